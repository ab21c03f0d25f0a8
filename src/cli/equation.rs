//! `abbe equation` and `abbe volumetric`.

use std::path::PathBuf;

use abbe::codegen::{Equation, Language, Options, Order, SessionTest, Symbols, Variable};
use abbe::model::chain::Machine;
use abbe::model::component::ErrorName;
use abbe::model::effect::{Component, Effect};
use abbe::model::files::{self, ReadOptions, SourceMap};
use abbe::model::frames::Rotation;
use abbe::model::instrument::InstrumentParameter;
use abbe::model::pattern;
use abbe::model::session::Session;
use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::message::{Kind, tell};
use super::output::{self, Outputs};

/// The language of an equation.
#[derive(Clone, Copy, ValueEnum)]
enum OutputForm {
    Text,
    Latex,
    Typst,
    Rust,
    C,
    Python,
    Matlab,
}

impl OutputForm {
    fn language(self) -> Language {
        match self {
            OutputForm::Text => Language::Text,
            OutputForm::Latex => Language::Latex,
            OutputForm::Typst => Language::Typst,
            OutputForm::Rust => Language::Rust,
            OutputForm::C => Language::C,
            OutputForm::Python => Language::Python,
            OutputForm::Matlab => Language::Matlab,
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
    language: OutputForm,
    /// How far it goes in the errors: all terms, products of two, or a coefficient for each.
    #[arg(long, value_enum, default_value = "exact")]
    order: OrderWord,
    /// How error angles rotate; the machine's own way if not given.
    #[arg(long, value_enum)]
    rotation: Option<RotationWord>,
    /// What to keep, by name and separated by commas; what is not named is zero. Errors as EX0C or e_x0c or by a pattern as E?0C, of a session also unknowns of the
    /// instrument, as bar or workpiece_ball.x, and effects that it declares, as EZC~C:h2. Without it a session's unknown errors and declared
    /// effects, of a machine all errors.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    errors: Vec<String>,
    /// Which names errors go by in print: e_y0a, or EY0A of ISO 230-1.
    #[arg(long, value_enum, default_value = "literature")]
    symbols: SymbolsWord,
    /// Add the derivatives by everything that is kept: to code of any form, in text, LaTeX and Typst to the exact length of a bar.
    #[arg(long)]
    gradient: bool,
    /// Write to a file, whole or not at all.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// `abbe equation SESSION --test T`
#[derive(Args)]
pub struct EquationArguments {
    #[command(flatten)]
    session: super::SessionArguments,
    /// The test, by its name in the session. Its readings, if there are any, only say which axes move and how far.
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

/// What an equation is written in.
#[derive(Default)]
struct Kept {
    errors: Vec<ErrorName>,
    /// Places in the instrument's list of unknowns.
    unknowns: Vec<usize>,
    effects: Vec<Effect>,
}

impl Kept {
    /// Reads names of errors, also as patterns, of the instrument's unknowns and of effects.
    fn parse(
        names: &[String],
        machine: &Machine,
        known: &[InstrumentParameter],
        effects: &[Effect],
    ) -> Result<Kept, Failure> {
        let mut kept = Kept::default();
        for name in names {
            if pattern::is_pattern(name) {
                let found = pattern::matching(machine, name);
                if found.is_empty() {
                    return Err(Failure::Other(format!(
                        "`{name}` matches no error of the machine; `?` stands for one character, `*` for any number of them"
                    )));
                }
                for error in found {
                    if !kept.errors.contains(&error) {
                        kept.errors.push(error);
                    }
                }
                continue;
            }
            if name.contains('~') {
                kept.effects.extend(named(name, effects)?);
                continue;
            }
            match Component::parse(name) {
                Some(Component::Axis(error)) => kept.errors.push(error),
                Some(Component::Instrument { thing, coordinate }) => {
                    let place = known
                        .iter()
                        .position(|u| u.thing == thing && u.coordinate == coordinate);
                    let unknown = |u: &InstrumentParameter| Variable::Instrument(*u).name();
                    kept.unknowns.push(place.ok_or_else(|| {
                        let has = match known {
                            [] => "an error vector has none of an instrument".to_string(),
                            known => format!(
                                "this one has {}",
                                known.iter().map(unknown).collect::<Vec<_>>().join(", ")
                            ),
                        };
                        Failure::Other(format!("`{name}` is an unknown of another instrument; {has}"))
                    })?);
                }
                Some(Component::TriggerDelay) | None => {
                    return Err(Failure::Other(format!(
                        "`{name}` is no error that an equation can keep; errors go by ISO 230-1 names, as EX0C or EZC, or by those of the literature, as e_x0c"
                    )));
                }
            }
        }
        Ok(kept)
    }
}

/// The declared effects of a name such as `EZC~C:h2`; those that differ in their numbers alone share one.
fn named(name: &str, effects: &[Effect]) -> Result<Vec<Effect>, Failure> {
    let found: Vec<Effect> = effects
        .iter()
        .filter(|effect| effect.id() == name)
        .cloned()
        .collect();
    if found.is_empty() {
        let declared: Vec<String> = effects.iter().map(Effect::id).collect();
        let has = match declared.as_slice() {
            [] => "no effect that is declared acts here".to_string(),
            declared => format!("declared here: {}", declared.join(", ")),
        };
        return Err(Failure::Other(format!("no effect is called `{name}`; {has}")));
    }
    Ok(found)
}

impl FormArguments {
    fn options(&self, kept: &Kept) -> Options {
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
            unknowns: kept.unknowns.clone(),
            effects: kept.effects.clone(),
        }
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

/// The session with its readings; without them where they cannot be read, which is said.
fn read(arguments: &super::SessionArguments) -> Result<(Session, SourceMap), Failure> {
    let fault = match files::session_with_sources(&arguments.session, &arguments.options()) {
        Ok(found) => return Ok(found),
        Err(fault) => fault,
    };
    let plan_only = ReadOptions {
        read_data: false,
        ..arguments.options()
    };
    match files::session_with_sources(&arguments.session, &plan_only) {
        Ok(found) => {
            tell(Kind::Note, &fault.to_string());
            tell(
                Kind::Note,
                "the equation does without readings; of a test without a planned movement every axis that it does not hold is taken to move",
            );
            Ok(found)
        }
        Err(_) => Err(fault.into()),
    }
}

/// Runs `abbe equation`.
pub fn run(arguments: &EquationArguments) -> Result<(), Failure> {
    let outputs = Outputs::new(&arguments.form.out)?;
    let (session, sources) = read(&arguments.session)?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    let Some(test) = session.tests.iter().find(|test| test.name == arguments.test) else {
        let names: Vec<&str> = session.tests.iter().map(|test| test.name.as_str()).collect();
        let names = names.join(", ");
        return Err(Failure::Other(format!(
            "no test `{}`; the session has {names}",
            arguments.test
        )));
    };
    let source = SessionTest::new(&session, test)?;
    let form = &arguments.form;
    let effects: Vec<Effect> = session
        .effects
        .iter()
        .filter(|effect| effect.acts_in(&test.name))
        .cloned()
        .collect();
    let mut kept = Kept::parse(
        &form.errors,
        &session.machine,
        session.instrument.unknowns(),
        &effects,
    )?;
    if form.errors.is_empty() {
        kept.errors.clone_from(&session.unknowns);
        kept.effects = effects;
    }
    let equation = Equation::of(&session.machine, &source, &kept.errors, &form.options(&kept))?;
    form.write(&equation)
}

/// Runs `abbe volumetric`.
pub fn run_volumetric(arguments: &VolumetricArguments, quiet: bool) -> Result<(), Failure> {
    let machine = files::machine(&arguments.machine)?;
    let outputs = Outputs::new(arguments.form.out.iter().chain(arguments.map.outputs()))?;
    let read = std::iter::once(&arguments.machine).chain(arguments.map.functions());
    outputs.refuse_overwrite(read.map(PathBuf::as_path))?;
    if arguments.map.wanted() {
        return super::map::run(&machine, &arguments.map, outputs.tables(quiet));
    }
    let form = &arguments.form;
    let mut kept = Kept::parse(&form.errors, &machine, &[], &[])?;
    if form.errors.is_empty() {
        kept.errors = pattern::errors(&machine);
    }
    let equation = Equation::volumetric(&machine, &kept.errors, &form.options(&kept))?;
    form.write(&equation)
}
