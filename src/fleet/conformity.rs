//! Decisions of conformity of the machines over time.

use abbe_identify::tolerance::rule::Decision;
use abbe_identify::tolerance::{Conformity, ConformityItem};
use schemars::JsonSchema;
use serde::Serialize;

use super::history::sessions::{Dated, Machine};

/// The decisions about a machine over time.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MachineConformity {
    /// Identifier of the machine.
    pub machine_id: String,
    /// The sessions that state limits, by time.
    pub sessions: Vec<SessionConformity>,
    /// The quantities that have limits.
    pub items: Vec<ItemHistory>,
}

/// The decision about one session.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SessionConformity {
    /// Day of the session.
    pub days: f64,
    /// The session file.
    pub file: String,
    /// `fail` if an item fails; else `undecided` if an item is undecided; else `pass`.
    pub verdict: Decision,
}

/// The decisions about one quantity over time.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ItemHistory {
    /// The parameter, `EX0C`, or the figure with its test, `circular_deviation[XY]`.
    pub id: String,
    /// The decisions, by time. Each holds for the limits that its session states.
    pub points: Vec<DecisionPoint>,
}

/// A decision about one quantity in one session.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DecisionPoint {
    /// Day of the session.
    pub days: f64,
    /// The decision.
    #[serde(flatten)]
    pub item: ConformityItem,
}

impl ItemHistory {
    /// The latest decision, and the first day from which on the decision is the same; `None` without decisions.
    pub fn latest(&self) -> Option<(Decision, f64)> {
        let last = self.points.last()?;
        let since = self.points.iter().rev().take_while(|point| point.item.decision == last.item.decision).last()?;
        Some((last.item.decision, since.days))
    }

    /// The number of sessions with a decision.
    pub fn count(&self, decision: Decision) -> usize {
        self.points.iter().filter(|point| point.item.decision == decision).count()
    }
}

impl MachineConformity {
    /// The decisions about a machine; `None` if no session states limits.
    pub fn of(machine: &Machine) -> Option<MachineConformity> {
        let mut found = MachineConformity { machine_id: machine.id().into(), sessions: Vec::new(), items: Vec::new() };
        for Dated { days, file, record, .. } in &machine.sessions {
            let Some(Conformity { verdict, items, .. }) = &record.conformity else { continue };
            found.sessions.push(SessionConformity { days: *days, file: file.clone(), verdict: *verdict });
            items.iter().for_each(|item| found.add(*days, item));
        }
        (!found.sessions.is_empty()).then_some(found)
    }

    fn add(&mut self, days: f64, item: &ConformityItem) {
        let point = DecisionPoint { days, item: item.clone() };
        match self.items.iter_mut().find(|known| known.id == item.id) {
            Some(known) => known.points.push(point),
            None => self.items.push(ItemHistory { id: item.id.clone(), points: vec![point] }),
        }
    }
}
