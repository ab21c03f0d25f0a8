//! The form of an equation: language, order, symbols, arrangement.

use std::path::PathBuf;

use abbe::codegen::print::{LANGUAGES, OutputLanguage, language};
use abbe::codegen::{Arrangement, Equation, Options, Order, SessionTest, Source, Symbols, check};
use abbe::equation::EquationParameters;
use abbe::model::Diagnostic;
use abbe::model::frames::Rotation;
use abbe::model::session::{Session, Test};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::style::StyleArguments;
use crate::cli::output;
use crate::cli::values::{self, Words};

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
