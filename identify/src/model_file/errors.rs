//! The errors of a machine along a sequence of positions.

use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::driver::{DriverInput, DriverSample, Reference};
use abbe_model::effect::{Effect, EffectPart};
use abbe_model::instrument::Station;
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;

use crate::error;
use crate::model_file::IdentifiedModel;

/// The errors at positions near the commanded ones, by slot of the machine, mm or rad.
pub type ErrorsNear<'a> = Box<dyn Fn(&Readings) -> Result<SlotValues, Diagnostic> + 'a>;

/// The errors of a machine as functions of its axes, and of what else the rows of a file state.
pub trait MachineErrors: Sync {
    /// The errors along commanded positions. Direction and speed of travel, time and driver columns are those of
    /// the commands. The result gives the errors at positions that deviate from them by corrections.
    ///
    /// # Errors
    /// If the rows lack a column that an error depends on.
    fn along<'a>(&'a self, commanded: &'a Readings) -> Result<ErrorsNear<'a>, Diagnostic>;

    /// An effect that depends on all rows before, so that the rows cannot be divided into blocks: a first-order lag.
    fn with_history(&self) -> Option<String> {
        None
    }
}

/// An effect with its coefficients.
#[derive(Clone, Debug)]
pub struct EstimatedEffect {
    /// The effect.
    pub effect: Effect,
    /// One per basis function, internal units.
    pub coefficients: Vec<f64>,
}

/// Estimated errors: constant ones, and effects.
#[derive(Clone, Debug)]
pub struct EstimatedErrors {
    /// The machine.
    pub machine: Arc<Machine>,
    /// The instrument as set up: gravity acts at its point.
    pub station: Station<f64>,
    /// Reference values of the drivers.
    pub reference: Reference,
    /// The constant errors by slot of the machine, mm or rad.
    pub constant: Vec<f64>,
    /// The effects on errors of the machine.
    pub effects: Vec<EstimatedEffect>,
}

impl EstimatedErrors {
    /// The errors of a model: those that belong to the machine. Gravity acts at the load points, in the tool frame and in
    /// the table frame.
    pub fn of_model(model: &IdentifiedModel, tool_mm: [f64; 3], table_mm: [f64; 3]) -> EstimatedErrors {
        let machine = Arc::new(model.machine.clone());
        let mut constant = vec![0.0; machine.error_slots()];
        let coefficients = |effect: &Effect| vec![0.0; effect.shape.coefficients()];
        let mut coefficients: Vec<Vec<f64>> = model.effects.iter().map(coefficients).collect();
        for parameter in &model.parameters {
            if let Some(slot) = parameter.id.error().and_then(|name| machine.error_slot(name)) {
                constant[slot] = parameter.value;
            }
            if let (Some(effect), Some(index), true) =
                (parameter.effect, parameter.index, parameter.id.is_coefficient())
            {
                coefficients[effect][index] = parameter.value;
            }
        }
        let effects = model.carried_effects().map(|index| EstimatedEffect {
            effect: model.effects[index].clone(),
            coefficients: coefficients[index].clone(),
        });
        let effects = effects.collect();
        // A reading that connects both load points is affected by all errors.
        let station = Station::between(table_mm, tool_mm, 1.0);
        EstimatedErrors { machine, station, reference: model.reference.clone(), constant, effects }
    }

    fn samples(
        &self,
        effect: &Effect,
        rows: &Readings,
        model: &TestModel,
    ) -> Result<Vec<DriverSample<f64>>, Diagnostic> {
        let driver = effect.driver.kind();
        let input = DriverInput {
            machine: &self.machine,
            model,
            readings: rows,
            reference: &self.reference,
            component_axis: effect.component.axis(&self.machine),
            lag_s: effect.shape.lag_s(),
        };
        driver.samples(&input).ok_or_else(|| {
            error::missing_driver(
                effect.id(),
                &effect.driver,
                "the commands",
                driver.missing_column(rows).unwrap_or_else(|| effect.driver.to_string()),
            )
        })
    }

    fn model(&self, rows: &Readings) -> TestModel {
        TestModel::new(Arc::clone(&self.machine), self.station.clone(), rows)
    }
}

impl MachineErrors for EstimatedErrors {
    fn with_history(&self) -> Option<String> {
        let lagged = self.effects.iter().find(|estimated| estimated.effect.shape.lag_s().is_some());
        lagged.map(|estimated| estimated.effect.id())
    }

    fn along<'a>(&'a self, commanded: &'a Readings) -> Result<ErrorsNear<'a>, Diagnostic> {
        let model = self.model(commanded);
        let parameters = self.station.kind().unknowns();
        let travel: Vec<Vec<DriverSample<f64>>> = self
            .effects
            .iter()
            .map(|estimated| self.samples(&estimated.effect, commanded, &model))
            .collect::<Result<_, _>>()?;
        let slots_of = |part: EffectPart| {
            let slots = part.component.slots_in(&self.machine, parameters, commanded);
            (part, slots)
        };
        let parts: Vec<Vec<(EffectPart, Vec<(usize, Option<Vec<f64>>)>)>> = (self.effects.iter())
            .map(|estimated| estimated.effect.parts(&self.machine).into_iter().map(slots_of).collect())
            .collect();
        Ok(Box::new(move |positions: &Readings| {
            let model = self.model(positions);
            let mut values =
                SlotValues { constant: self.constant.clone(), varying: Vec::with_capacity(self.effects.len()) };
            for ((estimated, travel), parts) in self.effects.iter().zip(&travel).zip(&parts) {
                let mut samples = self.samples(&estimated.effect, positions, &model)?;
                for (sample, commanded) in samples.iter_mut().zip(travel) {
                    *sample = DriverSample { value: sample.value, ..*commanded };
                }
                let columns = estimated.effect.shape.columns(&samples);
                for (part, slots) in parts {
                    let mut sum = vec![0.0; positions.rows()];
                    for (coefficient, column) in estimated.coefficients.iter().zip(part.columns(columns.clone())) {
                        sum.iter_mut().zip(column).for_each(|(sum, basis)| *sum += coefficient * basis);
                    }
                    for (slot, factor) in slots {
                        let term: Vec<f64> = match factor {
                            None => sum.clone(),
                            Some(factor) => sum.iter().zip(factor).map(|(value, factor)| value * factor).collect(),
                        };
                        match values.varying.iter_mut().find(|(own, _)| own == slot) {
                            Some((_, column)) => column.iter_mut().zip(&term).for_each(|(sum, term)| *sum += term),
                            None => values.varying.push((*slot, term)),
                        }
                    }
                }
            }
            Ok(values)
        }))
    }
}
