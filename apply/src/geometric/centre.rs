//! The centre of the circle that one ball describes about a turning axis while the other ball is fixed.
//!
//! Let `m` be the vector from the fixed ball to the moving one, `h` its component along the axis, and φ the angle of
//! its transverse component, all nominal. A reading `L` gives the point
//!
//! ```text
//! (u, v) = √(L² − h²) · (cos φ, sin φ)
//! ```
//!
//! The axis passes the fixed ball at the centre of the least-squares circle through these points. Without an extension
//! bar `h = 0` (Jiang 2014, Section 4.2). With an extension bar the lengths are projected onto the base plane of the
//! cone (Sections 4.2.1 and 5.2). `workpiece_ball_mm` states the measured ball position; φ then includes the deviation
//! of the start angle (Eq. 4.1).
//!
//! Jiang (2014): full reference in [`super`].

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::sensitivity::TestModel;
use num_dual::{Derivative, DualNum, DualSVec64};

use abbe_identify::numerics::circle;

/// Tolerance of other axes' nominal motion and of directions, mm or rad.
const MOTION_TOLERANCE: f64 = 1e-6;
/// Number of readings per differentiation.
const PACK: usize = 8;

/// The geometry of a circular test about one rotary axis.
#[derive(Clone, Debug)]
pub struct CircleGeometry {
    /// The axis that turns, by index.
    pub axis: usize,
    /// The two directions of R across the axis: 0, 1, 2 for X, Y, Z.
    pub across: [usize; 2],
    /// Nominal position of the axis relative to the fixed ball, mm, in the directions across.
    pub nominal_mm: [f64; 2],
    /// Position of the moving ball relative to the fixed one, along the axis, mm; nonzero with an extension bar.
    pub height_mm: f64,
    /// Position of the circle's plane relative to the origin of the axis, along the axis, mm.
    pub plane_mm: f64,
    /// Sine and cosine of φ, reading by reading.
    angle: Vec<[f64; 2]>,
}

/// The circle centre from the readings of a test.
#[derive(Clone, Debug)]
pub struct Centre {
    /// Position of the circle's centre relative to the nominal axis, mm, in the directions across.
    pub offset_mm: [f64; 2],
    /// Radius of the fitted circle, mm.
    pub radius_mm: f64,
    /// Derivative of each offset by each reading; 0 for excluded readings.
    pub by_reading: [Vec<f64>; 2],
}

impl CircleGeometry {
    /// From the nominal machine. The error states why the path is no circle.
    pub fn of(machine: &Machine, model: &TestModel) -> Result<CircleGeometry, String> {
        let Some(bar) = model.station().bar() else {
            return Err("it is not a ball-bar test".into());
        };
        let axis = turning(machine, model)?;
        let on_table = axis < machine.workpiece_side;
        let balls = |row| balls(machine, model, bar, row, on_table);
        let (origin, along) = machine.axis_line(axis, &model.state(0));
        let Some(principal) = (0..3).find(|k| (along[*k].abs() - 1.0).abs() < MOTION_TOLERANCE) else {
            return Err(format!("axis `{}` does not lie along X, Y or Z while it turns", machine.axes[axis].name));
        };
        let across = [(principal + 1) % 3, (principal + 2) % 3];
        let (_, standing) = balls(0);
        let mut angle = Vec::with_capacity(model.rows());
        let (mut height_mm, mut plane_mm) = (0.0, 0.0);
        for row in 0..model.rows() {
            let (moving, fixed) = balls(row);
            let from: [f64; 3] = std::array::from_fn(|k| moving[k] - fixed[k]);
            if row == 0 {
                height_mm = from[principal];
                plane_mm = moving[principal] - origin[principal];
            }
            let [u, v] = across.map(|k| from[k]);
            let radius = u.hypot(v);
            if radius < 1.0 {
                return Err(
                    "the moving ball lies on the line through the other ball along the axis, so its angle is undefined"
                        .into(),
                );
            }
            angle.push([v / radius, u / radius]);
        }
        Ok(CircleGeometry {
            axis,
            nominal_mm: across.map(|k| origin[k] - standing[k]),
            across,
            height_mm,
            plane_mm,
            angle,
        })
    }

    /// The circle centre of the readings, without those marked in `left_out`.
    pub fn centre(&self, lengths_mm: &[f64], left_out: &[bool]) -> Result<Centre, String> {
        let kept: Vec<usize> = (0..lengths_mm.len()).filter(|row| !left_out[*row]).collect();
        if let Some(row) = kept.iter().find(|row| lengths_mm[**row] <= self.height_mm.abs()) {
            return Err(format!(
                "reading {} is {:.3} mm, not longer than the nominal distance of the balls along the axis ({:.3} mm)",
                row + 1,
                lengths_mm[*row],
                self.height_mm.abs()
            ));
        }
        let mut centre = Centre {
            offset_mm: [0.0; 2],
            radius_mm: 0.0,
            by_reading: [vec![0.0; lengths_mm.len()], vec![0.0; lengths_mm.len()]],
        };
        let mut points: Vec<[DualSVec64<PACK>; 2]> = Vec::with_capacity(kept.len());
        for pack in kept.chunks(PACK) {
            points.clear();
            for &row in &kept {
                let mut length = DualSVec64::<PACK>::from(lengths_mm[row]);
                if let Some(place) = pack.iter().position(|seeded| *seeded == row) {
                    let mut seed = nalgebra::SVector::<f64, PACK>::zeros();
                    seed[place] = 1.0;
                    length.eps = Derivative::some(seed);
                }
                let radius = (length * length - self.height_mm * self.height_mm).sqrt();
                let [sin, cos] = self.angle[row];
                points.push([radius * cos, radius * sin]);
            }
            let Some(circle) = circle::through(&points) else {
                return Err("its readings do not lie on a circle".into());
            };
            centre.radius_mm = circle.radius.re;
            for (which, coordinate) in circle.centre.iter().enumerate() {
                centre.offset_mm[which] = coordinate.re - self.nominal_mm[which];
                let gradient = coordinate.eps.unwrap_generic(nalgebra::Const::<PACK>, nalgebra::Const::<1>);
                for (place, row) in pack.iter().enumerate() {
                    centre.by_reading[which][*row] = gradient[place];
                }
            }
        }
        Ok(centre)
    }
}

/// The single axis that turns in a test.
fn turning(machine: &Machine, model: &TestModel) -> Result<usize, String> {
    let moves = |axis: &usize| {
        let first = model.state(0)[*axis].value;
        (1..model.rows()).any(|row| (model.state(row)[*axis].value - first).abs() > MOTION_TOLERANCE)
    };
    let moving: Vec<usize> = (0..machine.axes.len()).filter(moves).collect();
    match moving[..] {
        [axis] if machine.axes[axis].kind == AxisKind::Rotary => Ok(axis),
        _ => {
            let names: Vec<&str> = moving.iter().map(|axis| machine.axes[*axis].name.as_str()).collect();
            Err(format!(
                "exactly one rotary axis has to turn, but {} {}",
                if names.is_empty() { "none".into() } else { names.join(", ") },
                if names.len() == 1 { "moves" } else { "move" }
            ))
        }
    }
}

/// Nominal positions of the moving ball and the fixed one in R.
fn balls(machine: &Machine, model: &TestModel, bar: &BallBar<f64>, row: usize, on_table: bool) -> ([f64; 3], [f64; 3]) {
    let [workpiece, spindle] = bar.nominal_mm(machine, &model.state(row));
    if on_table { (workpiece, spindle) } else { (spindle, workpiece) }
}
