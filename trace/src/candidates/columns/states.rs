//! The distinct states of a driver, and the channels by which effects reach the readings.
//!
//! A column of an effect is `s(row) · b(state(row))`, with the sensitivity `s` of a component and a basis function `b`.
//! Axes are swept over the same positions again and again, so that a session has few distinct states. A product of the
//! column with any vector is a sum over the states ([`crate::candidates::gram`]).

use std::sync::Arc;

use abbe_model::driver::{Driver, DriverPart, DriverSample};

/// The distinct states of a driver, as far as the shapes that use one part of them can tell.
#[derive(Debug)]
pub struct DriverStates {
    /// One sample for each state, in ascending order.
    pub samples: Vec<DriverSample<f64>>,
    /// Index of the state of each reading, by test. Empty for a test in which the effect does not act.
    of_reading: Vec<Vec<u32>>,
    /// Whether each scalar reading has a state of its own.
    scalar: bool,
}

impl DriverStates {
    /// Of the samples of each test. `None` for a test in which the effect does not act.
    pub fn of(samples: &[Option<Arc<Vec<DriverSample<f64>>>>], part: DriverPart) -> DriverStates {
        // Adding zero turns −0 into 0.
        let key = |sample: &DriverSample<f64>| match part {
            DriverPart::Value => [sample.value + 0.0, 0.0, 0.0],
            DriverPart::Direction => [sample.direction + 0.0, 0.0, 0.0],
            DriverPart::Rate => [sample.rate + 0.0, 0.0, 0.0],
            DriverPart::SinceReversal => [sample.direction, sample.since_reversal, sample.since_reversal_s],
        };
        let ascending =
            |a: &[f64; 3], b: &[f64; 3]| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]));
        let mut order: Vec<([f64; 3], usize, usize)> = Vec::new();
        for (test, samples) in samples.iter().enumerate() {
            let of_test = samples.iter().flat_map(|samples| samples.iter()).enumerate();
            order.extend(of_test.map(|(row, sample)| (key(sample), test, row)));
        }
        order.sort_by(|a, b| ascending(&a.0, &b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut of_reading: Vec<Vec<u32>> =
            samples.iter().map(|samples| vec![0; samples.as_ref().map_or(0, |samples| samples.len())]).collect();
        let mut distinct: Vec<DriverSample<f64>> = Vec::new();
        let mut last = None;
        for (key, test, row) in order {
            if last.is_none_or(|last| ascending(&last, &key).is_ne()) {
                distinct.extend(samples[test].as_ref().map(|samples| samples[row]));
                last = Some(key);
            }
            of_reading[test][row] = distinct.len() as u32 - 1;
        }
        DriverStates { samples: distinct, of_reading, scalar: false }
    }

    /// A state for each reading, in the order of tests and readings: what an effect that lags behind its driver has
    /// been following depends on all readings before.
    pub fn of_readings(samples: &[Option<Arc<Vec<DriverSample<f64>>>>]) -> DriverStates {
        let mut states = DriverStates { samples: Vec::new(), of_reading: Vec::new(), scalar: false };
        for of_test in samples {
            let rows = of_test.as_ref().map_or(&[][..], |samples| samples.as_slice());
            let first = states.samples.len() as u32;
            states.samples.extend_from_slice(rows);
            states.of_reading.push((0..rows.len() as u32).map(|row| first + row).collect());
        }
        states
    }

    /// A state for each scalar reading, in the order of tests, readings and channels. An effect on two components has
    /// another basis function in each channel. `channels` are those of each test.
    pub fn of_scalars(samples: &[Option<Arc<Vec<DriverSample<f64>>>>], channels: &[usize]) -> DriverStates {
        let mut states = DriverStates { samples: Vec::new(), of_reading: Vec::new(), scalar: true };
        for (of_test, channels) in samples.iter().zip(channels) {
            let rows = of_test.as_ref().map_or(&[][..], |samples| samples.as_slice());
            let first = states.samples.len() as u32;
            states.samples.extend(rows.iter().flat_map(|sample| std::iter::repeat_n(*sample, *channels)));
            states.of_reading.push((0..(rows.len() * channels) as u32).map(|scalar| first + scalar).collect());
        }
        states
    }

    /// Whether the effect acts in a test.
    pub fn acts_in(&self, test: usize) -> bool {
        !self.of_reading[test].is_empty()
    }

    /// Index of the state of a scalar reading of a test that has so many channels.
    pub fn of_scalar(&self, test: usize, scalar: usize, channels: usize) -> usize {
        let place = if self.scalar { scalar } else { scalar / channels };
        self.of_reading[test][place] as usize
    }
}

