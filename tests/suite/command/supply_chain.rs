//! Dependencies: licences, sources and duplicates conform to `deny.toml`, and docs/development/dependencies.md names
//! each direct dependency.
//!
//! `cargo deny` reads the same file if it is installed. These tests use cargo only and need neither a database nor a
//! network.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;

use crate::suite::workspace;

/// A crate that is built for some platform, including tests and build scripts.
struct Built {
    name: String,
    version: String,
    licence: String,
}

/// The crates that `cargo tree` lists.
fn built(more: &[&str]) -> Vec<Built> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--workspace", "--all-features", "--locked", "--edges", "normal,build,dev", "--target", "all"])
        .args(["--prefix", "none", "--format", "{p}\t{l}"])
        .args(more)
        .current_dir(workspace())
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let listed = String::from_utf8(output.stdout).unwrap();
    let crates = listed.lines().filter_map(|line| {
        let (package, licence) = line.split_once('\t')?;
        let mut words = package.split(' ');
        Some(Built {
            name: words.next()?.to_string(),
            version: words.next()?.to_string(),
            // A star marks a crate that is listed twice.
            licence: licence.trim_end_matches(" (*)").to_string(),
        })
    });
    crates.collect()
}

fn policy() -> toml::Table {
    fs::read_to_string(workspace().join("deny.toml")).unwrap().parse().unwrap()
}

/// Whether the allowed licences satisfy an SPDX expression. `OR` binds less than `AND`, `/` is an old `OR`, an
/// exception only adds rights.
fn is_met(expression: &str, allowed: &BTreeSet<&str>) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let mut words = spaced.split_whitespace().peekable();
    any(&mut words, allowed)
}

type Words<'a> = std::iter::Peekable<std::str::SplitWhitespace<'a>>;

fn any(words: &mut Words<'_>, allowed: &BTreeSet<&str>) -> bool {
    let mut met = all(words, allowed);
    while words.next_if_eq(&"OR").is_some() {
        met |= all(words, allowed);
    }
    met
}

fn all(words: &mut Words<'_>, allowed: &BTreeSet<&str>) -> bool {
    let mut met = one(words, allowed);
    while words.next_if_eq(&"AND").is_some() {
        met &= one(words, allowed);
    }
    met
}

fn one(words: &mut Words<'_>, allowed: &BTreeSet<&str>) -> bool {
    let word = words.next().unwrap_or("");
    if word == "(" {
        let met = any(words, allowed);
        assert_eq!(words.next(), Some(")"));
        return met;
    }
    if words.next_if_eq(&"WITH").is_some() {
        words.next();
    }
    allowed.contains(word)
}

#[test]
fn licence_expressions() {
    let allowed = BTreeSet::from(["MIT", "Apache-2.0", "Zlib"]);
    for met in [
        "MIT",
        "GPL-3.0 OR MIT",
        "Unlicense/MIT",
        "(MIT OR GPL-3.0) AND Zlib",
        "GPL-3.0 OR MIT AND Zlib",
        "Apache-2.0 WITH LLVM-exception OR GPL-3.0",
    ] {
        assert!(is_met(met, &allowed), "{met}");
    }
    for unmet in ["", "GPL-3.0", "MIT AND GPL-3.0", "(MIT AND GPL-3.0) OR MPL-2.0", "GPL-3.0 AND (MIT OR Zlib)"] {
        assert!(!is_met(unmet, &allowed), "{unmet}");
    }
}

#[test]
fn every_licence_is_allowed() {
    let policy = policy();
    let allowed: BTreeSet<&str> =
        policy["licenses"]["allow"].as_array().unwrap().iter().filter_map(toml::Value::as_str).collect();
    let built = built(&[]);
    assert!(built.len() > 100, "{}", built.len());
    for Built { name, licence, .. } in built {
        assert!(is_met(&licence, &allowed), "{name} is under \"{licence}\", which deny.toml does not allow");
    }
}

