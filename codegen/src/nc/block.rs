//! One block of a program, as data.

use super::Plane;

/// Letter and position of axes, mm and degrees.
pub(super) type Positions = [(char, f64)];

/// Whether a letter is that of a rotary axis (ISO 841).
pub(super) fn is_rotary(letter: char) -> bool {
    "ABC".contains(letter)
}

/// Whether a rotary axis moves from a known position.
pub(super) fn turns(from: &Positions, to: &Positions) -> bool {
    to.iter().any(|(letter, q)| is_rotary(*letter) && before(from, *letter).is_some_and(|before| before != *q))
}

/// The position of an axis before a motion, if it is known.
pub(super) fn before(from: &Positions, letter: char) -> Option<f64> {
    from.iter().find(|(own, _)| *own == letter).map(|(_, q)| *q)
}

/// The change of an axis between positions of so many decimals, so that the changes of a program add up to its
/// positions; the position itself if the one before is not known.
pub(super) fn change(from: &Positions, (letter, to): (char, f64), decimals: usize) -> f64 {
    let unit = 10_f64.powi(-(decimals as i32));
    let steps = |q: f64| (q / unit).round();
    before(from, letter).map_or(to, |before| (steps(to) - steps(before)) * unit)
}

/// One block of a program. Positions in mm and degrees.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A remark.
    Comment(String),
    /// The program stops; the operator does what the text says.
    Stop(String),
    /// A pause, s.
    Dwell(f64),
    /// A straight motion of these axes at a feed: mm/min if a linear axis moves, otherwise °/min.
    Line {
        /// Positions before it, of the same axes; empty if they are not known.
        from: Vec<(char, f64)>,
        /// Letter and end position of each axis.
        to: Vec<(char, f64)>,
        /// The feed.
        feed: f64,
    },
    /// A circle of two linear axes.
    Arc {
        /// The plane.
        plane: Plane,
        /// Letter and start position of both axes.
        from: [(char, f64); 2],
        /// Letter and end position of both axes.
        to: [(char, f64); 2],
        /// The centre, mm, in the order of the axes.
        centre_at: [f64; 2],
        /// Counterclockwise in the plane.
        counterclockwise: bool,
        /// The feed, mm/min.
        feed: f64,
    },
    /// Segments of rotary and linear axes together, each with its duration.
    Segments {
        /// Positions before it, of the same axes.
        from: Vec<(char, f64)>,
        /// End positions and duration in s of each segment.
        ends: Vec<(Vec<(char, f64)>, f64)>,
        /// The positions of X, Y, Z are those of the tool point over the table.
        tool_point: bool,
    },
}
