//! The volumetric error of models over the range of axes that all of them cover, with its uncertainty.
//!
//! ```text
//! e(q) = T(q, E(q)) p − T(q, 0) p,    u²(q) = tr(J·C·Jᵀ),   J = ∂e/∂β
//! ```
//!
//! `J` is the derivative of the tool point by the errors, from dual numbers, times the basis functions of effects.

use abbe_model::Diagnostic;
use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::{AxisPosition, ERRORS_PER_AXIS, Frame, Machine};
use abbe_model::driver::Driver;
use abbe_model::frames::Point;
use abbe_model::session::readings::Readings;
use nalgebra::Vector3;
use num_dual::Dual64;
use schemars::JsonSchema;
use serde::Serialize;

use crate::correction::Correction;
use abbe_identify::model_file::IdentifiedModel;
use abbe_identify::model_file::carried::States;
use abbe_identify::model_file::errors::EstimatedErrors;
use abbe_identify::numerics::parallel;
use abbe_model::pose::Aim;
use abbe_trace::validate::MovedParameter;

/// Places along each axis, if the caller states none.
pub const PLACES: usize = 5;
/// Maximum number of points.
const MAX_POINTS: usize = 4096;

/// The volumetric error of a model.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct VolumetricSummary {
    /// Number of points of the grid.
    pub points: usize,
    /// The range of each axis: name, from, to, unit.
    pub axes: Vec<AxisRange>,
    /// Rms length of the error vector, µm.
    pub rms_um: f64,
    /// Largest length of the error vector, µm.
    pub largest_um: f64,
    /// Rms over the grid of the standard uncertainty of the error vector, µm.
    pub u_um: f64,
}

/// The range of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct AxisRange {
    /// The axis.
    pub axis: String,
    /// Least position, mm or degrees.
    pub from: f64,
    /// Greatest position, mm or degrees.
    pub to: f64,
    /// `mm` or `deg`.
    pub unit: String,
}

impl AxisRange {
    /// The range of an axis from internal units.
    pub(crate) fn of(axis: &Axis, [from, to]: [f64; 2]) -> AxisRange {
        AxisRange {
            axis: axis.name.clone(),
            from: axis.kind.to_display(from),
            to: axis.kind.to_display(to),
            unit: axis.kind.unit().to_string(),
        }
    }
}

/// The volumetric error of each model over a grid with a number of places along each axis that moves. Empty if the
/// ranges have nothing in common. Time and driver columns have the reference values of each model.
///
/// # Errors
/// If an error cannot be evaluated on the grid.
pub fn evaluate(models: &[&IdentifiedModel], places: usize) -> Result<Vec<VolumetricSummary>, Diagnostic> {
    let Some(first) = models.first() else { return Ok(Vec::new()) };
    let machine = &first.machine;
    let Some(ranges) = common_ranges(models) else { return Ok(Vec::new()) };
    let grid = grid(&ranges, places);
    let axes: Vec<AxisRange> =
        machine.axes.iter().zip(&ranges).map(|(axis, range)| AxisRange::of(axis, *range)).collect();
    models.iter().map(|model| of_model(model, first.tool_mm, &grid, axes.clone())).collect()
}

/// The volumetric error of a model and of the same model with parameters that have moved, rms in µm; empty if none has, or
/// if the axes have no range.
///
/// # Errors
/// If an error cannot be evaluated on the grid.
pub fn rms_of_moved(model: &IdentifiedModel, moved: &[MovedParameter]) -> Result<Vec<f64>, Diagnostic> {
    if moved.is_empty() {
        return Ok(Vec::new());
    }
    let mut after = model.clone();
    for parameter in &mut after.parameters {
        let id = parameter.id.to_string();
        let changes = moved.iter().map(|moved| &moved.change).filter(|change| change.id == id);
        parameter.value += changes.map(|change| change.value).sum::<f64>() / parameter.display_per_internal;
    }
    Ok(evaluate(&[model, &after], PLACES)?.iter().map(|volume| volume.rms_um).collect())
}

/// The range of every axis that all models cover; `None` if there is none.
fn common_ranges(models: &[&IdentifiedModel]) -> Option<Vec<[f64; 2]>> {
    let machine = &models.first()?.machine;
    machine
        .axes
        .iter()
        .map(|axis| {
            let driver = Driver::Axis(axis.name.clone());
            let mut common = [f64::NEG_INFINITY, f64::INFINITY];
            for range in models.iter().flat_map(|model| &model.ranges).filter(|range| range.driver == driver) {
                common = [common[0].max(range.range[0]), common[1].min(range.range[1])];
            }
            (common[0].is_finite() && common[0] <= common[1]).then_some(common)
        })
        .collect()
}

