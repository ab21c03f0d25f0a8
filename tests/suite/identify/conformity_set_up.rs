//! Figures of rotary sweeps and the set-up of the balls: uncertainty, coverage and decisions against readings of a closed
//! form; what a bar beside the radius and a bar of unknown length do not tell.

use abbe::identify::results::{Goodness, GoodnessVerdict, ModelResult, Outcome};
use std::f64::consts::TAU;

use abbe::files::read::add_node;
use abbe::files::table::memory::MemoryColumn;
use abbe::identify::circular::{CircularTest, of_session};
use abbe::identify::figure::find;
use abbe::identify::noise::ReadingNoise;
use abbe::identify::tolerance::rule::Decision;
use abbe::identify::tolerance::{ConformityItem, conformity};
use abbe::model::chain::Machine;
use abbe::model::instrument::InstrumentKind;
use abbe::model::instrument::ballbar::BAR;
use abbe::model::session::tolerance::{Limit, TestFigure, Tolerance, Toleranced};
use abbe::model::session::{Prior, Session};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde_json::json;

const ROWS: usize = 72;
const RADIUS: f64 = 100.0;
/// Standard uncertainties of each coordinate of the workpiece ball, of the spindle ball, and of the bar, mm.
const U_WORKPIECE: [f64; 3] = [8e-3, 5e-3, 3e-3];
const U_SPINDLE: [f64; 3] = [9e-3, 7e-3, 4e-3];
const U_BAR: f64 = 1e-3;

/// Length of a bar from a ball at radius 100 mm of C to a ball above the centre, with both displaced in their frames, mm.
fn length(c: f64, height: f64, workpiece: [f64; 3], spindle: [f64; 3]) -> f64 {
    let (x, y) = (workpiece[0], RADIUS + workpiece[1]);
    let own = [x * c.cos() - y * c.sin(), x * c.sin() + y * c.cos(), workpiece[2]];
    let other = [spindle[0], spindle[1], height + spindle[2]];
    (0..3).map(|i| (other[i] - own[i]).powi(2)).sum::<f64>().sqrt()
}

/// A sweep of C over a full turn in both directions, `runs` in each, with the spindle ball at a height over the workpiece
/// ball. `deviation` adds to the length at an angle in a run, mm.
fn session(height: f64, runs: i64, mut reading: impl FnMut(f64, i64) -> f64) -> Session {
    let mut session = Session::new(Machine::from_code("[wCbXYZt]").unwrap(), InstrumentKind::BallBar);
    session.noise_mm = Some(1e-4);
    let (mut c, mut run, mut observed) = (Vec::new(), Vec::new(), Vec::new());
    for number in 0..2 * runs {
        for k in 0..=ROWS {
            let there = TAU * k as f64 / ROWS as f64;
            c.push(if number % 2 == 0 { there } else { TAU - there });
            run.push((number + 1) as f64);
            observed.push(reading(c[c.len() - 1], number));
        }
    }
    let columns = [("c_rad", &c), ("length_mm", &observed), ("run", &run)];
    let columns = columns.map(|(name, values)| MemoryColumn::numbers(name, values));
    let test = json!({"name": "C", "bar_mm": RADIUS.hypot(height), "workpiece_ball_mm": [0, RADIUS, 0],
                      "spindle_ball_mm": [0, 0, 0], "at": {"z_mm": height}});
    add_node(&mut session, "test", test.into(), &columns).unwrap();
    session
}

fn figures(session: &Session) -> Vec<CircularTest> {
    let rows = session.tests[0].readings.as_ref().unwrap().rows();
    of_session(session, 1e-4, &[vec![false; rows]])
}

