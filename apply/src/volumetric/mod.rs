//! The volumetric error: the deviation of the tool point from its nominal position in the table frame, anywhere in the
//! workspace.
//!
//! ```text
//! e(q) = T_w(q, E(q))⁻¹ T_t(q, E(q)) p − T_w(q)⁻¹ T_t(q) p
//! ```
//!
//! The errors `E` are functions of the axes. Compensation is that of [`crate::correction`], by the linear axes.

pub mod functions;
mod results;

use abbe_identify::error;
use abbe_model::Diagnostic;
use abbe_model::chain::{BodyErrors, ERRORS_PER_AXIS, Frame, Machine};
use abbe_model::frames::Point;
use abbe_model::sensitivity::SlotValues;
use abbe_model::session::limits::LARGEST;
use abbe_model::session::readings::Readings;
use nalgebra::Vector3;

pub use functions::{ErrorFunction, Form};
pub use results::{AxisShare, Coordinates, MapPosition, Size, Summary};

use crate::correction::{Correction, State};
use abbe_identify::model_file::errors::ErrorsNear;
use abbe_identify::model_file::errors::MachineErrors;
use abbe_identify::numerics::parallel;
use abbe_model::pose::Aim;

/// Maximum number of points of a map.
pub const MAX_POINTS: usize = 1_000_000;

/// A machine with errors.
#[derive(Clone, Debug)]
pub struct MachineWithErrors<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Its errors.
    pub functions: &'a [ErrorFunction],
    /// The tool point in the tool frame, mm.
    pub tool_mm: [f64; 3],
}

/// The volumetric error at one point, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumetricPoint {
    /// Positions of the axes, mm or rad.
    pub positions: Vec<f64>,
    /// Nominal position of the tool point in the table frame.
    pub nominal_mm: [f64; 3],
    /// Its deviation from nominal.
    pub error_mm: [f64; 3],
    /// The compensating commands and their residual error, if requested.
    pub compensated: Option<Compensated>,
}

/// Corrected commands.
#[derive(Clone, Debug, PartialEq)]
pub struct Compensated {
    /// Positions to command, mm or rad; rotary axes unchanged.
    pub positions: Vec<f64>,
    /// The residual error, mm.
    pub error_mm: [f64; 3],
}

impl MachineWithErrors<'_> {
    /// The tool point in the table frame, with errors or without.
    fn point(&self, positions: &[f64], with_errors: bool, only: Option<usize>) -> Vector3<f64> {
        let machine = self.machine;
        let state = machine.axis_positions(positions);
        let errors = if with_errors {
            let mut slots = vec![0.0; machine.error_slots()];
            for function in self.functions {
                if only.is_none_or(|axis| function.slot / ERRORS_PER_AXIS == axis) {
                    slots[function.slot] += function.form.at(positions[function.over]);
                }
            }
            machine.body_errors(|slot| slots[slot] != 0.0, |slot| slots[slot])
        } else {
            vec![BodyErrors::NONE; machine.axes.len()]
        };
        let tool = machine.in_r(Frame::Tool, &state, &errors, Point(self.tool_mm));
        Vector3::from(machine.in_frame(Frame::Table, &state, &errors, tool).0)
    }

    /// The error vector at given axis positions.
    pub fn error_at(&self, positions: &[f64]) -> VolumetricPoint {
        let nominal = self.point(positions, false, None);
        VolumetricPoint {
            positions: positions.to_vec(),
            nominal_mm: nominal.into(),
            error_mm: (self.point(positions, true, None) - nominal).into(),
            compensated: None,
        }
    }

    /// The error vector from the errors of one axis alone, mm.
    pub fn of_axis(&self, positions: &[f64], axis: usize) -> [f64; 3] {
        (self.point(positions, true, Some(axis)) - self.point(positions, false, None)).into()
    }

    /// Axis positions in display units, mm or degrees.
    fn position_text(&self, positions: &[f64]) -> String {
        let axes = self.machine.axes.iter().zip(positions);
        let each: Vec<String> =
            axes.map(|(axis, q)| format!("{} {:.3}", axis.name, axis.kind.to_display(*q))).collect();
        each.join(", ")
    }

    /// The commands of the linear axes that bring the tool to its nominal position.
    ///
    /// # Errors
    /// If the linear axes do not span the space, or the errors are too large.
    pub fn compensate(&self, positions: &[f64]) -> Result<Compensated, Diagnostic> {
        let correction = Correction { machine: self.machine, errors: self, tool_mm: self.tool_mm, aim: Aim::Position };
        let columns = positions.iter().map(|position| vec![*position]).collect();
        let commanded = Readings { positions: columns, channels: 1, ..Readings::default() };
        let corrected = correction.correct(&commanded)?.into_iter().next();
        match corrected.map(|row| (row.state, row.condition, row.positions)) {
            Some((State::Corrected | State::BeyondTravel, _, commands)) => {
                let error_mm = self.point(&commands, true, None) - self.point(positions, false, None);
                Ok(Compensated { positions: commands, error_mm: error_mm.into() })
            }
            Some((_, condition, _)) if condition.is_infinite() => {
                let found = format!("{} linear axes of the machine", Aim::Position.axes(self.machine).len());
                Err(error::not_applicable("compensation", found, "they do not span the space"))
            }
            _ => Err(error::not_applicable("compensation", "no convergence", "the errors are too large")),
        }
    }
}

