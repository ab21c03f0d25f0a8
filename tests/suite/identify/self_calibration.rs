//! Self-calibration by probing (Zimmermann & Ibaraki 2020) against the tables of the paper and against readings from
//! plane geometry.

use std::sync::Arc;

use abbe::files::{self, ReadOptions};
use abbe::identify::noise::NoiseSource;
use abbe::identify::self_calibration::{
    Calibration, Equations, Function, MonteCarlo, Reference, calibrate, conditions, rank_before, reduce, solve,
};
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::component::ErrorName;
use abbe::model::instrument::probe::Probe;
use abbe::model::instrument::{Station, Target};
use abbe::model::sensitivity::{SlotValues, TestModel};
use abbe::model::session::Session;
use abbe::model::session::motion::Traversals;
use abbe::model::session::readings::Readings;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::suite::{abbe, ready, text};

/// Table 5: expanded uncertainties (k = 2), µm, of the four functions at −180°, −135°, … 135°, without 0°.
const TABLE_5: [[f64; 4]; 7] = [
    [1.72, 6.68, 0.0, 1.94],
    [4.07, 4.41, 3.26, 3.71],
    [4.01, 3.44, 3.04, 3.28],
    [3.48, 4.71, 3.19, 2.75],
    [2.19, 4.10, 1.76, 1.96],
    [3.49, 3.28, 3.04, 3.09],
    [5.07, 6.19, 4.60, 4.61],
];
const ANGLES_OF_TABLE_5: [f64; 7] = [-180.0, -135.0, -90.0, -45.0, 45.0, 90.0, 135.0];
/// Permitted difference of a cell, µm.
const CELL: f64 = 0.35;

/// The ready plan with `count` angles and test 1b at `second_deg`.
fn plan(count: usize, second_deg: f64) -> Session {
    plan_on(count, second_deg, |machine| machine)
}

/// The same on a changed machine.
fn plan_on(count: usize, second_deg: f64, change: impl Fn(String) -> String) -> Session {
    let original = std::fs::read_to_string(ready("self-calibration/session.toml")).unwrap();
    let step = 360.0 / count as f64;
    let (sin, cos) = second_deg.to_radians().sin_cos();
    let edited = original
        .replace("step_deg = 45", &format!("step_deg = {step}"))
        .replace("to_deg = 315", &format!("to_deg = {}", 360.0 - step))
        .replace(
            "x_mm = \"R / sqrt(2)\", y_mm = \"R / sqrt(2)\"",
            &format!("x_mm = \"R * {cos:.15}\", y_mm = \"R * {sin:.15}\"").replace("* -", "* (0 - 1) * "),
        );
    let folder = tempfile::tempdir().unwrap();
    let machine = change(std::fs::read_to_string(ready("self-calibration/machine.toml")).unwrap());
    std::fs::write(folder.path().join("machine.toml"), machine).unwrap();
    let path = folder.path().join("session.toml");
    std::fs::write(&path, edited).unwrap();
    files::session(&path, &ReadOptions::default()).unwrap()
}

/// The plan with readings of the nominal machine.
fn unmoved(count: usize, second_deg: f64) -> Session {
    let session = plan(count, second_deg);
    let simulation = Simulation { noise_mm: Some(0.0), ..Simulation::default() };
    let simulated = simulate(&session, &simulation).unwrap();
    session.with_readings(simulated.readings)
}

/// Sets the radius as known, so that all readings refer to the first one, as in the paper.
fn as_in_the_paper(session: &mut Session) {
    for test in &mut session.tests {
        test.priors[abbe::model::instrument::probe::RADIUS] = abbe::model::session::Prior::Known;
    }
}

/// Expanded uncertainties in the order of Table 5.
fn expanded_um(calibration: &Calibration, covariance: &faer::Mat<f64>) -> [[f64; 4]; 7] {
    ANGLES_OF_TABLE_5.map(|angle| {
        Function::ALL.map(|function| {
            let column = calibration.equations.column(function, angle.to_radians()).unwrap();
            2e3 * covariance[(column, column)].max(0.0).sqrt()
        })
    })
}

