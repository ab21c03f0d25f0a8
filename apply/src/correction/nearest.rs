//! Commands near those that the iteration does not correct: near a singularity its steps lead too far, or nowhere.
//!
//! ```text
//! min ‖r(q′)‖²,   |q′ − q| at most the largest correction,   s = −Jᵀ(JJᵀ + λ²I)⁻¹ r
//! ```
//!
//! Rotations count as arcs at a radius of 1 m. The damping `λ` decreases with each step that reduces the deviation and
//! increases with each that does not (Levenberg 1944, Marquardt 1963), so that a solution close to the command is found
//! if there is one, and else the command that leaves least.

use abbe_model::Diagnostic;
use abbe_model::pose::jacobian::{Inverse, arcs, lever_mm};
use abbe_model::pose::{Pose, size};
use abbe_model::sensitivity::SlotValues;
use abbe_model::session::readings::Readings;

use super::{CONVERGENCE_MM, CONVERGENCE_RAD, Correction, LARGEST_CORRECTION_MM, Row, Rows};

/// Maximum number of steps.
const STEPS: usize = 200;
/// Damping of the first step, mm per mm.
const FIRST_DAMPING: f64 = 1e-2;
/// Damping from which a step is none.
const LARGEST_DAMPING: f64 = 1e3;
/// Factors on the damping after a step that reduces the deviation and after one that does not.
const FACTORS: [f64; 2] = [0.3, 4.0];

/// A row in this iteration.
struct Near {
    number: usize,
    /// The best command so far, in the order of the axes.
    best: Vec<f64>,
    /// Sum of squares of its deviation, mm².
    cost: f64,
    damping: f64,
    done: bool,
}

/// Moves the positions of these rows to the best commands near those stated, and notes what remains there. Returns the
/// length of the deviation before and after, mm, for each row.
///
/// # Errors
/// If the errors cannot be evaluated.
pub(super) fn settle(
    correction: &Correction<'_>,
    commanded: &Readings,
    positions: &mut Readings,
    (rows, numbers): (&mut [Row], &[usize]),
    errors: &dyn Fn(&Readings) -> Result<SlotValues, Diagnostic>,
) -> Result<Vec<[f64; 2]>, Diagnostic> {
    let machine = correction.machine;
    let axes = correction.aim.axes(machine);
    let command = |number: usize| axes.iter().map(|axis| commanded.positions[*axis][number]).collect::<Vec<f64>>();
    let mut near: Vec<Near> = (numbers.iter())
        .map(|number| Near {
            number: *number,
            best: command(*number),
            cost: f64::INFINITY,
            damping: FIRST_DAMPING,
            done: false,
        })
        .collect();
    let mut first = vec![f64::INFINITY; near.len()];
    let mut state = Vec::new();
    for step in 0..STEPS {
        let values = errors(positions)?;
        let block = Rows::of(&values, machine.error_slots());
        for (own, first) in near.iter_mut().zip(&mut first).filter(|(own, _)| !own.done) {
            let row = &mut rows[own.number];
            positions.state(machine, own.number, &mut state);
            let actual = Pose::of(machine, &state, &block.bodies(machine, own.number), correction.tool_mm);
            let deviation = correction.aim.deviation(&actual, &row.wanted);
            let cost = arcs(&deviation).norm_squared();
            if step == 0 {
                *first = cost;
            }
            if cost < own.cost {
                let [mm, rad] = size(&deviation);
                row.remaining = [mm, rad];
                row.deviation = deviation;
                own.cost = cost;
                own.best = axes.iter().map(|axis| positions.positions[*axis][own.number]).collect();
                own.damping *= FACTORS[0];
                own.done = mm <= CONVERGENCE_MM && rad <= CONVERGENCE_RAD;
            } else {
                own.damping *= FACTORS[1];
                own.done = own.damping > LARGEST_DAMPING || cost.is_nan();
            }
            for (axis, best) in axes.iter().zip(&own.best) {
                positions.positions[*axis][own.number] = *best;
            }
            if own.done {
                continue;
            }
            positions.state(machine, own.number, &mut state);
            let inverse = Inverse::damped(machine, &state, (correction.tool_mm, correction.aim), &axes, own.damping);
            let step = inverse.step(&row.deviation);
            for ((axis, change), command) in axes.iter().zip(step.iter()).zip(command(own.number)) {
                let lever_mm = lever_mm(machine.axes[*axis].kind);
                let most = LARGEST_CORRECTION_MM / lever_mm;
                let position = &mut positions.positions[*axis][own.number];
                *position = (*position - change / lever_mm).clamp(command - most, command + most);
            }
        }
        if near.iter().all(|own| own.done) {
            break;
        }
    }
    for own in &near {
        for (axis, best) in axes.iter().zip(&own.best) {
            positions.positions[*axis][own.number] = *best;
        }
    }
    Ok(near.iter().zip(first).map(|(own, first)| [first.sqrt(), own.cost.sqrt()]).collect())
}
