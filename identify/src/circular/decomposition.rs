//! The least-squares decomposition of a circle, with the search for faults that have a nonlinear parameter: the width of a
//! reversal spike, the pitch of a cyclic error.
//!
//! A fault is significant if `P(χ² ≥ gain / s²)` times the number of candidates is below one in a thousand. `s²` is the
//! variance of the residual, enlarged for the correlation of neighbours.

use abbe_model::chain::Machine;

use super::faults::{Fault, cyclic, cyclic_by_direction, is_third_order, set_up, spike, standard, third_order};
use super::path::{MovingAxes, Path};
use super::rows::{Row, rows};
use crate::noise::enlargement_of_mean;
use crate::numerics::range;
use crate::numerics::regression::Regression;
use crate::numerics::tails::chi_square_tail;

/// Least arc for a diagnosis.
const MIN_ARC_DEG: f64 = 180.0;
/// Arc of a full circle.
const FULL_CIRCLE_DEG: f64 = 360.0;
/// Largest correlation of neighbouring residuals.
const MAX_CORRELATION: f64 = 0.99;
/// Significance level of a spike or cyclic error.
const SIGNIFICANCE: f64 = 1e-3;
/// Least amplitude, 2 nm. Smaller values are below the resolution of a ball bar, and the terms are of first order only:
/// 20 µm across a radius of 100 mm change it by 2 nm.
const MIN_MM: f64 = 2e-6;
/// Candidate widths of reversal spikes, degrees of the path.
const SPIKE_WIDTHS_DEG: [f64; 6] = [0.5, 1.0, 2.0, 3.0, 5.0, 8.0];

/// The decomposition of one circle: the set-up, then fault by fault.
pub(super) struct Decomposition {
    pub names: [String; 2],
    pub rows: Vec<Row>,
    pub faults: Vec<Fault>,
    pub regression: Regression,
}

/// Of a set-up and faults; `None` if they are not separable.
fn solve(rows: &[Row], faults: &[Fault]) -> Option<Regression> {
    let of_faults = faults.iter().flat_map(|fault| fault.columns.iter().cloned());
    let y: Vec<f64> = rows.iter().map(|row| row.y).collect();
    Regression::solve(set_up(rows).into_iter().chain(of_faults).collect(), &y)
}

/// Whether a gain of this many columns is significant after this many candidates.
fn is_significant(gain: f64, variance: f64, columns: usize, candidates: usize) -> bool {
    variance > 0.0 && chi_square_tail(gain / variance, columns as f64) * candidates as f64 <= SIGNIFICANCE
}

impl Decomposition {
    /// Decomposes a path. The error holds the reason in words if the path is a circle of linear axes.
    pub fn of(machine: &Machine, path: &Path) -> Result<Decomposition, Option<String>> {
        let MovingAxes::Linear { axes, radius_mm, radial } = path.moves else {
            return Err(None);
        };
        let arc_deg = path.arc().to_degrees();
        if !radial {
            return Err(Some("no diagnosis: the bar does not lie in the plane of the circle".into()));
        }
        if arc_deg < MIN_ARC_DEG * 0.99 {
            return Err(Some(format!("no diagnosis: an arc of {arc_deg:.0}° is too short for it")));
        }
        let names = axes.map(|axis| machine.axes[axis].name.clone());
        let rows = rows(path);
        let faults = standard(machine, path, &rows, axes, radius_mm);
        let Some(regression) = solve(&rows, &faults) else {
            return Err(Some("no diagnosis: the faults are not separable with these readings".into()));
        };
        let mut own = Decomposition { names, rows, faults, regression };
        // Third-order errors are in the model during the search for spikes and cyclic errors, and remain if they are
        // significant. On a partial circle they are nearly collinear with scale mismatch and straightness.
        if arc_deg > FULL_CIRCLE_DEG * 0.99 {
            own.add(third_order(&own.rows, &own.names));
        }
        own.add(own.spikes(path));
        own.add(own.cyclic());
        let stays = |place: usize| !is_third_order(&own.faults[place]) || own.is_separable(place);
        let mut stays = (0..own.faults.len()).map(stays).collect::<Vec<bool>>().into_iter();
        if stays.as_slice().contains(&false) {
            own.faults.retain(|_| stays.next().unwrap_or(true));
            own.add(Vec::new());
        }
        Ok(own)
    }

    /// Adds faults, if they are separable from the others.
    fn add(&mut self, found: Vec<Fault>) {
        let kept = self.faults.len();
        self.faults.extend(found);
        match solve(&self.rows, &self.faults) {
            Some(better) => self.regression = better,
            None => self.faults.truncate(kept),
        }
    }

    /// The column of the regression with which a fault begins.
    pub fn place(&self, fault: usize) -> usize {
        set_up(&[]).len() + self.faults[..fault].iter().map(|fault| fault.columns.len()).sum::<usize>()
    }

