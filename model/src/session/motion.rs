//! How the axes move in a planned test.

/// The movement of a planned test, positions in mm and rad.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// One axis sweeps, the others stand.
    Sweep {
        /// Index of the axis in the machine.
        axis: usize,
        /// Where it starts.
        from: f64,
        /// Where it ends.
        to: f64,
        /// The step between readings.
        step: f64,
        /// Speed in mm/s or rad/s.
        speed: f64,
        /// How often it goes.
        runs: usize,
        /// Whether each run goes there and back as two traversals.
        both_directions: bool,
    },
    /// Two linear axes move on a circle.
    Circle {
        /// The first axis of the plane, by index.
        first: usize,
        /// The second.
        second: usize,
        /// mm.
        radius: f64,
        /// Centre in R, mm.
        centre: [f64; 3],
        /// rad.
        from: f64,
        /// rad.
        to: f64,
        /// rad.
        step: f64,
        /// Path speed, mm/s.
        speed: f64,
        /// How often it goes.
        runs: usize,
        /// Whether each run goes there and back as two traversals.
        both_directions: bool,
    },
    /// A rotary axis turns and the linear axes keep the spindle ball at a constant offset from the workpiece ball.
    Follow {
        /// The rotary axis, by index.
        axis: usize,
        /// rad.
        from: f64,
        /// rad.
        to: f64,
        /// rad.
        step: f64,
        /// rad/s.
        speed: f64,
        /// How often it goes.
        runs: usize,
        /// Whether each run goes there and back as two traversals.
        both_directions: bool,
        /// Direction of the bar.
        offset: FollowOffset,
    },
    /// The states come from the data file.
    List,
}

/// Direction of the bar while linear axes follow a rotary axis (ISO 10791-6, BK1 and BK2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FollowOffset {
    /// Away from the axis.
    Radial,
    /// Along the path of the workpiece ball.
    Tangential,
    /// Along the axis.
    Axial,
}
