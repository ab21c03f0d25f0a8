//! `abbe equation`: closed-form equations of tests.

mod files;
pub mod form;
mod style;

use abbe::codegen::print::{Audience, TestEquations};
use abbe::codegen::{Checked, Equation, SessionTest, check};
use abbe::equation;
use abbe::files::{SourceMap, text};
use abbe::model::Diagnostic;
use abbe::model::session::{Session, Test};
use clap::Args;

use self::form::FormArguments;
use super::Global;
use super::message::{Kind, tell};
use super::output::Outputs;

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
        return files::write(arguments);
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
