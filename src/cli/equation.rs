//! `abbe equation`: closed-form equations of tests.

use std::path::PathBuf;

use abbe::codegen::print::{
    AngleUnit, Audience, LANGUAGES, Layout, Numbering, OutputLanguage, Style, TestEquations, language,
};
use abbe::codegen::{Arrangement, Checked, Equation, Options, Order, SessionTest, Source, Symbols, check};
use abbe::equation::{self, EquationParameters};
use abbe::files::{SourceMap, text};
use abbe::model::Diagnostic;
use abbe::model::frames::Rotation;
use abbe::model::session::{Session, Test};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::message::{Kind, tell};
use super::output::{self, Outputs};
use super::values::{self, Words};
use super::{Global, folder};

/// Examples of `abbe equation`.
pub const HELP: &str = include_str!("help/equation.txt");

/// `abbe equation SESSION --test T`
#[derive(Args)]
pub struct EquationArguments {
    #[command(flatten)]
    session: super::SessionArguments,
    /// Name of a test of the session. Its readings, if there are any, state only which axes move and how far.
    ///
    /// Example: --test A150
    #[arg(
        long,
        value_name = "NAME",
        required_unless_present = "all_tests",
        conflicts_with = "all_tests",
        allow_hyphen_values = true
    )]
    test: Option<String>,
    /// The equations of all tests: in text, LaTeX and Typst with the derivatives of their readings by the errors as a
    /// matrix; as code with a file for each test in the folder that --out names.
    #[arg(long)]
    all_tests: bool,
    /// Axes that stay symbols where the test holds them, separated by commas; `none` for numbers [default: in code none,
    /// otherwise the rotary axes that are held at an angle that is no multiple of 90°].
    ///
    /// Example: --symbols A,C
    #[arg(long, value_delimiter = ',', value_name = "AXES")]
    symbols: Option<Vec<String>>,
    #[command(flatten)]
    form: FormArguments,
    #[command(flatten)]
    folder: super::ForceArguments,
}

impl EquationArguments {
    /// The test with its symbols.
    fn source<'s>(&self, session: &'s Session, test: &'s Test) -> Result<SessionTest<'s>, Diagnostic> {
        let source = SessionTest::new(session, test)?;
        let symbols: &[String] = match self.symbols.as_deref() {
            None if self.form.language.keeps_symbols() => return Ok(source),
            None => &[],
            Some([none]) if none == "none" => &[],
            Some(axes) => axes,
        };
        source.with_symbols(symbols)
    }
}

/// The session with its readings, or without them and with a note if they cannot be read.
fn read(arguments: &super::SessionArguments) -> Result<(Session, SourceMap), Diagnostic> {
    let source = text(&arguments.session, "the session file")?;
    let (session, sources, fault) = equation::session(&source, &arguments.options())?;
    if let Some(fault) = fault {
        tell(Kind::Note, &fault.to_string());
        tell(Kind::Note, equation::WITHOUT_READINGS);
    }
    Ok((session, sources))
}

