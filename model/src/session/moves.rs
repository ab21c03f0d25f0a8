//! Moves of a program beside the states of a test, for checks of clearance.

/// What is between the balls of a ball bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mounted {
    /// The bar.
    Bar,
    /// Nothing.
    Nothing,
    /// The cup of the spindle holds the workpiece ball, or is about to: the two holders meet.
    BallInCup,
}

/// Moves that follow each other: the axes go straight from state to state.
#[derive(Clone, Debug, PartialEq)]
pub struct Moves {
    /// The test.
    pub test: String,
    /// What the moves are for: `approach`, `centring`, `feed-in`, `overshoot`, `retreat`.
    pub stage: &'static str,
    /// Positions of all axes, mm or rad.
    pub states: Vec<Vec<f64>>,
    /// What is mounted.
    pub mounted: Mounted,
}