/// The decision about a figure.
fn decided(session: &mut Session, figure: TestFigure, lower: f64, upper: f64, noise_um: f64) -> ConformityItem {
    let of = Toleranced::Figure { test: "C".into(), figure, instrument_u_um: 0.0 };
    let limits = vec![Limit { of, lower: Some(lower), upper, unit: "um" }];
    session.tolerance = Some(Tolerance { probability: 0.95, limits });
    let goodness = Goodness::default().with_verdict(GoodnessVerdict::Agrees);
    let noise = ReadingNoise { value: noise_um, ..ReadingNoise::default() };
    let model = ModelResult { noise, outcome: Outcome { goodness, ..Outcome::default() }, ..ModelResult::default() };
    conformity(session, &model, &figures(session)).unwrap().items.remove(0)
}

fn with_priors(mut session: Session) -> Session {
    let u: Vec<f64> = U_WORKPIECE.into_iter().chain(U_SPINDLE).collect();
    for (prior, u) in session.tests[0].priors.iter_mut().zip(u) {
        *prior = Prior::Gaussian(u);
    }
    session.tests[0].priors[BAR] = Prior::Gaussian(U_BAR);
    session
}

/// Balls, bar and noise are drawn 2000 times. The uncertainty is that of the drawing; 95 % of the intervals of ± 1.96 u
/// contain the true D and F; at the limit 5 % pass and 5 % fail.
#[test]
fn the_set_up_of_the_balls_is_in_the_uncertainty_of_d_and_f() {
    const DRAWS: usize = 2000;
    const HEIGHT: f64 = 75.0;
    const NOISE: f64 = 0.2e-3;
    const TRUE_D_UM: f64 = 12.0;
    const AMPLITUDE_UM: f64 = 20.0;
    let nominal = RADIUS.hypot(HEIGHT);
    let (up, out) = (HEIGHT / nominal, RADIUS / nominal);
    // The centre absorbs the spindle ball across the axis, and along the path the workpiece ball is not measured.
    let expected_um =
        1e3 * (up * U_SPINDLE[2]).hypot(up * U_WORKPIECE[2]).hypot(out * U_WORKPIECE[1]).hypot(U_BAR).hypot(NOISE);
    let mut random = Pcg64::seed_from_u64(6);
    let mut covered = [0; 2];
    let mut passed_failed = [0; 2];
    for _ in 0..DRAWS {
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let workpiece = U_WORKPIECE.map(|u| u * draw());
        let spindle = U_SPINDLE.map(|u| u * draw());
        let bar = U_BAR * draw();
        let mut session = with_priors(session(HEIGHT, 1, |c, _| {
            let own = (TRUE_D_UM + AMPLITUDE_UM * (2.0 * c).cos()) * 1e-3;
            length(c, HEIGHT, workpiece, spindle) + own + bar + NOISE * draw()
        }));
        let d = decided(&mut session, TestFigure::MeanBidirectionalRadialDeviation, -500.0, TRUE_D_UM, 1e3 * NOISE);
        let f = decided(&mut session, TestFigure::RadialDeviation, -500.0, 20.0, 1e3 * NOISE);
        for ((item, truth), covered) in [(&d, TRUE_D_UM), (&f, TRUE_D_UM + AMPLITUDE_UM)].into_iter().zip(&mut covered)
        {
            let (value, u) = (item.value.unwrap(), item.u.unwrap());
            assert!((u / expected_um - 1.0).abs() < 2e-3, "{u} µm, expected {expected_um}");
            *covered += usize::from((value - truth).abs() <= 1.96 * u);
        }
        passed_failed[0] += usize::from(d.decision == Decision::Pass);
        passed_failed[1] += usize::from(d.decision == Decision::Fail);
    }
    let sampling = (0.05_f64 * 0.95 / DRAWS as f64).sqrt();
    let share = |count: usize| count as f64 / DRAWS as f64;
    println!(
        "u {expected_um:.3} um, covered {:?}, at the limit {:?} (± {sampling:.4})",
        covered.map(share),
        passed_failed.map(share)
    );
    for count in covered.map(|count| DRAWS - count).into_iter().chain(passed_failed) {
        assert!((share(count) - 0.05).abs() < 3.5 * sampling, "{count} of {DRAWS}");
    }
}

