//! The oracle: bounds for an observer who knows the injected effect. It gives the smallest significant amplitude, the
//! aliases and the attainable held-out error.
//!
//! Columns are central differences on the plant. One oracle serves a kind of session, noise and step; it depends on no
//! random draw.

use super::component::{AxisName, Cartesian, Component, Freedom, unit_size};
use super::effect::{Injected, Shape};
use super::families;
use super::machine::Displacement;
use super::naming::{EffectLabel, named};
use super::noise::Noise;
use super::plan::Plan;
use super::recipe::Recipe;
use super::whitening::{rows_of, whiten};
use nalgebra::{DMatrix, DVector, DVectorView};
use rand::Rng;
use std::collections::HashMap;

/// Prior standard uncertainty of the errors of the machine, µm or arcsec: hardly informative, but every design has full
/// rank.
pub(super) const WEAK_U: f64 = 1000.0;

/// Smallest share of a column that remains after projection on the present model; a smaller one counts as not
/// identifiable.
const MIN_REMAINING_SHARE: f64 = 1e-3;

/// Changes of a reading below this are rounding errors of the difference, µm.
const MIN_CHANGE_UM: f64 = 1e-7;

/// A response of fewer standard deviations per unit of amplitude is a rounding error.
const MIN_SIGNATURE: f64 = 1e-6;

/// The oracle of one kind of session.
#[derive(Clone, Debug)]
pub struct Oracle {
    /// The plan of the session.
    pub plan: Plan,
    /// The noise, assumed known.
    pub noise: Noise,
    /// µm of reading per unit of component, by instant.
    sensitivities: HashMap<Component, Vec<f64>>,
    /// µm of reading per µm or arcsec of each parameter.
    pub(super) base: DMatrix<f64>,
    /// Orthonormal basis of the column space of the parameters in the whitened readings, with the priors as additional
    /// rows.
    parameter_space: DMatrix<f64>,
}

impl Oracle {
    /// The oracle for the plan and the noise of a recipe; effects and seed have no influence.
    pub fn new(recipe: &Recipe) -> Oracle {
        Oracle::on(recipe.plan(), recipe.noise)
    }

    /// The oracle of a plan.
    pub fn on(plan: Plan, noise: Noise) -> Oracle {
        let sensitivities: HashMap<Component, Vec<f64>> =
            components().into_iter().map(|component| (component, sensitivity(&plan, component))).collect();
        let base = DMatrix::from_fn(plan.instants.len(), plan.unknowns.len(), |row, column| {
            let unknown = &plan.unknowns[column];
            if unknown.in_test[plan.instants[row].test] { sensitivities[&unknown.component][row] } else { 0.0 }
        });
        let every_row: Vec<usize> = (0..plan.instants.len()).collect();
        let mut whitened = whiten(&plan, noise, &every_row, base.clone());
        let priors = plan.unknowns.len();
        whitened = whitened.insert_rows(every_row.len(), priors, 0.0);
        for (k, unknown) in plan.unknowns.iter().enumerate() {
            whitened[(every_row.len() + k, k)] = 1.0 / unknown.prior_u_um.unwrap_or(WEAK_U);
        }
        let parameter_space = whitened.qr().q();
        Oracle { plan, noise, sensitivities, base, parameter_space }
    }

    /// µm of reading per unit of amplitude, by instant, to first order.
    pub fn column(&self, effect: &Injected) -> DVector<f64> {
        let size = unit_size(effect.unit()) / unit_size(effect.component.unit());
        let sensitivity = &self.sensitivities[&effect.component];
        DVector::from_fn(self.plan.instants.len(), |row, _| {
            size * effect.basis(&self.plan.instants[row]) * sensitivity[row]
        })
    }

    /// The columns that span the effect at any phase.
    pub fn columns(&self, effect: &Injected) -> DMatrix<f64> {
        let columns: Vec<_> = effect.basis_effects().iter().map(|basis| self.column(basis)).collect();
        DMatrix::from_columns(&columns)
    }

    /// Whitened columns after removal of their projection on the parameters, and their lengths before.
    fn projected(&self, effect: &Injected) -> (DMatrix<f64>, Vec<f64>) {
        let whitened = whiten(&self.plan, self.noise, &rows_of(&self.plan), self.columns(effect));
        let lengths = whitened.column_iter().map(|column| column.norm()).collect();
        let rows = whitened.nrows();
        let mut projected = whitened.insert_rows(rows, self.plan.unknowns.len(), 0.0);
        for _ in 0..2 {
            projected -= &self.parameter_space * self.parameter_space.tr_mul(&projected);
        }
        (projected, lengths)
    }

