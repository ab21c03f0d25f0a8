//! Compares a result of trace with the true effects.

use abbe::identify::results::ModelResult;
use abbe::trace::result::{EffectName, EffectResult, ShapeParameter};

use super::rates::Pulls;
use super::sessions::{TracedSession, oracle};
use crate::plant::{Decay, EffectLabel, Injected, Oracle, Shape, from_name, named};

/// The name of a found effect, in the notation of the plant.
pub fn name_in_plant(name: &EffectName) -> EffectLabel {
    EffectLabel {
        component: name.component.clone(),
        driver: name.driver.clone(),
        shape: name.shape.clone(),
        order: name.order.map(|order| order as u32),
    }
}

/// Whether a name is that of the injected effect.
pub fn is(name: &EffectName, truth: &Injected) -> bool {
    let found = name_in_plant(name);
    let expected = named(truth);
    match truth.shape {
        // A ball that moves after a test: its offset in the tests before or after is a constant of those tests.
        Shape::Remount { .. } => {
            found.component == expected.component && found.shape == "constant" && !name.tests.is_empty()
        }
        _ => found == expected,
    }
}

/// All that a found effect is called, with the shape numbers that are stated: its name, its variants, its aliases and theirs.
fn explanations(effect: &EffectResult) -> impl Iterator<Item = (&EffectName, &[ShapeParameter])> {
    let named = (&effect.name, effect.shape_parameters.as_slice(), &effect.variants);
    let aliases = effect.aliases.iter().map(|own| (&own.name, own.shape_parameters.as_slice(), &own.variants));
    std::iter::once(named).chain(aliases).flat_map(|(name, numbers, variants)| {
        std::iter::once((name, numbers)).chain(variants.iter().map(|own| (own, &[][..])))
    })
}

/// The found effect that is the truth or has it among its aliases or their variants. A period that divides a turn, within the resolution
/// of a turn, is that harmonic.
pub fn found<'r>(outcome: &'r TracedSession, truth: &Injected) -> Option<&'r EffectResult> {
    let oracle = oracle(outcome.kind, outcome.noise);
    let is_truth = |name: &EffectName| {
        is(name, truth)
            || name.shape == "harmonic"
                && name.component == truth.component.to_string()
                && matches!(truth.shape, Shape::Periodic { .. })
                && from_name(&name_in_plant(name), truth)
                    .is_some_and(|other| oracle.explained_share(truth, &other) > 0.99)
    };
    let effects = &outcome.result.effects;
    effects.iter().find(|effect| explanations(effect).any(|(name, _)| is_truth(name)))
}

/// The numbers with which the oracle judges a member of an alias set.
#[derive(Clone, Copy, PartialEq)]
pub enum Numbers {
    /// The positions, widths and time constants of the truth.
    OfTruth,
    /// Those, or the member's own: whichever the oracle separates less.
    Own,
}

/// The surplus members of an alias set, the named effect included: effects of the plant that neither belong to the
/// alias class of the truth nor lie within `sigma` standard deviations of it.
pub fn surplus_aliases(
    outcome: &TracedSession,
    effect: &EffectResult,
    truth: &Injected,
    sigma: f64,
    numbers: Numbers,
) -> Vec<EffectLabel> {
    let oracle = oracle(outcome.kind, outcome.noise);
    let mut surplus_aliases: Vec<EffectLabel> = explanations(effect)
        .filter(|(name, _)| !is(name, truth))
        .filter_map(|(name, own)| {
            let remounted = matches!(truth.shape, Shape::Remount { .. }) && !name.tests.is_empty();
            let label = match remounted {
                // A ball that moves between tests is a constant of those tests in the result and a step in time in the
                // plant.
                true => EffectLabel { component: name.component.clone(), ..named(truth) },
                false => name_in_plant(name),
            };
            let other = from_name(&label, truth)?;
            let mut share = with_any_time_constant(&other)
                .iter()
                .map(|other| oracle.explained_share(truth, other))
                .fold(0.0, f64::max);
            if numbers == Numbers::Own && !remounted {
                share = oracle.explained_share_of(truth, &with_own_numbers(&other, own)).max(share);
            }
            is_apart(&oracle, truth, share, sigma).then_some(label)
        })
        .collect();
    surplus_aliases.dedup();
    surplus_aliases
}

/// Whether another effect, with its own numbers and with those of the truth, neither belongs to the alias class of the truth
/// nor lies within `sigma` standard deviations of it.
pub fn is_surplus(oracle: &Oracle, truth: &Injected, other: &Injected, sigma: f64) -> bool {
    let with_numbers_of_truth = from_name(&named(other), truth);
    let shares = with_numbers_of_truth.iter().chain([other]).map(|other| oracle.explained_share(truth, other));
    is_apart(oracle, truth, shares.fold(0.0, f64::max), sigma)
}

