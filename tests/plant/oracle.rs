//! What somebody could know who knows the effect: the smallest amplitude that counts as significant, what looks like what, and how well
//! readings can be predicted that nobody fitted.
//!
//! Columns are central differences on the plant itself. Per kind of session, noise and step an oracle is made once; it depends on no draw.

use super::component::{AxisName, Cartesian, Component, Freedom, unit_size};
use super::effect::{Injected, Shape};
use super::families;
use super::machine::Displacement;
use super::naming::{Named, named};
use super::noise::Noise;
use super::plan::Plan;
use super::recipe::Recipe;
use super::whitening::{rows_of, whiten};
use nalgebra::{DMatrix, DVector};
use rand::Rng;
use std::collections::HashMap;

/// Standard uncertainty given to errors of the machine, µm or arcsec: next to nothing known, but every design has full rank.
pub(super) const WEAK_U: f64 = 1000.0;

/// A share of a column that is left after the present model has taken its own; less is not seen.
const SEEN_SHARE: f64 = 1e-3;

/// Changes of a reading below this are rounding errors of the difference, µm.
const MIN_CHANGE_UM: f64 = 1e-7;

/// A signature of fewer standard deviations per unit of amplitude is a rounding error.
const MIN_SIGNATURE: f64 = 1e-6;

/// The oracle of one kind of session.
#[derive(Clone, Debug)]
pub struct Oracle {
    /// The session's plan.
    pub plan: Plan,
    /// The noise, known.
    pub noise: Noise,
    /// µm of reading per unit of component, by instant.
    sensitivities: HashMap<Component, Vec<f64>>,
    /// µm of reading per µm or arcsec of each unknown.
    pub(super) base: DMatrix<f64>,
    /// Orthonormal columns: what unknowns with their priors can do to the whitened readings (priors are extra rows).
    absorbed: DMatrix<f64>,
}

impl Oracle {
    /// The oracle of a recipe's plan and noise; effects and seed do not matter.
    pub fn new(recipe: &Recipe) -> Oracle {
        Oracle::on(recipe.plan(), recipe.noise)
    }

    /// The oracle of a plan.
    pub fn on(plan: Plan, noise: Noise) -> Oracle {
        let sensitivities: HashMap<Component, Vec<f64>> = components()
            .into_iter()
            .map(|component| (component, sensitivity(&plan, component)))
            .collect();
        let base = DMatrix::from_fn(plan.instants.len(), plan.unknowns.len(), |row, column| {
            let unknown = &plan.unknowns[column];
            if unknown.in_test[plan.instants[row].test] {
                sensitivities[&unknown.component][row]
            } else {
                0.0
            }
        });
        let every_row: Vec<usize> = (0..plan.instants.len()).collect();
        let mut whitened = whiten(&plan, noise, &every_row, base.clone());
        let priors = plan.unknowns.len();
        whitened = whitened.insert_rows(every_row.len(), priors, 0.0);
        for (k, unknown) in plan.unknowns.iter().enumerate() {
            whitened[(every_row.len() + k, k)] = 1.0 / unknown.prior_u_um.unwrap_or(WEAK_U);
        }
        let absorbed = whitened.qr().q();
        Oracle {
            plan,
            noise,
            sensitivities,
            base,
            absorbed,
        }
    }

    /// µm of reading per unit of amplitude, by instant, to first order.
    pub fn column(&self, effect: &Injected) -> DVector<f64> {
        let size = unit_size(effect.unit()) / unit_size(effect.component.unit());
        let sensitivity = &self.sensitivities[&effect.component];
        DVector::from_fn(self.plan.instants.len(), |row, _| {
            size * effect.basis(&self.plan.instants[row]) * sensitivity[row]
        })
    }

    /// The columns of everything that the effect can be when its phase is unknown.
    pub fn columns(&self, effect: &Injected) -> DMatrix<f64> {
        let columns: Vec<_> = effect
            .basis_effects()
            .iter()
            .map(|basis| self.column(basis))
            .collect();
        DMatrix::from_columns(&columns)
    }

