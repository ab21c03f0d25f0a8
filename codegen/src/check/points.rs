//! Deterministic pseudo-random points at which programs are compared.

use abbe_model::driver::{Driver, DriverPart};
use abbe_model::effect::Effect;

use crate::equation::Equation;
use crate::program::{Input, Program};
use crate::subject::Source;
use crate::variable::Variable;

/// Deterministic pseudo-random numbers (SplitMix64).
pub(crate) struct PseudoRandom(u64);

impl PseudoRandom {
    pub(crate) fn new(seed: u64) -> Self {
        PseudoRandom(seed)
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform between two values.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Value of a length that the source does not state, mm.
const UNSTATED_MM: f64 = 100.0;

/// Values of the lengths, the positions and the parameters.
pub(crate) struct CheckPoint {
    pub(crate) nominal: Vec<(Variable, f64)>,
    pub(crate) small: Vec<f64>,
}

impl CheckPoint {
    pub(crate) fn nominal(&self, variable: &Variable) -> f64 {
        let found = self.nominal.iter().find(|(known, _)| known == variable);
        found.map_or(f64::NAN, |(_, value)| *value)
    }

    pub(crate) fn inputs(&self, program: &Program, parameters: &[Variable]) -> Vec<f64> {
        let value = |variable: &Variable| {
            let index = parameters.iter().position(|parameter| parameter == variable);
            index.map_or_else(|| self.nominal(variable), |index| self.small[index])
        };
        let input = |input: &Input| match input {
            Input::Plain(variable) => value(variable),
            Input::Sine(variable) => value(variable).sin(),
            Input::Cosine(variable) => value(variable).cos(),
        };
        program.inputs.iter().map(input).collect()
    }
}

/// Intervals of a driver in which effects with a local shape are not zero.
fn intervals_of_effects(equation: &Equation, driver: &Variable) -> Vec<[f64; 2]> {
    let (driver, part) = match driver {
        Variable::Driver(quantity) => (quantity.driver.clone(), quantity.part),
        Variable::Position { axis, .. } => (Driver::Axis(axis.clone()), DriverPart::Value),
        _ => return Vec::new(),
    };
    let follows = |effect: &Effect| effect.driver == driver && effect.shape.uses() == part;
    let effects = equation.options.effects.iter();
    effects.filter(|effect| follows(effect)).filter_map(|effect| effect.shape.varies_within()).collect()
}

/// Draws the nominal variables over their whole range: lengths near their stated values, positions over all possible
/// values.
pub(crate) fn draw_anywhere(
    equation: &Equation,
    source: &impl Source,
    draws: &mut PseudoRandom,
) -> Vec<(Variable, f64)> {
    let draw = |variable: Variable| {
        let value = match &variable {
            Variable::Length(name) => match source.length_mm(name) {
                Some(value) => value * (1.0 + draws.between(-0.01, 0.01)),
                None => UNSTATED_MM * (1.0 + draws.between(-0.5, 0.5)),
            },
            Variable::Driver(quantity) if quantity.part == DriverPart::Direction => {
                if draws.bits() & 1 == 0 {
                    -1.0
                } else {
                    1.0
                }
            }
            moving => {
                let places = intervals_of_effects(equation, moving);
                // Half of the points lie where local effects are not zero.
                let anywhere = places.is_empty() || draws.bits() & 1 == 0;
                let [low, high] =
                    if anywhere { whole_range(moving) } else { places[(draws.bits() % places.len() as u64) as usize] };
                draws.between(low, high)
            }
        };
        (variable, value)
    };
    let nominal = equation.arena.variables().into_iter().filter(|v| !v.is_small());
    nominal.map(draw).collect()
}

/// Ranges of the nominal variables in the session: lengths as stated; axis positions between the ends of their motion,
/// as stated by the source or else by the machine; mm or rad.
pub(crate) fn range(equation: &Equation, source: &impl Source) -> Vec<(Variable, [f64; 2])> {
    let range = |variable: Variable| {
        let ends = match &variable {
            Variable::Length(name) => [source.length_mm(name).unwrap_or(UNSTATED_MM); 2],
            Variable::Position { axis, .. } => {
                let index = equation.machine.axis_index(axis);
                let travel = index.and_then(|index| equation.machine.axes[index].travel);
                let stated = source.range(axis).or(travel);
                stated.unwrap_or_else(|| whole_range(&variable))
            }
            Variable::Driver(_) => whole_range(&variable),
            Variable::Error(_) | Variable::Instrument(_) | Variable::Coefficient(_) => [0.0; 2],
        };
        (variable, ends)
    };
    let nominal = equation.arena.variables().into_iter().filter(|v| !v.is_small());
    nominal.map(range).collect()
}

/// Range of a position or another driver whose range is not stated, in its unit.
fn whole_range(moving: &Variable) -> [f64; 2] {
    if let Variable::Driver(quantity) = moving {
        quantity.range
    } else if moving.is_angle() {
        [-std::f64::consts::PI, std::f64::consts::PI]
    } else {
        [-200.0, 200.0]
    }
}

/// The absolute difference; infinite if either value is not a number.
pub(crate) fn worst(found: f64, expected: f64) -> f64 {
    let difference = (found - expected).abs();
    if difference.is_nan() { f64::INFINITY } else { difference }
}
