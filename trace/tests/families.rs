//! Families of effects on poses of a simulated robot. Its kinematics are written out here, independently of the chain.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use abbe_files::ReadOptions;
use abbe_identify::fit::report;
use abbe_identify::problem::Problem;
use abbe_model::session::Session;
use abbe_trace::SessionFit;
use abbe_trace::{TraceOptions, TraceOutcome, trace};
use nalgebra::{Matrix3xX, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;

/// The robot: J1 about Z at the origin, J2 about Y at the height 400 mm, J3 about Y 500 mm further.
const SESSION: &str = r#"
[machine]
name = "arm"
chain = "w b J1 J2 J3 t"
[machine.axis.J1]
kind = "rotary"
direction = [0, 0, 1]
origin_mm = [0, 0, 0]
[machine.axis.J2]
kind = "rotary"
direction = [0, 1, 0]
origin_mm = [0, 0, 400]
[machine.axis.J3]
kind = "rotary"
direction = [0, 1, 0]
origin_mm = [500, 0, 400]
[instrument]
kind = "tracker"
[unknowns]
errors = ["EA0J2", "EX0J3"]
"#;

/// Angular positioning errors of the joints, rad: bumps of different width, and on J2 a line with 17 cycles per turn.
fn error_of(joint: usize, q: f64) -> f64 {
    const BUMPS: [(f64, f64); 6] = [(-1.2, 0.15), (-0.7, 0.09), (-0.35, 0.12), (0.1, 0.1), (0.6, 0.2), (1.05, 0.08)];
    let bump = |(k, (centre, width)): (usize, (f64, f64))| {
        let sign = if (k * (joint + 2)).is_multiple_of(3) { -1.0 } else { 1.0 };
        sign * 150e-6 * (-((q - centre - 0.1 * joint as f64) / width).powi(2)).exp()
    };
    let gear = if joint == 1 { 60e-6 * (17.0 * q + 0.4).cos() } else { 0.0 };
    gear + BUMPS.into_iter().enumerate().map(bump).sum::<f64>()
}

/// The target at the end of the arm, 400 mm beyond J3.
fn target(q: [f64; 3]) -> Vector3<f64> {
    let about = |axis: Vector3<f64>, angle: f64| Rotation3::from_scaled_axis(axis * angle);
    let (y, z) = (Vector3::y(), Vector3::z());
    let [a, b, c] = [0, 1, 2].map(|joint| q[joint] + error_of(joint, q[joint]));
    let elbow = Vector3::new(500.0, 0.0, 0.0) + about(y, c) * Vector3::new(400.0, 0.0, 0.0);
    about(z, a) * (Vector3::new(0.0, 0.0, 400.0) + about(y, b) * elbow)
}

/// A session with `poses` random poses within the reach of each joint, rad, and noise of 5 µm. `more` is appended.
fn session(name: &str, poses: usize, reach: [[f64; 2]; 3], more: &str) -> Session {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("families-{name}"));
    std::fs::create_dir_all(&folder).unwrap();
    let mut random = rand_pcg::Pcg64::seed_from_u64(11 + poses as u64);
    let mut data = "J1_rad,J2_rad,J3_rad,px_mm,py_mm,pz_mm\n".to_string();
    for _ in 0..poses {
        let q = reach.map(|[low, high]| random.random_range(low..high));
        let point = target(q).map(|value| value + 0.005 * random.sample::<f64, _>(StandardNormal));
        writeln!(data, "{},{},{},{},{},{}", q[0], q[1], q[2], point.x, point.y, point.z).unwrap();
    }
    std::fs::write(folder.join("poses.csv"), data).unwrap();
    let test = "[[test]]\nname = \"T\"\ndata = \"poses.csv\"\npath = { kind = \"list\" }\n\
                target_mm = [900, 0, 400]\ntarget_u_um = 50\n";
    let file = folder.join("session.toml");
    std::fs::write(&file, format!("{SESSION}{test}{more}")).unwrap();
    abbe_files::session(Path::new(&file), &ReadOptions::default()).unwrap()
}

