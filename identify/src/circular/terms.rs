//! The contribution of each classical fault of two linear axes to the radius of a circle.
//!
//! Notation: `u₁ = cos θ`, `u₂ = sin θ`, `dᵢ` the direction of travel of axis i, `s` that of the path, `v` the feed.
//! The radius changes by `δL = u₁·δ₁ + u₂·δ₂`. `δᵢ` is the deviation of the tool along the positive direction of axis
//! i.
//!
//! ```text
//! scale mismatch   δᵢ = mᵢ·qᵢ                 ½(m₁ − m₂)·R·cos 2θ
//! squareness       δ₁ = −γ·q₂                 −½γ·R·sin 2θ            the angle between the positive axes is 90° + γ
//! servo mismatch   δᵢ = −τᵢ·q̇ᵢ                ½s·v·(τ₁ − τ₂)·sin 2θ   positive: the first axis lags more
//! backlash         δᵢ = −½Bᵢ·dᵢ               −½Bᵢ·dᵢ·uᵢ              Bᵢ = mean + slope·uᵢ: one value at each end
//! lateral play     δⱼ = −½Pᵢ·dᵢ               −½Pᵢ·dᵢ·uⱼ
//! straightness     δⱼ = κᵢ·qᵢ²                κᵢR²·uᵢ²·uⱼ             κᵢR²: sagitta over the diameter
//! third order      δᵢ = cᵢ·(qᵢ/R)³            ⅛(c₁ + c₂)·cos 4θ           beside radius and scale, which absorb the other terms
//!                  δⱼ = kᵢ·(qᵢ/R)³            ⅛(k₁ − k₂)·sin 4θ           beside squareness
//! reversal spike   δL = H·exp(−φ/w)           φ: angle of the path since the reversal of axis i
//! cyclic error     δᵢ = A·cos(2πqᵢ/p + …)     uᵢ·…
//! ```

use std::f64::consts::TAU;

use super::path::Path;

/// The rows of a path that are not outliers, in the quantities of the terms.
pub(super) struct PathRows {
    /// cos θ and sin θ.
    pub u: [Vec<f64>; 2],
    /// Direction of the path.
    pub s: Vec<f64>,
    /// Direction of each axis.
    pub d: [Vec<f64>; 2],
    /// Position of each axis, mm.
    pub q: [Vec<f64>; 2],
    /// Angle of the path since the last reversal of each axis in this run, and the end of that reversal; infinite
    /// before the first reversal.
    pub since: [Vec<(f64, f64)>; 2],
    /// Deviation of the length, mm.
    pub y: Vec<f64>,
    /// Whether the preceding row belongs to the same run.
    pub follows: Vec<bool>,
    /// The row of the test.
    pub row: Vec<usize>,
}

impl PathRows {
    /// Collects the rows of a path that are not outliers.
    pub fn of(path: &Path) -> PathRows {
        let mut rows = PathRows {
            u: Default::default(),
            s: Vec::new(),
            d: Default::default(),
            q: Default::default(),
            since: Default::default(),
            y: Vec::new(),
            follows: Vec::new(),
            row: Vec::new(),
        };
        for run in &path.runs {
            let mut turned: [Option<(f64, f64)>; 2] = [None, None];
            for row in run.rows.clone() {
                let angle = path.angle[row];
                let u = [angle.cos(), angle.sin()];
                for axis in 0..2 {
                    let travels = path.samples[axis][row].direction;
                    if row > run.rows.start && path.samples[axis][row - 1].direction != travels {
                        // The axis reverses between this reading and the one before.
                        let quarter = std::f64::consts::FRAC_PI_2;
                        let offset = quarter * axis as f64;
                        let end = offset + ((angle - offset) / (2.0 * quarter)).round() * 2.0 * quarter;
                        turned[axis] = Some((end, (end - offset).cos().signum()));
                    }
                    rows.since[axis].push(match turned[axis] {
                        Some((at, end)) => ((angle - at).abs(), end),
                        None => (f64::INFINITY, 0.0),
                    });
                    rows.d[axis].push(travels);
                    rows.u[axis].push(u[axis]);
                    rows.q[axis].push(path.samples[axis][row].value);
                }
                rows.s.push(run.direction);
                rows.y.push(path.deviation_mm[row]);
                rows.follows.push(row > run.rows.start);
                rows.row.push(row);
            }
        }
        let keep: Vec<bool> = path
            .runs
            .iter()
            .flat_map(|run| run.rows.clone())
            .map(|row| !path.left_out.get(row).copied().unwrap_or(false))
            .collect();
        rows.retain(&keep);
        rows
    }

