//! Readings of a probe as linear equations in four functions of an angle.

use std::f64::consts::{PI, TAU};
use std::fmt::Display;
use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::{BodyErrors, ERRORS_PER_AXIS};
use abbe_model::frames::Point;
use abbe_model::instrument::InstrumentKind;
use abbe_model::instrument::probe::{FORM, Probe, RADIUS};
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::{Prior, Session, Test};

use crate::error;

/// The method in its errors.
const METHOD: &str = "self-calibration";

/// Angles nearer than this are equal, rad: positions in files are rounded to about 0.1 µm.
const ANGLE_TOLERANCE: f64 = 1e-4;
/// Sine of the angle up to which a probing direction is radial.
const DIRECTION_TOLERANCE: f64 = 1e-6;

/// The four unknown functions, in the order of their columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Displacement of the table along the first direction across its axis, as a function of the axis' position:
    /// `E_XC,total`.
    First,
    /// The same along the second direction: `E_YC,total`.
    Second,
    /// Positioning error of the linear axes away from the rotary axis, as a function of the machine angle: `E_radial`.
    Linear,
    /// Form deviation of the artefact's surface, as a function of the angle on the artefact: `W_radial`.
    Artefact,
}

impl Function {
    /// All four.
    pub const ALL: [Function; 4] = [Function::First, Function::Second, Function::Linear, Function::Artefact];
}

/// Equations `Σ a·f(angle) = Δr`, one per reading.
#[derive(Clone, Debug)]
pub struct Equations {
    /// Index of the rotary axis in the machine.
    pub axis: usize,
    /// The two directions of R across the axis: 0, 1, 2 for X, Y, Z. A positive rotation turns the first towards the
    /// second.
    pub across: [usize; 2],
    /// 1 if the axis turns from the first direction towards the second for an increasing command, else −1.
    pub sense: f64,
    /// The angles of each function, rad in (−π, π], ascending.
    pub angles: [Vec<f64>; 4],
    /// One row per reading, one column per angle of a function.
    pub rows: Vec<Vec<f64>>,
    /// Outward deviation of the measured surface from nominal, mm: `Δr`.
    pub outward_mm: Vec<f64>,
    /// The reference of the readings.
    pub reference: Reference,
}

/// The source of an uncalibrated artefact's radius.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// A parameter, estimated from all readings.
    Estimated,
    /// The first reading at which every angle is 0, as in Zimmermann & Ibaraki (2020). It is subtracted from all
    /// readings, and its own noise is not propagated.
    FirstReading,
}

impl Equations {
    /// The column of the first angle of a function.
    pub fn offset(&self, function: Function) -> usize {
        self.angles[..function as usize].iter().map(Vec::len).sum()
    }

    /// Number of unknown values of the functions.
    pub fn columns(&self) -> usize {
        self.angles.iter().map(Vec::len).sum()
    }

    /// The column of a function at an angle, if a reading determines it there.
    pub fn column(&self, function: Function, angle: f64) -> Option<usize> {
        let index = self.angles[function as usize]
            .iter()
            .position(|known| angular_distance(*known, angle) < ANGLE_TOLERANCE)?;
        Some(self.offset(function) + index)
    }

    /// Function and angle of a column.
    pub fn node(&self, column: usize) -> (Function, f64) {
        let mut index = column;
        for function in Function::ALL {
            let angles = &self.angles[function as usize];
            if let Some(angle) = angles.get(index) {
                return (function, *angle);
            }
            index -= angles.len();
        }
        (Function::Artefact, f64::NAN)
    }

    /// The name of a function: `EXC`, `EYC` with the axis' own letters, `E_radial`, `W_radial`.
    pub fn name(&self, function: Function, axis: &str) -> String {
        let letter = |k: usize| ["X", "Y", "Z"][self.across[k]];
        match function {
            Function::First => format!("E{}{axis},total", letter(0)),
            Function::Second => format!("E{}{axis},total", letter(1)),
            Function::Linear => "E_radial".into(),
            Function::Artefact => "W_radial".into(),
        }
    }