/// The change of each scalar reading of a test per unit of a basis function. A term of one run is zero in all others, whose
/// values are not held.
#[derive(Clone, Debug, Default)]
pub struct Sensitivity {
    /// The scalar reading of the first value.
    first: usize,
    values: Arc<Vec<f64>>,
}

impl Sensitivity {
    /// Of all scalar readings.
    pub fn whole(values: Arc<Vec<f64>>) -> Sensitivity {
        Sensitivity { first: 0, values }
    }

    /// Of the scalar readings from one on; zero for all others.
    pub fn within(first: usize, values: Vec<f64>) -> Sensitivity {
        Sensitivity { first, values: Arc::new(values) }
    }

    /// Whether no reading has a value.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Number of scalar readings up to the last value.
    pub fn len(&self) -> usize {
        self.first + self.values.len()
    }

    /// The values, for a loop over many readings.
    pub fn values(&self) -> SensitivityValues<'_> {
        SensitivityValues { first: self.first, values: &self.values }
    }

    /// The value of a scalar reading.
    pub fn at(&self, scalar: usize) -> f64 {
        self.values().at(scalar)
    }
}

/// The values of a [`Sensitivity`].
#[derive(Clone, Copy)]
pub struct SensitivityValues<'s> {
    first: usize,
    values: &'s [f64],
}

impl SensitivityValues<'_> {
    /// The value of a scalar reading.
    #[inline(always)]
    pub fn at(&self, scalar: usize) -> f64 {
        self.values.get(scalar.wrapping_sub(self.first)).copied().unwrap_or_default()
    }
}

/// What moves the readings and what it follows. Effects that differ in their shapes alone share a channel.
#[derive(Debug)]
pub struct Channel {
    /// By test. Empty for a test in which the effect does not act.
    pub sensitivity: Vec<Sensitivity>,
    /// The states of the driver.
    pub states: Arc<DriverStates>,
    /// The largest absolute value of what multiplies the basis functions, other than the sensitivity of the component.
    pub greatest_factor: f64,
    /// The driver of effects that lag behind it. Their samples depend on the time constant.
    pub lagging: Option<Driver>,
}

impl Channel {
    /// Whether it reaches a test.
    pub fn acts_in(&self, test: usize) -> bool {
        !self.sensitivity[test].is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings at one position are one state, whatever the test. States ascend.
    #[test]
    fn readings_at_one_position_share_a_state() {
        let at =
            |values: &[f64]| Some(Arc::new(values.iter().map(|v| DriverSample::plain(*v, 0.0)).collect::<Vec<_>>()));
        let states = DriverStates::of(&[at(&[2.0, 0.0, 1.0, -0.0]), None, at(&[1.0, 3.0])], DriverPart::Value);
        let values: Vec<f64> = states.samples.iter().map(|sample| sample.value).collect();
        assert_eq!(values, [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(states.of_reading, [vec![2, 0, 1, 0], vec![], vec![1, 3]]);
        let states = DriverStates::of(&[at(&[2.0, 0.0, 1.0])], DriverPart::Direction);
        assert_eq!((states.samples.len(), &states.of_reading[0]), (1, &vec![0, 0, 0]));
    }
}
