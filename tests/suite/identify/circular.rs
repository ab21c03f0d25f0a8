//! Ball-bar figures against closed forms, the independent plant and the sample of another simulator.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use serde_json::Value;

use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Recipe, Shape};
use crate::suite::{abbe, text};

const RADIUS_MM: f64 = 100.0;
const FEED_MM_S: f64 = 20.0;
const STEP: f64 = PI / 360.0;

/// A reading of a circle: path angle, path direction, direction of each axis, path angle since the reversal of each
/// axis, and the end of that reversal.
struct At {
    angle: f64,
    path: f64,
    travels: [f64; 2],
    turned: [Option<(f64, f64)>; 2],
}

/// Writes a session of a circle in XY with the tool displaced by `error`, mm along X and Y: exact geometry, no formula
/// of the diagnosis.
fn circle(folder: &Path, directions: &[f64], time: bool, error: impl Fn(&At) -> [f64; 2]) -> Value {
    let mut rows = String::from(if time { "time_s," } else { "" });
    rows.push_str("run,x_mm,y_mm,length_mm\n");
    let mut run = 0;
    for _ in 0..2 {
        for path in directions {
            run += 1;
            for k in 0..=720 {
                let angle = if *path > 0.0 { k as f64 * STEP } else { TAU - k as f64 * STEP };
                // The reading at a reversal belongs to the travel before it.
                let middle = angle - path * STEP / 2.0;
                let middle = if k == 0 { angle + path * STEP / 2.0 } else { middle };
                let travels = [-path * middle.sin(), path * middle.cos()].map(f64::signum);
                let along = if *path > 0.0 { angle } else { TAU - angle };
                let turned = [(PI, -1.0), (PI / 2.0, *path)].map(|(first, end)| {
                    let passed = along - first - 1e-9;
                    let again = (passed / PI).floor();
                    (passed > 0.0).then(|| (passed - again * PI, if again == 0.0 { end } else { -end }))
                });
                let at = At { angle, path: *path, travels, turned };
                let off = error(&at);
                let (x, y) = (RADIUS_MM * angle.cos(), RADIUS_MM * angle.sin());
                let length = (x + off[0]).hypot(y + off[1]);
                if time {
                    let seconds = f64::from(run) * 60.0 + k as f64 * STEP * RADIUS_MM / FEED_MM_S;
                    rows.push_str(&format!("{seconds:.6},"));
                }
                rows.push_str(&format!("{run},{x:.9},{y:.9},{length:.9}\n"));
            }
        }
    }
    std::fs::write(folder.join("xy.csv"), rows).unwrap();
    let session = folder.join("session.toml");
    let text_of = "[machine]\nchain = \"w b Y X Z t\"\naxis.X = {}\naxis.Y = {}\naxis.Z = {}\n[instrument]\nkind = \"ballbar\"\nnoise_um = 0.01\n\
         [unknowns]\nerrors = []\n[[test]]\nname = \"XY\"\ndata = \"xy.csv\"\nbar_mm = 100\nworkpiece_ball_mm = [0, 0, 0]\n\
         spindle_ball_mm = [0, 0, 0]\nworkpiece_ball_u_um = inf\nbar_u_um = inf\n";
    std::fs::write(&session, text_of).unwrap();
    figures(&session)[0].clone()
}

/// The ball-bar figures of `abbe fit` for a session.
fn figures(session: &Path) -> Vec<Value> {
    let run = abbe(&["fit", text(session), "--json", "-"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let fit: Value = serde_json::from_slice(&run.stdout).unwrap();
    fit["circular"].as_array().unwrap().clone()
}

fn fault<'v>(test: &'v Value, fault: &str, axes: &str) -> Option<&'v Value> {
    test["diagnosis"].as_array().unwrap().iter().find(|found| found["fault"] == fault && found["axes"] == axes)
}

