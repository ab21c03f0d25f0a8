//! `abbe new`: every template is a session that reads.

use abbe::identify::volumetric::functions;
use abbe::model::session::read::{self, ReadOptions};

use super::{abbe, text};

#[test]
fn every_template_is_copied_and_reads() {
    let listed = abbe(&["new", "--list"]);
    assert!(listed.status.success());
    let listed = String::from_utf8(listed.stdout).unwrap();
    let names: Vec<&str> = listed
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(
        [
            "hermle-c600u",
            "hermle-c600u-measured",
            "kuka-iiwa14",
            "self-calibration",
            "ur10",
            "volumetric"
        ]
        .iter()
        .all(|name| names.contains(name))
    );
    let folder = tempfile::tempdir().unwrap();
    for name in names {
        let made = folder.path().join("new").join(name);
        assert!(abbe(&["new", text(&made), "--template", name]).status.success());
        let mut sessions = 0;
        for entry in std::fs::read_dir(&made).unwrap() {
            let path = entry.unwrap().path();
            let file = path.file_name().unwrap().to_str().unwrap().to_string();
            if file == "errors.toml" {
                let machine = read::machine(&made.join("machine.toml")).unwrap();
                assert!(!functions::read(&path, &machine).unwrap().is_empty());
                sessions += 1;
            } else if file.ends_with(".toml") && file != "machine.toml" {
                let options = ReadOptions {
                    read_data: !["kuka-iiwa14", "ur10"].contains(&name),
                    ..ReadOptions::default()
                };
                read::session(&path, &options).unwrap();
                sessions += 1;
            }
        }
        assert!(sessions > 0, "{name}");
        // What is there is not overwritten unasked.
        let again = abbe(&["new", text(&made), "--template", name]);
        assert_eq!(again.status.code(), Some(1));
        assert!(String::from_utf8_lossy(&again.stderr).contains("there and not empty"));
        assert!(
            abbe(&["new", text(&made), "--template", name, "--force"])
                .status
                .success()
        );
    }
    let nothing_else = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(nothing_else, 1, "temporary folders are left behind");
}

#[test]
fn an_unknown_template_names_those_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let told = abbe(&["new", text(&folder.path().join("a")), "--template", "hermle"]);
    assert_eq!(told.status.code(), Some(1));
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    assert!(
        told.contains("no template `hermle`") && told.contains("kuka-iiwa14"),
        "{told}"
    );
}