/// The same for an effect that explains this share of the truth.
fn is_apart(oracle: &Oracle, truth: &Injected, share: f64, sigma: f64) -> bool {
    share < 0.95 && oracle.strength_sigma(truth) * (1.0 - share * share).max(0.0).sqrt() > sigma
}

/// The effects that span an effect with the numbers of a result; steps have free heights.
fn with_own_numbers(effect: &Injected, numbers: &[ShapeParameter]) -> Vec<Injected> {
    let values: Vec<f64> = numbers.iter().flat_map(|number| number.values.iter().copied()).collect();
    let shapes = match (&effect.shape, values.as_slice()) {
        (Shape::Steps { .. }, at) => at.iter().map(|at| Shape::Steps { at: vec![*at], heights: vec![1.0] }).collect(),
        (Shape::Local { profile, .. }, [centre, width]) => {
            vec![Shape::Local { centre: *centre, width: *width, profile: *profile }]
        }
        (Shape::Warmup { .. }, [tau_s]) => vec![Shape::Warmup { tau_s: *tau_s }],
        (Shape::Periodic { phase_deg, .. }, [period]) => {
            vec![Shape::Periodic { period: *period, phase_deg: *phase_deg }]
        }
        (Shape::ReversalSpike { .. }, [width]) => vec![Shape::ReversalSpike { decay: Decay::Way(*width) }],
        (shape, _) => vec![shape.clone()],
    };
    shapes.into_iter().map(|shape| Injected { shape, ..effect.clone() }).collect()
}

/// Variants of an effect that its name does not distinguish: the name of a warm-up does not state its time constant.
fn with_any_time_constant(effect: &Injected) -> Vec<Injected> {
    match effect.shape {
        Shape::Warmup { .. } => [30.0, 60.0, 120.0, 240.0, 480.0, 960.0, 1920.0, 3840.0]
            .map(|tau_s| Injected { shape: Shape::Warmup { tau_s }, ..effect.clone() })
            .to_vec(),
        _ => vec![effect.clone()],
    }
}

/// Pulls of the errors of the machine: (value − truth) / u.
pub fn pulls(outcome: &TracedSession, model: &ModelResult) -> Pulls {
    let pulls = outcome.draw.truth.piges().filter_map(|(id, value, _)| {
        let parameter = model.parameters.iter().find(|parameter| parameter.id == id)?;
        Some((parameter.value - value) / parameter.u)
    });
    Pulls(pulls.collect())
}

/// A short form of a name.
pub fn short(name: &EffectName) -> String {
    let order = name.order.map(|order| format!("{order}")).unwrap_or_default();
    let tests = if name.tests.is_empty() { String::new() } else { format!("[{}]", name.tests.join("+")) };
    format!("{}~{}:{}{order}{tests}", name.component, name.driver, name.shape)
}

/// A summary of one session for the terminal.
pub fn summary(outcome: &TracedSession, mark: &str) -> String {
    let oracle = oracle(outcome.kind, outcome.noise);
    let noise = match outcome.noise {
        crate::plant::Noise::White { .. } => "white",
        crate::plant::Noise::Serial { .. } => "serial",
        crate::plant::Noise::Outliers { .. } => "outliers",
    };
    let truth: Vec<String> = outcome
        .draw
        .truth
        .effects
        .iter()
        .map(|effect| {
            format!(
                "{}~{:?}:{:?} x{:.2} ({:.1} sigma)",
                effect.component,
                effect.driver,
                effect.shape,
                effect.amplitude,
                oracle.strength_sigma(effect)
            )
        })
        .collect();
    let found: Vec<String> = outcome
        .result
        .effects
        .iter()
        .map(|effect| {
            let aliases: Vec<String> = effect.aliases.iter().take(6).map(|alias| short(&alias.name)).collect();
            format!(
                "{} (p {:.3}, {} aliases: {})",
                short(&effect.name),
                effect.p_value,
                effect.aliases.len(),
                aliases.join(" ")
            )
        })
        .collect();
    let result = &outcome.result;
    let not_claimed: Vec<String> = result
        .rejected_candidates
        .iter()
        .map(|rejected| {
            let (fall, u) = (rejected.heldout_decrease_um, rejected.u_heldout_decrease_um);
            let name = short(&rejected.name);
            format!("\n        REJECTED {name} (p {:.3}, held out falls by {fall:.5} ± {u:.5})", rejected.p_value)
        })
        .collect();
    format!(
        "{mark:<5} #{} {:?} {noise} {}\n        {} noise {:.3} AR {:?} outliers {}  held out {:.3} -> {:.3}, remainder p {:.3} {:?}, {:.2} s\n        {}{}",
        outcome.number,
        outcome.kind,
        truth.join(" + "),
        result.verdict,
        result.after.noise.value,
        result.after.noise_ar_coefficients,
        result.after.outliers.len(),
        result.before.fit.heldout_rms_um,
        result.after.fit.heldout_rms_um,
        result.remainder.p_value,
        result.remainder.place,
        outcome.seconds,
        found.join("\n        "),
        not_claimed.concat()
    )
}
