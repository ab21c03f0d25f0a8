//! Calibrated robots: the identified origins and parameters back in the maker's own file, and where each axis is.

use std::path::{Path, PathBuf};

use abbe::files::{self, Changes, ReadOptions, with_readings};
use abbe::identify::quantity::Given;
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::axis::AxisKind;
use abbe::model::chain::{AxisPosition, Frame, Machine};
use abbe::model::frames::Point;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use serde_json::Value;

use super::{
    ROBOTS, TARGET, abbe, created, file_of, in_metres, of_mujoco, of_table, positions, success, tables, target_mm,
    text, tip, urdf,
};

/// The model of a robot from simulated tracker readings of its plan: the file, with the machine's location errors by slot.
fn identified(machine: &Machine, folder: &Path, seed: u64) -> (PathBuf, Machine, Vec<f64>) {
    let (session, sources) = files::session_with_sources(&folder.join("plan.toml"), &ReadOptions::default()).unwrap();
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut given = Vec::new();
    for error in &session.unknowns {
        let share = 2.0 * random.random::<f64>() - 1.0;
        let is_angle = ["EA0", "EB0", "EC0"].iter().any(|start| error.to_string().starts_with(start));
        // The direction of a linear axis is not scaled to length 1 in the model, as it is in a URDF: q·ω²/2 apart.
        let is_linear = machine.axes.iter().any(|axis| axis.kind == AxisKind::Linear && error.axis == axis.name);
        let angle = if is_linear { 10.0 } else { 60.0 };
        let value = if is_angle { format!("{:.3}arcsec", angle * share) } else { format!("{:.3}um", 300.0 * share) };
        given.push(Given::parse(&format!("{error}={value}")).unwrap());
    }
    let simulation = Simulation { given, noise_mm: Some(2e-4), noise_rad: None, draw_setups: false, seed: 3 };
    let simulated = simulate(&session, &simulation).unwrap();
    let measured = folder.join("measured");
    std::fs::create_dir(&measured).unwrap();
    for (name, contents) in with_readings((&session, &sources), &simulated.readings, Changes::default()).unwrap() {
        std::fs::write(measured.join(name), contents).unwrap();
    }
    let model = folder.join("model.json");
    success(&abbe(&["fit", text(&measured.join("session.toml")), "--save", text(&model), "--quiet"]));
    let source = files::text(&model, "the model file").unwrap();
    let identified = abbe::identify::model_file::of_source(&source).unwrap();
    let slots = abbe::apply::export::frames::location_errors(&identified);
    (model, identified.machine, slots)
}

/// The target with errors of the machine, mm.
fn with_errors(machine: &Machine, slots: &[f64], q: &[f64], tool_mm: [f64; 3]) -> Vector3<f64> {
    let errors = machine.body_errors(|slot| slots[slot] != 0.0, |slot| slots[slot]);
    let state: Vec<AxisPosition<f64>> =
        machine.axes.iter().zip(q).map(|(axis, q)| AxisPosition::new(axis.kind, *q)).collect();
    Vector3::from(machine.in_r(Frame::Tool, &state, &errors, Point(tool_mm)).0)
}

