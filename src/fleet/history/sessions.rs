//! The sessions that a history uses, and the parameters of a machine in each of them.

use std::collections::{BTreeMap, HashMap, HashSet};

use abbe_identify::results::Estimate;
use abbe_model::parameter_id::ParameterId;
use abbe_trace::validate::ValidationVerdict;

use super::NotUsed;
use crate::fleet::date;
use crate::fleet::record::Record;
use crate::fleet::store::Pointer;

/// A usable session.
#[derive(Clone, Debug, Default)]
pub struct Dated {
    /// Day of the session, since 1970-01-01 UTC.
    pub days: f64,
    /// The latest time that its date can mean: a date without a time is a whole day.
    pub until_days: f64,
    /// Its number by a counter of the control.
    pub number: Option<f64>,
    /// The session file.
    pub file: String,
    /// Its result.
    pub record: Record,
}

/// The sessions of one machine by time, and the parameters that are followed.
#[derive(Clone, Debug)]
pub struct Machine {
    /// The sessions.
    pub sessions: Vec<Dated>,
    /// Whether base parameters are followed.
    by_base: bool,
    parameters: Vec<Followed>,
}

/// A parameter that is followed: where the estimates of the sessions have it.
#[derive(Clone, Debug)]
struct Followed {
    /// The first session that has it.
    first: usize,
    /// Its place in each session.
    places: Vec<Option<usize>>,
}

impl Machine {
    /// The sessions of a machine by time.
    pub fn new(sessions: Vec<Dated>) -> Machine {
        let held = |dated: &Dated| dated.record.base.as_ref().map(|base| base.held.clone());
        // Base parameters are the same numbers in all sessions only if the same ones are held.
        let last = sessions.last().and_then(held);
        let by_base = last.is_some() && sessions.iter().all(|dated| held(dated) == last);
        let mut parameters: Vec<Followed> = Vec::new();
        let mut known: HashMap<&str, usize> = HashMap::new();
        for (session, dated) in sessions.iter().enumerate() {
            for (place, Estimate { id, .. }) in dated.record.followed(by_base).0.iter().enumerate() {
                if is_of_machine(id) {
                    let parameter = *known.entry(id).or_insert_with(|| {
                        parameters.push(Followed { first: session, places: vec![None; sessions.len()] });
                        parameters.len() - 1
                    });
                    parameters[parameter].places[session] = Some(place);
                }
            }
        }
        Machine { by_base, parameters, sessions }
    }

    /// Its identifier.
    pub fn id(&self) -> &str {
        self.latest().map_or("", |record| &record.machine_id)
    }

    /// The result of the latest session.
    pub fn latest(&self) -> Option<&Record> {
        self.sessions.last().map(|dated| &dated.record)
    }

    /// The number of parameters that are followed.
    pub fn count(&self) -> usize {
        self.parameters.len()
    }

    /// A parameter in a session; `None` if the session does not identify it.
    pub fn estimate(&self, parameter: usize, session: usize) -> Option<&Estimate> {
        let place = self.parameters[parameter].places[session]?;
        self.sessions[session].record.followed(self.by_base).0.get(place)
    }

    /// Identifier, unit and meaning of a parameter, from the first session that has it.
    pub fn named(&self, parameter: usize) -> [&str; 3] {
        let first = self.estimate(parameter, self.parameters[parameter].first);
        first.map_or([""; 3], |first| [&first.id, &first.unit, &first.meaning])
    }

    /// The unit of the parameter with this identifier; `None` if no session identifies it.
    pub fn unit_of(&self, id: &str) -> Option<&str> {
        (0..self.count()).map(|parameter| self.named(parameter)).find(|[own, ..]| *own == id).map(|[_, unit, _]| unit)
    }

    /// The covariance of two parameters in a session; 0 if it does not have both.
    pub fn covariance(&self, session: usize, i: usize, j: usize) -> f64 {
        let matrix = self.sessions[session].record.followed(self.by_base).1;
        let place = |parameter: usize| self.parameters[parameter].places[session];
        let entry = place(i).zip(place(j)).and_then(|(i, j)| matrix.get(i)?.get(j));
        entry.copied().unwrap_or(0.0)
    }

