//! The travel over which the entries of a control are judged: a grid of axis positions with weights.

use abbe_identify::error;
use abbe_model::Diagnostic;
use abbe_model::driver::Driver;
use abbe_model::session::limits::MAX_LENGTH_MM;
use abbe_model::session::readings::Readings;

use crate::compare::workspace::AxisRange;
use abbe_identify::model_file::IdentifiedModel;

/// Places along a rotary axis, odd.
const ROTARY_PLACES: usize = 13;
/// Rotary axes that turn up to which a grid has all combinations of places; of more, positions fill the range evenly.
const MOST_ROTARY: usize = 3;
/// Number of these positions.
const SAMPLES: usize = 3000;
/// Places along a linear axis, odd. Errors of location are linear along it, and the squares of these are integrated
/// without error.
const LINEAR_PLACES: usize = 3;

/// The range of every axis, and whether it is that of the readings of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Travel {
    /// Least and greatest position of each axis, mm or rad.
    pub ranges: Vec<[f64; 2]>,
    /// Whether all ranges are those that the readings of the model cover.
    pub is_measured: bool,
}

impl Travel {
    /// The range of the readings of a model. An axis without readings stands at 0.
    pub fn measured(model: &IdentifiedModel) -> Travel {
        let range = |axis: &abbe_model::axis::Axis| {
            let driver = Driver::Axis(axis.name.clone());
            model.ranges.iter().find(|range| range.driver == driver).map_or([0.0; 2], |range| range.range)
        };
        Travel { ranges: model.machine.axes.iter().map(range).collect(), is_measured: true }
    }

    /// With another range of an axis, mm or degrees.
    ///
    /// # Errors
    /// If there is no such axis, or the range is none.
    pub fn with(mut self, model: &IdentifiedModel, name: &str, [from, to]: [f64; 2]) -> Result<Travel, Diagnostic> {
        let axes = &model.machine.axes;
        let no_axis = || error::no_axis(&model.machine, "", name);
        let index = model.machine.axis_index(name).ok_or_else(no_axis)?;
        let range = [-MAX_LENGTH_MM, MAX_LENGTH_MM];
        let axis = || format!("axis `{name}`");
        if let Some(found) = [from, to].into_iter().find(|found| !(range[0]..=range[1]).contains(found)) {
            return Err(error::out_of_range(axis(), found, range, "mm or degrees"));
        }
        if from >= to {
            let found = "the first number is not below the second";
            return Err(error::not_applicable(axis(), found, "state the lower end first"));
        }
        self.ranges[index] = [from, to].map(|value| axes[index].kind.to_internal(value));
        self.is_measured = false;
        Ok(self)
    }

    /// A position of a sequence that fills the range evenly: the golden ratio's generalisation (Roberts 2018, "The
    /// unreasonable effectiveness of quasirandom sequences").
    fn sample(&self, number: usize) -> Vec<f64> {
        let dimensions = self.ranges.len() as f64;
        let root = (0..40).fold(2.0_f64, |root, _| (1.0 + root).powf(1.0 / (dimensions + 1.0)));
        let share = |axis: usize| (0.5 + (number + 1) as f64 * root.powi(-(axis as i32 + 1))).fract();
        self.ranges.iter().enumerate().map(|(axis, [from, to])| from + share(axis) * (to - from)).collect()
    }

    /// The ranges as results state them.
    pub fn axes(&self, model: &IdentifiedModel) -> Vec<AxisRange> {
        model.machine.axes.iter().zip(&self.ranges).map(|(axis, range)| AxisRange::of(axis, *range)).collect()
    }

    /// Axis positions and their weights, whose sum is 1: Simpson's rule, so that a mean over the grid is one over the
    /// travel and the ends are among the positions.
    pub fn grid(&self, model: &IdentifiedModel) -> (Readings, Vec<f64>) {
        let (mut positions, mut weights) = (vec![Vec::new()], vec![1.0]);
        let turning = model.machine.axes.iter().zip(&self.ranges);
        let is_rotary = |axis: &abbe_model::axis::Axis| axis.kind == abbe_model::axis::AxisKind::Rotary;
        let is_large = turning.filter(|(axis, [from, to])| is_rotary(axis) && to > from).count() > MOST_ROTARY;
        if is_large {
            positions = (0..SAMPLES).map(|number| self.sample(number)).collect();
            weights = vec![1.0 / SAMPLES as f64; SAMPLES];
        }
        let axes = model.machine.axes.iter().zip(&self.ranges).filter(|_| !is_large);
        for (axis, [from, to]) in axes {
            let places = match (to > from, axis.kind) {
                (false, _) => vec![(*from, 1.0)],
                (true, abbe_model::axis::AxisKind::Rotary) => simpson(*from, *to, ROTARY_PLACES),
                (true, abbe_model::axis::AxisKind::Linear) => simpson(*from, *to, LINEAR_PLACES),
            };
            let longer = |row: &Vec<f64>| -> Vec<Vec<f64>> {
                places.iter().map(|(at, _)| [row.as_slice(), &[*at]].concat()).collect()
            };
            weights = weights.iter().flat_map(|own| places.iter().map(move |(_, weight)| own * weight)).collect();
            positions = positions.iter().flat_map(longer).collect();
        }
        let columns = (0..self.ranges.len()).map(|axis| positions.iter().map(|row| row[axis]).collect()).collect();
        let rows = positions.len();
        // A grid has neither time nor driver columns: the reference values stand for them.
        let readings = Readings {
            positions: columns,
            channels: 1,
            time_s: vec![model.reference.time_s; rows],
            drivers: model.reference.means.iter().map(|(name, mean)| (name.clone(), vec![*mean; rows])).collect(),
            ..Readings::default()
        };
        (readings, weights)
    }
}

/// Positions and weights of Simpson's rule with an odd number of places.
fn simpson(from: f64, to: f64, places: usize) -> Vec<(f64, f64)> {
    let intervals = places - 1;
    let weight = |k: usize| match k {
        0 => 1.0,
        k if k == intervals => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..places)
        .map(|k| (from + (to - from) * k as f64 / intervals as f64, weight(k) / (3.0 * intervals as f64)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_cubics() {
        let mean: f64 = simpson(-1.0, 3.0, 5).iter().map(|(x, weight)| weight * (x.powi(3) + x * x)).sum();
        assert!((mean - (20.0 + 28.0 / 3.0) / 4.0).abs() < 1e-12);
    }
}