#[test]
fn everything_comes_from_the_registry_with_a_checksum() {
    let lock: toml::Table = fs::read_to_string(workspace().join("Cargo.lock")).unwrap().parse().unwrap();
    for package in lock["package"].as_array().unwrap() {
        let name = package["name"].as_str().unwrap();
        match package.get("source").and_then(toml::Value::as_str) {
            None => {
                let own = name == "abbe" || name.starts_with("abbe-") || name == "test-needs";
                assert!(own, "{name} comes from a folder");
            }
            Some(source) => {
                assert_eq!(source, "registry+https://github.com/rust-lang/crates.io-index", "{name}");
                assert!(package.get("checksum").is_some(), "{name} has no checksum");
            }
        }
    }
}

#[test]
fn no_crate_is_built_twice_unless_deny_toml_permits_it() {
    let policy = policy();
    let skipped: BTreeSet<&str> =
        policy["bans"]["skip"].as_array().unwrap().iter().filter_map(|entry| entry["crate"].as_str()).collect();
    let mut versions: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for package in built(&[]) {
        versions.entry(package.name).or_default().insert(package.version);
    }
    let twice: BTreeSet<&str> =
        versions.iter().filter(|(_, versions)| versions.len() > 1).map(|(name, _)| name.as_str()).collect();
    assert_eq!(twice, skipped, "crates of which several versions are built, and those that deny.toml names");
}

/// The first cell of each table row of the page, without backticks.
fn explained() -> BTreeSet<String> {
    let page = fs::read_to_string(workspace().join("docs/development/dependencies.md")).unwrap();
    let cells = page.lines().filter_map(|line| line.strip_prefix("| `")?.split_once('`'));
    cells.map(|(name, _)| name.to_string()).collect()
}

#[test]
fn the_page_names_every_direct_dependency_and_no_other() {
    let listed = built(&["--depth", "1", "--no-dedupe"]).into_iter().map(|package| package.name);
    let crates = listed.filter(|name| !name.starts_with("abbe") && name != "test-needs");
    let page = fs::read(workspace().join("web/package.json")).unwrap();
    let page: serde_json::Value = serde_json::from_slice(&page).unwrap();
    let packages = ["dependencies", "devDependencies"].map(|kind| page[kind].as_object().unwrap().keys().cloned());
    let packages = packages.into_iter().flatten().filter(|name| !name.starts_with("@types/"));
    let direct: BTreeSet<String> = crates.chain(packages).collect();
    assert_eq!(explained(), direct);
}

/// The names of packages in a list of requirements, in lower case: the words at the beginning of lines.
fn required(text: &str) -> BTreeSet<String> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let name = |line: &str| line.split(|c| !is_part(c)).next().unwrap_or_default().to_lowercase();
    text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_alphanumeric())).map(name).collect()
}

/// CI installs from PyPI what `.ci/requirements.in` names: the tools of the build, the dependencies of the wheel with its
/// extra `test`, and what the tests of the workspace import. All are pinned with hashes, and nothing else is installed.
#[test]
fn packages_of_pypi_are_pinned_with_their_hashes() {
    let read = |name: &str| fs::read_to_string(workspace().join(name)).unwrap();
    let project: toml::Table = read("python/pyproject.toml").parse().unwrap();
    let names = |list: &toml::Value| -> BTreeSet<String> {
        list.as_array().unwrap().iter().flat_map(|entry| required(entry.as_str().unwrap())).collect()
    };
    let of_build = required(&read(".ci/build.in"));
    let asked = &required(&read(".ci/requirements.in")) | &of_build;
    assert!(names(&project["build-system"]["requires"]).is_subset(&of_build), "{of_build:?}");
    for list in [&project["project"]["dependencies"], &project["project"]["optional-dependencies"]["test"]] {
        let missing: Vec<String> = names(list).difference(&asked).cloned().collect();
        assert!(missing.is_empty(), ".ci/requirements.in lacks {missing:?} of python/pyproject.toml");
    }
    for (file, asked) in [(".ci/requirements.txt", &asked), (".ci/build.txt", &of_build)] {
        let text = read(file);
        let pinned = required(&text);
        assert!(asked.is_subset(&pinned), "{file} does not pin {:?}", asked - &pinned);
        // Each entry is `name==version` and its hashes.
        let mut entries = text.lines().filter(|line| !line.trim_start().starts_with('#')).peekable();
        while let Some(line) = entries.next() {
            if line.trim().is_empty() {
                continue;
            }
            assert!(line.contains("==") && line.ends_with('\\'), "{file}: {line}");
            let mut hashes = 0;
            while entries.next_if(|line| line.starts_with("    --hash=sha256:")).is_some() {
                hashes += 1;
            }
            assert!(hashes > 0, "{file}: {line} has no hash");
        }
    }
    let script = read(".ci/run");
    for line in script.lines().filter(|line| line.contains("pip install")) {
        let own = line.contains("--no-deps") && line.contains("/abbe-*.whl");
        assert!(own || line.contains("--require-hashes"), ".ci/run: {line}");
    }
    assert!(!script.contains("npm install") && script.contains("npm --prefix web ci"));
}