/// Tracker readings of a robot with errors; fit; the origins in its own file: MuJoCo moves the target as the model does.
#[test]
fn calibrated_origins_go_back_into_the_file_of_the_robot() {
    let test = "calibrated_origins_go_back_into_the_file_of_the_robot";
    let Some(python) = test_needs::python(test, "numpy, mujoco") else { return };
    let place = tempfile::tempdir().unwrap();
    for (number, name) in ROBOTS.into_iter().enumerate() {
        let (machine, folder) =
            created(place.path(), name, &["--from-urdf", text(&urdf(name)), "--target-mm", "12,-34,56"]);
        let (model, own_machine, slots) = identified(&machine, &folder, 30 + number as u64);
        let patched = folder.join("patched.urdf");
        let own = urdf(name);
        let asked = ["export", text(&model), "--as", "urdf", "--patch", text(&own), "--out", text(&patched), "--quiet"];
        success(&abbe(&asked));

        // Only origins have changed.
        let [before, after] = [urdf(name), patched.clone()].map(|file| std::fs::read_to_string(file).unwrap());
        let without_origins = |text: &str| {
            let kept = text.split("<origin ").enumerate();
            kept.map(|(k, part)| if k == 0 { part } else { part.split_once("/>").unwrap().1 }).collect::<String>()
        };
        let plain = |text: &str| without_origins(text).split_whitespace().collect::<String>();
        assert_eq!(plain(&before), plain(&after), "{name}");
        assert_ne!(before, after, "{name}");

        // The file moves the target as the model does.
        let poses = positions(&machine, 100, 9);
        let found = of_mujoco(&python, &patched, tip(name), &in_metres(&machine, &poses), TARGET);
        let tool = target_mm(&folder);
        let worst = poses.iter().zip(&found);
        let worst =
            worst.map(|(q, found)| (with_errors(&own_machine, &slots, q, tool) - found).norm()).fold(0.0, f64::max);
        println!("{name}: {worst:.1e} mm");
        assert!(worst < 1e-6, "{name}: {worst:e} mm");
        // Another robot's file is refused.
        let other = urdf(if name == "ur5e" { "ur10" } else { "ur5e" });
        let refused = abbe(&["export", text(&model), "--as", "urdf", "--patch", text(&other), "--out", "-"]);
        assert!(
            String::from_utf8_lossy(&refused.stderr).contains("the model is not of the robot in the file"),
            "{name}"
        );
    }
}

/// A fixed pose of the JSON: `Trans(x, y, z)·Rz(yaw)·Ry(pitch)·Rx(roll)`.
fn fixed(pose: &Value) -> Matrix4<f64> {
    let three = |key: &str| -> [f64; 3] { serde_json::from_value(pose[key].clone()).unwrap() };
    let ([x, y, z], [roll, pitch, yaw]) = (three("xyz_mm"), three("rpy_deg"));
    let turn = |axis: Vector3<f64>, degrees: f64| Rotation3::new(axis * degrees.to_radians()).to_homogeneous();
    Matrix4::new_translation(&Vector3::new(x, y, z))
        * turn(Vector3::z(), yaw)
        * turn(Vector3::y(), pitch)
        * turn(Vector3::x(), roll)
}

/// The rows of a table of the JSON: a, α, β, θ and d of each joint, mm and degrees.
fn joints(table: &Value) -> Vec<[f64; 5]> {
    let keys = ["a_mm", "alpha_deg", "beta_deg", "theta_deg", "d_mm"];
    let row = |joint: &Value| keys.map(|key| joint[key].as_f64().unwrap());
    table["joints"].as_array().unwrap().iter().map(row).collect()
}

/// The frame of a joint of such a row at its position, rad, in the frame of the joint before.
fn joint_frame([a, alpha, beta, theta, d]: [f64; 5], q: f64, modified: bool) -> Matrix4<f64> {
    let turn = |axis: Vector3<f64>, degrees: f64| Rotation3::new(axis * degrees.to_radians()).to_homogeneous();
    let shift = |x: f64, z: f64| Matrix4::new_translation(&Vector3::new(x, 0.0, z));
    let about_x = shift(a, 0.0) * turn(Vector3::x(), alpha) * turn(Vector3::y(), beta);
    let about_z = turn(Vector3::z(), theta + q.to_degrees()) * shift(0.0, d);
    if modified { about_x * about_z } else { about_z * about_x }
}

