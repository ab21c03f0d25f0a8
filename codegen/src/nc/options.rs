//! What the user may choose of NC programs.

use abbe_model::Diagnostic;
use abbe_model::words::number;

use super::Control;
use crate::error;

/// The number of `main` unless another is asked for.
const FIRST_NUMBER: u32 = 1000;
/// The last program number.
const LAST_NUMBER: u32 = 9999;

/// Options of NC programs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NcOptions {
    /// Overshoot of an angle before and after the measured path, degrees; `None`: 180° on full circles, 2° otherwise.
    pub overshoot_deg: Option<f64>,
    /// Overshoot of a linear axis or along a line, mm; `None`: 2 mm, or less where the travel ends.
    pub overshoot_mm: Option<f64>,
    /// Length by which the bar is longer at the feed-in than at the start, mm.
    pub feed_in_mm: f64,
    /// Distance along the tool from which a position is approached, mm.
    pub clearance_mm: f64,
    /// Pause between two traversals, and rest at each target of an instrument that reads at rest, s.
    pub dwell_s: f64,
    /// Feed of approach and retreat, mm/min and °/min.
    pub approach_feed: f64,
    /// Largest chord error of a segment in the distance of the balls, mm.
    pub chord_error_mm: f64,
    /// The least increment of the control, mm and degrees: a power of ten. `None`: that of the control, 0.001 for Fanuc.
    /// Positions, their changes and the centres of circles are whole increments.
    pub increment_mm: Option<f64>,
    /// The number of `main` on a control whose programs have numbers; the tests follow. `None`: 1000.
    pub number: Option<u32>,
    /// Whether paths of rotary and linear axes are written for the tool point over the table, by a function of the
    /// control.
    pub tool_point: bool,
}

impl Default for NcOptions {
    fn default() -> Self {
        NcOptions {
            overshoot_deg: None,
            overshoot_mm: None,
            feed_in_mm: 1.0,
            clearance_mm: 50.0,
            dwell_s: 3.0,
            approach_feed: 1000.0,
            chord_error_mm: 0.5e-3,
            increment_mm: None,
            number: None,
            tool_point: false,
        }
    }
}

impl NcOptions {
    /// The number of `main` on a control whose programs have numbers.
    pub fn number(&self) -> u32 {
        self.number.unwrap_or(FIRST_NUMBER)
    }

    /// Decimals of a position.
    pub(super) fn decimals(&self, control: &dyn Control) -> usize {
        self.increment_mm.map_or(control.decimals(), |increment| (-increment.log10()).round().max(0.0) as usize)
    }

    pub(super) fn check(&self, control: &dyn Control, tests: usize) -> Result<(), Diagnostic> {
        let fault = |what: &str, value: f64, least: f64, most: f64| {
            if value >= least && value <= most {
                return Ok(());
            }
            Err(error::nc(
                format!("{what} is {}", number(value)),
                format!("a value from {} to {} is expected", number(least), number(most)),
            ))
        };
        fault("the overshoot in degrees", self.overshoot_deg.unwrap_or(0.0), 0.0, 360.0)?;
        fault("the overshoot in mm", self.overshoot_mm.unwrap_or(0.0), 0.0, 1e3)?;
        fault("the feed-in in mm", self.feed_in_mm, 0.0, 10.0)?;
        fault("the clearance in mm", self.clearance_mm, 0.0, 1e3)?;
        fault("the dwell in s", self.dwell_s, 0.0, 600.0)?;
        fault("the feed of approach", self.approach_feed, 1.0, 1e5)?;
        fault("the chord error in mm", self.chord_error_mm, 1e-5, 1e-2)?;
        if let Some(increment) = self.increment_mm {
            let power = 0.1_f64.powi(self.decimals(control) as i32);
            if !(1e-6..=0.01).contains(&increment) || (increment - power).abs() > 1e-9 * power {
                return Err(error::nc(
                    format!("the increment in mm is {increment}"),
                    "0.01, 0.001, 0.0001, 0.00001 or 0.000001 is expected",
                ));
            }
        }
        if self.number.is_some() && !control.has_numbers() {
            return Err(error::nc(format!("programs for {} have no numbers", control.word()), "a number is for fanuc"));
        }
        if control.has_numbers() {
            let number = self.number();
            let last = u64::from(number) + tests as u64;
            if number == 0 || last > u64::from(LAST_NUMBER) {
                return Err(error::nc(
                    format!("main has the number {number}, and the last test {last}"),
                    format!("numbers from 1 to {LAST_NUMBER} are expected: state a lower number, or write fewer tests"),
                ));
            }
        }
        if self.tool_point && !control.has_tool_point() {
            return Err(error::nc(
                format!("{} has no function that moves the tool point over the table", control.word()),
                "write the motion of the axes",
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::control;
    use super::*;

    /// `O1000` and 8999 tests end at `O9999`, also where no number is stated.
    #[test]
    fn the_last_number_is_one_of_the_control() {
        let options = NcOptions::default();
        let check = |word: &str, tests: usize| options.check(control(word).unwrap(), tests);
        assert!(check("fanuc", 8999).is_ok());
        let message = check("fanuc", 9000).unwrap_err().to_string();
        assert!(message.contains("main has the number 1000, and the last test 10000"), "{message}");
        // Programs without numbers have no last one.
        assert!(check("linuxcnc", 9000).is_ok());
    }
}