    /// Whitened columns less what the unknowns can absorb, and how long they were before.
    fn projected(&self, effect: &Injected) -> (DMatrix<f64>, Vec<f64>) {
        let whitened = whiten(&self.plan, self.noise, &rows_of(&self.plan), self.columns(effect));
        let lengths = whitened.column_iter().map(|column| column.norm()).collect();
        let rows = whitened.nrows();
        let mut left = whitened.insert_rows(rows, self.plan.unknowns.len(), 0.0);
        for _ in 0..2 {
            left -= &self.absorbed * self.absorbed.tr_mul(&left);
        }
        (left, lengths)
    }

    /// An orthonormal basis of what effects together can do to the readings beyond the unknowns; no column if none is seen.
    fn signature(&self, effects: &[Injected]) -> DMatrix<f64> {
        let mut basis: Vec<DVector<f64>> = Vec::new();
        for effect in effects {
            let (left, lengths) = self.projected(effect);
            for (column, length) in left.column_iter().zip(lengths) {
                let mut rest = column.into_owned();
                for _ in 0..2 {
                    for other in &basis {
                        rest -= other * other.dot(&rest);
                    }
                }
                let norm = rest.norm();
                if norm > SEEN_SHARE * length && norm > MIN_SIGNATURE {
                    basis.push(rest / norm);
                }
            }
        }
        if basis.is_empty() {
            DMatrix::zeros(self.absorbed.nrows(), 0)
        } else {
            DMatrix::from_columns(&basis)
        }
    }

    /// The amplitude, in [`Injected::unit`], at which the oracle's own test of the effect is expected to reach the level that `z`
    /// standard deviations are for one amplitude. With an unknown phase (cosine and sine) the level is that of χ² with two degrees of
    /// freedom at the same probability, and the amplitude that of this effect's phase. Infinite where nothing is seen.
    pub fn smallest_significant_amplitude(&self, effect: &Injected, z: f64) -> f64 {
        let (left, lengths) = self.projected(effect);
        let coordinates = DVector::from_vec(effect.coordinates());
        let length: f64 = lengths.iter().map(|length| length * length).sum::<f64>().sqrt();
        let seen = (&left * &coordinates).norm();
        if seen <= SEEN_SHARE * length || seen == 0.0 {
            return f64::INFINITY;
        }
        let level = if coordinates.len() == 1 {
            z * z
        } else {
            -2.0 * two_sided_tail(z).ln()
        };
        level.sqrt() / seen
    }

    /// How much of what the unknowns leave of this effect stands in the readings; the rest is only tension in the priors, which pulls the
    /// set-up away from where it is said to be and leaves no structure in any residual.
    pub fn share_in_readings(&self, effect: &Injected) -> f64 {
        let direction = self.direction(effect);
        direction.rows(0, self.plan.instants.len()).norm_squared()
    }

