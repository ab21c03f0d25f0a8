//! One run of the chain, over symbols for the equation and over numbers for its check.

use abbe_model::chain::{AxisPosition, BodyErrors, Machine};
use abbe_model::instrument::{Station, ballbar};
use abbe_model::scalar::{Nominal, Scalar};

use crate::error::CodegenError;
use crate::subject::{Source, Subject};
use crate::variable::Variable;

/// Everything that a reading is computed from.
pub(crate) struct Run<'m, S: Scalar> {
    pub(crate) machine: &'m Machine,
    pub(crate) subject: Subject<S::Nominal>,
    pub(crate) state: Vec<AxisPosition<S::Nominal>>,
    pub(crate) errors: Vec<BodyErrors<S>>,
    unknowns: Vec<(usize, S)>,
    /// The parameter in each error slot, and slots of instrument unknowns with theirs.
    slots: Vec<Option<usize>>,
    unknown_slots: Vec<(usize, usize)>,
}

impl<'m, S: Scalar> Run<'m, S> {
    /// `nominal` gives lengths and the positions of moving axes, `small` the parameters by their places.
    pub(crate) fn new(
        machine: &'m Machine,
        source: &impl Source,
        parameters: &[Variable],
        nominal: &impl Fn(Variable) -> S::Nominal,
        small: &impl Fn(usize) -> S,
    ) -> Result<Self, CodegenError> {
        let length = |name: &str| nominal(Variable::Length(name.to_string()));
        let subject = source.subject(&length);
        let state = machine
            .axes
            .iter()
            .map(|axis| {
                let position = source.held(&axis.name, &length).unwrap_or_else(|| {
                    nominal(Variable::Position {
                        axis: axis.name.clone(),
                        kind: axis.kind,
                    })
                });
                AxisPosition::new(axis.kind, position)
            })
            .collect();
        let mut slots = vec![None; machine.error_slots()];
        let mut unknown_slots = Vec::new();
        for (place, parameter) in parameters.iter().enumerate() {
            match parameter {
                Variable::Error(name) => {
                    let slot = machine.error_slot(name).ok_or_else(|| CodegenError::NoSuchAxis {
                        error: name.to_string(),
                        axis: name.axis.clone(),
                        machine: machine.code(),
                    })?;
                    slots[slot] = Some(place);
                }
                Variable::Unknown(unknown) => {
                    let slot = subject.unknowns().iter().position(|known| known == unknown);
                    let slot = slot.ok_or_else(|| CodegenError::NoSuchUnknown {
                        unknown: parameter.meaning(),
                    })?;
                    unknown_slots.push((slot, place));
                }
                Variable::Length(_) | Variable::Position { .. } => {}
            }
        }
        let mut run = Run {
            machine,
            subject,
            state,
            errors: Vec::new(),
            unknowns: Vec::new(),
            slots,
            unknown_slots,
        };
        run.seed(small);
        Ok(run)
    }

    /// Other values for the parameters, everything nominal as it is.
    pub(crate) fn seed(&mut self, small: &impl Fn(usize) -> S) {
        let zero = S::nominal(S::Nominal::constant(0.0));
        self.errors = self.machine.body_errors(
            |slot| self.slots[slot].is_some(),
            |slot| self.slots[slot].map_or(zero, small),
        );
        let unknown = |(slot, place): &(usize, usize)| (*slot, small(*place));
        self.unknowns = self.unknown_slots.iter().map(unknown).collect();
    }

    /// The instrument's unknown in a slot, if it is carried.
    pub(crate) fn unknown(&self, slot: usize) -> Option<S> {
        let found = self.unknowns.iter().find(|(known, _)| *known == slot);
        found.map(|(_, value)| *value)
    }

    /// The coordinates of the reading.
    pub(crate) fn read(&self) -> Vec<S> {
        self.subject
            .read(self.machine, &self.state, &self.errors, |slot| self.unknown(slot))
    }

    /// The reading of a ball bar from the distance between its balls, with the bar's own unknowns; the distance itself for any
    /// other subject.
    pub(crate) fn length_reading(&self, distance: S) -> S {
        let Subject::Station(Station::BallBar(bar)) = &self.subject else {
            return distance;
        };
        let length = match self.unknown(ballbar::BAR) {
            Some(error) => distance - error,
            None => distance,
        };
        match self.unknown(ballbar::GAIN) {
            Some(gain) => length + gain * (distance - bar.bar),
            None => length,
        }
    }
}