/// Rms of the readings of another session under the model that a trace found, µm. Only the pose of the tracker is
/// estimated again, by the rigid motion of least squares (Kabsch, Acta Crystallographica A32 (1976) 922).
fn predicted_um(found: &TraceOutcome, other: &Session) -> f64 {
    let mut problem = Problem::new(other, found.after.noise.clone(), 1).unwrap();
    found.effects.iter().for_each(|effect| problem.add_effect(effect).unwrap());
    let ids = |problem: &Problem| problem.parameters.list.iter().map(|p| p.id.clone()).collect::<Vec<_>>();
    assert_eq!(ids(&problem), ids(&found.after));
    let residuals = problem.residuals(&found.after_fit.beta).concat();
    let observed = &problem.tests[0].readings.as_ref().unwrap().observed;
    let points = |values: &[f64]| Matrix3xX::from_column_slice(values);
    let (measured, modelled) = (points(observed), points(observed) - points(&residuals));
    let centred = |points: &Matrix3xX<f64>| {
        let mean = points.column_mean();
        Matrix3xX::from_columns(&points.column_iter().map(|point| point - mean).collect::<Vec<_>>())
    };
    let (measured, modelled) = (centred(&measured), centred(&modelled));
    let product = (&measured * modelled.transpose()).svd(true, true);
    let rotation = product.u.unwrap() * product.v_t.unwrap();
    ((&measured - rotation * modelled).norm_squared() / observed.len() as f64).sqrt() * 1e3
}

#[test]
fn a_family_predicts_another_region_better_than_single_lines() {
    let measured = session("first", 300, [[-1.5, 1.5], [-1.3, 1.3], [-1.0, 1.0]], "");
    let elsewhere = session("second", 200, [[-1.5, 1.5], [-1.3, 1.3], [-1.5, 1.5]], "");
    let with = |exclude: &[&str]| {
        let exclude = exclude.iter().map(ToString::to_string).collect();
        trace(&measured, &TraceOptions { exclude, ..TraceOptions::default() }, &|_| true).unwrap()
    };
    let family = with(&[]);
    let ids: Vec<String> = family.effects.iter().map(|effect| effect.id()).collect();
    assert!(ids.contains(&"EBJ2~J2:spectrum".to_string()), "{ids:?}");
    let lines = with(&["spectrum", "gravity"]);
    let [of_family, of_lines] = [&family, &lines].map(|found| predicted_um(found, &elsewhere));
    println!("another region: family {of_family:.2} µm, {} lines {of_lines:.2} µm", lines.effects.len());
    assert!(of_family < 0.9 * of_lines && of_family < 30.0, "{of_family} {of_lines}");

    // One row: the rms over a turn, and the curve with its band. The true curve lies within it.
    let effect = family.result.effects.iter().find(|effect| effect.name.driver == "J2").unwrap();
    assert_eq!(effect.parameters.len(), 1);
    assert_eq!(effect.parameters[0].id, "EBJ2~J2:spectrum.rms");
    let prior = effect.prior.as_ref().unwrap();
    assert!(prior.effective_parameters > 5.0 && prior.effective_parameters < 80.0 && prior.coefficients == 80);
    for point in &effect.curve {
        let covered = point.at.abs() < 1.3_f64.to_degrees();
        assert!(covered != point.extrapolated || (point.at.abs() - 1.3_f64.to_degrees()).abs() < 5.0, "{}", point.at);
    }
    let inside = effect.curve.iter().filter(|point| point.at.abs() < 70.0);
    let arcsec = 648_000.0 / std::f64::consts::PI;
    let differences: Vec<(f64, f64)> =
        inside.map(|point| (error_of(1, point.at.to_radians()) * arcsec - point.value, point.u)).collect();
    // The constant is a location error.
    let mean = differences.iter().map(|(difference, _)| difference).sum::<f64>() / differences.len() as f64;
    let covered = differences.iter().filter(|(difference, u)| (difference - mean).abs() < 2.0 * u + 1.0).count();
    assert!(covered as f64 > 0.9 * differences.len() as f64, "{covered} of {}", differences.len());
}

#[test]
fn a_stated_scale_is_used_and_an_estimated_one_is_that_of_the_family() {
    let declared = |keys: &str| {
        let effect =
            format!("[[effect]]\ncomponent = \"EBJ2\"\ndriver = \"J2\"\nshape = \"spectrum\"\norders = 20\n{keys}");
        session("declared", 120, [[-1.5, 1.5], [-1.3, 1.3], [-1.0, 1.0]], &effect)
    };
    let of = |session: &Session| {
        let found = SessionFit::of(session, 1).unwrap();
        let result = report(&found.problem, &found.fit).unwrap();
        assert!(result.model.parameters.iter().any(|p| p.id == "EBJ2~J2:spectrum.rms" && p.u > 0.0));
        assert!(!result.model.parameters.iter().any(|p| p.id.contains(".cos")));
        result.model.fit.rms_um
    };
    // Far too small a scale leaves the error in the residual; the estimated one does not. The errors of the other joints
    // remain.
    let [small, stated, estimated] =
        ["scale_arcsec = 0.001\n", "scale_arcsec = 20\n", ""].map(|keys| of(&declared(keys)));
    assert!(small > 1.3 * stated && (estimated / stated - 1.0).abs() < 0.1, "{small} {stated} {estimated}");
}
