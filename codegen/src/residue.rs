//! Rounding residue of a nominal geometry in normal forms.
//!
//! A coordinate such as `H·sin 30.5° − 38.0654…` cancels to rounding only, and `sin² + cos²` of a number is one to
//! rounding only. Such a residue is below 1e-12 of the largest term of its kind. It says nothing about the machine and is
//! left out; a coefficient that is a simple number to rounding becomes that number.

use std::collections::HashMap;

use num_traits::ToPrimitive;

use crate::constant::rational;
use crate::normal_form::Ring;
use crate::polynomial::{Atom, Monomial, Polynomial};
use crate::symbol::VariableId;
use crate::variable::Variable;

/// Largest share of the largest term that is residue.
const RESIDUE: f64 = 1e-12;
/// Rounding error of a coefficient after some operations.
const ROUNDING: f64 = 1e-14;
/// A length or a position whose size is not known, mm.
const LENGTH_MM: f64 = 100.0;

/// The errors in a term: numbers of lengths and of angles, and the coefficients of effects, whose terms are compared
/// with their own alone.
type Class = (u32, u32, Vec<(Atom, u32)>);

impl Ring<'_> {
    /// The forms without residue. Terms of all forms are compared if they have the same kinds of errors.
    pub(crate) fn without_residue(&self, forms: &[Polynomial]) -> Vec<Polynomial> {
        let largest = self.largest(forms);
        let form = |form: &Polynomial| {
            let mut cleaned = Polynomial::default();
            for (monomial, coefficient) in form.terms() {
                let size = coefficient.to_f64().unwrap_or(f64::INFINITY);
                let most = largest.get(&self.class(monomial)).copied().unwrap_or(0.0);
                if size.abs() * self.size(monomial) >= RESIDUE * most {
                    let simple = rational(size, ROUNDING).unwrap_or_else(|| coefficient.clone());
                    cleaned.insert(monomial.clone(), simple);
                }
            }
            cleaned
        };
        forms.iter().map(form).collect()
    }

    /// One form without residue.
    pub(crate) fn cleaned(&self, form: Polynomial) -> Polynomial {
        self.without_residue(std::slice::from_ref(&form)).pop().unwrap_or(form)
    }

    /// Whether a difference is nothing but residue beside these forms.
    pub(crate) fn is_residue(&self, difference: &Polynomial, forms: &[Polynomial]) -> bool {
        let largest = self.largest(forms);
        difference.terms().all(|(monomial, coefficient)| {
            let most = largest.get(&self.class(monomial)).copied().unwrap_or(0.0);
            coefficient.to_f64().unwrap_or(f64::INFINITY).abs() * self.size(monomial) < RESIDUE * most
        })
    }

    fn largest(&self, forms: &[Polynomial]) -> HashMap<Class, f64> {
        let mut largest: HashMap<Class, f64> = HashMap::new();
        for (monomial, coefficient) in forms.iter().flat_map(Polynomial::terms) {
            let size = coefficient.to_f64().unwrap_or(0.0).abs() * self.size(monomial);
            let most = largest.entry(self.class(monomial)).or_default();
            *most = most.max(size);
        }
        largest
    }

    fn class(&self, monomial: &Monomial) -> Class {
        let mut class = Class::default();
        for (atom, power) in monomial.powers() {
            match atom {
                Atom::Variable(id) | Atom::Sin(id) if self.variable(*id).is_small() => match self.variable(*id) {
                    Variable::Coefficient(_) => class.2.push((*atom, *power)),
                    angle if angle.is_angle() => class.1 += power,
                    _ => class.0 += power,
                },
                _ => {}
            }
        }
        class
    }

    /// The size of a product of lengths, positions and drivers; errors count as one.
    fn size(&self, monomial: &Monomial) -> f64 {
        let size = |atom: Atom| match atom {
            Atom::Variable(id) => self.size_of_variable(id),
            Atom::Root(_) => Ring::root_of_number(atom).map_or(LENGTH_MM, |root| f64::from(root).sqrt()),
            Atom::Sin(_) | Atom::Cos(_) | Atom::Function(_) => 1.0,
        };
        monomial.powers().iter().map(|(atom, power)| size(*atom).powi(*power as i32)).product()
    }

    fn size_of_variable(&self, id: VariableId) -> f64 {
        match self.variable(id) {
            Variable::Driver(quantity) => quantity.range.iter().fold(1.0, |most, end| end.abs().max(most)),
            angle if angle.is_angle() => 1.0,
            Variable::Length(_) | Variable::Position { .. } => LENGTH_MM,
            Variable::Error(_) | Variable::Instrument(_) | Variable::Coefficient(_) => 1.0,
        }
    }
}