/// The points of a grid as columns of axis positions.
fn grid(ranges: &[[f64; 2]], places: usize) -> Readings {
    let moving = ranges.iter().filter(|[from, to]| to > from).count() as i32;
    let mut places = places.max(1);
    while places > 1 && (places as f64).powi(moving) > MAX_POINTS as f64 {
        places -= 1;
    }
    let mut positions: Vec<Vec<f64>> = vec![vec![]];
    for [from, to] in ranges {
        let count = if to > from { places } else { 1 };
        let at =
            |k: usize| if count == 1 { 0.5 * (from + to) } else { from + (to - from) * k as f64 / (count - 1) as f64 };
        let longer = |row: &Vec<f64>| (0..count).map(|k| [row.as_slice(), &[at(k)]].concat()).collect::<Vec<_>>();
        positions = positions.iter().flat_map(longer).collect();
    }
    let columns = (0..ranges.len()).map(|axis| positions.iter().map(|row| row[axis]).collect()).collect();
    Readings { positions: columns, channels: 1, ..Readings::default() }
}

fn of_model(
    model: &IdentifiedModel,
    tool_mm: [f64; 3],
    grid: &Readings,
    axes: Vec<AxisRange>,
) -> Result<VolumetricSummary, Diagnostic> {
    let machine = &model.machine;
    // A grid has neither time nor driver columns: the reference values stand for them.
    let rows = grid.rows();
    let grid = Readings {
        time_s: vec![model.reference.time_s; rows],
        drivers: model.reference.means.iter().map(|(name, mean)| (name.clone(), vec![*mean; rows])).collect(),
        ..grid.clone()
    };
    let errors = EstimatedErrors::of_model(model, tool_mm, model.table_mm);
    let correction = Correction { machine, errors: &errors, tool_mm, aim: Aim::Position };
    let vectors = correction.pose_errors(&grid)?;
    let states = States { readings: grid.clone(), tool_mm, table_mm: model.table_mm };
    let contributions = model.contributions(&states)?;
    let mut slots: Vec<usize> = contributions.iter().map(|contribution| contribution.slot).collect();
    slots.sort_unstable();
    slots.dedup();
    slots.retain(|slot| *slot < machine.axes.len() * ERRORS_PER_AXIS);
    let carried = model.carried_parameters();
    let variances = parallel::map(rows, &|row| {
        let mut state = Vec::new();
        grid.state(machine, row, &mut state);
        let mut jacobian = vec![Vector3::zeros(); carried.len()];
        let by_slot: Vec<Vector3<f64>> = slots.iter().map(|slot| point_by(machine, &state, tool_mm, *slot)).collect();
        for contribution in &contributions {
            let Ok(place) = slots.binary_search(&contribution.slot) else { continue };
            let basis = contribution.basis.as_ref().map_or(1.0, |basis| basis[row]);
            jacobian[contribution.parameter] += by_slot[place] * basis;
        }
        let used: Vec<usize> = (0..carried.len()).filter(|k| jacobian[*k] != Vector3::zeros()).collect();
        let mut variance = 0.0;
        for k in &used {
            for l in &used {
                variance += jacobian[*k].dot(&jacobian[*l]) * model.covariance[(carried[*k], carried[*l])];
            }
        }
        variance.max(0.0)
    });
    let length = |error: &[f64; 6]| error[..3].iter().map(|value| value * value).sum::<f64>();
    let mean = |sum: f64| (sum / rows.max(1) as f64).sqrt() * 1e3;
    Ok(VolumetricSummary {
        points: rows,
        axes,
        rms_um: mean(vectors.iter().map(length).sum()),
        largest_um: vectors.iter().map(|error| length(error).sqrt() * 1e3).fold(0.0, f64::max),
        u_um: mean(variances.iter().sum()),
    })
}

/// The derivative of the tool point in the table frame by an error of the machine without errors.
pub(crate) fn point_by(machine: &Machine, state: &[AxisPosition<f64>], tool_mm: [f64; 3], slot: usize) -> Vector3<f64> {
    let errors = machine.body_errors(|own| own == slot, |own| Dual64::new(0.0, f64::from(u8::from(own == slot))));
    let reference = machine.in_r(Frame::Tool, state, &errors, Point::nominal(tool_mm));
    let point = machine.in_frame(Frame::Table, state, &errors, reference);
    let of_linear_position =
        machine.axes[slot / ERRORS_PER_AXIS].kind == AxisKind::Linear && slot % ERRORS_PER_AXIS < 3;
    if of_linear_position { Vector3::zeros() } else { Vector3::from(point.0.map(|coordinate| coordinate.eps)) }
}
