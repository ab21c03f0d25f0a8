//! Machines with stated estimates in each session, as records of a folder of results have them.

use abbe::fleet::history::sessions::{Dated, Machine};
use abbe::fleet::history::{self, FleetHistory, HistoryOptions};
use abbe::fleet::record::{MachineRecord, Record};
use abbe::identify::results::{Covariance, Estimate, ModelResult};

/// The sessions of one machine, by time.
#[derive(Clone, Debug, Default)]
pub struct MachineSessions {
    pub machine_id: String,
    pub name: String,
    pub code: String,
    /// Identifier, unit, meaning.
    pub parameters: Vec<(String, String, String)>,
    pub sessions: Vec<SessionValues>,
}

/// The parameters in one session: value and standard uncertainty of each; `None` where the session does not identify it.
#[derive(Clone, Debug, Default)]
pub struct SessionValues {
    pub days: f64,
    pub until_days: f64,
    pub values: Vec<Option<(f64, f64)>>,
    pub covariance: Vec<Vec<f64>>,
}

impl MachineSessions {
    fn dated(&self, session: &SessionValues) -> Dated {
        let present: Vec<usize> = (0..self.parameters.len()).filter(|k| session.values[*k].is_some()).collect();
        let estimate = |k: &usize| {
            let ((id, unit, meaning), (value, u)) = (&self.parameters[*k], session.values[*k].unwrap());
            Estimate { meaning: meaning.clone(), ..Estimate::new(id, value, u, unit) }
        };
        let matrix = present.iter().map(|i| present.iter().map(|j| session.covariance[*i][*j]).collect()).collect();
        let model = ModelResult {
            parameters: present.iter().map(estimate).collect(),
            covariance: Covariance { matrix, ..Covariance::default() },
            ..ModelResult::default()
        };
        let machine = MachineRecord { name: self.name.clone(), code: self.code.clone(), sha256: String::new() };
        let record = Record {
            machine_id: self.machine_id.clone(),
            machine: Some(machine),
            model: Some(model),
            ..Record::default()
        };
        Dated { days: session.days, until_days: session.until_days, record, ..Dated::default() }
    }
}

/// The history of these machines.
pub fn analyse(machines: &[MachineSessions], options: &HistoryOptions) -> FleetHistory {
    let of_machine =
        |machine: &MachineSessions| Machine::new(machine.sessions.iter().map(|own| machine.dated(own)).collect());
    history::analyse(&machines.iter().map(of_machine).collect::<Vec<_>>(), options)
}
