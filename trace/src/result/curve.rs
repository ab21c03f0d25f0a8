//! The curve of an effect over its driver with its uncertainty: nonparametric curves and spectra.
//!
//! A spectrum is drawn over one period of a rotary axis, or over the positions of a linear axis. Points without a
//! reading nearby are marked: there the prior determines the curve.

use abbe_identify::fit::{Fit, contribution_beside_noise};
use abbe_identify::problem::Problem;
use abbe_model::driver::{Driver, DriverSample};
use abbe_model::effect::{Effect, Shape};
use faer::Mat;

use crate::result::CurvePoint;

/// Number of points of a reported curve.
const CURVE_POINTS: usize = 73;
/// Points for each order of a spectrum.
const POINTS_PER_ORDER: usize = 8;

/// The positions at which an effect is drawn, and the positions of the readings that it depends on, over one period.
struct Drawn {
    points: Vec<f64>,
    /// The period, if it is drawn over one.
    period: Option<f64>,
    /// Distance from the nearest reading beyond which a point is extrapolated; infinite for a nonparametric curve.
    reach: f64,
}

impl Drawn {
    /// `None` for an effect that is no curve.
    fn of(problem: &Problem, effect: &Effect) -> Option<Drawn> {
        let spaced = |from: f64, to: f64, count: usize| -> Vec<f64> {
            (0..count).map(|k| from + (to - from) * k as f64 / (count - 1) as f64).collect()
        };
        if let Some([from, to]) = effect.shape.curve_ends() {
            return Some(Drawn { points: spaced(from, to, CURVE_POINTS), period: None, reach: f64::INFINITY });
        }
        let Shape::Spectrum(spectrum) = &effect.shape else { return None };
        let count = (POINTS_PER_ORDER * spectrum.orders + 1).max(CURVE_POINTS);
        let half = 0.5 * spectrum.period;
        let rotary = effect.driver_unit(&problem.session.machine).is_angle();
        let [from, to] = if rotary { [-half, half] } else { range(&positions(problem, effect))? };
        let reach = half / spectrum.orders as f64;
        Some(Drawn { points: spaced(from, to, count), period: rotary.then_some(spectrum.period), reach })
    }

    /// Whether no reading lies near each of the points.
    fn extrapolated(&self, mut read: Vec<f64>) -> Vec<bool> {
        if self.reach.is_infinite() {
            return vec![false; self.points.len()];
        }
        if let Some(period) = self.period {
            let wrapped = |value: &f64| value - period * (value / period).round();
            let one: Vec<f64> = read.iter().map(wrapped).collect();
            read = one.iter().flat_map(|value| [value - period, *value, value + period]).collect();
        }
        read.sort_by(f64::total_cmp);
        let near = |point: f64| {
            let next = read.partition_point(|value| *value < point - self.reach);
            read.get(next).is_some_and(|value| *value <= point + self.reach)
        };
        self.points.iter().map(|point| !near(*point)).collect()
    }
}

/// The positions of an effect's axis in its tests, internal units; empty without an axis.
fn positions(problem: &Problem, effect: &Effect) -> Vec<f64> {
    let Some(axis) = effect.driver.axis(&problem.session.machine).filter(|_| matches!(effect.driver, Driver::Axis(_)))
    else {
        return Vec::new();
    };
    let tests = problem.tests.iter().filter(|test| effect.acts_in(&test.name));
    let readings = tests.filter_map(|test| test.readings.as_ref());
    readings.flat_map(|readings| readings.positions[axis].iter().copied()).collect()
}

/// The least and the largest of some values; `None` without two different ones.
fn range(values: &[f64]) -> Option<[f64; 2]> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (low < high).then_some([low, high])
}

