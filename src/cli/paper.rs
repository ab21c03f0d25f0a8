//! `abbe paper`: text, tables and figures of sessions for LaTeX and Typst.

use std::path::{Path, PathBuf};

use abbe::identify::fit::SessionFit;
use abbe::identify::plan::bias::{bias_table, usual_effects};
use abbe::identify::plan::structure::structure;
use abbe::identify::plan::{self, PlanOptions};
use abbe::identify::problem::Problem;
use abbe::model::effect::Effect;
use abbe::model::files::{self, SourceMap};
use abbe::model::words::counted;
use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::message::print_warnings;
use super::{SessionArguments, folder, output};
use crate::printers::paper::layout::{Class, Layout};
use crate::report::paper::contents::{self, Study};
use crate::report::paper::{self, Section, comparison, methods};
use crate::report::provenance::Provenance;

/// Examples of `abbe paper`.
pub const HELP: &str = "Examples:
  abbe paper sessions/hermle-c600u/chapter5.toml --out paper
  abbe paper sessions/hermle-c600u/measured/session.toml --out ieee --two-column --class ieeetran
  abbe paper sessions/hermle-c600u/chapter4.toml sessions/hermle-c600u/chapter5.toml \\
      sessions/hermle-c600u/chapter6.toml --out comparison
  abbe paper sessions/r-test/plan.toml --out bias --parts identifiability,bias --effects EZC~C:h2

The folder has main.tex and main.typ, sections/, tables/ (LaTeX, Typst, CSV), figures/ (PDF, SVG, data as CSV), refs.bib, \
and README.md with the commands. Of several sessions the first one is shown in full, and all are compared.";

/// The parts of a paper, in their order.
const PARTS: [&str; 9] = [
    "methods",
    "set-up",
    "sensitivity",
    "uncertainty",
    "correlation",
    "identifiability",
    "bias",
    "comparison",
    "trace",
];
/// Effects of the bias table where none are named.
const BIASING_EFFECTS: usize = 12;

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum ClassArgument {
    Elsarticle,
    Ieeetran,
}

