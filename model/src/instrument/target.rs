//! Points of an instrument: each is fixed on a body of the machine.

use super::point;
use crate::chain::{AxisPosition, BodyErrors, Frame, Machine, MachineState};
use crate::document::Fault;
use crate::document::node::Node;
use crate::frames::Point;
use crate::scalar::{Nominal, Scalar};
use crate::words::listed;

/// A point that is fixed on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target<N> {
    /// The frame of the body.
    pub frame: Frame,
    /// Coordinates in that frame, mm.
    pub mm: [N; 3],
}

impl<N> Target<N> {
    /// A point of the table frame.
    pub const fn on_table(mm: [N; 3]) -> Target<N> {
        Target { frame: Frame::Table, mm }
    }

    /// A point of the tool frame.
    pub const fn on_tool(mm: [N; 3]) -> Target<N> {
        Target { frame: Frame::Tool, mm }
    }

    /// Converts every coordinate.
    pub(super) fn map<M>(&self, to: &impl Fn(&N) -> M) -> Target<M> {
        Target { frame: self.frame, mm: point(&self.mm, to) }
    }
}

impl<N: Nominal> Target<N> {
    /// In its frame, displaced by three parameters from the first on, if they are included.
    #[inline]
    pub fn displaced<S: Scalar<Nominal = N>>(&self, first: usize, unknown: &impl Fn(usize) -> Option<S>) -> Point<S> {
        let coordinate = |i: usize| match unknown(first + i) {
            Some(displacement) => displacement + self.mm[i],
            None => S::nominal(self.mm[i]),
        };
        Point([coordinate(0), coordinate(1), coordinate(2)])
    }

    /// In R, displaced as by [`Target::displaced`].
    #[inline]
    pub fn in_r<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        first: usize,
        unknown: &impl Fn(usize) -> Option<S>,
    ) -> Point<S> {
        at.in_r(self.frame, self.displaced(first, unknown))
    }

    /// In R, of the commanded machine.
    pub fn nominal_in_r<S: Scalar<Nominal = N>>(&self, machine: &Machine, state: &[AxisPosition<N>]) -> Point<S> {
        let none = vec![BodyErrors::<S>::NONE; machine.axes.len()];
        machine.in_r(self.frame, state, &none, Point::nominal(self.mm))
    }
}

impl<N> Target<N> {
    /// The body on which it is mounted, after the name of an object: ` on axis A`. Nothing on the table and on the tool.
    pub fn mounted(&self, machine: &Machine) -> String {
        match self.frame {
            Frame::Table | Frame::Tool => String::new(),
            Frame::Bed => " on the bed".to_string(),
            Frame::Axis(_) => format!(" on {}", self.frame.word(machine)),
        }
    }
}

impl Target<f64> {
    /// In R, of the commanded machine, mm.
    pub fn nominal_mm(&self, machine: &Machine, state: &[AxisPosition<f64>]) -> [f64; 3] {
        self.nominal_in_r::<f64>(machine, state).0
    }
}

/// The frame of a word.
pub(super) fn frame(node: &Node, machine: &Machine) -> Result<Frame, Fault> {
    let axes = (0..machine.axes.len()).map(Frame::Axis);
    let mut frames = [Frame::Table, Frame::Tool, Frame::Bed].into_iter().chain(axes);
    frames.clone().find(|frame| node.as_text() == Some(&frame.word(machine))).ok_or_else(|| {
        let known: Vec<String> = frames.by_ref().map(|frame| format!("\"{}\"", frame.word(machine))).collect();
        Fault::of_key(format!("is {}, which is no body of the machine", node.found()), listed(&known, "or"))
    })
}
