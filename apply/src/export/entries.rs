//! The displacements of axis lines that make the volumetric error of a machine least over a travel.
//!
//! A control knows where the lines of its rotary axes are, and nothing of their orientation. Where the lines of the
//! machine are tilted, or do not meet, displaced lines still describe a part of the error. With `e(q)` the volumetric
//! error of the machine, `f(q, v)` that of a machine whose lines are displaced by `v`, and `z` the zero of the
//! workpiece,
//!
//! ```text
//! v = argmin mean |e(q) − f(q, v) − z|²
//! ```
//!
//! over the travel. The zero of a workpiece is measured on the table, so that a constant vector in the table frame is no
//! error. Gauss and Newton's iteration starts at the plain displacements, the location errors themselves, and leaves
//! there what the travel does not determine.

use abbe_model::Diagnostic;
use abbe_model::chain::{ERRORS_PER_AXIS, Frame};
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::driver::Driver;
use abbe_model::effect::Effect;
use abbe_model::frames::Point;
use abbe_model::session::readings::Readings;
use nalgebra::{DMatrix, DVector, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use super::frames::location_errors;
use super::travel::Travel;
use crate::compare::workspace::point_by;
use crate::correction::Correction;
use crate::volumetric::Size;
use abbe_identify::model_file::IdentifiedModel;
use abbe_identify::model_file::carried::States;
use abbe_identify::model_file::errors::EstimatedErrors;
use abbe_identify::numerics::parallel;
use abbe_model::pose::Aim;

/// Iterations. The displacements are small against the machine: the second step is already below a nanometre.
const ITERATIONS: usize = 3;
/// Least length of a vector of the set-up beside the others, of its own.
const LEAST_SHARE: f64 = 1e-4;
/// Least eigenvalue over the largest of the directions of displacements that the travel determines.
const LEAST_EIGENVALUE: f64 = 1e-8;

/// The volumetric error over the travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Remaining {
    /// Without changes of the entries.
    pub without: Size,
    /// With the plain entries: the location errors of the lines themselves.
    pub plain: Size,
    /// With the entries that are written.
    pub written: Size,
    /// Whether base and target are presumed to be set up anew, so that their shifts are no errors; otherwise only the
    /// zero of the workpiece is.
    pub set_up_anew: bool,
}

impl Remaining {
    /// What the entries leave, in a sentence.
    pub fn words(&self) -> String {
        let [without, plain, written] =
            [self.without, self.plain, self.written].map(|size| format!("{:.1}", size.rms_um));
        let presumed = match self.set_up_anew {
            true => {
                "base and target are presumed to be set up anew (a shift and a rotation of the base and an offset of the \
                     target count as no error)"
            }
            false => {
                "the zero of the workpiece is presumed to be measured on the table (a constant shift counts as no error)"
            }
        };
        format!(
            "the errors of the model are {without} um rms over the range of its readings; the plain location errors leave \
             {plain}, those written, which leave least without the effects, {written}, the whole model with its effects 0; \
             {presumed}"
        )
    }
}

/// An error that the control's model does not represent.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NotRepresented {
    /// The location error or the effect.
    pub id: String,
    /// Rms over the travel of what the best entries leave of it, µm.
    pub rms_um: f64,
}

/// The lines of a machine over a travel.
pub(super) struct Lines<'m> {
    model: &'m IdentifiedModel,
    tool_mm: [f64; 3],
    grid: Readings,
    weights: Vec<f64>,
    /// The slots of the displacements.
    slots: Vec<usize>,
    /// Vectors of what is set up anew with the machine, orthonormal: no error.
    set_up: Vec<Vec<Vector3<f64>>>,
    /// The volumetric error, centred.
    error: Vec<Vector3<f64>>,
    /// Its derivative by each displacement, centred.
    by_line: Vec<Vec<Vector3<f64>>>,
}

/// Whether an effect is a function of positions, so that it has a value everywhere in the travel.
fn follows_position(effect: &Effect) -> bool {
    let of_position = matches!(effect.driver, Driver::Axis(_) | Driver::None | Driver::Gravity | Driver::GravityAt(_));
    of_position && effect.shape.fits_position_table()
}

