//! The options and commands of the command line: one meaning for each name, and examples that are accepted.

use clap::error::ErrorKind;
use clap::{Arg, Command};

use super::parser;

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
    let command = parser();
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
    let command = parser();
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
    const NAMES: [&str; 11] =
        ["NAME", "NAMES", "TEST", "TEXT", "ID", "THING", "A,B", "EFFECT,…", "NAME=SIZE", "NAME=VALUE", "AXIS=POSITION"];
    let command = parser();
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
    let command = parser();
    for (command, option) in options_with_values(&command) {
        let text = option.get_long_help().map(ToString::to_string).unwrap_or_default();
        for example in text.lines().filter_map(|line| line.strip_prefix("Example: ")) {
            let required: &[&str] = match command.get_name() {
                "equation" => &["SESSION", "--test", "T"],
                "poses" => &["SESSION", "--poses", "3"],
                "history" => &["DIR"],
                "run" if example.contains("--sessions") => &["--out", "DIR"],
                "sheet" if example.contains("--program-number") => &["SESSION", "--out", "OUT", "--control", "fanuc"],
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
                "import" if example.contains("--session") || example.contains("--like") => &["FILE", "--session", "S"],
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
            let group = ["run", "history"].contains(&command.get_name()).then_some("fleet");
            let words = ["abbe"].into_iter().chain(group).chain([command.get_name()]);
            let words = words.chain(required.iter().copied()).chain(example.split(' '));
            let parsed = parser().try_get_matches_from(words);
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
            let found = words(line).map(|words| parser().try_get_matches_from(&words));
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
            if let Err(found) = parser().try_get_matches_from(&words)
                && found.use_stderr()
            {
                wrong.push(format!("{}: {line}: {found}", file.display()));
            }
        }
    }
    assert!(count > 80, "{count} command lines");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