    /// The parameters that are held at nominal, so that the others have values: those of a base parametrisation.
    pub fn held_at_nominal(&self) -> Vec<String> {
        let base = self.latest().and_then(|record| record.base.as_ref()).filter(|_| self.by_base);
        base.map_or_else(Vec::new, |base| base.held.clone())
    }

    /// Number of directions of the parameters of the machine that the latest session determines.
    pub fn determined(&self) -> usize {
        self.latest().map_or(0, |record| match &record.base {
            Some(base) => base.determined(),
            None => record.followed(false).0.iter().filter(|found| is_of_machine(&found.id)).count(),
        })
    }

    /// What the validation of the latest session says, if the model does not hold.
    pub fn validation(&self) -> Option<ValidationVerdict> {
        let verdict = self.latest()?.validation.as_ref()?.verdict;
        Some(verdict).filter(|verdict| !matches!(verdict, ValidationVerdict::Holds | ValidationVerdict::HoldsInRange))
    }
}

/// Whether a parameter belongs to the machine, not to the set-up of a test, and has a value without a jump: a phase
/// has one at a full turn.
fn is_of_machine(id: &str) -> bool {
    !id.parse::<ParameterId>().is_ok_and(|id| id.group().is_some() || id.is_phase())
}

/// The machines of records by their identifiers, and what of the records is not used.
pub fn machines(records: Vec<(Pointer, Record)>, not_used: &mut Vec<NotUsed>) -> Vec<Machine> {
    let mut machines: BTreeMap<String, Vec<Dated>> = BTreeMap::new();
    for dated in usable(records, not_used) {
        machines.entry(dated.record.machine_id.clone()).or_default().push(dated);
    }
    let of_machine = |mut sessions: Vec<Dated>| {
        sessions.sort_by(|a, b| a.days.total_cmp(&b.days).then_with(|| a.file.cmp(&b.file)));
        Machine::new(of_one_machine(in_order(sessions, not_used), not_used))
    };
    machines.into_values().map(of_machine).collect()
}

/// The sessions with a result, a date and an identifier of their own. A copy of a session counts once.
fn usable(records: Vec<(Pointer, Record)>, not_used: &mut Vec<NotUsed>) -> Vec<Dated> {
    // Sessions of other machines may have the same numbers.
    let identifier = |record: &Record| record.session_id.clone().map(|id| (record.machine_id.clone(), id));
    let mut keys_of: HashMap<(String, String), HashSet<String>> = HashMap::new();
    for (_, record) in &records {
        if let Some(id) = identifier(record) {
            keys_of.entry(id).or_default().insert(record.key.clone());
        }
    }
    let mut known = HashSet::new();
    let mut found = Vec::new();
    for (pointer, record) in records {
        let shared = identifier(&record).filter(|id| keys_of.get(id).is_some_and(|keys| keys.len() > 1));
        let text = record.date.as_deref();
        let machine_id = Some(record.machine_id.clone()).filter(|id| !id.is_empty());
        // The estimates do not depend on the validation of a model.
        let reason = if let Some(error) = record.error.as_ref().filter(|error| error.stage != "validate") {
            Some(format!("it has no result: {}", error.message.lines().next().unwrap_or_default()))
        } else if let Some((_, id)) = shared {
            Some(format!(
                "several sessions of different content have its identifier `{id}`: give each a `session_id` of its own"
            ))
        } else if !known.insert(record.key.clone()) {
            Some("it is a copy of another session".to_string())
        } else {
            match (text, text.and_then(date::interval)) {
                (None, _) => Some("it has no date: state `date` in [about]".to_string()),
                (Some(text), None) => Some(format!("its date `{text}` has another form than 2026-11-23T08:00:00")),
                (Some(_), Some([days, until_days])) => {
                    let number = record.about.get("session_number").and_then(|text| text.trim().parse().ok());
                    found.push(Dated { days, until_days, number, file: pointer.file.clone(), record });
                    None
                }
            }
        };
        not_used.extend(reason.map(|reason| NotUsed { machine_id, file: pointer.file, reason }));
    }
    found
}