/// `abbe paper SESSION…`
#[derive(Args)]
pub struct PaperArguments {
    /// The session files: plans or measured sessions.
    #[arg(required = true)]
    sessions: Vec<PathBuf>,
    /// The folder to write; new or empty.
    ///
    /// Example: --out paper
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace files with the same names in the folder.
    #[arg(long)]
    force: bool,
    /// The parts to write, separated by commas [default: all that the sessions have].
    ///
    /// Example: --parts identifiability,bias
    #[arg(long, value_name = "PART,…", value_delimiter = ',', value_parser = PossibleValuesParser::new(PARTS))]
    parts: Vec<String>,
    /// Class of main.tex.
    ///
    /// Example: --class ieeetran
    #[arg(long, value_enum, default_value = "elsarticle")]
    class: ClassArgument,
    /// Two columns.
    #[arg(long)]
    two_column: bool,
    /// Undeclared effects of the bias table, by their identifiers [default: of location errors that are not estimated
    /// and harmonics of orders 1 and 2 of error motions, those with the largest bias].
    ///
    /// Example: --effects EZC~C:h2,EAC~C:h1
    #[arg(long, value_name = "EFFECT,…", value_delimiter = ',', allow_hyphen_values = true)]
    effects: Vec<String>,
    /// Folder of the data files, if they do not lie beside the session files.
    ///
    /// Example: --data measurements
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Allow the sessions to read files outside their own folders and the folder of --data.
    #[arg(long)]
    allow_outside: bool,
    /// Seed of the folds of a fit.
    ///
    /// Example: --seed 7
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Runs `abbe paper`.
pub fn run(arguments: &PaperArguments, quiet: bool) -> Result<(), Failure> {
    folder::check(&arguments.out, Some(arguments.force))?;
    let mut studies = Vec::new();
    let mut origins = Vec::new();
    for (place, path) in arguments.sessions.iter().enumerate() {
        if arguments.sessions[..place].iter().any(|earlier| output::is_same(earlier, path)) {
            return Err(Failure::Other(format!("{} is named twice; name each session once", path.display())));
        }
        let read = SessionArguments {
            session: path.clone(),
            data: arguments.data.clone(),
            allow_outside: arguments.allow_outside,
        };
        let (session, sources) = files::session_with_sources(path, &read.options())?;
        let study = study(arguments, label(&arguments.sessions, path), &session)?;
        let warnings: Vec<String> =
            study.analysis.warnings.iter().map(|warning| format!("{}: {warning}", path.display())).collect();
        print_warnings(&warnings);
        origins.push((session, sources));
        studies.push(study);
    }
    let sections = sections(arguments, &studies)?;
    let class = match arguments.class {
        ClassArgument::Elsarticle => Class::Elsarticle,
        ClassArgument::Ieeetran => Class::Ieeetran,
    };
    let layout = Layout { class, two_column: arguments.two_column };
    let machine = &studies[0].problem.session.machine;
    let title = format!("Geometric errors of the {}: tests, identifiability and uncertainty", machine.name);
    let summary = format!(
        "Generated by Abbe {} from {}. Every number follows from the session files.",
        env!("CARGO_PKG_VERSION"),
        counted(studies.len(), "session"),
    );
    let mut files = crate::printers::paper::files(&title, &summary, &sections, layout).map_err(Failure::Other)?;
    files.push(("README.md".into(), readme(arguments, &origins, &sections)?.into_bytes()));
    folder::write(&arguments.out, &files, arguments.force, |_| Ok(()))?;
    if !quiet {
        let names: Vec<&str> = sections.iter().map(|section| section.name).collect();
        say!("{}: {} in {}", arguments.out.display(), counted(files.len(), "file"), counted(names.len(), "section"));
        say!("  {}", names.join(", "));
        say!("typeset: pdflatex main, bibtex main, pdflatex main (three times); or typst compile main.typ");
    }
    Ok(())
}

/// The name of a session in tables: that of its file, or of its folder if several have the same name.
fn label(sessions: &[PathBuf], path: &Path) -> String {
    let stem = |path: &Path| path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let own = stem(path);
    if sessions.iter().filter(|other| stem(other) == own).count() == 1 {
        return own;
    }
    path.with_extension("").display().to_string()
}

fn study(arguments: &PaperArguments, label: String, session: &abbe::model::session::Session) -> Result<Study, Failure> {
    let options = PlanOptions { effects: false, ..PlanOptions::default() };
    let analysis = plan::analyse(session, &options)?;
    let (complete, noise) = plan::prepared(session, &options)?;
    let problem = plan::states::problem_by_test(&complete, noise)?;
    let bias = if arguments.effects.is_empty() {
        bias_table(&problem, &usual_effects(&problem)?)?.largest(BIASING_EFFECTS)
    } else {
        bias_table(&problem, &named(&problem, &arguments.effects)?)?
    };
    let structure = structure(&problem)?;
    let measured = session.tests.iter().all(|test| test.readings.is_some());
    let fitted = if measured { Some(SessionFit::of(session, arguments.seed)?) } else { None };
    Ok(Study { label, problem, analysis, structure, bias, fitted })
}

fn named(problem: &Problem, ids: &[String]) -> Result<Vec<Effect>, Failure> {
    ids.iter().map(|id| Ok(super::plan::improve::effect(problem, id)?)).collect()
}

/// The requested sections that the sessions have.
fn sections(arguments: &PaperArguments, studies: &[Study]) -> Result<Vec<Section>, Failure> {
    let study = &studies[0];
    let mut sections = Vec::new();
    for part in PARTS {
        let is_named = arguments.parts.iter().any(|named| named == part);
        if !arguments.parts.is_empty() && !is_named {
            continue;
        }
        let section = match part {
            "methods" => Some(methods::section(study)),
            "set-up" => Some(contents::set_up(study)),
            "sensitivity" => Some(contents::sensitivity(study)?),
            "uncertainty" => Some(contents::uncertainty(study)),
            "correlation" => Some(contents::correlation(study)),
            "identifiability" => Some(contents::identifiability(study)),
            "bias" => Some(contents::bias(study)),
            "comparison" => (studies.len() > 1).then(|| comparison::section(studies)),
            _ => contents::trace(study)?,
        };
        match section {
            Some(section) => sections.push(section),
            None if is_named && part == "comparison" => {
                return Err(Failure::CommandLine(
                    "`--parts comparison` needs at least two sessions; name another".into(),
                ));
            }
            None if is_named => {
                return Err(Failure::Other(format!(
                    "`--parts {part}`: {} has no readings; name a measured session, or leave the part out",
                    arguments.sessions[0].display()
                )));
            }
            None => {}
        }
    }
    Ok(sections)
}

/// The commands that make the folder and its results again, and the files that were read.
fn readme(
    arguments: &PaperArguments,
    origins: &[(abbe::model::session::Session, SourceMap)],
    sections: &[Section],
) -> Result<String, Failure> {
    let mut text = String::from("# Files of a paper\n\n## This folder\n\n");
    let mut inputs = String::new();
    for (place, (session, sources)) in origins.iter().enumerate() {
        let found = Provenance::of((session, sources), arguments.seed);
        if place == 0 {
            text.push_str(&format!("```sh\n{}\n```\n\n", found.command));
        }
        for input in &found.inputs {
            inputs.push_str(&format!("- `{}`, {} bytes, SHA-256 `{}`\n", input.path, input.bytes, input.sha256));
        }
    }
    text.push_str("## Results\n\n| part | files | command |\n|---|---|---|\n");
    let first = arguments.sessions[0].display();
    for section in sections {
        let command = match section.name {
            "sensitivity" => format!("abbe plan {first} --all --patterns patterns.csv"),
            "trace" => format!("abbe fit {first} --all --residuals residuals.csv --plots plots"),
            "methods" if section.items.len() > 3 => format!("abbe fit {first} --json fit.json"),
            "bias" => format!("abbe paper {first} --out bias --parts bias"),
            _ => format!("abbe plan {first} --all --json plan.json"),
        };
        let files = section.items.iter().filter_map(|item| match item {
            paper::Item::Table(name, _) => Some(format!("`tables/{name}`")),
            paper::Item::Figure(figure) => Some(format!("`figures/{}`", figure.name)),
            _ => None,
        });
        let files = files.collect::<Vec<_>>().join(", ");
        text.push_str(&format!("| {} | {files} | `{command}` |\n", section.name));
    }
    text.push_str(
        "\nEach table is there for LaTeX, Typst and as CSV. Each figure is there as PDF, as SVG, and its data as CSV, which \
         pgfplots reads: `\\addplot table [col sep=comma] {figures/NAME.csv};`.\n\n## Typeset\n\n```sh\npdflatex main && \
         bibtex main && pdflatex main && pdflatex main && pdflatex main\ntypst compile main.typ\n```\n\n## Files that were read\n\n",
    );
    Ok(text + &inputs)
}
