//! The derivative of the tool's pose by the axes, and its pseudoinverse.
//!
//! A change of an axis position is an error motion along or about the axis. The chain over dual numbers gives the
//! derivative by that motion. Angles enter as arcs at a radius of 1 m, so that both parts of a pose and both kinds of
//! axes are lengths.

use crate::axis::AxisKind;
use crate::chain::{AxisPosition, Machine};
use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector6};
use num_dual::Dual64;

use super::{Aim, points};

/// Maximum number of axes that correct.
pub const MAX_AXES: usize = 12;
/// Radius at which angles count as arcs, mm.
const LEVER_MM: f64 = 1000.0;
/// Share of a step in its prediction below which a step teaches nothing.
const LEAST_SHARE: f64 = 1e-3;
/// Ratio of singular values below which a direction is lost.
const LOST: f64 = 1e-6;

/// Millimetres per internal unit of an axis of a kind.
pub fn lever_mm(kind: AxisKind) -> f64 {
    match kind {
        AxisKind::Linear => 1.0,
        AxisKind::Rotary => LEVER_MM,
    }
}

/// The pseudoinverse of the Jacobian at a position.
pub struct Inverse {
    /// Axes × components; mm per mm, rotations as arcs.
    by_component: SMatrix<f64, MAX_AXES, 6>,
    /// Ratio of the largest to the smallest singular value; infinite if a direction is lost.
    pub condition: f64,
}

impl Inverse {
    /// At axis positions without errors.
    pub fn at(machine: &Machine, state: &[AxisPosition<f64>], tool_mm: [f64; 3], aim: Aim, axes: &[usize]) -> Inverse {
        Inverse::damped(machine, state, (tool_mm, aim), axes, 0.0)
    }

    /// The same with a damping, mm per mm: directions whose singular value is smaller are hardly moved along.
    pub fn damped(
        machine: &Machine,
        state: &[AxisPosition<f64>],
        (tool_mm, aim): ([f64; 3], Aim),
        axes: &[usize],
        damping: f64,
    ) -> Inverse {
        let mut columns = SMatrix::<f64, 6, MAX_AXES>::zeros();
        for (column, axis) in axes.iter().enumerate().take(MAX_AXES) {
            let derivative = derivative(machine, state, tool_mm, aim, *axis) / lever_mm(machine.axes[*axis].kind);
            columns.set_column(column, &derivative);
        }
        let normal: Matrix6<f64> = columns * columns.transpose();
        let eigen = normal.symmetric_eigen();
        let mut order: [usize; 6] = std::array::from_fn(|k| k);
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let largest = eigen.eigenvalues[order[0]];
        let smallest = eigen.eigenvalues[order[aim.rank() - 1]];
        let mut inverse = Matrix6::zeros();
        for k in &order[..aim.rank()] {
            if eigen.eigenvalues[*k] > LOST * LOST * largest {
                let vector = eigen.eigenvectors.column(*k);
                inverse += vector * vector.transpose() / (eigen.eigenvalues[*k] + damping * damping);
            }
        }
        let condition = if smallest > LOST * LOST * largest { (largest / smallest).sqrt() } else { f64::INFINITY };
        Inverse { by_component: columns.transpose() * inverse, condition }
    }

    /// Whether the axes cannot move the tool in some direction.
    pub fn is_singular(&self) -> bool {
        !self.condition.is_finite()
    }

    /// The change of each axis that makes a deviation, in the order of the axes, mm and mm of arc.
    pub fn step(&self, deviation: &Vector6<f64>) -> SVector<f64, MAX_AXES> {
        self.by_component * arcs(deviation)
    }

    /// Corrects the pseudoinverse by an observed step: the axes changed by `step`, mm and mm of arc, and the deviation by
    /// `change`. Broyden's update `H ← H + (s − H y)·sᵀH / (sᵀH y)` (Broyden, Math. Comp. 19 (1965) 577) takes in the
    /// slopes of the errors, which matter where small errors need large motions.
    pub fn observe(&mut self, step: &SVector<f64, MAX_AXES>, change: &Vector6<f64>) {
        let predicted = self.by_component * arcs(change);
        let scale = predicted.dot(step);
        if scale > LEAST_SHARE * step.norm_squared() {
            let row = step.transpose() * self.by_component;
            self.by_component += (step - predicted) * row / scale;
        }
    }
}

/// A deviation as lengths: angles as arcs.
pub fn arcs(deviation: &Vector6<f64>) -> Vector6<f64> {
    let mut arcs = *deviation;
    arcs.fixed_rows_mut::<3>(3).scale_mut(LEVER_MM);
    arcs
}

/// The derivative of the pose by an axis: mm and mm of arc, per mm or rad.
fn derivative(
    machine: &Machine,
    state: &[AxisPosition<f64>],
    tool_mm: [f64; 3],
    aim: Aim,
    axis: usize,
) -> Vector6<f64> {
    let along: Vec<(usize, f64)> = machine.slots_along(axis).collect();
    let share = |slot: usize| along.iter().find(|(own, _)| *own == slot).map(|(_, share)| *share);
    let errors = machine.body_errors(|slot| share(slot).is_some(), |slot| Dual64::new(0.0, share(slot).unwrap_or(0.0)));
    let [point, x, y, z] = points(machine, state, &errors, tool_mm);
    let value = |point: &crate::frames::Point<Dual64>| Vector3::from(point.0.map(|number| number.re));
    let change = |point: &crate::frames::Point<Dual64>| Vector3::from(point.0.map(|number| number.eps));
    let (origin, moved) = (value(&point), change(&point));
    let twice: Vector3<f64> = [x, y, z].iter().map(|end| (value(end) - origin).cross(&(change(end) - moved))).sum();
    let rotation = aim.held(twice * 0.5, &(value(&z) - origin)) * LEVER_MM;
    Vector6::new(moved.x, moved.y, moved.z, rotation.x, rotation.y, rotation.z)
}
