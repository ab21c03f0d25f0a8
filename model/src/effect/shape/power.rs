//! `power`: one power of the driver over a scale: (q/s)ⁿ. Results call it a polynomial.

use super::kind::{Basis, Entry, Follows, Per, ShapeKind};
use super::words::EffectWords;
use super::{DriverSample, KeyWriter, Shape, polynomial};
use crate::scalar::Nominal;

/// The power `degree` alone, over `scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// The power, at least 1.
    pub degree: usize,
    /// The divisor of the driver.
    pub scale: f64,
}

pub(super) const ENTRY: Entry = Entry {
    word: "power",
    keys: &[polynomial::ORDER, polynomial::SCALE],
    follows: Follows::Anything,
    read: |keys| {
        let (degree, scale) = polynomial::read(keys)?;
        Ok(Shape::Power(Power { degree, scale }))
    },
    members: |sampled| {
        let scale = sampled.default_scale;
        let member = |degree: &f64| {
            let shape = Shape::Power(Power { degree: *degree as usize, scale });
            (shape, COST_PER_DEGREE * degree)
        };
        sampled.numbers.iter().map(member).collect()
    },
};

/// Cost of a member per degree.
const COST_PER_DEGREE: f64 = 0.2;

impl ShapeKind for Power {
    fn write(&self, keys: &mut KeyWriter) {
        polynomial::write(self.degree, self.scale, keys);
    }
    fn check(&self) -> Result<(), String> {
        polynomial::check(self.degree, self.scale)
    }
    fn describe(&self, words: &EffectWords) -> String {
        let EffectWords { motion, driver, .. } = words;
        match self.degree {
            1 => words.in_proportion(),
            2 => format!("{motion} with the square of {driver}"),
            3 => format!("{motion} with the cube of {driver}"),
            degree => format!("{motion} with {driver} to the power of {degree}"),
        }
    }
    fn word(&self) -> &'static str {
        "polynomial"
    }
    fn tag(&self) -> String {
        format!("power{}", self.degree)
    }
    fn order(&self) -> Option<f64> {
        Some(self.degree as f64)
    }
    fn per(&self, _: usize) -> Per {
        polynomial::per(self.degree, self.scale, self.degree)
    }
}

impl Basis for Power {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        basis.push((sample.value / N::constant(self.scale)).power(self.degree as i32));
    }
}
