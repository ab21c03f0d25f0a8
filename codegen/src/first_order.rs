//! First-order form: the reading without errors, and a sensitivity coefficient for each error.
//!
//! For a ball bar with the nominal vector `b₀`, its length `L₀ = ‖b₀‖` and `∂b/∂eᵢ = bᵢ`:
//!
//! ```text
//! L ≈ L₀ + Σ (b₀·bᵢ / L₀) eᵢ
//! ```

use abbe_model::Diagnostic;

use crate::normal_form::Ring;
use crate::polynomial::{Monomial, Polynomial};
use crate::symbol::Operand;
use crate::variable::Variable;

/// The first-order form of a reading.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstOrder {
    /// The coordinates without errors; for a length, its square `L₀²`.
    pub nominal: Vec<Polynomial>,
    /// The sensitivities, one for each parameter.
    pub sensitivities: Vec<Sensitivity>,
    /// The reading without errors, if it is not `L₀` itself.
    pub alternative_length: Option<AlternativeLength>,
}

/// `±L₀ + offset`: the reading of a probe without errors.
#[derive(Clone, Debug, PartialEq)]
pub struct AlternativeLength {
    /// 1 or −1.
    pub sign: f64,
    /// The offset.
    pub offset: Polynomial,
}

/// Sensitivity of the coordinates of a reading to one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivity {
    /// The error or instrument parameter.
    pub parameter: Variable,
    /// The coefficient in each coordinate; for a length, the numerator over L₀.
    pub coefficients: Vec<Polynomial>,
    /// Whether the coefficient is divided by L₀.
    pub over_length: bool,
    /// Linear dependence of the column.
    pub column: Column,
}

/// Linear dependence of a column of sensitivities on the earlier columns.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Not zero, and not a multiple of an earlier column.
    Distinct,
    /// Identically zero: the parameter does not affect the reading.
    Zero,
    /// A constant multiple of an earlier column at all positions of the axes: the two parameters are confounded.
    Multiple {
        /// The earlier parameter.
        of: Variable,
        /// The factor: numerator and denominator. The denominator is 1 if it divides the numerator.
        factor: (Polynomial, Polynomial),
    },
}

impl FirstOrder {
    /// First-order form of a bar vector in a ring of first order; `unknowns` are the length error of the bar and the
    /// gain error of its sensor, if included.
    pub(crate) fn of_length(
        ring: &mut Ring<'_>,
        vector: [Operand; 3],
        stated: Operand,
        unknowns: [Option<Operand>; 2],
        parameters: &[Variable],
    ) -> Result<Self, Diagnostic> {
        let vector = cleaned_vector(ring, vector)?;
        let nominal = vector.each_ref().map(|component| without_errors(ring, component));
        let square = ring.cleaned(dot(ring, &nominal, &nominal));
        let length = ring.root(square.clone());
        let stated = ring.normal_form(stated)?;
        let [bar, gain] = unknowns.map(|unknown| unknown.unwrap_or(Operand::constant(0.0)));
        let (bar, gain) = (ring.normal_form(bar)?, ring.normal_form(gain)?);
        let beyond = &length - &stated;
        let mut sensitivities = Vec::new();
        for parameter in parameters {
            let of_bar = coefficient_of(ring, &bar, parameter);
            let of_gain = coefficient_of(ring, &gain, parameter);
            let (coefficient, over_length) = if of_bar.is_zero() && of_gain.is_zero() {
                let slope = vector.each_ref().map(|component| coefficient_of(ring, component, parameter));
                (dot(ring, &nominal, &slope), true)
            } else {
                (&ring.product(&beyond, &of_gain) - &of_bar, false)
            };
            sensitivities.push(Sensitivity {
                parameter: parameter.clone(),
                coefficients: vec![coefficient],
                over_length,
                column: Column::Distinct,
            });
        }
        let form = FirstOrder { nominal: vec![square], sensitivities, alternative_length: None };
        Ok(form.finished(ring))
    }

    /// First-order form of a probe that moves straight towards the artefact's axis: the distance to the axis less the
    /// radius. The rotation of the probing direction by errors across the axis is of second order.
    pub(crate) fn of_way_to_the_axis(
        ring: &mut Ring<'_>,
        stylus: [Operand; 3],
        radius: Operand,
        parameters: &[Variable],
    ) -> Result<Self, Diagnostic> {
        let none = Operand::constant(0.0);
        let mut form = FirstOrder::of_length(ring, stylus, none, [Some(radius), None], parameters)?;
        let radius = ring.normal_form(radius)?;
        form.alternative_length = Some(AlternativeLength { sign: 1.0, offset: -&without_errors(ring, &radius) });
        Ok(form)
    }