    /// The cosine of the largest principal angle between what two effects can do to the readings beyond the unknowns: 1 for effects that
    /// no reading tells apart, 0 if either is not seen.
    pub fn indistinguishability(&self, a: &Injected, b: &Injected) -> f64 {
        let (a, b) = (
            self.signature(std::slice::from_ref(a)),
            self.signature(std::slice::from_ref(b)),
        );
        if a.ncols() == 0 || b.ncols() == 0 {
            return 0.0;
        }
        a.tr_mul(&b)
            .singular_values()
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min)
            .min(1.0)
    }

    /// How much of this very effect (its phase included) another, with any phase, can do: the cosine of the angle between the
    /// signature and the other's subspace.
    pub fn explained_share(&self, effect: &Injected, other: &Injected) -> f64 {
        self.share(&self.direction(effect), std::slice::from_ref(other))
    }

    /// The same for several effects together, each with its own amplitude: polynomials of every degree up to one, a curve as
    /// harmonics, steps of free height, both members of a pair.
    pub fn explained_share_of(&self, effect: &Injected, others: &[Injected]) -> f64 {
        self.share(&self.direction(effect), others)
    }

    /// Unit vector of the effect's signature, or zero.
    fn direction(&self, effect: &Injected) -> DVector<f64> {
        let (left, lengths) = self.projected(effect);
        let signature = left * DVector::from_vec(effect.coordinates());
        let length: f64 = lengths.iter().map(|length| length * length).sum::<f64>().sqrt();
        let norm = signature.norm();
        if norm > SEEN_SHARE * length {
            signature / norm
        } else {
            signature * 0.0
        }
    }

    fn share(&self, direction: &DVector<f64>, others: &[Injected]) -> f64 {
        self.signature(others).tr_mul(direction).norm().min(1.0)
    }

    /// How many standard deviations stand behind an effect of this amplitude beyond the unknowns: the square root of the χ² that the
    /// truth would gain without noise.
    pub fn strength_sigma(&self, effect: &Injected) -> f64 {
        let (left, _) = self.projected(effect);
        (left * DVector::from_vec(effect.coordinates())).norm() * effect.amplitude.abs()
    }

    /// What could be named in place of this very effect: every entry of the plant's catalogue that can do at least `cosine` of it, and
    /// every near-tie whose χ² is expected to stay behind the truth's by no more than `sigma` squared. Best first; the truth is one.
    pub fn alias_class(&self, effect: &Injected, cosine: f64, sigma: f64) -> Vec<Alias> {
        let direction = self.direction(effect);
        let strength = self.strength_sigma(effect);
        let mut class: Vec<Alias> = families::catalogue(self.plan.kind, effect)
            .into_iter()
            .map(|other| {
                let share = self.share(&direction, std::slice::from_ref(&other));
                let behind_sigma = strength * (1.0 - share * share).max(0.0).sqrt();
                Alias {
                    name: named(&other),
                    effect: other,
                    share,
                    behind_sigma,
                }
            })
            .filter(|alias| alias.share >= cosine || alias.behind_sigma <= sigma)
            .collect();
        class.sort_by(|a, b| b.share.total_cmp(&a.share));
        class
    }

    /// A random effect that this session sees, at `factor` times the smallest significant amplitude (z = 1.96). Effects that would have to
    /// be larger than any machine shows, and those that show in priors rather than in readings, are drawn again.
    pub fn random_seeable(&self, factor: f64, random: &mut impl Rng) -> Injected {
        loop {
            let effect = families::random_effect(self.plan.kind, random);
            // A spindle ball that every test mounts anew may sit anywhere within its prior: no remount.
            let allowed = self.plan.shared_mounts
                || !matches!(
                    (&effect.shape, effect.component),
                    (Shape::Remount { .. }, Component::SpindleBall(_))
                );
            let smallest = self.smallest_significant_amplitude(&effect, 1.96);
            let allowed = allowed && self.share_in_readings(&effect) > 0.5;
            if allowed && smallest < largest_sensible(effect.unit()) {
                return effect.with_amplitude(factor * smallest);
            }
        }
    }

    /// Two random effects that this session sees and does not take for each other, each at `factor` times its own smallest significant
    /// amplitude.
    pub fn random_pair(&self, factor: f64, random: &mut impl Rng) -> [Injected; 2] {
        loop {
            let pair = [
                self.random_seeable(factor, random),
                self.random_seeable(factor, random),
            ];
            let [a, b] = &pair;
            let share = self.explained_share(a, b).max(self.explained_share(b, a));
            if share < PAIR_SHARE {
                return pair;
            }
        }
    }
}

/// How much two effects of one session may have in common, as the cosine of an angle between their signatures, either in the other.
const PAIR_SHARE: f64 = 0.5;

/// What could be named in place of a true effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Alias {
    /// In the words of results.
    pub name: Named,
    /// The same for the plant, at unit amplitude.
    pub effect: Injected,
    /// How much of the true effect it can do, as a cosine.
    pub share: f64,
    /// By how many standard deviations its χ² is expected to stay behind the truth's.
    pub behind_sigma: f64,
}

/// No smallest significant amplitude above this is worth a session.
fn largest_sensible(unit: &str) -> f64 {
    match unit {
        "ms" => 10.0,
        _ => 4.0,
    }
}

/// Every component of an axis that may move, both balls, bar, sensor and trigger.
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

/// The probability of a normal number beyond ±z, by the continued fraction of its tail (z above 1) or its series.
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