    /// The equations of a session. The coefficients are the derivatives of the chain.
    ///
    /// # Errors
    /// If the session does not fit the method: another instrument, no or several rotary axes that turn under the
    /// artefact, another rotary axis that is not at zero, several artefacts or set-ups, a probing direction that is not
    /// radial, no readings.
    pub fn of(session: &Session) -> Result<Equations, Diagnostic> {
        if let Some(other) = session.tests.iter().find(|test| test.station.probe().is_none()) {
            let (found, expected) = (other.station.kind(), InstrumentKind::Probe);
            return Err(error::other_instrument(METHOD, found, expected));
        }
        let tests: Vec<Test> = session.tests.iter().filter(|test| test.readings.is_some()).cloned().collect();
        let Some(first) = tests.first() else {
            return Err(error::no_readings());
        };
        if let Some(other) = tests.iter().find(|test| test.setup != first.setup) {
            return Err(refused(
                format!("tests \"{}\" and \"{}\" have different set-ups", first.name, other.name),
                "all tests must probe one artefact in one clamping: give them the same `setup`",
            ));
        }
        let axis = turning_axis(session, &tests)?;
        let Some((coordinate, sense)) = session.machine.axes[axis].principal() else {
            let name = &session.machine.axes[axis].name;
            return Err(refused(format!("axis `{name}` turns"), "the method is for an axis along X, Y or Z"));
        };
        let along = coordinate.index();
        let mut equations = Equations {
            axis,
            across: [(along + 1) % 3, (along + 2) % 3],
            sense,
            angles: Default::default(),
            rows: Vec::new(),
            outward_mm: Vec::new(),
            reference: match first.priors[RADIUS] {
                Prior::Known => Reference::FirstReading,
                Prior::Free | Prior::Gaussian(_) => Reference::Estimated,
            },
        };
        let mut touches = Vec::new();
        for test in &tests {
            touches.extend(equations.touches(session, test)?);
        }
        for touch in &touches {
            for (known, angle) in equations.angles.iter_mut().zip(touch.angles) {
                if known.iter().all(|known| angular_distance(*known, angle) >= ANGLE_TOLERANCE) {
                    known.push(angle);
                }
            }
        }
        for known in &mut equations.angles {
            known.sort_by(f64::total_cmp);
        }
        if equations.reference == Reference::FirstReading {
            let at_zero = |touch: &&TouchEquation| {
                touch.angles.iter().all(|angle| angular_distance(*angle, 0.0) < ANGLE_TOLERANCE)
            };
            let Some(first) = touches.iter().find(at_zero).map(|touch| touch.outward_mm) else {
                return Err(refused(
                    "no reading at 0° of axis, machine and artefact as reference",
                    "`radius_u_um = inf` makes the radius a parameter instead",
                ));
            };
            for touch in &mut touches {
                touch.outward_mm -= first;
            }
        }
        for touch in touches {
            let mut row = vec![0.0; equations.columns()];
            for function in Function::ALL {
                if let Some(column) = equations.column(function, touch.angles[function as usize]) {
                    row[column] += touch.coefficients[function as usize];
                }
            }
            equations.rows.push(row);
            equations.outward_mm.push(touch.outward_mm);
        }
        Ok(equations)
    }

    /// The probed points of a test, one per reading.
    fn touches(&self, session: &Session, test: &Test) -> Result<Vec<TouchEquation>, Diagnostic> {
        let (Some(probe), Some(readings)) = (test.station.probe(), &test.readings) else {
            return Ok(Vec::new());
        };
        let machine = &session.machine;
        let model = TestModel::new(Arc::clone(machine), test.station.clone(), readings);
        let motions = self.axis * ERRORS_PER_AXIS + 6;
        let slots = [motions + self.across[0], motions + self.across[1], machine.error_slots() + FORM];
        let touched: Vec<TouchAngles> =
            (0..model.rows()).map(|row| self.touch_angles(machine, probe, &model, row)).collect();
        // Eq. (2): a table that stays at 0 has no displacement beyond the reference. Eq. (3): nor has a spot at 0 of
        // the artefact, probed throughout, a form deviation.
        let varies = |angle: fn(&TouchAngles) -> f64| {
            let stays = touched.iter().all(|angles| angular_distance(angle(angles), 0.0) < ANGLE_TOLERANCE);
            f64::from(u8::from(!stays))
        };
        let (axis_varies, spot_varies) = (varies(|angles| angles.position), varies(|angles| angles.on_artefact));
        let nominal = SlotValues::zero(model.slots());
        let sensitivities = model.sensitivities(&nominal, &slots, 0..model.rows());
        (0..model.rows())
            .map(|row| {
                let angles = &touched[row];
                if angles.direction_error > DIRECTION_TOLERANCE {
                    let (name, number, axis) = (&test.name, row + 1, &machine.axes[self.axis].name);
                    let found = format!(
                        "test \"{name}\", reading {number}: the probe does not move straight towards axis `{axis}`"
                    );
                    return Err(refused(found, "the method requires radial probing"));
                }
                // The measured radius increases as the distance decreases.
                let by = |slot: usize| -sensitivities.derivatives[slot][row];
                Ok(TouchEquation {
                    angles: [angles.position, angles.position, angles.angle, angles.on_artefact],
                    coefficients: [axis_varies * by(0), axis_varies * by(1), -1.0, spot_varies * by(2)],
                    outward_mm: sensitivities.readings[row] - readings.observed[row],
                })
            })
            .collect()
    }

