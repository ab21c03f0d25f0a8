//! An effect that the search cannot find: no verdict calls the model complete, no limit is decided, no estimate may be
//! quoted.

use abbe::files::{ReadOptions, session};
use abbe::identify::results::TraceVerdict;
use abbe::identify::tolerance::rule::Decision;
use abbe::model::session::tolerance::{Limit, Tolerance, Toleranced};
use abbe::trace::SessionFit;
use abbe::trace::screening::screened_effects;
use abbe::trace::{TraceOptions, trace};
use rayon::prelude::*;

use super::rates::Rate;
use super::sessions::{at_multiple, case, first_number, oracle, random, sessions, skipped};
use crate::plant::{EffectLabel, Injected, Oracle, Recipe, from_name};

/// Limits of every declared error: so wide that each would pass without the gate, and so narrow that each would fail.
fn limits(session: &abbe::model::session::Session, width: f64) -> Option<Tolerance> {
    let limit = |name: &abbe::model::component::ErrorName| Limit {
        of: Toleranced::Parameter(name.to_string()),
        lower: Some(-width),
        upper: width,
        unit: if name.freedom.is_angle() { "arcsec" } else { "um" },
    };
    let limits = session.unknowns.iter().map(limit).collect();
    Some(Tolerance { probability: Tolerance::PROBABILITY, limits })
}

/// The candidates that are compared with the effect, evenly chosen.
const COMPARED: usize = 40;

/// The candidate that explains the least of an effect. It is the only one that the search has.
fn unlike(oracle: &Oracle, truth: &Injected, session: &abbe::model::session::Session) -> String {
    let screened = screened_effects(session, &TraceOptions::default()).unwrap();
    let step = screened.len().div_ceil(COMPARED);
    let shares = screened.iter().step_by(step).filter(|candidate| candidate.observable).filter_map(|candidate| {
        let label = EffectLabel {
            component: candidate.effect.component.to_string(),
            driver: candidate.effect.driver.to_string(),
            shape: candidate.effect.shape.word().to_string(),
            order: candidate.effect.shape.order().map(|order| order as u32),
        };
        Some((oracle.explained_share(truth, &from_name(&label, truth)?), candidate.id.clone()))
    });
    let (share, id) = shares.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    assert!(share < 0.5, "{id} explains {share} of {truth:?}");
    id
}

struct Judged {
    complete: bool,
    decided: bool,
    quoted: bool,
}

/// A session with one effect at ten times the smallest significant size, and no candidate that could explain it.
fn judged(number: usize) -> Judged {
    let (kind, noise) = case(number);
    let oracle = oracle(kind, noise);
    let effect = oracle.random_detectable(1.0, &mut random(42, number));
    let effects = vec![at_multiple(&oracle, &effect, 10.0)];
    let recipe = Recipe { effects, ..Recipe::new(kind, 9000 + number as u64) }.noise(noise);
    let folder = tempfile::tempdir().unwrap();
    recipe.draw_on(&oracle.plan).write(folder.path()).unwrap();
    let read = session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
    let only = vec![unlike(&oracle, &recipe.effects[0], &read)];
    let options = TraceOptions { only, ..TraceOptions::default() };
    let mut judged = Judged { complete: false, decided: false, quoted: false };
    for width in [1e5, 1e-3] {
        let mut read = read.clone();
        read.tolerance = limits(&read, width);
        let traced = trace(&read, &options, &|_| true).unwrap().result;
        let fitted = SessionFit::of(&read, 1).unwrap().result;
        judged.complete |= matches!(traced.verdict, TraceVerdict::Clean | TraceVerdict::Explained);
        for (conformity, parameters) in
            [(traced.conformity, &traced.after.parameters), (fitted.conformity, &fitted.model.parameters)]
        {
            let decided = conformity.unwrap().items.iter().any(|item| item.decision != Decision::Undecided);
            let quoted = parameters.iter().any(|parameter| parameter.quotable);
            if decided || quoted {
                println!(
                    "session {number}, {kind:?}, {noise:?}, {:?}: decided {decided}, quoted {quoted}; trace {:?}",
                    recipe.effects[0], traced.verdict
                );
            }
            judged.decided |= decided;
            judged.quoted |= quoted;
        }
    }
    judged
}

#[test]
fn a_model_that_lacks_an_effect_decides_nothing() {
    if skipped("a_model_that_lacks_an_effect_decides_nothing") {
        return;
    }
    let first = first_number();
    let outcomes: Vec<Judged> = (0..sessions()).into_par_iter().map(|number| judged(number + first)).collect();
    let rate = |of: fn(&Judged) -> bool| {
        let mut rate = Rate::default();
        outcomes.iter().for_each(|judged| rate.count(of(judged)));
        rate
    };
    let rates = [rate(|judged| judged.complete), rate(|judged| judged.decided), rate(|judged| judged.quoted)];
    println!(
        "| an effect at 10 times that no candidate explains | |\n|---|---|\n| called clean or explained | {} |\n\
         | a limit decided by fit or trace | {} |\n| an estimate quotable | {} |",
        rates[0], rates[1], rates[2]
    );
    assert!(rates.iter().all(|rate| rate.hits == 0), "{rates:?}");
}

/// An error of order 36 whose χ²/ν is not significant: the fit decides nothing, since its residual has structure.
#[test]
fn a_wave_that_chi_square_overlooks_decides_nothing() {
    let Judged { complete, decided, quoted } = judged(33);
    assert!(!complete && !decided && !quoted, "complete {complete}, decided {decided}, quotable {quoted}");
}