/// The parameters in the maker's own form: the product of the exported table is the model, its nominal rows are the maker's,
/// and its calibrated rows lie beside them.
#[test]
fn calibrated_parameters_have_the_form_of_the_makers_table() {
    let place = tempfile::tempdir().unwrap();
    for (number, (name, modified, rows)) in tables().into_iter().enumerate().filter(|(_, (name, ..))| *name != "scara")
    {
        let file = place.path().join(format!("{name}.csv"));
        std::fs::write(&file, file_of(&rows, number)).unwrap();
        let convention = if modified { "modified" } else { "standard" };
        let asked = ["--from-dh", text(&file), "--convention", convention, "--target-mm", "12,-34,56"];
        let (machine, folder) = created(place.path(), name, &asked);
        let (model, own, slots) = identified(&machine, &folder, 50 + number as u64);
        let (out, json) = (folder.join("dh.csv"), folder.join("dh.json"));
        let asked = ["export", text(&model), "--as", "dh", "--convention", convention, "--dh", text(&file)];
        success(&abbe(&[&asked[..], &["--out", text(&out), "--json", text(&json), "--quiet"]].concat()));
        let found: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
        let (calibrated, nominal) = (joints(&found["calibrated"]), joints(&found["nominal"]));
        // Angles by their direction: 180 and -180 degrees are one.
        let apart = |a: f64, b: f64| ((a - b + 540.0).rem_euclid(360.0) - 180.0).abs();
        for ((own, (a, alpha, d, theta, _)), calibrated) in nominal.iter().zip(&rows).zip(&calibrated) {
            assert!((own[0] - a * 1e3).abs() < 1e-6 && (own[4] - d * 1e3).abs() < 1e-6, "{name}: {own:?}");
            assert!(
                apart(own[1], *alpha) < 1e-6 && own[2].abs() < 1e-6 && apart(own[3], *theta) < 1e-6,
                "{name}: {own:?}"
            );
            assert!(
                (own[0] - calibrated[0]).abs() < 3.0 && (own[4] - calibrated[4]).abs() < 3.0,
                "{name}: {calibrated:?}"
            );
            assert!((1..4).all(|k| apart(own[k], calibrated[k]) < 0.5), "{name}: {calibrated:?}");
        }
        // The exported table is one that `new` reads: the chain from the first frame to the last.
        let again = ["--from-dh", text(&out), "--convention", convention];
        let (again, again_folder) = created(place.path(), &format!("{name}-again"), &again);
        let end = target_mm(&again_folder);
        let tool = target_mm(&folder);
        for q in positions(&machine, 100, 11) {
            let base = fixed(&found["calibrated"]["base"]);
            let mut frame = base;
            calibrated.iter().zip(&q).for_each(|(row, q)| frame *= joint_frame(*row, *q, modified));
            let of_chain = (base.try_inverse().unwrap() * frame).fixed_view::<3, 1>(0, 3).into_owned();
            let off = (super::point_mm(&again, &q, end) - of_chain).norm();
            assert!(off < 1e-6, "{name}: {off:e} mm");
            let point = (frame * fixed(&found["calibrated"]["tool"])).fixed_view::<3, 1>(0, 3).into_owned();
            let off = (point - with_errors(&own, &slots, &q, tool)).norm();
            assert!(off < 1e-6, "{name}: {off:e} mm");
        }
        // The uncertainties are those of the covariance.
        let ids: Vec<String> = serde_json::from_value(found["dh_parameters"].clone()).unwrap();
        let covariance: Vec<Vec<f64>> = serde_json::from_value(found["dh_covariance"].clone()).unwrap();
        assert_eq!((ids.len(), covariance.len()), (5 * machine.axes.len(), 5 * machine.axes.len()));
        let second = &found["dh_u"][2];
        let place = ids.iter().position(|id| *id == "J3.a_mm").unwrap();
        if let Some(u) = second["a_mm"].as_f64() {
            assert!((u * u - covariance[place][place]).abs() < 1e-12 && u > 0.0, "{name}: {u}");
        }
    }
}

/// What remains of the errors of the target at these places, mm, where base and target are set up anew: rms in µm after a
/// rotation and a shift of the base and a shift of the target, whose effects at each place are the columns of `by_target`.
fn remaining_um(errors: &[Vector3<f64>], places: &[Vector3<f64>], by_target: &[Matrix3<f64>]) -> f64 {
    let design = DMatrix::from_fn(3 * places.len(), 9, |row, column| match (row / 3, row % 3, column) {
        (_, coordinate, 0..3) => f64::from(u8::from(coordinate == column)),
        (pose, coordinate, 3..6) => Vector3::ith(column - 3, 1.0).cross(&places[pose])[coordinate],
        (pose, coordinate, _) => by_target[pose][(coordinate, column - 6)],
    });
    let errors = DVector::from_iterator(design.nrows(), errors.iter().flat_map(|error| error.iter().copied()));
    let set_up = design.clone().svd(true, true).solve(&errors, 1e-9).unwrap();
    1e3 * ((errors - design * set_up).norm_squared() / places.len() as f64).sqrt()
}

