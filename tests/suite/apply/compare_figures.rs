//! Every figure of a comparison, recomputed by hand from the estimates and the covariances of the two models.

use abbe::apply::compare::results::{Comparison, Difference};
use abbe::apply::compare::{CompareOptions, Named, compare};
use abbe::identify::fit;
use abbe::identify::model_file::{IdentifiedModel, Provenance};
use abbe::identify::quantity::Given;
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::chain::{ERRORS_PER_AXIS, Frame, Machine};
use abbe::model::frames::Point;
use abbe::model::session::{Prior, Session};
use nalgebra::{DMatrix, DVector, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use crate::suite::plan::figures::{EIGHT, plan};

/// A model of simulated readings. `known` states where the balls are.
fn model(plan: &Session, known: bool, given: &[(&str, f64)], seed: u64) -> IdentifiedModel {
    let mut session = plan.clone();
    if known {
        session.tests.iter_mut().for_each(|test| test.priors[..6].fill(Prior::Known));
    }
    let given = given.iter().map(|(id, um)| Given { id: id.to_string(), value: *um, unit: "um".into() }).collect();
    let simulation = Simulation { given, draw_setups: !known, seed, ..Simulation::default() };
    let readings = simulate(&session, &simulation).unwrap().readings;
    let (problem, fit) = fit::prepare(&session.with_readings(readings), 1).unwrap();
    IdentifiedModel::of_fit(&problem, &fit, Provenance::default()).unwrap()
}

fn compared(a: &IdentifiedModel, b: &IdentifiedModel, shared: Option<&str>, places: usize) -> Comparison {
    let named = [Named { name: "before".into(), model: a }, Named { name: "after".into(), model: b }];
    let shared = shared.map(|kind| vec![kind.to_string()]);
    compare(&named, &CompareOptions { places, shared, ..CompareOptions::default() }).unwrap()
}

fn place(model: &IdentifiedModel, id: &str) -> usize {
    model.parameters.iter().position(|parameter| parameter.id.to_string() == id).unwrap_or_else(|| panic!("{id}"))
}

/// Value in display units, and that unit's size.
fn value(model: &IdentifiedModel, id: &str) -> f64 {
    model.parameters[place(model, id)].value * display(id)
}

fn display(id: &str) -> f64 {
    let is_angle = id.starts_with('E') && matches!(id.as_bytes()[1], b'A'..=b'C');
    if is_angle { 180.0 * 3600.0 / std::f64::consts::PI } else { 1e3 }
}

fn near(found: f64, wanted: f64, what: &str) {
    assert!((found - wanted).abs() <= 1e-5 * wanted.abs().max(1e-9), "{what}: {found} instead of {wanted}");
}

/// Differences with their covariance: the words, probabilities and counts that follow from them.
fn check(found: &Comparison, ids: &[&str], delta: &DVector<f64>, covariance: &DMatrix<f64>) {
    assert_eq!(found.inputs, ["before", "after"]);
    assert_eq!((found.significance, found.pairs.len()), (0.05, 1));
    let pair = &found.pairs[0];
    assert_eq!((pair.from.as_str(), pair.to.as_str()), ("before", "after"));
    assert_eq!((pair.compared, pair.degrees_of_freedom), (ids.len(), ids.len()));
    assert_eq!(found.differences.len(), ids.len());
    let chi_square = (delta.transpose() * covariance.clone().try_inverse().unwrap() * delta)[(0, 0)];
    near(pair.chi_square, chi_square, "χ²");
    let tail = ChiSquared::new(ids.len() as f64).unwrap().sf(chi_square);
    assert!((pair.p_value - tail).abs() < 1e-5 * tail + 1e-12, "{} {tail}", pair.p_value);
    let mut p_values = Vec::new();
    for (k, id) in ids.iter().enumerate() {
        let difference: &Difference = found.differences.iter().find(|difference| difference.change.id == *id).unwrap();
        assert_eq!((difference.from.as_str(), difference.to.as_str()), ("before", "after"));
        let u = covariance[(k, k)].sqrt();
        near(difference.change.value, delta[k], &format!("the difference of {id}"));
        near(difference.change.u, u, &format!("u of {id}"));
        assert_eq!(difference.change.unit, if display(id) == 1e3 { "um" } else { "arcsec" });
        let p = 2.0 * Normal::standard().sf((delta[k] / u).abs());
        assert!((difference.p_value - p).abs() < 1e-4 * p + 1e-12, "{id}: {} {p}", difference.p_value);
        p_values.push(p);
    }
    assert!(found.differences.is_sorted_by(|a, b| a.p_value <= b.p_value));
    p_values.sort_by(f64::total_cmp);
    let count = p_values.iter().enumerate().take_while(|(k, p)| *p * (ids.len() - k) as f64 <= 0.05).count();
    assert_eq!(pair.significant, count);
    for (k, difference) in found.differences.iter().enumerate() {
        assert_eq!(difference.significant, k < count, "{}", difference.change.id);
    }
}

const IDS: [&str; 8] = ["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"];

/// Covariance of some parameters in display units.
fn block(model: &IdentifiedModel, ids: &[&str]) -> DMatrix<f64> {
    DMatrix::from_fn(ids.len(), ids.len(), |i, j| {
        let covariance = model.covariance[(place(model, ids[i]), place(model, ids[j]))];
        covariance * display(ids[i]) * display(ids[j])
    })
}

/// Sessions with nothing in common: `Cov = C_A + C_B`. One of them has an effect that the other does not have.
#[test]
fn differences_of_separate_sessions_have_the_sum_of_the_covariances() {
    let before = [("EX0C", 10.0), ("EY0A", -20.0)];
    let a = model(&plan(EIGHT, ""), false, &before, 1);
    let effect = "[[effect]]\ncomponent = \"EZC\"\nshape = \"harmonic\"\norder = 2\n";
    let b = model(&plan(EIGHT, effect), false, &[("EX0C", 25.0), ("EY0A", -20.0), ("EZC~C:h2.cos", 3.0)], 2);
    let found = compared(&a, &b, Some("none"), 0);
    let delta = DVector::from_iterator(8, IDS.iter().map(|id| value(&b, id) - value(&a, id)));
    check(&found, &IDS, &delta, &(block(&a, &IDS) + block(&b, &IDS)));
    assert!(found.pairs[0].shared_setup.is_empty() && found.pairs[0].not_shared.is_empty());
    assert!(found.pairs[0].not_comparable.is_empty() && found.workspace.is_empty() && found.outliers.is_empty());
    let only: Vec<(&str, &str)> =
        found.pairs[0].only_in.iter().map(|only| (only.id.as_str(), only.model.as_str())).collect();
    assert_eq!(only, [("EZC~C:h2", "after")]);
    assert!(found.pairs[0].significant >= 1, "{:?}", found.differences);
}

/// One bar in both sessions: the second session is an observation of its own errors and of the bar, whose prior the
/// first one has already (a Kalman update of the bar by the second session's information without the prior).
#[test]
fn a_common_bar_enters_the_difference_once() {
    let plan = plan(EIGHT, "");
    let mut a = model(&plan, true, &[("EX0C", 10.0), ("bar[A]", 0.4), ("bar[C]", -0.5)], 3);
    let mut b = model(&plan, true, &[("EX0C", 10.9), ("bar[A]", 0.4), ("bar[C]", -0.5)], 4);
    for (model, factor) in [(&mut a, 1.5), (&mut b, 1.2)] {
        model.fit.u_enlargement = factor;
        model.covariance = &model.covariance * faer::Scale(factor * factor);
    }
    let found = compared(&a, &b, None, 0);
    let bars = ["bar[A]", "bar[C]"];
    assert_eq!(found.pairs[0].shared_setup, bars);
    let all: Vec<&str> = IDS.into_iter().chain(bars).collect();
    // Of the second session without the narrower common prior: values and covariance of its errors and bars.
    let mut information = block(&b, &all).try_inverse().unwrap();
    let values = DVector::from_iterator(10, all.iter().map(|id| value(&b, id)));
    let gradient = &information * &values;
    for k in 8..10 {
        information[(k, k)] -= 1.0 / (1.5 * 0.7 * 1.5 * 0.7);
    }
    let of_b = information.try_inverse().unwrap();
    let values_b = &of_b * gradient;
    // (errors of A, bars of A) are known with C_A; B's values are an observation of (errors of B, bars).
    let c_a = block(&a, &all);
    let value_a = DVector::from_iterator(10, all.iter().map(|id| value(&a, id)));
    let innovation = values_b.rows(8, 2) - value_a.rows(8, 2);
    let gain_covariance = c_a.view((8, 8), (2, 2)) + of_b.view((8, 8), (2, 2));
    let inverse = gain_covariance.try_inverse().unwrap();
    let bars_a = c_a.view((0, 8), (8, 2)).into_owned();
    let bars_b = of_b.view((0, 8), (8, 2)).into_owned();
    let errors_a = value_a.rows(0, 8) + &bars_a * &inverse * &innovation;
    let errors_b = values_b.rows(0, 8) - &bars_b * &inverse * &innovation;
    // δ = b − a: both move with the innovation.
    let moved = &bars_a + &bars_b;
    let covariance = c_a.view((0, 0), (8, 8)) + of_b.view((0, 0), (8, 8)) - &moved * &inverse * moved.transpose();
    check(&found, &IDS, &(errors_b - errors_a), &covariance);
}

/// Two bars of one name. Each is known to the readings alone by its estimate with the prior taken out.
#[test]
fn a_bar_that_is_another_has_the_difference_of_the_readings_alone() {
    let ids = ["EX0C", "EY0C", "EB0C"];
    let plan = plan("[\"EX0C\", \"EY0C\", \"EB0C\"]", "");
    let a = model(&plan, true, &[("bar[A]", 0.4), ("bar[C]", -0.5)], 5);
    let mut b = model(&plan, true, &[("bar[A]", 3.4), ("bar[C]", -0.5)], 6);
    b.fit.u_enlargement = 1.3;
    b.covariance = &b.covariance * faer::Scale(1.69);
    let found = compared(&a, &b, None, 0);
    assert!(found.pairs[0].shared_setup.is_empty());
    let alone = |model: &IdentifiedModel, id: &str, prior: f64| {
        let variance = block(model, &[id])[(0, 0)];
        let of_readings = 1.0 / (1.0 / variance - 1.0 / (prior * prior));
        (value(model, id) / variance * of_readings, of_readings)
    };
    for (id, refuted) in [("bar[A]", true), ("bar[C]", false)] {
        let one = found.pairs[0].not_shared.iter().find(|one| one.change.id == id).unwrap();
        let ((of_a, variance_a), (of_b, variance_b)) = (alone(&a, id, 0.7), alone(&b, id, 0.7 * 1.3));
        let u = (variance_a + variance_b).sqrt();
        near(one.change.value, of_b - of_a, &format!("the difference of {id}"));
        near(one.change.u, u, &format!("u of {id}"));
        let p = 2.0 * Normal::standard().sf(((of_b - of_a) / u).abs());
        assert!((one.p_value - p).abs() < 1e-4 * p + 1e-9, "{id}: {} {p}", one.p_value);
        assert_eq!((one.change.unit.as_str(), one.refuted), ("um", refuted), "{id}");
        println!("{id}: {:.3} ± {:.3} µm, p {:.2e}", one.change.value, one.change.u, one.p_value);
    }
    let delta = DVector::from_iterator(3, ids.iter().map(|id| value(&b, id) - value(&a, id)));
    check(&found, &ids, &delta, &(block(&a, &ids) + block(&b, &ids)));
}

/// The tool point in the table frame with small errors of the machine, mm.
fn error_vector(machine: &Machine, tool_mm: [f64; 3], positions: &[f64], errors: &[(usize, f64)]) -> Vector3<f64> {
    let state = machine.axis_positions(positions);
    let point = |errors: &[(usize, f64)]| {
        let of = |slot: usize| errors.iter().find(|(own, _)| *own == slot).map_or(0.0, |(_, value)| *value);
        let bodies = machine.body_errors(|slot| of(slot) != 0.0, of);
        Vector3::from(
            machine
                .in_frame(Frame::Table, &state, &bodies, machine.in_r(Frame::Tool, &state, &bodies, Point(tool_mm)))
                .0,
        )
    };
    point(errors) - point(&[])
}

/// The error of the tool point on a grid of the common range, and its uncertainty by finite differences.
#[test]
fn the_volumetric_error_is_that_of_the_chain_on_a_grid() {
    let plan = plan(EIGHT, "");
    let a = model(&plan, false, &[("EX0C", 10.0), ("EY0A", -20.0)], 7);
    let mut b = model(&plan, false, &[("EX0C", 30.0)], 8);
    // The second session covers less of C.
    for range in b.ranges.iter_mut().filter(|range| range.driver.to_string() == "C") {
        range.range = [0.5, 4.0];
    }
    let found = compared(&a, &b, Some("none"), 3).workspace;
    assert_eq!(found.len(), 2);
    let machine = &a.machine;
    let mut grid: Vec<Vec<f64>> = vec![Vec::new()];
    for (axis, reported) in machine.axes.iter().zip(&found[0].axes) {
        let of = |model: &IdentifiedModel| {
            let own = model.ranges.iter().find(|range| range.driver.to_string() == axis.name);
            own.unwrap().range
        };
        let (from, to) = (of(&a)[0].max(of(&b)[0]), of(&a)[1].min(of(&b)[1]));
        let (display, unit) =
            if axis.name == "A" || axis.name == "C" { (1f64.to_degrees(), "deg") } else { (1.0, "mm") };
        near(reported.from, from * display, &axis.name);
        near(reported.to, to * display, &axis.name);
        assert_eq!((reported.axis.as_str(), reported.unit.as_str()), (axis.name.as_str(), unit));
        let places = if to > from { vec![from, 0.5 * (from + to), to] } else { vec![from] };
        grid = grid.iter().flat_map(|row| places.iter().map(|at| [row.as_slice(), &[*at]].concat())).collect();
    }
    for (summary, model) in found.iter().zip([&a, &b]) {
        assert_eq!((summary.points, &summary.axes), (grid.len(), &found[0].axes));
        let slots: Vec<usize> = model.parameters[..8]
            .iter()
            .map(|parameter| {
                let id = parameter.id.to_string();
                let axis = machine.axis_index(&id[3..]).unwrap();
                axis * ERRORS_PER_AXIS + "XYZABC".find(&id[1..2]).unwrap()
            })
            .collect();
        let errors: Vec<(usize, f64)> =
            slots.iter().zip(&model.parameters).map(|(slot, parameter)| (*slot, parameter.value)).collect();
        let (mut squares, mut largest, mut variances) = (0.0, 0.0_f64, 0.0);
        for positions in &grid {
            let error = error_vector(machine, a.tool_mm, positions, &errors);
            squares += error.norm_squared();
            largest = largest.max(error.norm());
            let by: Vec<Vector3<f64>> = slots
                .iter()
                .map(|slot| {
                    let [plus, minus] =
                        [1e-4, -1e-4].map(|step| error_vector(machine, a.tool_mm, positions, &[(*slot, step)]));
                    (plus - minus) / 2e-4
                })
                .collect();
            for (i, x) in by.iter().enumerate() {
                variances += by.iter().enumerate().map(|(j, y)| x.dot(y) * model.covariance[(i, j)]).sum::<f64>();
            }
        }
        let count = grid.len() as f64;
        // The errors of the model may be applied to first order.
        assert!((summary.rms_um / ((squares / count).sqrt() * 1e3) - 1.0).abs() < 1e-3, "{summary:?}");
        assert!((summary.largest_um / (largest * 1e3) - 1.0).abs() < 1e-3, "{summary:?} {largest}");
        near(summary.u_um, (variances / count).sqrt() * 1e3, "u over the grid");
    }
}

/// Of two bars the readings show one to be another, and say nothing of the other one: that has no difference by the
/// readings alone, and is not shared either.
#[test]
fn a_bar_of_which_the_readings_say_nothing_has_no_difference_of_its_own() {
    let fitted = model(&plan(EIGHT, ""), true, &[], 9);
    let (ids, prior) = (["EX0C", "bar[A]", "bar[C]"], 0.7e-3);
    let of = |bar_mm: f64| {
        let mut model = fitted.clone();
        model.parameters = ids.map(|id| fitted.parameters[place(&fitted, id)].clone()).to_vec();
        for (parameter, value) in model.parameters.iter_mut().zip([0.0, bar_mm, 0.0]) {
            parameter.value = value;
        }
        // The first bar is known to 0.1 µm, the second one hardly better than its prior says.
        let u = [1e-3, 1e-4, 0.9999 * prior];
        model.covariance = faer::Mat::from_fn(3, 3, |i, j| if i == j { u[i] * u[i] } else { 0.0 });
        model.null_directions = Vec::new();
        model.fit.u_enlargement = 1.0;
        model
    };
    let found = compared(&of(0.0), &of(1e-3), None, 0);
    assert!(found.pairs[0].shared_setup.is_empty(), "{:?}", found.pairs[0].shared_setup);
    let named: Vec<&str> = found.pairs[0].not_shared.iter().map(|one| one.change.id.as_str()).collect();
    assert_eq!(named, ["bar[A]"]);
    // 1 µm over √2·0.1 µm, each with the prior of 0.7 µm taken out.
    let alone = 1.0 / (1.0 - (0.1_f64 / 0.7).powi(2));
    near(found.pairs[0].not_shared[0].change.value, alone, "the difference");
    near(found.pairs[0].not_shared[0].change.u, 0.1 * (2.0 * alone).sqrt(), "its u");
}