/// Number of cells of Table 5 beyond the permitted difference, and the largest difference.
fn off(found: &[[f64; 4]; 7]) -> (usize, f64) {
    let differences: Vec<f64> =
        found.iter().flatten().zip(TABLE_5.iter().flatten()).map(|(found, printed)| (found - printed).abs()).collect();
    let worst = differences.iter().copied().fold(0.0, f64::max);
    (differences.iter().filter(|d| **d > CELL).count(), worst)
}

#[test]
fn table_5_is_reproduced_in_every_cell() {
    let mut session = unmoved(8, 45.0);
    for (reference, unknowns, worst_cell) in [(Reference::Estimated, 27, 0.252), (Reference::FirstReading, 26, 0.308)] {
        if reference == Reference::FirstReading {
            as_in_the_paper(&mut session);
        }
        let calibration = calibrate(&session).unwrap();
        assert_eq!(calibration.equations.reference, reference);
        assert_eq!(calibration.equations.columns(), 32);
        assert_eq!(calibration.rank_before, 30);
        assert_eq!(calibration.conditions.len(), 6);
        assert_eq!(calibration.solution.parameters, unknowns);
        assert!(calibration.solution.identifiable.iter().all(|seen| *seen));
        let (cells, worst) = off(&expanded_um(&calibration, &calibration.solution.covariance));
        assert_eq!(cells, 0, "{reference:?}: worst {worst}");
        assert!(worst < worst_cell, "{reference:?}: {worst}");
    }
}

#[test]
fn the_printed_sign_of_test_3_does_not_reproduce_table_5() {
    let mut session = unmoved(8, 45.0);
    as_in_the_paper(&mut session);
    let calibration = calibrate(&session).unwrap();
    let mut printed = calibration.equations.clone();
    let second = printed.offset(Function::Second)..printed.offset(Function::Linear);
    // The rows of test 3 are the last eight.
    for row in &mut printed.rows[24..] {
        for coefficient in &mut row[second.clone()] {
            *coefficient = -*coefficient;
        }
    }
    assert_eq!(rank_before(&printed).unwrap(), 31);
    let reduction = reduce(printed.columns(), &conditions(&printed, "C").unwrap()).unwrap();
    let solution = solve(&printed, &reduction, 1e-3).unwrap();
    let (cells, worst) = off(&expanded_um(&calibration, &solution.covariance));
    assert_eq!(cells, 24, "worst {worst}");
    assert!(worst > 2.5, "{worst}");
}

/// Table 6 prints 3.68 and 3.10 µm. The algebraic circle of draws about readings of zero reproduces them: there the
/// radius of the circle is due to noise alone. About a circle with the radius of that of Table 4 the same fit gives
/// 2.93 and 3.10 µm.
#[test]
fn table_6_is_the_circle_through_draws_about_zero() {
    let mut session = unmoved(8, 45.0);
    as_in_the_paper(&mut session);
    let draws = MonteCarlo { runs: 400_000, seed: 1, coverage: 0.95 };
    let about_zero = calibrate(&session).unwrap();
    let expanded = |calibration: &Calibration| {
        let distributions = calibration.monte_carlo(&draws);
        [0, 1].map(|k| 2e3 * distributions[calibration.solution.values_mm.len() + k].u)
    };
    let [x, y] = expanded(&about_zero);
    assert!((x - 3.68).abs() < 0.05 && (y - 3.10).abs() < 0.05, "{x} {y}");

    let mut as_measured = plan(8, 45.0);
    touched(&mut as_measured, &Touched { axis: [3.0e-3, 5.1e-3], ..Touched::default() });
    as_in_the_paper(&mut as_measured);
    let [x, y] = expanded(&calibrate(&as_measured).unwrap());
    assert!((x - 2.93).abs() < 0.05 && (y - 3.10).abs() < 0.05, "{x} {y}");
}

/// Errors in a plane: of the table axis, the artefact on the table, and the linear axes.
#[derive(Default)]
struct Touched {
    /// Position of the table axis in the plane, mm.
    axis: [f64; 2],
    /// Centre of the cylinder at table position 0, mm.
    cylinder: [f64; 2],
    /// Squareness of X and Y, rad.
    squareness: f64,
    /// Standard deviation of a reading, mm, and seed.
    noise: (f64, u64),
}

