//! Limits of identified errors and of figures of tests, and the probability at which a decision about them is taken.

/// The tolerances of a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// Least probability with which a pass or a fail is true, above 0.5 and below 1 (ISO 14253-1: 0.95 by default).
    pub probability: f64,
    /// The limits, in the order of the file.
    pub limits: Vec<Limit>,
}

impl Tolerance {
    /// Probability of the default rule of ISO 14253-1.
    pub const PROBABILITY: f64 = 0.95;
}

/// The limits of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// The quantity.
    pub of: Toleranced,
    /// Least permitted value, in `unit`; `None` for a figure that is never negative.
    pub lower: Option<f64>,
    /// Largest permitted value, in `unit`.
    pub upper: f64,
    /// `um`, `mm`, `arcsec`, `deg`, `mrad`, `urad`.
    pub unit: &'static str,
}

/// A quantity that has a limit.
#[derive(Clone, Debug, PartialEq)]
pub enum Toleranced {
    /// An estimated parameter, by its identifier in results: `EX0C`, `EZC~C:h2.amplitude`.
    Parameter(String),
    /// A figure of a test.
    Figure {
        /// The name of the test.
        test: String,
        /// The figure.
        figure: TestFigure,
        /// Standard uncertainty of the instrument besides the noise of its readings, µm.
        instrument_u_um: f64,
    },
}

impl std::fmt::Display for Toleranced {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Toleranced::Parameter(id) => formatter.write_str(id),
            Toleranced::Figure { test, figure, .. } => write!(formatter, "{}[{test}]", figure.word()),
        }
    }
}

/// A figure of a circular test or of the rotation of an axis, µm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TestFigure {
    /// Circular deviation G, the larger of both directions (ISO 230-4).
    CircularDeviation,
    /// Bidirectional circular deviation G(b) (ISO 230-4).
    BidirectionalCircularDeviation,
    /// Radial deviation F, of both directions (ISO 230-4).
    RadialDeviation,
    /// Mean bidirectional radial deviation D (ISO 230-4).
    MeanBidirectionalRadialDeviation,
    /// Circular hysteresis H (ISO 230-4, edition of 1996).
    Hysteresis,
    /// Synchronous error motion of a rotary axis, the larger of both directions (ISO 230-7).
    SynchronousErrorMotion,
    /// Asynchronous error motion of a rotary axis, the larger of both directions (ISO 230-7).
    AsynchronousErrorMotion,
}

impl TestFigure {
    /// Its key in session files, without the unit.
    pub fn word(self) -> &'static str {
        match self {
            TestFigure::CircularDeviation => "circular_deviation",
            TestFigure::BidirectionalCircularDeviation => "bidirectional_circular_deviation",
            TestFigure::RadialDeviation => "radial_deviation",
            TestFigure::MeanBidirectionalRadialDeviation => "mean_bidirectional_radial_deviation",
            TestFigure::Hysteresis => "hysteresis",
            TestFigure::SynchronousErrorMotion => "synchronous_error_motion",
            TestFigure::AsynchronousErrorMotion => "asynchronous_error_motion",
        }
    }

    /// Whether it may be negative. Its limits then lie on both sides of zero.
    pub fn is_signed(self) -> bool {
        matches!(self, TestFigure::RadialDeviation | TestFigure::MeanBidirectionalRadialDeviation)
    }
}
