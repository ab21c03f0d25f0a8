//! Effects of many sessions as faults: two effects are one fault if one of them is among the aliases of the other, or
//! if they have one family, component and driver and a common alias. The same fault under two names is one fault.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::Serialize;

use super::sessions::{Dated, Machine};
use crate::fleet::record::EffectRecord;

/// An effect with the session that found it.
type Found<'s> = (&'s Dated, &'s EffectRecord);

/// A fault: effects that the sessions do not tell apart.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Fault {
    /// The name that most sessions give it.
    pub id: String,
    /// What it is, in words.
    pub meaning: String,
    /// Structural code of the machines.
    pub code: String,
    /// All names that sessions give it, each with the number of sessions.
    pub names: BTreeMap<String, usize>,
    /// Number of sessions.
    pub sessions: usize,
    /// The machines.
    pub machines: Vec<FaultOfMachine>,
    /// Mean of the rms that it explains, µm.
    pub mean_rms_gain_um: f64,
}

/// A fault of one machine.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FaultOfMachine {
    /// Identifier of the machine.
    pub machine_id: String,
    /// Number of sessions with the fault.
    pub sessions: usize,
    /// Day of the first of them.
    pub first_days: f64,
    /// Day of the last.
    pub last_days: f64,
}

/// The faults, the most frequent first.
pub fn faults<'s>(machines: impl IntoIterator<Item = &'s Machine>) -> Vec<Fault> {
    // Effects of one name belong together, so names are joined, not sessions. Those of machines of other axes are other
    // faults.
    let mut named: BTreeMap<(&str, &str), Vec<Found<'s>>> = BTreeMap::new();
    for dated in machines.into_iter().flat_map(|machine| &machine.sessions) {
        let code = dated.record.machine.as_ref().map_or("", |machine| &machine.code);
        for effect in &dated.record.effects {
            named.entry((code, &effect.id)).or_default().push((dated, effect));
        }
    }
    let groups: Vec<((&str, &str), Vec<Found<'s>>)> = named.into_iter().collect();
    let aliases: Vec<BTreeSet<&str>> = groups
        .iter()
        .map(|(_, found)| found.iter().flat_map(|(_, effect)| effect.aliases.iter().map(String::as_str)).collect())
        .collect();
    let same = |i: usize, j: usize| {
        let (((code_i, id_i), found_i), ((code_j, id_j), found_j)) = (&groups[i], &groups[j]);
        code_i == code_j
            && (aliases[i].contains(id_j)
                || aliases[j].contains(id_i)
                || (family(found_i[0].1) == family(found_j[0].1) && !aliases[i].is_disjoint(&aliases[j])))
    };
    let mut root: Vec<usize> = (0..groups.len()).collect();
    for i in 0..groups.len() {
        for j in 0..i {
            if root[i] != root[j] && same(i, j) {
                let (from, to) = (root[i].max(root[j]), root[i].min(root[j]));
                root.iter_mut().filter(|root| **root == from).for_each(|root| *root = to);
            }
        }
    }
    let mut found: Vec<Fault> = (0..groups.len())
        .filter(|group| root[*group] == *group)
        .map(|group| {
            let members = (0..groups.len()).filter(|other| root[*other] == group);
            fault(groups[group].0.0, &members.map(|k| (groups[k].0.1, groups[k].1.as_slice())).collect::<Vec<_>>())
        })
        .collect();
    found.sort_by(|a, b| b.sessions.cmp(&a.sessions).then_with(|| a.id.cmp(&b.id)));
    found
}

/// Family, component and driver.
fn family(effect: &EffectRecord) -> [&str; 3] {
    [&effect.family, &effect.name.component, &effect.name.driver]
}

/// Number of sessions of effects.
fn sessions(effects: &[Found<'_>]) -> usize {
    effects.iter().map(|(dated, _)| dated.record.key.as_str()).collect::<BTreeSet<_>>().len()
}

fn fault(code: &str, members: &[(&str, &[Found<'_>])]) -> Fault {
    let all = || members.iter().flat_map(|(_, effects)| effects.iter().copied());
    let mut by_machine: BTreeMap<&str, Vec<Found<'_>>> = BTreeMap::new();
    for (dated, effect) in all() {
        by_machine.entry(&dated.record.machine_id).or_default().push((dated, effect));
    }
    let machines = by_machine.into_iter().map(|(machine_id, effects)| {
        let days = || effects.iter().map(|(dated, _)| dated.days);
        FaultOfMachine {
            machine_id: machine_id.to_string(),
            sessions: sessions(&effects),
            first_days: days().fold(f64::INFINITY, f64::min),
            last_days: days().fold(f64::NEG_INFINITY, f64::max),
        }
    });
    let machines: Vec<FaultOfMachine> = machines.collect();
    let most = members.iter().max_by_key(|(id, effects)| (effects.len(), std::cmp::Reverse(*id)));
    let (id, first) = most.map_or(("", None), |(id, effects)| (*id, effects.first()));
    let gain: f64 = all().map(|(_, effect)| effect.rms_gain_um).sum();
    Fault {
        id: id.to_string(),
        meaning: first.map_or(String::new(), |(_, effect)| effect.name.meaning.clone()),
        code: code.to_string(),
        names: members.iter().map(|(id, effects)| (id.to_string(), sessions(effects))).collect(),
        sessions: machines.iter().map(|machine| machine.sessions).sum(),
        machines,
        mean_rms_gain_um: gain / all().count() as f64,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::fleet::record::{MachineRecord, Record};

    /// A session of a machine with one effect.
    fn session(machine_id: &str, code: &str, id: &str, aliases: &[&str]) -> Dated {
        let name = json!({ "component": &id[..3], "driver": "C", "shape": "harmonic", "meaning": "" });
        let effect = EffectRecord {
            id: id.into(),
            name: serde_json::from_value(name).unwrap(),
            family: "harmonic".into(),
            p_value: 0.0,
            rms_gain_um: 1.0,
            unique: true,
            aliases: aliases.iter().map(ToString::to_string).collect(),
        };
        let machine = MachineRecord { name: String::new(), code: code.into(), sha256: String::new() };
        let record = Record {
            machine_id: machine_id.into(),
            key: format!("{machine_id} {id}"),
            machine: Some(machine),
            effects: vec![effect],
            ..Record::default()
        };
        Dated { days: 1.0, record, ..Dated::default() }
    }

    #[test]
    fn one_fault_under_two_names_is_one() {
        let sessions = [
            session("1", "w C b t", "EZC~C:h2", &["EAC~C:h1", "EBC~C:h1"]),
            session("2", "w C b t", "EZC~C:h2", &["EAC~C:h1"]),
            session("3", "w C b t", "EAC~C:h1", &["EZC~C:h2"]),
            session("3", "w C b t", "EXX~X:p2", &[]),
            session("4", "w A b t", "EZC~C:h2", &[]),
        ];
        let found = faults(&[Machine::new(sessions.into())]);
        assert_eq!(found.len(), 3);
        assert_eq!((found[0].id.as_str(), found[0].sessions, found[0].machines.len()), ("EZC~C:h2", 3, 3));
        assert_eq!(found[0].names, BTreeMap::from([("EAC~C:h1".into(), 1), ("EZC~C:h2".into(), 2)]));
    }
}