/// Readings by plane geometry: intersection of the ray from the origin at the angle of the probe with the circle of the
/// rotated cylinder.
fn touched(session: &mut Session, case: &Touched) {
    let radius = 45.0;
    let mut random = Pcg64::seed_from_u64(case.noise.1);
    let machine = session.machine.clone();
    let [c, x, y] = ["C", "X", "Y"].map(|name| machine.axis_index(name).unwrap());
    for test in &mut session.tests {
        let mut readings = abbe::model::session::planned::planned(&machine, test).unwrap();
        for row in 0..readings.rows() {
            let (commanded_x, commanded_y) = (readings.positions[x][row], readings.positions[y][row]);
            // The table rotates clockwise by C.
            let (sin, cos) = readings.positions[c][row].sin_cos();
            let from = [case.cylinder[0] - case.axis[0], case.cylinder[1] - case.axis[1]];
            let centre = [case.axis[0] + cos * from[0] + sin * from[1], case.axis[1] - sin * from[0] + cos * from[1]];
            let angle = commanded_y.atan2(commanded_x);
            let direction = [angle.cos(), angle.sin()];
            // A squareness of Y displaces the tip along X in proportion to Y.
            let tip = [commanded_x - case.squareness * commanded_y, commanded_y];
            let from = [tip[0] - centre[0], tip[1] - centre[1]];
            let along = from[0] * direction[0] + from[1] * direction[1];
            let beside = from[0] * direction[1] - from[1] * direction[0];
            let distance = along - (radius * radius - beside * beside).sqrt();
            let normal: f64 = StandardNormal.sample(&mut random);
            readings.observed[row] = distance + case.noise.0 * normal;
        }
        test.readings = Some(Arc::new(readings));
    }
}

/// A probe that does not move straight towards the axis, on a table at 30° whose axis is displaced by 0.2 mm: line and
/// circle in the plane.
#[test]
fn a_declared_direction_is_the_one_that_is_probed_along() {
    let machine = plan(8, 45.0).machine;
    let station = Station::Probe(Probe {
        artefact: Target::on_table([10.0, 0.0, 0.0]),
        axis: [0.0, 0.0, 1.0],
        radius: 45.0,
        stylus: Target::on_tool([0.0; 3]),
        direction: Some([-0.8, 0.6, 0.0]),
    });
    let mut readings = Readings { positions: vec![vec![0.0]; machine.axes.len()], ..Readings::default() };
    let place = |name: &str| machine.axis_index(name).unwrap();
    readings.positions[place("C")][0] = 30.0_f64.to_radians();
    readings.positions[place("X")][0] = 58.0;
    readings.positions[place("Y")][0] = -20.0;
    let model = TestModel::new(machine.clone(), station, &readings);
    let mut values = SlotValues::zero(model.slots());
    values.constant[machine.error_slot(&ErrorName::parse("EX0C").unwrap()).unwrap()] = 0.2;
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    let from = [58.0 - 0.2 - 10.0 * cos, -20.0 + 10.0 * sin];
    let along = -0.8 * from[0] + 0.6 * from[1];
    let beside = 0.6 * from[0] + 0.8 * from[1];
    let expected = -along - (45.0_f64.powi(2) - beside * beside).sqrt();
    let found = model.readings(&values)[0];
    assert!((found - expected).abs() < 1e-11, "{found} {expected}");
}

