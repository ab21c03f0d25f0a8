//! The quantity that an equation describes: a reading of an instrument, or the error vector of the tool.

use abbe_model::chain::{AxisPosition, BodyErrors, Frame, Machine};
use abbe_model::frames::Point;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::instrument::probe::Probe;
use abbe_model::instrument::{InstrumentParameter, Station};
use abbe_model::scalar::{Nominal, Scalar};

/// The nominal geometry of an equation over any nominal type: symbols give the equation, numbers its check. Implemented
/// by a test of a session and by [`ToolPoint`].
pub trait Source {
    /// The instrument as set up, or the point whose error is computed; `length` gives the value of a named length in
    /// mm.
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N>;

    /// The position at which the test holds an axis, mm or rad; `None` for a moving axis, which stays a symbol. A held
    /// axis may stay one too: [`Source::held_symbol`]. `position` gives the position of such an axis.
    fn held<N: Nominal>(&self, axis: &str, length: &impl Fn(&str) -> N, position: &impl Fn(&str) -> N) -> Option<N> {
        let _ = (axis, length, position);
        None
    }

    /// The position of an axis that the test holds and that stays a symbol all the same, mm or rad.
    fn held_symbol(&self, axis: &str) -> Option<f64> {
        let _ = axis;
        None
    }

    /// The value of a named length, mm, if the session states it; used to evaluate truncation errors.
    fn length_mm(&self, name: &str) -> Option<f64> {
        let _ = name;
        None
    }

    /// The meaning of a named length in words, if the session states it.
    fn meaning(&self, name: &str) -> Option<String> {
        let _ = name;
        None
    }

    /// The name of the test, for the label of its equation.
    fn name(&self) -> Option<&str> {
        None
    }

    /// Least and greatest position of an axis that is a symbol, mm or rad, if the test states it.
    fn range(&self, axis: &str) -> Option<[f64; 2]> {
        let _ = axis;
        None
    }
}

/// The error vector of the tool at the point `X_t`, `Y_t`, `Z_t` of the tool frame; every axis moves.
#[derive(Clone, Copy, Debug)]
pub struct ToolPoint;

impl Source for ToolPoint {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Volumetric { tool: ["X_t", "Y_t", "Z_t"].map(length) }
    }
}

/// The quantity that an equation describes, with its nominal geometry.
#[derive(Clone, Debug)]
pub enum Subject<N> {
    /// A reading of an instrument.
    Station(Station<N>),
    /// The error vector of a point of the tool frame, in the table frame: its position in the chain with errors less
    /// that in the chain without.
    Volumetric {
        /// The point, mm.
        tool: [N; 3],
    },
}

impl<N: Nominal> Subject<N> {
    /// The instrument, if a reading is described.
    pub fn station(&self) -> Option<&Station<N>> {
        match self {
            Subject::Station(station) => Some(station),
            Subject::Volumetric { .. } => None,
        }
    }

    /// The bar, if one is read.
    pub(crate) fn bar(&self) -> Option<&BallBar<N>> {
        self.station()?.bar()
    }

    /// The probe, if one touches.
    pub(crate) fn probe(&self) -> Option<&Probe<N>> {
        self.station()?.probe()
    }

    /// The parameters of the instrument.
    pub fn unknowns(&self) -> &'static [InstrumentParameter] {
        match self {
            Subject::Station(station) => station.kind().unknowns(),
            Subject::Volumetric { .. } => &[],
        }
    }

    /// Computes the coordinates of one reading; `unknown` gives the parameters of the instrument.
    pub fn read<S: Scalar<Nominal = N>>(
        &self,
        machine: &Machine,
        state: &[AxisPosition<N>],
        errors: &[BodyErrors<S>],
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Vec<S> {
        match self {
            Subject::Station(station) => station.read(machine, state, errors, unknown).channels().to_vec(),
            Subject::Volumetric { tool } => {
                let none = vec![BodyErrors::<S>::NONE; machine.axes.len()];
                let seen = |errors: &[BodyErrors<S>]| {
                    let in_r = machine.in_r(Frame::Tool, state, errors, Point::nominal(*tool));
                    machine.in_frame(Frame::Table, state, errors, in_r)
                };
                seen(errors).minus(seen(&none)).0.to_vec()
            }
        }
    }
}
