//! Paths of a test in polar form: means of runs, and deviations about the least-squares circle.

use std::f64::consts::{PI, TAU};

use num_dual::DualNum;

use super::path::{MovingAxes, Path};
use crate::numerics::circle::{self, Circle};

/// A reading, or the mean of the readings of several runs at one angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct PolarPoint {
    /// Angle, rad.
    pub angle: f64,
    /// Its cosine and sine.
    direction: [f64; 2],
    /// Observed less nominal length, mm.
    pub deviation_mm: f64,
    /// Nominal length, mm.
    pub nominal_mm: f64,
    /// The row of the reading, in the first of the runs.
    pub row: usize,
}

/// A path in polar form, by angle.
#[derive(Clone, Debug)]
pub(super) struct PolarPath(pub Vec<PolarPoint>);

/// The runs in one direction.
fn in_direction(path: &Path, direction: f64) -> Vec<PolarPath> {
    let runs = path.runs.iter().filter(|run| run.direction == direction);
    runs.map(|run| {
        let kept = run.rows.clone().filter(|row| !path.left_out.get(*row).copied().unwrap_or(false));
        let mut points: Vec<PolarPoint> = kept
            .map(|row| PolarPoint {
                angle: path.angle[row],
                direction: [path.angle[row].cos(), path.angle[row].sin()],
                deviation_mm: path.deviation_mm[row],
                nominal_mm: path.nominal_mm[row],
                row,
            })
            .collect();
        points.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        PolarPath(points)
    })
    .collect()
}

/// The runs in one direction together.
pub(super) struct Mean {
    /// Their mean path, at the angles of the first run.
    pub path: PolarPath,
    /// Their number.
    pub runs: usize,
    /// The greatest range of the runs at one of these angles, mm; `None` for a single run.
    pub width_mm: Option<f64>,
}

/// The mean path of the runs in one direction.
pub(super) fn mean(path: &Path, direction: f64) -> Option<Mean> {
    let runs = in_direction(path, direction);
    let (first, others) = runs.split_first()?;
    let mut places = vec![0; others.len()];
    let mut widths = Vec::with_capacity(first.0.len());
    let points = first.0.iter().map(|p| {
        let (mut sum, mut count, mut least, mut most) = (0.0, 1, p.deviation_mm, p.deviation_mm);
        for (run, place) in others.iter().zip(&mut places) {
            if let Some(deviation_mm) = run.at(p.angle, place) {
                sum += deviation_mm;
                count += 1;
                (least, most) = (least.min(deviation_mm), most.max(deviation_mm));
            }
        }
        widths.push(most - least);
        PolarPoint { deviation_mm: (p.deviation_mm + sum) / f64::from(count), ..*p }
    });
    let path = PolarPath(points.collect());
    let width_mm = widths.into_iter().reduce(f64::max).filter(|_| !others.is_empty());
    Some(Mean { path, runs: runs.len(), width_mm })
}

impl PolarPath {
    /// The deviation at an angle (modulo whole turns), interpolated between the neighbouring readings. `place` is that of
    /// the angle before, near which the search begins.
    pub fn at(&self, angle: f64, place: &mut usize) -> Option<f64> {
        const SAME: f64 = 1e-6;
        let points = &self.0;
        let (first, last) = (points.first()?.angle, points.last()?.angle);
        let turns = ((first - SAME - angle) / TAU).ceil();
        let angle = (angle + turns * TAU).clamp(first, f64::INFINITY);
        if angle > last + SAME {
            return None;
        }
        let is_before = |k: usize| points.get(k).is_some_and(|p| p.angle < angle);
        let is_there = |k: &usize| !is_before(*k) && (*k == 0 || is_before(*k - 1));
        let near = [*place, *place + 1].into_iter().find(is_there);
        *place = near.unwrap_or_else(|| points.partition_point(|p| p.angle < angle));
        let next = (*place).min(points.len() - 1);
        if next == 0 {
            return Some(points[0].deviation_mm);
        }
        let (a, b) = (points[next - 1], points[next]);
        let share = ((angle - a.angle) / (b.angle - a.angle).max(SAME)).clamp(0.0, 1.0);
        Some(a.deviation_mm + share * (b.deviation_mm - a.deviation_mm))
    }
}

/// The centre of the least-squares circle of a path, about which the radial deviations are.
pub(super) struct Centre<D> {
    /// Whether the reading is a radius of the path.
    radial: bool,
    /// The mean nominal length, mm.
    nominal_mm: f64,
    /// The circle; `None` on a short arc, where the centre is confounded with the radius.
    circle: Option<Circle<D>>,
    /// Radius of the circle less the nominal length, mm.
    pub radius_mm: D,
}

impl<D: DualNum<Primitive = f64> + Copy> Centre<D> {
    /// If a rotary axis turns, the reading need not be a radius; the centre is then the first harmonic of the reading.
    /// `deviation` gives the deviation of a point, or with dual numbers its derivative too.
    pub fn of(path: &Path, trace: &PolarPath, deviation: impl Fn(&PolarPoint) -> D) -> Centre<D> {
        let count = trace.0.len() as f64;
        let nominal_mm = trace.0.iter().map(|p| p.nominal_mm).sum::<f64>() / count;
        let radial = matches!(path.moves, MovingAxes::Linear { radial: true, .. });
        let mean = |of: &dyn Fn(&PolarPoint) -> D| trace.0.iter().fold(D::from(0.0), |sum, p| sum + of(p)) / count;
        let mut centre = Centre { radial, nominal_mm, circle: None, radius_mm: D::from(0.0) };
        if path.arc() >= PI * 0.99 {
            let points: Vec<[D; 2]> = trace.0.iter().map(|p| centre.point(p, deviation(p))).collect();
            centre.circle = circle::through(&points);
        }
        centre.radius_mm = match &centre.circle {
            Some(circle) => circle.radius - nominal_mm,
            None => mean(&deviation),
        };
        centre
    }

    fn nominal_mm(&self, p: &PolarPoint) -> f64 {
        if self.radial { p.nominal_mm } else { self.nominal_mm }
    }

    fn point(&self, p: &PolarPoint, deviation: D) -> [D; 2] {
        p.direction.map(|along| (deviation + self.nominal_mm(p)) * along)
    }

    /// Distance of a point with this deviation from the centre less the nominal length, mm.
    pub fn deviation_mm(&self, p: &PolarPoint, deviation: D) -> D {
        let Some(circle) = &self.circle else { return deviation };
        let [x, y] = self.point(p, deviation);
        let (x, y) = (x - circle.centre[0], y - circle.centre[1]);
        (x * x + y * y).sqrt() - self.nominal_mm(p)
    }
}