    /// The angles of a probed point.
    fn touch_angles(
        &self,
        machine: &abbe_model::chain::Machine,
        probe: &Probe<f64>,
        model: &TestModel,
        row: usize,
    ) -> TouchAngles {
        let state = &model.state(row);
        let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
        let origin = machine.axes[self.axis].origin_mm;
        let stylus = probe.stylus.nominal_in_r::<f64>(machine, state);
        let on_table = machine.in_frame::<f64>(probe.artefact.frame, state, &none, stylus);
        let angle_of = |point: Point<f64>| {
            let [first, second] = self.across.map(|k| point.0[k] - origin[k]);
            second.atan2(first)
        };
        let angle = angle_of(stylus);
        let direction = probe.direction_at::<f64>(machine, state).0;
        let [first, second] = self.across.map(|k| direction[k]);
        TouchAngles {
            position: wrapped(state[self.axis].value),
            angle: wrapped(angle),
            on_artefact: wrapped(angle_of(on_table)),
            // For inward probing the direction is minus the unit vector at the angle.
            direction_error: (first + angle.cos()).hypot(second + angle.sin()),
        }
    }
}

/// The equation of one reading.
struct TouchEquation {
    angles: [f64; 4],
    coefficients: [f64; 4],
    outward_mm: f64,
}

/// The angles of a probed point, rad, and the sine of the angle between probing direction and radius.
struct TouchAngles {
    position: f64,
    angle: f64,
    on_artefact: f64,
    direction_error: f64,
}

/// The error of a session that does not fit the method.
pub(super) fn refused(found: impl Display, expected: impl Display) -> Diagnostic {
    error::not_applicable(METHOD, found, expected)
}

/// The rotary axis that turns under the artefact.
fn turning_axis(session: &Session, tests: &[Test]) -> Result<usize, Diagnostic> {
    let machine = &session.machine;
    let moves = |axis: usize| {
        tests.iter().filter_map(|test| test.readings.as_ref()).any(|readings| {
            let positions = &readings.positions[axis];
            positions.iter().any(|q| (q - positions[0]).abs() > ANGLE_TOLERANCE)
        })
    };
    let rotary = |axis: &usize| machine.axes[*axis].kind == AxisKind::Rotary;
    let turning: Vec<usize> = (0..machine.axes.len()).filter(rotary).filter(|axis| moves(*axis)).collect();
    let [axis] = turning[..] else {
        let names: Vec<&str> = turning.iter().map(|axis| machine.axes[*axis].name.as_str()).collect();
        let found = match names.len() {
            0 => "no rotary axis turns in these tests".into(),
            _ => format!("axes {} turn", names.join(" and ")),
        };
        return Err(refused(found, "the method is for one"));
    };
    if axis >= machine.workpiece_side {
        let found = format!("axis `{}` turns the tool", machine.axes[axis].name);
        return Err(refused(found, "the method is for an axis that turns the table"));
    }
    for other in (0..machine.axes.len()).filter(rotary).filter(|other| *other != axis) {
        let readings = tests.iter().filter_map(|test| test.readings.as_ref());
        if readings.flat_map(|readings| &readings.positions[other]).any(|q| q.abs() > ANGLE_TOLERANCE) {
            return Err(refused(
                format!("axis `{}` does not stand at zero", machine.axes[other].name),
                format!("the directions across axis `{}` are then not those of R", machine.axes[axis].name),
            ));
        }
    }
    Ok(axis)
}

/// An angle in (−π, π].
fn wrapped(angle: f64) -> f64 {
    let turned = angle.rem_euclid(TAU);
    if turned > PI + ANGLE_TOLERANCE / 2.0 { turned - TAU } else { turned }
}

/// The distance of two angles, modulo whole turns.
fn angular_distance(a: f64, b: f64) -> f64 {
    let turned = (a - b).rem_euclid(TAU);
    turned.min(TAU - turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_above_minus_half_a_turn_and_up_to_it() {
        for (angle, expected) in
            [(1.5 * PI, -0.5 * PI), (-0.5 * PI, -0.5 * PI), (PI, PI), (-PI, PI), (2.5 * PI, 0.5 * PI)]
        {
            assert!((wrapped(angle) - expected).abs() < 1e-12, "{angle}: {}", wrapped(angle));
        }
    }
}
