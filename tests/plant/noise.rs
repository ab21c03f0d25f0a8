//! What the sensor adds: white or serially correlated noise, outliers, rows that are missing.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

/// The resolution of the sensor, µm.
pub const RESOLUTION_UM: f64 = 0.1;

/// The noise of one session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Independent readings.
    White {
        /// Standard deviation, µm.
        sigma_um: f64,
    },
    /// First-order autoregressive within every traversal.
    Serial {
        /// Standard deviation of a reading, µm.
        sigma_um: f64,
        /// Correlation of neighbours.
        coefficient: f64,
    },
    /// Independent readings, some of them off by 5 to 30 µm either way.
    Wild {
        /// Standard deviation of the others, µm.
        sigma_um: f64,
        /// How many are wild, as a share of one.
        share: f64,
    },
}

impl Noise {
    /// Standard deviation of an ordinary reading, µm, before rounding.
    pub fn sigma_um(self) -> f64 {
        match self {
            Noise::White { sigma_um } | Noise::Serial { sigma_um, .. } | Noise::Wild { sigma_um, .. } => {
                sigma_um
            }
        }
    }

    /// Correlation of neighbours within a traversal.
    pub fn coefficient(self) -> f64 {
        if let Noise::Serial { coefficient, .. } = self {
            coefficient
        } else {
            0.0
        }
    }

    /// Standard deviation of an ordinary reading with its rounding, µm.
    pub fn total_um(self) -> f64 {
        self.sigma_um().hypot(RESOLUTION_UM / 12.0_f64.sqrt())
    }
}

/// A standard normal number.
pub fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

/// The noise of one traversal, µm, and whether the reading is wild.
pub fn traversal(noise: Noise, readings: usize, random: &mut impl Rng) -> Vec<(f64, bool)> {
    let coefficient = noise.coefficient();
    let innovation = (1.0 - coefficient * coefficient).sqrt();
    let mut last = normal(random);
    (0..readings)
        .map(|reading| {
            if reading > 0 {
                last = coefficient * last + innovation * normal(random);
            }
            let ordinary = noise.sigma_um() * last;
            match noise {
                Noise::Wild { share, .. } if random.random::<f64>() < share => {
                    let size = 5.0 + 25.0 * random.random::<f64>();
                    let sign = if random.random::<bool>() { 1.0 } else { -1.0 };
                    (ordinary + sign * size, true)
                }
                _ => (ordinary, false),
            }
        })
        .collect()
}
