//! Linear axes that stand where a held rotary axis puts the ball.
//!
//! A test of C at A = 45° states `y_mm = "-sqrt(2)/2*(H - Z_CA)"`. With A as a symbol that position is
//! `−sin A·(H − Z_CA)`: only then do the terms of the nominal geometry cancel. A number is a multiple of the sine or the
//! cosine of the held axis if the test reads the same at every other angle of that axis.

use abbe_model::chain::{AxisPosition, BodyErrors, Machine};
use abbe_model::scalar::Nominal;
use abbe_model::session::Test;
use abbe_model::session::expression::Length;
use num_traits::ToPrimitive;

use crate::constant::{ROUNDING, rational};
use crate::subject::Subject;

/// Largest number of numbers in the positions of one test.
const MOST_NUMBERS: usize = 5;
/// Changes of the held axis at which the reading is compared, rad.
const CHANGES_RAD: [f64; 2] = [0.2, -0.35];
/// Places between the ends of the motion at which the reading is compared.
const PLACES: [f64; 3] = [0.0, 0.37, 1.0];
/// Largest change of a reading, relative to it.
const CHANGE: f64 = 1e-9;

/// The words before the name of an axis in the place of the name of a constant.
const TURNS: [&str; 2] = ["sin", "cos"];

/// The value of a position; `position` gives that of an axis that stays a symbol.
pub(crate) fn evaluate<N: Nominal>(written: &Length, length: &impl Fn(&str) -> N, position: &impl Fn(&str) -> N) -> N {
    written.evaluate(&|name: &str| match name.split_once(' ') {
        Some(("sin", axis)) => position(axis).sin_cos().0,
        Some((_, axis)) => position(axis).sin_cos().1,
        None => length(name),
    })
}

/// The geometry of a test, in which some axes follow.
pub(crate) struct Following<'t> {
    pub(crate) machine: &'t Machine,
    pub(crate) test: &'t Test,
    /// Least and greatest position of each axis; `None` for an unknown range.
    pub(crate) ranges: &'t [Option<[f64; 2]>],
    /// The value of a named length, mm.
    pub(crate) length_mm: &'t dyn Fn(&str) -> f64,
}

