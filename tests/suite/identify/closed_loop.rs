//! The loop on a machine that is not the model: measure, trace, save, compensate, measure again, compare.
//!
//! The readings and the volumetric error before and after come from the plant, which shares no kinematics with the
//! model. It stands at the corrected commands; its session lists the nominal ones, as a control with compensation does.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use serde_json::Value;

use crate::plant::component::AxisName;
use crate::plant::effect::{Driver, Injected, Shape};
use crate::plant::files::{DriverColumns, session_files};
use crate::plant::kind::Kind;
use crate::plant::machine::{Displacement, Machine};
use crate::plant::plan::Plan;
use crate::plant::recipe::{Recipe, SimulatedSession};
use crate::plant::schedule::Instant;
use crate::suite::{abbe, text};

fn written(folder: &Path, name: &str, files: &[(String, String)]) -> PathBuf {
    let folder = folder.join(name);
    std::fs::create_dir(&folder).unwrap();
    for (name, contents) in files {
        std::fs::write(folder.join(name), contents).unwrap();
    }
    folder.join("session.toml")
}

fn run(arguments: &[&str]) {
    let done = abbe(arguments);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Commands of these positions, corrected by a saved model.
fn corrected(folder: &Path, model: &Path, positions: &[[f64; 5]]) -> Vec<[f64; 5]> {
    let mut file = String::from("x_mm,y_mm,z_mm,a_deg,c_deg\n");
    for position in positions {
        let shown = AxisName::ALL.map(|axis| match position[axis.index()] {
            radians if axis.is_rotary() => radians.to_degrees(),
            mm => mm,
        });
        let row: Vec<String> = shown.iter().map(|value| format!("{value:.12}")).collect();
        writeln!(file, "{}", row.join(",")).unwrap();
    }
    let (commands, out) = (folder.join("commands.csv"), folder.join("corrected.csv"));
    std::fs::write(&commands, file).unwrap();
    run(&["compensate", text(model), text(&commands), "--out", text(&out), "--tool-mm", "0,0,0", "--quiet"]);
    let read = |line: &str| -> [f64; 5] {
        let cells: Vec<f64> = line.split(',').take(5).map(|cell| cell.parse().unwrap()).collect();
        let mut position = [0.0; 5];
        for (axis, value) in AxisName::ALL.into_iter().zip(cells) {
            position[axis.index()] = if axis.is_rotary() { value.to_radians() } else { value };
        }
        position
    };
    std::fs::read_to_string(&out).unwrap().lines().skip(1).map(read).collect()
}

/// The displaced bodies of the plant at a position: its location errors and its effects.
fn displacement(session: &SimulatedSession, effects: &[Injected], like: &Instant, position: [f64; 5]) -> Displacement {
    let mut displacement = Displacement::default();
    for value in session.truth.unknowns.iter().filter(|value| !value.is_setup) {
        displacement.add(value.component, value.value * crate::plant::component::unit_size(value.component.unit()));
    }
    let mut at = *like;
    at.commanded.position = position;
    for effect in effects {
        effect.displace(&at, &mut displacement);
    }
    displacement
}

/// The tool point in the table frame, mm.
fn over_table(machine: &Machine, position: &[f64; 5], displacement: &Displacement) -> Vector3<f64> {
    let tool = machine.tool_point(position, displacement, [0.0; 3]);
    // Three points of the table give its frame.
    let at = |point: [f64; 3]| machine.workpiece_point(position, displacement, point);
    let origin = at([0.0; 3]);
    let axis = |i: usize| {
        let mut point = [0.0; 3];
        point[i] = 1.0;
        at(point) - origin
    };
    Vector3::from_fn(|i, _| axis(i).dot(&(tool - origin)))
}

/// Rms and largest length of the volumetric error of the plant over its nominal positions, µm.
fn volumetric(
    session: &SimulatedSession,
    effects: &[Injected],
    like: &Instant,
    nominal: &[[f64; 5]],
    commanded: &[[f64; 5]],
) -> f64 {
    let machine = Machine::default();
    let none = Displacement::default();
    let squares: f64 = nominal
        .iter()
        .zip(commanded)
        .map(|(nominal, commanded)| {
            let actual = displacement(session, effects, like, *commanded);
            let error = over_table(&machine, commanded, &actual) - over_table(&machine, nominal, &none);
            error.norm_squared()
        })
        .sum();
    1e3 * (squares / nominal.len() as f64).sqrt()
}

#[test]
fn the_machine_is_better_after_compensation_as_predicted() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let effect = Injected::new(
        crate::plant::component::Component::parse("EZC").unwrap(),
        Driver::Axis(AxisName::C),
        Shape::Harmonic { order: 2, phase_deg: 60.0 },
        3.0,
    );
    let recipe = Recipe::new(Kind::Rotary, 17).with(effect);
    let plan: Plan = recipe.plan();
    let before = recipe.draw_on(&plan);
    let session = written(folder, "before", &before.files);
    let (model, found) = (folder.join("before.json"), folder.join("trace.json"));
    run(&["trace", text(&session), "--save", text(&model), "--json", text(&found), "--quiet"]);
    assert_eq!(json(&found)["verdict"], "explained");

    // The plant stands at the corrected commands; machine and bars are the same, the balls are mounted again.
    let nominal: Vec<[f64; 5]> = plan.instants.iter().map(|instant| instant.commanded.position).collect();
    let mut standing = plan.clone();
    for (instant, position) in standing.instants.iter_mut().zip(corrected(folder, &model, &nominal)) {
        instant.commanded.position = position;
    }
    let kept = |id: &str| {
        let same =
            |value: &&crate::plant::recipe::TrueValue| value.id == id && (!value.is_setup || id.starts_with("bar"));
        before.truth.unknowns.iter().find(same).map(|value| value.value)
    };
    let again = Recipe { seed: 18, ..recipe.clone() }.draw_of(&standing, kept);
    let after = written(folder, "after", &session_files(&plan, &again.rows, DriverColumns::default(), true));
    let compared = folder.join("compare.json");
    let model_after = folder.join("after.json");
    run(&["trace", text(&after), "--save", text(&model_after), "--quiet"]);
    run(&["compare", text(&model), text(&model_after), "--json", text(&compared), "--quiet"]);

    // What the model states of the volumetric error, and what the plant has, over the positions of the tests.
    let compared = json(&compared);
    let of = |place: usize, key: &str| compared["workspace"][place][key].as_f64().unwrap();
    let (stated_before, stated_after) = (of(0, "rms_um"), of(1, "rms_um"));
    let u = (of(0, "u_um").powi(2) + of(1, "u_um").powi(2)).sqrt();
    assert!(stated_before > 10.0 && stated_after < 3.0 * u, "{stated_before} → {stated_after}, u {u}");
    assert!(compared["pairs"][0]["significant"].as_u64().unwrap() > 0);

    let spread: Vec<[f64; 5]> = (0..200)
        .map(|k| {
            let wave = |rate: f64| (f64::from(k) * rate).sin();
            [100.0 * wave(0.7), 100.0 * wave(1.1), 100.0 * wave(1.3), 0.6 + 0.5 * wave(0.9), 3.0 * wave(0.31)]
        })
        .collect();
    let like = &plan.instants[0];
    let commands = corrected(folder, &model, &spread);
    let true_before = volumetric(&before, &recipe.effects, like, &spread, &spread);
    let true_after = volumetric(&before, &recipe.effects, like, &spread, &commands);
    println!(
        "volumetric error, µm: stated {stated_before:.2} before, {stated_after:.2} after, u {u:.2}; of the plant elsewhere \
         {true_before:.2} before, {true_after:.2} after"
    );
    assert!(true_after < 0.25 * true_before && true_after < 3.0 * u, "{true_before} → {true_after}, u {u}");
}
