//! Effects: `component × driver × shape`.
//!
//! A *component* is the error or set-up quantity that changes (an error of an axis, a ball, the bar). A *driver* is the
//! independent variable (an axis position, its direction, time, temperature, the gravity moment): see
//! [`crate::driver`]. A *shape* is the functional form: see [`shape`]. The chain depends on components only, so the
//! Jacobian column of an effect is the sensitivity to its component times the shape's basis function:
//! `∂L/∂k = (∂L/∂component) · b_k(driver)`. A PIGE is `component × constant`.

mod component;
pub mod description;
pub mod keys;
mod part;
pub mod prior;
pub mod sampled;
pub mod shape;

pub use component::Component;
pub use part::EffectPart;
pub use prior::CoefficientPrior;
pub use shape::Shape;

use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::driver::{Driver, DriverSample, DriverUnit};
use crate::parameter_id::EffectId;

/// An effect: component × driver × shape.
///
/// ```
/// use abbe_model::driver::{Driver, DriverSample};
/// use abbe_model::effect::shape::Harmonic;
/// use abbe_model::effect::{Component, Effect, Shape};
///
/// let component = Component::parse("EZC").unwrap();
/// let effect = Effect::new(component, Driver::parse("C"), Shape::Harmonic(Harmonic { order: 2.0 }));
/// assert_eq!(effect.id(), "EZC~C:h2");
/// // Cosine and sine of 2 C, at C = 30°.
/// let at = DriverSample { value: 30_f64.to_radians(), ..DriverSample::default() };
/// let mut basis = Vec::new();
/// effect.shape.basis(&at, &mut basis);
/// assert!((basis[0] - 0.5).abs() < 1e-15 && (basis[1] - 0.75_f64.sqrt()).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// The component.
    pub component: Component,
    /// The driver.
    pub driver: Driver,
    /// The shape.
    pub shape: Shape,
    /// The tests in which the effect acts; empty for all.
    pub tests: Vec<String>,
    /// The prior of its coefficients.
    pub prior: CoefficientPrior,
    /// The effects that explain the readings equally well in its place, the most probable first. Uncertainties cover
    /// what each would change. An alias has no aliases of its own.
    pub aliases: Vec<Effect>,
    /// The numbers of the shape that a fit estimates from the values of the shape, by index among
    /// [`ShapeKind::number_names`](shape::ShapeKind::number_names).
    pub estimated: Vec<usize>,
    /// Whether a fit estimates the positions of the shape ([`ShapeKind::positions`](shape::ShapeKind::positions)).
    pub positions_estimated: bool,
    /// Whether the effect is taken for the explanation on the user's word, so that uncertainties do not cover its
    /// aliases.
    pub assumed: bool,
}

/// Step of a difference quotient in a number of a shape, as a share of the interval in which it is tuned.
const NUMBER_STEP: f64 = 1e-4;

impl Effect {
    /// An effect in all tests, with the prior of its shape.
    pub fn new(component: Component, driver: Driver, shape: Shape) -> Effect {
        let prior = CoefficientPrior::default_of(&shape);
        Effect {
            component,
            driver,
            shape,
            tests: Vec::new(),
            prior,
            aliases: Vec::new(),
            estimated: Vec::new(),
            positions_estimated: false,
            assumed: false,
        }
    }

    /// The effect without its aliases, with all numbers of its shape as they are.
    pub fn alone(&self) -> Effect {
        let (aliases, estimated) = (Vec::new(), Vec::new());
        Effect { aliases, estimated, positions_estimated: false, assumed: false, ..self.clone() }
    }

    /// The effect with all numbers and positions of its shape that can be estimated declared so.
    #[must_use]
    pub fn with_estimated_numbers(self) -> Effect {
        let estimated = (0..self.shape.number_names().len()).collect();
        Effect { estimated, positions_estimated: !self.shape.positions().is_empty(), ..self }
    }

