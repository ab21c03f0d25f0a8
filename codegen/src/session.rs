//! A test of a session as the source of an equation: its geometry as written, and the positions of its axes.

use std::f64::consts::FRAC_PI_2;

use abbe_model::Diagnostic;
use abbe_model::axis::{Axis, AxisKind};
use abbe_model::scalar::Nominal;
use abbe_model::session::expression::{Constant, Length};
use abbe_model::session::planned;
use abbe_model::session::{Session, Test};

use crate::follow::{self, Following};
use crate::subject::{Source, Subject};

/// A position is a multiple of 90° to this share of it.
const QUARTER_TURN: f64 = 1e-12;

/// A test of a session. Named lengths and positions of moving axes stay symbols, and so do rotary axes that are held at
/// an angle that is no multiple of 90°. Other axes are at their stated positions.
#[derive(Clone, Debug)]
pub struct SessionTest<'s> {
    session: &'s Session,
    test: &'s Test,
    /// Least and greatest position of each axis of the machine; `None` for an axis that moves over an unknown range.
    ranges: Vec<Option<[f64; 2]>>,
    /// The axes that stay symbols where they are held.
    symbols: Vec<bool>,
    /// The stated positions of linear axes; some follow an axis that stays a symbol.
    written: Vec<Option<Length>>,
}

impl<'s> SessionTest<'s> {
    /// From a test, with the positions of its readings or, for a plan, of its motion. Without either, every axis moves,
    /// except those that the test holds at a nonzero position.
    ///
    /// # Errors
    /// If a planned motion is impossible.
    pub fn new(session: &'s Session, test: &'s Test) -> Result<Self, Diagnostic> {
        let range = |column: &Vec<f64>| {
            let least = column.iter().copied().fold(f64::INFINITY, f64::min);
            let greatest = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            Some([least, greatest])
        };
        let ranges: Vec<Option<[f64; 2]>> = match (&test.readings, &test.motion) {
            (Some(readings), _) => readings.positions.iter().map(range).collect(),
            (None, None) => {
                let held = test.at_written.iter().zip(&test.at);
                let held = held.map(|(written, at)| (written.is_some() || *at != 0.0).then_some([*at; 2]));
                held.collect()
            }
            (None, Some(_)) => {
                let planned = planned::planned(&session.machine, test)?;
                planned.positions.iter().map(range).collect()
            }
        };
        let oblique = |(axis, range): (&Axis, &Option<[f64; 2]>)| {
            let quarters = range.map_or(0.0, |[at, _]| at / FRAC_PI_2);
            axis.kind == AxisKind::Rotary && (quarters - quarters.round()).abs() > QUARTER_TURN
        };
        let symbols = session.machine.axes.iter().zip(&ranges).map(oblique).collect();
        Ok(SessionTest { session, test, ranges, symbols, written: Vec::new() }.following())
    }

    /// With the positions of linear axes that follow the rotary axes that stay symbols.
    fn following(mut self) -> Self {
        let machine = &self.session.machine;
        let following = Following {
            machine,
            test: self.test,
            ranges: &self.ranges,
            length_mm: &|name| self.length_mm(name).unwrap_or(f64::NAN),
        };
        let mut written = self.test.at_written.clone();
        for (index, axis) in machine.axes.iter().enumerate() {
            if axis.kind == AxisKind::Rotary && self.held_symbol(&axis.name).is_some() {
                written = following.positions(index, &written);
            }
        }
        self.written = written;
        self
    }

    /// The test with these axes as symbols where it holds them, and no others.
    ///
    /// # Errors
    /// If the machine lacks an axis.
    pub fn with_symbols(mut self, axes: &[String]) -> Result<Self, Diagnostic> {
        let machine = &self.session.machine;
        self.symbols.fill(false);
        for name in axes {
            let index = machine.axis_index(name).ok_or_else(|| {
                let axes: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
                let (machine, axes) = (machine.code(), axes.join(", "));
                Diagnostic::equation(format!(
                    "`{machine}` has no axis `{name}` that could stay a symbol; its axes are {axes}"
                ))
            })?;
            self.symbols[index] = true;
        }
        Ok(self.following())
    }

    /// Least and greatest position of an axis by its name.
    fn range_of(&self, axis: &str) -> Option<[f64; 2]> {
        self.ranges.get(self.session.machine.axis_index(axis)?).copied().flatten()
    }

    fn constant(&self, name: &str) -> Option<&Constant> {
        self.session.constants.iter().find(|constant| constant.name == name)
    }
}

impl Source for SessionTest<'_> {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Station(self.test.geometry.map(|written| written.evaluate(length)))
    }

    fn held<N: Nominal>(&self, axis: &str, length: &impl Fn(&str) -> N, position: &impl Fn(&str) -> N) -> Option<N> {
        let index = self.session.machine.axis_index(axis)?;
        let [least, greatest] = (*self.ranges.get(index)?)?;
        if greatest > least {
            return None;
        }
        let written = self.written.get(index).and_then(Option::as_ref);
        let held_position = if least.is_finite() { least } else { self.test.at[index] };
        Some(written.map_or_else(|| N::constant(held_position), |written| follow::evaluate(written, length, position)))
    }

    fn held_symbol(&self, axis: &str) -> Option<f64> {
        let index = self.session.machine.axis_index(axis)?;
        let [least, greatest] = self.range_of(axis)?;
        (self.symbols[index] && least == greatest).then_some(least)
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
        let is_symbol = |[least, greatest]: &[f64; 2]| greatest > least || self.held_symbol(axis).is_some();
        self.range_of(axis).filter(is_symbol)
    }
}
