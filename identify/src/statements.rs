//! The three statements of a result: is it good, what to correct, what to measure next.
//!
//! The line of a rotary axis `k` in R with all axes at zero follows from the location errors of the axis and of the
//! rotary axes `p` between it and the bed on its side. To first order, with their translations `t`, rotations `ω` and
//! origins `o`,
//!
//! ```text
//! point:  o_k + Σ_p t_p + ω_p × (o_k − o_p)        direction:  d_k + Σ_p ω_p × d_k        p: k itself included
//! ```
//!
//! A linear axis has its own squareness errors in place of `ω_k`. The components across the axis are reported; a shift
//! of a line along itself is none. A rotation about the axis itself, or a shift of a linear axis along itself, is the zero
//! of the axis: `d_k · ω_k`, `d_k · t_k`.

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::instrument::Contact;
use abbe_model::parameter_id::ParameterId;
use abbe_model::unit::Unit;

use crate::fit::{FitResult, doubt_on_unit};
use crate::linear::is_of_interest;
use crate::plausibility::{Conflict, ConflictKind, Plausibility, likely_unit};
use crate::problem::Problem;
use crate::results::{
    AxisCorrection, Covariance, DeterminedBy, Estimate, Finding, GoodStatement, Goodness, GoodnessVerdict,
    LineQuantity, MeasureStatement, ModelResult, NextStep, NotJudged, Statements, Unobservable,
};
use crate::tolerance::Conformity;
use crate::tolerance::rule::Decision;

/// A component of a unit vector above which it is taken as along the axis.
const ALONG: f64 = 0.9;

impl Statements {
    /// Of a fit.
    pub fn of_fit(problem: &Problem, result: &FitResult) -> Statements {
        let model = &result.model;
        let measure = match base_step(&result.plausibility, model.outcome.goodness) {
            Some(step) => step,
            None if !has_candidates(problem) => NextStep::Nothing,
            None if model.unobservable.is_empty() => NextStep::Improve,
            None if is_exhausted(problem, &model.unobservable) => NextStep::AllDetermined,
            None => NextStep::Identify,
        };
        let measure = MeasureStatement {
            description: match measure {
                NextStep::AllDetermined => Some(format!("rank {0} of {0}", model.rank)),
                NextStep::CheckUnit => in_doubt(problem, &result.plausibility),
                _ => None,
            },
            ..measure.into()
        };
        Statements::of_model(problem, model, good(model, result.conformity.as_ref()), measure)
    }

    /// Of a model, with what is said of its goodness and of the next measurement.
    pub fn of_model(
        problem: &Problem,
        model: &ModelResult,
        good: GoodStatement,
        measure: MeasureStatement,
    ) -> Statements {
        Statements {
            good,
            further: further(problem, &model.parameters),
            correct: corrections(&problem.session.machine, &model.parameters, &model.covariance),
            changed: Vec::new(),
            measure,
        }
    }
}

/// Whether candidate tests exist for a problem: it has errors or effects to identify, and one of its instruments reads a
/// motion that a session can state. That of a ball bar, a nest or a stylus turns a rotary axis; a ball in sockets goes from one to another.
pub fn has_candidates(problem: &Problem) -> bool {
    let session = &problem.session;
    let has_errors = problem.parameters.list.iter().any(is_of_interest);
    let has_rotary = session.machine.axes.iter().any(|axis| axis.kind == AxisKind::Rotary);
    has_errors
        && session.tests.iter().any(|test| match test.station.contact() {
            Contact::None => true,
            Contact::InR(_) => false,
            _ => has_rotary,
        })
}

/// Whether any number of further poses of the same set-up would leave the same combinations: all are structural, and random
/// poses over the travel of every axis have no fewer.
fn is_exhausted(problem: &Problem, unobservable: &[Unobservable]) -> bool {
    unobservable.iter().all(|combination| combination.finding == Finding::Structural)
        && problem.at_random_poses().is_some_and(|anywhere| {
            let nominal = vec![0.0; anywhere.parameters.list.len()];
            let whole = anywhere.triangles(&nominal).map(|own| anywhere.prior_triangle(&nominal).merged(&own));
            let rank = whole.and_then(|whole| anywhere.parameters.rank(&whole));
            rank.is_ok_and(|rank| rank.null_space.ncols() >= unobservable.len())
        })
}

/// The step that has to come before any further test.
pub fn base_step(plausibility: &Plausibility, goodness: Goodness) -> Option<NextStep> {
    match goodness.verdict {
        _ if goodness.not_judged == Some(NotJudged::WrongUnit) => Some(NextStep::CheckUnit),
        _ if !plausibility.conflicts.is_empty() => Some(NextStep::CorrectSession),
        // More readings are what is lacking.
        GoodnessVerdict::NotJudged if goodness.not_judged == Some(NotJudged::NoDegreesOfFreedom) => None,
        GoodnessVerdict::NotJudged => Some(NextStep::StateNoise),
        verdict if verdict.lacks_an_effect() => Some(NextStep::Trace),
        _ => None,
    }
}

