//! The readings of a path that are not outliers, in the quantities of the faults.

use std::f64::consts::{FRAC_PI_2, PI};

use super::path::Path;

/// A reading.
pub(super) struct Row {
    /// Its row in the test.
    pub row: usize,
    /// Whether it continues a run.
    pub follows: bool,
    /// cos θ and sin θ.
    pub u: [f64; 2],
    /// Direction of the path.
    pub s: f64,
    /// Direction of each axis.
    pub d: [f64; 2],
    /// Position of each axis, mm.
    pub q: [f64; 2],
    /// Angle of the path since the last reversal of each axis in this run, and the end of that reversal.
    pub since: [Option<(f64, f64)>; 2],
    /// Deviation of the length, mm.
    pub y: f64,
}

/// The readings of a path that are not outliers.
pub(super) fn rows(path: &Path) -> Vec<Row> {
    let mut rows = Vec::new();
    for run in &path.runs {
        let mut turned: [Option<(f64, f64)>; 2] = [None, None];
        for row in run.rows.clone() {
            let angle = path.angle[row];
            let follows = row > run.rows.start;
            for axis in 0..2 {
                let direction = |row: usize| path.samples[axis][row].direction;
                if follows && direction(row - 1) != direction(row) {
                    // The axis reverses between this reading and the one before.
                    let offset = FRAC_PI_2 * axis as f64;
                    let end = offset + ((angle - offset) / PI).round() * PI;
                    turned[axis] = Some((end, (end - offset).cos().signum()));
                }
            }
            if !path.left_out.get(row).copied().unwrap_or(false) {
                rows.push(Row {
                    row,
                    follows,
                    u: [angle.cos(), angle.sin()],
                    s: run.direction,
                    d: path.samples.each_ref().map(|samples| samples[row].direction),
                    q: path.samples.each_ref().map(|samples| samples[row].value),
                    since: turned.map(|turned| turned.map(|(at, end)| ((angle - at).abs(), end))),
                    y: path.deviation_mm[row],
                });
            }
        }
    }
    rows
}
