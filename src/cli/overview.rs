//! The help of `abbe` itself: the commands by task, on one screen.

use clap::Subcommand;

use super::{Command, analysis};

/// Examples of `abbe`.
pub const EXAMPLES: &str = "Example, from a template to a found effect (`abbe COMMAND --help` has more):
  abbe new my --template hermle-c600u
  abbe plan my/chapter5.toml
  abbe simulate my/chapter5.toml --out my/run1 --error EY0A=35.3um --error EB0A=-1.29arcsec
  abbe fit my/run1/session.toml --json my/fit.json
  abbe trace my/run1/session.toml --only EZC --only EAC
  abbe equation my/chapter5.toml --test C150 --order first

Results go to standard output, progress and messages to standard error; FILE `-` is standard output.
Exit status: 0 done; 1 the input cannot be used; 2 wrong command line; 130 interrupted; 143 ended.";

/// The commands by task. An analysis that none of them names stands in [`ANALYSE`].
const TASKS: [(&str, &[&str]); 5] = [
    ("Prepare", &["new", "import", "plan", "poses", "simulate", "sheet", "nc"]),
    (ANALYSE, &["fit", "trace", "validate", "compare"]),
    ("Correct", &["compensate", "volumetric", "export"]),
    ("Many machines", &["fleet"]),
    ("Write", &["equation", "paper", "schema", "completions"]),
];

/// The task of an analysis.
const ANALYSE: &str = "Analyse";

/// The help of `abbe` with the commands by task: clap lists them in one.
pub fn template() -> String {
    let all = analysis::added(Command::augment_subcommands(clap::Command::new("abbe")));
    let line = |name: &&str| {
        let about =
            all.find_subcommand(name).and_then(clap::Command::get_about).map_or(String::new(), ToString::to_string);
        format!("  {name:<13}{about}\n")
    };
    let others = analysis::commands().map(|(line, _)| &line.name);
    let others = others.filter(|name| !TASKS.iter().any(|(_, names)| names.contains(name)));
    let others: String = others.map(line).collect();
    let tasks = TASKS.iter().map(|(task, names)| {
        let others = if *task == ANALYSE { &others } else { "" };
        format!("{task}:\n{}{others}\n", names.iter().map(line).collect::<String>())
    });
    let tasks: String = tasks.collect();
    format!("{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{tasks}Options:\n{{options}}{{after-help}}\n")
}
