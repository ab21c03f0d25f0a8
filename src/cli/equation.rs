//! `abbe equation` and `abbe volumetric`: closed-form equations.

mod style;

use std::path::PathBuf;

use abbe::codegen::print::{Audience, LANGUAGES, OutputLanguage, Style, TestEquations, language};
use abbe::codegen::{Arrangement, Checked, Equation, Options, Order, SessionTest, Source, Symbols, ToolPoint, check};
use abbe::equation::EquationParameters;
use abbe::model::files::{self, ReadOptions, SourceMap};
use abbe::model::frames::Rotation;
use abbe::model::pattern;
use abbe::model::session::{Session, Test};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};

use self::style::StyleArguments;
use super::failure::Failure;
use super::folder;
use super::message::{Kind, tell};
use super::output::{self, Outputs};

/// Examples of `abbe equation`.
pub const HELP: &str = "Examples:
  abbe equation sessions/hermle-c600u/chapter5.toml --test A150 --as latex
  abbe equation sessions/hermle-c600u/chapter5.toml --test C150 --order first \\
      --errors EX0C,EY0C,bar
  abbe equation sessions/hermle-c600u/chapter5.toml --test A150 --rotation small-angle \\
      --form single --as latex --two-column --number last --nomenclature
  abbe equation sessions/hermle-c600u/chapter5.toml --test A100 --rotation small-angle \\
      --form single --symbols A,C
  abbe equation sessions/hermle-c600u/chapter5.toml --all --order first --as latex
  abbe equation sessions/hermle-c600u/chapter5.toml --test A150 --as python \\
      --gradient --out a150.py
  abbe equation sessions/hermle-c600u/chapter5.toml --all --as c --gradient --out readings";

/// Examples of `abbe volumetric`.
pub const VOLUMETRIC_HELP: &str = "Examples:
  abbe volumetric sessions/hermle-c600u/machine.toml --order first --errors EX0C,EY0C,EXX
  abbe volumetric sessions/hermle-c600u/machine.toml --errors EX0C,EB0A --rotation small-angle \\
      --as c --notation iso --gradient --out error.c
  abbe volumetric sessions/volumetric/machine.toml --map map.csv \\
      --functions sessions/volumetric/errors.toml --compensate
  abbe volumetric sessions/volumetric/machine.toml --map map2.csv \\
      --functions sessions/volumetric/errors.toml --places 3 --axis A=30 --axis X:5 \\
      --tool-mm 0,0,-120 --json map.json";

/// The words of the output languages, as the registry lists them.
fn languages() -> impl TypedValueParser<Value = &'static OutputLanguage> {
    PossibleValuesParser::new(LANGUAGES.iter().map(|language| language.word)).try_map(|word| language(&word))
}

#[derive(Clone, Copy, ValueEnum)]
enum OrderArgument {
    Exact,
    Bilinear,
    First,
}

#[derive(Clone, Copy, ValueEnum)]
enum RotationArgument {
    Exact,
    SmallAngle,
}

#[derive(Clone, Copy, ValueEnum)]
enum NotationArgument {
    Literature,
    Iso,
}

#[derive(Clone, Copy, ValueEnum)]
enum ArrangementArgument {
    Frames,
    Single,
    Groups,
}

