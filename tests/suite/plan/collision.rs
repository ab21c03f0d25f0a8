//! Clearance of bar, holders and bodies against MuJoCo, with kinematics, shapes and sampling of its own; bodies and sizes
//! that cannot be used.

use std::path::{Path, PathBuf};
use std::process::Command;

use abbe::files::{self, ReadOptions};
use abbe::plan::collision::{TestClearance, clearances};
use abbe::plan::states;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;

use crate::suite::{abbe, ready, text};

const PLANS: usize = 200;

/// The surface of a prism with its axis along Z, as an STL file, binary or ASCII.
fn prism(sides: usize, radius: f64, bottom: f64, top: f64, is_text: bool) -> Vec<u8> {
    let corner = |k: usize, z: f64| {
        let angle = std::f64::consts::TAU * (k % sides) as f64 / sides as f64;
        [radius * angle.cos(), radius * angle.sin(), z]
    };
    let mut facets = Vec::new();
    for k in 0..sides {
        let [a, b, c, d] = [corner(k, bottom), corner(k + 1, bottom), corner(k + 1, top), corner(k, top)];
        facets.extend([[a, b, c], [a, c, d], [[0.0, 0.0, bottom], b, a], [[0.0, 0.0, top], d, c]]);
    }
    if is_text {
        let vertices = |facet: &[[f64; 3]; 3]| {
            facet.iter().map(|[x, y, z]| format!("      vertex {x:e} {y:e} {z:e}\n")).collect::<String>()
        };
        let facet = |facet: &[[f64; 3]; 3]| {
            format!("  facet normal 0 0 0\n    outer loop\n{}    endloop\n  endfacet\n", vertices(facet))
        };
        return format!("solid prism\n{}endsolid prism\n", facets.iter().map(facet).collect::<String>()).into_bytes();
    }
    let mut bytes = vec![0; 80];
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        bytes.extend(facet.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// A random machine with a plan of one sweep of C or A. The table of every second machine is a surface, `stl`.
fn plan(random: &mut Pcg64, stl: Option<&str>) -> (String, Vec<u8>) {
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let about_c = between(0.0, 1.0) < 0.5;
    let (radius, height, beside) = (between(40.0, 150.0), between(0.0, 60.0), between(20.0, 140.0));
    let bar = radius.hypot(beside);
    let (ball, at, sweep) = if about_c {
        let from = 2.0 * between(-90.0, 0.0).round();
        let sweep = format!("axis = \"C\", from_deg = {from}, to_deg = 200, step_deg = 2");
        (format!("[0, {radius}, {height}]"), format!("z_mm = {}", height + beside), sweep)
    } else {
        let from = 2.0 * between(-50.0, 0.0).round();
        let sweep = format!("axis = \"A\", from_deg = {from}, to_deg = 100, step_deg = 2");
        (format!("[0, {radius}, 0]"), format!("x_mm = {beside}"), sweep)
    };
    let mut text =
        String::from("[machine]\nchain = \"w C A b Y X Z t\"\naxis = { C = {}, A = {}, X = {}, Y = {}, Z = {} }\n");
    let (half, top) = (between(60.0, 160.0), -between(5.0, 90.0));
    let sides = between(3.0, 60.0) as usize;
    let surface = prism(sides, half, top - 40.0, top, sides.is_multiple_of(2));
    text += "[[machine.body]]\nname = \"table\"\naxis = \"C\"\n";
    text += &match stl {
        Some(name) => format!("stl = \"{name}\"\n"),
        None => format!("box_mm = [[-{half}, -{half}, {}], [{half}, {half}, {top}]]\n", top - 40.0),
    };
    let (x, y) = (between(150.0, 260.0), between(30.0, 80.0));
    text += &format!(
        "[[machine.body]]\nname = \"trunnion\"\naxis = \"A\"\nbox_mm = [[{x}, -{y}, -60], [{}, {y}, 60]]\n",
        x + 40.0
    );
    let (low, wide) = (between(10.0, 120.0), between(20.0, 70.0));
    text += &format!(
        "[[machine.body]]\nname = \"spindle\"\naxis = \"Z\"\ncapsule = {{ from_mm = [0, 0, {}], to_mm = [0, 0, 400], radius_mm = {wide} }}\n",
        low + wide
    );
    let head = between(80.0, 160.0);
    text += &format!(
        "[[machine.body]]\nname = \"head\"\naxis = \"X\"\nbox_mm = [[-{head}, -{head}, 300], [{head}, {head}, 500]]\n"
    );
    let wall = between(180.0, 350.0);
    text += &format!(
        "[[machine.body]]\nname = \"column\"\nbox_mm = [[-400, {wall}, -300], [400, {}, 600]]\n",
        wall + 100.0
    );
    let [bar_radius, stem, own] = [between(5.0, 14.0), between(5.0, 15.0), between(5.0, 15.0)];
    let [down, up] = [between(20.0, 120.0), between(20.0, 120.0)];
    text += &format!(
        "[clearance]\nbar_radius_mm = {bar_radius}\nworkpiece_holder = {{ radius_mm = {stem}, length_mm = {down} }}\n\
         spindle_holder = {{ radius_mm = {own}, length_mm = {up} }}\n[instrument]\nkind = \"ballbar\"\n[[test]]\nname = \"T\"\n\
         bar_mm = {bar}\nworkpiece_ball_mm = {ball}\nspindle_ball_mm = [0, 0, 0]\nat = {{ {at} }}\nsweep = {{ {sweep} }}\n"
    );
    (text, surface)
}

#[test]
fn clearances_agree_with_mujoco() {
    let Some(python) = test_needs::python("clearances_agree_with_mujoco", "numpy, mujoco") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut random = Pcg64::seed_from_u64(4);
    let file = |number: usize| folder.path().join(format!("{number:03}.toml"));
    for number in 0..PLANS {
        let stl = format!("{number:03}.stl");
        let (text, surface) = plan(&mut random, (number % 2 == 1).then_some(&stl));
        std::fs::write(file(number), text).unwrap();
        std::fs::write(folder.path().join(stl), surface).unwrap();
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/plan/collision.py");
    // Both computations run at the same time.
    let mujoco = std::thread::spawn({
        let folder = folder.path().to_path_buf();
        move || Command::new(python).arg(script).arg(folder).output().unwrap()
    });
    let found: Vec<TestClearance> = (0..PLANS)
        .map(|number| {
            let session = files::session(&file(number), &ReadOptions::default()).unwrap();
            clearances(&states::complete(&session, true).unwrap()).remove(0)
        })
        .collect();
    let run = mujoco.join().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let expected: Value = serde_json::from_slice(&run.stdout).unwrap();
    let (mut collisions, mut worst) = (0, 0.0_f64);
    for (number, found) in found.iter().enumerate() {
        let expected = expected[format!("{number:03}.toml")].as_f64().unwrap();
        assert_eq!(found.clearance_mm <= 0.0, expected <= 0.0, "{number}: {found:?} against {expected}");
        if expected > 0.0 {
            worst = worst.max((found.clearance_mm - expected).abs());
            assert!((found.clearance_mm - expected).abs() < 0.1, "{number}: {found:?} against {expected}");
        } else {
            collisions += 1;
        }
    }
    println!("{PLANS} plans, {collisions} collide, clearances within {worst:.4} mm");
    assert!((40..160).contains(&collisions), "{collisions}");
}

/// The bundled plan with a table, a spindle and holders.
fn with_bodies(folder: &Path, bodies: &str, clearance: &str) -> PathBuf {
    let plan = ready("hermle-c600u/chapter5.toml");
    let machine = std::fs::read_to_string(plan.parent().unwrap().join("machine.toml")).unwrap();
    std::fs::write(folder.join("machine.toml"), format!("{machine}\n{bodies}")).unwrap();
    let file = folder.join("plan.toml");
    std::fs::write(&file, format!("{}\n{clearance}", std::fs::read_to_string(plan).unwrap())).unwrap();
    file
}

const SPINDLE: &str = "[[body]]\nname = \"spindle\"\naxis = \"Z\"\ncapsule = { from_mm = [0, 0, 90], to_mm = [0, 0, 400], radius_mm = 40 }\n";
const TABLE: &str = "[[body]]\nname = \"table\"\naxis = \"C\"\nbox_mm = [[-160, -160, -110], [160, 160, -60]]\n";
const HOLDERS: &str = "[clearance]\nbar_radius_mm = 10\nworkpiece_holder = { radius_mm = 10, length_mm = 60 }\n\
                       spindle_holder = { radius_mm = 10, length_mm = 60 }\nleast_mm = 3\n";

#[test]
fn proposals_clear_and_commands_warn() {
    let folder = tempfile::tempdir().unwrap();
    let file = with_bodies(folder.path(), &format!("{SPINDLE}{TABLE}"), HOLDERS);
    let [plan, found, next] = ["plan.json", "found.json", "next.toml"].map(|name| folder.path().join(name));
    let run = |arguments: &[&str]| {
        let output = abbe(arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    run(&["plan", text(&file), "--no-effects", "--json", text(&plan)]);
    let parsed = |file: &Path| -> Value { serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap() };
    assert_eq!(parsed(&plan)["clearances"].as_array().unwrap().len(), 4);
    let few = ["--radii-mm", "50,100", "--heights-mm", "0,100", "--bars-mm", "100,150"];
    run(&[&["plan", text(&file), "--improve", "2", "--write", text(&next), "--json", text(&found)][..], &few].concat());
    let free = with_bodies(folder.path(), "", "");
    let all = folder.path().join("all.json");
    run(&[&["plan", text(&free), "--improve", "2", "--json", text(&all)][..], &few].concat());
    let candidates = |file: &Path| parsed(file)["improvement"]["candidate_tests"].as_u64().unwrap();
    assert!(candidates(&found) < candidates(&all), "{} of {}", candidates(&found), candidates(&all));
    let file = with_bodies(folder.path(), &format!("{SPINDLE}{TABLE}"), HOLDERS);
    assert!(file.exists());
    run(&["plan", text(&next), "--no-effects", "--json", text(&plan)]);
    for proposed in &parsed(&plan)["clearances"].as_array().unwrap()[4..] {
        assert!(proposed["clearance_mm"].as_f64().unwrap() >= 3.0, "{proposed}");
    }
    // A table where the balls are: every command that goes to the machine says so.
    let high = TABLE.replace("-60]]", "-5]]").replace("[clearance]", "");
    let file = with_bodies(folder.path(), &high, HOLDERS);
    let programs = folder.path().join("programs");
    let message = run(&["nc", text(&file), "--control", "linuxcnc", "--out", text(&programs)]);
    assert!(message.contains("and bar collide") || message.contains("bar and table collide"), "{message}");
    let sheet = abbe(&["sheet", text(&file), "--out", "-"]);
    assert!(String::from_utf8_lossy(&sheet.stdout).contains("Least clearance: "));
}

#[test]
fn bodies_and_sizes_that_cannot_be_used_are_errors() {
    for (bodies, clearance, expected) in [
        ("[[body]]\nname = \"t\"\n", "", "body `t` has no shape, or two"),
        ("[[body]]\nname = \"t\"\naxis = \"Q\"\nbox_mm = [[0, 0, 0], [1, 1, 1]]\n", "", "has no axis `Q`"),
        ("[[body]]\nname = \"t\"\nbox_mm = [[0, 0, 0], [1, 1, 0]]\n", "", "is not greater than that of the first"),
        ("[[body]]\nname = \"t\"\nbox_mm = [[0, 0, 0]]\n", "", "is not a list of two corners"),
        (&format!("{TABLE}{TABLE}"), "", "two bodies are called `table`"),
        (
            "[[body]]\nname = \"t\"\ncapsule = { from_mm = [0, 0, 0], to_mm = [0, 0, 1], radius_mm = 0 }\n",
            "",
            "must be greater than 0",
        ),
        ("", "[clearance]\nbar_radius_mm = -1\n", "must be greater than 0"),
        ("", "[clearance]\nleast_mm = -1\n", "cannot be negative"),
        ("", "[clearance]\nworkpiece_holder = { radius_mm = 5 }\n", "has no `length_mm`"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let file = with_bodies(folder.path(), bodies, clearance);
        let run = abbe(&["plan", text(&file)]);
        let message = String::from_utf8_lossy(&run.stderr).replace('\n', " ");
        assert_eq!(run.status.code(), Some(1), "{message}");
        assert!(message.contains(expected), "{expected}: {message}");
    }
}
