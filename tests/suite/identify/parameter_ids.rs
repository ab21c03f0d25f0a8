//! The identifiers of the parameters of every bundled session, and of every effect that a search tries on it, say what they
//! name: read again, they are the same.

use std::path::{Path, PathBuf};

use abbe::files::{self, ReadOptions};
use abbe::identify::noise::{Noise, NoiseSource};
use abbe::model::parameter_id::{EffectId, ParameterId};
use abbe::model::session::Prior;
use abbe::plan::states;
use abbe::trace::candidates::library;

use crate::suite::workspace;

fn tables(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            tables(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "toml") {
            found.push(path);
        }
    }
}

#[test]
fn identifiers_of_bundled_sessions_are_read_as_what_they_are() {
    let mut found = Vec::new();
    tables(&workspace().join("sessions"), &mut found);
    let (mut sessions, mut effects) = (0, 0);
    for file in found {
        let Ok(session) = files::session(&file, &ReadOptions::default()) else { continue };
        let Ok(mut plan) = states::complete(&session, true) else { continue };
        for prior in plan.tests.iter_mut().flat_map(|test| &mut test.priors) {
            *prior = Prior::Free;
        }
        let Ok(problem) = states::problem_by_test(&plan, Noise::white(1e-3, NoiseSource::Stated)) else { continue };
        for parameter in &problem.parameters.list {
            let text = parameter.id.to_string();
            assert_eq!(text.parse::<ParameterId>().as_ref(), Ok(&parameter.id), "{}: {text}", file.display());
            let (set_up, effect) = (parameter.effect.is_none() && !parameter.id.is_error(), parameter.effect.is_some());
            assert_eq!((parameter.id.is_setup(), parameter.id.effect().is_some()), (set_up, effect), "{text}");
        }
        for candidate in library::candidates(&problem).unwrap_or_default() {
            let id = EffectId::of(&candidate.effect, 1);
            assert_eq!(EffectId::parse(&candidate.effect.id()).as_deref(), Some(&id), "{}", file.display());
            effects += 1;
        }
        sessions += 1;
    }
    assert!(sessions > 10 && effects > 1000, "{sessions} {effects}");
    assert!("EXQ~C".parse::<ParameterId>().is_err());
}