/// J2 has an angular error twice per turn, which no table holds. The written table leaves less than the plain location errors,
/// and no more than that of a fit without the effect; screen and file state what products of the tables leave.
#[test]
fn parameters_without_an_effect_leave_least() {
    let (_, _, rows) = tables().swap_remove(0);
    let place = tempfile::tempdir().unwrap();
    let maker = place.path().join("ur5e.csv");
    std::fs::write(&maker, file_of(&rows, 0)).unwrap();
    let asked = ["--from-dh", text(&maker), "--convention", "standard", "--target-mm", "12,-34,56"];
    let (_, folder) = created(place.path(), "ur5e", &asked);
    let mut random = rand_pcg::Pcg64::seed_from_u64(60);
    let mut drawn = |middle: f64, half: f64| middle + half * (2.0 * random.random::<f64>() - 1.0);
    let ranges = [(0.0, 1.7), (-1.1, 0.8), (1.1, 0.8), (0.0, 1.7), (0.0, 1.7), (0.0, 1.7)];
    let zeros = [0.0, 60.0, -40.0, 0.0, 30.0, 0.0].map(|arcsec: f64| (arcsec / 3600.0).to_radians());
    let with_zeros = |q: &[f64; 6]| -> [f64; 6] { std::array::from_fn(|joint| q[joint] + zeros[joint]) };
    let carried = |q: &[f64; 6]| of_table(&rows, false, q, TARGET);
    let actual = |q: &[f64; 6]| {
        let mut turned = with_zeros(q);
        turned[1] += (100.0_f64 / 3600.0).to_radians() * (2.0 * q[1] + 0.5).cos();
        carried(&turned)
    };
    let mut readings = "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,px_mm,py_mm,pz_mm\n".to_string();
    for _ in 0..150 {
        let q = ranges.map(|(middle, half)| drawn(middle, half));
        let seen = actual(&q) + Vector3::from_fn(|_, _| drawn(0.0, 0.009));
        let cells = q.iter().map(|q| q.to_degrees()).chain(seen.iter().copied());
        readings += &(cells.map(|cell| format!("{cell:.9}")).collect::<Vec<_>>().join(",") + "\n");
    }
    std::fs::write(folder.join("poses.csv"), readings).unwrap();
    let exported = |name: &str, effect: &str| {
        let [session, model, out, json] =
            ["toml", "json", "csv", "export.json"].map(|end| folder.join(format!("{name}.{end}")));
        let of_session = format!(
            "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"tracker\"\nnoise_um = 5\n[unknowns]\n\
             errors = [\"E?0J*\"]\n{effect}[[test]]\nname = \"T\"\ndata = \"poses.csv\"\npath = {{ kind = \"list\" }}\n\
             target_mm = {:?}\ntarget_u_um = inf\n",
            target_mm(&folder)
        );
        std::fs::write(&session, of_session).unwrap();
        success(&abbe(&["fit", text(&session), "--save", text(&model), "--quiet"]));
        let asked = ["export", text(&model), "--as", "dh", "--convention", "standard", "--dh", text(&maker)];
        let screen = success(&abbe(&[&asked[..], &["--out", text(&out), "--json", text(&json)]].concat()));
        let found: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
        (found, screen, std::fs::read_to_string(&out).unwrap())
    };
    let effect = "[[effect]]\ncomponent = \"EBJ2\"\ndriver = \"J2\"\nshape = \"harmonic\"\norder = 2\n";
    let (found, screen, file) = exported("effect", effect);
    let (plain_fit, ..) = exported("plain", "");

    // Other poses within the same ranges.
    let poses: Vec<[f64; 6]> = (0..1500).map(|_| ranges.map(|(middle, half)| drawn(middle, half))).collect();
    let places: Vec<Vector3<f64>> = poses.iter().map(carried).collect();
    let shifted =
        |q: &[f64; 6], k: usize| of_table(&rows, false, q, (Vector3::from(TARGET) + Vector3::ith(k, 1.0)).into());
    let by_target: Vec<Matrix3<f64>> = poses
        .iter()
        .zip(&places)
        .map(|(q, place)| Matrix3::from_columns(&[0, 1, 2].map(|k| shifted(q, k) - place)))
        .collect();
    let left = |described: &dyn Fn(&[f64; 6]) -> Vector3<f64>| {
        let errors: Vec<Vector3<f64>> = poses.iter().map(|q| actual(q) - described(q)).collect();
        remaining_um(&errors, &places, &by_target)
    };
    let of_export = |found: &Value| {
        let table = &found["calibrated"];
        let (rows, base, tool) = (joints(table), fixed(&table["base"]), fixed(&table["tool"]));
        left(&|q: &[f64; 6]| {
            let frame = rows.iter().zip(q).fold(base, |frame, (row, q)| frame * joint_frame(*row, *q, false));
            (frame * tool).fixed_view::<3, 1>(0, 3).into_owned()
        })
    };
    let (without, plain, written) = (left(&carried), left(&|q: &[f64; 6]| carried(&with_zeros(q))), of_export(&found));
    let of_plain_fit = of_export(&plain_fit);
    println!("{without:.1}, {plain:.1}, {written:.1}, plain fit {of_plain_fit:.1} µm");
    assert!(written < 0.6 * plain && written < 1.02 * of_plain_fit, "{written}, {plain}, plain fit {of_plain_fit}");
    for (key, expected) in [("without", without), ("plain", plain), ("written", written)] {
        let stated = found["remaining"][key]["rms_um"].as_f64().unwrap();
        assert!((stated / expected - 1.0).abs() < 0.05, "{key}: {stated} µm, {expected} µm expected");
        assert!([&screen, &file].iter().all(|said| said.contains(&format!(" {stated:.1}"))), "{key}: {screen}\n{file}");
    }
    // The figures presume what the numbers above take off: a base and a target that are set up anew.
    let presumed = "base and target are presumed to be set up anew";
    assert!(screen.contains(presumed) && file.contains(presumed), "{screen}\n{file}");
    assert_eq!(found["remaining"]["set_up_anew"], true);
    assert!(screen.contains("left out: EBJ2~J2:h2") && plain_fit["remaining"].is_null(), "{screen}");
}

