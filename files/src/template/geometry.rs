//! Sizes that a structural code does not state, and the places that follow from them.

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::words::number;

use super::body::{Body, Side};

/// Distance from a rotary axis to the ball that turns about it, mm.
pub(super) const RADIUS_MM: f64 = 100.0;
/// The bar with its extension, mm.
pub(super) const EXTENDED_MM: f64 = 150.0;
/// Half of the width of the table and of the spindle, mm.
pub(super) const TABLE_HALF_MM: f64 = 150.0;
const SPINDLE_HALF_MM: f64 = 60.0;
/// Radius of the bar and of what holds its balls, mm.
pub(super) const STEM_MM: f64 = 10.0;
/// What stays between two bodies, mm, beyond the 5 mm that a plan asks for.
const ROOM_MM: f64 = 10.0;
/// Least height of a workpiece ball above the table, mm: the spindle ball goes below it on a vertical circle.
const LEAST_STAND_MM: f64 = 70.0;
/// Usual height of a workpiece ball above the table, mm.
const USUAL_STAND_MM: f64 = 100.0;
/// That of a machine whose workpiece ball is mounted lower for the extended bar.
const HIGH_STAND_MM: f64 = 220.0;
const USUAL_PIVOT_MM: f64 = 150.0;
const USUAL_GAUGE_MM: f64 = 100.0;
/// The tool of a machine without an axis along Z: its balls are mounted at several heights.
const LONG_GAUGE_MM: f64 = 250.0;
/// Half of a usual travel, mm.
const HALF_TRAVEL_MM: f64 = 300.0;
/// Largest tilt of a head that a plan asks for, and of a table that the linear axes follow, degrees.
pub(super) const HEAD_TILT_DEG: f64 = 45.0;
pub(super) const TABLE_TILT_DEG: f64 = 30.0;
/// Largest elevation of the workpiece ball over a spindle ball, degrees.
const MOST_ELEVATION_DEG: f64 = 30.0;
/// Least range of a sweep of a tilting table, degrees.
const LEAST_RANGE_DEG: f64 = 60.0;

/// Sizes that a structural code does not state, mm; `None`: a usual one, which the files call a guess.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sizes {
    /// From the rotary axes of the head to the spindle nose.
    pub pivot_mm: Option<f64>,
    /// Height of the table surface in R with all axes at zero.
    pub table_mm: Option<f64>,
    /// From the spindle nose to the centre of the spindle ball.
    pub gauge_mm: Option<f64>,
}

/// The sizes of a machine, mm. R is where the rotary axes of the table meet, or at the spindle ball of a machine without
/// them, which with all axes at zero is the same place.
pub(super) struct Geometry {
    pub stated: Sizes,
    /// From the axes of the head to the spindle ball; 0 without a head.
    pub lever: f64,
    pub table: f64,
    pub gauge: f64,
    /// Height of the workpiece balls.
    pub ball_height: f64,
    pub has_head: bool,
}

impl Geometry {
    /// # Errors
    /// If a size is out of its range, or belongs to a part that the machine has not.
    pub fn of(bodies: &[Body], stated: Sizes) -> Result<Geometry, Diagnostic> {
        let rotary = |side: Side| bodies.iter().filter(move |own| own.kind == AxisKind::Rotary && own.side() == side);
        let has_head = rotary(Side::Tool).next().is_some();
        if stated.pivot_mm.is_some() && !has_head {
            return Err(Diagnostic::session(
                "a pivot length is stated, but the head of this machine has no rotary axis",
                "state it for a code with a rotary axis between b and t",
            ));
        }
        let within = |what: &str, stated: Option<f64>, usual: f64, [least, most]: [f64; 2]| {
            let mm = stated.unwrap_or(usual);
            if mm >= least && mm <= most {
                return Ok(mm);
            }
            Err(Diagnostic::session(
                format!("{what} is {} mm", number(mm)),
                format!("a value from {} to {} mm is expected", number(least), number(most)),
            ))
        };
        let moves_along_z = bodies.iter().any(|own| own.kind == AxisKind::Linear && own.along == 2);
        let usual_gauge = if moves_along_z { USUAL_GAUGE_MM } else { LONG_GAUGE_MM };
        // A vertical axis of the head that carries every axis along Z.
        let lowers = bodies.iter().enumerate().any(|(turning, own)| {
            let lifts = |(index, other): (usize, &Body)| {
                other.kind == AxisKind::Linear && other.along == 2 && (other.on_table || index < turning)
            };
            own.kind == AxisKind::Rotary && !own.on_table && own.along == 2 && !bodies.iter().enumerate().any(lifts)
        });
        let usual_stand = if lowers { HIGH_STAND_MM } else { USUAL_STAND_MM };
        let pivot = within("the pivot length", stated.pivot_mm, USUAL_PIVOT_MM, [10.0, 2000.0])?;
        let table = within("the height of the table surface", stated.table_mm, -usual_stand, [-2000.0, 500.0])?;
        let gauge = within("the gauge length", stated.gauge_mm, usual_gauge, [60.0, 1000.0])?;
        let tilts = rotary(Side::Workpiece).any(|own| own.along != 2);
        Ok(Geometry {
            stated,
            lever: if has_head { pivot + gauge } else { 0.0 },
            table,
            gauge,
            // The ball is at the height of a tilting axis where the table allows it.
            ball_height: if tilts { (table + LEAST_STAND_MM).max(0.0) } else { table + usual_stand },
            has_head,
        })
    }

