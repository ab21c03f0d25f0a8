//! The ten structural codes of Table 1.1 of seed 000 (three of them are misprinted with a doubled axis), and a ball bar
//! on each.

use abbe_codegen::{Source, Subject};
use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, Frame, Machine};
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::frames::Point;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::instrument::{Station, Target};
use abbe_model::scalar::Nominal;
use num_dual::{Derivative, DualSVec64};
use rand::RngExt;

/// Table 1.1.
pub const CODES: [&str; 10] = [
    "[wXYbZABt]",
    "[wABXYbZt]",
    "[wXYbZBAt]",
    "[wBAXYbZt]",
    "[wXYbZCAt]",
    "[wCAXYbZt]",
    "[wCXYbZAt]",
    "[wXYbZCBt]",
    "[wCBXYbZt]",
    "[wCXYbZBt]",
];

/// A machine of this code with rotary axes away from R's origin and one axis that counts against R.
pub fn machine(code: &str) -> Machine {
    let mut machine = Machine::from_code(code).expect("a code of the table");
    for (index, axis) in machine.axes.iter_mut().enumerate() {
        if axis.kind == AxisKind::Rotary {
            axis.origin_mm = [12.5, -30.0 + index as f64, 41.25];
        }
    }
    machine.axes[1].direction = machine.axes[1].direction.map(|d| -d);
    machine
}

/// Every error of every axis: twelve of a rotary axis; three squareness errors and six error motions of a linear one.
pub fn all_errors(machine: &Machine) -> Vec<ErrorName> {
    let mut names = Vec::new();
    for axis in &machine.axes {
        for kind in [ErrorKind::Location, ErrorKind::Motion] {
            for freedom in Freedom::ALL {
                let without_effect =
                    axis.kind == AxisKind::Linear && kind == ErrorKind::Location && !freedom.is_angle();
                if !without_effect {
                    names.push(ErrorName { kind, freedom, axis: axis.name.clone() });
                }
            }
        }
    }
    names
}

const LENGTHS: [&str; 6] = ["W_x", "W_y", "W_z", "S_x", "S_y", "S_z"];

/// A bar with both balls at arbitrary positions.
#[derive(Clone, Copy)]
pub struct AnyBar;

impl Source for AnyBar {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Station(Station::BallBar(BallBar {
            workpiece_ball: Target::on_table([length("W_x"), length("W_y"), length("W_z")]),
            spindle_ball: Target::on_tool([length("S_x"), length("S_y"), length("S_z")]),
            bar: N::constant(100.0),
        }))
    }
}

/// A test case: values in the order of the printed arguments, and the expected outputs.
pub struct Case {
    /// Lengths, axes (sine and cosine of a rotary one), errors.
    pub arguments: [Vec<f64>; 3],
    /// Output by output.
    pub values: Vec<f64>,
    /// Output by output, error by error.
    pub gradient: Vec<f64>,
}

type Pack = DualSVec64<8>;

/// The quantity that is read.
#[derive(Clone, Copy, PartialEq)]
pub enum What {
    Bar,
    Volumetric,
}

/// Random states, lengths, and errors of 10 mm and 0.1 rad, with value and gradient by dual numbers.
pub fn cases(
    what: What,
    machine: &Machine,
    errors: &[ErrorName],
    count: usize,
    random: &mut impl rand::Rng,
) -> Vec<Case> {
    (0..count).map(|_| case(what, machine, errors, random)).collect()
}

