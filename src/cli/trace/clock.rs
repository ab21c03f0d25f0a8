//! The time of a trace: its limit, and the time that a stage is expected to take.

use std::sync::Mutex;
use std::time::Instant;

use crate::cli::values;

/// When the searches without one fold began.
pub struct Folds(Mutex<Instant>);

impl Folds {
    /// They begin from now on.
    pub fn started() -> Folds {
        Folds(Mutex::new(Instant::now()))
    }

    /// The stage of the searches without one fold, of which so many have ended, and the time that the others are
    /// expected to take.
    pub fn remaining(&self, ended: usize, folds: usize) -> String {
        let Ok(mut began) = self.0.lock() else { return String::new() };
        if ended <= 1 {
            *began = Instant::now();
        }
        let stage = format!("searching without one fold: {ended} of {folds}");
        let left = began.elapsed().as_secs_f64() * folds.saturating_sub(ended) as f64 / ended.saturating_sub(1) as f64;
        if left.is_finite() && left >= 1.0 { format!("{stage}, about {left:.0} s left") } else { stage }
    }
}

/// Reads a time in seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse::<f64>().map_err(|_| "a number of seconds is expected, for example 10".to_string())?;
    values::SECONDS.reason(seconds).map_or(Ok(seconds), Err)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_a_positive_number() {
        assert_eq!(seconds("2.5"), Ok(2.5));
        for wrong in ["0", "-1", "nan", "inf", "1e300", "soon"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