    fn retain(&mut self, keep: &[bool]) {
        fn filter<T: Copy>(values: &mut Vec<T>, keep: &[bool]) {
            let mut kept = keep.iter();
            values.retain(|_| kept.next().copied().unwrap_or(true));
        }
        for axis in 0..2 {
            filter(&mut self.u[axis], keep);
            filter(&mut self.d[axis], keep);
            filter(&mut self.q[axis], keep);
            filter(&mut self.since[axis], keep);
        }
        filter(&mut self.s, keep);
        filter(&mut self.y, keep);
        filter(&mut self.follows, keep);
        filter(&mut self.row, keep);
    }

    /// Number of rows.
    pub fn count(&self) -> usize {
        self.y.len()
    }

    /// A column by row.
    fn column(&self, of: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.count()).map(of).collect()
    }

    /// Mean radius and centre, which absorb the set-up.
    pub fn setup(&self) -> Vec<Vec<f64>> {
        vec![vec![1.0; self.count()], self.u[0].clone(), self.u[1].clone()]
    }

    /// ½cos 2θ, for (m₁ − m₂)·R.
    pub fn scale(&self) -> Vec<f64> {
        self.column(|i| 0.5 * (self.u[0][i].powi(2) - self.u[1][i].powi(2)))
    }

    /// −½sin 2θ, for γ·R.
    pub fn squareness(&self) -> Vec<f64> {
        self.column(|i| -self.u[0][i] * self.u[1][i])
    }

    /// ½s·sin 2θ, for v·(τ₁ − τ₂).
    pub fn servo(&self) -> Vec<f64> {
        self.column(|i| self.s[i] * self.u[0][i] * self.u[1][i])
    }

    /// −½d·u and −½d·u², for the mean backlash of an axis and its increase towards the positive end.
    pub fn backlash(&self, axis: usize) -> [Vec<f64>; 2] {
        let mean = self.column(|i| -0.5 * self.d[axis][i] * self.u[axis][i]);
        let slope = self.column(|i| -0.5 * self.d[axis][i] * self.u[axis][i].powi(2));
        [mean, slope]
    }

    /// −½d·(the other u), for the lateral play of an axis.
    pub fn lateral(&self, axis: usize) -> Vec<f64> {
        self.column(|i| -0.5 * self.d[axis][i] * self.u[1 - axis][i])
    }

    /// u²·(the other u), for the sagitta of an axis.
    pub fn straightness(&self, axis: usize) -> Vec<f64> {
        self.column(|i| self.u[axis][i].powi(2) * self.u[1 - axis][i])
    }

    /// ⅛cos 4θ and ⅛sin 4θ, for errors that grow with the third power of the position.
    pub fn third_order(&self) -> [Vec<f64>; 2] {
        // cos 2θ = u₁² − u₂², sin 2θ = 2u₁u₂.
        let double = |i: usize| {
            let (u, v) = (self.u[0][i], self.u[1][i]);
            (u * u - v * v, 2.0 * u * v)
        };
        [
            self.column(|i| {
                let (cos, sin) = double(i);
                0.125 * (cos * cos - sin * sin)
            }),
            self.column(|i| {
                let (cos, sin) = double(i);
                0.25 * cos * sin
            }),
        ]
    }

    /// exp(−φ/w) after each reversal at the positive and at the negative end.
    pub fn spikes(&self, axis: usize, width: f64) -> [Vec<f64>; 2] {
        [1.0, -1.0].map(|end| {
            self.column(|i| {
                let (since, at) = self.since[axis][i];
                if at == end { (-since / width).exp() } else { 0.0 }
            })
        })
    }

    /// u·cos(2πq/p) and u·sin(2πq/p).
    pub fn cyclic(&self, axis: usize, pitch_mm: f64) -> [Vec<f64>; 2] {
        let phase = |i: usize| TAU * self.q[axis][i] / pitch_mm;
        [self.column(|i| self.u[axis][i] * phase(i).cos()), self.column(|i| self.u[axis][i] * phase(i).sin())]
    }
}
