//! What effects do to readings, by the exact chain: the readings with one unit of a coefficient less those without, nothing linearised.

use std::f64::consts::TAU;

use abbe_identify::noise::{Noise, NoiseSource};
use abbe_identify::parameters::Role;
use abbe_identify::problem::Problem;
use abbe_model::effect::Effect;
use abbe_model::session::{Prior, Session};
use nalgebra::DMatrix;

/// Things whose place on the machine nobody knows better than the readings do.
const MOUNTED: [&str; 9] = [
    "workpiece_ball",
    "spindle_ball",
    "bar",
    "tracker",
    "target",
    "socket",
    "ball",
    "sensor",
    "artefact",
];

/// Share of a unit by which a coefficient is changed: so little that its square is nothing.
const STEP: f64 = 0.01;

/// What rounding and second order leave of a change that is none, µm per unit.
const ROUNDED: f64 = 1e-5;

/// Where a scalar reading stands.
#[derive(Clone, Copy)]
pub struct At {
    pub test: usize,
    pub run: usize,
    pub coordinate: usize,
}

/// Changes of all readings of a session, µm per unit, a column a coefficient.
pub struct Changes {
    pub session: Session,
    pub at: Vec<At>,
    /// Names of the set-up quantities.
    mounted: Vec<String>,
    setup: DMatrix<f64>,
    effects: Vec<DMatrix<f64>>,
}

/// One unit of each coefficient of each effect, and of each set-up quantity; of a ratio 0.1 %.
pub fn changes(mut session: Session, effects: &[Effect]) -> Changes {
    session.unknowns.clear();
    session.effects = effects.to_vec();
    let unknowns = session.instrument.unknowns();
    for test in &mut session.tests {
        for (prior, unknown) in test.priors.iter_mut().zip(unknowns) {
            *prior = if MOUNTED.contains(&unknown.thing) {
                Prior::Free
            } else {
                Prior::Known
            };
        }
    }
    let problem = Problem::new(&session, Noise::white(1e-4, NoiseSource::Stated), 0).unwrap();
    let read = |beta: &[f64]| -> Vec<f64> {
        let values = problem.slot_values(beta);
        let models = problem.models.iter().zip(&values);
        models
            .flat_map(|(model, values)| model.readings_mm(values))
            .collect()
    };
    let list = &problem.parameters.list;
    let mut beta = vec![0.0; list.len()];
    let without = read(&beta);
    let mounted = list
        .iter()
        .filter(|parameter| matches!(parameter.role, Role::Setup));
    let mounted = mounted.map(|parameter| parameter.id.clone()).collect();
    let mut columns = |wanted: &dyn Fn(Role) -> bool| {
        let mut found = Vec::new();
        for (place, parameter) in list.iter().enumerate() {
            if wanted(parameter.role) {
                let unit = if parameter.id.starts_with("gain") {
                    1e3
                } else {
                    1.0
                };
                beta[place] = STEP * unit / parameter.unit.display_per_internal;
                let with = read(&beta);
                beta[place] = 0.0;
                found.extend(
                    with.iter()
                        .zip(&without)
                        .map(|(with, without)| (with - without) * 1e3 / STEP),
                );
            }
        }
        DMatrix::from_vec(without.len(), found.len() / without.len(), found)
    };
    let setup = columns(&|role| matches!(role, Role::Setup));
    let of_effects = (0..effects.len())
        .map(|wanted| columns(&|role| matches!(role, Role::Coefficient { effect, .. } if effect == wanted)))
        .collect();
    let mut at = Vec::new();
    for (test, model) in problem.models.iter().enumerate() {
        let readings = problem.tests[test].readings.as_ref().unwrap();
        for (run, rows) in readings.runs().into_iter().enumerate() {
            for _ in rows {
                at.extend((0..model.coordinates()).map(|coordinate| At {
                    test,
                    run,
                    coordinate,
                }));
            }
        }
    }
    assert_eq!(at.len(), without.len());
    Changes {
        at,
        mounted,
        setup,
        effects: of_effects,
        session: session.clone(),
    }
}

/// How much of an effect something else explains: the share of the square, at the phase at which it explains least and most.
#[derive(Clone, Copy)]
pub struct Share {
    pub least: f64,
    pub most: f64,
}

impl Changes {
    /// The change that an effect makes at some of the readings.
    pub fn of(&self, effect: usize, wanted: impl Fn(&At) -> bool) -> DMatrix<f64> {
        let rows: Vec<usize> = (0..self.at.len()).filter(|row| wanted(&self.at[*row])).collect();
        self.effects[effect].select_rows(&rows)
    }

    /// The greatest rms over phases, µm per unit.
    pub fn rms(&self, effect: usize, wanted: impl Fn(&At) -> bool) -> f64 {
        let change = self.of(effect, wanted);
        let rows = change.nrows() as f64;
        greatest(&change) / rows.sqrt()
    }

