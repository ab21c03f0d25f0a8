//! Denavit–Hartenberg parameters of a calibrated chain of rotary axes, nominal and with the standard uncertainty of each.
//!
//! ```text
//! standard:  T = B · Π_k Rz(θ_k + q_k)·Tz(d_k)·Tx(a_k)·Rx(α_k)·Ry(β_k) · F
//! modified:  T = B · Π_k Tx(a_k)·Rx(α_k)·Ry(β_k)·Rz(θ_k + q_k)·Tz(d_k) · F
//! ```
//!
//! The modified form is that of Craig (Introduction to Robotics, 1989, ch. 3). `β_k` is Hayati's angle (Hayati & Mirmirani,
//! J. Robotic Systems 2 (1985) 397): it is 0 unless two consecutive axes are nearly parallel, where the common normal is
//! ill-defined. `B` is the pose of the first frame in R, `F` that of the tool frame in the last one.
//!
//! The nominal table is the maker's own, or one that follows from the nominal machine (`dh_frames`). The frames of
//! the calibrated table are those of its lines that lie nearest to the nominal ones (`dh_frames`).

use abbe_files::robot::dh::{Convention, Table};
use abbe_identify::error;
use abbe_identify::model_file::IdentifiedModel;
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::component::ErrorKind;
use abbe_model::frames::FixedPose;
use nalgebra::{DMatrix, DVector, Isometry3, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use super::dh_frames::{self, Frames};
use super::entries::best_locations;
use super::frames::tool_side;
use crate::error::unrepresentable;

/// One joint.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DhRow {
    /// The axis.
    pub axis: String,
    /// Length along X, mm.
    pub a_mm: f64,
    /// Angle about X, degrees.
    pub alpha_deg: f64,
    /// Hayati's angle about Y, degrees; 0 unless two consecutive axes are nearly parallel.
    pub beta_deg: f64,
    /// Offset of the joint angle, degrees.
    pub theta_deg: f64,
    /// Length along the axis, mm.
    pub d_mm: f64,
}

impl DhRow {
    /// The parameters in the order a, α, β, θ, d.
    pub fn five(&self) -> [f64; 5] {
        [self.a_mm, self.alpha_deg, self.beta_deg, self.theta_deg, self.d_mm]
    }

    fn of(axis: &str, [a_mm, alpha_deg, beta_deg, theta_deg, d_mm]: [f64; 5]) -> DhRow {
        DhRow { axis: axis.to_string(), a_mm, alpha_deg, beta_deg, theta_deg, d_mm }
    }
}

/// The names of the parameters in their order.
pub const PARAMETERS: [&str; 5] = ["a_mm", "alpha_deg", "beta_deg", "theta_deg", "d_mm"];

/// The standard uncertainties of one joint; absent where the readings do not determine the parameter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DhUncertainty {
    /// The axis.
    pub axis: String,
    /// Of the length along X, mm.
    pub a_mm: Option<f64>,
    /// Of the angle about X, degrees.
    pub alpha_deg: Option<f64>,
    /// Of Hayati's angle, degrees.
    pub beta_deg: Option<f64>,
    /// Of the offset of the joint angle, degrees.
    pub theta_deg: Option<f64>,
    /// Of the length along the axis, mm.
    pub d_mm: Option<f64>,
}

/// The parameters of a chain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DhTable {
    /// The first frame in R.
    pub base: FixedPose,
    /// The joints.
    pub joints: Vec<DhRow>,
    /// The tool frame at the tool point in the last frame.
    pub tool: FixedPose,
}

/// The calibrated and the nominal table of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct DhTables {
    /// The convention of both.
    pub convention: Convention,
    /// With the identified location errors.
    pub calibrated: DhTable,
    /// Of the machine without errors.
    pub nominal: DhTable,
    /// The standard uncertainties of the calibrated parameters.
    pub u: Vec<DhUncertainty>,
    /// Their covariance, row by row in the order of [`DhTables::ids`]; mm and degrees.
    pub covariance: Vec<Vec<f64>>,
}

impl DhTables {
    /// The parameters of the covariance: `J2.a_mm`, ….
    pub fn ids(&self) -> Vec<String> {
        let of_row = |row: &DhRow| PARAMETERS.map(|name| format!("{}.{name}", row.axis));
        self.calibrated.joints.iter().flat_map(of_row).collect()
    }
}

/// Step of a difference, mm and rad.
const STEP: f64 = 1e-5;
/// Change along a direction that the readings do not determine, mm and degrees for one physical size (1 mm, 0.01 rad), above
/// which a parameter is not determined. One that does not change at the nominal machine changes by the size of the errors,
/// some 10⁻³ of this size.
const UNDETERMINED: f64 = 0.05;
/// Largest distance between an axis of the maker's table and of the machine, mm; and of their directions.
const SAME_MM: f64 = 1e-3;
const SAME_DIRECTION: f64 = 1e-6;

