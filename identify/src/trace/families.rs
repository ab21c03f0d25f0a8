//! The first stage of a search on independent poses: families of effects under one prior, each accepted as a whole.
//!
//! Choosing single orders out of a smooth error of a joint finds those that fit the poses at hand. A family takes all
//! orders with a prior whose scale is estimated, so that the prior takes over where no pose determines the error. Two
//! groups are proposed, both about the axis of the joint itself: the spectrum of the angular positioning error of every
//! joint, and the compliance of every joint under the gravity moment about its axis. A group is accepted if the
//! held-out error over blocks of joint space decreases by more than the standard error of the decrease.

use abbe_model::axis::AxisKind;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::driver::Driver;
use abbe_model::effect::shape::{Power, Spectrum};
use abbe_model::effect::{CoefficientPrior, Component, Effect, Shape};

use super::TraceOptions;
use super::constants::{HIGHEST_ORDER_OF_SPECTRA, MIN_EFFECTIVE, MIN_EFFECTIVE_OF_MEMBER};
use super::interrupt::Interrupt;
use super::policy::has_few_poses;
use super::screening::is_requested;
use crate::candidates::sampling::Sampling;
use crate::error::IdentifyError;
use crate::fit::families::{FoldEquations, Scales, families};
use crate::fit::{Fit, with_families};
use crate::heldout::paired::HeldOutDecrease;
use crate::problem::Problem;

/// The families that a search accepted, with the fitted model that contains them.
pub(super) struct AcceptedFamilies {
    /// The problem with their effects.
    pub problem: Problem,
    /// Its fit.
    pub fit: Fit,
    /// The effects, in the order of the parameters.
    pub effects: Vec<AcceptedEffect>,
    /// Number of effects in the proposed groups.
    pub proposed: usize,
}

/// An effect of an accepted family.
#[derive(Clone, Debug)]
pub(super) struct AcceptedEffect {
    pub effect: Effect,
    /// What its group is, in words.
    pub group: String,
    /// Of a family: probability of at least the decrease of the held-out error by its group, if the group has no effect.
    /// Of a single effect: probability of a gain as large among all candidates, with the inflated noise.
    pub p_value: f64,
    /// Held-out rms with its group and those before it, mm.
    pub heldout_rms_mm: f64,
}

/// A group of families that is accepted as a whole.
struct Group {
    name: &'static str,
    effects: Vec<Effect>,
}

/// The groups for a problem.
fn groups(problem: &Problem, options: &TraceOptions, most: usize) -> Vec<Group> {
    let machine = &problem.session.machine;
    let sampling = Sampling::of(problem);
    let rotary = |axis: &usize| machine.axes[*axis].kind == AxisKind::Rotary;
    let own = |axis: usize| {
        let axis = &machine.axes[axis];
        let name = ErrorName { kind: ErrorKind::Motion, freedom: axis.own_freedom(), axis: axis.name.clone() };
        Component::Axis(name)
    };
    let spectrum = |axis: usize| {
        let shape = Shape::Spectrum(Spectrum::of_turn(HIGHEST_ORDER_OF_SPECTRA));
        Effect::new(own(axis), Driver::Axis(machine.axes[axis].name.clone()), shape)
    };
    let compliance = |axis: usize| {
        let scale = Driver::Gravity.kind().default_scale(Some(AxisKind::Rotary));
        let prior = CoefficientPrior::Family("compliance".to_string());
        Effect { prior, ..Effect::new(own(axis), Driver::Gravity, Shape::Power(Power { degree: 1, scale })) }
    };
    let joints: Vec<usize> = (0..machine.axes.len()).filter(rotary).collect();
    let moving = joints.iter().copied().filter(|axis| sampling.moves[*axis]);
    let spectra = if has_few_poses(problem) { Vec::new() } else { moving.map(spectrum).collect() };
    let groups = [
        Group { name: "angular positioning errors of all joints, all orders", effects: spectra },
        Group {
            name: "compliance of all joints under gravity",
            effects: joints.iter().copied().map(compliance).collect(),
        },
    ];
    let declared = &problem.parameters.effects;
    let same = |a: &Effect, b: &Effect| (&a.component, &a.driver, &a.shape) == (&b.component, &b.driver, &b.shape);
    let is_new = |effect: &Effect| {
        is_requested(options, &effect.id()) && !declared.iter().any(|declared| same(declared, effect))
    };
    let open =
        groups.into_iter().map(|group| Group { effects: group.effects.into_iter().filter(is_new).collect(), ..group });
    open.filter(|group| (1..=most).contains(&group.effects.len())).collect()
}

/// A group whose families were accepted.
struct Accepted {
    group: usize,
    decrease: HeldOutDecrease,
    scales: Scales,
}

