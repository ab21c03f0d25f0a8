//! Basis functions of the shapes over an open scalar: numbers for a fit, symbols for a printed equation.
//!
//! | shape | basis |
//! |---|---|
//! | constant | 1 |
//! | polynomial(n) | (q/s), …, (q/s)ⁿ, s the scale of the driver |
//! | harmonic(n) | cos nq, sin nq |
//! | periodic(p) | cos 2πq/p, sin 2πq/p |
//! | curve | periodic or clamped cubic B-splines on equal knots |
//! | backlash | −½ · direction: the coefficient is the full lost motion |
//! | lag | −rate: the coefficient is the delay in s |
//! | reversal-spike | direction · exp(−distance since reversal / width) |
//! | drift | t/h, hours |
//! | warmup(τ) | 1 − exp(−t/τ) |
//! | steps | one at and beyond each position |
//! | local(centre, width) | (1 + cos(π(q − centre)/width))/2 within ±width, else 0 |
//!
//! Numbers select one piece of a piecewise function. Symbols cannot, so a symbolic basis function contains every piece times a step of 0
//! or 1.

use std::f64::consts::{PI, TAU};

use super::{DriverSample, Shape};
use crate::scalar::Nominal;

const SECONDS_PER_HOUR: f64 = 3600.0;

impl Shape {
    /// Appends the values of the basis functions at one reading to `basis`, in the order of the coefficients.
    pub fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let q = sample.value;
        let constant = N::constant;
        match self {
            Shape::Constant => basis.push(constant(1.0)),
            Shape::Polynomial { degree, scale } => {
                let mut power = constant(1.0);
                for _ in 0..*degree {
                    power = power * (q / constant(*scale));
                    basis.push(power);
                }
            }
            Shape::Power { degree, scale } => basis.push((q / constant(*scale)).power(*degree as i32)),
            Shape::Harmonic { order } => {
                let (sin, cos) = (constant(*order) * q).sin_cos();
                basis.extend([cos, sin]);
            }
            Shape::Periodic { period } => {
                let (sin, cos) = (constant(TAU) * q / constant(*period)).sin_cos();
                basis.extend([cos, sin]);
            }
            Shape::Curve {
                from,
                to,
                intervals,
                closed,
            } => b_splines(q, [*from, *to], *intervals, *closed, basis),
            Shape::Backlash => basis.push(constant(-0.5) * sample.direction),
            Shape::Lag => basis.push(-sample.rate),
            Shape::ReversalSpike { width } => {
                basis.push(sample.direction * (-sample.since_reversal / constant(*width)).exp());
            }
            Shape::Drift => basis.push(q / constant(SECONDS_PER_HOUR)),
            Shape::Warmup { tau_s } => basis.push(constant(1.0) - (-q / constant(*tau_s)).exp()),
            Shape::Steps { at } => basis.extend(at.iter().map(|position| (q - constant(*position)).step())),
            Shape::Local {
                centre,
                width,
                recurs,
            } => {
                let mut from_centre = q - constant(*centre);
                if let Some(period) = recurs.map(constant) {
                    from_centre = from_centre - period * (from_centre / period).round();
                }
                basis.push(bump(from_centre / constant(*width)));
            }
        }
    }
}

/// A raised cosine within ±1.
fn bump<N: Nominal>(within: N) -> N {
    let one = N::constant(1.0);
    let raised = || N::constant(0.5) * (one + (N::constant(PI) * within).sin_cos().1);
    match within.known() {
        Some(known) if known.abs() < 1.0 => raised(),
        Some(_) => N::constant(0.0),
        None => (one - within * within).step() * raised(),
    }
}

/// Uniform cubic B-splines (de Boor, A Practical Guide to Splines, ch. IX): four of them are nonzero at any position.
fn b_splines<N: Nominal>(q: N, ends: [f64; 2], intervals: usize, closed: bool, basis: &mut Vec<N>) {
    let constant = N::constant;
    let start = basis.len();
    let count = if closed { intervals } else { intervals + 3 };
    basis.resize(start + count, constant(0.0));
    let [from, to] = ends;
    let mut along = (q - constant(from)) / constant(to - from);
    along = if closed {
        along - along.floor()
    } else {
        along.at_least(0.0).at_most(1.0)
    };
    let position = along * constant(intervals as f64);
    let interval = position.floor().at_most((intervals - 1) as f64);
    let four = pieces(position - interval);
    let mut add = |interval: usize, value: &dyn Fn(N) -> N| {
        for (k, piece) in four.into_iter().enumerate() {
            let index = if closed {
                (interval + k) % intervals
            } else {
                interval + k
            };
            basis[start + index] = basis[start + index] + value(piece);
        }
    };
    match interval.known() {
        Some(known) => add(known as usize, &|piece| piece),
        None => {
            let beyond = |number: usize| match number {
                0 => constant(1.0),
                number if number == intervals => constant(0.0),
                number => (interval - constant(number as f64)).step(),
            };
            for number in 0..intervals {
                let here = beyond(number) - beyond(number + 1);
                add(number, &|piece| here * piece);
            }
        }
    }
}

/// The four cubic pieces of an interval at `u`, the position within the interval as a fraction of its length.
fn pieces<N: Nominal>(u: N) -> [N; 4] {
    let constant = N::constant;
    let six = constant(6.0);
    let v = constant(1.0) - u;
    [
        v * v * v / six,
        (constant(3.0) * u * u * u - six * u * u + constant(4.0)) / six,
        (constant(3.0) * v * v * v - six * v * v + constant(4.0)) / six,
        u * u * u / six,
    ]
}
