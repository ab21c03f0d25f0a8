//! The basis functions of an effect over the readings of a test, as they act on the slots of its model.

use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::driver::{DriverInput, Reference};
use abbe_model::effect::Effect;
use abbe_model::sensitivity::TestModel;
use abbe_model::session::{Session, Test};

use super::SlotContribution;
use crate::error;

/// The basis functions of an effect over the readings of a test.
pub(super) struct BasisOverTest {
    /// The value of the driver at each reading.
    pub driver: Vec<f64>,
    /// One column per coefficient.
    pub columns: Vec<Arc<Vec<f64>>>,
    /// The slots that the readings depend on, each with the basis functions as they act on it.
    slots: Vec<(usize, Vec<Arc<Vec<f64>>>)>,
}

impl BasisOverTest {
    /// `None` if the effect does not act in the test, or the test has no readings.
    ///
    /// # Errors
    /// If the data lack the column of the driver.
    pub fn of(
        session: &Session,
        test: &Test,
        model: &TestModel,
        reference: &Reference,
        effect: &Effect,
    ) -> Result<Option<BasisOverTest>, Diagnostic> {
        let Some(readings) = test.readings.as_ref().filter(|_| effect.acts_in(&test.name)) else { return Ok(None) };
        let driver = effect.driver.kind();
        let input = DriverInput {
            machine: &session.machine,
            model,
            readings,
            reference,
            component_axis: effect.component.axis(&session.machine),
            lag_s: effect.shape.lag_s(),
        };
        let samples = driver.samples(&input).ok_or_else(|| {
            error::missing_driver(
                effect.id(),
                &effect.driver,
                &test.name,
                driver.missing_column(readings).unwrap_or_else(|| effect.driver.to_string()),
            )
        })?;
        let effective = model.effective_slots();
        let columns: Vec<Arc<Vec<f64>>> = effect.shape.columns(&samples).into_iter().map(Arc::new).collect();
        let unknowns = test.station.kind().unknowns();
        let mut slots = Vec::new();
        for part in effect.parts(&session.machine) {
            let of_part: Vec<Arc<Vec<f64>>> = match part.quadrature {
                None => columns.clone(),
                Some(_) => {
                    let own = part.columns(columns.iter().map(|column| column.to_vec()).collect());
                    own.into_iter().map(Arc::new).collect()
                }
            };
            for (slot, factor) in part.component.slots_in(&session.machine, unknowns, readings) {
                if !effective.contains(&slot) {
                    continue;
                }
                let scaled = |column: &Arc<Vec<f64>>| match &factor {
                    None => column.clone(),
                    Some(factor) => Arc::new(column.iter().zip(factor).map(|(b, f)| b * f).collect()),
                };
                slots.push((slot, of_part.iter().map(scaled).collect()));
            }
        }
        Ok(Some(BasisOverTest { driver: samples.iter().map(|sample| sample.value).collect(), columns, slots }))
    }

    /// The contributions of its coefficients, which begin with the parameter `first`.
    pub fn contributions(self, first: usize) -> impl Iterator<Item = SlotContribution> {
        self.slots.into_iter().flat_map(move |(slot, columns)| {
            let columns = columns.into_iter().enumerate();
            columns.map(move |(k, basis)| SlotContribution { parameter: first + k, slot, basis: Some(basis) })
        })
    }

    /// The contributions of a number of the shape, as the quotient of the difference from another basis and a step of the
    /// number, at some coefficients.
    pub fn less(
        &self,
        other: &BasisOverTest,
        coefficients: &[f64],
        step: f64,
        parameter: usize,
    ) -> impl Iterator<Item = SlotContribution> {
        self.slots.iter().zip(&other.slots).map(move |((slot, more), (_, less))| {
            let mut basis = vec![0.0; more.first().map_or(0, |column| column.len())];
            for (coefficient, (more, less)) in coefficients.iter().zip(more.iter().zip(less)) {
                let quotients = more.iter().zip(less.iter()).map(|(more, less)| coefficient * (more - less) / step);
                basis.iter_mut().zip(quotients).for_each(|(sum, quotient)| *sum += quotient);
            }
            SlotContribution { parameter, slot: *slot, basis: Some(Arc::new(basis)) }
        })
    }
}
