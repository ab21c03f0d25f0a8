//! From a finished search to what is reported.

use abbe_model::axis::AxisKind;
use abbe_model::effect::{Driver, DriverSample, Effect, Shape};

use super::alias::{self, Alias, Rival};
use super::library;
use super::remainder::Structure;
use super::search::Search;
use super::start::Start;
use crate::error::IdentifyError;
use crate::fit::{self, Fit};
use crate::heldout::rms_mm;
use crate::parameters::Role;
use crate::problem::Problem;
use crate::results::{
    CurvePoint, EffectName, EffectResult, ModelResult, Moved, ParameterResult, Remainder, ShapeNumber,
    TraceResult,
};

/// Share of the structure's excess over noise that may remain for the found effects to count as the explanation.
const EXPLAINED_SHARE: f64 = 0.5;

/// What a search has come to.
pub(super) struct Findings<'f, 'a> {
    pub before: &'f Problem<'a>,
    pub before_fit: &'f Fit,
    pub after: &'f Problem<'a>,
    pub after_fit: &'f Fit,
    pub search: &'f Search<'f>,
    pub start: &'f Start,
    pub structure_before: Option<&'f Structure>,
    pub structure_after: Option<&'f Structure>,
    pub last_p_value: f64,
    /// Whether the search was ended by its cap or by the user, not by the evidence.
    pub stopped_early: bool,
    pub candidates: usize,
    pub candidates_seen: usize,
}

/// What is reported, and what stands behind it.
pub(super) struct Reported {
    pub result: TraceResult,
    pub look_alikes: Vec<Vec<Effect>>,
    pub rivals: Vec<Vec<Rival>>,
}

/// An effect's name as it stands in results.
pub(super) fn effect_name(effect: &Effect) -> EffectName {
    EffectName {
        component: effect.component.to_string(),
        driver: effect.driver.to_string(),
        shape: effect.shape.word().to_string(),
        order: effect.shape.order(),
        tests: effect.tests.clone(),
    }
}

/// What is reported, and for each effect what looks like it and what stands highest in its place.
pub(super) fn report(findings: &Findings<'_, '_>) -> Result<Reported, IdentifyError> {
    let Findings {
        before,
        before_fit,
        after,
        after_fit,
        search,
        ..
    } = findings;
    let whitened_rows = search.columns.rows().max(1) as f64;
    let in_residual_variance = findings.structure_after.is_none();
    let held_out_um = |sum: f64, scale: f64| (sum / whitened_rows).sqrt() * scale;
    // Whitened sums of squares are turned into µm by the declared model's own figures.
    let first = search.held_out.first().copied().unwrap_or(1.0);
    let before_result = model_result(before, before_fit, before_fit.held_out.rms_mm);
    let scale = before_result.heldout_rms_um / held_out_um(first, 1.0).max(f64::MIN_POSITIVE);
    let last = search.held_out.last().copied().unwrap_or(first);
    let mut after_result = model_result(after, after_fit, held_out_um(last, scale) * 1e-3);

    let families = library::families()?;
    let mut effects = Vec::new();
    let mut look_alikes: Vec<Vec<Effect>> = Vec::new();
    let mut rivals = Vec::new();
    let mut alias_shifts = vec![0.0_f64; before_fit.beta.len()];
    let variance = if in_residual_variance {
        let sum: f64 = after_fit
            .residuals
            .iter()
            .flatten()
            .map(|v| (v / after.noise.sigma_mm).powi(2))
            .sum();
        (sum / whitened_rows).max(1.0)
    } else {
        1.0
    };
    for (k, taken) in search.taken().iter().enumerate() {
        let candidate = &search.candidates[taken.candidate];
        let model = search.model_without(Some(k));
        let (aliases, of_effect) = alias::aliases(search, k, variance);
        rivals.push(of_effect);
        let named = model.joined(taken.candidate).0;
        let effect_of = |alias: &Alias| search.candidates[alias.candidate].effect.clone();
        look_alikes.push(aliases.iter().map(effect_of).collect());
        widen(&mut alias_shifts, &aliases, &named, findings.start);
        let gain = model.gain(taken.candidate).gain;
        effects.push(EffectResult {
            name: effect_name(&candidate.effect),
            family: families
                .get(candidate.family)
                .map(|family| family.name.clone())
                .unwrap_or_default(),
            numbers: numbers_of(after, &candidate.effect),
            parameters: parameters_of(after, after_fit, k + before.parameters.effects.len()),
            curve: curve_of(after, after_fit, k + before.parameters.effects.len()),
            curve_at_unit: curve_units(after, &candidate.effect).0,
            curve_unit: curve_units(after, &candidate.effect).1,
            p_value: taken.p_value,
            rms_gain_um: (gain / whitened_rows).sqrt() * before.noise.sigma_mm * 1e3,
            heldout_rms_um: held_out_um(search.held_out.get(k + 1).copied().unwrap_or(last), scale),
            aliases: look_alikes[k].iter().map(effect_name).collect(),
            separated_by: None,
            separation: None,
        });
    }
    for parameter in &mut after_result.parameters {
        let place = after.parameters.list.iter().position(|p| p.id == parameter.id);
        if let Some(shift) = place.and_then(|j| alias_shifts.get(j).copied()) {
            let unit = place.map_or(1.0, |j| after.parameters.list[j].unit.per_inside);
            parameter.u = parameter.u.hypot(shift * unit);
        }
    }
    let (verdict, remainder) = verdict(findings, &mut effects);
    let moved = moved(&before_result.parameters, &after_result.parameters);
    let warnings = before.session.warnings.clone();
    let result = TraceResult {
        verdict,
        noise_um: before.noise.sigma_mm * 1e3,
        noise_source: before.noise.source.word().to_string(),
        noise_memory: before.noise.memory.clone(),
        readings: before.readings(),
        heldout_by: before.folds.kind.words().to_string(),
        before: before_result,
        after: after_result,
        effects,
        remainder,
        residual_before: match findings.structure_before {
            Some(structure) if structure.is_there() => structure.words.clone(),
            Some(_) => "no structure beyond noise".to_string(),
            None => "independent poses: structure is looked for effect by effect".to_string(),
        },
        moved,
        candidates: findings.candidates,
        candidates_seen: findings.candidates_seen,
        unobservable: fit::unobservable(after, &after_fit.rank),
        rejected: fit::rejected(after, after_fit),
        warnings,
    };
    Ok(Reported {
        result,
        look_alikes,
        rivals,
    })
}