fn case(what: What, machine: &Machine, errors: &[ErrorName], random: &mut impl rand::Rng) -> Case {
    let lengths: Vec<f64> = match what {
        What::Bar => LENGTHS.map(|_| random.random_range(-200.0..200.0)).to_vec(),
        What::Volumetric => (0..3).map(|_| random.random_range(-200.0..200.0)).collect(),
    };
    let mut axes = Vec::new();
    let mut state = Vec::new();
    for axis in &machine.axes {
        let position: f64 = match axis.kind {
            AxisKind::Linear => random.random_range(-300.0..300.0),
            AxisKind::Rotary => random.random_range(-3.0..3.0),
        };
        state.push(AxisPosition::new(axis.kind, position));
        match axis.kind {
            AxisKind::Linear => axes.push(position),
            AxisKind::Rotary => axes.extend([position.sin(), position.cos()]),
        }
    }
    let small: Vec<f64> = errors
        .iter()
        .map(|name| {
            let size = if name.freedom.is_angle() { 0.1 } else { 10.0 };
            random.random_range(-size..size)
        })
        .collect();
    let index = |slot: usize| errors.iter().position(|name| machine.error_slot(name) == Some(slot));
    let mut values = Vec::new();
    let mut gradient: Vec<Vec<f64>> = Vec::new();
    for start in (0..errors.len()).step_by(8) {
        let seeded = |i: usize| {
            let mut seed = nalgebra::SVector::<f64, 8>::zeros();
            if (start..start + 8).contains(&i) {
                seed[i - start] = 1.0;
            }
            Pack::new(small[i], Derivative::some(seed))
        };
        let bodies = machine
            .body_errors(|slot| index(slot).is_some(), |slot| index(slot).map_or_else(|| Pack::from_re(0.0), seeded));
        let read: Vec<Pack> = match what {
            What::Bar => {
                let l = |i: usize| lengths[i];
                let (workpiece_ball, spindle_ball) =
                    (Target::on_table([l(0), l(1), l(2)]), Target::on_tool([l(3), l(4), l(5)]));
                let bar = BallBar { workpiece_ball, spindle_ball, bar: 100.0 };
                Station::BallBar(bar).read(machine, &state, &bodies, |_| None).channels().to_vec()
            }
            What::Volumetric => {
                let none = machine.body_errors::<Pack>(|_| false, |_| Pack::from_re(0.0));
                let tool = Point::<Pack>::nominal([lengths[0], lengths[1], lengths[2]]);
                let seen = |bodies: &[_]| {
                    machine.in_frame(Frame::Table, &state, bodies, machine.in_r(Frame::Tool, &state, bodies, tool))
                };
                seen(&bodies).minus(seen(&none)).0.to_vec()
            }
        };
        values = read.iter().map(|value| value.re).collect();
        gradient.resize(read.len(), Vec::new());
        for (row, value) in gradient.iter_mut().zip(&read) {
            let slopes = value.eps.unwrap_generic(nalgebra::Const::<8>, nalgebra::Const::<1>);
            let end = errors.len().min(start + 8);
            row.extend((start..end).map(|k| slopes[k - start]));
        }
    }
    Case { arguments: [lengths, axes, small], values, gradient: gradient.concat() }
}

/// Share of the largest entry below which a column is zero but for rounding errors.
const VANISHING: f64 = 1e-15;

/// The largest difference, relative to the largest value of the same quantity over the cases.
pub fn disagreement(cases: &[Case], found: &[Vec<f64>], gradient: bool) -> f64 {
    let expected = |case: &Case| {
        let mut all = case.values.clone();
        if gradient {
            all.extend(&case.gradient);
        }
        all
    };
    let columns = expected(&cases[0]).len();
    assert_eq!(found.len(), cases.len());
    let largest_of = |column: usize| cases.iter().map(|case| expected(case)[column].abs()).fold(0.0, f64::max);
    let largest = (0..columns).map(largest_of).fold(0.0, f64::max);
    let mut worst = 0.0_f64;
    for column in 0..columns {
        // A column that vanishes, as the derivative of a distance along its cylinder, holds rounding errors of terms of
        // the size of the others.
        let scale = match largest_of(column) {
            own if own <= VANISHING * largest => largest,
            own => own.max(1e-3),
        };
        for (case, found) in cases.iter().zip(found) {
            assert_eq!(found.len(), columns);
            let difference = (found[column] - expected(case)[column]).abs() / scale;
            assert!(!difference.is_nan());
            worst = worst.max(difference);
        }
    }
    worst
}

/// A short name for files and modules.
pub fn short(code: &str) -> String {
    code.trim_matches(['[', ']']).to_lowercase()
}
