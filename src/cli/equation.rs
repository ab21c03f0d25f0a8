//! `abbe equation` and `abbe volumetric`.

use std::path::PathBuf;

use abbe::codegen::{Equation, Language, Options, Order, SessionTest, Symbols};
use abbe::model::component::{ErrorKind, ErrorName, Freedom};
use abbe::model::frames::Rotation;
use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::output;

/// The language of an equation.
#[derive(Clone, Copy, ValueEnum)]
enum As {
    Text,
    Latex,
    Typst,
    Rust,
    C,
    Python,
    Matlab,
}

impl As {
    fn language(self) -> Language {
        match self {
            As::Text => Language::Text,
            As::Latex => Language::Latex,
            As::Typst => Language::Typst,
            As::Rust => Language::Rust,
            As::C => Language::C,
            As::Python => Language::Python,
            As::Matlab => Language::Matlab,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum OrderWord {
    Exact,
    Bilinear,
    First,
}

#[derive(Clone, Copy, ValueEnum)]
enum RotationWord {
    Exact,
    SmallAngle,
}

#[derive(Clone, Copy, ValueEnum)]
enum SymbolsWord {
    Literature,
    Iso,
}

/// The form of an equation.
#[derive(Args)]
struct FormArguments {
    /// The language.
    #[arg(long = "as", value_enum, default_value = "text")]
    language: As,
    /// How far it goes in the errors.
    #[arg(long, value_enum, default_value = "exact")]
    order: OrderWord,
    /// How error angles rotate; the machine's own way if not given.
    #[arg(long, value_enum)]
    rotation: Option<RotationWord>,
    /// Errors to keep, by name and separated by commas.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    errors: Vec<String>,
    /// Which names errors go by.
    #[arg(long, value_enum, default_value = "literature")]
    symbols: SymbolsWord,
    /// Add the derivatives by every error to code.
    #[arg(long)]
    gradient: bool,
    /// Write to a file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// `abbe equation SESSION --test T`
#[derive(Args)]
pub struct EquationArguments {
    /// The session file; its readings are not needed.
    session: PathBuf,
    /// The test.
    #[arg(long, value_name = "NAME")]
    test: String,
    #[command(flatten)]
    form: FormArguments,
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
    fn options(&self) -> Options {
        Options {
            order: match self.order {
                OrderWord::Exact => Order::Exact,
                OrderWord::Bilinear => Order::Bilinear,
                OrderWord::First => Order::First,
            },
            rotation: self.rotation.map(|rotation| match rotation {
                RotationWord::Exact => Rotation::Exact,
                RotationWord::SmallAngle => Rotation::SmallAngle,
            }),
            symbols: match self.symbols {
                SymbolsWord::Literature => Symbols::Literature,
                SymbolsWord::Iso => Symbols::Iso,
            },
            gradient: self.gradient,
            unknowns: Vec::new(),
        }
    }

    /// The errors that were asked for, or those given.
    fn errors(&self, otherwise: Vec<ErrorName>) -> Result<Vec<ErrorName>, Failure> {
        if self.errors.is_empty() {
            return Ok(otherwise);
        }
        let read = |text: &String| {
            let help =
                "errors go by ISO 230-1 names, as EX0C or EZC, or by those of the literature, as e_x0c";
            ErrorName::parse(text).ok_or_else(|| Failure::Other(format!("`{text}` is no error; {help}")))
        };
        self.errors.iter().map(read).collect()
    }

    fn write(&self, equation: &Equation) -> Result<(), Failure> {
        let text = equation.print(self.language.language())?;
        match &self.out {
            Some(path) => output::write_whole(path, text.as_bytes()),
            None => {
                say!("{}", text.trim_end());
                Ok(())
            }
        }
    }
}

/// Runs `abbe equation`.
pub fn run(arguments: &EquationArguments) -> Result<(), Failure> {
    let options = abbe::model::session::read::ReadOptions {
        data_directory: None,
        read_data: false,
    };
    let session = abbe::model::session::read::session(&arguments.session, &options)?;
    let Some(test) = session.tests.iter().find(|test| test.name == arguments.test) else {
        let names: Vec<&str> = session.tests.iter().map(|test| test.name.as_str()).collect();
        let names = names.join(", ");
        return Err(Failure::Other(format!(
            "no test `{}`; the session has {names}",
            arguments.test
        )));
    };
    let source = SessionTest::new(&session, test)?;
    let errors = arguments.form.errors(session.unknowns.clone())?;
    let equation = Equation::of(&session.machine, &source, &errors, &arguments.form.options())?;
    arguments.form.write(&equation)
}

/// Runs `abbe volumetric`.
pub fn run_volumetric(arguments: &VolumetricArguments) -> Result<(), Failure> {
    let machine = abbe::model::session::read::machine(&arguments.machine)?;
    if arguments.map.wanted() {
        return super::map::run(&machine, &arguments.map);
    }
    // Every error motion and location error that the chain applies.
    let all = machine
        .axes
        .iter()
        .flat_map(|axis| {
            let rotary = axis.kind == abbe::model::axis::AxisKind::Rotary;
            [ErrorKind::Location, ErrorKind::Motion]
                .into_iter()
                .flat_map(move |kind| {
                    Freedom::ALL
                        .into_iter()
                        .filter(move |freedom| kind == ErrorKind::Motion || rotary || freedom.is_angle())
                        .map(move |freedom| ErrorName {
                            kind,
                            freedom,
                            axis: axis.name.clone(),
                        })
                })
        })
        .collect();
    let errors = arguments.form.errors(all)?;
    let equation = Equation::volumetric(&machine, &errors, &arguments.form.options())?;
    arguments.form.write(&equation)
}
