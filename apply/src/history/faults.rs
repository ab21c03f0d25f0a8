//! Effects of many sessions as faults: two effects are one fault if one of them is among the aliases of the other, or
//! if they have one family, component and driver and a common alias. The same fault under two names is one fault.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::Serialize;

/// An effect that a session found.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundEffect {
    /// Identifier of the machine.
    pub machine_id: String,
    /// What tells machines of one kind from others: effects of other kinds are other faults.
    pub kind: String,
    /// The session.
    pub session: String,
    /// Day of the session.
    pub days: f64,
    /// Identifier of the effect.
    pub id: String,
    /// Family, component and driver.
    pub family: (String, String, String),
    /// What the effect is, in words.
    pub meaning: String,
    /// Rms that the effect explains, µm.
    pub rms_gain_um: f64,
    /// Identifiers of its aliases.
    pub aliases: Vec<String>,
}

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
pub fn faults(effects: &[FoundEffect]) -> Vec<Fault> {
    // Effects of one name belong together, so names are joined, not sessions.
    let mut named: BTreeMap<(&str, &str), Vec<&FoundEffect>> = BTreeMap::new();
    for effect in effects {
        named.entry((&effect.kind, &effect.id)).or_default().push(effect);
    }
    let groups: Vec<((&str, &str), Vec<&FoundEffect>)> = named.into_iter().collect();
    let aliases: Vec<BTreeSet<&str>> = groups
        .iter()
        .map(|(_, found)| found.iter().flat_map(|effect| effect.aliases.iter().map(String::as_str)).collect())
        .collect();
    let same = |i: usize, j: usize| {
        let (((kind_i, id_i), found_i), ((kind_j, id_j), found_j)) = (&groups[i], &groups[j]);
        kind_i == kind_j
            && (aliases[i].contains(id_j)
                || aliases[j].contains(id_i)
                || (found_i[0].family == found_j[0].family && !aliases[i].is_disjoint(&aliases[j])))
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
            fault(&members.map(|member| (groups[member].0.1, groups[member].1.as_slice())).collect::<Vec<_>>())
        })
        .collect();
    found.sort_by(|a, b| b.sessions.cmp(&a.sessions).then_with(|| a.id.cmp(&b.id)));
    found
}

/// Number of sessions of effects.
fn sessions<'e>(effects: impl Iterator<Item = &'e FoundEffect>) -> usize {
    effects.map(|effect| effect.session.as_str()).collect::<BTreeSet<_>>().len()
}

fn fault(members: &[(&str, &[&FoundEffect])]) -> Fault {
    let mut by_machine: BTreeMap<&str, Vec<&FoundEffect>> = BTreeMap::new();
    for effect in members.iter().flat_map(|(_, effects)| effects.iter()) {
        by_machine.entry(&effect.machine_id).or_default().push(effect);
    }
    let machines = by_machine.into_iter().map(|(machine_id, effects)| {
        let days = || effects.iter().map(|effect| effect.days);
        FaultOfMachine {
            machine_id: machine_id.to_string(),
            sessions: sessions(effects.iter().copied()),
            first_days: days().fold(f64::INFINITY, f64::min),
            last_days: days().fold(f64::NEG_INFINITY, f64::max),
        }
    });
    let machines: Vec<FaultOfMachine> = machines.collect();
    let most = members.iter().max_by_key(|(id, effects)| (effects.len(), std::cmp::Reverse(*id)));
    let (id, first) = most.map_or(("", None), |(id, effects)| (*id, effects.first()));
    let count: usize = members.iter().map(|(_, effects)| effects.len()).sum();
    let gain: f64 = members.iter().flat_map(|(_, effects)| effects.iter()).map(|effect| effect.rms_gain_um).sum();
    Fault {
        id: id.to_string(),
        meaning: first.map_or(String::new(), |effect| effect.meaning.clone()),
        code: first.map_or(String::new(), |effect| effect.kind.clone()),
        names: members.iter().map(|(id, effects)| (id.to_string(), sessions(effects.iter().copied()))).collect(),
        sessions: machines.iter().map(|machine| machine.sessions).sum(),
        machines,
        mean_rms_gain_um: gain / count as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effect(machine: &str, kind: &str, id: &str, aliases: &[&str]) -> FoundEffect {
        FoundEffect {
            machine_id: machine.into(),
            kind: kind.into(),
            session: format!("{machine} {id}"),
            days: 1.0,
            id: id.into(),
            family: ("harmonic".into(), id[..3].into(), "C".into()),
            meaning: String::new(),
            rms_gain_um: 1.0,
            aliases: aliases.iter().map(ToString::to_string).collect(),
        }
    }

    #[test]
    fn one_fault_under_two_names_is_one() {
        let effects = [
            effect("1", "w C b t", "EZC~C:h2", &["EAC~C:h1", "EBC~C:h1"]),
            effect("2", "w C b t", "EZC~C:h2", &["EAC~C:h1"]),
            effect("3", "w C b t", "EAC~C:h1", &["EZC~C:h2"]),
            effect("3", "w C b t", "EXX~X:p2", &[]),
            effect("4", "w A b t", "EZC~C:h2", &[]),
        ];
        let found = faults(&effects);
        assert_eq!(found.len(), 3);
        assert_eq!((found[0].id.as_str(), found[0].sessions, found[0].machines.len()), ("EZC~C:h2", 3, 3));
        assert_eq!(found[0].names, BTreeMap::from([("EAC~C:h1".into(), 1), ("EZC~C:h2".into(), 2)]));
    }
}