/// A ball without a prior leaves D and F undecided, unless the centre absorbs what is unknown.
#[test]
fn an_unknown_ball_leaves_a_figure_undecided_only_where_it_moves_it() {
    let mut session = session(75.0, 1, |c, _| length(c, 75.0, [0.0; 3], [0.0; 3]) + 0.01);
    let d = TestFigure::MeanBidirectionalRadialDeviation;
    for (coordinate, is_decided) in [(0, true), (1, false), (2, false), (3, true), (4, true), (5, false)] {
        session.tests[0].priors = vec![Prior::Known; session.tests[0].priors.len()];
        session.tests[0].priors[coordinate] = Prior::Free;
        let item = decided(&mut session, d, -50.0, 50.0, 0.1);
        assert_eq!(item.decision == Decision::Pass, is_decided, "{coordinate}: {item:?}");
        assert_eq!(item.why.is_some_and(|why| why.contains("position of a ball that is not known")), !is_decided);
        // A range about the centre does not contain the mean.
        let item = decided(&mut session, TestFigure::BidirectionalCircularDeviation, -50.0, 50.0, 0.1);
        assert_eq!(item.decision, Decision::Pass, "{coordinate}: {item:?}");
    }
}

/// The radial deviations need the length of the bar; the others do not.
#[test]
fn a_bar_of_unknown_length_leaves_d_and_f_undecided() {
    let mut session = session(75.0, 1, |c, _| length(c, 75.0, [0.0; 3], [0.0; 3]) + 0.01);
    for (prior, expected) in [(Prior::Free, Decision::Undecided), (Prior::Gaussian(1e-3), Decision::Pass)] {
        session.tests[0].priors[BAR] = prior;
        for figure in [TestFigure::RadialDeviation, TestFigure::MeanBidirectionalRadialDeviation] {
            let item = decided(&mut session, figure, -50.0, 50.0, 0.1);
            assert_eq!(item.decision, expected, "{item:?}");
            let says = item.why.is_some_and(|why| why.contains("the bar length is not calibrated"));
            assert_eq!(says, expected == Decision::Undecided);
        }
        let item = decided(&mut session, TestFigure::CircularDeviation, -50.0, 50.0, 0.1);
        assert_eq!(item.decision, Decision::Pass, "{item:?}");
    }
}

/// Error motions of an axis need a bar along its radius. A bar beside it measures axial and radial motion together.
#[test]
fn error_motions_need_a_radial_bar() {
    // Twice the amplitude is synchronous; every second run in a direction is displaced by 3 µm.
    let own = |c: f64, run: i64| 4e-3 * (2.0 * c).cos() + if run / 2 % 2 == 1 { 3e-3 } else { 0.0 };
    for (height, is_radial) in [(0.0, true), (5.0, true), (75.0, false)] {
        let session = session(height, 2, |c, run| length(c, height, [0.0; 3], [0.0; 3]) + own(c, run));
        let found = &figures(&session)[0];
        let said = found.not_identifiable.iter().any(|words| words.contains("the bar is not radial to C"));
        assert_eq!(said, !is_radial, "{height}: {:?}", found.not_identifiable);
        for direction in &found.directions {
            let motions = ["synchronous_error_motion", "asynchronous_error_motion"]
                .map(|id| find(&direction.figures, id).map(|figure| figure.value));
            assert_eq!(motions.map(|motion| motion.is_some()), [is_radial; 2], "{height}: {direction:?}");
            for (motion, expected) in motions.into_iter().zip([8.0, 3.0]) {
                // Both ends of the turn count, so that the centre absorbs a part of the second harmonic.
                assert!(motion.is_none_or(|motion| (motion - expected).abs() < 0.15), "{motion:?}");
            }
        }
        let mut session = session;
        let item = decided(&mut session, TestFigure::SynchronousErrorMotion, -20.0, 20.0, 0.1);
        assert_eq!(item.decision == Decision::Pass, is_radial, "{item:?}");
    }
}