/// The unit in which readings in doubt likely are.
pub fn in_doubt(problem: &Problem, plausibility: &Plausibility) -> Option<String> {
    let unit = plausibility.conflicts.iter().find(|conflict| conflict.kind == ConflictKind::Unit);
    let likely = |conflict: &Conflict| {
        let likely = likely_unit(conflict.value / conflict.stated, problem.unit());
        format!("possibly {likely}, or deviations that were divided before")
    };
    unit.map(likely).or_else(|| doubt_on_unit(problem))
}

/// Whether a model is good, and what the limits of the session decide.
pub fn good(model: &ModelResult, conformity: Option<&Conformity>) -> GoodStatement {
    let of = |decision: Decision| -> Vec<String> {
        let items = conformity.iter().flat_map(|conformity| &conformity.items);
        items.filter(|item| item.decision == decision).map(|item| item.id.clone()).collect()
    };
    GoodStatement {
        verdict: None,
        goodness: model.outcome.goodness,
        decision: conformity.map(|conformity| conformity.verdict),
        failed: of(Decision::Fail),
        undecided: of(Decision::Undecided),
    }
}

/// A linear function of the location errors: coefficients of translations (mm per mm) and rotations (per rad).
type Terms = Vec<(ErrorName, f64)>;

/// The axis lines with identified location errors.
fn corrections(machine: &Machine, parameters: &[Estimate], covariance: &Covariance) -> Vec<AxisCorrection> {
    let mut found = Vec::new();
    for index in 0..machine.axes.len() {
        let axis = &machine.axes[index];
        let mut quantities = vec![LineQuantity::Direction];
        if axis.kind == AxisKind::Rotary {
            quantities.insert(0, LineQuantity::Point);
        }
        let nearest = nearest(axis.direction);
        found.extend(correction(
            &axis.name,
            (LineQuantity::Zero, ['X', 'Y', 'Z'][nearest]),
            0.0,
            &zero_terms(axis, nearest),
            (parameters, covariance),
        ));
        for quantity in quantities {
            for (i, coordinate) in ['X', 'Y', 'Z'].into_iter().enumerate() {
                if axis.direction[i].abs() > ALONG {
                    continue;
                }
                let terms = terms(machine, index, quantity, i);
                let nominal = match quantity {
                    LineQuantity::Point => axis.origin_mm[i],
                    LineQuantity::Direction => axis.direction[i],
                    LineQuantity::Zero => 0.0,
                };
                let of = (quantity, coordinate);
                found.extend(correction(&axis.name, of, nominal, &terms, (parameters, covariance)));
            }
        }
    }
    found
}

/// The location errors that change a component of an axis line.
fn terms(machine: &Machine, index: usize, quantity: LineQuantity, i: usize) -> Terms {
    let axis = &machine.axes[index];
    let on_tool_side = index >= machine.workpiece_side;
    // From the bed to the axis, on its side.
    let before: Vec<usize> = match on_tool_side {
        true => (machine.workpiece_side..index).collect(),
        false => (index + 1..machine.workpiece_side).collect(),
    };
    let rotary = |k: &usize| machine.axes[*k].kind == AxisKind::Rotary;
    let carriers = before.into_iter().filter(rotary).chain([index]);
    let mut terms = Terms::new();
    for k in carriers {
        let name = |freedom: usize| ErrorName {
            kind: ErrorKind::Location,
            freedom: Freedom::ALL[freedom],
            axis: machine.axes[k].name.clone(),
        };
        let lever: [f64; 3] = match quantity {
            LineQuantity::Point => std::array::from_fn(|c| axis.origin_mm[c] - machine.axes[k].origin_mm[c]),
            LineQuantity::Direction | LineQuantity::Zero => axis.direction,
        };
        if quantity == LineQuantity::Point {
            terms.push((name(i), 1.0));
        }
        // (ω × v)_i = ω_j v_k − ω_k v_j
        let (j, l) = ((i + 1) % 3, (i + 2) % 3);
        terms.extend([(name(3 + j), lever[l]), (name(3 + l), -lever[j])].into_iter().filter(|(_, by)| *by != 0.0));
    }
    terms
}

/// The coordinate of R nearest to a direction.
fn nearest(direction: [f64; 3]) -> usize {
    (1..3).fold(0, |best, i| if direction[i].abs() > direction[best].abs() + 1e-9 { i } else { best })
}

