//! Families of effects under one prior, each group accepted as a whole.
//!
//! Choosing single orders out of a smooth error of a joint finds those that fit the poses at hand. A family takes all
//! orders with a prior whose scale is estimated, so that the prior takes over where no pose determines the error. Two
//! groups are proposed, both about the axis of the joint itself: the spectrum of the angular positioning error of every
//! joint, and the compliance of every joint under the gravity moment about its axis. A group is accepted if the
//! held-out error over blocks of joint space decreases by more than the standard error of the decrease.

use abbe_identify::fit::families::{FoldEquations, Scales, families};
use abbe_identify::fit::with_families_linearised;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::driver::Driver;
use abbe_model::effect::shape::{Power, Spectrum};
use abbe_model::effect::{CoefficientPrior, Component, Effect, Shape};
use abbe_model::sensitivity::TestModel;

use super::{AcceptedEffect, PoseModel};
use crate::TraceOptions;
use crate::candidates::sampling::Sampling;
use crate::constants::{HIGHEST_ORDER_OF_SPECTRA, MIN_EFFECTIVE, MIN_EFFECTIVE_OF_MEMBER};
use crate::interrupt::Interrupt;
use crate::paired::HeldOutDecrease;
use crate::policy::has_few_poses;
use crate::screening::is_requested;

/// A group of families that is accepted as a whole.
struct Group {
    name: &'static str,
    effects: Vec<Effect>,
}

/// The name of the group of the spectra.
const SPECTRA: &str = "angular positioning errors of all joints, all orders";

/// The identifiers of all effects that the search proposes in groups for a problem.
pub(crate) fn proposed_ids(problem: &Problem) -> Vec<String> {
    [true, false]
        .iter()
        .flat_map(|spectra| all(problem, *spectra))
        .flat_map(|group| group.effects)
        .map(|effect| effect.id())
        .collect()
}

/// All groups for a problem.
fn all(problem: &Problem, spectra: bool) -> Vec<Group> {
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
    let spectra: Vec<Effect> =
        if spectra && !has_few_poses(problem) { moving.map(spectrum).collect() } else { Vec::new() };
    let link = |axis: usize, loaded: usize| {
        let driver = Driver::GravityAt(machine.axes[loaded].name.clone());
        let scale = driver.kind().default_scale(Some(AxisKind::Rotary));
        let prior = CoefficientPrior::Family("links".to_string());
        Effect { prior, ..Effect::new(own(axis), driver, Shape::Power(Power { degree: 1, scale })) }
    };
    // Beside curves of all orders, the links would be a second description of the same smooth errors.
    let carriers = joints.iter().filter(|_| spectra.is_empty());
    let loads = carriers.flat_map(|axis| loads(problem, *axis).into_iter().map(|loaded| (*axis, loaded)));
    let links = loads.map(|(axis, loaded)| link(axis, loaded)).collect();
    vec![
        Group { name: SPECTRA, effects: spectra },
        Group {
            name: "compliance of all joints under gravity",
            effects: joints.iter().copied().map(compliance).collect(),
        },
        Group { name: "compliance of all joints under the weights of the links", effects: links },
    ]
}

/// The groups that a model does not have yet, with at most `most` effects.
fn groups(model: &PoseModel, options: &TraceOptions, spectra: bool, most: usize) -> Vec<Group> {
    let problem = &model.problem;
    let declared = &problem.parameters.effects;
    let same = |a: &Effect, b: &Effect| (&a.component, &a.driver, &a.shape) == (&b.component, &b.driver, &b.shape);
    let is_new = |effect: &Effect| {
        is_requested(options, &effect.id()) && !declared.iter().any(|declared| same(declared, effect))
    };
    let open = all(problem, spectra)
        .into_iter()
        .map(|group| Group { effects: group.effects.into_iter().filter(is_new).collect(), ..group });
    let has = |group: &Group| model.effects.iter().any(|accepted| accepted.group == group.name);
    open.filter(|group| (1..=most).contains(&group.effects.len()) && !has(group)).collect()
}