impl MachineErrors for MachineWithErrors<'_> {
    fn along<'a>(&'a self, _: &'a Readings) -> Result<ErrorsNear<'a>, Diagnostic> {
        Ok(Box::new(|positions| {
            let mut values = SlotValues::zero(self.machine.error_slots());
            for function in self.functions {
                let column = positions.positions[function.over].iter().map(|q| function.form.at(*q));
                match values.varying.iter_mut().find(|(slot, _)| *slot == function.slot) {
                    Some((_, sum)) => sum.iter_mut().zip(column).for_each(|(sum, value)| *sum += value),
                    None => values.varying.push((function.slot, column.collect())),
                }
            }
            Ok(values)
        }))
    }
}

/// The volumetric error at every point of a grid, in the order of the axes, the last one fastest.
///
/// # Errors
/// If the grid has too many points, an error exceeds the limits, or a compensation fails.
pub fn map(
    machine_with_errors: &MachineWithErrors<'_>,
    grid: &[Vec<f64>],
    compensate: bool,
) -> Result<(Vec<VolumetricPoint>, Summary), Diagnostic> {
    let total = grid.iter().try_fold(1_usize, |total, axis| total.checked_mul(axis.len()));
    let Some(total) = total.filter(|total| *total > 0 && *total <= MAX_POINTS) else {
        let found = grid.iter().map(|axis| axis.len() as f64).product();
        let (name, range) = ("a map".to_string(), [1.0, MAX_POINTS as f64]);
        return Err(error::out_of_range(name, found, range, "points"));
    };
    let points = parallel::map(total, &|number| {
        let mut rest = number;
        let mut positions = vec![0.0; grid.len()];
        for (axis, values) in grid.iter().enumerate().rev() {
            positions[axis] = values[rest % values.len()];
            rest /= values.len();
        }
        let mut point = machine_with_errors.error_at(&positions);
        if !point.error_mm.iter().all(|error| error.abs() <= LARGEST) {
            let (error, place) = (norm(point.error_mm), machine_with_errors.position_text(&positions));
            let found = format!("the errors displace the tool by {error:.2e} mm at {place}");
            return Err(error::not_applicable("a map", found, "polynomials grow fast beyond their scale"));
        }
        if compensate {
            point.compensated = Some(machine_with_errors.compensate(&positions)?);
        }
        let by_axis = (0..grid.len()).map(|axis| norm(machine_with_errors.of_axis(&positions, axis))).collect();
        Ok((point, by_axis))
    });
    // With several failures, the first one in grid order is reported.
    let points: Vec<(VolumetricPoint, Vec<f64>)> = points.into_iter().collect::<Result<_, Diagnostic>>()?;
    let machine = machine_with_errors.machine;
    let largest = points.iter().max_by(|(a, _), (b, _)| norm(a.error_mm).total_cmp(&norm(b.error_mm)));
    let residual = compensate.then(|| {
        let compensated_points = points.iter().filter_map(|(point, _)| point.compensated.as_ref());
        Size::of(compensated_points.map(|compensated| norm(compensated.error_mm)))
    });
    let coordinate = |k: usize| Size::of(points.iter().map(|(point, _)| point.error_mm[k]));
    let summary = Summary {
        points: total,
        error: Size::of(points.iter().map(|(point, _)| norm(point.error_mm))),
        largest_at: largest.map_or(Vec::new(), |(point, _)| {
            let named = machine.axes.iter().zip(&point.positions);
            named
                .map(|(axis, q)| MapPosition {
                    axis: axis.name.clone(),
                    position: axis.kind.to_display(*q),
                    unit: axis.kind.unit().to_string(),
                })
                .collect()
        }),
        coordinates: Coordinates { x: coordinate(0), y: coordinate(1), z: coordinate(2) },
        by_axis: machine
            .axes
            .iter()
            .enumerate()
            .map(|(k, axis)| AxisShare {
                axis: axis.name.clone(),
                size: Size::of(points.iter().map(|(_, by_axis)| by_axis[k])),
            })
            .collect(),
        residual,
    };
    Ok((points.into_iter().map(|(point, _)| point).collect(), summary))
}

fn norm(vector: [f64; 3]) -> f64 {
    Vector3::from(vector).norm()
}
