//! The statements of a history: which machines are in control, what to correct, what to measure next.

use abbe_identify::results::{MeasuredValue, NextStep, Statements};
use schemars::JsonSchema;
use serde::Serialize;

use super::events::{ChangeEvent, Kind};
use super::results::{MachineHistory, ParameterHistory};

/// Whether the machines of a history are in control.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct HistoryStatement {
    /// Number of machines.
    pub machines: usize,
    /// The machines with a parameter that is out of control in the latest session, or whose model does not hold there.
    pub out_of_control: Vec<String>,
}

/// A parameter of a machine that drifts or has shifted.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ChangedInHistory {
    /// Identifier of the machine.
    pub machine_id: String,
    /// The parameter.
    pub id: String,
    /// Its drift, in `unit` a year; absent if it has shifted only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift_per_year: Option<MeasuredValue>,
    /// Its last such step, in `unit`; absent if it drifts only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift: Option<MeasuredValue>,
    /// Unit of the parameter.
    pub unit: String,
}

/// The statements of a history.
pub type HistoryStatements = Statements<HistoryStatement, ChangedInHistory>;

/// Are these machines in control, what to correct, what to measure next.
pub fn statements(machines: &[MachineHistory]) -> HistoryStatements {
    let out = machines.iter().filter(|machine| !machine.out_of_control.is_empty() || machine.validation.is_some());
    let changed = |machine: &MachineHistory, is_explained: bool| -> Vec<ChangedInHistory> {
        let is_wanted = |change: &ChangeEvent| match change.kind {
            Kind::Shift | Kind::CompensationAndShift => !is_explained,
            Kind::Compensation | Kind::Correction => is_explained,
        };
        // The last step of this kind.
        let shift_of = |one: &ParameterHistory| -> Option<MeasuredValue> {
            let is_own = |change: &&ChangeEvent| change.parameters.contains(&one.id) && is_wanted(change);
            machine.amount(machine.changes.iter().rfind(is_own)?, &one.id)
        };
        let own = machine.parameters.iter().map(|one| ChangedInHistory {
            machine_id: machine.machine_id.clone(),
            id: one.id.clone(),
            drift_per_year: one.drift_per_year.filter(|drift| !is_explained && exceeds_u(drift)),
            shift: shift_of(one).filter(exceeds_u),
            unit: one.unit.clone(),
        });
        own.filter(|one| one.drift_per_year.is_some() || one.shift.is_some()).collect()
    };
    let step = if machines.is_empty() { NextStep::Nothing } else { NextStep::NextCheck };
    Statements {
        good: HistoryStatement {
            machines: machines.len(),
            out_of_control: out.map(|machine| machine.machine_id.clone()).collect(),
        },
        correct: machines.iter().flat_map(|machine| changed(machine, false)).collect(),
        // Steps that a known compensation or a way to zero explains.
        changed: machines.iter().flat_map(|machine| changed(machine, true)).collect(),
        further: Vec::new(),
        measure: step.into(),
    }
}

/// Whether a change exceeds its standard uncertainty. Sessions that repeat each other to a fraction of it, such as computed ones,
/// show changes that mean nothing.
fn exceeds_u(change: &MeasuredValue) -> bool {
    change.value.abs() > change.u
}

#[cfg(test)]
mod tests {
    use super::super::{HistoryOptions, analyse, sessions};
    use super::*;

    /// What is stated of 30 sessions of a machine with these values of EX0C, each with u = 0.6.
    fn stated_of(value: impl Fn(usize) -> f64) -> HistoryStatements {
        let days: Vec<f64> = (0..30).map(|k| 30.0 * f64::from(k)).collect();
        let machine = sessions::tests::machine("M", &["EX0C"], &days, |_, session| value(session));
        statements(&analyse(&[machine], &HistoryOptions::default()).machines)
    }

    /// Deviations of known size in place of noise.
    const DEVIATIONS: [f64; 7] = [0.4, -0.7, 0.1, 0.9, -0.5, -0.2, 0.6];

    /// Sessions that repeat each other to a thousandth of their uncertainty show a step that means nothing.
    #[test]
    fn a_step_below_its_uncertainty_is_not_stated() {
        let step = |k: usize| if k < 15 { 0.0 } else { 10.0 };
        let scaled = |scale: f64| stated_of(|k| scale * (step(k) + DEVIATIONS[k % 7]));
        assert_eq!(scaled(1.0).correct.len() + scaled(1.0).changed.len(), 1);
        let small = scaled(1e-3);
        assert!(small.correct.is_empty() && small.changed.is_empty(), "{small:?}");
    }

    /// A correction by 30 and a shift by 20 after it: each is stated with its own amount, whichever is the later.
    #[test]
    fn a_step_is_stated_where_its_event_belongs() {
        for (levels, corrected, shifted) in [([30.0, 0.0, 20.0], -30.0, 20.0), ([10.0, 30.0, 0.0], -30.0, 20.0)] {
            let stated = stated_of(|k| levels[k / 10] + DEVIATIONS[k % 7]);
            let amounts = |list: &[ChangedInHistory]| -> Vec<f64> {
                list.iter().map(|own| own.shift.map_or(f64::NAN, |shift| shift.value)).collect()
            };
            let [explained, others] = [amounts(&stated.changed), amounts(&stated.correct)];
            assert!(explained.len() == 1 && (explained[0] - corrected).abs() < 1.0, "{levels:?}: {stated:?}");
            assert!(others.len() == 1 && (others[0] - shifted).abs() < 1.0, "{levels:?}: {stated:?}");
            assert!(stated.changed[0].drift_per_year.is_none());
        }
    }
}
