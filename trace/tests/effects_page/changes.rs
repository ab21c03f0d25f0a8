//! Computes the response of readings to effects from the exact chain: the readings with one unit of a coefficient less
//! those without, not linearised.

use std::f64::consts::TAU;

use abbe_identify::noise::{Noise, NoiseSource};
use abbe_identify::parameters::Parameter;
use abbe_identify::problem::Problem;
use abbe_model::driver::Driver;
use abbe_model::effect::Effect;
use abbe_model::session::{Prior, Session};
use nalgebra::DMatrix;

/// Set-up components whose position is a free parameter.
const MOUNTED: [&str; 9] =
    ["workpiece_ball", "spindle_ball", "bar", "tracker", "target", "socket", "ball", "sensor", "artefact"];

/// Share of a unit by which a coefficient is changed. It is small enough for its square to be negligible.
const STEP: f64 = 0.01;

/// Bound of rounding and second-order terms for a zero response, µm per unit.
const ROUNDED: f64 = 1e-5;

/// The position of a scalar reading in the session.
#[derive(Clone, Copy)]
pub struct At {
    pub test: usize,
    pub run: usize,
    pub coordinate: usize,
}

/// Responses of all readings of a session, µm per unit, one column per coefficient.
pub struct Changes {
    pub session: Session,
    pub at: Vec<At>,
    /// Identifiers of the set-up parameters.
    mounted: Vec<String>,
    setup: DMatrix<f64>,
    effects: Vec<DMatrix<f64>>,
}

/// Computes the response to one unit of each coefficient of each effect and of each set-up parameter. The unit of a
/// ratio is 0.1 %.
pub fn changes(mut session: Session, effects: &[Effect]) -> Changes {
    session.unknowns.clear();
    session.effects = effects.to_vec();
    let components = session.instrument.unknowns();
    for test in &mut session.tests {
        for (prior, component) in test.priors.iter_mut().zip(components) {
            *prior = if MOUNTED.contains(&component.thing) { Prior::Free } else { Prior::Known };
        }
    }
    let problem = Problem::new(&session, Noise::white(1e-4, NoiseSource::Stated), 0).unwrap();
    let read = |beta: &[f64]| -> Vec<f64> {
        let values = problem.slot_values(beta);
        let models = problem.models.iter().zip(&values);
        models.flat_map(|(model, values)| model.readings(values)).collect()
    };
    let list = &problem.parameters.list;
    let mut beta = vec![0.0; list.len()];
    let without = read(&beta);
    let mounted = list.iter().filter(|parameter| parameter.id.is_setup());
    let mounted = mounted.map(|parameter| parameter.id.to_string()).collect();
    let mut columns = |wanted: &dyn Fn(&Parameter) -> bool| {
        let mut found = Vec::new();
        for (place, parameter) in list.iter().enumerate() {
            if wanted(parameter) {
                // Slopes over a linear axis count at 100 mm, as other powers do.
                let follows_axis = |effect: usize| matches!(problem.parameters.effects[effect].driver, Driver::Axis(_));
                let is_slope =
                    parameter.unit.name.ends_with("/m") && parameter.coefficient_of().is_some_and(follows_axis);
                let unit = match (parameter.id.to_string().starts_with("gain"), is_slope) {
                    (true, _) => 1e3,
                    (false, true) => 10.0,
                    (false, false) => 1.0,
                };
                beta[place] = STEP * unit / parameter.unit.display_per_internal;
                let with = read(&beta);
                beta[place] = 0.0;
                found.extend(with.iter().zip(&without).map(|(with, without)| (with - without) * 1e3 / STEP));
            }
        }
        DMatrix::from_vec(without.len(), found.len() / without.len(), found)
    };
    let setup = columns(&|parameter| parameter.id.is_setup());
    let of_effects =
        (0..effects.len()).map(|wanted| columns(&|parameter| parameter.coefficient_of() == Some(wanted))).collect();
    let mut at = Vec::new();
    for (test, model) in problem.models.iter().enumerate() {
        let readings = problem.tests[test].readings.as_ref().unwrap();
        for (run, rows) in readings.runs().into_iter().enumerate() {
            for _ in rows {
                at.extend((0..model.channels().len()).map(|coordinate| At { test, run, coordinate }));
            }
        }
    }
    assert_eq!(at.len(), without.len());
    Changes { at, mounted, setup, effects: of_effects, session: session.clone() }
}

