//! The history of the machines of a folder of records: trends, change points, control charts, the next check.
//!
//! - [`sessions`]: which sessions are used, and the parameters of a machine in each of them; `series`: one parameter of
//!   one machine over time, and its search for drift and steps; `significance`: whether it has any; `scatter`: how much
//!   sessions scatter;
//! - `machine`: all parameters of one machine together, by generalised least squares with the covariances of the
//!   sessions;
//! - [`events`]: steps of several parameters at one time, and what they are;
//! - [`chart`]: control charts; [`mod@faults`]: effects of many sessions, by alias set; [`results`]: what is reported of a
//!   machine; [`statements`](mod@statements): what follows for the user.
//!
//! Every series is tested for any change. Benjamini and Hochberg (1995, J. R. Stat. Soc. B 57, 289) control the false
//! discovery rate over all series of all machines.

pub mod chart;
pub mod events;
pub mod faults;
mod machine;
pub mod results;
mod scatter;
mod series;
pub mod sessions;
mod significance;
pub mod statements;

use std::collections::BTreeSet;

use abbe_identify::numerics::parallel;
use abbe_model::Diagnostic;
use schemars::JsonSchema;
use serde::Serialize;

use super::compensations::Compensation;
use super::conformity::MachineConformity;
use super::store::Store;
use super::unusable;
use faults::{Fault, faults};
use machine::Fitted;
use results::MachineHistory;
use scatter::{priors_of_differences, priors_of_models};
use series::{Prior, Series};
use sessions::Machine;
use significance::most_significant;

/// Days of a year.
pub const DAYS_PER_YEAR: f64 = 365.25;

/// The options of a history.
#[derive(Clone, Debug)]
pub struct HistoryOptions {
    /// False discovery rate over all series.
    pub false_discovery_rate: f64,
    /// Change of a parameter, in its standard uncertainties, before which the next check is due.
    pub tolerance_u: f64,
    /// Changes of the errors by known compensations.
    pub compensations: Vec<Compensation>,
}

impl Default for HistoryOptions {
    fn default() -> Self {
        HistoryOptions { false_discovery_rate: 0.05, tolerance_u: 4.0, compensations: Vec::new() }
    }
}

/// The machines of a folder over time, and their faults.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FleetHistory {
    /// False discovery rate over all series of all machines.
    pub false_discovery_rate: f64,
    /// The p value below which a series has a change (Benjamini and Hochberg); 0 if none has.
    pub p_value_threshold: f64,
    /// Number of series that were tested.
    pub tested_series: usize,
    /// The machines.
    pub machines: Vec<MachineHistory>,
    /// The effects of all sessions, by alias set, the most frequent first.
    pub faults: Vec<Fault>,
    /// Decisions of conformity over time, of the machines whose sessions state limits.
    pub conformity: Vec<MachineConformity>,
    /// Sessions, notes and rows of known compensations that the history does not use.
    pub not_used: Vec<NotUsed>,
}

/// A session, a note or a row of known compensations that the history does not use.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NotUsed {
    /// Identifier of the machine; `null` if it is not known.
    pub machine_id: Option<String>,
    /// The session file, the damaged note, or the file of compensations with the line.
    pub file: String,
    /// Why, and what to do.
    pub reason: String,
}

/// The history of all machines of a folder, or of one of them. The statistics are those of all machines either way.
///
/// # Errors
/// If the folder cannot be read, or has no session of the machine.
pub fn history(store: &Store, machine_id: Option<&str>, options: &HistoryOptions) -> Result<FleetHistory, Diagnostic> {
    let (records, missing) = store.records()?;
    let mut not_used: Vec<NotUsed> = missing
        .into_iter()
        .map(|(machine_id, file)| NotUsed {
            machine_id,
            file,
            reason: "its result is missing or of another version of the schema: run `abbe fleet run` again".to_string(),
        })
        .collect();
    let all = records.len();
    let known: BTreeSet<String> = records.iter().map(|(_, record)| record.machine_id.clone()).collect();
    if let Some(id) = machine_id.filter(|id| !known.contains(*id)) {
        return Err(Diagnostic::other(format!(
            "no session of the machine `{id}` among {all}: the identifier is `serial_number` of [about], or the name of the \
             machine"
        )));
    }
    let machines = sessions::machines(records, &mut not_used);
    not_used.sort_by(|a, b| a.file.cmp(&b.file));
    check_units(&machines, &options.compensations)?;
    not_used.extend(unknown_rows(&known, &machines, &options.compensations));
    let mut history = analyse(&machines, options);
    history.not_used = not_used;
    if let Some(id) = machine_id {
        history.machines.retain(|machine| machine.machine_id == id);
        history.faults = faults(machines.iter().filter(|machine| machine.id() == id));
        history.conformity.retain(|machine| machine.machine_id == id);
        history.not_used.retain(|not_used| not_used.machine_id.as_deref().is_none_or(|own| own == id));
    }
    Ok(history)
}

