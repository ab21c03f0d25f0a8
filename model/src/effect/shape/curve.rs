//! `curve`: a nonparametric curve (spline): periodic or clamped cubic B-splines on equal knots.

use std::f64::consts::TAU;

use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::words::EffectWords;
use super::{DriverSample, Key, KeyForm, KeyReader, KeyWriter, Shape};
use crate::document::Fault;
use crate::effect::sampled::Sampled;
use crate::scalar::Nominal;

/// A nonparametric curve (spline): cubic B-splines on equal knots from `from` to `to`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// Start of the curve.
    pub from: f64,
    /// End of the curve.
    pub to: f64,
    /// Number of intervals.
    pub intervals: usize,
    /// Whether the curve is periodic.
    pub closed: bool,
}

/// Number of intervals if a session states none.
const DEFAULT_INTERVALS: usize = 12;
/// Highest number of intervals.
const MAX_INTERVALS: usize = 500;
/// Highest number of intervals in the library for poses.
const MAX_INTERVALS_OF_POSES: usize = 16;

const INTERVALS: Key =
    Key { name: "intervals", form: KeyForm::Count(1, MAX_INTERVALS), meaning: "intervals of a curve" };
const CLOSED: Key = Key { name: "closed", form: KeyForm::Flag, meaning: "whether a curve is periodic" };
const FROM: Key = Key { name: "from", form: KeyForm::Quantity, meaning: "start of a curve" };
const TO: Key = Key { name: "to", form: KeyForm::Quantity, meaning: "end of a curve" };

pub(super) const ENTRY: Entry =
    Entry { word: "curve", keys: &[INTERVALS, CLOSED, FROM, TO], follows: Follows::Anything, read, members };

/// Reads a curve. By default it covers the full revolution of a rotary axis and is closed; for other drivers its ends
/// are required.
fn read(keys: &KeyReader<'_>) -> Result<Shape, Fault> {
    let rotary = keys.unit().is_angle();
    let stated = keys.flag("closed")?;
    let mut closed = stated.unwrap_or(rotary);
    let (from, to) = if rotary {
        let from = keys.quantity(&FROM)?;
        let to = keys.quantity(&TO)?;
        // A curve with stated ends is open unless it is declared closed.
        closed &= stated.is_some() || (from.is_none() && to.is_none());
        let from = from.unwrap_or(0.0);
        (from, to.unwrap_or(from + TAU))
    } else {
        (keys.required_quantity(&FROM)?, keys.required_quantity(&TO)?)
    };
    let intervals = keys.count("intervals", 1, MAX_INTERVALS)?;
    Ok(Shape::Curve(Curve { from, to, intervals: intervals.unwrap_or(DEFAULT_INTERVALS), closed }))
}

fn members(sampled: &Sampled) -> Vec<(Shape, f64)> {
    let Some([from, high]) = sampled.ends.filter(|_| !sampled.poses || sampled.rotary) else {
        return Vec::new();
    };
    let closed = sampled.is_full_turn();
    let to = if closed { from + TAU } else { high };
    // At least 1.5 readings per interval.
    let observable = |intervals: &usize| {
        sampled.poses && *intervals <= MAX_INTERVALS_OF_POSES
            || sampled.step > 0.0 && 1.5 * sampled.step * *intervals as f64 <= sampled.span()
    };
    let curve = |intervals| Curve { from, to, intervals, closed };
    [8, 16, 32, 64].into_iter().filter(observable).map(|intervals| (Shape::Curve(curve(intervals)), 0.0)).collect()
}

impl ShapeKind for Curve {
    fn write(&self, keys: &mut KeyWriter) {
        keys.quantity(&FROM, self.from);
        keys.quantity(&TO, self.to);
        keys.set("intervals", self.intervals);
        keys.set("closed", self.closed);
    }
    fn check(&self) -> Result<(), String> {
        positive(self.to - self.from, "the length of a curve")?;
        let least = if self.closed { 4 } else { 1 };
        if self.intervals < least || self.intervals > MAX_INTERVALS {
            return Err(format!("a curve has {} intervals; {least} to {MAX_INTERVALS} are allowed", self.intervals));
        }
        Ok(())
    }
    fn describe(&self, words: &EffectWords) -> String {
        format!("{}, a nonparametric curve over {} in {} intervals", words.motion, words.driver, self.intervals)
    }
    fn coefficients(&self) -> usize {
        if self.closed { self.intervals } else { self.intervals + 3 }
    }
    fn varies_within(&self) -> Option<[f64; 2]> {
        let margin = 0.1 * (self.to - self.from);
        Some([self.from - margin, self.to + margin])
    }
    fn curve_ends(&self) -> Option<[f64; 2]> {
        Some([self.from, self.to])
    }
}

impl Basis for Curve {
    /// Uniform cubic B-splines (de Boor, A Practical Guide to Splines, ch. IX): four of them are nonzero at any
    /// position.
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let Curve { intervals, closed, .. } = *self;
        let constant = N::constant;
        let start = basis.len();
        basis.resize(start + self.coefficients(), constant(0.0));
        let mut along = (sample.value - constant(self.from)) / constant(self.to - self.from);
        along = if closed { along - along.floor() } else { along.at_least(0.0).at_most(1.0) };
        let position = along * constant(intervals as f64);
        let interval = position.floor().at_most((intervals - 1) as f64);
        let four = pieces(position - interval);
        let mut add = |interval: usize, value: &dyn Fn(N) -> N| {
            for (k, piece) in four.into_iter().enumerate() {
                let index = if closed { (interval + k) % intervals } else { interval + k };
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
