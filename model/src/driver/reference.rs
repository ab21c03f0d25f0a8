//! Reference values from which drivers count.

use crate::session::readings::Readings;

/// Reference time and temperature of the session.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reference {
    /// Time of the session's first reading, s.
    pub time_s: f64,
    /// Mean of the temperature columns, °C.
    pub temperature_c: f64,
}

impl Reference {
    /// The reference values of a session, from the readings of its tests.
    pub fn of<'a>(readings: impl Iterator<Item = &'a Readings> + Clone) -> Reference {
        let first = readings.clone().flat_map(|r| r.time_s.first().copied()).fold(f64::INFINITY, f64::min);
        let (sum, count) = readings
            .flat_map(|r| r.temperature_c.iter())
            .fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
        Reference {
            time_s: if first.is_finite() { first } else { 0.0 },
            temperature_c: if count > 0 { sum / count as f64 } else { 0.0 },
        }
    }
}