/// The location errors by slot that a description without effects states, mm and rad, and what they leave: those of the
/// model, or where it has effects of positions, those that leave least of its volumetric error over the range of its
/// readings.
///
/// # Errors
/// If an error of the model cannot be evaluated there.
pub fn best_locations(model: &IdentifiedModel, tool_mm: [f64; 3]) -> Result<(Vec<f64>, Option<Remaining>), Diagnostic> {
    let mut errors = location_errors(model);
    let estimated = |name: &ErrorName| model.machine.error_slot(name).filter(|_| name.kind == ErrorKind::Location);
    let found = model.parameters.iter().filter(|parameter| !parameter.held);
    let slots: Vec<usize> = found.filter_map(|own| own.id.error().and_then(estimated)).collect();
    if slots.is_empty() || !model.carried_effects().any(|effect| follows_position(&model.effects[effect])) {
        return Ok((errors, None));
    }
    let (free, none) = (vec![true; slots.len()], vec![0.0; slots.len()]);
    let plain: Vec<f64> = slots.iter().map(|slot| errors[*slot]).collect();
    let mut lines = Lines::of(model, slots.clone(), &Travel::measured(model), tool_mm)?;
    let set_up_anew = model.parameters.iter().any(|own| own.id.is_setup() && own.prior_u.is_none());
    if set_up_anew {
        lines = lines.with_free_set_up();
    }
    let best = lines.best(&plain, &free);
    let [without, of_plain, written] = [&none, &plain, &best].map(|entries| lines.remaining(entries));
    // What the travel hardly determines is not improved by steps of first order.
    let is_better = written.rms_um < of_plain.rms_um;
    if is_better {
        slots.iter().zip(best).for_each(|(slot, value)| errors[*slot] = value);
    }
    let written = if is_better { written } else { of_plain };
    Ok((errors, Some(Remaining { without, plain: of_plain, written, set_up_anew })))
}

