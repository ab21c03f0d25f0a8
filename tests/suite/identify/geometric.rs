//! The geometric methods of the thesis on lengths from plain matrices: their results, their bias, and the printed signs
//! that are wrong.

use std::sync::Arc;

use abbe::apply::geometric::{Estimator, Method, compare};
use abbe::files::{self, ReadOptions};
use abbe::identify::fit::prepare;
use abbe::identify::noise::{Noise, NoiseSource};
use abbe::identify::numerics::circle;
use abbe::identify::problem::Problem;
use abbe::model::chain::Frame;
use abbe::model::instrument::Station;
use abbe::model::session::motion::{Motion, Moved};
use abbe::model::session::planned;
use abbe::model::session::{Prior, Session};
use nalgebra::{Point3, Rotation3, Translation3, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::suite::{abbe, ready, text};

const ARCSEC: f64 = std::f64::consts::PI / (180.0 * 3600.0);

/// The eight errors: mm and rad.
#[derive(Clone, Copy, Default)]
struct Errors {
    a: [f64; 4], // EY0A, EZ0A, EB0A, EC0A
    c: [f64; 4], // EX0C, EY0C, EA0C, EB0C
}

/// From a table: µm and arcsec, `[e_y0a, e_z0a, θ_y0a, θ_z0a, e_x0c, e_y0c, θ_x0c, θ_y0c]`.
fn table(values: [f64; 8]) -> Errors {
    let of = |k: usize| [values[k] * 1e-3, values[k + 1] * 1e-3, values[k + 2] * ARCSEC, values[k + 3] * ARCSEC];
    Errors { a: of(0), c: of(4) }
}

/// Tables 4.2 and 4.3, 5.2 and 5.3, 6.3 and 6.4.
const TABLES: [(&str, Method, [f64; 8]); 3] = [
    ("chapter4", Method::Cone, [34.2, -35.3, 6.62, 1.89, 1.3, -52.5, -22.32, -3.75]),
    ("chapter5", Method::Cone, [35.3, -33.4, -1.29, 1.20, 1.3, -52.9, -22.28, 4.48]),
    ("chapter6", Method::TwoPlane, [33.5, -35.6, 7.23, 2.94, 1.4, -51.3, -26.03, -14.38]),
];
const IDS: [&str; 8] = ["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"];

fn plan(chapter: &str) -> Session {
    let mut session = files::session(&ready(&format!("hermle-c600u/{chapter}.toml")), &ReadOptions::default()).unwrap();
    for test in &mut session.tests {
        if let Some(Motion { moved: Moved::Axis(_), course }) = &mut test.motion {
            course.step *= 4.0;
        }
    }
    session.resolution_mm = None;
    session
}

/// Lengths by Eqs. 3.2 and 3.3 as homogeneous transformations: location errors, then the rotation. `moved` displaces
/// the workpiece ball.
fn measured(plan: &Session, errors: &Errors, moved: [f64; 3], noise: Option<(f64, u64)>) -> Session {
    let mut session = plan.clone();
    let machine = plan.machine.clone();
    let place = |name: &str| machine.axis_index(name).unwrap();
    let [a, c, x, y, z] = ["A", "C", "X", "Y", "Z"].map(place);
    let mut random = Pcg64::seed_from_u64(noise.map_or(0, |(_, seed)| seed));
    for test in &mut session.tests {
        let mut readings = planned::planned(&machine, test).unwrap();
        let Station::BallBar(bar) = &test.station else { unreachable!() };
        let ball: [f64; 3] = std::array::from_fn(|k| bar.workpiece_ball.mm[k] + moved[k]);
        for row in 0..readings.rows() {
            let at = |axis: usize| readings.positions[axis][row];
            let turned = |e: [f64; 3], r: [f64; 3], axis: Vector3<f64>, angle: f64| {
                Translation3::new(e[0], e[1], e[2])
                    * Rotation3::from_axis_angle(&Vector3::x_axis(), r[0])
                    * Rotation3::from_axis_angle(&Vector3::y_axis(), r[1])
                    * Rotation3::from_axis_angle(&Vector3::z_axis(), r[2])
                    * Rotation3::new(axis * angle)
            };
            let [ey, ez, rb, rc] = errors.a;
            let tilted = turned([0.0, ey, ez], [0.0, rb, rc], Vector3::x(), at(a));
            let [ex, ey, ra, rb] = errors.c;
            let table = turned([ex, ey, 0.0], [ra, rb, 0.0], Vector3::z(), at(c));
            let on_table = bar.workpiece_ball.frame == Frame::Table;
            let workpiece = tilted * if on_table { table * Point3::from(ball) } else { Point3::from(ball) };
            let spindle = Point3::from(bar.spindle_ball.mm) + Vector3::new(at(x), at(y), at(z));
            let normal: f64 = StandardNormal.sample(&mut random);
            readings.observed[row] = (workpiece - spindle).norm() + noise.map_or(0.0, |(sigma, _)| sigma * normal);
        }
        test.readings = Some(Arc::new(readings));
    }
    session
}

fn problem(session: &Session) -> Problem {
    Problem::new(session, Noise::white(0.3e-3, NoiseSource::Stated), 1).unwrap()
}

/// Errors by a method, µm and arcsec, in the order of [`IDS`]; NaN if the method gives no value.
fn by(session: &Session, method: Method) -> [f64; 8] {
    let problem = problem(session);
    let estimator = Estimator::new(&problem, method).unwrap();
    let observed: Vec<&[f64]> =
        problem.tests.iter().map(|test| test.readings.as_ref().unwrap().observed.as_slice()).collect();
    let estimate = estimator.estimate(&problem, &observed).unwrap();
    IDS.map(|id| {
        let place = estimator.errors.iter().position(|p| problem.parameters.list[*p].id.to_string() == id);
        place.map_or(f64::NAN, |k| {
            estimate.values[k] * problem.parameters.list[estimator.errors[k]].unit.display_per_internal
        })
    })
}

/// Offsets of the centre of one test, µm.
fn centre(session: &Session, test: &str) -> [f64; 2] {
    let problem = problem(session);
    let place = problem.tests.iter().position(|known| known.name == test).unwrap();
    let geometry = abbe::apply::geometric::CircleGeometry::of(&session.machine, &problem.models[place]).unwrap();
    let observed = &problem.tests[place].readings.as_ref().unwrap().observed;
    let left_out = vec![false; observed.len()];
    geometry.centre(observed, &left_out).unwrap().offset_mm.map(|mm| mm * 1e3)
}

/// A ball that is displaced by `t` along its path is plotted `t²/R` off the true circle; over an arc of 90° the centre
/// shifts by at most 1.75 times as much. The axes pass within 50 µm of the ball (0.044 µm), within 64 µm at the second
/// positions of Chapter 6 (0.07 µm). An angle is the difference of two centres over its lever.
#[test]
fn each_method_recovers_its_table_of_the_thesis_within_its_bias() {
    for (chapter, method, values) in TABLES {
        let session = measured(&plan(chapter), &table(values), [0.0; 3], None);
        for (k, (found, given)) in by(&session, method).into_iter().zip(values).enumerate() {
            let angle = k % 4 >= 2;
            let most = if angle { 0.03 } else { 0.08 };
            assert!((found - given).abs() < most, "{chapter} {}: {found} for {given}", IDS[k]);
        }
        // The circle method also gives positions, from the planes at the origin.
        if chapter != "chapter6" {
            for (k, (found, given)) in by(&session, Method::Circle).into_iter().zip(values).enumerate() {
                if k % 4 >= 2 {
                    assert!(found.is_nan());
                } else {
                    assert!((found - given).abs() < 0.08, "{chapter} {}: {found} for {given}", IDS[k]);
                }
            }
        }
    }
}

/// If its plane is off the origin, the circle method adds the lever times the angle to a position: the conversion
/// between local and reference position errors.
#[test]
fn local_position_errors_are_reference_errors_plus_lever_times_angle() {
    let (_, _, values) = TABLES[2];
    let errors = table(values);
    let session = measured(&plan("chapter6"), &errors, [0.0; 3], None);
    let [ey, ez, tb, tc] = [values[0], values[1], values[2] * ARCSEC * 1e3, values[3] * ARCSEC * 1e3];
    let [ex, eyc, ta, tbc] = [values[4], values[5], values[6] * ARCSEC * 1e3, values[7] * ARCSEC * 1e3];
    let close = |found: f64, expected: f64| (found - expected).abs() < 0.1;
    for (test, lever) in [("A position 1", -275.0), ("A position 2", 275.0)] {
        let [y, z] = centre(&session, test);
        assert!(close(y, ey + lever * tc), "{test}: {y}");
        assert!(close(z, ez - lever * tb), "{test}: {z}");
        // Section 6.1.2 prints a plus.
        assert!(!close(z, ez + lever * tb), "{test}: {z}");
    }
    let [x, y] = centre(&session, "C position 4");
    assert!(close(x, ex + 78.0 * (tbc + tb)), "{x}");
    assert!(close(y, ey + eyc - 78.0 * ta), "{y}");
    assert!(!close(y, ey + eyc + 78.0 * ta), "{y}");
    let [x, y] = centre(&session, "C position 3");
    assert!(close(x, ex) && close(y, ey + eyc), "{x} {y}");
}

/// Sections 4.2.1 and 5.2 take the angles from the foot point E of the cone: `O'E = O'P − EP`.
#[test]
fn the_cone_has_the_axes_of_chapter_4_and_chapter_5_exchanges_them() {
    let lever = (149.9946_f64.powi(2) - 100.0_f64.powi(2)).sqrt();
    let errors = table([35.3, -33.4, 12.0, -5.0, 0.0, 0.0, 0.0, 0.0]);
    let session = measured(&plan("chapter5"), &errors, [0.0; 3], None);
    let (plane, cone) = (centre(&session, "A100"), centre(&session, "A150"));
    let foot = [plane[0] - cone[0], plane[1] - cone[1]];
    let angle = |offset_um: f64| (offset_um * 1e-3 / lever).atan() / ARCSEC;
    // The correct relations: θ_z0a = +Y/D, θ_y0a = −Z/D.
    assert!((angle(foot[0]) - -5.0).abs() < 0.05, "{foot:?}");
    assert!((-angle(foot[1]) - 12.0).abs() < 0.05, "{foot:?}");
    // Chapter 4 prints +Z/D for θ_y0a; Chapter 5 takes it from Y.
    assert!((angle(foot[1]) - 12.0).abs() > 20.0);
    assert!((angle(foot[0]) - 12.0).abs() > 10.0);
    let values = by(&session, Method::Cone);
    assert!((values[2] - 12.0).abs() < 0.05 && (values[3] - -5.0).abs() < 0.05, "{values:?}");
}

/// Eq. 4.1: a pivot that is 0.4 mm further along its path starts at `δ = atan(0.4/100)`. With its true position stated,
/// the angle is correct.
#[test]
fn stating_the_true_ball_position_corrects_the_start_angle() {
    let errors = table([35.3, -33.4, 0.0, 0.0, 1.3, -52.9, 0.0, 0.0]);
    // The ball of the plan is at 100 mm along Y, displaced by 0.4 mm along −X for C.
    let moved = [-0.4, 0.0, 0.0];
    let mut session = measured(&plan("chapter5"), &errors, moved, None);
    let uncorrected = centre(&session, "C100");
    for test in &mut session.tests {
        if let Station::BallBar(bar) = &mut test.station {
            bar.workpiece_ball.mm[0] += moved[0];
        }
    }
    let corrected = centre(&session, "C100");
    let expected = [1.3, 35.3 - 52.9];
    for (found, expected) in corrected.iter().zip(expected) {
        assert!((found - expected).abs() < 0.005, "{corrected:?}");
    }
    // Without correction the centre is rotated by δ about the origin.
    let delta = (0.4_f64 / 100.0).atan();
    let turned =
        [delta.cos() * expected[0] + delta.sin() * expected[1], -delta.sin() * expected[0] + delta.cos() * expected[1]];
    for (found, expected) in uncorrected.iter().zip(turned) {
        assert!((found - expected).abs() < 0.005, "{uncorrected:?} {turned:?}");
    }
    assert!((uncorrected[0] - expected[0]).abs() > 0.05);
}

/// Section 4.2: the distortion is below 0.2 µm for eccentricities below 100 µm. A ball displaced by `t` along its path
/// reads `t²/2R` long and is plotted `t²/R` off the circle: 0.10 µm at 100 µm and R = 100 mm, 0.2 µm at 141 µm. A full
/// turn does not shift the centre; an arc of 90° shifts it by 0.17 µm at 100 µm and by 0.2 µm at 107 µm.
#[test]
fn the_distortion_by_eccentricity_is_below_a_fifth_of_a_micrometre_up_to_141_micrometres() {
    let radius = 100.0;
    let plotted = |eccentricity: f64, direction: f64, from: f64, to: f64| -> (f64, f64) {
        let (sin, cos) = direction.sin_cos();
        let centre = [eccentricity * cos, eccentricity * sin];
        let points: Vec<[f64; 2]> = (0..720)
            .map(|k| from + (to - from) * f64::from(k) / 720.0)
            .map(|angle| {
                let length = (centre[0] + radius * angle.cos()).hypot(centre[1] + radius * angle.sin());
                [length * angle.cos(), length * angle.sin()]
            })
            .collect();
        let off = |p: &[f64; 2]| ((p[0] - centre[0]).hypot(p[1] - centre[1]) - radius).abs();
        let distortion = points.iter().map(off).fold(0.0, f64::max);
        let found = circle::through(&points).unwrap().centre;
        (distortion * 1e3, (found[0] - centre[0]).hypot(found[1] - centre[1]) * 1e3)
    };
    let worst = |eccentricity: f64, from_deg: f64, to_deg: f64| {
        (0..72)
            .map(|k| plotted(eccentricity, f64::from(k).to_radians() * 5.0, from_deg.to_radians(), to_deg.to_radians()))
            .fold((0.0_f64, 0.0_f64), |(a, b), (c, d)| (a.max(c), b.max(d)))
    };
    let (distortion, centre) = worst(0.100, 0.0, 360.0);
    assert!((distortion - 0.100).abs() < 0.001, "{distortion}");
    assert!(centre < 0.001, "{centre}");
    assert!(worst(0.141, 0.0, 360.0).0 < 0.2 && worst(0.142, 0.0, 360.0).0 > 0.2);
    let (distortion, centre) = worst(0.100, -20.0, 70.0);
    assert!((distortion - 0.100).abs() < 0.001 && (centre - 0.175).abs() < 0.001, "{distortion} {centre}");
    let fails = (80..200).find(|um| worst(f64::from(*um) * 1e-3, -20.0, 70.0).1 > 0.2);
    assert_eq!(fails, Some(107));
}

#[test]
fn uncertainties_of_the_cone_cover_noise_and_set_ups() {
    let mut plan = plan("chapter5");
    for test in &mut plan.tests {
        if let Some(Motion { moved: Moved::Axis(_), course }) = &mut test.motion {
            course.step *= 3.0;
        }
        for prior in &mut test.priors {
            *prior = Prior::Known;
        }
    }
    let errors = table(TABLES[1].2);
    let truth = TABLES[1].2;
    const DRAWS: u64 = 100;
    let mut squares = [0.0; 8];
    for seed in 0..DRAWS {
        let session = measured(&plan, &errors, [0.0; 3], Some((0.3e-3, seed)));
        let problem = problem(&session);
        let estimator = Estimator::new(&problem, Method::Cone).unwrap();
        let observed: Vec<&[f64]> =
            problem.tests.iter().map(|test| test.readings.as_ref().unwrap().observed.as_slice()).collect();
        let estimate = estimator.estimate(&problem, &observed).unwrap();
        for (k, id) in IDS.iter().enumerate() {
            let place =
                estimator.errors.iter().position(|p| problem.parameters.list[*p].id.to_string() == *id).unwrap();
            let unit = problem.parameters.list[estimator.errors[place]].unit.display_per_internal;
            let u = estimate.covariance[(place, place)].sqrt() * unit;
            squares[k] += ((estimate.values[place] * unit - truth[k]) / u).powi(2) / DRAWS as f64;
        }
    }
    for (id, square) in IDS.iter().zip(squares) {
        // Three standard deviations of the mean of that many squares, and the bias of an arc.
        assert!((square - 1.0).abs() < 0.5, "{id}: {square}");
    }
}

#[test]
fn one_command_shows_method_and_full_fit_on_the_same_readings() {
    let session = measured(&plan("chapter5"), &table(TABLES[1].2), [0.0; 3], Some((0.3e-3, 7)));
    let comparison = compare(&session, Method::Cone, 1).unwrap();
    let (problem, full) = prepare(&session, 1).unwrap();
    assert_eq!(comparison.errors.len(), 8);
    for row in &comparison.errors {
        let place = problem.parameters.list.iter().position(|p| p.id.to_string() == row.id).unwrap();
        let unit = problem.parameters.list[place].unit.display_per_internal;
        assert!((row.full_value.unwrap() - full.beta[place] * unit).abs() < 1e-9);
        // The full fit uses every reading for every error: its uncertainty is not larger.
        assert!(row.full_u.unwrap() <= row.u.unwrap() * 1.001, "{row:?}");
        assert!(row.bias.unwrap().abs() < 0.08 && row.full_bias.unwrap().abs() < 1e-6, "{row:?}");
    }
    // Compensation (Figs. 5.3, 5.4): the residual is the noise.
    assert!(comparison.nominal_rms_um > 20.0 && comparison.method_rms_um < 0.33);

    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let made =
        abbe(&["simulate", text(&ready("hermle-c600u/chapter5.toml")), "--out", text(&out), "--error", "EY0A=35.3um"]);
    assert!(made.status.success());
    let session = out.join("session.toml");
    let json = folder.path().join("cone.json");
    let shown = abbe(&["fit", text(&session), "--method", "cone", "--json", text(&json)]);
    assert!(shown.status.success());
    assert!(String::from_utf8_lossy(&shown.stdout).contains("cone beside the full fit"));
    assert!(std::fs::read_to_string(&json).unwrap().contains("\"full_value\""));
    let refused = abbe(&["fit", text(&session), "--method", "two-plane"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("two tests in planes apart"));
}

/// A session that states no noise: that of a method, too, follows from the repeated runs of the tests, and with it its u.
#[test]
fn the_noise_of_a_method_is_that_of_the_repeats() {
    const NOISE_MM: f64 = 0.8e-3;
    for (chapter, method, values) in TABLES {
        let mut session = measured(&plan(chapter), &table(values), [0.0; 3], Some((NOISE_MM, 11)));
        let stated = compare(&Session { noise_mm: Some(NOISE_MM), ..session.clone() }, method, 1).unwrap();
        session.noise_mm = None;
        let found = compare(&session, method, 1).unwrap();
        assert_eq!((found.noise.source, stated.noise.source), (NoiseSource::Repeats, NoiseSource::Stated), "{chapter}");
        let ratio = found.noise.value / (1e3 * NOISE_MM);
        assert!((ratio - 1.0).abs() < 0.05, "{chapter}: {ratio}");
        for (own, other) in found.errors.iter().zip(&stated.errors) {
            let [own, other] = [own, other].map(|row| row.u.unwrap());
            assert!((own / other - 1.0).abs() < 0.06, "{chapter}: {own} and {other}");
        }
    }
}

/// Chapter 7 (Figs. 7.1, 7.2): the method of Chapter 5 with rotary axes that carry the spindle. The true values are in
/// the comments of the sessions.
#[test]
fn tilting_heads_are_identified_by_method_and_full_fit() {
    let cases = [
        (
            "tilting-head",
            vec![
                ("EX0B", 12.0),
                ("EZ0B", -8.0),
                ("EA0B", 6.0),
                ("EC0B", -9.0),
                ("EX0C", -15.0),
                ("EY0C", 10.0),
                ("EA0C", -12.0),
                ("EB0C", 7.0),
            ],
        ),
        (
            "table-and-head",
            vec![
                ("EZ0A", -8.0),
                ("EB0A", 6.0),
                ("EC0A", -9.0),
                ("EX0C", -15.0),
                ("EY0C", 10.0),
                ("EA0C", -12.0),
                ("EB0C", 7.0),
            ],
        ),
    ];
    for (name, truth) in cases {
        let path = ready(&format!("{name}/measured/session.toml"));
        let session = files::session(&path, &ReadOptions::default()).unwrap();
        let comparison = compare(&session, Method::Cone, 1).unwrap();
        assert_eq!(comparison.errors.len(), truth.len());
        for (id, value) in truth {
            let row = comparison.errors.iter().find(|row| row.id == id).unwrap();
            for (found, u) in [(row.value, row.u), (row.full_value, row.full_u)] {
                assert!((found.unwrap() - value).abs() < 3.5 * u.unwrap(), "{name}: {row:?}");
            }
            assert!(row.bias.unwrap().abs() < 0.02, "{name}: {row:?}");
        }
    }
    // For a table and a head only the offset of A from C along Y is identifiable: with both errors as parameters
    // neither method gives a value.
    let path = ready("table-and-head/measured/session.toml");
    let mut session = files::session(&path, &ReadOptions::default()).unwrap();
    session.unknowns.push(abbe::model::component::ErrorName::parse("EY0A").unwrap());
    let refused = compare(&session, Method::Cone, 1).unwrap_err().to_string();
    assert!(refused.contains("EY0C") && refused.contains("EY0A"), "{refused}");
}