    /// Whether another effect is the same, whatever the aliases of both.
    pub fn is_same(&self, other: &Effect) -> bool {
        self.alone() == other.alone()
    }

    /// Whether another effect is the same but for numbers and positions of its shape that are estimated.
    pub fn is_same_but_for_numbers(&self, other: &Effect) -> bool {
        let with_number = |shape: Shape, which: &usize| shape.with_number(*which, other.shape.number(*which));
        let mut shape = self.estimated.iter().fold(self.shape.clone(), with_number);
        let estimated = |effect: &Effect| (effect.estimated.clone(), effect.positions_estimated);
        if self.positions_estimated && shape.positions().len() == other.shape.positions().len() {
            shape = shape.with_positions(other.shape.positions().to_vec());
        }
        estimated(self) == estimated(other) && Effect { shape, ..self.alone() } == other.alone()
    }

    /// The aliases that uncertainties cover: none if the effect is assumed.
    pub fn covered_aliases(&self) -> &[Effect] {
        if self.assumed { &[] } else { &self.aliases }
    }

    /// The basis functions of its coefficients at a reading, and behind them the derivatives of the effect with these
    /// coefficients by its estimated numbers.
    pub fn basis_with_numbers(&self, sample: &DriverSample<f64>, coefficients: &[f64], basis: &mut Vec<f64>) {
        self.shape.basis(sample, basis);
        for which in &self.estimated {
            let (ends, step) = self.around_number(*which);
            let [less, more] = ends.map(|effect| {
                let mut own = Vec::with_capacity(coefficients.len());
                effect.shape.basis(sample, &mut own);
                own.iter().zip(coefficients).map(|(b, c)| b * c).sum::<f64>()
            });
            basis.push((more - less) / step);
        }
    }

    /// How far an estimated number is uncertain at most, internal unit of the driver: the interval in which a search tunes
    /// it. It serves as a weak prior, so that a number that the readings do not determine leaves the rest determined.
    pub fn width_of_number(&self, which: usize) -> f64 {
        let spacing = 0.5 * self.shape.number(which).abs();
        self.shape.brackets(spacing).get(which).map_or(f64::NAN, |[low, high]| high - low)
    }

    /// The effect with one of its numbers a little smaller and a little larger, and the difference of the two numbers.
    pub fn around_number(&self, which: usize) -> ([Effect; 2], f64) {
        let (number, step) = (self.shape.number(which), NUMBER_STEP * self.width_of_number(which));
        let at = |number: f64| Effect { shape: self.shape.with_number(which, number), ..self.clone() };
        ([at(number - step), at(number + step)], 2.0 * step)
    }

    /// The family whose prior standard deviation is estimated from the readings: the one that it names, or its own
    /// identifier. `None` if there is no prior or its standard deviation is stated.
    pub fn family(&self) -> Option<String> {
        match &self.prior {
            CoefficientPrior::Family(name) if name.is_empty() => Some(self.id()),
            CoefficientPrior::Family(name) => Some(name.clone()),
            CoefficientPrior::Flat | CoefficientPrior::Scale(_) => None,
        }
    }

    /// Whether the effect acts in a test of this name.
    pub fn acts_in(&self, test: &str) -> bool {
        self.tests.is_empty() || self.tests.iter().any(|name| name == test)
    }

    /// The kind of the axis that the driver is about: the one that it names, or else that of the component.
    pub fn driver_axis_kind(&self, machine: &Machine) -> Option<AxisKind> {
        self.driver.kind_of_axis(machine, self.component.axis(machine))
    }

    /// The unit of the driver's numbers.
    pub fn driver_unit(&self, machine: &Machine) -> DriverUnit {
        self.driver.kind().unit(self.driver_axis_kind(machine))
    }

    /// The identifier used in results: `EZC~C:h2` (component, driver, shape).
    pub fn id(&self) -> String {
        EffectId::of(self, 1).to_string()
    }
}