/// The tables of a model with its tool point in the tool frame, mm, in a convention: near the maker's `own` table, if it is
/// given.
///
/// # Errors
/// If the chain has linear axes or axes on the workpiece side, its error angles are small-angle matrices, or the maker's
/// table is not that of its machine.
pub fn tables(
    model: &IdentifiedModel,
    tool_mm: [f64; 3],
    convention: Convention,
    own: Option<&Table>,
) -> Result<DhTables, Diagnostic> {
    let machine = &model.machine;
    let rotary = machine.axes.iter().all(|axis| axis.kind == AxisKind::Rotary);
    if !rotary || machine.workpiece_side > 0 || machine.axes.is_empty() {
        return Err(unrepresentable(
            "a table of Denavit–Hartenberg parameters",
            format!("the machine `{}`", machine.code()),
            "it is that of a chain of rotary axes on the tool side; use URDF",
        ));
    }
    let names: Vec<String> = machine.axes.iter().map(|axis| axis.name.clone()).collect();
    let zero = vec![0.0; machine.error_slots()];
    let design = tool_side(machine, &zero, tool_mm)?;
    let nominal = match own {
        Some(table) => of_maker(model, table, convention, design.at_zero().1)?,
        None => dh_frames::frames(&design),
    };
    let of_errors = |errors: &[f64]| -> Result<(DhTable, Vec<f64>), Diagnostic> {
        let branch = tool_side(machine, errors, tool_mm)?;
        let (lines, end) = branch.at_zero();
        let found = dh_frames::near(&nominal, &lines, &end);
        let rows = found.rows(convention);
        let joints: Vec<DhRow> = names.iter().zip(&rows).map(|(name, row)| DhRow::of(name, *row)).collect();
        let table = DhTable { base: FixedPose::from(&found.base), joints, tool: FixedPose::from(&found.tool) };
        Ok((table, rows.into_iter().flatten().collect()))
    };
    let (errors, _) = best_locations(model, tool_mm)?;
    let (mut calibrated, _) = of_errors(&errors)?;
    let (nominal_table, _) = of_errors(&zero)?;
    // Angles near ±180° are those near the nominal ones.
    for (row, nominal) in calibrated.joints.iter_mut().zip(&nominal_table.joints) {
        let near = |angle: &mut f64, nominal: f64| *angle += 360.0 * ((nominal - *angle) / 360.0).round();
        near(&mut row.alpha_deg, nominal.alpha_deg);
        near(&mut row.theta_deg, nominal.theta_deg);
    }
    let mut columns: Vec<(usize, DVector<f64>)> = Vec::new();
    for (index, parameter) in model.parameters.iter().enumerate() {
        let name = parameter.id.error().filter(|name| name.kind == ErrorKind::Location);
        let Some(slot) = name.and_then(|name| machine.error_slot(name)) else { continue };
        let moved = |by: f64| {
            let mut errors = errors.clone();
            errors[slot] += by;
            of_errors(&errors).map(|(_, values)| DVector::from_vec(values))
        };
        // Angles near ±180° differ by a turn.
        let change = (moved(STEP)? - moved(-STEP)?).map(|change| change - 360.0 * (change / 360.0).round());
        columns.push((index, change / (2.0 * STEP)));
    }
    let count = 5 * names.len();
    let jacobian = DMatrix::from_fn(count, columns.len(), |i, j| columns[j].1[i]);
    let own = DMatrix::from_fn(columns.len(), columns.len(), |i, j| model.covariance[(columns[i].0, columns[j].0)]);
    let covariance = &jacobian * own * jacobian.transpose();
    // An origin may lie anywhere on its axis: of axes that are nearly parallel the other parameters follow it a little.
    let along_null = |i: usize| {
        let along = |null: &Vec<f64>| columns.iter().map(|(index, column)| column[i] * null[*index]).sum::<f64>();
        model.null_directions.iter().map(|null| along(null).powi(2)).sum::<f64>()
    };
    let u = |i: usize| {
        let (variance, open) = (covariance[(i, i)].max(0.0), along_null(i));
        (open < variance.max(UNDETERMINED.powi(2))).then(|| (variance + open).sqrt())
    };
    let uncertainty = |(joint, name): (usize, &String)| {
        let [a_mm, alpha_deg, beta_deg, theta_deg, d_mm] = std::array::from_fn(|k| u(5 * joint + k));
        DhUncertainty { axis: name.clone(), a_mm, alpha_deg, beta_deg, theta_deg, d_mm }
    };
    Ok(DhTables {
        convention,
        calibrated,
        nominal: nominal_table,
        u: names.iter().enumerate().map(uncertainty).collect(),
        covariance: (0..count).map(|i| (0..count).map(|j| covariance[(i, j)]).collect()).collect(),
    })
}

/// The nominal frames of the maker's table.
fn of_maker(
    model: &IdentifiedModel,
    table: &Table,
    convention: Convention,
    end: Isometry3<f64>,
) -> Result<Frames, Diagnostic> {
    let refused = |difference: String| {
        let (one, other) = ("the table".to_string(), "the model's machine".to_string());
        Err(error::unlike(one, "that of", other, difference))
    };
    if table.convention != convention {
        return refused("its convention is another".into());
    }
    let (frames, _) = table.frames();
    let joints = table.rows.iter().take_while(|row| row.kind.is_some()).count();
    let axes = &model.machine.axes;
    if joints != axes.len() || table.rows[joints..].iter().any(|row| row.kind.is_some()) {
        return refused(format!("it has {joints} joints before a fixed row, the machine {}", axes.len()));
    }
    for ((axis, row), frame) in axes.iter().zip(&table.rows).zip(&frames) {
        let (point, direction) = (frame.translation.vector, frame.rotation * Vector3::z());
        let off = Vector3::from(axis.origin_mm) - point;
        let across = (off - direction * off.dot(&direction)).norm();
        if across > SAME_MM || (Vector3::from(axis.direction) - direction).norm() > SAME_DIRECTION {
            return refused(format!("joint `{}` is not the axis {}", row.name, axis.name));
        }
    }
    Ok(Frames::of_table(table, joints, &end))
}
