//! How densely and how far a session samples its axes. This determines which shapes are observable.

use crate::problem::Problem;

/// The sampling of the axes in a session.
pub(crate) struct Sampling {
    pub moves: Vec<bool>,
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    /// Median step between readings where the axis moves; 0 for poses.
    pub step: Vec<f64>,
    pub has_time: bool,
    pub duration_s: f64,
    pub has_temperature: bool,
    pub reverses_inside_runs: Vec<bool>,
    pub both_directions: Vec<bool>,
}

impl Sampling {
    pub fn of(problem: &Problem) -> Sampling {
        let axes = problem.session.machine.axes.len();
        let mut sampling = Sampling {
            moves: vec![false; axes],
            low: vec![f64::INFINITY; axes],
            high: vec![f64::NEG_INFINITY; axes],
            step: vec![0.0; axes],
            has_time: true,
            duration_s: 0.0,
            has_temperature: true,
            reverses_inside_runs: vec![false; axes],
            both_directions: vec![false; axes],
        };
        for test in &problem.tests {
            let Some(readings) = &test.readings else { continue };
            sampling.has_time &= !readings.time_s.is_empty();
            sampling.has_temperature &= !readings.temperature_c.is_empty();
            for (axis, column) in readings.positions.iter().enumerate() {
                for value in column {
                    sampling.low[axis] = sampling.low[axis].min(*value);
                    sampling.high[axis] = sampling.high[axis].max(*value);
                }
                let kind = problem.session.machine.axes[axis].kind;
                let samples = readings.axis_samples(axis, kind);
                let directions = |range: std::ops::Range<usize>| {
                    samples[range]
                        .iter()
                        .map(|s| s.direction as i32)
                        .filter(|d| *d != 0)
                        .collect::<std::collections::BTreeSet<_>>()
                };
                sampling.both_directions[axis] |= directions(0..samples.len()).len() > 1;
                for run in readings.runs() {
                    sampling.reverses_inside_runs[axis] |= directions(run).len() > 1;
                }
                if !readings.run.is_empty() && column.len() > 1 {
                    let mut steps: Vec<f64> =
                        column.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 1e-9).collect();
                    sampling.step[axis] = sampling.step[axis].max(crate::numerics::median(&mut steps));
                }
            }
            let last = readings.time_s.iter().copied().fold(0.0, f64::max);
            sampling.duration_s = sampling.duration_s.max(last - problem.reference.time_s);
        }
        for axis in 0..axes {
            sampling.moves[axis] = sampling.high[axis] - sampling.low[axis] > 1e-6;
        }
        sampling
    }

    /// Whether the rows are independent poses: no axis is swept.
    pub fn is_poses(&self) -> bool {
        self.step.iter().all(|step| *step == 0.0)
    }

    pub fn span(&self, axis: usize) -> f64 {
        self.high[axis] - self.low[axis]
    }
}