/// Accepts families for a fitted problem. `None` if no group lowers the held-out error.
///
/// # Errors
/// If the model with the families cannot be fitted, or [`IdentifyError::Interrupted`].
pub(super) fn accepted(
    problem: &Problem,
    fit: &Fit,
    options: &TraceOptions,
    most: usize,
    interrupt: Interrupt<'_>,
) -> Result<Option<AcceptedFamilies>, IdentifyError> {
    let groups = groups(problem, options, most);
    if groups.is_empty() {
        return Ok(None);
    }
    let mut all = problem.clone();
    for effect in groups.iter().flat_map(|group| &group.effects) {
        all.add_effect(effect)?;
    }
    let mut beta = fit.beta.clone();
    beta.resize(all.parameters.list.len(), 0.0);
    let equations = FoldEquations::of(&all, &beta, &all.triangles(&beta)?);
    interrupt.check()?;
    // The families of each group, those declared first.
    let names: Vec<String> = families(&all.parameters).into_iter().map(|family| family.name).collect();
    let of_group = |group: &Group| -> Vec<usize> {
        let own: Vec<String> = group.effects.iter().filter_map(Effect::family).collect();
        (0..names.len()).filter(|family| own.contains(&names[*family])).collect()
    };
    let determined = equations.with_effect(MIN_EFFECTIVE)?;
    let families_of: Vec<Vec<usize>> = (groups.iter())
        .map(|group| of_group(group).into_iter().filter(|family| determined.contains(family)).collect())
        .collect();
    let declared: Vec<usize> =
        (0..names.len()).filter(|family| !groups.iter().any(|group| of_group(group).contains(family))).collect();
    let mut present = (declared.clone(), equations.with_families(&declared).estimate()?);
    let mut accepted: Vec<Accepted> = Vec::new();
    loop {
        let taken: usize = accepted.iter().map(|accepted| groups[accepted.group].effects.len()).sum();
        let open = (0..groups.len()).filter(|k| {
            let is_new = !accepted.iter().any(|accepted| accepted.group == *k);
            is_new && !families_of[*k].is_empty() && taken + groups[*k].effects.len() <= most
        });
        let mut best: Option<(usize, Vec<usize>, Scales)> = None;
        for k in open {
            interrupt.check()?;
            let mut chosen: Vec<usize> = present.0.iter().chain(&families_of[k]).copied().collect();
            chosen.sort_unstable();
            let mut scales = equations.with_families(&chosen).estimate()?;
            // Families whose scale vanishes explain nothing.
            let weak: Vec<usize> = (chosen.iter().zip(scales.effective()))
                .filter(|(family, effective)| families_of[k].contains(family) && **effective < MIN_EFFECTIVE)
                .map(|(family, _)| *family)
                .collect();
            if weak.len() == families_of[k].len() {
                continue;
            }
            if !weak.is_empty() {
                chosen.retain(|family| !weak.contains(family));
                scales = equations.with_families(&chosen).estimate()?;
            }
            if best.as_ref().is_none_or(|(_, _, best)| scales.held_out_sum() < best.held_out_sum()) {
                best = Some((k, chosen, scales));
            }
        }
        let Some((group, chosen, scales)) = best else { break };
        let decrease = scales.decrease_from(&present.1);
        if !decrease.is_significant() {
            break;
        }
        let before = std::mem::replace(&mut present, (chosen, scales));
        accepted.push(Accepted { group, decrease, scales: before.1 });
    }
    if accepted.is_empty() {
        return Ok(None);
    }
    finish(problem, &fit.beta, &equations, (&groups, &names), accepted, present).map(Some)
}

/// Fits the problem with the accepted families.
fn finish(
    problem: &Problem,
    declared: &[f64],
    equations: &FoldEquations,
    (groups, names): (&[Group], &[String]),
    accepted: Vec<Accepted>,
    (chosen, scales): (Vec<usize>, Scales),
) -> Result<AcceptedFamilies, IdentifyError> {
    // The held-out error after each group is that before the next one.
    let readings = equations.readings();
    let rms = |scales: &Scales| (scales.held_out_sum() / readings).sqrt() * problem.noise.likelihood_mm();
    let after: Vec<f64> = accepted.iter().skip(1).map(|next| rms(&next.scales)).chain([rms(&scales)]).collect();
    let kept = equations.with_families(&chosen);
    let mut with = problem.clone();
    let mut effects = Vec::new();
    let mut first: Vec<usize> = Vec::new();
    let mut next = problem.parameters.list.len();
    for group in groups {
        first.push(next);
        next += group.effects.iter().map(|effect| effect.shape.coefficients()).sum::<usize>();
    }
    for (place, group) in groups.iter().enumerate() {
        let Some(order) = accepted.iter().position(|accepted| accepted.group == place) else { continue };
        for effect in &group.effects {
            let Some(family) = effect.family() else { continue };
            // The readings determine nothing of a joint on which gravity has no moment.
            let own: Vec<usize> = (first[place]..).take(effect.shape.coefficients()).collect();
            first[place] += own.len();
            if !chosen.iter().any(|k| names[*k] == family) {
                continue;
            }
            if kept.effective_among(&scales, &own) >= MIN_EFFECTIVE_OF_MEMBER {
                with.add_effect(effect)?;
                effects.push(AcceptedEffect {
                    effect: effect.clone(),
                    group: group.name.to_string(),
                    p_value: accepted[order].decrease.p_value(),
                    heldout_rms_mm: after[order],
                });
            }
        }
    }
    // As in a fit of a session that declares these effects.
    let mut start = declared.to_vec();
    start.resize(with.parameters.list.len(), 0.0);
    let (problem, fit) = with_families(with, start)?;
    let proposed = groups.iter().map(|group| group.effects.len()).sum();
    Ok(AcceptedFamilies { problem, fit, effects, proposed })
}
