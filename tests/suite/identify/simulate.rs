//! `abbe simulate`: a plan and given errors become a session that reads, the same for the same seed.

use std::fs;
use std::path::{Path, PathBuf};

use abbe::files::{self, ReadOptions};
use abbe::model::session::Session;

use crate::plant;
use crate::suite::{abbe, ready, text};

fn chapter5() -> PathBuf {
    ready("hermle-c600u/chapter5.toml")
}

/// Runs `abbe simulate` on a plan and returns its standard output.
#[track_caller]
fn simulated(plan: &Path, out: &Path, more: &[&str]) -> String {
    let arguments = [&["simulate", text(plan), "--out", text(out)], more].concat();
    let output = abbe(&arguments);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{stderr}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs it, asserts that it fails, and returns its standard error.
#[track_caller]
fn refused(plan: &Path, out: &Path, more: &[&str]) -> String {
    let arguments = [&["simulate", text(plan), "--out", text(out)], more].concat();
    let output = abbe(&arguments);
    assert_eq!(output.status.code(), Some(1));
    String::from_utf8(output.stderr).unwrap()
}

fn session(folder: &Path) -> Session {
    files::session(&folder.join("session.toml"), &ReadOptions::default()).unwrap()
}

/// Writes a plan of one coarse C test with a declared effect, and its machine.
fn small_plan(folder: &Path) -> PathBuf {
    let plan = fs::read_to_string(chapter5()).unwrap();
    let head = &plan[..plan.find("[[test]]").unwrap()];
    let text = format!(
        "{head}[[effect]] # an axial motion\ncomponent = \"EZC\"\nshape = \"harmonic\"\norder = 2\n\n[[test]]\nname = \"C 150\"\n\
         bar_mm = \"R_e\"\nworkpiece_ball_mm = [0, \"R\", 0]\nspindle_ball_mm = [0, 0, 0]\nbar_u_um = 0.5\n\
         at = {{ z_mm = \"sqrt(R_e^2 - R^2)\" }}\nsweep = {{ axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 5 }}\n"
    );
    fs::copy(ready("hermle-c600u/machine.toml"), folder.join("machine.toml")).unwrap();
    let path = folder.join("plan.toml");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    for (name, seed) in [("a", "1"), ("b", "1"), ("c", "2")] {
        simulated(&chapter5(), &out(name), &["--error", "EY0A=35.3um", "--seed", seed, "--draw-setups"]);
    }
    for file in ["session.toml", "machine.toml", "A100.csv", "A150.csv", "C100.csv", "C150.csv"] {
        let of = |name: &str| fs::read(out(name).join(file)).unwrap();
        assert!(of("a") == of("b"), "{file}");
        assert_eq!(of("a") == of("c"), !file.ends_with(".csv"), "{file}");
    }
    let session = session(&out("a"));
    assert_eq!(session.tests.len(), 4);
    for value in &session.tests[2].readings.as_ref().unwrap().observed {
        let steps = value / 1e-4;
        assert!((steps - steps.round()).abs() < 1e-6, "{value} is no multiple of 0.1 um");
    }
}

#[test]
fn amplitude_and_phase_are_those_of_the_independent_plant() {
    use plant::{AxisName, Component, Driver, Freedom, Injected, Shape};
    let folder = tempfile::tempdir().unwrap();
    let plan = small_plan(folder.path());
    let (still, moved) = (folder.path().join("still"), folder.path().join("moved"));
    let exact = fs::read_to_string(&plan).unwrap().replace("resolution_um = 0.1\n", "");
    fs::write(&plan, exact).unwrap();
    simulated(&plan, &still, &["--noise-um", "0"]);
    let effect = ["--effect", "EZC~C:h2.amplitude=1.5um", "--effect", "EZC~C:h2.phase=60deg"];
    simulated(&plan, &moved, &[&effect[..], &["--noise-um", "0", "--hide-effects"]].concat());
    let (still, moved) = (session(&still), session(&moved));
    assert_eq!((still.effects.len(), moved.effects.len()), (1, 0));
    assert_eq!(moved.noise_mm, Some(0.0));
    let injected = Injected::new(
        Component::Motion(Freedom::Z, AxisName::C),
        Driver::Axis(AxisName::C),
        Shape::Harmonic { order: 2, phase_deg: 60.0 },
        1.5,
    );
    let machine = plant::machine::Machine::default();
    let height = (149.9946_f64.powi(2) - 1e4).sqrt();
    let readings = moved.tests[0].readings.as_ref().unwrap();
    let c = &readings.positions[moved.machine.axis_index("C").unwrap()];
    for (row, c) in c.iter().enumerate() {
        // The axes of the plant: X, Y, Z, A, C.
        let position = [0.0, 0.0, height, 0.0, *c];
        let mut displacement = plant::machine::Displacement::default();
        displacement.add(injected.component, 1.5e-3 * (2.0 * c + 60.0_f64.to_radians()).cos());
        let table = machine.workpiece_point(&position, &displacement, [0.0, 100.0, 0.0]);
        let tool = machine.tool_point(&position, &displacement, [0.0; 3]);
        let length = (table - tool).norm();
        assert!((readings.observed[row] - length).abs() < 1e-10, "{row}");
    }
}

/// The names of results are those of `simulate`, and a scale error is per length whatever its scale in the file: what is
/// simulated is found under its name, in its unit.
#[test]
fn a_parameter_has_one_name_in_simulate_fit_and_trace() {
    let effect = |component: &str, shape: &str| {
        format!("[[effect]]\ncomponent = \"{component}\"\ndriver = \"X\"\nshape = \"{shape}\"\n")
    };
    let slope = "order = 1\nscale_mm = 250\n";
    let cases = [
        (
            effect("EXX", "polynomial") + slope + &effect("EXX", "backlash"),
            vec![("EXX~X:power1", 40.0, "um/m"), ("EXX~X:backlash", 3.0, "um")],
        ),
        (effect("EBX", "polynomial") + slope, vec![("EBX~X:power1", -12.0, "arcsec/m")]),
    ];
    for (effects, truth) in cases {
        let folder = tempfile::tempdir().unwrap();
        let plan = folder.path().join("plan.toml");
        fs::copy(ready("laser/machine.toml"), folder.path().join("machine.toml")).unwrap();
        let bundled = fs::read_to_string(ready("laser/plan.toml")).unwrap();
        let (head, rest) = bundled.split_once("# Positioning.").unwrap();
        let (_, test) = rest.split_once("[[test]]").unwrap();
        fs::write(&plan, format!("{head}{effects}\n[[test]]{test}")).unwrap();
        let values: Vec<String> = truth.iter().map(|(id, value, unit)| format!("{id}={value}{unit}")).collect();
        let given: Vec<&str> = values.iter().flat_map(|value| ["--effect", value.as_str()]).collect();
        let out = folder.path().join("run");
        let printed = simulated(&plan, &out, &given);
        for (command, key) in [("fit", "parameters"), ("trace", "after")] {
            let file = out.join("session.toml");
            if command == "trace" {
                // A trace finds what the session does not declare.
                let declared = fs::read_to_string(&file).unwrap();
                let start = declared.find("[[effect]]").unwrap();
                let end = declared.find("[[test]]").unwrap();
                fs::write(&file, format!("{}{}", &declared[..start], &declared[end..])).unwrap();
            }
            let (found, screen) = crate::suite::identify::result_and_screen(command, &file, &[]);
            let list = if key == "after" { &found["after"]["parameters"] } else { &found["parameters"] };
            for (id, value, unit) in &truth {
                let is_it = |own: &&serde_json::Value| own["id"] == *id;
                let own =
                    list.as_array().unwrap().iter().find(is_it).unwrap_or_else(|| panic!("{command} {id}: {screen}"));
                assert_eq!(own["unit"], *unit, "{command}");
                let [estimate, u] = ["value", "u"].map(|key| own[key].as_f64().unwrap());
                assert!((estimate - value).abs() < 4.0 * u && u < 1.0, "{command} {value}: {own}");
                let shown = unit.replace("um", "µm").replace("arcsec", "″");
                for shows in [&printed, &screen] {
                    let row = shows.lines().find(|line| line.trim_start().starts_with(&format!("{id} ")));
                    assert!(row.is_some_and(|row| row.contains(&shown)), "{command} {id}: {shows}");
                }
            }
        }
    }
}

#[test]
fn the_text_of_the_plan_is_kept_except_for_data_and_noise() {
    let folder = tempfile::tempdir().unwrap();
    let plan = small_plan(folder.path());
    let out = folder.path().join("deep/er/out");
    let printed = simulated(&plan, &out, &["--noise-um", "0.5"]);
    assert!(printed.contains("146 readings of 1 test,") && printed.contains("noise 0.500 µm"), "{printed}");
    let text = fs::read_to_string(out.join("session.toml")).unwrap();
    for part in [
        "# test radius: distance of the pivot from the axis (Table 3.1)",
        "noise_um = 0.5\n",
        "[[effect]] # an axial motion",
        "data = \"C-150.csv\"",
        "sweep = { axis = \"C\"",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    assert!(session(&out).tests[0].readings.is_some());
    // A measured session can serve as a plan.
    simulated(&out.join("session.toml"), &folder.path().join("again"), &[]);
}

#[test]
fn errors_come_from_a_file_and_the_command_line_overrides_it() {
    let folder = tempfile::tempdir().unwrap();
    let plan = small_plan(folder.path());
    let errors = folder.path().join("errors.toml");
    fs::write(&errors, "e_y0c = \"10 um\"\n\"bar[C 150]\" = \"0.4um\"\nEB0C = \"1 arcsec\"\n").unwrap();
    let printed =
        simulated(&plan, &folder.path().join("out"), &["--values", text(&errors), "--error", "EB0C=-2arcsec"]);
    let row = |id: &str| printed.lines().find(|line| line.trim().starts_with(id)).map(str::to_string);
    assert!(row("EY0C").unwrap().contains("10.0000"), "{printed}");
    assert!(row("bar[C 150]").unwrap().contains("0.4000"), "{printed}");
    assert!(row("EB0C").unwrap().contains("-2.0000"), "{printed}");
    for (bad, message) in [
        ("EY0C = 10", "`EY0C` is not text"),
        ("EY0C = \"10\"", "has no unit"),
        ("EY0C = ", "errors.toml:1: not valid TOML"),
    ] {
        fs::write(&errors, bad).unwrap();
        let stderr = refused(&plan, &folder.path().join("bad"), &["--values", text(&errors)]);
        assert!(stderr.contains(message) && stderr.contains("errors.toml"), "{stderr}");
    }
}

#[test]
fn invalid_simulations_are_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let plan = small_plan(folder.path());
    let out = folder.path().join("out");
    for (more, message) in [
        (&["--error", "EY0Q=1um"][..], "has no axis `Q`; its axes are C, A, Y, X, Z"),
        (&["--error", "EY0A=1"], "`EY0A=1` has no unit"),
        (&["--error", "EY0A=onemm"], "is not a number with a unit"),
        (&["--error", "EY0A"], "has no value"),
        (&["--error", "EY0A=1arcsec"], "`EY0A` has the unit `arcsec`; a unit such as `um` is expected"),
        (&["--error", "e_y0a=1um", "--error", "EY0A=2um"], "is given twice"),
        (&["--error", "bra=1um"], "the session has no parameter `bra`"),
        (&["--effect", "EZC~C:h3.amplitude=1um"], "coefficients of its effects are EZC~C:h2.cos, EZC~C:h2.sin"),
        (&["--effect", "EZC~C:h2.coss=1um"], "EZC~C:h2.sin; did you mean `EZC~C:h2.cos`?"),
        (&["--effect", "EZC~C:h2.phase=1deg"], "`EZC~C:h2` has no amplitude beside its phase; give"),
        (&["--noise-um", "-1"], "a standard deviation in µm is expected"),
    ] {
        let stderr = refused(&plan, &out, more);
        assert!(stderr.contains(message), "{stderr}");
        assert!(!out.exists());
    }
    fs::create_dir(&out).unwrap();
    fs::write(out.join("notes.txt"), "mine").unwrap();
    let stderr = refused(&plan, &out, &[]);
    assert!(stderr.contains("exists and is not empty") && stderr.contains("--force"), "{stderr}");
    assert_eq!(fs::read_dir(&out).unwrap().count(), 1);
    fs::remove_dir_all(&out).unwrap();
    let before = fs::read(&plan).unwrap();
    let stderr = refused(&plan, folder.path(), &["--force"]);
    assert!(stderr.contains("this folder contains the plan itself"), "{stderr}");
    assert_eq!(fs::read(&plan).unwrap(), before);
    let stderr = refused(&ready("kuka-iiwa14/session.toml"), &out, &["--data", "nowhere"]);
    assert!(stderr.contains("nowhere"), "{stderr}");
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 2, "temporary folders are left behind");
}

#[test]
fn force_replaces_files_of_the_same_names_and_leaves_others() {
    let folder = tempfile::tempdir().unwrap();
    let plan = small_plan(folder.path());
    let out = folder.path().join("out");
    simulated(&plan, &out, &[]);
    fs::write(out.join("notes.txt"), "mine").unwrap();
    fs::write(out.join("C-150.csv"), "old").unwrap();
    simulated(&plan, &out, &["--force"]);
    assert_eq!(fs::read_to_string(out.join("notes.txt")).unwrap(), "mine");
    assert!(session(&out).tests[0].readings.is_some());
}