/// A figure of a fault with its uncertainty.
fn figure(test: &Value, name: &str, axes: &str, id: &str) -> (f64, f64) {
    let Some(fault) = fault(test, name, axes) else { panic!("no {name} of {axes}: {test}") };
    let value = fault["values"].as_array().unwrap().iter().find(|value| value["id"] == id).unwrap();
    (value["value"].as_f64().unwrap(), value["u"].as_f64().unwrap())
}

fn is(test: &Value, name: &str, axes: &str, id: &str, expected: f64, within: f64) {
    let (value, _) = figure(test, name, axes, id);
    assert!((value - expected).abs() < within, "{name} of {axes}, {id}: {value}, not {expected}");
}

fn um(test: &Value, key: &str) -> f64 {
    test[key].as_f64().unwrap()
}

/// The figure of a standard with an identifier, of a test or of one direction.
fn figure_of_standard<'v>(of: &'v Value, id: &str) -> Option<&'v Value> {
    of["figures"].as_array().unwrap().iter().find(|figure| figure["id"] == id)
}

/// Its value, µm.
fn figure_um(of: &Value, id: &str) -> f64 {
    let figure = figure_of_standard(of, id).unwrap_or_else(|| panic!("no {id}: {of}"));
    assert_eq!(figure["unit"], "um", "{figure}");
    um(figure, "value")
}