/// Runs `abbe equation`.
pub fn run(arguments: &EquationArguments, _: Global) -> Result<(), Diagnostic> {
    let form = &arguments.form;
    if arguments.all_tests && matches!(form.language.audience, Audience::Compilers | Audience::Algebra) {
        return write(arguments);
    }
    let outputs = Outputs::new(&form.out)?;
    let (session, sources) = read(&arguments.session)?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    if let Some(name) = &arguments.test {
        let test = equation::test(&session, name)?;
        let (equation, source) = form.of_test(&session, test, arguments.source(&session, test)?, false)?;
        return form.write(&equation, &source);
    }
    let of = |test, first: bool| form.of_test(&session, test, arguments.source(&session, test)?, first);
    let both = session.tests.iter().map(|test| Ok([of(test, false)?, of(test, true)?]));
    let both: Vec<[(Equation, SessionTest<'_>); 2]> = both.collect::<Result<_, Diagnostic>>()?;
    let pairs = both.iter().map(|[whole, first]| Ok([check(&whole.0, &whole.1)?, check(&first.0, &first.1)?]));
    let pairs: Vec<[Checked<'_>; 2]> = pairs.collect::<Result<_, Diagnostic>>()?;
    let tests: Vec<TestEquations<'_>> =
        pairs.iter().map(|[equation, first]| TestEquations { equation, first }).collect();
    form.put(&form.language.print_system(&tests, &form.style.style(form.language)?)?)
}

/// A file of code for each test, in a new folder.
pub fn write(arguments: &EquationArguments) -> Result<(), Diagnostic> {
    let form = &arguments.form;
    let Some(out) = &form.out else {
        return Err(Diagnostic::other(format!(
            "`--all-tests --as {}` writes a file for each test; name a new folder by --out",
            form.language.word
        )));
    };
    folder::check(out, arguments.folder.force)?;
    let (session, _) = read(&arguments.session)?;
    let style = Style { name_of_test: true, ..form.style.style(form.language)? };
    let file = |test: &Test| -> Result<_, Diagnostic> {
        let (equation, source) = form.of_test(&session, test, arguments.source(&session, test)?, false)?;
        Ok((form.language.file_name(&equation), form.language.print(&check(&equation, &source)?, &style)?))
    };
    let files: Vec<(String, String)> = session.tests.iter().map(file).collect::<Result<_, Diagnostic>>()?;
    equation::refuse_equal_names(&session, &files)?;
    folder::write(out, &files, arguments.folder.force, |_| Ok(()))
}

const NUMBERINGS: Words<Numbering> = &[("none", Numbering::None), ("last", Numbering::Last), ("all", Numbering::All)];
const LAYOUTS: Words<Layout> = &[("named", Layout::Named), ("flat", Layout::Flat)];
const ANGLES: Words<AngleUnit> = &[("rad", AngleUnit::Radian), ("deg", AngleUnit::Degree)];

/// How an equation is set.
#[derive(Args)]
pub struct StyleArguments {
    /// LaTeX, Typst: equations with a number and a label, such as `eq:ldbb-C150` [default: none].
    ///
    /// Example: --number last
    #[arg(long, value_parser = values::words(NUMBERINGS))]
    number: Option<Numbering>,
    /// LaTeX, Typst: width of a line, as 84mm; longer equations are broken [default: a column of an article].
    ///
    /// Example: --width 84mm
    #[arg(long, value_name = "LENGTH", value_parser = width_mm)]
    width: Option<f64>,
    /// Set for two columns: in LaTeX and Typst lines are broken as with --width 84mm.
    #[arg(long, conflicts_with = "width")]
    two_column: bool,
    /// LaTeX, Typst: add a table of all symbols.
    #[arg(long)]
    nomenclature: bool,
    /// Code: named arguments, errors with the default 0; or three arrays, with sines and cosines, for kernels [default:
    /// named].
    ///
    /// Example: --layout flat
    #[arg(long, value_parser = values::words(LAYOUTS))]
    layout: Option<Layout>,
    /// Code with named arguments: unit of the positions of rotary axes [default: rad].
    ///
    /// Example: --angles deg
    #[arg(long, value_parser = values::words(ANGLES))]
    angles: Option<AngleUnit>,
}

/// Width of a line for two columns, mm.
const TWO_COLUMN_MM: f64 = 84.0;

/// Reads a width such as `84mm`, in mm.
fn width_mm(text: &str) -> Result<f64, String> {
    let units = [("mm", 1.0), ("cm", 10.0), ("in", 25.4), ("pt", 25.4 / 72.27)];
    let unit = units.iter().find_map(|(unit, mm)| Some((text.strip_suffix(unit)?, mm)));
    let (number, mm) = unit.ok_or("a length with its unit mm, cm, in or pt is expected, for example 84mm")?;
    let width = number.trim().parse::<f64>().map_err(|_| format!("`{number}` is not a number"))? * mm;
    if (40.0..=1000.0).contains(&width) { Ok(width) } else { Err("a line is 40 mm to 1000 mm wide".to_string()) }
}

impl StyleArguments {
    /// Refuses options that the language ignores.
    pub fn style(&self, language: &OutputLanguage) -> Result<Style, Diagnostic> {
        let typeset = [
            ("--number", self.number.is_some()),
            ("--width", self.width.is_some()),
            ("--two-column", self.two_column),
            ("--nomenclature", self.nomenclature),
        ];
        let groups: [(&[Audience], &[(&str, bool)]); 3] = [
            (&[Audience::Authors], &typeset),
            (&[Audience::Compilers], &[("--layout", self.layout.is_some())]),
            (&[Audience::Compilers, Audience::Algebra], &[("--angles", self.angles.is_some())]),
        ];
        for (audience, options) in groups {
            if let (true, Some((option, _))) =
                (!audience.contains(&language.audience), options.iter().find(|(_, set)| *set))
            {
                let known: Vec<&str> =
                    LANGUAGES.iter().filter(|l| audience.contains(&l.audience)).map(|l| l.word).collect();
                let message = format!(
                    "`{option}` does not apply to `--as {}`; it applies to {}",
                    language.word,
                    known.join(", ")
                );
                return Err(Diagnostic::other(message));
            }
        }
        if matches!((self.layout, self.angles), (Some(Layout::Flat), Some(_))) {
            let message = "`--angles` does not apply to `--layout flat`, whose arguments are sines and cosines";
            return Err(Diagnostic::other(message.to_string()));
        }
        Ok(Style {
            numbering: self.number.unwrap_or(Numbering::None),
            width_mm: self.two_column.then_some(TWO_COLUMN_MM).or(self.width),
            nomenclature: self.nomenclature,
            layout: self.layout.unwrap_or(Layout::Named),
            angles: self.angles.unwrap_or(AngleUnit::Radian),
            name_of_test: false,
        })
    }
}

/// The words of the output languages, as the registry lists them.
fn languages() -> impl TypedValueParser<Value = &'static OutputLanguage> {
    PossibleValuesParser::new(LANGUAGES.iter().map(|language| language.word)).try_map(|word| language(&word))
}

const ORDERS: Words<Order> = &[("exact", Order::Exact), ("bilinear", Order::Bilinear), ("first", Order::First)];
const ROTATIONS: Words<Rotation> = &[("exact", Rotation::Exact), ("small-angle", Rotation::SmallAngle)];
const NOTATIONS: Words<Symbols> = &[("literature", Symbols::Literature), ("iso", Symbols::Iso)];
const FORMS: Words<Arrangement> =
    &[("frames", Arrangement::Frames), ("single", Arrangement::Single), ("groups", Arrangement::Groups)];

/// The form of an equation.
#[derive(Args)]
pub struct FormArguments {
    /// The format of the output.
    ///
    /// Example: --as latex
    #[arg(long = "as", value_parser = languages(), value_name = "FORMAT", default_value = "text")]
    pub language: &'static OutputLanguage,
    /// Order in the errors: all terms, products of two errors, or one sensitivity coefficient per error.
    ///
    /// Example: --order first
    #[arg(long, value_parser = values::words(ORDERS), default_value = "exact")]
    order: Order,
    /// How the equation is divided, in text, LaTeX and Typst: frame by frame, one equation as in the literature, or
    /// coordinate groups.
    ///
    /// Example: --form single
    #[arg(long, value_parser = values::words(FORMS), default_value = "frames")]
    form: Arrangement,
    /// Rotation by error angles [default: as the machine file states].
    ///
    /// Example: --rotation small-angle
    #[arg(long, value_parser = values::words(ROTATIONS))]
    rotation: Option<Rotation>,
    /// Parameters in the equation, separated by commas; all others are zero. Errors (EX0C, e_x0c) or patterns of errors
    /// (E?0C); for a session also parameters of the instrument (bar, workpiece_ball.x) and declared effects (EZC~C:h2)
    /// [default: for a session its errors and declared effects, for a machine all errors].
    ///
    /// Example: --errors EX0C,EY0C,E?0A
    #[arg(long, value_delimiter = ',', value_name = "NAMES", allow_hyphen_values = true)]
    pub errors: Vec<String>,
    /// Symbols of the errors: e_y0a (literature) or EY0A (ISO 230-1).
    ///
    /// Example: --notation iso
    #[arg(long, value_parser = values::words(NOTATIONS), default_value = "literature")]
    notation: Symbols,
    /// Add the derivatives with respect to all parameters in the equation: in code for every order; in text, LaTeX and
    /// Typst for the exact length of a bar.
    #[arg(long)]
    gradient: bool,
    #[command(flatten)]
    pub style: StyleArguments,
    /// Where the result is written: a file [default: standard output]; for code of all tests a new folder.
    ///
    /// Example: --out equation.tex
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

impl FormArguments {
    /// Options of the library.
    pub fn options(&self, parameters: &EquationParameters) -> Options {
        Options {
            order: self.order,
            arrangement: self.form,
            rotation: self.rotation,
            symbols: self.notation,
            gradient: self.gradient,
            unknowns: parameters.instrument.clone(),
            effects: parameters.effects.clone(),
        }
    }

    /// The equation of a test, as requested or in first order.
    pub fn of_test<'s>(
        &self,
        session: &'s Session,
        test: &'s Test,
        source: SessionTest<'s>,
        first: bool,
    ) -> Result<(Equation, SessionTest<'s>), Diagnostic> {
        let parameters = EquationParameters::of_test(session, test, &self.errors)?;
        let whole = self.options(&parameters);
        let options = if first { whole.in_first_order() } else { whole };
        Ok((Equation::of(&session.machine, &source, &parameters.errors, &options)?, source))
    }

    /// Writes a checked equation.
    pub fn write(&self, equation: &Equation, source: &impl Source) -> Result<(), Diagnostic> {
        self.put(&self.language.print(&check(equation, source)?, &self.style.style(self.language)?)?)
    }

    /// Writes a text to the requested file or to standard output.
    pub fn put(&self, text: &str) -> Result<(), Diagnostic> {
        if let Some(path) = &self.out {
            return output::write_whole(path, text.as_bytes());
        }
        output::whole(text.trim_end());
        Ok(())
    }
}