/// The points of the curve of the `number`-th effect with their standard uncertainty; empty if it is no curve.
pub(super) fn curve_of(problem: &Problem, fit: &Fit, number: usize) -> Vec<CurvePoint> {
    let Some(effect) = problem.parameters.effects.get(number) else {
        return Vec::new();
    };
    let Some(drawn) = Drawn::of(problem, effect) else {
        return Vec::new();
    };
    let places: Vec<usize> = (0..problem.parameters.list.len())
        .filter(|j| problem.parameters.list[*j].coefficient_of() == Some(number))
        .collect();
    let Some(first) = places.first() else {
        return Vec::new();
    };
    let outside = problem.parameters.list[*first].unit.display_per_internal;
    let at_outside = effect.driver_unit(&problem.session.machine).to_display(1.0);
    let covariance = Mat::from_fn(places.len(), places.len(), |i, k| fit.covariance[(places[i], places[k])]);
    let extrapolated = drawn.extrapolated(positions(problem, effect));
    let points = drawn.points.iter().zip(extrapolated);
    points
        .map(|(q, extrapolated)| {
            let mut basis = Vec::new();
            effect.shape.basis(&DriverSample { value: *q, ..DriverSample::default() }, &mut basis);
            let value_at = |beta: &[f64]| -> f64 { basis.iter().zip(&places).map(|(b, j)| b * beta[*j]).sum() };
            let value = value_at(&fit.beta);
            let column = Mat::from_fn(basis.len(), 1, |k, _| basis[k]);
            let variance = (column.transpose() * (&covariance * &column))[(0, 0)];
            let moved = contribution_beside_noise(fit, 1, |beta| vec![value_at(beta)]);
            CurvePoint {
                at: q * at_outside,
                value: value * outside,
                u: (variance.max(0.0).sqrt() * fit.u_enlargement).hypot(moved[0]) * outside,
                extrapolated,
            }
        })
        .collect()
}

/// Units of the positions and values of a curve; empty for other shapes.
pub(super) fn curve_units(problem: &Problem, effect: &Effect) -> (String, String) {
    if effect.shape.curve_ends().is_none() && !effect.shape.needs_prior() {
        return (String::new(), String::new());
    }
    (
        effect.driver_unit(&problem.session.machine).result().to_string(),
        abbe_identify::unit::ParameterUnit::of_effect(&problem.session, effect, 0).name,
    )
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::fit::{AliasChange, EffectAliases, fit, prepare};
    use abbe_model::driver::Driver;
    use abbe_model::effect::Component;
    use abbe_model::effect::shape::Curve;

    use super::*;

    #[test]
    fn the_band_of_a_curve_is_enlarged_as_every_uncertainty_is_and_covers_what_aliases_move() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let (mut problem, _) = prepare(&session, 1).unwrap();
        let turn = 360_f64.to_radians();
        problem
            .add_effect(&Effect::new(
                Component::parse("EZC").unwrap(),
                Driver::parse("C"),
                Shape::Curve(Curve { from: 0.0, to: turn, intervals: 6, closed: false }),
            ))
            .unwrap();
        let mut fit = fit(&problem, None).unwrap();
        let number = problem.parameters.effects.len() - 1;
        fit.u_enlargement = 1.0;
        let by_noise = curve_of(&problem, &fit, number);
        fit.u_enlargement = 1.5;
        let enlarged = curve_of(&problem, &fit, number);
        assert_eq!(by_noise.len(), CURVE_POINTS);
        let spaced = |k: usize| 360.0 * k as f64 / (CURVE_POINTS - 1) as f64;
        assert!((0..CURVE_POINTS).all(|k| (by_noise[k].at - spaced(k)).abs() < 1e-9), "{by_noise:?}");
        for (by_noise, enlarged) in by_noise.iter().zip(&enlarged) {
            assert!(by_noise.u > 0.0);
            assert!((enlarged.u / by_noise.u - 1.5).abs() < 1e-12);
            assert_eq!(enlarged.value, by_noise.value);
        }

        // The splines sum to one: an alias that changes all coefficients by 1 µm changes the curve by 1 µm.
        let of_curve = |j: usize| problem.parameters.list[j].coefficient_of() == Some(number);
        let alias: Vec<f64> = (0..fit.beta.len()).map(|j| if of_curve(j) { 1e-3 } else { 0.0 }).collect();
        let alias = AliasChange { alias: 0, changes: alias, delta_chi2: 0.0 };
        fit.aliases = vec![EffectAliases { effect: number, aliases: vec![alias] }];
        let covered = curve_of(&problem, &fit, number);
        for (enlarged, covered) in enlarged.iter().zip(&covered) {
            assert!((covered.u - enlarged.u.hypot(1.0)).abs() < 1e-9);
            assert_eq!(covered.value, enlarged.value);
        }
    }
}