/// The sessions of a machine with the axes of its latest session.
fn of_one_machine(sessions: Vec<Dated>, not_used: &mut Vec<NotUsed>) -> Vec<Dated> {
    let axes = |dated: &Dated| dated.record.machine.as_ref().map(|machine| machine.sha256.clone());
    let latest = sessions.last().and_then(axes);
    let (kept, others): (Vec<Dated>, Vec<Dated>) = sessions.into_iter().partition(|dated| axes(dated) == latest);
    not_used.extend(others.into_iter().map(|dated| NotUsed {
        machine_id: Some(dated.record.machine_id),
        file: dated.file,
        reason: "the axes of the machine differ from those of its latest session: parameters are not comparable".into(),
    }));
    kept
}

/// The sessions whose dates agree with their numbers: the longest part in which both increase.
fn in_order(sessions: Vec<Dated>, not_used: &mut Vec<NotUsed>) -> Vec<Dated> {
    let numbers: Vec<f64> = sessions.iter().filter_map(|dated| dated.number).collect();
    let keeps = longest_increasing(&numbers);
    let mut next = 0;
    let mut kept = Vec::with_capacity(sessions.len());
    for dated in sessions {
        let keep = dated.number.is_none_or(|_| {
            next += 1;
            keeps[next - 1]
        });
        if keep {
            kept.push(dated);
        } else {
            not_used.push(NotUsed {
                reason: format!(
                    "its date {} contradicts its `session_number`: correct the clock or the date",
                    dated.record.date.as_deref().unwrap_or_default()
                ),
                machine_id: Some(dated.record.machine_id),
                file: dated.file,
            });
        }
    }
    kept
}

/// Which numbers belong to the longest part that does not decrease.
fn longest_increasing(numbers: &[f64]) -> Vec<bool> {
    // Length of the longest part that ends with each number, and the number before it.
    let mut ends: Vec<(usize, Option<usize>)> = Vec::with_capacity(numbers.len());
    for (i, number) in numbers.iter().enumerate() {
        let before = (0..i).filter(|j| numbers[*j] <= *number).max_by_key(|j| (ends[*j].0, std::cmp::Reverse(*j)));
        ends.push((1 + before.map_or(0, |j| ends[j].0), before));
    }
    let mut keeps = vec![false; numbers.len()];
    let mut at = (0..numbers.len()).max_by_key(|i| (ends[*i].0, std::cmp::Reverse(*i)));
    while let Some(i) = at {
        keeps[i] = true;
        at = ends[i].1;
    }
    keeps
}

#[cfg(test)]
pub(super) mod tests {
    use abbe_identify::results::{Covariance, ModelResult};

    use super::*;

    /// A machine whose sessions are at these days, with the values of its parameters in µm, each with u = 0.6.
    pub fn machine(id: &str, names: &[&str], days: &[f64], value: impl Fn(usize, usize) -> f64) -> Machine {
        let session = |(session, days): (usize, &f64)| {
            let estimate = |(k, name): (usize, &&str)| Estimate::new(*name, value(k, session), 0.6, "um");
            let entry = |i: usize, j: usize| if i == j { 0.36 } else { 0.0 };
            let matrix = (0..names.len()).map(|i| (0..names.len()).map(|j| entry(i, j)).collect()).collect();
            let model = ModelResult {
                parameters: names.iter().enumerate().map(estimate).collect(),
                covariance: Covariance { matrix, ..Covariance::default() },
                ..ModelResult::default()
            };
            let record = Record { machine_id: id.into(), model: Some(model), ..Record::default() };
            Dated { days: *days, until_days: *days, record, ..Dated::default() }
        };
        Machine::new(days.iter().enumerate().map(session).collect())
    }

    #[test]
    fn a_clock_that_runs_backwards_takes_out_the_fewest_sessions() {
        assert_eq!(longest_increasing(&[1.0, 2.0, 9.0, 3.0, 4.0]), [true, true, false, true, true]);
        assert_eq!(longest_increasing(&[1.0, 1.0, 2.0]), [true; 3]);
        assert!(longest_increasing(&[]).is_empty());
    }

    #[test]
    fn set_up_parameters_and_phases_have_no_history() {
        for (id, is) in [("EX0C", true), ("bar[A100]", false), ("EZC~C:h2.amplitude", true), ("EZC~C:h2.phase", false)]
        {
            assert_eq!(is_of_machine(id), is, "{id}");
        }
    }
}