    /// Variance of the residual, and the factor on it for the correlation of neighbours.
    pub fn variance_and_enlargement(&self) -> (f64, f64) {
        let residual = &self.regression.residual;
        let sum = self.regression.sum_of_squares();
        let follows = (1..residual.len()).filter(|i| self.rows[*i].follows);
        let neighbours: f64 = follows.map(|i| residual[i] * residual[i - 1]).sum();
        let freedom = residual.len().saturating_sub(self.regression.beta.len()).max(1);
        (sum / freedom as f64, enlargement_of_mean(neighbours, sum, MAX_CORRELATION))
    }

    /// The variance of the gain test: that of the residual, enlarged for the correlation of neighbours.
    fn gain_variance(&self) -> f64 {
        let (variance, enlargement) = self.variance_and_enlargement();
        variance.max(MIN_MM * MIN_MM) * enlargement
    }

    /// Whether a fault of one column is significant beside all the others.
    fn is_separable(&self, fault: usize) -> bool {
        let place = self.place(fault);
        let u = self.regression.u(&[(place, 1.0)], 1.0);
        u > 0.0 && is_significant((self.regression.beta[place] / u).powi(2), self.gain_variance(), 1, 2)
    }

    /// The parameter of a fault with the largest gain, for each axis for which it is significant. `candidates` gives the
    /// parameters of an axis, and the number of candidates of both axes.
    fn best(
        &self,
        candidates: impl Fn(usize) -> (Vec<f64>, usize),
        fault: impl Fn(usize, &str, f64) -> Fault,
    ) -> Vec<(usize, f64)> {
        let variance = self.gain_variance();
        let mut found = Vec::new();
        for (axis, name) in self.names.iter().enumerate() {
            let (candidates, tried) = candidates(axis);
            let gain = |candidate: f64| self.regression.gain(&fault(axis, name, candidate).columns);
            let best = candidates.into_iter().map(|own| (gain(own), own)).max_by(|a, b| a.0.total_cmp(&b.0));
            let best = best.filter(|(gain, _)| is_significant(*gain, variance, 2, tried));
            found.extend(best.map(|(_, own)| (axis, own)));
        }
        found
    }

    /// The reversal spikes of each axis, at the width with the largest gain.
    fn spikes(&self, path: &Path) -> Vec<Fault> {
        let step = path.arc() / (self.rows.len() as f64 / path.runs.len() as f64);
        let tried = SPIKE_WIDTHS_DEG.map(f64::to_radians);
        let widths: Vec<f64> = tried.into_iter().filter(|width| *width >= 0.5 * step).collect();
        let fault = |axis: usize, name: &str, width: f64| spike(&self.rows, axis, name, width);
        let found = self.best(|_| (widths.clone(), 2 * tried.len()), fault);
        found.into_iter().map(|(axis, width)| fault(axis, &self.names[axis], width)).collect()
    }

    /// The cyclic error of each axis, at the pitch with the largest gain, with an amplitude for each direction of travel.
    fn cyclic(&self) -> Vec<Fault> {
        let pitches = |axis: usize| {
            let q: Vec<f64> = self.rows.iter().map(|row| row.q[axis]).collect();
            let steps = (1..q.len()).filter(|i| self.rows[*i].follows).map(|i| (q[i] - q[i - 1]).abs());
            let (travel, spacing) = (range(&q), steps.fold(0.0, f64::max));
            // From four periods over the travel to 2.5 readings per period.
            let (slowest, fastest) = (4.0, travel / (2.5 * spacing.max(1e-3)));
            let tried = (((fastest - slowest) * 4.0).max(0.0) as usize).min(1000);
            ((0..tried).map(|k| travel / (slowest + k as f64 / 4.0)).collect(), 2 * tried)
        };
        let found = self.best(pitches, |axis, name, pitch| cyclic(&self.rows, axis, name, pitch));
        let by_direction =
            |(axis, pitch): (usize, f64)| cyclic_by_direction(&self.rows, axis, &self.names[axis], pitch);
        found.into_iter().map(by_direction).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With two degrees of freedom `P(χ² ≥ x) = exp(−x/2)`: the gain at which `n` candidates are significant is
    /// `2 s² ln(1000 n)`.
    #[test]
    fn the_limit_of_a_gain_rises_with_the_candidates() {
        for (variance, candidates) in [(1.0, 1), (4e-8, 12), (2.5e-7, 640)] {
            let limit = 2.0 * variance * (1000.0 * candidates as f64).ln();
            assert!(is_significant(limit * (1.0 + 1e-9), variance, 2, candidates), "{candidates}");
            assert!(!is_significant(limit * (1.0 - 1e-9), variance, 2, candidates), "{candidates}");
        }
        assert!(!is_significant(1.0, 0.0, 2, 1), "no residual, no significance");
    }
}