/// The form of an equation.
#[derive(Args)]
struct FormArguments {
    /// The language of the equation.
    ///
    /// Example: --as latex
    #[arg(long = "as", value_parser = languages(), default_value = "text")]
    language: &'static OutputLanguage,
    /// Order in the errors: all terms, products of two errors, or one sensitivity coefficient per error.
    ///
    /// Example: --order first
    #[arg(long, value_enum, default_value = "exact")]
    order: OrderArgument,
    /// How the equation is divided, in text, LaTeX and Typst: frame by frame, one equation as in the literature, or
    /// coordinate groups.
    ///
    /// Example: --form single
    #[arg(long, value_enum, default_value = "frames")]
    form: ArrangementArgument,
    /// Rotation by error angles [default: as the machine file states].
    ///
    /// Example: --rotation small-angle
    #[arg(long, value_enum)]
    rotation: Option<RotationArgument>,
    /// Parameters in the equation, separated by commas; all others are zero. Errors (EX0C, e_x0c) or patterns of errors
    /// (E?0C); for a session also parameters of the instrument (bar, workpiece_ball.x) and declared effects (EZC~C:h2)
    /// [default: for a session its errors and declared effects, for a machine all errors].
    ///
    /// Example: --errors EX0C,EY0C,E?0A
    #[arg(long, value_delimiter = ',', value_name = "NAMES", allow_hyphen_values = true)]
    errors: Vec<String>,
    /// Symbols of the errors: e_y0a (literature) or EY0A (ISO 230-1).
    ///
    /// Example: --notation iso
    #[arg(long, value_enum, default_value = "literature")]
    notation: NotationArgument,
    /// Add the derivatives with respect to all parameters in the equation: in code for every order; in text, LaTeX and
    /// Typst for the exact length of a bar.
    #[arg(long)]
    gradient: bool,
    #[command(flatten)]
    style: StyleArguments,
    /// Write the equation to a file instead of standard output; with --all, code goes to a new folder.
    ///
    /// Example: --out equation.tex
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// `abbe equation SESSION --test T`
#[derive(Args)]
pub struct EquationArguments {
    #[command(flatten)]
    session: super::SessionArguments,
    /// Name of the test in the session. Its readings, if there are any, state only which axes move and how far.
    ///
    /// Example: --test A150
    #[arg(
        long,
        value_name = "NAME",
        required_unless_present = "all",
        conflicts_with = "all",
        allow_hyphen_values = true
    )]
    test: Option<String>,
    /// The equations of all tests: in text, LaTeX and Typst with the derivatives of their readings by the errors as a
    /// matrix; as code with a file for each test in the folder that --out names.
    #[arg(long)]
    all: bool,
    /// Axes that stay symbols where the test holds them, separated by commas; `none` for numbers [default: in code none,
    /// otherwise the rotary axes that are held at an angle that is no multiple of 90°].
    ///
    /// Example: --symbols A,C
    #[arg(long, value_delimiter = ',', value_name = "AXES")]
    symbols: Option<Vec<String>>,
    #[command(flatten)]
    form: FormArguments,
}

impl EquationArguments {
    /// The test with its symbols.
    fn source<'s>(&self, session: &'s Session, test: &'s Test) -> Result<SessionTest<'s>, Failure> {
        let source = SessionTest::new(session, test)?;
        let symbols: &[String] = match self.symbols.as_deref() {
            None if self.form.language.keeps_symbols() => return Ok(source),
            None => &[],
            Some([none]) if none == "none" => &[],
            Some(axes) => axes,
        };
        Ok(source.with_symbols(symbols)?)
    }
}

/// `abbe volumetric MACHINE`
#[derive(Args)]
pub struct VolumetricArguments {
    /// The machine file.
    machine: PathBuf,
    #[command(flatten)]
    form: FormArguments,
    #[command(flatten)]
    map: super::map::MapArguments,
}

impl FormArguments {
    fn options(&self, parameters: &EquationParameters) -> Options {
        Options {
            order: match self.order {
                OrderArgument::Exact => Order::Exact,
                OrderArgument::Bilinear => Order::Bilinear,
                OrderArgument::First => Order::First,
            },
            arrangement: match self.form {
                ArrangementArgument::Frames => Arrangement::Frames,
                ArrangementArgument::Single => Arrangement::Single,
                ArrangementArgument::Groups => Arrangement::Groups,
            },
            rotation: self.rotation.map(|rotation| match rotation {
                RotationArgument::Exact => Rotation::Exact,
                RotationArgument::SmallAngle => Rotation::SmallAngle,
            }),
            symbols: match self.notation {
                NotationArgument::Literature => Symbols::Literature,
                NotationArgument::Iso => Symbols::Iso,
            },
            gradient: self.gradient,
            unknowns: parameters.instrument.clone(),
            effects: parameters.effects.clone(),
        }
    }

    /// The equation of a test, as requested or in first order.
    fn of_test<'s>(
        &self,
        session: &'s Session,
        test: &'s Test,
        source: SessionTest<'s>,
        first: bool,
    ) -> Result<(Equation, SessionTest<'s>), Failure> {
        let parameters = EquationParameters::of_test(session, test, &self.errors)?;
        let mut options = self.options(&parameters);
        if first {
            options = Options { order: Order::First, gradient: false, ..options };
            options.arrangement = match options.arrangement {
                Arrangement::Groups => Arrangement::Single,
                other => other,
            };
        }
        Ok((Equation::of(&session.machine, &source, &parameters.errors, &options)?, source))
    }

    fn write(&self, equation: &Equation, source: &impl Source) -> Result<(), Failure> {
        self.put(&self.language.print(&check(equation, source)?, &self.style.style(self.language)?)?)
    }

    /// Writes a text to the requested file or to standard output.
    fn put(&self, text: &str) -> Result<(), Failure> {
        match &self.out {
            Some(path) => output::write_whole(path, text.as_bytes()),
            None => {
                output::whole(text.trim_end());
                Ok(())
            }
        }
    }
}

