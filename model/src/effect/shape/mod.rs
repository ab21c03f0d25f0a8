//! Shapes: the functional dependence of a component on its driver. Each file holds one; the registry below lists them.
//!
//! A shape is linear in its coefficients: `component = Σ c_k · b_k(driver; shape parameters)`. Shape parameters (a
//! period, a time constant, a centre, a width, knots) are fixed numbers; a fit estimates the coefficients. Positions,
//! periods and widths are in the driver's internal unit: mm, rad, s, °C, m.

mod kind;
mod words;

pub use kind::{Basis, Entry, Follows, Per, Registered, ShapeKind};
pub use words::EffectWords;

use std::ops::Deref;

use super::keys::{Key, KeyForm, KeyReader, KeyWriter};
use crate::driver::DriverSample;
use crate::scalar::Nominal;

/// Declares the modules, the enumeration and the list of all shapes.
macro_rules! shapes {
    ($($module:ident: $shape:ident $(($numbers:ident))?,)+) => {
        $(mod $module;)+
        $($(pub use $module::$numbers;)?)+
        $(
            impl Registered for $module::$shape {
                fn entry(&self) -> &'static Entry {
                    &$module::ENTRY
                }
            }
        )+

        /// Functional dependence of a component on its driver.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Shape {
            $(
                #[doc = concat!("`", stringify!($module), "`")]
                $shape $(($numbers))?,
            )+
        }

        /// All shapes, in the order of documentation and messages.
        pub const SHAPES: &[&Entry] = &[$(&$module::ENTRY,)+];

        impl Shape {
            fn kind_mut(&mut self) -> Option<&mut dyn ShapeKind> {
                match self {
                    $(shapes!(@pattern kind $shape $($numbers)?) => shapes!(@mutable kind $($numbers)?),)+
                }
            }

            /// Appends the values of the basis functions at one reading to `basis`, in the order of the coefficients.
            pub fn basis<N: Nominal>(&self, sample: &DriverSample<N>, basis: &mut Vec<N>) {
                match self {
                    $(shapes!(@pattern kind $shape $($numbers)?) =>
                        Basis::basis(shapes!(@value kind $module $shape $($numbers)?), sample, basis),)+
                }
            }
        }

        impl Deref for Shape {
            type Target = dyn ShapeKind;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(shapes!(@pattern kind $shape $($numbers)?) => shapes!(@value kind $module $shape $($numbers)?),)+
                }
            }
        }
    };
    (@pattern $kind:ident $shape:ident) => { Shape::$shape };
    (@pattern $kind:ident $shape:ident $numbers:ident) => { Shape::$shape($kind) };
    (@value $kind:ident $module:ident $shape:ident) => { &$module::$shape };
    (@value $kind:ident $module:ident $shape:ident $numbers:ident) => { $kind };
    (@mutable $kind:ident) => { None };
    (@mutable $kind:ident $numbers:ident) => { Some($kind) };
}

shapes! {
    constant: Constant,
    polynomial: Polynomial(Polynomial),
    power: Power(Power),
    harmonic: Harmonic(Harmonic),
    cosine: Cosine(Cosine),
    cotangent: Cotangent,
    precession: Precession(Precession),
    periodic: Periodic(Periodic),
    spectrum: Spectrum(Spectrum),
    triangle: Triangle(Triangle),
    curve: Curve(Curve),
    backlash: Backlash,
    lag: Lag,
    reversal_spike: ReversalSpike(ReversalSpike),
    drift: Drift,
    warmup: Warmup(Warmup),
    first_order_lag: FirstOrderLag(FirstOrderLag),
    steps: Steps(Steps),
    local: Local(Local),
}

impl Shape {
    /// The entry of a word in files; `None` if no shape has it.
    pub fn entry_of(word: &str) -> Option<&'static Entry> {
        SHAPES.iter().copied().find(|entry| entry.word == word)
    }

    /// The same shape with one of the numbers that have a bracket changed.
    #[must_use]
    pub fn with_number(&self, which: usize, value: f64) -> Shape {
        let mut changed = self.clone();
        if let Some(kind) = changed.kind_mut() {
            kind.set_number(which, value);
        }
        changed
    }

    /// One of the numbers that have a bracket.
    pub fn number(&self, which: usize) -> f64 {
        self.reported().get(which).and_then(|(_, values)| values.first()).copied().unwrap_or(f64::NAN)
    }

    /// The same shape with other positions ([`ShapeKind::positions`]).
    #[must_use]
    pub fn with_positions(&self, positions: Vec<f64>) -> Shape {
        let mut changed = self.clone();
        if let Some(kind) = changed.kind_mut() {
            kind.set_positions(positions);
        }
        changed
    }

    /// The basis functions over the rows of a test: one column per coefficient.
    pub fn columns(&self, samples: &[DriverSample<f64>]) -> Vec<Vec<f64>> {
        let count = self.coefficients();
        let mut columns = vec![vec![0.0; samples.len()]; count];
        let mut row = Vec::with_capacity(count);
        for (i, sample) in samples.iter().enumerate() {
            row.clear();
            self.basis(sample, &mut row);
            for (column, value) in columns.iter_mut().zip(&row) {
                column[i] = *value;
            }
        }
        columns
    }
}