impl Following<'_> {
    /// The positions as written, with sines and cosines of the held axis `rotary` in them. Unchanged if the test reads
    /// the same wherever that axis stands, or if no such positions make it so.
    pub(crate) fn positions(&self, rotary: usize, written: &[Option<Length>]) -> Vec<Option<Length>> {
        let unchanged = written.to_vec();
        let Some(Some([angle, _])) = self.ranges.get(rotary) else {
            return unchanged;
        };
        let (sin, cos) = angle.sin_cos();
        let axis = &self.machine.axes[rotary].name;
        let candidates = |value: f64| -> Vec<Length> {
            let turns = TURNS.into_iter().zip([sin, cos]);
            turns.filter_map(|(word, turn)| Some(multiple(value, turn)?.of(format!("{word} {axis}")))).collect()
        };
        let mut numbers: Vec<Vec<Length>> = Vec::new();
        for written in written.iter().flatten() {
            replaced(written, &mut |value| {
                numbers.push(candidates(value));
                None
            });
        }
        if numbers.len() > MOST_NUMBERS {
            return unchanged;
        }
        // Every choice, those with the fewest changes first.
        let mut choices: Vec<Vec<usize>> = vec![Vec::new()];
        for number in &numbers {
            choices = choices
                .iter()
                .flat_map(|choice| (0..=number.len()).map(|own| choice.iter().copied().chain([own]).collect()))
                .collect();
        }
        choices.sort_by_key(|choice: &Vec<usize>| choice.iter().filter(|own| **own > 0).count());
        let chosen = choices.into_iter().map(|choice| {
            let mut next = 0;
            let of = |written: &Option<Length>| {
                let written = written.as_ref()?;
                Some(replaced(written, &mut |_| {
                    next += 1;
                    choice[next - 1].checked_sub(1).map(|own| numbers[next - 1][own].clone())
                }))
            };
            written.iter().map(of).collect::<Vec<_>>()
        });
        chosen.into_iter().find(|written| self.reads_the_same(rotary, *angle, written)).unwrap_or(unchanged)
    }

    /// Whether the reading without errors does not depend on the angle of the held axis.
    fn reads_the_same(&self, rotary: usize, angle: f64, written: &[Option<Length>]) -> bool {
        let same = |place: &f64| {
            let stated = self.reading(rotary, angle, *place, written);
            CHANGES_RAD.iter().all(|change| {
                let other = self.reading(rotary, angle + change, *place, written);
                stated.iter().zip(other).all(|(a, b)| (a - b).abs() <= CHANGE * a.abs().max(1.0))
            })
        };
        PLACES.iter().all(same)
    }

    fn reading(&self, rotary: usize, angle: f64, place: f64, written: &[Option<Length>]) -> Vec<f64> {
        let length = |name: &str| (self.length_mm)(name);
        let turned = |name: &str| match self.machine.axis_index(name) {
            Some(index) if index != rotary => self.ranges.get(index).copied().flatten().map_or(f64::NAN, |[at, _]| at),
            _ => angle,
        };
        let position = |index: usize| match (self.ranges.get(index).copied().flatten(), &written[index]) {
            _ if index == rotary => angle,
            (Some([low, high]), _) if high > low => low + place * (high - low),
            (Some(_), Some(written)) => evaluate(written, &length, &turned),
            (Some([at, _]), None) => at,
            (None, _) => place,
        };
        let axes = self.machine.axes.iter().enumerate();
        let state: Vec<AxisPosition<f64>> =
            axes.map(|(index, axis)| AxisPosition::new(axis.kind, position(index))).collect();
        let errors = vec![BodyErrors::<f64>::NONE; state.len()];
        Subject::Station(self.test.station.clone()).read::<f64>(self.machine, &state, &errors, |_| None)
    }
}

/// A number times the sine or cosine of an axis.
struct Multiple(f64);

impl Multiple {
    fn of(&self, turn: String) -> Length {
        let turn = Length::Constant(turn);
        match self.0 {
            1.0 => turn,
            -1.0 => Length::Negative(Box::new(turn)),
            factor => Length::Product(Box::new(Length::Number(factor)), Box::new(turn)),
        }
    }
}

/// The factor of a sine or cosine, if it is a simple number.
fn multiple(value: f64, turn: f64) -> Option<Multiple> {
    rational(value / turn, 2.0 * ROUNDING).and_then(|factor| factor.to_f64()).map(Multiple)
}

/// The expression with each of its largest parts without names replaced, if `by` gives something else for its value.
fn replaced(length: &Length, by: &mut impl FnMut(f64) -> Option<Length>) -> Length {
    if is_number(length) {
        let value = length.evaluate(&|_: &str| f64::NAN);
        return if value == 0.0 { length.clone() } else { by(value).unwrap_or_else(|| length.clone()) };
    }
    let mut of = |inner: &Length| Box::new(replaced(inner, by));
    match length {
        Length::Number(_) | Length::Constant(_) => length.clone(),
        Length::Negative(a) => Length::Negative(of(a)),
        Length::Sum(a, b) => Length::Sum(of(a), of(b)),
        Length::Difference(a, b) => Length::Difference(of(a), of(b)),
        Length::Product(a, b) => Length::Product(of(a), of(b)),
        Length::Quotient(a, b) => Length::Quotient(of(a), of(b)),
        Length::Root(a) => Length::Root(of(a)),
    }
}

fn is_number(length: &Length) -> bool {
    match length {
        Length::Number(_) => true,
        Length::Constant(_) => false,
        Length::Negative(a) | Length::Root(a) => is_number(a),
        Length::Sum(a, b) | Length::Difference(a, b) | Length::Product(a, b) | Length::Quotient(a, b) => {
            is_number(a) && is_number(b)
        }
    }
}