    /// First-order form of a probe that moves in a stated direction. With `w = v₀ + d₀·u₀` from the axis to the point
    /// of contact and `L₀ = √(b₀² − a₀·c₀)`, half of the chord that the artefact cuts from the probing line,
    ///
    /// ```text
    /// d₀ = −(b₀ + L₀)/a₀,   ∂d/∂eᵢ = (w·(vᵢ + d₀·uᵢ) − r₀·rᵢ)/L₀
    /// ```
    pub(crate) fn of_stated_way(
        ring: &mut Ring<'_>,
        [stylus, step]: [[Operand; 3]; 2],
        radius: Operand,
        parameters: &[Variable],
    ) -> Result<Self, Diagnostic> {
        let (v, u) = (cleaned_vector(ring, stylus)?, cleaned_vector(ring, step)?);
        let r = ring.normal_form(radius)?;
        let nominal = |vector: &[Polynomial; 3]| vector.each_ref().map(|part| without_errors(ring, part));
        let (v_0, u_0, r_0) = (nominal(&v), nominal(&u), without_errors(ring, &r));
        // In floating point a unit vector has unit length only to rounding.
        if !dot(ring, &u_0, &u_0).is_about(1.0) {
            return Err(Diagnostic::equation(
                "the first order of a distance has no short form where the angle between the stated probing `direction` and \
                 the artefact's axis changes as the axes move; use the exact or the bilinear order",
            ));
        }
        let b = dot(ring, &v_0, &u_0);
        let c = &dot(ring, &v_0, &v_0) - &ring.product(&r_0, &r_0);
        let square = ring.cleaned(&ring.product(&b, &b) - &c);
        let d_0 = -&(&b + &ring.root(square.clone()));
        let along = |start: &[Polynomial; 3], way: &[Polynomial; 3]| -> [Polynomial; 3] {
            std::array::from_fn(|i| &start[i] + &ring.product(&d_0, &way[i]))
        };
        let w = along(&v_0, &u_0);
        let sensitivity = |parameter: &Variable| {
            let slope = |form: &Polynomial| coefficient_of(ring, form, parameter);
            let moved = along(&v.each_ref().map(slope), &u.each_ref().map(slope));
            let coefficient = &dot(ring, &w, &moved) - &ring.product(&r_0, &slope(&r));
            Sensitivity {
                parameter: parameter.clone(),
                coefficients: vec![coefficient],
                over_length: true,
                column: Column::Distinct,
            }
        };
        let form = FirstOrder {
            sensitivities: parameters.iter().map(sensitivity).collect(),
            nominal: vec![square],
            alternative_length: Some(AlternativeLength { sign: -1.0, offset: ring.cleaned(-&b) }),
        };
        Ok(form.finished(ring))
    }

    /// First-order form of coordinates in a ring of first order.
    pub(crate) fn of_coordinates(
        ring: &mut Ring<'_>,
        coordinates: &[Operand],
        parameters: &[Variable],
    ) -> Result<Self, Diagnostic> {
        let forms =
            coordinates.iter().map(|coordinate| ring.normal_form(*coordinate)).collect::<Result<Vec<_>, _>>()?;
        let forms = ring.without_residue(&forms);
        let sensitivities = parameters
            .iter()
            .map(|parameter| Sensitivity {
                parameter: parameter.clone(),
                coefficients: forms.iter().map(|form| coefficient_of(ring, form, parameter)).collect(),
                over_length: false,
                column: Column::Distinct,
            })
            .collect();
        let form = FirstOrder {
            nominal: forms.iter().map(|form| without_errors(ring, form)).collect(),
            sensitivities,
            alternative_length: None,
        };
        Ok(form.finished(ring))
    }

    /// Without residue, and with its columns marked. The coefficients of lengths are compared with each other, and so
    /// are those of angles.
    fn finished(mut self, ring: &Ring<'_>) -> Self {
        // The coefficients of effects have units of their own.
        let kind = |(index, sensitivity): (usize, &Sensitivity)| {
            let alone = matches!(sensitivity.parameter, Variable::Coefficient(_)).then_some(index);
            (alone, sensitivity.parameter.is_angle(), sensitivity.over_length)
        };
        let kinds: Vec<_> = self.sensitivities.iter().enumerate().map(kind).collect();
        for (first, own) in kinds.iter().enumerate() {
            if kinds[..first].contains(own) {
                continue;
            }
            let alike: Vec<usize> = (first..kinds.len()).filter(|index| kinds[*index] == *own).collect();
            let forms: Vec<Polynomial> =
                alike.iter().flat_map(|index| self.sensitivities[*index].coefficients.clone()).collect();
            let mut cleaned = ring.without_residue(&forms).into_iter();
            for index in alike {
                for coefficient in &mut self.sensitivities[index].coefficients {
                    *coefficient = cleaned.next().unwrap_or_default();
                }
            }
        }
        self.mark(ring);
        self
    }

