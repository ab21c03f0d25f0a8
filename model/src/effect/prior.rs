//! Priors of the coefficients of effects: none, or Gaussian with mean zero and one standard deviation.
//!
//! The standard deviation is the value of the component where a basis function is 1. Effects of one *family* share it.
//! It is stated, or estimated from the readings by maximum marginal likelihood (MacKay, Neural Computation 4 (1992)
//! 415; Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, section 5.4).

use super::shape::Shape;

/// The prior of the coefficients of an effect.
#[derive(Clone, Debug, PartialEq)]
pub enum CoefficientPrior {
    /// None: the readings alone determine the coefficients.
    Flat,
    /// Gaussian with mean zero and this standard deviation, in the internal unit of the component: mm or rad.
    Scale(f64),
    /// Gaussian with mean zero. The standard deviation is common to the effects that name this family, and estimated
    /// from the readings. An empty name stands for the effect alone.
    Family(String),
}

impl CoefficientPrior {
    /// The prior of an effect of a shape that states none.
    pub fn default_of(shape: &Shape) -> CoefficientPrior {
        if shape.needs_prior() { CoefficientPrior::Family(String::new()) } else { CoefficientPrior::Flat }
    }
}
