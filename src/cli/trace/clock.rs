//! The time of a trace: its limit, and the time that a stage is expected to take.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::cli::values;

/// A clock that runs from the start of a command.
pub struct Clock {
    start: Instant,
    limit: Option<Duration>,
    /// When the searches without one fold began.
    folds: Mutex<Instant>,
}

impl Clock {
    /// Starts a clock with a limit in seconds.
    pub fn started(limit_s: Option<f64>) -> Clock {
        let start = Instant::now();
        // A limit beyond what a duration can hold is no limit.
        let limit = limit_s.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Clock { start, limit, folds: Mutex::new(start) }
    }

    /// Whether the limit has passed.
    pub fn has_run_out(&self) -> bool {
        self.limit.is_some_and(|limit| self.start.elapsed() >= limit)
    }

    /// The stage of the searches without one fold, of which so many have ended, and the time that the others are
    /// expected to take.
    pub fn remaining(&self, ended: usize, folds: usize) -> String {
        let Ok(mut began) = self.folds.lock() else { return String::new() };
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
    fn a_clock_runs_out_only_with_a_limit() {
        assert!(!Clock::started(None).has_run_out());
        assert!(!Clock::started(Some(1e300)).has_run_out());
        assert!(!Clock::started(Some(3600.0)).has_run_out());
        assert!(Clock::started(Some(1e-9)).has_run_out());
    }

    #[test]
    fn a_limit_is_a_positive_number() {
        assert_eq!(seconds("2.5"), Ok(2.5));
        for wrong in ["0", "-1", "nan", "inf", "1e300", "soon"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