/// The location errors that displace an axis along or about itself, in its own positive direction; the one along `nearest`
/// comes first.
fn zero_terms(axis: &Axis, nearest: usize) -> Terms {
    let first = if axis.kind == AxisKind::Rotary { 3 } else { 0 };
    let of = |i: usize| {
        let freedom = Freedom::ALL[first + i];
        (ErrorName { kind: ErrorKind::Location, freedom, axis: axis.name.clone() }, axis.direction[i])
    };
    let others = (0..3).filter(|i| *i != nearest && axis.direction[*i] != 0.0);
    [nearest].into_iter().chain(others).map(of).collect()
}

/// What exceeds its expanded uncertainty, is no set-up parameter and changes no axis line: the most significant coefficient
/// of each effect, constant errors, shifts of a rotary axis along itself.
fn further(problem: &Problem, parameters: &[Estimate]) -> Vec<Estimate> {
    let machine = &problem.session.machine;
    let is_of_line = |name: &ErrorName| {
        let axis = machine.axes.iter().find(|axis| axis.name == name.axis && name.kind == ErrorKind::Location);
        axis.is_some_and(|axis| {
            let share = axis.direction[name.freedom.index() % 3].abs();
            match (axis.kind, name.freedom.is_angle()) {
                (AxisKind::Rotary, true) => true,
                // No shift along itself, and no roll.
                (AxisKind::Rotary, false) | (AxisKind::Linear, true) => share <= ALONG,
                (AxisKind::Linear, false) => share > 0.0,
            }
        })
    };
    let ratio = |found: &Estimate| (found.value / found.u).abs();
    let mut list: Vec<(ParameterId, Estimate)> = Vec::new();
    for found in parameters.iter().filter(|found| found.exceeds_u()) {
        let Ok(id) = found.id.parse::<ParameterId>() else { continue };
        // The phase of an amplitude and the numbers of a shape are no sizes.
        if id.is_phase() || id.is_number() || id.is_position() {
            continue;
        }
        match list.iter_mut().find(|(other, _)| id.effect().is_some() && other.effect() == id.effect()) {
            Some((_, other)) if ratio(found) > ratio(other) => *other = found.clone(),
            Some(_) => {}
            None if id.is_setup() || id.error().is_some_and(is_of_line) => {}
            None => list.push((id, found.clone())),
        }
    }
    list.into_iter().map(|(_, found)| found).collect()
}

/// The change of one component; `None` if no error of it is identified.
fn correction(
    axis: &str,
    (quantity, coordinate): (LineQuantity, char),
    nominal: f64,
    terms: &[(ErrorName, f64)],
    (parameters, covariance): (&[Estimate], &Covariance),
) -> Option<AxisCorrection> {
    // Index and change of the component in mm or 1 per unit of the parameter.
    let place = |name: &ErrorName| {
        let id = name.to_string();
        parameters.iter().position(|parameter| parameter.id == id)
    };
    let own: Vec<(usize, f64)> = (terms.iter())
        .filter_map(|(name, by)| {
            let internal = by / name.freedom.unit().displayed().per_internal();
            Some((place(name)?, internal))
        })
        .collect();
    // An error of the axis itself has to be identified; of a zero, the one along the axis.
    let is_own = |name: &ErrorName| match (quantity, terms.first()) {
        (LineQuantity::Zero, Some((first, _))) => name == first,
        _ => name.axis == axis && name.kind == ErrorKind::Location,
    };
    if !terms.iter().any(|(name, _)| is_own(name) && place(name).is_some()) {
        return None;
    }
    let is_angle = terms.first().is_some_and(|(name, _)| name.freedom.is_angle());
    // Changes and nominal values per mm, per rad or per 1.
    let (unit, identified) = match quantity {
        LineQuantity::Direction => (Unit::MicrometrePerMetre, 1.0),
        LineQuantity::Zero if is_angle => (Unit::Arcsecond, Unit::Degree.per_internal()),
        LineQuantity::Point | LineQuantity::Zero => (Unit::Micrometre, 1.0),
    };
    let change: f64 = own.iter().map(|(place, by)| by * parameters[*place].value).sum();
    let of = |a: usize, b: usize| covariance.matrix.get(a).and_then(|row| row.get(b)).copied().unwrap_or(0.0);
    let variance: f64 = own.iter().map(|(a, x)| own.iter().map(|(b, y)| x * y * of(*a, *b)).sum::<f64>()).sum();
    let by_prior = own.iter().any(|(place, _)| parameters[*place].determined_by == DeterminedBy::Prior);
    Some(AxisCorrection {
        axis: axis.to_string(),
        quantity,
        coordinate,
        nominal,
        identified: nominal + change * identified,
        change: unit.to_display(change),
        u: unit.to_display(variance.max(0.0).sqrt()),
        unit: unit.to_string(),
        determined_by: if by_prior { DeterminedBy::Prior } else { DeterminedBy::Readings },
        quotable: own.iter().all(|(place, _)| parameters[*place].quotable),
    })
}