/// Share of the square of an effect that another one explains, at the phase with the smallest and the largest share.
#[derive(Clone, Copy)]
pub struct Share {
    pub least: f64,
    pub most: f64,
}

impl Changes {
    /// The response of some of the readings to an effect.
    pub fn of(&self, effect: usize, wanted: impl Fn(&At) -> bool) -> DMatrix<f64> {
        let rows: Vec<usize> = (0..self.at.len()).filter(|row| wanted(&self.at[*row])).collect();
        self.effects[effect].select_rows(&rows)
    }

    /// The largest rms over all phases, µm per unit.
    pub fn rms(&self, effect: usize, wanted: impl Fn(&At) -> bool) -> f64 {
        let change = self.of(effect, wanted);
        let rows = change.nrows() as f64;
        greatest(&change) / rows.sqrt()
    }

    /// The shares of each effect that the mounts explain, without those called `known`, and the shares of the remainder
    /// that each other effect explains.
    pub fn shares(&self, wanted: impl Fn(&At) -> bool, known: Option<&str>) -> (Vec<Share>, Vec<Vec<Share>>) {
        let rows: Vec<usize> = (0..self.at.len()).filter(|row| wanted(&self.at[*row])).collect();
        let is_known = |name: &str| known.is_some_and(|known| name.starts_with(known));
        let open: Vec<usize> = (0..self.mounted.len()).filter(|column| !is_known(&self.mounted[*column])).collect();
        let setup = basis(&self.setup.select_rows(&rows).select_columns(&open), 1e-5);
        let changes: Vec<DMatrix<f64>> = self.effects.iter().map(|e| e.select_rows(&rows)).collect();
        let by_setup: Vec<Share> = changes.iter().map(|change| share(change, &setup)).collect();
        let left: Vec<DMatrix<f64>> =
            changes.iter().map(|change| change - &setup * (setup.transpose() * change)).collect();
        let bases: Vec<DMatrix<f64>> =
            changes.iter().zip(&left).map(|(change, left)| part(left, 1e-3 * greatest(change))).collect();
        let between = bases.iter().map(|own| bases.iter().map(|other| share(own, other)).collect()).collect();
        (by_setup, between)
    }

    /// Amplitudes by order of a test whose runs are full turns in equal steps: `[same, opposite]` in the two
    /// directions, µm per unit, the largest over all phases.
    pub fn orders(&self, effect: usize, test: usize, coordinate: usize, most: usize) -> [Vec<f64>; 2] {
        let run = |run: usize| self.of(effect, |at| at.test == test && at.coordinate == coordinate && at.run == run);
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

/// The largest singular value.
fn greatest(matrix: &DMatrix<f64>) -> f64 {
    if matrix.is_empty() {
        return 0.0;
    }
    matrix.clone().svd(false, false).singular_values.max()
}

/// Orthonormal columns of the span of a matrix whose columns are scaled to unit length. Columns with less than
/// [`ROUNDED`] rms count as zero.
fn basis(matrix: &DMatrix<f64>, relative: f64) -> DMatrix<f64> {
    let mut scaled = matrix.clone();
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        let nothing = norm < ROUNDED * (column.len() as f64).sqrt();
        column *= if nothing { 0.0 } else { 1.0 / norm };
    }
    part(&scaled, relative)
}

/// Orthonormal columns of the directions with singular values above `least`.
fn part(matrix: &DMatrix<f64>, least: f64) -> DMatrix<f64> {
    if matrix.ncols() == 0 {
        return matrix.clone();
    }
    let svd = matrix.clone().svd(true, false);
    let kept: Vec<usize> =
        (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > least.max(1e-9)).collect();
    svd.u.unwrap().select_columns(&kept)
}

/// Share of the square of the span of `change` that lies in the span of the orthonormal columns of `other`.
fn share(change: &DMatrix<f64>, other: &DMatrix<f64>) -> Share {
    let own = basis(change, 1e-6);
    if own.ncols() == 0 || other.ncols() == 0 {
        return Share { least: 0.0, most: 0.0 };
    }
    let cosines = (other.transpose() * &own).svd(false, false).singular_values;
    let most = cosines[0].powi(2);
    let least = if cosines.len() < own.ncols() { 0.0 } else { cosines.min().powi(2) };
    Share { least, most }
}