/// The axes at whose origins a weight has a moment about an axis, each place once.
fn loads(problem: &Problem, axis: usize) -> Vec<usize> {
    /// Poses that are compared.
    const POSES: usize = 32;
    let machine = &problem.session.machine;
    let mut found: Vec<(usize, Vec<f64>)> = Vec::new();
    for loaded in (0..machine.axes.len()).filter(|loaded| machine.carries(axis, *loaded)) {
        let of_model = |model: &TestModel| -> Vec<f64> {
            let rows = (0..model.rows()).step_by(model.rows().div_ceil(POSES).max(1));
            rows.filter_map(|row| machine.gravity_moment_of_axis_mm(axis, &model.state(row), loaded)).collect()
        };
        let moments: Vec<f64> = problem.models.iter().flat_map(of_model).collect();
        let is_new = |(_, known): &(usize, Vec<f64>)| known.iter().zip(&moments).any(|(a, b)| (a - b).abs() > 1e-6);
        if moments.iter().any(|moment| *moment != 0.0) && found.iter().all(is_new) {
            found.push((loaded, moments));
        }
    }
    found.into_iter().map(|(loaded, _)| loaded).collect()
}

/// A group whose families were accepted.
struct Accepted {
    group: usize,
    decrease: HeldOutDecrease,
    scales: Scales,
}

/// Adds groups to a model as long as one lowers its held-out error, and returns whether it added one. `spectra` is whether
/// the spectra are proposed, `most` the maximum number of effects.
///
/// # Errors
/// If the model with the families cannot be fitted, or `INTERRUPTED`.
pub(super) fn add(
    model: &mut PoseModel,
    options: &TraceOptions,
    spectra: bool,
    most: usize,
    interrupt: Interrupt<'_>,
) -> Result<bool, Diagnostic> {
    let most = most.saturating_sub(model.effects.len());
    let groups = groups(model, options, spectra, most);
    model.proposed = model.proposed.max(groups.iter().map(|group| group.effects.len()).sum());
    if groups.is_empty() {
        return Ok(false);
    }
    let problem = &model.problem;
    let mut all = problem.clone();
    for effect in groups.iter().flat_map(|group| &group.effects) {
        all.add_effect(effect)?;
    }
    let mut beta = model.near.beta.clone();
    beta.resize(all.parameters.list.len(), 0.0);
    let equations = FoldEquations::of(&all, &beta)?;
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
    let mut present = (declared.clone(), equations.with_families(&declared).estimate_near(&all, model.near.inflation)?);
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
            let mut scales = equations.with_families(&chosen).estimate_near(&all, model.near.inflation)?;
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
                scales = equations.with_families(&chosen).estimate_near(&all, model.near.inflation)?;
            }
            if best.as_ref().is_none_or(|(_, _, best)| scales.held_out_sum() < best.held_out_sum()) {
                best = Some((k, chosen, scales));
            }
        }
        let Some((group, chosen, scales)) = best else { break };
        let decrease = HeldOutDecrease::over_blocks(&present.1.held_out, &scales.held_out);
        if !decrease.is_significant() {
            break;
        }
        let before = std::mem::replace(&mut present, (chosen, scales));
        accepted.push(Accepted { group, decrease, scales: before.1 });
    }
    if accepted.is_empty() {
        return Ok(false);
    }
    finish(model, &equations, (&groups, &names), accepted, present)?;
    Ok(true)
}

/// Fits the model with the accepted families.
fn finish(
    model: &mut PoseModel,
    equations: &FoldEquations,
    (groups, names): (&[Group], &[String]),
    accepted: Vec<Accepted>,
    (chosen, scales): (Vec<usize>, Scales),
) -> Result<(), Diagnostic> {
    let problem = &model.problem;
    // The held-out error after each group is that before the next one.
    let readings = equations.readings();
    let rms = |scales: &Scales| (scales.held_out_sum() / readings).sqrt() * problem.noise.likelihood_mm();
    let after: Vec<f64> = accepted.iter().skip(1).map(|next| rms(&next.scales)).chain([rms(&scales)]).collect();
    let kept = equations.with_families(&chosen);
    let mut with = problem.clone();
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
                model.effects.push(AcceptedEffect {
                    effect: effect.clone(),
                    group: group.name.to_string(),
                    is_single: false,
                    p_value: accepted[order].decrease.p_value(),
                    heldout_rms_mm: after[order],
                    aliases: Vec::new(),
                });
            }
        }
    }
    // As in a fit of a session that declares these effects.
    let mut start = model.near.beta.clone();
    start.resize(with.parameters.list.len(), 0.0);
    (model.problem, model.near) = with_families_linearised(with, start, model.near.inflation)?;
    Ok(())
}
