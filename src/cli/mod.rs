//! The command line: arguments, progress, tables, files. It calls the library and contains no mathematics.

/// Writes a line of the result to standard output. A closed pipe ends the program without a message.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::output::line(format_args!($($text)*)) };
}

mod certificate;
mod compare;
mod compensate;
mod controls;
mod equation;
mod excerpt;
mod export;
mod failure;
mod fit;
mod fleet;
mod folder;
mod forms;
mod import;
mod interrupt;
mod json;
mod map;
mod message;
mod method;
mod monte_carlo;
mod nc;
mod new;
mod next_session;
mod output;
mod overview;
mod paper;
mod plan;
mod poses;
mod readings;
mod repeated;
mod results;
mod save;
mod schema;
mod search;
mod sheet;
mod simulate;
mod trace;
mod validate;
mod values;
mod volumetric;

use std::path::PathBuf;
use std::process::ExitCode;

use abbe::identify::plausibility::{self, ConflictKind, Plausibility};
use abbe::model::files::{self, ReadOptions, SourceMap};
use abbe::model::session::Session;
use clap::{Args, CommandFactory, Parser, Subcommand};

use crate::report::commands::Commands;
use failure::Failure;
use output::Outputs;
use results::OutputArguments;

/// Geometric errors of machine tools, robots and other serial chains
#[derive(Parser)]
#[command(name = "abbe", version, max_term_width = 110, help_template = overview::template(), after_help = overview::EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Suppress tables and progress output; warnings and errors stay.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Number of threads; by default all processors, but one for `fleet run` and `fleet study`.
    #[arg(long, global = true, value_name = "N", value_parser = values::threads())]
    threads: Option<u32>,
}

const COMPLETIONS: &str = "Example:
  abbe completions bash

Save the output where the shell finds it: ~/.local/share/bash-completion/completions/abbe (bash), a folder of $fpath as _abbe (zsh),
~/.config/fish/completions/abbe.fish (fish).";

#[derive(Subcommand)]
enum Command {
    /// Print the closed-form equation of a test.
    #[command(after_help = equation::HELP)]
    Equation(equation::EquationArguments),
    /// Print or map the volumetric error, and compensate it.
    #[command(after_help = volumetric::HELP)]
    Volumetric(volumetric::VolumetricArguments),
    /// State what differs between sessions or models of one machine.
    #[command(after_help = compare::HELP)]
    Compare(compare::CompareArguments),
    /// Correct commanded positions or poses with a model.
    #[command(after_help = compensate::HELP)]
    Compensate(compensate::CompensateArguments),
    /// Export the calibrated machine for controls and other programs.
    #[command(after_help = export::HELP)]
    Export(export::ExportArguments),
    /// Write the NC programs of planned tests.
    #[command(after_help = nc::HELP)]
    Nc(nc::NcArguments),
    /// Estimate errors from readings, with uncertainties.
    #[command(after_help = fit::HELP)]
    Fit(fit::FitArguments),
    /// Write text, tables and figures for LaTeX and Typst.
    #[command(after_help = paper::HELP)]
    Paper(paper::PaperArguments),
    /// State what planned tests identify, how surely, and what improves.
    #[command(after_help = plan::HELP)]
    Plan(Box<plan::PlanArguments>),
    /// Create a machine and a session.
    #[command(after_help = new::HELP)]
    New(new::NewArguments),
    /// Write the completions of a shell.
    #[command(after_help = COMPLETIONS)]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Analyse many sessions and show machines over time; simulate studies.
    #[command(subcommand, after_help = fleet::HELP)]
    Fleet(Box<fleet::Fleet>),
    /// Turn foreign files of readings into a session.
    #[command(after_help = import::HELP)]
    Import(import::ImportArguments),
    /// Print the JSON Schema of a file or a result.
    #[command(after_help = schema::HELP)]
    Schema(schema::SchemaArguments),
    /// Write set-up sheets of planned tests.
    #[command(after_help = sheet::HELP)]
    Sheet(sheet::SheetArguments),
    /// Simulate readings of planned tests with given errors.
    #[command(after_help = simulate::HELP)]
    Simulate(Box<simulate::SimulateArguments>),
    /// Choose the poses of a robot or a probe that determine its errors best.
    #[command(after_help = poses::HELP)]
    Poses(poses::PoseArguments),
    /// Find the unmodelled effect behind the residual.
    #[command(after_help = trace::HELP)]
    Trace(trace::TraceArguments),
    /// Test a saved model on readings that it never saw.
    #[command(after_help = validate::HELP)]
    Validate(validate::ValidateArguments),
}

/// Arguments of every command that reads a session.
#[derive(Args, Clone)]
pub struct SessionArguments {
    /// The session file.
    session: PathBuf,
    #[command(flatten)]
    data: DataArguments,
}