    /// What the mounts take of each effect, those called `known` excepted, and, of what they leave, what each other effect explains.
    pub fn shares(&self, wanted: impl Fn(&At) -> bool, known: Option<&str>) -> (Vec<Share>, Vec<Vec<Share>>) {
        let rows: Vec<usize> = (0..self.at.len()).filter(|row| wanted(&self.at[*row])).collect();
        let is_known = |name: &str| known.is_some_and(|known| name.starts_with(known));
        let open: Vec<usize> = (0..self.mounted.len())
            .filter(|column| !is_known(&self.mounted[*column]))
            .collect();
        let setup = basis(&self.setup.select_rows(&rows).select_columns(&open), 1e-5);
        let changes: Vec<DMatrix<f64>> = self.effects.iter().map(|e| e.select_rows(&rows)).collect();
        let taken: Vec<Share> = changes.iter().map(|change| share(change, &setup)).collect();
        let left: Vec<DMatrix<f64>> = changes
            .iter()
            .map(|change| change - &setup * (setup.transpose() * change))
            .collect();
        let bases: Vec<DMatrix<f64>> = changes
            .iter()
            .zip(&left)
            .map(|(change, left)| part(left, 1e-3 * greatest(change)))
            .collect();
        let between = bases
            .iter()
            .map(|own| bases.iter().map(|other| share(own, other)).collect())
            .collect();
        (taken, between)
    }

    /// Amplitude by order of a test whose runs are full turns in equal steps: `[same, opposite]` in both directions, µm per unit, the
    /// greatest over phases.
    pub fn orders(&self, effect: usize, test: usize, coordinate: usize, most: usize) -> [Vec<f64>; 2] {
        let run = |run: usize| {
            self.of(effect, |at| {
                at.test == test && at.coordinate == coordinate && at.run == run
            })
        };
        let forward = run(0);
        let mut backward = run(1);
        let rows = forward.nrows();
        if backward.nrows() == 0 {
            backward = forward.clone();
        } else {
            assert_eq!(backward.nrows(), rows);
            for column in 0..backward.ncols() {
                let reversed: Vec<f64> = backward.column(column).iter().rev().copied().collect();
                backward.set_column(column, &reversed.into());
            }
        }
        let same = (&forward + &backward) * 0.5;
        let opposite = (&forward - &backward) * 0.5;
        [same, opposite].map(|change| {
            (0..=most)
                .map(|order| {
                    let turn = rows - 1;
                    let wave = DMatrix::from_fn(2, turn, |part, k| {
                        let angle = TAU * (order * k) as f64 / turn as f64;
                        let weight = if order == 0 { 1.0 } else { 2.0 } / turn as f64;
                        weight * if part == 0 { angle.cos() } else { angle.sin() }
                    });
                    greatest(&(wave * change.rows(0, turn)))
                })
                .collect()
        })
    }
}

/// The greatest singular value.
fn greatest(matrix: &DMatrix<f64>) -> f64 {
    if matrix.is_empty() {
        return 0.0;
    }
    matrix.clone().svd(false, false).singular_values.max()
}

/// Orthonormal columns of what a matrix spans, columns scaled to one; columns of less than [`ROUNDED`] rms are nothing.
fn basis(matrix: &DMatrix<f64>, relative: f64) -> DMatrix<f64> {
    let mut scaled = matrix.clone();
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        let nothing = norm < ROUNDED * (column.len() as f64).sqrt();
        column *= if nothing { 0.0 } else { 1.0 / norm };
    }
    part(&scaled, relative)
}

/// Orthonormal columns of what stands out by more than `least`.
fn part(matrix: &DMatrix<f64>, least: f64) -> DMatrix<f64> {
    if matrix.ncols() == 0 {
        return matrix.clone();
    }
    let svd = matrix.clone().svd(true, false);
    let kept: Vec<usize> = (0..svd.singular_values.len())
        .filter(|k| svd.singular_values[*k] > least.max(1e-9))
        .collect();
    svd.u.unwrap().select_columns(&kept)
}

/// Share of the square of what `change` spans that lies in the span of the orthonormal columns of `other`.
fn share(change: &DMatrix<f64>, other: &DMatrix<f64>) -> Share {
    let own = basis(change, 1e-6);
    if own.ncols() == 0 || other.ncols() == 0 {
        return Share {
            least: 0.0,
            most: 0.0,
        };
    }
    let cosines = (other.transpose() * &own).svd(false, false).singular_values;
    let most = cosines[0].powi(2);
    let least = if cosines.len() < own.ncols() {
        0.0
    } else {
        cosines.min().powi(2)
    };
    Share { least, most }
}