    /// Marks zero columns and constant multiples of earlier columns.
    fn mark(&mut self, ring: &Ring<'_>) {
        // A constant L₀ is a constant factor like any other.
        let fixed = self.nominal.len() == 1 && !self.nominal[0].contains(|atom| ring.moves(atom));
        for index in 0..self.sensitivities.len() {
            let (earlier, rest) = self.sensitivities.split_at_mut(index);
            let this = &mut rest[0];
            if this.coefficients.iter().all(Polynomial::is_zero) {
                this.column = Column::Zero;
                continue;
            }
            let candidates = earlier
                .iter()
                .filter(|other| other.column == Column::Distinct && (fixed || other.over_length == this.over_length));
            for other in candidates {
                if let Some(factor) = fixed_factor(ring, &this.coefficients, &other.coefficients) {
                    this.column = Column::Multiple { of: other.parameter.clone(), factor };
                    break;
                }
            }
        }
    }
}

/// The normal forms of a vector without residue.
fn cleaned_vector(ring: &mut Ring<'_>, vector: [Operand; 3]) -> Result<[Polynomial; 3], Diagnostic> {
    let [x, y, z] = vector.map(|component| ring.normal_form(component));
    let mut forms = ring.without_residue(&[x?, y?, z?]).into_iter();
    Ok(std::array::from_fn(|_| forms.next().unwrap_or_default()))
}

/// The terms without errors.
fn without_errors(ring: &Ring<'_>, form: &Polynomial) -> Polynomial {
    form.filtered(|monomial| monomial.degree(|atom| ring.is_small(atom)) == 0)
}

/// The coefficient of a parameter in a form of first order.
fn coefficient_of(ring: &Ring<'_>, form: &Polynomial, parameter: &Variable) -> Polynomial {
    let Some(atom) = ring.atom_of(parameter) else {
        return Polynomial::default();
    };
    let mut collected = form.collect(|other| other == atom);
    collected.remove(&Monomial(vec![(atom, 1)])).unwrap_or_default()
}

fn dot(ring: &Ring<'_>, a: &[Polynomial; 3], b: &[Polynomial; 3]) -> Polynomial {
    let products = (0..3).map(|i| ring.product(&a[i], &b[i]));
    products.fold(Polynomial::default(), |sum, product| &sum + &product)
}

/// `a/b` if it is constant over all positions of the axes, that is, if all 2×2 minors of the coefficients, grouped by
/// axis position, vanish.
fn fixed_factor(ring: &Ring<'_>, a: &[Polynomial], b: &[Polynomial]) -> Option<(Polynomial, Polynomial)> {
    let by_motion = |column: &[Polynomial]| {
        let mut parts = Vec::new();
        for (coordinate, polynomial) in column.iter().enumerate() {
            for (motion, lengths) in polynomial.collect(|atom| ring.moves(atom)) {
                parts.push(((coordinate, motion), lengths));
            }
        }
        parts
    };
    let (a, b) = (by_motion(a), by_motion(b));
    let same = a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| a.0 == b.0);
    let (first_a, first_b) = (&a.first()?.1, &b.first()?.1);
    let proportional =
        same && a.iter().zip(&b).all(|((_, x), (_, y))| ring.product(x, first_b) == ring.product(first_a, y));
    proportional.then(|| match quotient(ring, first_a, first_b) {
        Some(quotient) => (quotient, Polynomial::constant(1.0)),
        None => (first_a.clone(), first_b.clone()),
    })
}

/// `a/b` if it is a polynomial. Each term of `a` is divided by the first term of `b`; the product then proves the
/// result.
fn quotient(ring: &Ring<'_>, a: &Polynomial, b: &Polynomial) -> Option<Polynomial> {
    let (b_first, b_factor) = b.terms().next()?;
    let mut quotient = Polynomial::default();
    for (monomial, factor) in a.terms() {
        if let Some(monomial) = monomial.divided_by(b_first) {
            quotient.insert(monomial, factor / b_factor);
        }
    }
    (ring.product(&quotient, b) == *a).then_some(quotient)
}
