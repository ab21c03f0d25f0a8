//! The kinematic chain of any structural code with ISO 841 letters, axes along R through its origin, and the ball-bar
//! reading on it.

use super::pose::{Axis, Joint};
use nalgebra::Vector3;

/// An axis and its letter.
#[derive(Clone, Debug)]
pub struct Link {
    /// The letter.
    pub letter: char,
    /// Its direction and origin.
    pub axis: Axis,
}

/// The two sides of a machine, each from the bed outwards.
#[derive(Clone, Debug)]
pub struct Chain {
    /// The axes that carry the workpiece ball.
    pub workpiece_side: Vec<Link>,
    /// The axes that carry the spindle ball.
    pub tool_side: Vec<Link>,
}

/// Errors of machine and set-up: location errors `[EX, EY, EZ, EA, EB, EC]` of each axis in mm and rad, both balls and
/// the bar in mm.
#[derive(Clone, Debug, Default)]
pub struct ChainErrors {
    /// By letter; axes that are not listed have no error.
    pub location: Vec<(char, [f64; 6])>,
    /// Offset of the workpiece ball in the table frame.
    pub workpiece_ball: [f64; 3],
    /// Offset of the spindle ball in the tool frame.
    pub spindle_ball: [f64; 3],
    /// True minus stated bar length.
    pub bar: f64,
}

impl Chain {
    /// Builds the chain from a structural code, spaced or compact, with or without brackets.
    pub fn from_code(code: &str) -> Chain {
        let letters: Vec<char> = code.chars().filter(|c| c.is_ascii_alphabetic()).collect();
        let inner = &letters[1..letters.len() - 1];
        let bed = inner.iter().position(|letter| *letter == 'b').unwrap();
        let link = |letter: &char| {
            let (joint, direction) = match letter {
                'X' | 'U' => (Joint::Linear, Vector3::x()),
                'Y' | 'V' => (Joint::Linear, Vector3::y()),
                'Z' | 'W' => (Joint::Linear, Vector3::z()),
                'A' => (Joint::Rotary, Vector3::x()),
                'B' => (Joint::Rotary, Vector3::y()),
                'C' => (Joint::Rotary, Vector3::z()),
                other => panic!("no axis `{other}`"),
            };
            Link { letter: *letter, axis: Axis { joint, direction, origin_mm: Vector3::zeros() } }
        };
        Chain {
            workpiece_side: inner[..bed].iter().rev().map(link).collect(),
            tool_side: inner[bed + 1..].iter().map(link).collect(),
        }
    }

    /// The ball-bar reading, mm, for the stated ball positions and the axes at `position` (mm and rad, by letter).
    pub fn reading_mm(
        &self,
        position: &impl Fn(char) -> f64,
        workpiece_ball_mm: [f64; 3],
        spindle_ball_mm: [f64; 3],
        out: &ChainErrors,
    ) -> f64 {
        let carried = |side: &[Link], stated: [f64; 3], off: [f64; 3]| {
            let ball = Vector3::from(stated) + Vector3::from(off);
            side.iter().rev().fold(ball, |point, link| {
                let location = out.location.iter().find(|(letter, _)| *letter == link.letter);
                let location = location.map_or([0.0; 6], |(_, errors)| *errors);
                link.axis.motion(position(link.letter), &location, &[0.0; 6]).apply(point)
            })
        };
        let workpiece = carried(&self.workpiece_side, workpiece_ball_mm, out.workpiece_ball);
        let spindle = carried(&self.tool_side, spindle_ball_mm, out.spindle_ball);
        (workpiece - spindle).norm() - out.bar
    }
}