/// The session with its readings, or without them and with a note if they cannot be read.
fn read(arguments: &super::SessionArguments) -> Result<(Session, SourceMap), Failure> {
    let source = files::text(&arguments.session, "the session file")?;
    let fault = match files::session_of(&source, &arguments.options()) {
        Ok(found) => return Ok(found),
        Err(fault) => fault,
    };
    let plan_only = ReadOptions { read_data: false, ..arguments.options() };
    match files::session_of(&source, &plan_only) {
        Ok(found) => {
            tell(Kind::Note, &fault.to_string());
            tell(
                Kind::Note,
                "the equation is made without readings: in a test without a planned movement every axis moves that the test does not hold",
            );
            Ok(found)
        }
        Err(_) => Err(fault.into()),
    }
}

/// Runs `abbe equation`.
pub fn run(arguments: &EquationArguments) -> Result<(), Failure> {
    let form = &arguments.form;
    let all_code = arguments.all && matches!(form.language.audience, Audience::Compilers | Audience::Algebra);
    if all_code {
        return write_all_code(arguments);
    }
    let outputs = Outputs::new(&form.out)?;
    let (session, sources) = read(&arguments.session)?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    if let Some(name) = &arguments.test {
        let Some(test) = session.tests.iter().find(|test| test.name == *name) else {
            let names: Vec<&str> = session.tests.iter().map(|test| test.name.as_str()).collect();
            let names = names.join(", ");
            return Err(Failure::Other(format!("no test `{name}`; the session has {names}")));
        };
        let (equation, source) = form.of_test(&session, test, arguments.source(&session, test)?, false)?;
        return form.write(&equation, &source);
    }
    let style = form.style.style(form.language)?;
    let both = session.tests.iter().map(|test| {
        let of_test = |first: bool| form.of_test(&session, test, arguments.source(&session, test)?, first);
        Ok([of_test(false)?, of_test(true)?])
    });
    let both: Vec<[(Equation, SessionTest<'_>); 2]> = both.collect::<Result<_, Failure>>()?;
    let checked = |(equation, source)| -> Result<_, Failure> { Ok(check(equation, source)?) };
    let pairs = both.iter().map(|[whole, first]| Ok([checked((&whole.0, &whole.1))?, checked((&first.0, &first.1))?]));
    let pairs: Vec<[Checked<'_>; 2]> = pairs.collect::<Result<_, Failure>>()?;
    let tests: Vec<TestEquations<'_>> =
        pairs.iter().map(|[equation, first]| TestEquations { equation, first }).collect();
    form.put(&form.language.print_system(&tests, &style)?)
}

/// A file of code for each test, in a new folder.
fn write_all_code(arguments: &EquationArguments) -> Result<(), Failure> {
    let form = &arguments.form;
    let Some(out) = &form.out else {
        return Err(Failure::Other(format!(
            "`--all --as {}` writes a file for each test; name a new folder by --out",
            form.language.word
        )));
    };
    folder::check(out, None)?;
    let (session, _) = read(&arguments.session)?;
    let style = Style { name_of_test: true, ..form.style.style(form.language)? };
    let mut files: Vec<(String, String)> = Vec::new();
    for test in &session.tests {
        let (equation, source) = form.of_test(&session, test, arguments.source(&session, test)?, false)?;
        let name = form.language.file_name(&equation);
        if let Some((other, _)) = files.iter().find(|(other, _)| other.eq_ignore_ascii_case(&name)) {
            return Err(Failure::Other(format!(
                "test \"{}\" would be written to {name}, and another test is written to {other}; rename one of them",
                test.name
            )));
        }
        files.push((name, form.language.print(&check(&equation, &source)?, &style)?));
    }
    folder::write(out, &files, false, |_| Ok(()))
}

/// Runs `abbe volumetric`.
pub fn run_volumetric(arguments: &VolumetricArguments, quiet: bool) -> Result<(), Failure> {
    let source = files::text(&arguments.machine, "the machine file")?;
    let machine = files::machine_of(&source)?;
    let outputs = Outputs::new(arguments.form.out.iter().chain(arguments.map.outputs()))?;
    let read = std::iter::once(&arguments.machine).chain(arguments.map.functions());
    outputs.refuse_overwrite(read.map(PathBuf::as_path))?;
    if arguments.map.wanted() {
        return super::map::run(&source, &machine, &arguments.map, outputs.tables(quiet));
    }
    let form = &arguments.form;
    let mut parameters = EquationParameters::parse(&form.errors, &machine, &[], &[])?;
    if form.errors.is_empty() {
        parameters.errors = pattern::errors(&machine);
    }
    let equation = Equation::volumetric(&machine, &parameters.errors, &form.options(&parameters))?;
    form.write(&equation, &ToolPoint)
}