/// Section 5.2 and Table 9: the origin moves to eight points of a 40 µm square, so axis and artefact have the opposite
/// offset.
#[test]
fn shifted_origins_come_back_within_their_uncertainty() {
    let shifts = [
        [0.0, 20.0],
        [0.0, -20.0],
        [20.0, 0.0],
        [-20.0, 0.0],
        [20.0, 20.0],
        [20.0, -20.0],
        [-20.0, 20.0],
        [-20.0, -20.0],
    ];
    let mut inside = 0;
    for (seed, [x, y]) in (0..).zip(shifts) {
        for (noise, k) in [(0.0, 0.0), (1e-3, 3.5)] {
            let axis = [-x * 1e-3 + 1.5e-3, -y * 1e-3 + 0.2e-3];
            let mut session = plan(8, 45.0);
            let case = Touched {
                axis,
                cylinder: [axis[0] + 0.060, axis[1] - 0.045],
                squareness: 1.0e-5,
                noise: (noise, seed),
            };
            touched(&mut session, &case);
            let calibration = calibrate(&session).unwrap();
            let report = calibration.report(&session, None);
            // The origin turns about the axis.
            let (circle, expected) = (report.circle_radius_um.unwrap(), 1e3 * axis[0].hypot(axis[1]));
            assert!((circle - expected).abs() < 0.2 + 3.5e3 * noise, "{circle} {expected}");
            for parameters in [&report.parameters, &report.parameters_by_turn] {
                for (parameter, axis) in parameters.iter().zip(axis) {
                    let miss = (parameter.value - axis * 1e3).abs();
                    // Without noise: the omitted second order, (90 µm)²/45 mm = 0.18 µm.
                    assert!(miss < 0.18 + k * parameter.u, "{x} {y}: {parameter:?}");
                    inside += usize::from(noise > 0.0 && miss < 2.0 * parameter.u);
                }
            }
            // The errors of the linear axes have not changed: there is only a squareness.
            for (angle, value) in calibration.equations.angles[2].iter().zip(calibration.values_mm(Function::Linear)) {
                let expected = -0.5 * 45.0 * case.squareness * (2.0 * angle).sin();
                let u = if noise > 0.0 { 4.0 * 2.3e-3 } else { 2e-4 };
                assert!((value - expected).abs() < u, "{angle}: {value} {expected}");
            }
        }
    }
    // 32 intervals with a coverage of about 95 %.
    assert!(inside >= 27, "{inside} of 32");
}

#[test]
fn any_number_of_angles_and_any_second_direction() {
    for (count, second) in
        [(5, 72.0), (6, 60.0), (7, 360.0 / 7.0), (7, 720.0 / 7.0), (8, 135.0), (12, 30.0), (36, 10.0)]
    {
        let mut session = plan(count, second);
        let case = Touched { axis: [4e-3, -3e-3], cylinder: [0.030, 0.010], ..Touched::default() };
        touched(&mut session, &case);
        let calibration = calibrate(&session).unwrap();
        assert_eq!(calibration.equations.columns(), 4 * count);
        assert_eq!(calibration.rank_before, 4 * count - 2, "N = {count}");
        assert!(calibration.solution.identifiable.iter().all(|seen| *seen), "N = {count}");
        let report = calibration.report(&session, None);
        for (parameter, expected) in report.parameters.iter().zip([4.0, -3.0]) {
            assert!((parameter.value - expected).abs() < 0.05, "N = {count}: {parameter:?}");
        }
    }
}

/// Between the table and the bed there may be another axis under the table, or none.
#[test]
fn a_table_on_the_bed_has_the_same_errors() {
    let without_b = |machine: String| {
        let (before, rest) = machine.split_once("[axis.B]").unwrap();
        let (_, after) = rest.split_once("[axis.X]").unwrap();
        format!("{}[axis.X]{after}", before.replace("w C B b", "w C b"))
    };
    let mut session = plan_on(8, 45.0, without_b);
    assert_eq!(session.machine.workpiece_side, 1);
    touched(&mut session, &Touched { axis: [4e-3, -3e-3], cylinder: [0.030, 0.010], ..Touched::default() });
    let report = calibrate(&session).unwrap().report(&session, None);
    for (parameter, expected) in report.parameters.iter().zip([4.0, -3.0]) {
        assert!((parameter.value - expected).abs() < 0.05, "{parameter:?}");
    }
}

/// With eight angles, a second direction at 90° connects only every second angle: one further combination is not
/// identifiable.
#[test]
fn a_direction_that_divides_the_angles_leaves_named_combinations_unidentified() {
    let session = unmoved(8, 90.0);
    let calibration = calibrate(&session).unwrap();
    assert_eq!(calibration.rank_before, 29);
    let report = calibration.report(&session, None);
    assert_eq!(report.unobservable.len(), 1);
    assert!(report.unobservable[0].combination.len() > 4);
    let stderr = report.functions.iter().flat_map(|function| &function.points);
    assert!(stderr.clone().any(|point| point.value_um.is_none()));
    assert!(report.parameters.is_empty());
    assert!(report.warnings.iter().any(|warning| warning.contains("the position of the axis is not estimated")));
}

