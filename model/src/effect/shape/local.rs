//! `local`: a raised-cosine bump: (1 + cos(π(q − centre)/width))/2 within ±width of the centre, else 0.

use std::f64::consts::{PI, TAU};

use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::words::EffectWords;
use super::{DriverSample, Key, KeyForm, KeyWriter, Shape};
use crate::effect::sampled::Sampled;
use crate::scalar::Nominal;

/// A raised-cosine bump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// The centre.
    pub centre: f64,
    /// The half width.
    pub width: f64,
    /// The period of recurrence: a full revolution of a rotary axis, or `None`.
    pub recurs: Option<f64>,
}

/// Half widths of the library, as shares of the travel. Centres are one width apart.
const WIDTHS: [f64; 3] = [0.02, 0.04, 0.08];

const CENTRE: Key = Key { name: "centre", form: KeyForm::Quantity, meaning: "centre of a local effect" };
const WIDTH: Key = Key { name: "width", form: KeyForm::Quantity, meaning: "half width of a local effect" };
const RECURS: Key = Key {
    name: "recurs",
    form: KeyForm::Flag,
    meaning: "whether a local effect of a rotary axis recurs every revolution",
};

pub(super) const ENTRY: Entry = Entry {
    word: "local",
    keys: &[RECURS, CENTRE, WIDTH],
    follows: Follows::Anything,
    read: |keys| {
        let centre = keys.required_quantity(&CENTRE)?;
        let width = keys.required_quantity(&WIDTH)?;
        let recurs = keys.flag("recurs")?.unwrap_or(true);
        Ok(Shape::Local(Local { centre, width, recurs: (recurs && keys.unit().is_angle()).then_some(TAU) }))
    },
    members,
};

fn members(sampled: &Sampled) -> Vec<(Shape, f64)> {
    let Some([low, _]) = sampled.ends.filter(|_| !sampled.poses) else {
        return Vec::new();
    };
    let recurs = sampled.is_full_turn().then_some(TAU);
    let mut members = Vec::new();
    for share in WIDTHS {
        let width = share * sampled.span();
        let count = (1.0 / share) as usize;
        for k in 0..count {
            let centre = low + sampled.span() * (k as f64 + 0.5) / count as f64;
            let local = Local { centre, width, recurs };
            members.push((Shape::Local(local), 0.0));
        }
    }
    members
}

impl ShapeKind for Local {
    fn write(&self, keys: &mut KeyWriter) {
        keys.quantity(&CENTRE, self.centre);
        keys.quantity(&WIDTH, self.width);
        if self.recurs.is_none() && keys.unit().is_angle() {
            keys.set("recurs", false);
        }
    }
    fn check(&self) -> Result<(), String> {
        if !self.centre.is_finite() {
            return Err(format!("a local feature at {}", self.centre));
        }
        positive(self.width, "the width of a local feature")
    }
    fn describe(&self, words: &EffectWords) -> String {
        let each_turn = if self.recurs.is_some() { " of each turn" } else { "" };
        format!(
            "{}, a local feature at {}{each_turn}{}, {} to either side",
            words.motion,
            words.at_value(self.centre),
            words.of_another_axis,
            words.at_value(self.width)
        )
    }
    fn varies_within(&self) -> Option<[f64; 2]> {
        let margin = 1.2 * self.width;
        Some([self.centre - margin, self.centre + margin])
    }
    fn reported(&self) -> Vec<(&'static str, Vec<f64>)> {
        vec![("centre", vec![self.centre]), ("width", vec![self.width])]
    }
    fn spacing(&self, _: f64) -> f64 {
        self.width
    }
    fn brackets(&self, _: f64) -> Vec<[f64; 2]> {
        vec![[self.centre - self.width, self.centre + self.width], [self.width * 0.5, self.width * 2.0]]
    }
    fn number_names(&self) -> &'static [&'static str] {
        &["centre", "width"]
    }
    fn set_number(&mut self, which: usize, value: f64) {
        match which {
            0 => self.centre = value,
            _ => self.width = value,
        }
    }
}

impl Basis for Local {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let mut from_centre = sample.value - N::constant(self.centre);
        if let Some(period) = self.recurs.map(N::constant) {
            from_centre = from_centre - period * (from_centre / period).round();
        }
        basis.push(bump(from_centre / N::constant(self.width)));
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