impl<'m> Lines<'m> {
    /// The lines of a model whose displacements have these slots.
    ///
    /// # Errors
    /// If an error of the model cannot be evaluated over the travel.
    pub fn of(
        model: &'m IdentifiedModel,
        slots: Vec<usize>,
        travel: &Travel,
        tool_mm: [f64; 3],
    ) -> Result<Lines<'m>, Diagnostic> {
        let (grid, weights) = travel.grid(model);
        let mut errors = EstimatedErrors::of_model(model, tool_mm, model.table_mm);
        errors.effects.retain(|estimated| follows_position(&estimated.effect));
        let correction = Correction { machine: &model.machine, errors: &errors, tool_mm, aim: Aim::Position };
        let error = correction.pose_errors(&grid)?.into_iter().map(|six| Vector3::new(six[0], six[1], six[2]));
        let error = error.collect();
        let (set_up, by_line) = (Vec::new(), Vec::new());
        let mut lines = Lines { model, tool_mm, error, by_line, grid, weights, slots, set_up };
        lines.centre();
        Ok(lines)
    }

    /// The same where base and tool are set up anew: a rotation of the base and an offset of the tool point are no errors.
    pub fn with_free_set_up(mut self) -> Lines<'m> {
        let machine = &self.model.machine;
        let none = machine.body_errors(|_| false, |_| 0.0);
        let point = |row: usize, offset: usize| {
            let mut state = Vec::new();
            self.grid.state(machine, row, &mut state);
            let mut tool = self.tool_mm;
            if let Some(coordinate) = tool.get_mut(offset) {
                *coordinate += 1.0;
            }
            Vector3::from(
                machine.in_frame(Frame::Table, &state, &none, machine.in_r(Frame::Tool, &state, &none, Point(tool))).0,
            )
        };
        const NO_OFFSET: usize = 3;
        let places = parallel::map(self.grid.rows(), &|row| point(row, NO_OFFSET));
        let turns = [Vector3::x(), Vector3::y(), Vector3::z()]
            .map(|about| places.iter().map(|place| about.cross(place)).collect::<Vec<_>>());
        let offsets = [0, 1, 2].map(|offset| {
            let moved = parallel::map(self.grid.rows(), &|row| point(row, offset));
            moved.iter().zip(&places).map(|(moved, place)| moved - place).collect::<Vec<_>>()
        });
        for vectors in turns.into_iter().chain(offsets) {
            let before = self.product(&vectors, &vectors);
            let mut vectors = self.centred(vectors);
            let norm = self.product(&vectors, &vectors).sqrt();
            if norm > LEAST_SHARE * before.sqrt() {
                vectors.iter_mut().for_each(|vector| *vector /= norm);
                self.set_up.push(vectors);
            }
        }
        self.centre();
        self
    }

    /// Takes what is no error off the error and its derivatives.
    fn centre(&mut self) {
        let error = std::mem::take(&mut self.error);
        self.error = self.centred(error);
        self.by_line = self.slots.iter().map(|slot| self.by_slot(*slot)).collect();
    }

    /// Vectors less their mean, the zero of the workpiece, and less what is set up anew.
    fn centred(&self, mut vectors: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
        let mean: Vector3<f64> = vectors.iter().zip(&self.weights).map(|(vector, weight)| vector * *weight).sum();
        vectors.iter_mut().for_each(|vector| *vector -= mean);
        for set_up in &self.set_up {
            let share = self.product(&vectors, set_up);
            vectors.iter_mut().zip(set_up).for_each(|(vector, own)| *vector -= own * share);
        }
        vectors
    }

    /// The derivative of the tool point by an error, centred.
    fn by_slot(&self, slot: usize) -> Vec<Vector3<f64>> {
        let machine = &self.model.machine;
        let derivatives = parallel::map(self.grid.rows(), &|row| {
            let mut state = Vec::new();
            self.grid.state(machine, row, &mut state);
            point_by(machine, &state, self.tool_mm, slot)
        });
        self.centred(derivatives)
    }

    /// The volumetric error of the machine with displaced lines and no other error, centred.
    fn displaced(&self, displacements: &[f64]) -> Vec<Vector3<f64>> {
        let machine = &self.model.machine;
        let value = |slot: usize| {
            self.slots.iter().zip(displacements).filter(|(own, _)| **own == slot).map(|(_, value)| *value).sum::<f64>()
        };
        let bodies = machine.body_errors(|slot| value(slot) != 0.0, value);
        let none = machine.body_errors(|_| false, |_| 0.0);
        let vectors = parallel::map(self.grid.rows(), &|row| {
            let mut state = Vec::new();
            self.grid.state(machine, row, &mut state);
            let point = |bodies: &[_]| {
                let tool = machine.in_r(Frame::Tool, &state, bodies, Point(self.tool_mm));
                Vector3::from(machine.in_frame(Frame::Table, &state, bodies, tool).0)
            };
            point(&bodies) - point(&none)
        });
        self.centred(vectors)
    }

    /// What displacements leave of the volumetric error.
    fn residual(&self, displacements: &[f64]) -> Vec<Vector3<f64>> {
        let displaced = self.displaced(displacements);
        self.error.iter().zip(displaced).map(|(error, displaced)| error - displaced).collect()
    }

    fn product(&self, a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
        a.iter().zip(b).zip(&self.weights).map(|((a, b), weight)| a.dot(b) * weight).sum()
    }

    /// Rms and largest length of vectors.
    fn size(&self, vectors: &[Vector3<f64>]) -> Size {
        let largest = vectors.iter().map(Vector3::norm).fold(0.0, f64::max);
        Size { largest_um: largest * 1e3, rms_um: self.product(vectors, vectors).max(0.0).sqrt() * 1e3 }
    }

    /// The size of what displacements leave.
    pub fn remaining(&self, displacements: &[f64]) -> Size {
        self.size(&self.residual(displacements))
    }

    /// The displacements by each of some vectors, for the free lines: the pseudo-inverse of their derivatives.
    fn solve(&self, free: &[bool], vectors: &[&[Vector3<f64>]]) -> DMatrix<f64> {
        let count = self.slots.len();
        let kept = |i: usize, j: usize, value: f64| if free[i] && free[j] { value } else { 0.0 };
        let normal =
            DMatrix::from_fn(count, count, |i, j| kept(i, j, self.product(&self.by_line[i], &self.by_line[j])));
        let eigen = normal.symmetric_eigen();
        let least = LEAST_EIGENVALUE * eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
        let inverse = eigen.eigenvalues.map(|value| if value > least { 1.0 / value } else { 0.0 });
        let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
        let right =
            DMatrix::from_fn(count, vectors.len(), |i, j| kept(i, i, self.product(&self.by_line[i], vectors[j])));
        inverse * right
    }

    /// The displacements that make the error least; those of lines that are not free stay plain.
    pub fn best(&self, plain: &[f64], free: &[bool]) -> Vec<f64> {
        let mut best = DVector::from_row_slice(plain);
        for _ in 0..ITERATIONS {
            best += self.solve(free, &[&self.residual(best.as_slice())]).column(0);
        }
        best.as_slice().to_vec()
    }

    /// The change of the best displacements by each parameter of the model, and what the displacements leave of each
    /// error or effect.
    ///
    /// # Errors
    /// If an error of the model cannot be evaluated over the travel.
    pub fn by_parameter(&self, free: &[bool]) -> Result<(Vec<(usize, DVector<f64>)>, Vec<NotRepresented>), Diagnostic> {
        let model = self.model;
        let states = States { readings: self.grid.clone(), tool_mm: self.tool_mm, table_mm: model.table_mm };
        let carried = model.carried_parameters();
        let used = |parameter: usize| {
            model.parameters[parameter].effect.is_none_or(|effect| follows_position(&model.effects[effect]))
        };
        let mut slots: Vec<usize> = Vec::new();
        let contributions: Vec<_> = model
            .contributions(&states)?
            .into_iter()
            .filter(|one| one.slot < model.machine.axes.len() * ERRORS_PER_AXIS && used(carried[one.parameter]))
            .collect();
        slots.extend(contributions.iter().map(|one| one.slot));
        slots.sort_unstable();
        slots.dedup();
        let by_slot: Vec<Vec<Vector3<f64>>> = slots.iter().map(|slot| self.by_slot(*slot)).collect();
        let mut columns: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); carried.len()];
        for one in &contributions {
            let Ok(place) = slots.binary_search(&one.slot) else { continue };
            let column = &mut columns[one.parameter];
            column.resize(self.weights.len(), Vector3::zeros());
            for (row, (sum, vector)) in column.iter_mut().zip(&by_slot[place]).enumerate() {
                *sum += vector * one.basis.as_ref().map_or(1.0, |basis| basis[row]);
            }
        }
        let (mut changes, mut sources) = (Vec::new(), Vec::<(String, Vec<Vector3<f64>>)>::new());
        for (column, parameter) in columns.into_iter().zip(carried).filter(|(column, _)| !column.is_empty()) {
            let column = self.centred(column);
            changes.push((parameter, self.solve(free, &[&column]).column(0).into_owned()));
            let own = &model.parameters[parameter];
            let id = own.effect.map_or_else(|| own.id.to_string(), |effect| model.effects[effect].id());
            let vectors = column.iter().map(|vector| vector * own.value);
            match sources.iter_mut().find(|(known, _)| *known == id) {
                Some((_, sum)) => sum.iter_mut().zip(vectors).for_each(|(sum, vector)| *sum += vector),
                None => sources.push((id, vectors.collect())),
            }
        }
        let mut left: Vec<NotRepresented> = sources
            .into_iter()
            .map(|(id, vectors)| {
                let change = self.solve(free, &[&vectors]);
                let rest = (0..vectors.len()).map(|row| {
                    let lines = self.by_line.iter().zip(&change);
                    vectors[row] - lines.map(|(by_line, change)| by_line[row] * *change).sum::<Vector3<f64>>()
                });
                NotRepresented { id, rms_um: self.size(&rest.collect::<Vec<_>>()).rms_um }
            })
            // A nanometre is the rounding of the entries.
            .filter(|left| left.rms_um > 1e-3)
            .collect();
        left.sort_by(|a, b| b.rms_um.total_cmp(&a.rms_um));
        Ok((changes, left))
    }
}