#[test]
fn monte_carlo_agrees_with_the_law_of_propagation_and_is_repeatable() {
    let mut session = plan(8, 45.0);
    let case = Touched { axis: [0.3, 0.51], ..Touched::default() };
    touched(&mut session, &case);
    let calibration = calibrate(&session).unwrap();
    let draws = |seed| MonteCarlo { runs: 200_001, seed, coverage: 0.95 };
    let drawn = calibration.monte_carlo(&draws(1));
    for (k, distribution) in drawn.iter().take(calibration.solution.values_mm.len()).enumerate() {
        let u = calibration.solution.covariance[(k, k)].sqrt();
        let total: u64 = distribution.counts.iter().sum::<u64>() + distribution.outside.iter().sum::<u64>();
        assert_eq!(total, 200_001);
        if u < 1e-9 {
            continue;
        }
        assert!((distribution.u / u - 1.0).abs() < 0.008, "{k}: {} {u}", distribution.u);
        assert!((distribution.mean - calibration.solution.values_mm[k]).abs() < 0.01 * u);
        for interval in [distribution.shortest, distribution.symmetric] {
            let half = 0.5 * (interval[1] - interval[0]) / u;
            assert!((half - 1.96).abs() < 0.03, "{k}: {half}");
        }
    }
    // The circle is large compared with the noise, so its centre is practically linear in the readings.
    let report = calibration.report(&session, None);
    let by_law = report.parameters.iter().chain(&report.parameters_by_turn);
    for (distribution, parameter) in drawn[calibration.solution.values_mm.len()..].iter().zip(by_law) {
        assert!((distribution.u * 1e3 / parameter.u - 1.0).abs() < 0.008, "{parameter:?}");
    }
    // The same seed on one thread gives the same bits; another seed does not.
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(drawn, alone.install(|| calibration.monte_carlo(&draws(1))));
    assert_ne!(drawn, calibration.monte_carlo(&draws(2)));
}

/// A report has the distribution of every value that is not fixed, and of the position of the axis by circle and by turn;
/// where the position is not estimated, not of it. Lengths are in µm.
#[test]
fn distributions_are_reported_with_their_quantities() {
    let draws = MonteCarlo { runs: 20_000, seed: 4, coverage: 0.95 };
    for (second_deg, count) in [(45.0, 8), (60.0, 6)] {
        let mut session = plan(count, second_deg);
        touched(&mut session, &Touched { axis: [0.3, 0.51], ..Touched::default() });
        let calibration = calibrate(&session).unwrap();
        let report = calibration.report(&session, Some(&draws));
        let found = report.monte_carlo.unwrap();
        assert_eq!((found.draws.runs, found.draws.seed, found.draws.coverage), (20_000, 4, 0.95));
        let drawn = calibration.monte_carlo(&draws);
        let ids: Vec<&str> = found.quantities.iter().map(|quantity| quantity.id.as_str()).collect();
        let positions: Vec<String> = report.parameters.iter().map(|parameter| parameter.id.clone()).collect();
        let by_turn = positions.iter().map(|id| format!("{id} by turn"));
        let last: Vec<String> = positions.iter().cloned().chain(by_turn).collect();
        assert_eq!(ids[ids.len() - last.len()..], last);
        println!("{} quantities, of them {} positions", ids.len(), last.len());
        let free = |u: Option<f64>| u.is_some_and(|u| u > 1e-6);
        let points: usize = report.functions.iter().flat_map(|own| &own.points).filter(|own| free(own.u_um)).count();
        assert_eq!(ids.len(), points + usize::from(report.radius.is_some()) + last.len());
        let of_values: Vec<(String, f64, f64)> = report
            .functions
            .iter()
            .flat_map(|function| function.points.iter().map(move |point| (function, point)))
            .filter(|(_, point)| free(point.u_um))
            .map(|(function, point)| {
                (format!("{}({}°)", function.id, point.at_deg), point.value_um.unwrap(), point.u_um.unwrap())
            })
            .chain(report.parameters.iter().map(|own| (own.id.clone(), own.value, own.u)))
            .chain(report.parameters_by_turn.iter().map(|own| (format!("{} by turn", own.id), own.value, own.u)))
            .collect();
        for (id, value, u) in of_values {
            let own = found.quantities.iter().find(|own| own.id == id).unwrap_or_else(|| panic!("{id} {ids:?}"));
            assert!((own.u_um / u - 1.0).abs() < 0.03, "{id}: {} {u}", own.u_um);
            assert!((own.mean_um - value).abs() < 0.05 * u, "{id}: {} {value}", own.mean_um);
            let histogram = &own.histogram;
            assert_eq!(histogram.counts.iter().sum::<u64>() + histogram.below + histogram.above, 20_000, "{id}");
            assert!(histogram.from_um < value - 2.0 * u && histogram.to_um > value + 2.0 * u, "{id} {histogram:?}");
            for interval in [&own.shortest_interval_um, &own.symmetric_interval_um] {
                assert!(((interval.high - interval.low) / (2.0 * 1.96 * u) - 1.0).abs() < 0.06, "{id} {interval:?}");
                assert!((0.5 * (interval.high + interval.low) - value).abs() < 0.15 * u, "{id} {interval:?}");
            }
        }
        assert_eq!(drawn.len(), calibration.solution.values_mm.len() + if last.is_empty() { 0 } else { 4 });
    }
}

