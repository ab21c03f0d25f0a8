//! The range of axes and drivers that readings cover.
//!
//! Inside the range a model is tested by its own readings; outside it extrapolates.

use abbe_model::driver::{Driver, DriverInput};
use abbe_model::effect::Effect;

use super::DriverRange;
use crate::problem::Problem;

/// Share of the width of a range by which readings may leave it: positions are rounded, and commanded positions are
/// not reached exactly.
const MARGIN_SHARE: f64 = 0.01;
/// The least margin, mm, rad, s, … Positions of a file are rounded to this.
const LEAST_MARGIN: f64 = 1e-4;

impl DriverRange {
    /// Whether a value is in the range.
    pub fn contains(&self, value: f64) -> bool {
        let [least, greatest] = self.range;
        let margin = LEAST_MARGIN.max(MARGIN_SHARE * (greatest - least));
        value >= least - margin && value <= greatest + margin
    }

    /// `J2`, `time`, `gravity about J2`.
    pub fn name(&self) -> String {
        match &self.component_axis {
            Some(axis) => format!("{} about {axis}", self.driver),
            None => self.driver.to_string(),
        }
    }
}

/// The drivers whose range counts: every axis, and the other drivers of effects.
fn drivers(problem: &Problem, effects: &[Effect]) -> Vec<(Driver, Option<String>)> {
    let machine = &problem.session.machine;
    let mut drivers: Vec<(Driver, Option<String>)> =
        machine.axes.iter().map(|axis| (Driver::Axis(axis.name.clone()), None)).collect();
    for effect in effects {
        let own = effect.component.axis(machine).filter(|_| effect.driver.kind().is_of_component());
        let found = (effect.driver.clone(), own.map(|axis| machine.axes[axis].name.clone()));
        if effect.driver != Driver::None && !drivers.contains(&found) {
            drivers.push(found);
        }
    }
    drivers
}

/// The values of a driver in every reading of a test; `None` if the data lack it.
fn values(problem: &Problem, test: usize, driver: &Driver, component_axis: Option<&str>) -> Option<Vec<f64>> {
    let readings = problem.tests[test].readings.as_ref()?;
    let input = DriverInput {
        machine: &problem.session.machine,
        model: &problem.models[test],
        readings,
        reference: &problem.reference,
        component_axis: component_axis.and_then(|axis| problem.session.machine.axis_index(axis)),
        // The range is that of the column itself.
        lag_s: None,
    };
    Some(driver.kind().samples(&input)?.iter().map(|sample| sample.value).collect())
}

/// The ranges of the readings of a problem that are not excluded, for the drivers of `effects`.
pub(super) fn of_problem(problem: &Problem, effects: &[Effect]) -> Vec<DriverRange> {
    let mut ranges = Vec::new();
    for (driver, component_axis) in drivers(problem, effects) {
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for test in 0..problem.tests.len() {
            let values = values(problem, test, &driver, component_axis.as_deref()).unwrap_or_default();
            for (value, rejected) in values.iter().zip(&problem.rejected[test]) {
                if !rejected {
                    range = [range[0].min(*value), range[1].max(*value)];
                }
            }
        }
        if range[0] <= range[1] {
            let machine = &problem.session.machine;
            let about = component_axis.as_deref().and_then(|axis| machine.axis_index(axis));
            let unit = driver.kind().unit(driver.kind_of_axis(machine, about));
            let displayed = range.map(|value| unit.to_display(value));
            ranges.push(DriverRange { driver, component_axis, displayed, unit: unit.result().to_string(), range });
        }
    }
    ranges
}

/// Whether each reading of a problem lies in the ranges, by test and row, and the names of the ranges that readings
/// leave.
pub fn inside(problem: &Problem, ranges: &[DriverRange]) -> (Vec<Vec<bool>>, Vec<String>) {
    let mut inside: Vec<Vec<bool>> = problem.models.iter().map(|model| vec![true; model.rows()]).collect();
    let mut left = Vec::new();
    for range in ranges {
        let mut leaves = false;
        for (test, inside) in inside.iter_mut().enumerate() {
            let values = values(problem, test, &range.driver, range.component_axis.as_deref()).unwrap_or_default();
            for (inside, value) in inside.iter_mut().zip(values) {
                if !range.contains(value) {
                    *inside = false;
                    leaves = true;
                }
            }
        }
        if leaves {
            left.push(range.name());
        }
    }
    (inside, left)
}
