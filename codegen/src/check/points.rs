//! Points to compare at: numbers that look random and are the same every time.

use crate::equation::Equation;
use crate::program::{Input, Program};
use crate::subject::Source;
use crate::variable::Variable;

/// Numbers that look random and are the same every time (SplitMix64).
pub(crate) struct Draws(u64);

impl Draws {
    pub(crate) fn new(seed: u64) -> Self {
        Draws(seed)
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

/// A length that nobody states, mm.
const UNSTATED_MM: f64 = 100.0;

/// Values of lengths and positions, and of the parameters.
pub(crate) struct Point {
    pub(crate) nominal: Vec<(Variable, f64)>,
    pub(crate) small: Vec<f64>,
}

impl Point {
    pub(crate) fn nominal(&self, variable: &Variable) -> f64 {
        let found = self.nominal.iter().find(|(known, _)| known == variable);
        found.map_or(f64::NAN, |(_, value)| *value)
    }

    pub(crate) fn inputs(&self, program: &Program, parameters: &[Variable]) -> Vec<f64> {
        let value = |variable: &Variable| {
            let place = parameters.iter().position(|parameter| parameter == variable);
            place.map_or_else(|| self.nominal(variable), |place| self.small[place])
        };
        let input = |input: &Input| match input {
            Input::Plain(variable) => value(variable),
            Input::Sine(variable) => value(variable).sin(),
            Input::Cosine(variable) => value(variable).cos(),
        };
        program.inputs.iter().map(input).collect()
    }
}

impl Equation {
    /// The variables that no derivative is taken by, anywhere: lengths near what the source states, positions over every one there is.
    pub(crate) fn draw_anywhere(&self, source: &impl Source, draws: &mut Draws) -> Vec<(Variable, f64)> {
        let draw = |variable: Variable| {
            let value = match &variable {
                Variable::Length(name) => match source.length_mm(name) {
                    Some(value) => value * (1.0 + draws.between(-0.01, 0.01)),
                    None => UNSTATED_MM * (1.0 + draws.between(-0.5, 0.5)),
                },
                position => {
                    let [low, high] = whole_range(position);
                    draws.between(low, high)
                }
            };
            (variable, value)
        };
        let nominal = self.arena.variables().into_iter().filter(|v| !v.is_small());
        nominal.map(draw).collect()
    }

    /// The same over the session's range: lengths as stated, positions of axes between the ends of their movement (as the source or else
    /// the machine states it), mm or rad.
    pub(crate) fn range(&self, source: &impl Source) -> Vec<(Variable, [f64; 2])> {
        let range = |variable: Variable| {
            let ends = match &variable {
                Variable::Length(name) => [source.length_mm(name).unwrap_or(UNSTATED_MM); 2],
                Variable::Position { axis, .. } => {
                    let index = self.machine.axis_index(axis);
                    let travel = index.and_then(|index| self.machine.axes[index].travel);
                    let stated = source.range(axis).or(travel);
                    stated.unwrap_or_else(|| whole_range(&variable))
                }
                Variable::Error(_) | Variable::Unknown(_) => [0.0; 2],
            };
            (variable, ends)
        };
        let nominal = self.arena.variables().into_iter().filter(|v| !v.is_small());
        nominal.map(range).collect()
    }
}

/// Of a position whose range nobody states, mm or rad.
fn whole_range(position: &Variable) -> [f64; 2] {
    if position.is_angle() {
        [-std::f64::consts::PI, std::f64::consts::PI]
    } else {
        [-200.0, 200.0]
    }
}
