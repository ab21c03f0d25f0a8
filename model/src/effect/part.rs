//! The components that an effect changes. All shapes change one, except those whose direction turns with an axis.

use super::{Component, Effect};
use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::component::{ErrorKind, ErrorName, Freedom};
use crate::driver::Driver;
use crate::scalar::Nominal;

/// A component that an effect changes, with what the basis functions of its shape are there.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectPart {
    /// The component.
    pub component: Component,
    /// `None`: the basis functions of the shape. A sign `s`: `(cos, sin)` become `s (sin, −cos)`, the wave a quarter of a
    /// cycle later.
    pub quadrature: Option<f64>,
}

impl EffectPart {
    /// Whether a component has an error at right angles to it in which a shape that turns with its driver continues: an
    /// error motion of a rotary axis, neither along nor about this axis, over the position of the axis.
    pub fn can_turn(machine: &Machine, component: &Component, driver: &Driver) -> bool {
        at_right_angles(machine, component).is_some()
            && matches!((component, driver), (Component::Axis(name), Driver::Axis(axis)) if name.axis == *axis)
    }

    /// The basis functions of the shape in this component, from those in the component that the effect names.
    pub fn basis<N: Nominal>(&self, basis: &mut [N]) {
        if let (Some(sign), [cos, sin]) = (self.quadrature, basis) {
            (*cos, *sin) = (N::constant(sign) * *sin, N::constant(-sign) * *cos);
        }
    }

    /// The same of columns over the rows of a test, one for each coefficient.
    pub fn columns(&self, mut columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        if let (Some(sign), [cos, sin]) = (self.quadrature, &mut columns[..]) {
            std::mem::swap(cos, sin);
            cos.iter_mut().for_each(|value| *value *= sign);
            sin.iter_mut().for_each(|value| *value *= -sign);
        }
        columns
    }
}

impl Effect {
    /// The components that the effect changes: the one that it names, and for a shape whose direction turns
    /// ([`super::shape::ShapeKind::turns`]) the error at right angles to it.
    ///
    /// ```
    /// # use abbe_model::driver::Driver;
    /// # use abbe_model::effect::shape::Precession;
    /// # use abbe_model::effect::{Component, Effect, Shape};
    /// # let machine = abbe_model::chain::Machine::from_code("w C b t").unwrap();
    /// let shape = Shape::Precession(Precession { order: 2.0, backward: false });
    /// let parts = Effect::new(Component::parse("EAC").unwrap(), Driver::parse("C"), shape).parts(&machine);
    /// assert_eq!(parts[1].component, Component::parse("EBC").unwrap());
    /// ```
    pub fn parts(&self, machine: &Machine) -> Vec<EffectPart> {
        let mut parts = vec![EffectPart { component: self.component.clone(), quadrature: None }];
        if let (Some(sense), Some((component, sign))) = (self.shape.turns(), at_right_angles(machine, &self.component))
        {
            parts.push(EffectPart { component, quadrature: Some(sense * sign) });
        }
        parts
    }
}

/// The error at right angles to a tilt or radial error motion of a rotary axis, and its sign: the direction of the axis
/// times that of the component, as a vector product, is this sign times the direction of the error.
fn at_right_angles(machine: &Machine, component: &Component) -> Option<(Component, f64)> {
    let Component::Axis(name) = component else { return None };
    let axis = &machine.axes[machine.axis_index(&name.axis)?];
    let (about, own) = (axis.own_freedom().index() % 3, name.freedom.index() % 3);
    if axis.kind != AxisKind::Rotary || name.kind != ErrorKind::Motion || own == about {
        return None;
    }
    let freedom = Freedom::ALL[name.freedom.index() - own + (3 - about - own)];
    let cyclic = if (about + 1) % 3 == own { 1.0 } else { -1.0 };
    let sign = cyclic * axis.direction[about].signum();
    Some((Component::Axis(ErrorName { freedom, ..name.clone() }), sign))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the vector product of the direction of the axis and of the component.
    #[test]
    fn the_error_at_right_angles_is_the_vector_product() {
        let mut machine = Machine::from_code("w C b t").unwrap();
        let unit = |k: usize, sign: f64| std::array::from_fn(|i| if i == k { sign } else { 0.0 });
        for (about, sense) in [(0, 1.0), (1, 1.0), (2, 1.0), (0, -1.0), (1, -1.0), (2, -1.0)] {
            let direction: [f64; 3] = unit(about, sense);
            machine.axes[0].direction = direction;
            for freedom in Freedom::ALL {
                let name = ErrorName { kind: ErrorKind::Motion, freedom, axis: "C".to_string() };
                let found = at_right_angles(&machine, &Component::Axis(name));
                let own = freedom.index() % 3;
                let Some((Component::Axis(other), sign)) = found else {
                    assert_eq!(own, about);
                    continue;
                };
                assert_eq!(other.freedom.is_angle(), freedom.is_angle());
                let product = crate::frames::cross_nominal(direction, unit(own, 1.0));
                assert_eq!(product.0, unit(other.freedom.index() % 3, sign));
            }
        }
    }

    /// Columns and basis functions of the part at right angles: those of the wave a quarter of a cycle later, with the
    /// sense as sign.
    #[test]
    fn the_part_at_right_angles_follows_by_a_quarter_of_a_cycle() {
        let part = EffectPart { component: Component::TriggerDelay, quadrature: Some(-1.0) };
        let (sin, cos) = 0.7_f64.sin_cos();
        let mut basis = [cos, sin];
        part.basis(&mut basis);
        let quarter = 0.7 - std::f64::consts::FRAC_PI_2;
        assert!((basis[0] + quarter.cos()).abs() < 1e-15 && (basis[1] + quarter.sin()).abs() < 1e-15);
        assert_eq!(part.columns(vec![vec![cos], vec![sin]]), [[basis[0]], [basis[1]]]);
    }
}