#[test]
fn noise_that_is_not_stated_follows_from_repeated_cycles() {
    let mut random = Pcg64::seed_from_u64(5);
    let mut ratios = Vec::new();
    for _ in 0..20 {
        let mut session = plan(12, 30.0);
        for test in &mut session.tests {
            if let Some(motion) = &mut test.motion {
                motion.course.traversals = Traversals::new(3, motion.course.traversals.both_directions());
            }
        }
        session.noise_mm = None;
        let case = Touched { noise: (0.8e-3, random.random()), ..Touched::default() };
        touched(&mut session, &case);
        let calibration = calibrate(&session).unwrap();
        assert_eq!(calibration.noise_source, NoiseSource::Repeats);
        ratios.push(calibration.sigma_mm / 0.8e-3);
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    assert!((mean - 1.0).abs() < 0.04, "{mean}");
}

#[test]
fn a_session_of_another_kind_is_refused_with_a_remedy() {
    let refused = |session: &Session| Equations::of(session).unwrap_err().to_string();
    let bar = files::session(&ready("hermle-c600u/measured/session.toml"), &ReadOptions::default()).unwrap();
    assert!(refused(&bar).contains("instrument `ballbar`, not `probe`"));
    assert!(refused(&plan(8, 45.0)).contains("no readings"));
    let mut two = unmoved(8, 45.0);
    two.tests[1].setup = "another".into();
    assert!(refused(&two).contains("one artefact in one clamping"));
    let mut standing = unmoved(8, 45.0);
    standing.tests.retain(|test| test.name == "2");
    assert!(refused(&standing).contains("no rotary axis turns"));
    let output = abbe(&[
        "fit",
        text(&ready("hermle-c600u/measured/session.toml")),
        "--method",
        "self-calibration",
        "--monte-carlo",
        "20000",
    ]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("instrument `ballbar`, not `probe`"));
}

/// `--csv` of the published methods is for programs: one value a cell, with all its digits.
#[test]
fn the_values_of_a_method_are_numbers_with_all_digits() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let simulated = |plan: &str| {
        let run = abbe(&["simulate", text(&ready(plan)), "--out", text(&out), "--seed", "3", "--quiet", "--force"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        out.join("session.toml")
    };
    for (plan, method) in [
        ("self-calibration/session.toml", "self-calibration"),
        ("hermle-c600u/chapter5.toml", "circle"),
        ("hermle-c600u/chapter6.toml", "two-plane"),
    ] {
        let (session, csv, json) = (simulated(plan), folder.path().join("values.csv"), folder.path().join("m.json"));
        let run =
            abbe(&["fit", text(&session), "--method", method, "--csv", text(&csv), "--json", text(&json), "--quiet"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let values = std::fs::read_to_string(&csv).unwrap();
        let mut rows = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(values.as_bytes());
        let mut count = 0;
        for row in rows.records() {
            let row = row.unwrap();
            assert!(row[3].parse::<f64>().is_ok() && (row[4].is_empty() || row[4].parse::<f64>().is_ok()), "{row:?}");
            assert!(row.iter().all(|cell| !cell.starts_with('\'') && !cell.contains('\u{b1}')), "{row:?}");
            count += 1;
        }
        assert!(count > 10, "{values}");
        let found: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
        let rms = found[if method == "self-calibration" { "rms_um" } else { "method_rms_um" }].to_string();
        assert!(values.contains(&rms), "{rms} in {values}");
        std::fs::remove_dir_all(&out).unwrap();
    }
}