#[test]
fn licences_citation_and_changelog_are_in_the_project() {
    let read = |name: &str| fs::read_to_string(workspace().join(name)).unwrap_or_default();
    assert!(read("LICENSE-MIT").contains("Permission is hereby granted"));
    assert!(read("LICENSE-APACHE").contains("Version 2.0, January 2004"));
    let changelog = read("CHANGELOG.md");
    assert!(changelog.contains("## [Unreleased]"), "{changelog}");
    let citation = read("CITATION.cff");
    let version = format!("\nversion: {}\n", env!("CARGO_PKG_VERSION"));
    assert!(citation.starts_with("cff-version: 1.2.0") && citation.contains(&version), "{citation}");
}

/// A page that uses the thesis cites it in full once.
#[test]
fn the_thesis_is_cited_in_full_once_a_page() {
    let mut pages = vec![workspace().join("README.md")];
    let mut folders = vec![workspace().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                pages.push(path);
            }
        }
    }
    assert!(pages.len() > 20, "{pages:?}");
    let full = "Xiaogeng Jiang, *Characterising Geometric Errors in Rotary Axes of 5-axis Machine Tools*, PhD thesis, University of Birmingham, 2014";
    for page in pages {
        // The citation may contain line breaks.
        let text = fs::read_to_string(&page).unwrap();
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let times = text.matches(full).count();
        let rest = text.replace(full, "");
        let relies = rest.to_lowercase().contains("thesis") || rest.contains("Jiang");
        assert!(times == 1 || times == 0 && !relies, "{}: {times} times", page.display());
    }
}

/// Packages with their features, as `cargo build` of the named packages compiles them here.
fn compiled(packages: &[&str]) -> BTreeSet<String> {
    let mut tree = Command::new(env!("CARGO"));
    tree.args(["tree", "--locked", "--edges", "normal", "--prefix", "none", "--format", "{p} {f}"]);
    tree.args(packages.iter().flat_map(|package| ["--package", package])).current_dir(workspace());
    let output = tree.output().expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let listed = String::from_utf8(output.stdout).unwrap();
    let lines = listed.lines().map(|line| line.trim_end_matches(" (*)").trim_end());
    lines.filter(|line| !line.is_empty()).map(str::to_string).collect()
}

/// The wheel builds the command and then the module. With other features in one of them, a package is built twice, and
/// so is all that depends on it: most of Abbe, which took 3.5 of 8.4 minutes.
#[test]
fn a_wheel_builds_each_package_once() {
    let module = compiled(&["abbe-python"]);
    let both = compiled(&["abbe", "abbe-python"]);
    let name = |line: &String| line.split(' ').next().unwrap().to_string();
    let names: BTreeSet<String> = module.iter().map(name).collect();
    assert!(names.contains("faer") && names.contains("libc"), "{names:?}");
    let shared: BTreeSet<String> = both.into_iter().filter(|line| names.contains(&name(line))).collect();
    assert_eq!(shared, module, "packages whose features differ between the module and the wheel's first build");
}
