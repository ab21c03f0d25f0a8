//! A ball in fixed sockets: the tool's ball is at the same point in every pose of one socket.
//!
//! The reading is the closure `P_s − s`, the ball in R less the socket in R; the observed value is zero.

use super::{InstrumentParameter, SharedBy, displaced};
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::frames::Point;
use crate::scalar::Scalar;

/// The socket in R, then the ball in the tool frame.
pub const PARAMETERS: [InstrumentParameter; 6] = [
    InstrumentParameter::length("socket", "x", SharedBy::Socket),
    InstrumentParameter::length("socket", "y", SharedBy::Socket),
    InstrumentParameter::length("socket", "z", SharedBy::Socket),
    InstrumentParameter::length("ball", "x", SharedBy::SpindleSetup),
    InstrumentParameter::length("ball", "y", SharedBy::SpindleSetup),
    InstrumentParameter::length("ball", "z", SharedBy::SpindleSetup),
];

/// A ball and its socket, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Socket<N> {
    /// Centre of the ball in the tool frame.
    pub ball: [N; 3],
    /// Centre of the socket in R.
    pub socket: [N; 3],
}

impl<N: crate::scalar::Nominal> Socket<N> {
    /// The ball in R.
    pub fn ball_point<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: &impl Fn(usize) -> Option<S>,
    ) -> Point<S> {
        machine.tool_point(state, errors, displaced(self.ball, 3, unknown))
    }

    /// The closure: ball less socket, mm.
    pub fn read<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Point<S> {
        let ball = self.ball_point(machine, state, errors, &unknown);
        ball.minus(displaced(self.socket, 0, &unknown))
    }
}
