//! Shapes: the functional dependence of a component on its driver.
//!
//! A shape is linear in its coefficients: `component = Σ c_k · b_k(driver; shape parameters)`. Shape parameters (a period, a time
//! constant, a centre, a width, knots) are fixed numbers; a fit estimates the coefficients.
//!
//! [`super::basis`] contains the basis functions.

/// Functional dependence of a component on its driver. Positions, periods and widths are in the driver's internal unit: mm, rad, s, °C,
/// m.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Constant: a PIGE.
    Constant,
    /// Powers 1 … `degree` of the driver over `scale`.
    Polynomial {
        /// Highest power, at least 1.
        degree: usize,
        /// The divisor of the driver, which makes coefficients comparable: see [`super::Driver::default_scale`].
        scale: f64,
    },
    /// The power `degree` alone, over `scale`.
    Power {
        /// The power, at least 1.
        degree: usize,
        /// The divisor of the driver.
        scale: f64,
    },
    /// Cosine and sine of `order` times a rotary position.
    Harmonic {
        /// Cycles per revolution.
        order: f64,
    },
    /// Cosine and sine with a period of any length.
    Periodic {
        /// The period, in the driver's unit.
        period: f64,
    },
    /// A nonparametric curve (spline): cubic B-splines on equal knots from `from` to `to`.
    Curve {
        /// Start of the curve.
        from: f64,
        /// End of the curve.
        to: f64,
        /// Number of intervals.
        intervals: usize,
        /// Whether the curve is periodic.
        closed: bool,
    },
    /// Lost motion on reversal; the coefficient is the full lost motion.
    Backlash,
    /// The component trails in proportion to the driver's rate; the coefficient is a delay in seconds.
    Lag,
    /// A peak after each reversal that decays with the distance moved.
    ReversalSpike {
        /// Distance over which it decays to 1/e.
        width: f64,
    },
    /// Linear in time; the coefficient is the change per hour.
    Drift,
    /// Exponential approach; the coefficient is the final value.
    Warmup {
        /// Time constant, s.
        tau_s: f64,
    },
    /// A step at each position: 0 below, 1 at and beyond.
    Steps {
        /// Positions of the steps.
        at: Vec<f64>,
    },
    /// A raised-cosine bump.
    Local {
        /// The centre.
        centre: f64,
        /// The half width.
        width: f64,
        /// The period of recurrence: a full revolution of a rotary axis, or `None`.
        recurs: Option<f64>,
    },
}

/// Invalid shape parameters.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ShapeFault(pub String);

impl Shape {
    /// The identifier in files and results.
    pub fn word(&self) -> &'static str {
        match self {
            Shape::Constant => "constant",
            Shape::Polynomial { .. } | Shape::Power { .. } => "polynomial",
            Shape::Harmonic { .. } => "harmonic",
            Shape::Periodic { .. } => "periodic",
            Shape::Curve { .. } => "curve",
            Shape::Backlash => "backlash",
            Shape::Lag => "lag",
            Shape::ReversalSpike { .. } => "reversal-spike",
            Shape::Drift => "drift",
            Shape::Warmup { .. } => "warmup",
            Shape::Steps { .. } => "steps",
            Shape::Local { .. } => "local",
        }
    }

    /// A short tag for identifiers: `h2`, `p3`, `backlash`.
    pub fn tag(&self) -> String {
        match self {
            Shape::Polynomial { degree, .. } => format!("p{degree}"),
            Shape::Power { degree, .. } => format!("power{degree}"),
            Shape::Harmonic { order } => format!("h{order}"),
            other => other.word().to_string(),
        }
    }

    /// The order of a harmonic or the degree of a polynomial.
    pub fn order(&self) -> Option<f64> {
        match self {
            Shape::Harmonic { order } => Some(*order),
            Shape::Polynomial { degree, .. } | Shape::Power { degree, .. } => Some(*degree as f64),
            _ => None,
        }
    }

    /// Number of coefficients.
    pub fn coefficients(&self) -> usize {
        match self {
            Shape::Polynomial { degree, .. } => *degree,
            Shape::Harmonic { .. } | Shape::Periodic { .. } => 2,
            Shape::Curve {
                intervals, closed, ..
            } => {
                if *closed {
                    *intervals
                } else {
                    *intervals + 3
                }
            }
            Shape::Steps { at } => at.len(),
            _ => 1,
        }
    }

    /// Number of shape parameters that a search varies, besides the coefficients: a period, a time constant, a width, a position. The
    /// positions of several steps are not counted.
    pub fn numbers(&self) -> usize {
        match self {
            Shape::Periodic { .. } | Shape::Warmup { .. } | Shape::ReversalSpike { .. } => 1,
            Shape::Steps { at } if at.len() == 1 => 1,
            Shape::Local { .. } => 2,
            _ => 0,
        }
    }

    /// Names of the coefficients in identifiers: `cos`, `sin`, `1`, …; empty for a single coefficient.
    pub fn coefficient_names(&self) -> Vec<String> {
        match self {
            Shape::Harmonic { .. } | Shape::Periodic { .. } => vec!["cos".into(), "sin".into()],
            shape if shape.coefficients() == 1 => vec![String::new()],
            shape => (1..=shape.coefficients()).map(|k| k.to_string()).collect(),
        }
    }

    /// Checks the shape parameters.
    ///
    /// # Errors
    /// The message names the invalid number and the requirement.
    pub fn check(&self) -> Result<(), ShapeFault> {
        let positive = |value: f64, what: &str| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(ShapeFault(format!(
                    "{what} is {value}; it must be a positive number"
                )))
            }
        };
        match self {
            Shape::Polynomial { degree, scale } | Shape::Power { degree, scale } => {
                positive(*degree as f64, "the degree of a polynomial")?;
                if *degree > 30 {
                    return Err(ShapeFault(format!(
                        "a polynomial of degree {degree} cannot be fitted; the limit is 30"
                    )));
                }
                positive(*scale, "the scale of a polynomial")
            }
            Shape::Harmonic { order } => positive(*order, "the order of a harmonic"),
            Shape::Periodic { period } => positive(*period, "a period"),
            Shape::Curve {
                from,
                to,
                intervals,
                closed,
            } => {
                positive(to - from, "the length of a curve")?;
                let least = if *closed { 4 } else { 1 };
                if *intervals < least || *intervals > 500 {
                    return Err(ShapeFault(format!(
                        "a curve has {intervals} intervals; {least} to 500 are allowed"
                    )));
                }
                Ok(())
            }
            Shape::ReversalSpike { width } => positive(*width, "the width of a reversal spike"),
            Shape::Warmup { tau_s } => positive(*tau_s, "the time constant of a warm-up"),
            Shape::Steps { at } if at.is_empty() => Err(ShapeFault("steps without a position".into())),
            Shape::Steps { at } => match at.iter().find(|position| !position.is_finite()) {
                Some(position) => Err(ShapeFault(format!("a step at {position}"))),
                None => Ok(()),
            },
            Shape::Local { width, centre, .. } => {
                if !centre.is_finite() {
                    return Err(ShapeFault(format!("a local feature at {centre}")));
                }
                positive(*width, "the width of a local feature")
            }
            Shape::Constant | Shape::Backlash | Shape::Lag | Shape::Drift => Ok(()),
        }
    }
}
