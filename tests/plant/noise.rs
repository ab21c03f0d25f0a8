//! The errors of the sensor: white or autocorrelated noise, outliers, missing rows.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

/// The resolution of the sensor, µm.
pub const RESOLUTION_UM: f64 = 0.1;

/// The noise of one session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// White noise.
    White {
        /// Standard deviation, µm.
        sigma_um: f64,
    },
    /// First-order autoregressive noise within every traversal.
    Serial {
        /// Standard deviation of a reading, µm.
        sigma_um: f64,
        /// Correlation of neighbouring readings.
        coefficient: f64,
    },
    /// White noise, and outliers of 5 to 30 µm of either sign.
    Outliers {
        /// Standard deviation of the other readings, µm.
        sigma_um: f64,
        /// Proportion of outliers.
        share: f64,
    },
}

impl Noise {
    /// Standard deviation of a reading that is not an outlier, µm, before rounding.
    pub fn sigma_um(self) -> f64 {
        match self {
            Noise::White { sigma_um } | Noise::Serial { sigma_um, .. } | Noise::Outliers { sigma_um, .. } => sigma_um,
        }
    }

    /// Correlation of neighbouring readings within a traversal.
    pub fn coefficient(self) -> f64 {
        if let Noise::Serial { coefficient, .. } = self { coefficient } else { 0.0 }
    }

    /// Standard deviation of a reading that is not an outlier, µm, with rounding.
    pub fn total_um(self) -> f64 {
        self.sigma_um().hypot(RESOLUTION_UM / 12.0_f64.sqrt())
    }
}

/// A standard normal number.
pub fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

/// The noise of the readings of one traversal, µm, and whether each is an outlier.
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
                Noise::Outliers { share, .. } if random.random::<f64>() < share => {
                    let size = 5.0 + 25.0 * random.random::<f64>();
                    let sign = if random.random::<bool>() { 1.0 } else { -1.0 };
                    (ordinary + sign * size, true)
                }
                _ => (ordinary, false),
            }
        })
        .collect()
}