/// Where each axis is, for any control: the identified change agrees with what was simulated, within its uncertainty.
#[test]
fn the_neutral_table_says_where_each_axis_is() {
    let place = tempfile::tempdir().unwrap();
    let session = crate::suite::ready("hermle-c600u/measured/session.toml");
    let [model, out, json] = ["model.json", "table.csv", "table.json"].map(|name| place.path().join(name));
    success(&abbe(&["fit", text(&session), "--save", text(&model), "--quiet"]));
    success(&abbe(&["export", text(&model), "--as", "table", "--out", text(&out), "--json", text(&json), "--quiet"]));
    let found: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let parameters: Value = serde_json::from_slice(&std::fs::read(&model).unwrap()).unwrap();
    let value = |id: &str| {
        let all = parameters["parameters"].as_array().unwrap();
        all.iter().find(|p| p["id"] == id).unwrap()["internal"].as_f64().unwrap()
    };
    let axes = found["axes"].as_array().unwrap();
    let names: Vec<&str> = axes.iter().map(|axis| axis["axis"].as_str().unwrap()).collect();
    assert_eq!(names, ["C", "A", "Y", "X", "Z"]);
    let of = |axis: usize, entry: &str, k: usize, key: &str| axes[axis][entry][k][key].as_f64();
    // A turns next to the bed: its line moves by its own errors. C lies on it.
    assert!((of(1, "point_mm", 1, "change").unwrap() - value("EY0A")).abs() < 1e-6);
    assert!((of(1, "direction", 2, "change").unwrap() + value("EB0A")).abs() < 1e-8);
    // Its point at the origin moves with the errors of A too; EX0A is not estimated.
    assert!((of(0, "point_mm", 0, "change").unwrap() - value("EX0C")).abs() < 1e-5);
    // Its uncertainty is that of the one estimated error that moves it.
    let u = {
        let all = parameters["parameters"].as_array().unwrap();
        let own = all.iter().find(|p| p["id"] == "EX0C").unwrap();
        assert_eq!(own["unit"], "um");
        own["u"].as_f64().unwrap() * 1e-3
    };
    let found = of(0, "point_mm", 0, "u").unwrap();
    assert!((found / u - 1.0).abs() < 1e-3, "{found} mm, {u} mm expected");
    assert_eq!(of(2, "direction", 1, "nominal"), Some(1.0));
    assert!(axes[2]["point_mm"].as_array().unwrap().is_empty(), "a linear axis is nowhere in particular");
    let table = std::fs::read_to_string(&out).unwrap();
    assert!(table.starts_with("# Where each axis is") && table.contains("C,rotary,point x,mm,"), "{table}");
}