    /// Orthonormal basis of the response to several effects that the parameters do not explain; no column if none is
    /// identifiable.
    fn response(&self, effects: &[Injected]) -> DMatrix<f64> {
        let parts: Vec<(DMatrix<f64>, Vec<f64>)> = effects.iter().map(|effect| self.projected(effect)).collect();
        let columns: Vec<_> = parts.iter().flat_map(|(projected, _)| projected.column_iter()).collect();
        let lengths: Vec<f64> = parts.iter().flat_map(|(_, lengths)| lengths).copied().collect();
        orthonormal(self.parameter_space.nrows(), columns.into_iter().zip(lengths))
    }

    /// The amplitude, in [`Injected::unit`], at which the expected test statistic of the effect reaches the critical
    /// value of `z` standard deviations for one amplitude. With an unknown phase (cosine and sine) the critical value
    /// is that of χ² with two degrees of freedom at the same probability, and the amplitude that of the phase of this
    /// effect. Infinite if it is not identifiable.
    pub fn smallest_significant_amplitude(&self, effect: &Injected, z: f64) -> f64 {
        let (projected, lengths) = self.projected(effect);
        let coordinates = DVector::from_vec(effect.coordinates());
        let length: f64 = lengths.iter().map(|length| length * length).sum::<f64>().sqrt();
        let response = (&projected * &coordinates).norm();
        if response <= MIN_REMAINING_SHARE * length || response == 0.0 {
            return f64::INFINITY;
        }
        let level = if coordinates.len() == 1 { z * z } else { -2.0 * two_sided_tail(z).ln() };
        level.sqrt() / response
    }

    /// The share of the projected response of this effect that lies in the readings. The rest lies in the priors: it
    /// shifts the set-up parameters and leaves no structure in the residual.
    pub fn share_in_readings(&self, effect: &Injected) -> f64 {
        let direction = self.direction(effect);
        direction.rows(0, self.plan.instants.len()).norm_squared()
    }

    /// The cosine of the largest principal angle between the projected responses of two effects: 1 for effects that are
    /// confounded, 0 if either is not identifiable.
    pub fn largest_angle_cosine(&self, a: &Injected, b: &Injected) -> f64 {
        let (a, b) = (self.response(std::slice::from_ref(a)), self.response(std::slice::from_ref(b)));
        if a.ncols() == 0 || b.ncols() == 0 {
            return 0.0;
        }
        a.tr_mul(&b).singular_values().iter().copied().fold(f64::INFINITY, f64::min).min(1.0)
    }

    /// The share of this effect (at its phase) that another effect explains at any phase: the cosine of the angle
    /// between its projected response and the subspace of the other.
    pub fn explained_share(&self, effect: &Injected, other: &Injected) -> f64 {
        self.share(&self.direction(effect), std::slice::from_ref(other))
    }

    /// The same for several effects together, each with its own amplitude: polynomials of every degree up to one, a
    /// curve as harmonics, steps of free height, both members of a pair.
    pub fn explained_share_of(&self, effect: &Injected, others: &[Injected]) -> f64 {
        self.share(&self.direction(effect), others)
    }

    /// Unit vector of the projected response, or zero.
    fn direction(&self, effect: &Injected) -> DVector<f64> {
        let (projected, lengths) = self.projected(effect);
        let response = projected * DVector::from_vec(effect.coordinates());
        let length: f64 = lengths.iter().map(|length| length * length).sum::<f64>().sqrt();
        let norm = response.norm();
        if norm > MIN_REMAINING_SHARE * length { response / norm } else { response * 0.0 }
    }

    fn share(&self, direction: &DVector<f64>, others: &[Injected]) -> f64 {
        self.response(others).tr_mul(direction).norm().min(1.0)
    }

    /// The strength of an effect at its amplitude, in standard deviations: the square root of the χ² gain of the truth
    /// without noise.
    pub fn strength_sigma(&self, effect: &Injected) -> f64 {
        let (projected, _) = self.projected(effect);
        (projected * DVector::from_vec(effect.coordinates())).norm() * effect.amplitude.abs()
    }

    /// The aliases of this effect: every entry of the catalogue that explains at least `cosine` of it, and every entry
    /// whose expected χ² gain is below that of the truth by at most `sigma` squared. Best first; the truth is one of
    /// them.
    pub fn alias_class(&self, effect: &Injected, cosine: f64, sigma: f64) -> Vec<Alias> {
        let direction = self.direction(effect);
        let strength = self.strength_sigma(effect);
        let mut class: Vec<Alias> = families::catalogue(self.plan.kind, effect)
            .into_iter()
            .map(|other| {
                let share = self.share(&direction, std::slice::from_ref(&other));
                let deficit_sigma = strength * (1.0 - share * share).max(0.0).sqrt();
                Alias { name: named(&other), effect: other, share, deficit_sigma }
            })
            .filter(|alias| alias.share >= cosine || alias.deficit_sigma <= sigma)
            .collect();
        class.sort_by(|a, b| b.share.total_cmp(&a.share));
        class
    }