/// Where the data files of sessions are.
#[derive(Args, Clone)]
pub struct DataArguments {
    /// Folder of the data files, if they do not lie beside the session file.
    ///
    /// Example: --data measurements
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Allow a session to read files outside its own folder. The folder of --data is always allowed.
    #[arg(long)]
    allow_outside: bool,
}

impl DataArguments {
    /// Options of the reader.
    fn options(&self) -> ReadOptions {
        ReadOptions { data_directory: self.data.clone(), allow_outside: self.allow_outside, ..ReadOptions::default() }
    }
}

/// What an identification does with estimates that mean nothing.
#[derive(Args, Clone, Copy)]
pub struct PlausibilityArguments {
    /// Accept readings that contradict the machine, such as location errors above 5 % of a link.
    #[arg(long)]
    allow_implausible: bool,
}

impl PlausibilityArguments {
    /// Refuses the option without another one to which it belongs.
    fn belongs_to(self, other: &str, is_given: bool) -> Result<(), Failure> {
        if self.allow_implausible && !is_given {
            return Err(Failure::CommandLine(format!(
                "`--allow-implausible` belongs to `{other}`; state both or none"
            )));
        }
        Ok(())
    }

    /// Refuses estimates that mean nothing: location errors of a robot that are a large share of its links.
    fn check(self, found: &Plausibility) -> Result<(), Failure> {
        let conflict = found.conflicts.iter().find(|conflict| conflict.kind == ConflictKind::LocationError);
        let Some(conflict) = conflict.filter(|_| !self.allow_implausible) else { return Ok(()) };
        let why = plausibility::explained(found);
        let why = why.unwrap_or_else(|| "check the units, signs and order of the columns".to_string());
        Err(Failure::Implausible(format!("{}; {why}", conflict.words)))
    }
}

impl SessionArguments {
    /// Options of the reader.
    fn options(&self) -> ReadOptions {
        self.data.options()
    }

    /// How command lines name the session.
    fn commands(&self) -> Commands {
        Commands::of(&self.session, self.data.data.as_deref(), self.data.allow_outside)
    }
}

/// `--force`: an option of every command that writes a folder. Files that options name are always replaced.
#[derive(Args, Clone, Copy)]
pub struct ForceArguments {
    /// Replace files in an existing folder.
    #[arg(long)]
    pub force: bool,
}

/// Arguments of every command with a result that depends on a seed.
#[derive(Args, Clone)]
pub struct CommonArguments {
    #[command(flatten)]
    output: OutputArguments,
    /// Seed of the random numbers: folds, null distribution, simulated noise, Monte Carlo.
    ///
    /// Example: --seed 7
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Runs the command line and returns the exit status.
pub fn run() -> ExitCode {
    interrupt::watch_termination();
    let Arguments { command, quiet, threads } = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        // Help and version, to standard output.
        Err(shown) if !shown.use_stderr() => shown.exit(),
        Err(wrong) => {
            message::print_usage(wrong);
            return ExitCode::from(2);
        }
    };
    match with_threads(threads).and_then(|()| execute(command, quiet, threads)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) if interrupt::is_terminated() => ExitCode::from(interrupt::status()),
        Err(failure) => {
            failure.show();
            ExitCode::from(failure.status())
        }
    }
}

/// Makes the threads of the process, if their number is stated.
fn with_threads(threads: Option<u32>) -> Result<(), Failure> {
    let Some(threads) = threads else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).build_global();
    pool.map_err(|cause| Failure::Other(format!("{threads} threads cannot be started: {cause}; state fewer")))
}

/// Runs another command line as a part of a command.
fn again(arguments: &[&str], quiet: bool) -> Result<(), Failure> {
    let words = std::iter::once("abbe").chain(arguments.iter().copied());
    let parsed = Arguments::try_parse_from(words).map_err(|wrong| Failure::CommandLine(wrong.to_string()))?;
    execute(parsed.command, quiet, parsed.threads)
}

/// Runs a command.
fn execute(command: Command, quiet: bool, threads: Option<u32>) -> Result<(), Failure> {
    match command {
        Command::Equation(arguments) => equation::run(&arguments),
        Command::Volumetric(arguments) => volumetric::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Compensate(arguments) => compensate::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Nc(arguments) => nc::run(&arguments, quiet),
        Command::Fit(arguments) => fit::run(&arguments),
        Command::Paper(arguments) => paper::run(&arguments, quiet),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::New(arguments) => new::run(&arguments, quiet),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "abbe", &mut script);
            output::whole(String::from_utf8_lossy(&script).trim_end());
            Ok(())
        }
        Command::Fleet(command) => fleet::run(&command, threads),
        Command::Import(arguments) => import::run(&arguments),
        Command::Poses(arguments) => poses::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Sheet(arguments) => sheet::run(&arguments, quiet),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
        Command::Validate(arguments) => validate::run(&arguments),
    }
}

