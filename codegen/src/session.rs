//! A test of a session as the source of an equation: its geometry as written, and the positions of its axes.

use abbe_model::error::ModelError;
use abbe_model::scalar::Nominal;
use abbe_model::session::expression::Constant;
use abbe_model::session::motion::Motion;
use abbe_model::session::planned;
use abbe_model::session::{Session, Test};

use crate::subject::{Source, Subject};

/// A test of a session. Named lengths and positions of moving axes stay symbols; other axes are at their stated
/// positions.
#[derive(Clone, Debug)]
pub struct SessionTest<'s> {
    session: &'s Session,
    test: &'s Test,
    /// Least and greatest position of each axis of the machine; `None` for an axis that moves over an unknown range.
    ranges: Vec<Option<[f64; 2]>>,
}

impl<'s> SessionTest<'s> {
    /// From a test, with the positions of its readings or, for a plan, of its motion. Without either, every axis moves,
    /// except those that the test holds at a nonzero position.
    ///
    /// # Errors
    /// If a planned motion is impossible.
    pub fn new(session: &'s Session, test: &'s Test) -> Result<Self, ModelError> {
        let range = |column: &Vec<f64>| {
            let least = column.iter().copied().fold(f64::INFINITY, f64::min);
            let greatest = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            Some([least, greatest])
        };
        let ranges = match (&test.readings, &test.motion) {
            (Some(readings), _) => readings.positions.iter().map(range).collect(),
            (None, None | Some(Motion::List)) => {
                let held = test.at_written.iter().zip(&test.at);
                let held = held.map(|(written, at)| (written.is_some() || *at != 0.0).then_some([*at; 2]));
                held.collect()
            }
            (None, Some(_)) => {
                let planned = planned::planned(&session.machine, test)?;
                planned.positions.iter().map(range).collect()
            }
        };
        Ok(SessionTest { session, test, ranges })
    }

    fn constant(&self, name: &str) -> Option<&Constant> {
        self.session.constants.iter().find(|constant| constant.name == name)
    }
}

impl Source for SessionTest<'_> {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Station(self.test.geometry.map(|written| written.evaluate(length)))
    }

    fn held<N: Nominal>(&self, axis: &str, length: &impl Fn(&str) -> N) -> Option<N> {
        let index = self.session.machine.axis_index(axis)?;
        let [least, greatest] = (*self.ranges.get(index)?)?;
        if greatest > least {
            return None;
        }
        let written = self.test.at_written.get(index).and_then(Option::as_ref);
        let held_position = if least.is_finite() { least } else { self.test.at[index] };
        Some(written.map_or_else(|| N::constant(held_position), |written| written.evaluate(length)))
    }

    fn length_mm(&self, name: &str) -> Option<f64> {
        self.constant(name).map(|constant| constant.mm)
    }

    fn meaning(&self, name: &str) -> Option<String> {
        self.constant(name)?.means.clone()
    }

    fn name(&self) -> Option<&str> {
        Some(&self.test.name)
    }

    fn range(&self, axis: &str) -> Option<[f64; 2]> {
        let index = self.session.machine.axis_index(axis)?;
        self.ranges.get(index).copied().flatten().filter(|[least, greatest]| greatest > least)
    }
}
