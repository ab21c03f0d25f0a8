//! What an equation is of: a reading of an instrument, or the error vector of the tool.

use abbe_model::chain::{AxisPosition, BodyErrors, Machine};
use abbe_model::frames::Point;
use abbe_model::instrument::{InstrumentUnknown, Station};
use abbe_model::scalar::{Nominal, Scalar};

/// The nominal geometry of what is written down, over any nominal type: with symbols it gives the equation, with numbers its
/// check. A session's test is one; so is [`ToolPoint`].
pub trait Source {
    /// The instrument as it is set up, or the point whose error is wanted; `length` gives the value of a named length in mm.
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N>;

    /// Where an axis stands while the test runs, mm or rad; `None` for one that moves and stays a symbol.
    fn held<N: Nominal>(&self, axis: &str, length: &impl Fn(&str) -> N) -> Option<N> {
        let _ = (axis, length);
        None
    }

    /// The value of a named length, mm, where the session states it: what a truncation is judged at.
    fn length_mm(&self, name: &str) -> Option<f64> {
        let _ = name;
        None
    }

    /// Least and greatest position of a moving axis, mm or rad, where the test states it.
    fn range(&self, axis: &str) -> Option<[f64; 2]> {
        let _ = axis;
        None
    }
}

/// The error vector of the tool: at the point of the tool frame with the coordinates `X_t`, `Y_t`, `Z_t`, every axis moving.
#[derive(Clone, Copy, Debug)]
pub struct ToolPoint;

impl Source for ToolPoint {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Volumetric {
            tool: ["X_t", "Y_t", "Z_t"].map(length),
        }
    }
}

/// What is written down, with its nominal geometry.
#[derive(Clone, Debug)]
pub enum Subject<N> {
    /// A reading of an instrument.
    Station(Station<N>),
    /// The error vector of a point of the tool frame, in the table frame: where the chain with errors puts it less where the
    /// chain without puts it.
    Volumetric {
        /// The point, mm.
        tool: [N; 3],
    },
}

impl<N: Nominal> Subject<N> {
    /// The instrument's own unknowns.
    pub fn unknowns(&self) -> &'static [InstrumentUnknown] {
        match self {
            Subject::Station(station) => station.kind().unknowns(),
            Subject::Volumetric { .. } => &[],
        }
    }

    /// The coordinates of one reading. `unknown` gives the instrument's own unknowns.
    pub fn read<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Vec<S> {
        match self {
            Subject::Station(station) => station
                .read(machine, state, errors, unknown)
                .coordinates()
                .to_vec(),
            Subject::Volumetric { tool } => {
                let none = vec![BodyErrors::<S>::NONE; machine.axes.len()];
                let seen = |errors: &[BodyErrors<S>]| {
                    let in_r = machine.tool_point(state, errors, Point::nominal(*tool));
                    machine.table_point(state, errors, in_r)
                };
                seen(errors).minus(seen(&none)).0.to_vec()
            }
        }
    }
}
