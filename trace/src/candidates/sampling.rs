//! How densely and how far a session samples its axes. This determines which shapes are observable.

use abbe_identify::problem::Problem;

/// The levels of a driver column.
pub(crate) struct ColumnSampling {
    /// `NAME_unit`.
    pub name: String,
    /// Number of different values.
    pub levels: usize,
    /// Values between the levels, if there are more than two: midpoints between few levels, else deciles.
    pub between: Vec<f64>,
}

/// Largest number of levels between each of which a step is a candidate.
const FEW_LEVELS: usize = 10;

/// The sampling of the axes in a session.
pub(crate) struct Sampling {
    pub moves: Vec<bool>,
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    /// Median step between readings where the axis moves; 0 for poses.
    pub step: Vec<f64>,
    pub has_time: bool,
    pub duration_s: f64,
    /// The driver columns that all readings have and that vary.
    pub columns: Vec<ColumnSampling>,
    /// Whether the rows are independent poses and all readings are angles, of what the machine points at.
    pub reads_directions: bool,
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
            columns: columns(problem),
            reads_directions: false,
            reverses_inside_runs: vec![false; axes],
            both_directions: vec![false; axes],
        };
        for test in &problem.tests {
            let Some(readings) = &test.readings else { continue };
            sampling.has_time &= !readings.time_s.is_empty();
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
                    sampling.step[axis] = sampling.step[axis].max(abbe_identify::numerics::median(&mut steps));
                }
            }
            let last = readings.time_s.iter().copied().fold(0.0, f64::max);
            sampling.duration_s = sampling.duration_s.max(last - problem.reference.time_s);
        }
        let channels = problem.models.iter().flat_map(|model| model.channels());
        sampling.reads_directions = sampling.is_poses() && channels.clone().all(|channel| channel.is_angle());
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

/// The driver columns that all readings have and that vary.
fn columns(problem: &Problem) -> Vec<ColumnSampling> {
    let tests: Vec<_> = problem.tests.iter().filter_map(|test| test.readings.as_ref()).collect();
    let Some(first) = tests.first() else { return Vec::new() };
    let everywhere = first.drivers.keys().filter(|name| tests.iter().all(|test| test.drivers.contains_key(*name)));
    let sampled = everywhere.map(|name| {
        let recorded = tests.iter().flat_map(|test| &test.drivers[name]);
        let mut values: Vec<f64> = recorded.map(|value| problem.reference.counted(name, *value)).collect();
        values.sort_by(f64::total_cmp);
        let mut levels = values.clone();
        levels.dedup();
        let between = match levels.len() {
            0..3 => Vec::new(),
            3..=FEW_LEVELS => levels.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect(),
            _ => (1..FEW_LEVELS).map(|k| values[k * values.len() / FEW_LEVELS]).collect(),
        };
        ColumnSampling { name: name.clone(), levels: levels.len(), between }
    });
    sampled.filter(|column| column.levels > 1).collect()
}
