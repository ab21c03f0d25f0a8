//! From values to places in a drawing, and the round numbers that are written beside it.
//!
//! Round steps are 1, 2 or 5 times a power of ten: ten lines, where a plotting crate would bring its own canvas.

/// The least round number (1, 2 or 5 times a power of ten) that is no less than this.
pub fn round_up(value: f64) -> f64 {
    if !value.is_finite() || value <= 0.0 {
        return 1.0;
    }
    let power = 10.0_f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    // 0.3 over 0.1 is 2.9999999999999996: what is a step up to rounding is that step.
    let step = steps
        .into_iter()
        .find(|step| step * power >= value * (1.0 - 1e-9));
    step.unwrap_or(10.0) * power
}

/// A value as it is written beside an axis with this step.
pub fn text(value: f64, step: f64) -> String {
    let places = (-step.abs().log10() - 1e-9).ceil().clamp(0.0, 9.0) as usize;
    let rounded = format!("{value:.places$}");
    match rounded.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_string(),
        Some(digits) => format!("\u{2212}{digits}"),
        None => rounded,
    }
}

/// A range of values laid over a range of places.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Least and greatest value.
    pub values: [f64; 2],
    /// Their places.
    pub places: [f64; 2],
    /// Step between the values that are written.
    pub step: f64,
}

impl Scale {
    /// Over exactly these values.
    pub fn over(low: f64, high: f64, places: [f64; 2], about: usize) -> Scale {
        let (low, high) = if low.is_finite() && high.is_finite() && high > low {
            (low, high)
        } else if low.is_finite() {
            (low - 0.5, low + 0.5)
        } else {
            (0.0, 1.0)
        };
        Scale {
            values: [low, high],
            places,
            step: round_up((high - low) / about.max(1) as f64),
        }
    }

    /// Over these values, extended to whole steps.
    pub fn rounded(low: f64, high: f64, places: [f64; 2], about: usize) -> Scale {
        let scale = Scale::over(low, high, places, about);
        let whole = |value: f64| value / scale.step;
        Scale {
            values: [
                (whole(scale.values[0]) + 1e-9).floor() * scale.step,
                (whole(scale.values[1]) - 1e-9).ceil() * scale.step,
            ],
            ..scale
        }
    }

    /// The same with steps that divide a turn.
    pub fn in_degrees(self) -> Scale {
        let steps = [1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 90.0, 180.0, 360.0];
        let wanted = (self.values[1] - self.values[0]) / 9.0;
        let step = steps.into_iter().find(|step| *step >= wanted);
        match step {
            Some(step) if wanted > 0.5 => Scale { step, ..self },
            _ => self,
        }
    }

    /// Places a unit.
    pub fn per_unit(&self) -> f64 {
        (self.places[1] - self.places[0]) / (self.values[1] - self.values[0])
    }

    /// Where a value lies.
    pub fn at(&self, value: f64) -> f64 {
        self.places[0] + (value - self.values[0]) * self.per_unit()
    }

    /// The round values within the range.
    pub fn ticks(&self) -> Vec<f64> {
        let first = (self.values[0] / self.step - 1e-9).ceil() as i64;
        let last = (self.values[1] / self.step + 1e-9).floor() as i64;
        (first..=last).map(|k| k as f64 * self.step).collect()
    }
}

/// A place in a drawing: a tenth of a pixel is enough, and no figure is `-0`.
pub fn place(value: f64) -> String {
    let rounded = (value * 10.0).round() / 10.0;
    if rounded == 0.0 {
        "0".to_string()
    } else {
        format!("{rounded}")
    }
}

/// A way through points.
pub fn polyline(points: impl IntoIterator<Item = (f64, f64)>) -> String {
    let mut path = String::new();
    for (x, y) in points {
        path.push(if path.is_empty() { 'M' } else { 'L' });
        path.push_str(&place(x));
        path.push(' ');
        path.push_str(&place(y));
    }
    path
}

/// Points by themselves: a stroke of no length at each, which a round cap makes a dot.
pub fn dots(points: impl IntoIterator<Item = (f64, f64)>) -> String {
    let mut path = String::new();
    for (x, y) in points {
        path.push_str(&format!("M{} {}h0", place(x), place(y)));
    }
    path
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
    fn ticks_lie_within_the_range_and_at_their_places() {
        let scale = Scale::rounded(-3.2, 9.1, [100.0, 0.0], 5);
        assert_eq!(scale.values, [-5.0, 10.0]);
        assert_eq!(scale.ticks(), [-5.0, 0.0, 5.0, 10.0]);
        assert!((scale.at(10.0) - 0.0).abs() < 1e-9 && (scale.at(-5.0) - 100.0).abs() < 1e-9);
    }
}