/// A cubic error of one axis is not reported as a cyclic error of the other; a screw pitch error is.
#[test]
fn a_cubic_is_not_called_cyclic() {
    let folder = tempfile::tempdir().unwrap();
    for axis in 0..2 {
        for noise in [0.0, 0.1e-3] {
            let mut drawn = 12345_u64;
            let drawn = std::cell::RefCell::new(&mut drawn);
            let test = circle(folder.path(), &[1.0, -1.0], true, |at| {
                // A linear congruential generator, independent of the generators of the workspace.
                let mut state = drawn.borrow_mut();
                **state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let random = ((**state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5) * 3.46 * noise;
                let q = [at.angle.cos(), at.angle.sin()];
                let mut off = [random * q[0], random * q[1]];
                off[axis] += 4e-3 * q[axis].powi(3);
                off
            });
            for name in ["X", "Y"] {
                assert!(fault(&test, "cyclic error", name).is_none(), "{test}");
                assert!(fault(&test, "reversal spike", name).is_none(), "{test}");
            }
            is(&test, "third-order positioning", "XY", "sum", 4.0, 0.1);
            // cos⁴θ is ⅜ + ½cos 2θ + ⅛cos 4θ: the second term is that of a linear error, 4 µm over 100 mm by one axis.
            let sign = if axis == 0 { 1.0 } else { -1.0 };
            is(&test, "scale mismatch", "XY", "ratio", sign * 40.0, 0.5);
            let undetermined = test["not_identifiable"].to_string();
            assert!(undetermined.contains("third-order errors of X and Y are confounded"), "{undetermined}");
        }
    }
    let test = circle(folder.path(), &[1.0, -1.0], true, |at| [0.0, 2e-3 * at.angle.cos().powi(3)]);
    is(&test, "third-order straightness", "XY", "difference", 2.0, 0.05);
}

/// Signs in the diagnosis are those of the effects of the same name, for either direction of the axes and either side
/// of the machine.
#[test]
fn figures_have_the_signs_of_error_motions() {
    let folder = tempfile::tempdir().unwrap();
    for (number, (chain, x, y)) in [
        ("w b Y X Z t", -1, 1),
        ("w b Y X Z t", 1, -1),
        ("w X b Y Z t", -1, 1),
        ("w X b Y Z t", 1, -1),
        ("w X Y b Z t", -1, -1),
    ]
    .into_iter()
    .enumerate()
    {
        let plan = folder.path().join("plan.toml");
        let text_of = format!(
            "[machine]\nchain = \"{chain}\"\naxis.X = {{ direction = [{x}, 0, 0] }}\naxis.Y = {{ direction = [0, {y}, 0] }}\naxis.Z = {{}}\n\
             [instrument]\nkind = \"ballbar\"\nnoise_um = 0.05\n[unknowns]\nerrors = [\"EC0Y\"]\n\
             [[effect]]\ncomponent = \"EXX\"\nshape = \"backlash\"\n[[effect]]\ncomponent = \"EYX\"\ndriver = \"X\"\nshape = \"backlash\"\n\
             [[effect]]\ncomponent = \"EXY\"\ndriver = \"Y\"\nshape = \"power\"\norder = 2\n\
             [[test]]\nname = \"XY\"\nbar_mm = 100\nworkpiece_ball_mm = [0, 0, 0]\nspindle_ball_mm = [0, 0, 0]\nworkpiece_ball_u_um = inf\n\
             path = {{ kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 1 }}\n"
        );
        std::fs::write(&plan, text_of).unwrap();
        let out = folder.path().join(format!("run{number}"));
        let run = abbe(&[
            "simulate",
            text(&plan),
            "--out",
            text(&out),
            "--error",
            "EC0Y=4arcsec",
            "--effect",
            "EXX~X:backlash=4um",
            "--effect",
            "EYX~X:backlash=3um",
            "--effect",
            "EXY~Y:power2=5um",
        ]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let test = figures(&out.join("session.toml"))[0].clone();
        for (name, axes, id, expected) in [
            ("backlash", "X", "X+", 4.0),
            ("backlash", "X", "X-", 4.0),
            ("lateral play", "X", "play", 3.0),
            ("straightness", "Y", "sagitta", 5.0),
            ("squareness", "XY", "angle", 4.0 * PI / 0.648),
        ] {
            is(&test, name, axes, id, expected, 0.15);
        }
    }
}

/// A chip on the ball is no error of the machine: a single outlier changes no figure.
#[test]
fn an_outlier_is_excluded() {
    let folder = tempfile::tempdir().unwrap();
    let ellipse = |at: &At| [40e-6 * RADIUS_MM * at.angle.cos(), 10e-6 * RADIUS_MM * at.angle.sin()];
    let outwards = |at: &At, mm: f64| [mm * at.angle.cos(), mm * at.angle.sin()];
    for (chip_mm, there) in [(0.03, 137), (-0.02, 400)] {
        let test = circle(folder.path(), &[1.0, -1.0], true, |at| {
            let here = at.path > 0.0 && (at.angle / STEP).round() as usize == there;
            let chip = outwards(at, if here { chip_mm } else { 0.0 });
            let smooth = ellipse(at);
            [smooth[0] + chip[0], smooth[1] + chip[1]]
        });
        for direction in test["directions"].as_array().unwrap() {
            assert!((figure_um(direction, "circular_deviation") - 3.0).abs() < 0.01, "{test}");
            assert!((figure_um(direction, "radial_deviation_max") - 4.0).abs() < 0.01);
            assert!((figure_um(direction, "radial_deviation_min") - 1.0).abs() < 0.01);
        }
        assert!((figure_um(&test, "bidirectional_circular_deviation") - 3.0).abs() < 0.01);
        assert!(figure_um(&test, "hysteresis") < 0.01, "{test}");
        is(&test, "scale mismatch", "XY", "ratio", 30.0, 0.05);
    }
}

#[test]
fn every_fault_agrees_with_its_closed_form() {
    let folder = tempfile::tempdir().unwrap();
    let both = [1.0, -1.0];
    let q = |at: &At| [RADIUS_MM * at.angle.cos(), RADIUS_MM * at.angle.sin()];

    // The scale of X exceeds that of Y by 30 ppm: an ellipse.
    let test = circle(folder.path(), &both, true, |at| [40e-6 * q(at)[0], 10e-6 * q(at)[1]]);
    is(&test, "scale mismatch", "XY", "ratio", 30.0, 0.01);
    is(&test, "scale mismatch", "XY", "over_diameter", 6.0, 0.002);
    for direction in test["directions"].as_array().unwrap() {
        assert!((figure_um(direction, "circular_deviation") - 3.0).abs() < 0.006, "{test}");
        assert!((figure_um(direction, "radial_deviation_max") - 4.0).abs() < 0.006);
        assert!((figure_um(direction, "radial_deviation_min") - 1.0).abs() < 0.006);
    }
    assert!((figure_um(&test, "bidirectional_circular_deviation") - 3.0).abs() < 0.006);
    assert!((figure_um(&test, "mean_bidirectional_radial_deviation") - 2.5).abs() < 0.006);
    assert!(figure_um(&test, "hysteresis") < 0.002);
    assert!(test["diagnosis"][0]["fault"] == "scale mismatch");
    assert!(um(&test["diagnosis"][0], "share_percent") > 99.0, "{test}");

    // Y is inclined by 20 µm/m towards −X: the angle between the positive axes exceeds 90°.
    let test = circle(folder.path(), &both, true, |at| [-20e-6 * q(at)[1], 0.0]);
    is(&test, "squareness", "XY", "angle", 20.0, 0.01);
    assert!((figure_um(&test, "bidirectional_circular_deviation") - 2.0).abs() < 0.006);

    // X lags by 0.3 ms, Y by 0.1 ms.
    let test = circle(folder.path(), &both, true, |at| {
        let speed = [-at.path * FEED_MM_S * at.angle.sin(), at.path * FEED_MM_S * at.angle.cos()];
        [-0.3e-3 * speed[0], -0.1e-3 * speed[1]]
    });
    is(&test, "servo mismatch", "XY", "delay", 0.2, 1e-3);
    assert!((um(&test, "feed_mm_min") - 1200.0).abs() < 1.0);
    // ½v·Δτ·sin 2θ in both signs: a difference of twice 2 µm.
    assert!((figure_um(&test, "hysteresis") - 4.0).abs() < 0.01, "{test}");

    // X loses 3 µm at its positive end and 1 µm at the other.
    let test = circle(folder.path(), &both, true, |at| [-0.5 * (2e-3 + 1e-3 * at.angle.cos()) * at.travels[0], 0.0]);
    is(&test, "backlash", "X", "X+", 3.0, 0.02);
    is(&test, "backlash", "X", "X-", 1.0, 0.02);
    is(&test, "backlash", "Y", "Y+", 0.0, 0.02);

    // X has a lateral play of 2 µm along Y and a bow of 5 µm.
    let test =
        circle(folder.path(), &both, true, |at| [0.0, -0.5 * 2e-3 * at.travels[0] + 5e-3 * at.angle.cos().powi(2)]);
    is(&test, "lateral play", "X", "play", 2.0, 0.02);
    is(&test, "straightness", "X", "sagitta", 5.0, 0.02);
    is(&test, "straightness", "Y", "sagitta", 0.0, 0.02);

    // Y sticks for 2° at the reversal at its positive end.
    let test = circle(folder.path(), &both, true, |at| match at.turned[1] {
        Some((since, end)) if end > 0.0 && since < 0.5 => [0.0, 6e-3 * (-since / 2f64.to_radians()).exp()],
        _ => [0.0, 0.0],
    });
    is(&test, "reversal spike", "Y", "Y+", 6.0, 0.2);
    is(&test, "reversal spike", "Y", "width", 2.0, 1e-9);

    // A cyclic error of X with a pitch of 5 mm, 1.2 µm forward and 0.8 µm backward.
    let test = circle(folder.path(), &both, true, |at| {
        let size = if at.travels[0] > 0.0 { 1.2e-3 } else { 0.8e-3 };
        [size * (TAU * q(at)[0] / 5.0 + 0.7).cos(), 0.0]
    });
    is(&test, "cyclic error", "X", "pitch", 5.0, 0.01);
    is(&test, "cyclic error", "X", "forward", 1.2, 0.02);
    is(&test, "cyclic error", "X", "backward", 0.8, 0.02);
    assert!(fault(&test, "cyclic error", "Y").is_none() && fault(&test, "reversal spike", "X").is_none());
}

/// Faults that are also effects of the library: a fit of the session that declares them finds the figures of the diagnosis,
/// with their uncertainties.
#[test]
fn faults_that_are_effects_have_the_figures_of_a_fit() {
    let folder = tempfile::tempdir().unwrap();
    let drawn = std::cell::Cell::new(9876_u64);
    let test = circle(folder.path(), &[1.0, -1.0], true, |at| {
        drawn.set(drawn.get().wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407));
        let random = ((drawn.get() >> 33) as f64 / (1_u64 << 31) as f64 - 0.5) * 3.46e-4;
        let (x, y) = (at.angle.cos(), at.angle.sin());
        [
            (3e-3 + random) * x - 2e-3 * y - 1.5e-3 * at.travels[0] + 4e-3 * y * y + 2e-3 * at.path * y,
            random * y - 1e-3 * at.travels[0] - 0.5e-3 * at.travels[1] + 5e-3 * x * x,
        ]
    });
    let file = folder.path().join("session.toml");
    let effect = |(component, shape): (&str, &str)| {
        format!("[[effect]]\ncomponent = \"{component}\"\ndriver = \"{}\"\nshape = {shape}\n", &component[2..])
    };
    let (backlash, square) = ("\"backlash\"", "\"power\"\norder = 2");
    let effects = [("EXX", "\"power\"\norder = 1"), ("EXX", backlash), ("EYY", backlash), ("EYX", backlash)];
    let others = [("EXY", backlash), ("EYX", square), ("EXY", square), ("EXX", "\"lag\"")];
    let effects: String = effects.into_iter().chain(others).map(effect).collect();
    let declared = std::fs::read_to_string(&file).unwrap();
    let declared =
        declared.replace("errors = []", "errors = [\"EC0Y\"]").replace("[[test]]", &format!("{effects}[[test]]"));
    std::fs::write(&file, declared).unwrap();
    let run = abbe(&["fit", text(&file), "--json", "-"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let fit: Value = serde_json::from_slice(&run.stdout).unwrap();
    let estimate = |id: &str| {
        let found = fit["parameters"].as_array().unwrap().iter().find(|parameter| parameter["id"] == id).unwrap();
        (um(found, "value"), um(found, "u"))
    };
    // A square counts in 100 mm, the radius.
    for (name, axes, id, effect, unit) in [
        ("scale mismatch", "XY", "ratio", "EXX~X:power1", 1.0),
        ("squareness", "XY", "angle", "EC0Y", PI / 0.648),
        ("servo mismatch", "XY", "delay", "EXX~X:lag", 1.0),
        ("lateral play", "X", "play", "EYX~X:backlash", 1.0),
        ("lateral play", "Y", "play", "EXY~Y:backlash", 1.0),
        ("straightness", "X", "sagitta", "EYX~X:power2", 1.0),
        ("straightness", "Y", "sagitta", "EXY~Y:power2", 1.0),
    ] {
        let ((value, u), (estimate, u_of_fit)) = (figure(&test, name, axes, id), estimate(effect));
        assert!((value - estimate * unit).abs() < 0.05 * u, "{name} of {axes}: {value}, {effect} {estimate}");
        assert!((u / (u_of_fit * unit) - 1.0).abs() < 0.1, "{name} of {axes}: u {u}, {effect} {u_of_fit}");
    }
    for axis in ["X", "Y"] {
        let [plus, minus] = ["+", "-"].map(|end| figure(&test, "backlash", axis, &format!("{axis}{end}")));
        let (estimate, _) = estimate(&format!("E{axis}{axis}~{axis}:backlash"));
        assert!((0.5 * (plus.0 + minus.0) - estimate).abs() < 0.05 * plus.1, "{plus:?} {minus:?}, fit {estimate}");
    }
}

#[test]
fn quantities_that_one_direction_does_not_determine_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let test = circle(folder.path(), &[1.0], false, |at| [-20e-6 * RADIUS_MM * at.angle.sin(), 0.0]);
    assert!(fault(&test, "servo mismatch", "XY").is_none() && fault(&test, "lateral play", "X").is_none());
    is(&test, "squareness", "XY", "angle", 20.0, 0.01);
    let undetermined = test["not_identifiable"].to_string();
    assert!(
        undetermined.contains("servo mismatch is confounded with squareness")
            && undetermined.contains("hysteresis require"),
        "{undetermined}"
    );
    assert!(figure_of_standard(&test, "hysteresis").is_none() && test.get("feed_mm_min").is_none());
    // Without time a lag is stated as a length.
    let test = circle(folder.path(), &[1.0, -1.0], false, |_| [0.0, 0.0]);
    let undetermined = test["not_identifiable"].to_string();
    assert!(undetermined.contains("not in ms") && undetermined.contains("one feed"), "{undetermined}");
    figure(&test, "servo mismatch", "XY", "lag");
}

#[test]
fn the_faults_of_the_plant_are_found_within_their_uncertainty() {
    let motion =
        |freedom, axis, shape, size| Injected::new(Component::Motion(freedom, axis), Driver::Axis(axis), shape, size);
    let backlash = motion(Freedom::Y, AxisName::Y, Shape::Backlash, 4.0);
    let play = motion(Freedom::Y, AxisName::X, Shape::Backlash, 1.5);
    let lag = motion(Freedom::X, AxisName::X, Shape::Lag, 0.05);
    let square = Injected::new(Component::Location(Freedom::C, AxisName::Y), Driver::Nothing, Shape::Constant, 3.0);
    let mut pulls = Vec::new();
    for seed in 0..4 {
        let mut recipe = Recipe::new(Kind::LinearCircles, 40 + seed);
        for effect in [&backlash, &play, &lag, &square] {
            recipe = recipe.with(effect.clone());
        }
        let folder = tempfile::tempdir().unwrap();
        recipe.draw().write(folder.path()).unwrap();
        for test in figures(&folder.path().join("session.toml")) {
            let arcsec = PI / 648_000.0 * 1e6;
            for (name, axes, id, expected) in [
                ("backlash", "Y", "Y+", 4.0),
                ("backlash", "Y", "Y-", 4.0),
                ("backlash", "X", "X+", 0.0),
                ("lateral play", "X", "play", 1.5),
                ("lateral play", "Y", "play", 0.0),
                ("servo mismatch", "XY", "delay", 0.05),
                ("squareness", "XY", "angle", 3.0 * arcsec),
                ("scale mismatch", "XY", "ratio", 0.0),
                ("straightness", "X", "sagitta", 0.0),
            ] {
                let (value, u) = figure(&test, name, axes, id);
                pulls.push((value - expected) / u);
                assert!((value - expected).abs() < 4.5 * u, "{name} {axes} {id}: {value} ± {u}, not {expected}");
            }
            assert!(um(&test, "diagnosis_rms_um") < 0.35, "{test}");
            assert!(test["not_identifiable"].to_string().contains("compare with XY-F"), "{test}");
        }
    }
    let rms = (pulls.iter().map(|pull| pull * pull).sum::<f64>() / pulls.len() as f64).sqrt();
    println!("{} pulls, rms {rms:.2}", pulls.len());
    // 72 pulls, whose readings are rounded to 0.1 µm.
    assert!((0.7..1.3).contains(&rms), "pulls {rms}");
}

#[test]
fn rotary_axes_have_figures_without_a_diagnosis() {
    let axial_motion = Injected::new(
        Component::Motion(Freedom::X, AxisName::C),
        Driver::Axis(AxisName::C),
        Shape::Harmonic { order: 3, phase_deg: 0.0 },
        5.0,
    );
    let folder = tempfile::tempdir().unwrap();
    Recipe::new(Kind::Rotary, 7).with(axial_motion).draw().write(folder.path()).unwrap();
    let tests = figures(&folder.path().join("session.toml"));
    let c = tests.iter().find(|test| test["test"] == "C100").unwrap();
    assert_eq!(c["axes"], "C");
    assert!(c.get("diagnosis").is_none() && c.get("radius_mm").is_none());
    // EXC of order 3 along a stationary bar gives orders 2 and 4 of half its size: 5·cos 3θ·cos θ, a range of twice 5
    // µm plus the noise.
    let g = figure_um(c, "bidirectional_circular_deviation");
    assert!((8.0..12.5).contains(&g), "{c}");
}

#[test]
fn the_sample_of_another_simulator_is_diagnosed() {
    let name = "the_sample_of_another_simulator_is_diagnosed";
    let Some(sample) = test_needs::data(name, "../sample/circle-backlash-y/session.toml") else {
        return;
    };
    for test in figures(&sample) {
        assert_eq!(test["diagnosis"][0]["fault"], "backlash", "{test}");
        assert_eq!(test["diagnosis"][0]["axes"], "Y");
        for end in ["Y+", "Y-"] {
            let (value, u) = figure(&test, "backlash", "Y", end);
            assert!((value - 4.0).abs() < 4.0 * u && u < 0.2, "{end}: {value} ± {u}");
        }
        let (value, u) = figure(&test, "squareness", "XY", "angle");
        assert!(value.abs() < 4.0 * u, "{value} ± {u}");
    }
}

#[test]
fn a_short_arc_is_reported_as_an_arc() {
    let folder = tempfile::tempdir().unwrap();
    circle(folder.path(), &[1.0, -1.0], true, |at| [40e-6 * RADIUS_MM * at.angle.cos(), 0.0]);
    let file = folder.path().join("xy.csv");
    let table = std::fs::read_to_string(&file).unwrap();
    let kept: Vec<&str> = table
        .lines()
        .filter(|line| {
            let y = line.split(',').nth(3).unwrap();
            y.parse().is_ok_and(|y: f64| y >= 50.0) || y == "y_mm"
        })
        .collect();
    std::fs::write(&file, kept.join("\n")).unwrap();
    let test = figures(&folder.path().join("session.toml"))[0].clone();
    assert!((um(&test, "arc_deg") - 120.0).abs() < 0.6, "{test}");
    assert!(test.get("diagnosis").is_none(), "{test}");
    let undetermined = test["not_identifiable"].to_string();
    for reason in ["ISO 230-4 requires a full circle", "an arc of 120° is too short"] {
        assert!(undetermined.contains(reason), "{undetermined}");
    }
    // 40 µm/m of X alone, from the centre of the set-up: 40·cos²θ·R, between 30° and 90°.
    let direction = &test["directions"][0];
    assert!((figure_um(direction, "circular_deviation") - 3.0).abs() < 0.06, "{test}");
}

/// One direction with a few high places: its own least-squares circle is farther from the minimum zone than that of both
/// directions. Both directions together never lie in a narrower ring than one of them.
#[test]
fn both_directions_are_no_narrower_than_one() {
    for seed in 0..6 {
        let folder = tempfile::tempdir().unwrap();
        let place = |k: usize| (f64::from(seed) * 12.9898 + k as f64 * 78.233).sin();
        let test = circle(folder.path(), &[1.0, -1.0], false, |at| {
            let bump = |centre: f64| (-((at.angle - centre) / 0.15).powi(2)).exp();
            let there = 4e-3 * bump(PI + place(1)) + 3e-3 * bump(PI + place(2) * 2.0);
            let back = 4e-3 * bump(1.0 + place(3));
            let radial = if at.path > 0.0 { there } else { back };
            [radial * at.angle.cos(), radial * at.angle.sin()]
        });
        let both = figure_um(&test, "bidirectional_circular_deviation");
        for direction in test["directions"].as_array().unwrap() {
            assert!(figure_um(direction, "circular_deviation") <= both + 1e-9, "{seed}: {both} {direction}");
        }
    }
}
