//! `polynomial`: the powers 1 to n of the driver over a scale: (q/s), …, (q/s)ⁿ.

use super::kind::{Basis, Entry, Follows, Per, ShapeKind, positive};
use super::words::EffectWords;
use super::{DriverSample, Key, KeyForm, KeyReader, KeyWriter, Shape};
use crate::document::Fault;
use crate::scalar::Nominal;

/// Powers 1 … `degree` of the driver over `scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polynomial {
    /// Highest power, at least 1.
    pub degree: usize,
    /// The divisor of the driver, which makes coefficients comparable: see [`crate::driver`].
    pub scale: f64,
}

/// Highest degree. Powers of more are collinear to rounding.
const HIGHEST_DEGREE: usize = 30;

pub(super) const SCALE: Key =
    Key { name: "scale", form: KeyForm::Quantity, meaning: "divisor of the driver in a polynomial" };

pub(super) const ORDER: Key = Key { name: "order", form: KeyForm::Positive, meaning: "degree of a polynomial" };

pub(super) const ENTRY: Entry = Entry {
    word: "polynomial",
    keys: &[ORDER, SCALE],
    follows: Follows::Anything,
    read: |keys| {
        let (degree, scale) = read(keys)?;
        Ok(Shape::Polynomial(Polynomial { degree, scale }))
    },
    members: |_| Vec::new(),
};

/// Reads degree and scale.
pub(super) fn read(keys: &KeyReader<'_>) -> Result<(usize, f64), Fault> {
    let degree = keys.required_count("order", "add `order = 1`", 1, HIGHEST_DEGREE)?;
    let scale = keys.quantity(&SCALE)?.unwrap_or(keys.default_scale());
    Ok((degree, scale))
}

/// Writes degree and scale.
pub(super) fn write(degree: usize, scale: f64, keys: &mut KeyWriter) {
    keys.quantity(&SCALE, scale);
    keys.set("order", degree);
}

/// Checks degree and scale.
pub(super) fn check(degree: usize, scale: f64) -> Result<(), String> {
    positive(degree as f64, "the degree of a polynomial")?;
    if degree > HIGHEST_DEGREE {
        return Err(format!("a polynomial of degree {degree} cannot be fitted; the limit is {HIGHEST_DEGREE}"));
    }
    positive(scale, "the scale of a polynomial")
}

/// The dimension of the coefficient of a power of the driver over a scale, in a shape of this degree.
pub(super) fn per(degree: usize, scale: f64, power: usize) -> Per {
    match (degree, scale) {
        (1, scale) => Per::Slope(scale),
        (_, 1.0) => Per::Power(power),
        _ => Per::One,
    }
}

impl ShapeKind for Polynomial {
    fn write(&self, keys: &mut KeyWriter) {
        write(self.degree, self.scale, keys);
    }
    fn check(&self) -> Result<(), String> {
        check(self.degree, self.scale)
    }
    fn describe(&self, words: &EffectWords) -> String {
        match self.degree {
            1 => words.in_proportion(),
            degree => format!("{}, a polynomial of degree {degree} in {}", words.motion, words.driver),
        }
    }
    /// A polynomial of degree 1 is the power 1, and has its name.
    fn tag(&self) -> String {
        if self.degree == 1 { "power1".into() } else { format!("p{}", self.degree) }
    }
    fn order(&self) -> Option<f64> {
        Some(self.degree as f64)
    }
    fn coefficients(&self) -> usize {
        self.degree
    }
    fn per(&self, k: usize) -> Per {
        per(self.degree, self.scale, k + 1)
    }
}

impl Basis for Polynomial {
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        let mut power = N::constant(1.0);
        for _ in 0..self.degree {
            power = power * (sample.value / N::constant(self.scale));
            basis.push(power);
        }
    }
}