/// # Errors
/// If a compensation states a change in another unit than the parameter has.
fn check_units(machines: &[Machine], compensations: &[Compensation]) -> Result<(), Diagnostic> {
    for Compensation { machine_id, id, unit: stated, source, .. } in compensations {
        let machine = machines.iter().find(|machine| machine.id() == machine_id);
        if let Some(unit) = machine.and_then(|machine| machine.unit_of(id)).filter(|unit| unit != stated) {
            let found = format!("compensation of {machine_id}: the change of {id} is stated in `{stated}`");
            return Err(unusable(source, found, format!("state it in {unit}")));
        }
    }
    Ok(())
}

/// The rows of compensations whose machine or parameter no session has.
fn unknown_rows(known: &BTreeSet<String>, machines: &[Machine], compensations: &[Compensation]) -> Vec<NotUsed> {
    let unknown = |row: &Compensation| {
        let Compensation { machine_id, id, source, .. } = row;
        let reason = match machines.iter().find(|machine| machine.id() == machine_id) {
            None if !known.contains(machine_id) => {
                format!("no session is of the machine `{machine_id}`: correct `machine_id`")
            }
            Some(machine) if machine.unit_of(id).is_none() => {
                format!("no session of `{machine_id}` identifies the parameter `{id}`: correct `parameter`")
            }
            _ => return None,
        };
        Some(NotUsed { machine_id: Some(machine_id.clone()), file: source.clone(), reason })
    };
    compensations.iter().filter_map(unknown).collect()
}

/// Analyses machines.
pub fn analyse(machines: &[Machine], options: &HistoryOptions) -> FleetHistory {
    let plain = parallel::map(machines.len(), &|k| Series::of_machine(&machines[k]));
    let (_, first) = modelled(&plain, &priors_of_differences(machines, &plain), options);
    let (threshold, mut all) = modelled(&plain, &priors_of_models(machines, &first), options);
    all.iter_mut().flatten().for_each(Series::enlarge);
    FleetHistory {
        false_discovery_rate: options.false_discovery_rate,
        p_value_threshold: threshold,
        tested_series: all.iter().map(Vec::len).sum(),
        machines: parallel::map(machines.len(), &|k| Fitted::of(&machines[k], all[k].clone()).history(options)),
        faults: faults(machines),
        conformity: machines.iter().filter_map(MachineConformity::of).collect(),
        not_used: Vec::new(),
    }
}
/// The series with their models for given priors of their scatter, and the largest p value that is significant. A series
/// that is not significant keeps its level.
fn modelled(all: &[Vec<Series>], priors: &[Vec<Prior>], options: &HistoryOptions) -> (f64, Vec<Vec<Series>>) {
    let tested = parallel::map(all.len(), &|k| {
        let test = |(series, prior): (&Series, &Prior)| {
            let change = most_significant(series, prior);
            (series.clone().tested(*prior, change.p_value), change.steps)
        };
        all[k].iter().zip(&priors[k]).map(test).collect::<Vec<_>>()
    });
    let p_values: Vec<f64> = tested.iter().flatten().map(|(series, _)| series.p_value).collect();
    let threshold = benjamini_hochberg(&p_values, options.false_discovery_rate);
    let models = parallel::map(tested.len(), &|k| {
        let series = tested[k].iter().cloned();
        let model = |(series, steps): (Series, Vec<usize>)| match series.p_value <= threshold {
            true => series.searched(&steps, threshold),
            false => series,
        };
        series.map(model).collect()
    });
    (threshold, models)
}

/// The largest p value that is significant at a false discovery rate; below every p value if none is.
///
/// The `k` smallest of `m` p values are significant for the largest `k` with `p₍ₖ₎ ≤ k·q/m`.
pub fn benjamini_hochberg(p_values: &[f64], rate: f64) -> f64 {
    let mut sorted = p_values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len() as f64;
    let limits = sorted.iter().enumerate().map(|(k, p)| (*p, (k + 1) as f64 * rate / count));
    limits.filter(|(p, limit)| p <= limit).map(|(_, limit)| limit).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of Benjamini and Hochberg (1995), Section 4.1: of 15 p values the four smallest are significant.
    #[test]
    fn the_published_example_of_the_false_discovery_rate() {
        let p = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528,
            0.7590, 1.0,
        ];
        let threshold = benjamini_hochberg(&p, 0.05);
        assert_eq!(p.iter().filter(|p| **p <= threshold).count(), 4);
        assert_eq!(benjamini_hochberg(&[0.3, 0.9], 0.05), 0.0);
        assert_eq!(benjamini_hochberg(&[], 0.05), 0.0);
    }

    #[test]
    fn rows_of_unknown_machines_and_parameters_are_named() {
        let row = |machine: &str, id: &str, line: usize| Compensation {
            machine_id: machine.into(),
            id: id.into(),
            source: format!("c.csv:{line}"),
            ..Compensation::default()
        };
        let machine = sessions::tests::machine("M", &["EX0C"], &[0.0], |_, _| 0.0);
        let known = BTreeSet::from(["M".to_string(), "OTHER".to_string()]);
        let tables = [row("M", "EX0C", 2), row("M", "EX0B", 3), row("MM", "EX0C", 4), row("OTHER", "EX0C", 5)];
        let found: Vec<String> = unknown_rows(&known, &[machine], &tables).into_iter().map(|row| row.file).collect();
        assert_eq!(found, ["c.csv:3", "c.csv:4"]);
    }
}
