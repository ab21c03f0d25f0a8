//! Documents that are printed read back equal, whatever their form: every bundled file, and one with every table.

use std::fmt::Debug;
use std::fs;
use std::path::{Path, PathBuf};

use abbe_files::Source;
use abbe_model::document::machine::Machine;
use abbe_model::document::print;
use abbe_model::document::session::Session;
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;

fn files_in(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files_in(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "toml") {
            files.push(path);
        }
    }
}

#[track_caller]
fn reads_back<T: Serialize + DeserializeOwned + JsonSchema + PartialEq + Debug>(file: &Path, text: &str) {
    let document: T = Source::new(file, text).parse().unwrap().document().unwrap();
    let printed = print::text_of(&document).unwrap();
    let again = Source::new(file, &printed).parse().and_then(|parsed| parsed.document::<T>());
    let again = again.unwrap_or_else(|fault| panic!("{fault}\n{printed}"));
    assert_eq!(again, document, "{printed}");
}

#[test]
fn bundled_files_read_back_equal() {
    let mut files = Vec::new();
    files_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions"), &mut files);
    assert!(files.len() > 10);
    for file in files.iter().filter(|file| !file.ends_with("errors.toml")) {
        let text = fs::read_to_string(file).unwrap();
        if text.contains("[machine]") {
            reads_back::<Session>(file, &text);
        } else {
            reads_back::<Machine>(file, &text);
        }
    }
}

#[test]
fn every_table_reads_back_equal() {
    let text = r#"
about = { date = 2026-01-02, serial_number = 7.50, comment = "two\nlines" }
[machine]
chain = "w C b X Z t"
rotation = "small-angle"
gravity = [0, 0, -1]
[machine.axis.C]
travel_deg = [-360, 360]
[machine.axis]
X = {}
Z = { direction = [0, 0, 1], origin_mm = [1, 2.5, 3e-7] }
[[machine.body]]
name = "table"
axis = "C"
box_mm = [[0, 0, 0], [1, 1, 1]]
[[machine.body]]
name = "spindle"
capsule = { from_mm = [0, 0, 0], to_mm = [0, 0, 1], radius_mm = 2 }
[constants]
R = 100.0
H = { mm = 75, means = "height" }
[instrument]
kind = "ballbar"
noise_um = 0.3
[unknowns]
errors = ["E?0C"]
[format]
separator = ";"
anticlockwise = 1
[columns]
length_mm = 3
driver.load_kg = "T1"
[[effect]]
component = "EZC"
shape = "steps"
at_deg = [1, 2.5]
scale_um = 2
tests = ["T"]
assumed = true
[[effect.alias]]
component = "EAC"
shape = "harmonic"
order = 1
[[effect.alias]]
component = "EBC"
shape = "constant"
[[test]]
name = "T"
data = "T.csv"
bar_mm = "R + 1"
bar_u_um = inf
workpiece_ball_mm = [0, "R", "H - 3"]
workpiece_ball_u_um = [2, 2, inf]
spindle_ball_mm = [0, 0, 0]
at = { z_mm = "H" }
path = { kind = "circle", plane = "XZ", radius_mm = "R", step_deg = 2, runs = 3 }
[[test]]
name = "L"
path = { kind = "list" }
[[test]]
name = "F"
path = { kind = "follow", axis = "C", offset = "axial", step_deg = 1, both_directions = false }
[[socket_distance]]
between = ["0", "1"]
mm = 50
u_um = 100
[tolerance]
probability = 0.9
errors = { EX0C_um = [-5, 20], EB0C_arcsec = 3 }
tests.T = { radial_deviation_um = [-1, 2], hysteresis_um = 4 }
[clearance]
spindle_holder = { radius_mm = 1, length_mm = 20 }
"#;
    reads_back::<Session>(Path::new("session.toml"), text.trim_start());
}