fn model_result(problem: &Problem<'_>, fit: &Fit, held_out_mm: f64) -> ModelResult {
    let three = problem.coordinates() == 3;
    let rms = rms_mm(problem, &fit.residuals) * 1e3;
    let held = held_out_mm * 1e3;
    let in_3d = |rms: f64| three.then(|| rms * 3.0_f64.sqrt());
    ModelResult {
        rms_um: rms,
        heldout_rms_um: held,
        rms_3d_um: in_3d(rms),
        heldout_rms_3d_um: in_3d(held),
        parameters: fit::parameters(problem, fit),
    }
}

/// The parameters of the `number`-th effect.
fn parameters_of(problem: &Problem<'_>, fit: &Fit, number: usize) -> Vec<ParameterResult> {
    let Some(id) = problem.parameters.effect_ids.get(number) else {
        return Vec::new();
    };
    let has = problem
        .parameters
        .list
        .iter()
        .any(|p| matches!(p.role, Role::Coefficient { effect, .. } if effect == number));
    if !has {
        return Vec::new();
    }
    fit::parameters(problem, fit)
        .into_iter()
        .filter(|p| {
            p.id == *id
                || p.id
                    .strip_prefix(id.as_str())
                    .is_some_and(|rest| rest.starts_with('.'))
        })
        .collect()
}

/// Points at which a curve is reported.
const CURVE_POINTS: usize = 73;

/// The points of a free curve with their band; empty for other shapes.
fn curve_of(problem: &Problem<'_>, fit: &Fit, number: usize) -> Vec<CurvePoint> {
    let Some(effect) = problem.parameters.effects.get(number) else {
        return Vec::new();
    };
    let Shape::Curve { from, to, .. } = effect.shape else {
        return Vec::new();
    };
    let places: Vec<usize> = (0..problem.parameters.list.len())
        .filter(|j| matches!(problem.parameters.list[*j].role, Role::Coefficient { effect, .. } if effect == number))
        .collect();
    let Some(first) = places.first() else {
        return Vec::new();
    };
    let outside = problem.parameters.list[*first].unit.per_inside;
    let at_outside = if curve_units(problem, effect).0 == "deg" {
        1.0_f64.to_degrees()
    } else {
        1.0
    };
    (0..CURVE_POINTS)
        .map(|k| {
            let q = from + (to - from) * k as f64 / (CURVE_POINTS - 1) as f64;
            let mut basis = Vec::new();
            effect.shape.basis(
                &DriverSample {
                    value: q,
                    ..DriverSample::default()
                },
                &mut basis,
            );
            let value: f64 = basis.iter().zip(&places).map(|(b, j)| b * fit.beta[*j]).sum();
            let variance: f64 = basis
                .iter()
                .zip(&places)
                .flat_map(|(b, j)| basis.iter().zip(&places).map(move |(c, l)| (b, j, c, l)))
                .map(|(b, j, c, l)| b * c * fit.covariance[(*j, *l)])
                .sum();
            CurvePoint {
                at: q * at_outside,
                value: value * outside,
                u: variance.max(0.0).sqrt() * outside,
            }
        })
        .collect()
}

