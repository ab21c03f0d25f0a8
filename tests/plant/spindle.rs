//! The temperature of a spindle over time, and the displacement that follows it.

use std::f64::consts::TAU;

/// The temperature of the spindle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spindle {
    /// It runs and rests: two oscillations, the slower with this period in s.
    Cycles { period_s: f64 },
    /// It rises steadily, in K/s: collinear with time.
    Rises { rate: f64 },
}

/// The temperature at which the spindle has its nominal length, °C.
const REFERENCE_C: f64 = 27.0;
/// Steps of the integration per time constant.
const STEPS: f64 = 20.0;

impl Spindle {
    /// The name of the column in files.
    pub const COLUMN: &str = "driver.spindle_temperature_c";

    /// The temperature, °C.
    pub fn temperature_c(self, time_s: f64) -> f64 {
        match self {
            Spindle::Cycles { period_s } => {
                let phase = TAU * time_s / period_s;
                REFERENCE_C + 5.0 * phase.sin() + 2.0 * (2.7 * phase).cos()
            }
            Spindle::Rises { rate } => REFERENCE_C - 2.0 + rate * time_s,
        }
    }

    /// The temperature above [`REFERENCE_C`], K.
    pub fn above_k(self, time_s: f64) -> f64 {
        self.temperature_c(time_s) - REFERENCE_C
    }

    /// y with `τ dy/dt + y = T`, T above [`REFERENCE_C`], and y = T at the start, by the method of Runge and Kutta, K.
    pub fn lagged_k(self, time_s: f64, tau_s: f64) -> f64 {
        let count = (time_s / tau_s * STEPS).ceil().max(1.0);
        let step_s = time_s / count;
        let slope = |at_s: f64, y: f64| (self.above_k(at_s) - y) / tau_s;
        (0..count as usize).fold(self.above_k(0.0), |y, k| {
            let at_s = k as f64 * step_s;
            let first = slope(at_s, y);
            let second = slope(at_s + 0.5 * step_s, y + 0.5 * step_s * first);
            let third = slope(at_s + 0.5 * step_s, y + 0.5 * step_s * second);
            let fourth = slope(at_s + step_s, y + step_s * third);
            y + step_s / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        })
    }
}
