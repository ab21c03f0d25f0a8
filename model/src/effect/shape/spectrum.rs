//! `spectrum`: all orders 1 to n of a period at once: cos 2πkq/p and sin 2πkq/p for k = 1 … n.
//!
//! The coefficients have a Gaussian prior ([`crate::effect::prior`]). Without one, many orders over part of a period are
//! nearly collinear, and their sum is not determined where the axis was not read. With it the sum is a Gaussian process
//! with the covariance function `s² Σ_k cos 2πk(q − q′)/p`.

use std::f64::consts::TAU;

use super::kind::{Basis, Entry, Follows, ShapeKind, positive};
use super::words::EffectWords;
use super::{DriverSample, Key, KeyForm, KeyReader, KeyWriter, Shape};
use crate::document::Fault;
use crate::scalar::Nominal;

/// Cosines and sines of the orders 1 … `orders` of a period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum {
    /// Highest order, at least 1.
    pub orders: usize,
    /// The period of order 1, in the driver's internal unit: one turn of a rotary axis.
    pub period: f64,
}

/// Highest order.
const HIGHEST_ORDER: usize = 240;

const ORDERS: Key =
    Key { name: "orders", form: KeyForm::Count(1, HIGHEST_ORDER), meaning: "highest order of a spectrum" };

pub(super) const ENTRY: Entry = Entry {
    word: "spectrum",
    keys: &[ORDERS, super::periodic::PERIOD],
    follows: Follows::Axis,
    read,
    members: |_| Vec::new(),
};

/// Reads a spectrum. By default the period is one turn of a rotary axis. That of a linear axis is required: twice the
/// travelled range represents any curve over the range.
fn read(keys: &KeyReader<'_>) -> Result<Shape, Fault> {
    let orders = keys.required_count("orders", "add `orders = 40`", 1, HIGHEST_ORDER)?;
    let period = if keys.unit().is_angle() {
        keys.quantity(&super::periodic::PERIOD)?.unwrap_or(TAU)
    } else {
        keys.required_quantity(&super::periodic::PERIOD)?
    };
    Ok(Shape::Spectrum(Spectrum { orders, period }))
}

impl Spectrum {
    /// The orders 1 … `orders` of one turn of a rotary axis.
    pub fn of_turn(orders: usize) -> Spectrum {
        Spectrum { orders, period: TAU }
    }
}

impl ShapeKind for Spectrum {
    fn write(&self, keys: &mut KeyWriter) {
        keys.set("orders", self.orders);
        if self.period != TAU || !keys.unit().is_angle() {
            keys.quantity(&super::periodic::PERIOD, self.period);
        }
    }
    fn check(&self) -> Result<(), String> {
        positive(self.period, "a period")?;
        if self.orders == 0 || self.orders > HIGHEST_ORDER {
            return Err(format!("a spectrum has {} orders; 1 to {HIGHEST_ORDER} are allowed", self.orders));
        }
        Ok(())
    }
    fn describe(&self, words: &EffectWords) -> String {
        let period = if self.period == TAU && words.unit.is_angle() {
            "one turn".to_string()
        } else {
            words.at_value(self.period)
        };
        format!("{}, a curve of orders 1 to {} of {period}{}", words.motion, self.orders, words.of_another_axis)
    }
    fn coefficients(&self) -> usize {
        2 * self.orders
    }
    fn coefficient_names(&self) -> Vec<String> {
        (1..=self.orders).flat_map(|k| [format!("cos{k}"), format!("sin{k}")]).collect()
    }
    fn reported(&self) -> Vec<(&'static str, Vec<f64>)> {
        vec![("period", vec![self.period])]
    }
    fn order(&self) -> Option<f64> {
        Some(self.orders as f64)
    }
    fn needs_prior(&self) -> bool {
        true
    }
}

impl Basis for Spectrum {
    /// The recurrence `cos (k+1)x = cos kx cos x − sin kx sin x` is not used: symbols keep one function for each order.
    fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
        for k in 1..=self.orders {
            // Whole orders of one turn need no quotient, so that printed equations contain cos kq.
            let angle = if self.period == TAU {
                N::constant(k as f64) * sample.value
            } else {
                N::constant(k as f64 * TAU) * sample.value / N::constant(self.period)
            };
            let (sin, cos) = angle.sin_cos();
            basis.extend([cos, sin]);
        }
    }
}