/// Reads the session, with its sources. No output may replace one of its files.
fn read_session(arguments: &SessionArguments, outputs: &Outputs) -> Result<(Session, SourceMap), Failure> {
    let (session, sources) = files::session_with_sources(&arguments.session, &arguments.options())?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    Ok((session, sources))
}

#[cfg(test)]
mod tests {
    use clap::error::ErrorKind;
    use clap::{Arg, Command, CommandFactory};

    use super::Arguments;

    /// The help texts of an option and of its command in full.
    fn help(command: &Command, option: &Arg) -> String {
        let long = option.get_long_help().or(option.get_help());
        let texts = [long, command.get_after_help(), command.get_after_long_help()];
        let texts = texts.into_iter().flatten();
        texts.map(ToString::to_string).collect::<Vec<_>>().join("\n")
    }

    /// The options of all commands of this one, each with its command.
    fn options(command: &Command) -> Vec<(&Command, &Arg)> {
        let of = |inner| {
            let own = Command::get_arguments(inner).filter(|option| !option.is_positional());
            own.map(move |option| (inner, option)).chain(options(inner))
        };
        command.get_subcommands().flat_map(of).collect()
    }

    /// The options of all commands that take a value, each with its command.
    fn options_with_values(command: &Command) -> Vec<(&Command, &Arg)> {
        let mut options = options(command);
        options.retain(|(_, option)| option.get_action().takes_values());
        options
    }

    /// An option has one meaning: the same kind of value and the same first sentence wherever it stands.
    #[test]
    fn an_option_has_one_meaning() {
        let command = Arguments::command();
        let mut known: std::collections::BTreeMap<&str, ([String; 2], &str)> = std::collections::BTreeMap::new();
        let mut several = Vec::new();
        for (command, option) in options(&command) {
            let Some(long) = option.get_long() else { continue };
            let value = option.get_value_names().map_or(String::new(), |names| names[0].to_string());
            let value = if ["FILE", "DIR"].iter().any(|path| value.starts_with(path)) { "path".into() } else { value };
            let text = option.get_help().map(ToString::to_string).unwrap_or_default();
            let sentence = text.split(['.', ':', ';', '[']).next().unwrap_or_default().trim().to_string();
            let meaning = [value, sentence];
            match known.get(long) {
                Some((other, place)) if *other != meaning => {
                    several.push(format!("--{long} of {place}: {other:?}, of {}: {meaning:?}", command.get_name()));
                }
                Some(_) => {}
                None => drop(known.insert(long, (meaning, command.get_name()))),
            }
        }
        assert!(known.len() > 100, "{} options", known.len());
        assert!(several.is_empty(), "{}", several.join("\n"));
    }

    #[test]
    fn every_option_with_a_value_has_an_example() {
        let command = Arguments::command();
        let options = options_with_values(&command);
        assert!(options.len() > 60, "{} options", options.len());
        let without: Vec<String> = options
            .into_iter()
            .filter_map(|(command, option)| {
                let name = format!("--{} ", option.get_long()?);
                (!help(command, option).contains(&name)).then(|| format!("{} {name}", command.get_name()))
            })
            .collect();
        assert!(without.is_empty(), "no example of {}", without.join(", "));
    }

    /// A test, a machine or an effect may have a name that begins as an option does.
    #[test]
    fn a_name_may_begin_with_a_hyphen() {
        const NAMES: [&str; 11] = [
            "NAME",
            "NAMES",
            "TEST",
            "TEXT",
            "ID",
            "THING",
            "A,B",
            "EFFECT,…",
            "NAME=SIZE",
            "NAME=VALUE",
            "AXIS=POSITION",
        ];
        let command = Arguments::command();
        let named: Vec<(&Command, &Arg)> = options_with_values(&command)
            .into_iter()
            .filter(|(_, option)| option.get_value_names().is_some_and(|names| NAMES.contains(&names[0].as_str())))
            .collect();
        assert!(named.len() >= 15, "{} options", named.len());
        for (command, option) in named {
            assert!(option.is_allow_hyphen_values_set(), "abbe {} --{}", command.get_name(), option.get_id());
        }
    }

