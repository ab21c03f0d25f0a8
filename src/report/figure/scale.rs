//! Linear scales of plots: conversion of values to coordinates, and tick labels.
//!
//! Tick steps are 1, 2 or 5 times a power of ten.

/// Rounds up to the next number of the form 1, 2 or 5 times a power of ten.
pub fn round_up(value: f64) -> f64 {
    if !value.is_finite() || value <= 0.0 {
        return 1.0;
    }
    let power = 10.0_f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    // The tolerance covers rounding: 0.3 / 0.1 is 2.9999999999999996.
    let step = steps.into_iter().find(|step| step * power >= value * (1.0 - 1e-9));
    step.unwrap_or(10.0) * power
}

/// Formats a value with the decimal places of a tick step.
pub fn text(value: f64, step: f64) -> String {
    let places = (-step.abs().log10() - 1e-9).ceil().clamp(0.0, 9.0) as usize;
    let rounded = format!("{value:.places$}");
    match rounded.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_string(),
        Some(digits) => format!("\u{2212}{digits}"),
        None => rounded,
    }
}

/// A linear scale: a range of values with ticks.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Minimum and maximum value.
    pub values: [f64; 2],
    /// Step between ticks.
    pub step: f64,
    /// The words of a value that is no number for people, such as a date in days.
    pub words: Option<fn(f64) -> String>,
}

impl Scale {
    /// A scale over exactly this range, with about `ticks` ticks.
    pub fn over([low, high]: [f64; 2], ticks: usize) -> Scale {
        let (low, high) = if low.is_finite() && high.is_finite() && high > low {
            (low, high)
        } else if low.is_finite() {
            (low - 0.5, low + 0.5)
        } else {
            (0.0, 1.0)
        };
        Scale { values: [low, high], step: round_up((high - low) / ticks.max(1) as f64), words: None }
    }

    /// A scale over this range, extended to whole steps.
    pub fn rounded(range: [f64; 2], ticks: usize) -> Scale {
        let Scale { values: [low, high], step, words } = Scale::over(range, ticks);
        Scale { values: [(low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step], step, words }
    }

    /// A scale over this range and zero, extended to whole steps. Values that look equal do not lie on the edge.
    pub fn with_zero([low, high]: [f64; 2], ticks: usize) -> Scale {
        let beyond = if high - low <= 1e-3 * high.abs() { 1.2 } else { 1.0 };
        Scale::rounded([(beyond * low).min(0.0), (beyond * high).max(0.0)], ticks)
    }

    /// A scale over the range of an axis position. The steps of an angle divide a revolution.
    pub fn of_axis(range: [f64; 2], is_angle: bool) -> Scale {
        let steps = [1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 90.0, 180.0, 360.0];
        let scale = Scale::over(range, if is_angle { 9 } else { 7 });
        let wanted = (scale.values[1] - scale.values[0]) / 9.0;
        match steps.into_iter().find(|step| *step >= wanted) {
            Some(step) if is_angle && wanted > 0.5 => Scale { step, ..scale },
            _ => scale,
        }
    }

    /// The scale between two coordinates of a drawing: of the minimum, of the maximum.
    pub fn between(self, coordinates: [f64; 2]) -> Placed {
        Placed { scale: self, coordinates }
    }

    /// Values of the ticks within the range.
    pub fn ticks(&self) -> Vec<f64> {
        let first = (self.values[0] / self.step - 1e-9).ceil() as i64;
        let last = (self.values[1] / self.step + 1e-9).floor() as i64;
        (first..=last).map(|k| k as f64 * self.step).collect()
    }
}

/// A scale in a drawing.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// The scale.
    pub scale: Scale,
    /// Coordinates of its minimum and maximum.
    pub coordinates: [f64; 2],
}

impl Placed {
    /// Coordinate difference per unit of the value.
    pub fn per_unit(&self) -> f64 {
        (self.coordinates[1] - self.coordinates[0]) / (self.scale.values[1] - self.scale.values[0])
    }

    /// Coordinate of a value.
    pub fn at(&self, value: f64) -> f64 {
        self.coordinates[0] + (value - self.scale.values[0]) * self.per_unit()
    }

    /// The ticks: coordinate and label.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let label = |value: f64| self.scale.words.map_or_else(|| text(value, self.scale.step), |words| words(value));
        self.scale.ticks().into_iter().map(|value| (self.at(value), label(value))).collect()
    }
}

/// Minimum and maximum of the finite values.
pub fn span(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values
        .into_iter()
        .filter(|value| value.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_numbers_have_the_digits_of_their_step() {
        for (value, wanted) in [(0.3, 0.5), (0.2, 0.2), (7.0, 10.0), (1.0, 1.0), (0.0, 1.0)] {
            assert!((round_up(value) - wanted).abs() < 1e-12, "{value}");
        }
        assert_eq!(text(-0.4, 0.2), "\u{2212}0.4");
        assert_eq!(text(-0.0, 0.2), "0.0");
        assert_eq!(text(150.0, 50.0), "150");
    }

    #[test]
    fn ticks_lie_within_the_range_and_at_their_coordinates() {
        let scale = Scale::rounded([-3.2, 9.1], 5);
        assert_eq!(scale.values, [-5.0, 10.0]);
        assert_eq!(scale.ticks(), [-5.0, 0.0, 5.0, 10.0]);
        // A constant curve is no edge of its plot.
        assert_eq!(Scale::with_zero([-10.0, -10.0], 6).values, [-12.0, 0.0]);
        assert!(Scale::with_zero([-10.0, -9.999_999], 6).values[0] < -11.0);
        assert_eq!(Scale::with_zero([-10.0, 4.0], 7).values, [-10.0, 4.0]);
        let scale = scale.between([100.0, 0.0]);
        assert!((scale.at(10.0) - 0.0).abs() < 1e-9 && (scale.at(-5.0) - 100.0).abs() < 1e-9);
    }
}