/// Units of a curve's places and values; empty for other shapes.
fn curve_units(problem: &Problem<'_>, effect: &Effect) -> (String, String) {
    if !matches!(effect.shape, Shape::Curve { .. }) {
        return (String::new(), String::new());
    }
    (
        driver_unit(problem, effect).0.to_string(),
        crate::drivers::coefficient_unit(problem.session, effect).name,
    )
}

/// The unit in which results give places on what an effect follows, and how many of it are one inside unit.
fn driver_unit(problem: &Problem<'_>, effect: &Effect) -> (&'static str, f64) {
    let machine = &problem.session.machine;
    let kind = match &effect.driver {
        Driver::Axis(name) => machine.axis_index(name).map(|axis| machine.axes[axis].kind),
        Driver::Time => return ("s", 1.0),
        _ => None,
    };
    if kind == Some(AxisKind::Rotary) {
        ("deg", 1.0_f64.to_degrees())
    } else {
        ("mm", 1.0)
    }
}

/// The numbers and places of an effect's shape.
fn numbers_of(problem: &Problem<'_>, effect: &Effect) -> Vec<ShapeNumber> {
    let (unit, per_inside) = driver_unit(problem, effect);
    let numbers = match &effect.shape {
        Shape::Periodic { period } => vec![("period", vec![*period])],
        Shape::ReversalSpike { width } => vec![("width", vec![*width])],
        Shape::Warmup { tau_s } => vec![("time constant", vec![*tau_s])],
        Shape::Local { centre, width, .. } => vec![("centre", vec![*centre]), ("width", vec![*width])],
        Shape::Steps { at } => vec![("at", at.clone())],
        _ => Vec::new(),
    };
    let number = |(name, values): (&str, Vec<f64>)| ShapeNumber {
        name: name.to_string(),
        values: values.into_iter().map(|value| value * per_inside).collect(),
        unit: unit.to_string(),
    };
    numbers.into_iter().map(number).collect()
}

/// How far the unknowns would move if an alias stood in an effect's place: the largest move of each, inside units.
fn widen(shifts: &mut [f64], aliases: &[Alias], named: &[f64], start: &Start) {
    let rank = start.to_unknowns.ncols();
    let mut largest = vec![0.0_f64; shifts.len()];
    for alias in aliases {
        for (j, most) in largest.iter_mut().enumerate() {
            let move_of: f64 = (0..rank)
                .map(|k| start.to_unknowns[(j, k)] * (alias.model_coefficients[k] - named[k]))
                .sum();
            *most = most.max(move_of.abs());
        }
    }
    for (shift, most) in shifts.iter_mut().zip(largest) {
        *shift = shift.hypot(most);
    }
}

fn verdict(findings: &Findings<'_, '_>, effects: &mut [EffectResult]) -> (String, Remainder) {
    let Some(after) = findings.structure_after else {
        let word = match (effects.is_empty(), findings.stopped_early) {
            (true, _) => "clean",
            (false, false) => "explained",
            (false, true) => "partly-explained",
        };
        let remainder = Remainder {
            structured: false,
            p_value: findings.last_p_value,
            place: None,
        };
        return (word.to_string(), remainder);
    };
    let structured = after.is_there();
    let remainder = Remainder {
        structured,
        p_value: after.p_value,
        place: structured.then(|| after.words.clone()),
    };
    let before = findings
        .structure_before
        .map_or(0.0, |structure| structure.excess);
    let share = if before > 0.0 { after.excess / before } else { 0.0 };
    let word = match (effects.is_empty(), structured) {
        (true, false) => "clean",
        (true, true) => "unexplained",
        (false, false) => "explained",
        (false, true) if share < EXPLAINED_SHARE => "partly-explained",
        (false, true) => "unexplained",
    };
    (word.to_string(), remainder)
}

/// Parameters that moved by more than their uncertainty.
fn moved(before: &[ParameterResult], after: &[ParameterResult]) -> Vec<Moved> {
    before
        .iter()
        .filter_map(|b| {
            let a = after.iter().find(|a| a.id == b.id)?;
            ((a.value - b.value).abs() > a.u).then(|| Moved {
                id: a.id.clone(),
                by: a.value - b.value,
                u: a.u,
                unit: a.unit.clone(),
            })
        })
        .collect()
}