    /// The examples in the help of options are command lines that the parser accepts.
    #[test]
    fn examples_of_options_are_accepted() {
        let command = Arguments::command();
        for (command, option) in options_with_values(&command) {
            let text = option.get_long_help().map(ToString::to_string).unwrap_or_default();
            for example in text.lines().filter_map(|line| line.strip_prefix("Example: ")) {
                let required: &[&str] = match command.get_name() {
                    "equation" => &["SESSION", "--test", "T"],
                    "poses" => &["SESSION", "--poses", "3"],
                    "history" => &["DIR"],
                    "study" if example.contains("--out") => &["STUDY"],
                    "study" => &["STUDY", "--out", "DIR"],
                    "run" if example.contains("--sessions") => &["--out", "DIR"],
                    "sheet" if example.contains("--program-number") => {
                        &["SESSION", "--out", "OUT", "--control", "fanuc"]
                    }
                    "simulate" | "paper" | "run" | "sheet" => &["SESSION", "--out", "OUT"],
                    "volumetric" => &["MACHINE"],
                    "new" => &["DIR"],
                    "export" if example.contains("--as") => &["MODEL", "--out", "OUT"],
                    "export" => &["MODEL", "--as", "urdf", "--out", "OUT"],
                    "nc" if example.contains("--control") => &["SESSION", "--out", "OUT"],
                    "nc" => &["SESSION", "--control", "linuxcnc", "--out", "OUT"],
                    "import" if example.contains("--machine") && example.contains("--out") => &["FILE"],
                    "import" if example.contains("--machine") => &["FILE", "--out", "OUT"],
                    "import" if example.contains("--out") => &["FILE", "--machine", "M"],
                    "import" if example.contains("--session") || example.contains("--like") => {
                        &["FILE", "--session", "S"]
                    }
                    "import" => &["FILE", "--machine", "M", "--out", "OUT"],
                    "compare" => &["A", "B"],
                    "compensate" => &["MODEL", "FILE", "--out", "OUT"],
                    "validate" => &["MODEL", "SESSION"],
                    _ => &["SESSION"],
                };
                let is_given = |name: &str| example.split(' ').any(|word| word == name);
                let required = match required {
                    [positional @ .., name, _] if is_given(name) => positional,
                    all => all,
                };
                let group = ["run", "history", "study"].contains(&command.get_name()).then_some("fleet");
                let words = ["abbe"].into_iter().chain(group).chain([command.get_name()]);
                let words = words.chain(required.iter().copied()).chain(example.split(' '));
                let parsed = Arguments::command().try_get_matches_from(words);
                assert!(parsed.is_ok(), "{}: {example}: {}", command.get_name(), parsed.unwrap_err());
            }
        }
    }

    /// The words of a line of a shell, up to what the shell itself reads; `None` if a variable stands in it.
    fn words(line: &str) -> Option<Vec<String>> {
        let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None::<char>);
        for sign in line.chars() {
            match (quote, sign) {
                (Some(open), _) if open == sign => quote = None,
                (Some(_), _) => word.get_or_insert_default().push(sign),
                (None, '"' | '\'') => {
                    quote = Some(sign);
                    word.get_or_insert_default();
                }
                (None, '$' | '<' | '{') => return None,
                (None, '|' | '>' | ';' | '&' | '#') => break,
                (None, ' ') => words.extend(word.take()),
                (None, _) => word.get_or_insert_default().push(sign),
            }
        }
        words.extend(word);
        Some(words)
    }

    /// Every command line of the README and of the manual is one that the parser accepts.
    #[test]
    fn command_lines_of_the_manual_are_accepted() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut files = vec![root.join("README.md"), root.join("CONTRIBUTING.md")];
        let mut folders = vec![root.join("docs")];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
                match entry.extension() {
                    None if entry.is_dir() => folders.push(entry),
                    Some(extension) if extension == "md" => files.push(entry),
                    _ => {}
                }
            }
        }
        let (mut count, mut wrong) = (0, Vec::new());
        for file in files {
            let text = std::fs::read_to_string(&file).unwrap().replace("\\\n", " ");
            // In a sentence values may be placeholders, and what is required may be left out; options and commands exist.
            let inline = text.split('`').skip(1).step_by(2).filter(|piece| piece.starts_with("abbe "));
            for line in inline.filter(|piece| !piece.contains(['…', '\n', '\\']) && !piece.contains("COMMAND")) {
                let found = words(line).map(|words| Arguments::command().try_get_matches_from(&words));
                if let Some(Err(found)) = found
                    && matches!(found.kind(), ErrorKind::UnknownArgument | ErrorKind::InvalidSubcommand)
                {
                    wrong.push(format!("{}: {line}: {found}", file.display()));
                }
            }
            // Odd pieces are blocks of code.
            let blocks = text.split("\n```").skip(1).step_by(2);
            for line in
                blocks.filter(|block| block.starts_with("console") || block.starts_with("sh\n")).flat_map(str::lines)
            {
                let Some(words) = Some(line).filter(|line| line.starts_with("abbe ")).and_then(words) else {
                    continue;
                };
                count += 1;
                if let Err(found) = Arguments::command().try_get_matches_from(&words)
                    && found.use_stderr()
                {
                    wrong.push(format!("{}: {line}: {found}", file.display()));
                }
            }
        }
        assert!(count > 80, "{count} command lines");
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}