    /// Length of the stem between table and workpiece ball, mm.
    pub fn stand(&self) -> f64 {
        self.ball_height - self.table
    }

    /// The range of a sweep of a tilting table, degrees, in the direction in which a ball beside the axis rises; `None` if
    /// the table is so high that spindle and table would meet, or the bar not reach.
    pub fn tilt_deg(&self) -> Option<[f64; 2]> {
        let elevation = (self.ball_height / RADIUS_MM).asin().to_degrees();
        let whole = |deg: f64| (deg / 5.0).floor() * 5.0;
        // Up to where the bar would come below the edge of the spindle nose.
        let below_nose = ((self.gauge - 2.0 * STEM_MM) / SPINDLE_HALF_MM).atan().to_degrees();
        let up = whole(MOST_ELEVATION_DEG.min(below_nose) - elevation);
        // Down to where the tilted surface would come to the edge of the nose; three degrees beyond.
        let clears = |deg: &f64| {
            let (sin, cos) = (deg + 3.0).to_radians().sin_cos();
            self.gauge * cos - SPINDLE_HALF_MM * sin >= self.table + 5.0 + ROOM_MM
        };
        let down = (0..=18).map(|step| 5.0 * f64::from(step)).take_while(clears).last()?;
        (up + down >= LEAST_RANGE_DEG).then_some([-down, up])
    }

    /// Distance of the workpiece ball from the axis of a table, across X or Y, mm.
    pub fn beside(&self, tilts: bool) -> f64 {
        match self.tilt_deg() {
            Some(_) if tilts => (RADIUS_MM.powi(2) - self.ball_height.powi(2)).sqrt(),
            _ => RADIUS_MM,
        }
    }

    /// The tilt, degrees, at which a ball under the pivot is at the radius of the bar from a vertical axis, or as far as
    /// 30° brings it.
    pub fn tilted_head_deg(&self) -> f64 {
        (RADIUS_MM / self.lever).min(0.5).asin().to_degrees()
    }

    /// The usual travel of a linear axis, mm, wide enough for the plan.
    pub fn travel(&self, axis: &Body) -> [f64; 2] {
        let follows = if self.has_head {
            (self.lever + RADIUS_MM) * (HEAD_TILT_DEG + 2.0).to_radians().sin() + RADIUS_MM
        } else if self.ball_height > 0.0 {
            RADIUS_MM.hypot(self.ball_height) + RADIUS_MM
        } else {
            0.0
        };
        let half = HALF_TRAVEL_MM.max(((follows + 40.0) / 50.0).ceil() * 50.0);
        let height = (self.ball_height / 50.0).round() * 50.0;
        // A table comes down to bring its ball to the spindle.
        let middle = match (axis.along, axis.on_table) {
            (2, true) => -height,
            (2, false) => height,
            _ => 0.0,
        };
        [middle - half, middle + half]
    }

    /// The corners of the table and of the spindle in R with all axes at zero, mm.
    pub fn table_box(&self) -> [[f64; 3]; 2] {
        let half = TABLE_HALF_MM;
        [[-half, -half, self.table - 40.0], [half, half, self.table]]
    }

    pub fn spindle_box(&self) -> [[f64; 3]; 2] {
        let half = SPINDLE_HALF_MM;
        let top = if self.has_head { self.lever } else { self.gauge + 200.0 };
        [[-half, -half, self.gauge], [half, half, top]]
    }

    /// What a comment says of where a size is from.
    pub fn origin(stated: Option<f64>) -> &'static str {
        if stated.is_some() { "As stated" } else { "A guess. Enter that of the machine" }
    }
}