    /// A random detectable effect, at `factor` times the smallest significant amplitude (z = 1.96). Effects that would
    /// need an unrealistic amplitude, or that affect the priors rather than the readings, are drawn again.
    pub fn random_detectable(&self, factor: f64, random: &mut impl Rng) -> Injected {
        loop {
            let effect = families::random_effect(self.plan.kind, random);
            // A spindle ball with a mount for each test is anywhere within its prior: no remount.
            let allowed = self.plan.shared_mounts
                || !matches!((&effect.shape, effect.component), (Shape::Remount { .. }, Component::SpindleBall(_)));
            let smallest = self.smallest_significant_amplitude(&effect, 1.96);
            let allowed = allowed && self.share_in_readings(&effect) > 0.5;
            if allowed && smallest < largest_sensible(effect.unit()) {
                return effect.with_amplitude(factor * smallest);
            }
        }
    }

    /// Two random effects that are detectable and separable, each at `factor` times its own smallest significant
    /// amplitude.
    pub fn random_pair(&self, factor: f64, random: &mut impl Rng) -> [Injected; 2] {
        loop {
            let pair = [self.random_detectable(factor, random), self.random_detectable(factor, random)];
            let [a, b] = &pair;
            let share = self.explained_share(a, b).max(self.explained_share(b, a));
            if share < PAIR_SHARE {
                return pair;
            }
        }
    }
}

/// Orthonormal columns of the space of projected columns, each with its length before the projection, without those of which
/// nothing remains.
pub(super) fn orthonormal<'c>(rows: usize, columns: impl Iterator<Item = (DVectorView<'c, f64>, f64)>) -> DMatrix<f64> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for (column, length) in columns {
        let mut rest = column.into_owned();
        for _ in 0..2 {
            for other in &basis {
                rest -= other * other.dot(&rest);
            }
        }
        let norm = rest.norm();
        if norm > MIN_REMAINING_SHARE * length && norm > MIN_SIGNATURE {
            basis.push(rest / norm);
        }
    }
    if basis.is_empty() { DMatrix::zeros(rows, 0) } else { DMatrix::from_columns(&basis) }
}

/// Largest permitted collinearity of two effects of one session: cosine of the angle between the responses, in both
/// directions.
const PAIR_SHARE: f64 = 0.5;

/// An alias of a true effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Alias {
    /// Its name in results.
    pub name: EffectLabel,
    /// The effect of the plant, at unit amplitude.
    pub effect: Injected,
    /// The share of the true effect that it explains, as a cosine.
    pub share: f64,
    /// Square root of the expected χ² deficit relative to the truth, in standard deviations.
    pub deficit_sigma: f64,
}

/// Effects with a larger smallest significant amplitude are unrealistic and are not simulated.
fn largest_sensible(unit: &str) -> f64 {
    match unit {
        "ms" => 10.0,
        _ => 4.0,
    }
}

/// All components of the axes that can move, both balls, bar, sensor and trigger.
fn components() -> Vec<Component> {
    let mut components = vec![Component::Bar, Component::Sensor, Component::Trigger];
    for axis in AxisName::ALL {
        for freedom in Freedom::ALL {
            components.push(Component::Motion(freedom, axis));
            components.push(Component::Location(freedom, axis));
        }
    }
    for i in 0..3 {
        components.push(Component::WorkpieceBall(Cartesian(i)));
        components.push(Component::SpindleBall(Cartesian(i)));
    }
    components
}

/// µm of reading per unit of a component, by instant, by central differences over one unit either way.
fn sensitivity(plan: &Plan, component: Component) -> Vec<f64> {
    let step = unit_size(component.unit());
    plan.instants
        .iter()
        .map(|instant| {
            let at = |value| {
                let mut displacement = Displacement::default();
                displacement.add(component, value);
                let stated = &plan.tests[instant.test].stated;
                plan.machine.reading_mm(&instant.commanded, stated, &displacement)
            };
            let change = (at(step) - at(-step)) * 0.5e3;
            if change.abs() < MIN_CHANGE_UM { 0.0 } else { change }
        })
        .collect()
}

/// The two-sided tail probability of the normal distribution at z, by continued fraction (z above 1) or series.
pub fn two_sided_tail(z: f64) -> f64 {
    let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    if z > 2.0 {
        let fraction = (1..=200).rev().fold(z, |below, k| z + f64::from(k) / below);
        2.0 * density / fraction
    } else {
        let mut term = z;
        let mut sum = z;
        for k in 1..60 {
            term *= z * z / f64::from(2 * k + 1);
            sum += term;
        }
        1.0 - 2.0 * density * sum
    }
}
