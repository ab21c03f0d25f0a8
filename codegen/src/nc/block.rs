//! One block of a program, as data.

use super::Plane;

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
        /// Letter and end position of each axis.
        to: Vec<(char, f64)>,
        /// The feed.
        feed: f64,
    },
    /// A circle of two linear axes.
    Arc {
        /// The plane.
        plane: Plane,
        /// Letter and end position of both axes.
        to: [(char, f64); 2],
        /// Centre less start, mm, in the order of the axes.
        centre: [f64; 2],
        /// The centre, mm.
        centre_at: [f64; 2],
        /// Counterclockwise in the plane.
        counterclockwise: bool,
        /// The feed, mm/min.
        feed: f64,
    },
    /// Segments of rotary and linear axes together, each with its duration.
    Segments {
        /// End positions and duration in s of each segment.
        ends: Vec<(Vec<(char, f64)>, f64)>,
        /// The positions of X, Y, Z are those of the tool point over the table.
        tool_point: bool,
    },
}
