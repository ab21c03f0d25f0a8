//! The neutral table: where each axis is. Any control can be set by it, whatever the names of its parameters.
//!
//! In the frame R of the bed, with all axes at zero: a point and the direction of each rotary axis, the direction of each
//! linear axis; nominal, identified, the change and its standard uncertainty. The point of the identified axis is the one
//! nearest to the nominal point, so that its change is across the axis.

use abbe_identify::model_file::IdentifiedModel;
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorKind;
use nalgebra::{DMatrix, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use super::frames::{location_errors, tool_side, workpiece_side};

/// The place of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct AxisPlace {
    /// The axis.
    pub axis: String,
    /// Rotary or linear.
    pub kind: AxisKind,
    /// A point on a rotary axis, mm: x, y, z. Empty for a linear axis, which is nowhere in particular.
    pub point_mm: Vec<Place>,
    /// Its direction, of length 1: x, y, z.
    pub direction: Vec<Place>,
}

/// A coordinate of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Place {
    /// Of the machine without errors.
    pub nominal: f64,
    /// With the identified location errors; absent if the readings do not determine it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub identified: Option<f64>,
    /// Identified less nominal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change: Option<f64>,
    /// Standard uncertainty of the change.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub u: Option<f64>,
}

/// Step of a difference, mm and rad: the change is linear in the errors to far less than their uncertainty.
const STEP: f64 = 1e-5;
/// Change along a direction that the readings do not determine, mm and 1, above which a coordinate is not determined.
const UNDETERMINED: f64 = 1e-7;

/// The places of the axes of a model, in the order of the chain.
///
/// # Errors
/// If the machine's error angles are small-angle matrices.
pub fn places(model: &IdentifiedModel) -> Result<Vec<AxisPlace>, Diagnostic> {
    let machine = &model.machine;
    let errors = location_errors(model);
    let nominal = lines(machine, &vec![0.0; machine.error_slots()])?;
    let coordinates = |errors: &[f64]| -> Result<Vec<f64>, Diagnostic> {
        let lines = lines(machine, errors)?;
        Ok(lines.iter().zip(&nominal).flat_map(|(line, nominal)| six(line, nominal)).collect())
    };
    let (own, design) = (coordinates(&errors)?, coordinates(&vec![0.0; machine.error_slots()])?);
    // The derivatives by the location errors of the model.
    let mut columns: Vec<(usize, Vec<f64>)> = Vec::new();
    for (index, parameter) in model.parameters.iter().enumerate() {
        let name = parameter.id.error().filter(|name| name.kind == ErrorKind::Location);
        let Some(slot) = name.and_then(|name| machine.error_slot(name)) else { continue };
        let moved = |by: f64| {
            let mut errors = errors.clone();
            errors[slot] += by;
            coordinates(&errors)
        };
        let (ahead, behind) = (moved(STEP)?, moved(-STEP)?);
        columns.push((index, ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * STEP)).collect()));
    }
    let covariance =
        DMatrix::from_fn(columns.len(), columns.len(), |i, j| model.covariance[(columns[i].0, columns[j].0)]);
    let place = |k: usize| {
        let row = |weight: &dyn Fn(usize) -> f64| {
            columns.iter().map(|(index, column)| column[k] * weight(*index)).sum::<f64>()
        };
        let is_determined = model.null_directions.iter().all(|null| row(&|index| null[index]).abs() < UNDETERMINED);
        let derivatives = nalgebra::DVector::from_iterator(columns.len(), columns.iter().map(|(_, column)| column[k]));
        let variance = (derivatives.transpose() * &covariance * &derivatives)[(0, 0)];
        let given = |value: f64| is_determined.then_some(value);
        Place {
            nominal: design[k],
            identified: given(own[k]),
            change: given(own[k] - design[k]),
            u: given(variance.max(0.0).sqrt()),
        }
    };
    Ok((machine.axes.iter().enumerate())
        .map(|(axis, of_axis)| AxisPlace {
            axis: of_axis.name.clone(),
            kind: of_axis.kind,
            point_mm: match of_axis.kind {
                AxisKind::Rotary => (0..3).map(|i| place(6 * axis + i)).collect(),
                AxisKind::Linear => Vec::new(),
            },
            direction: (3..6).map(|i| place(6 * axis + i)).collect(),
        })
        .collect())
}

/// A point of an axis, mm, and its direction.
type AxisLine = (Vector3<f64>, Vector3<f64>);

/// The lines of the axes in R with all axes at zero, in the order of the chain.
fn lines(machine: &Machine, errors: &[f64]) -> Result<Vec<AxisLine>, Diagnostic> {
    let mut found = vec![(Vector3::zeros(), Vector3::z()); machine.axes.len()];
    for branch in [workpiece_side(machine, errors, [0.0; 3])?, tool_side(machine, errors, [0.0; 3])?] {
        for (joint, line) in branch.joints.iter().zip(branch.at_zero().0) {
            found[joint.axis] = line;
        }
    }
    Ok(found)
}

/// The point of a line nearest to that of another, and its direction.
fn six((point, direction): &AxisLine, (nominal, _): &AxisLine) -> [f64; 6] {
    let direction = direction.normalize();
    let nearest = point + direction * (nominal - point).dot(&direction);
    [nearest.x, nearest.y, nearest.z, direction.x, direction.y, direction.z]
}
