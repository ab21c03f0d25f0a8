//! Draws errors and set-ups and simulates the readings with the plant.

use std::sync::Arc;

use abbe::model::session::planned::planned_session;
use abbe::model::session::{Prior, Session, Test};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::bar;
use crate::plant::chain::ChainErrors;

/// Standard deviation of drawn errors, µm and arcsec.
const ERRORS: f64 = 20.0;
const ARCSEC: f64 = std::f64::consts::PI / (180.0 * 3600.0);

/// The drawn values of a session, by the names of results, in µm and arcsec.
pub struct DrawnSession {
    pub values: Vec<(String, f64)>,
    pub measured: Session,
}

/// The errors of the plant in a test.
fn out_of_place(plan: &Session, test: &Test, values: &[(String, f64)]) -> ChainErrors {
    let value = |id: String| values.iter().find(|(name, _)| *name == id).map_or(0.0, |(_, v)| *v);
    let ball = |ball: &str, mount: &str| ["x", "y", "z"].map(|axis| value(format!("{ball}.{axis}[{mount}]")) * 1e-3);
    let letters = plan.machine.axes.iter().map(|axis| axis.name.chars().next().unwrap());
    let location = letters.map(|letter| {
        let of = |freedom: char, size: f64| value(format!("E{freedom}0{letter}")) * size;
        let lengths = ['X', 'Y', 'Z'].map(|freedom| of(freedom, 1e-3));
        let angles = ['A', 'B', 'C'].map(|freedom| of(freedom, ARCSEC));
        let [x, y, z] = lengths;
        let [a, b, c] = angles;
        (letter, [x, y, z, a, b, c])
    });
    ChainErrors {
        location: location.collect(),
        workpiece_ball: ball("workpiece_ball", &test.setup),
        spindle_ball: ball("spindle_ball", &test.spindle_setup),
        bar: value(format!("bar[{}]", test.bar_setup)) * 1e-3,
    }
}

/// Draws errors and set-ups and simulates readings with white noise of `noise_um`, rounded to the resolution unless the
/// noise is zero.
pub fn draw(code: &str, plan: &Session, seed: u64, noise_um: f64) -> DrawnSession {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut values: Vec<(String, f64)> = Vec::new();
    for name in &plan.unknowns {
        values.push((name.to_string(), ERRORS * normal()));
    }
    for test in &plan.tests {
        let mut ids: Vec<(String, Prior)> = Vec::new();
        for (unknown, prior) in test.station.kind().unknowns().iter().zip(&test.priors) {
            let group = test.group(unknown.shared_by);
            let dot = if unknown.coordinate.is_empty() { "" } else { "." };
            ids.push((format!("{}{dot}{}[{group}]", unknown.thing, unknown.coordinate), *prior));
        }
        for (id, prior) in ids {
            let Prior::Gaussian(u_mm) = prior else { continue };
            if values.iter().all(|(name, _)| *name != id) {
                values.push((id, u_mm * 1e3 * normal()));
            }
        }
    }
    let chain = super::chain(code, plan);
    let mut measured = plan.clone();
    for (test, mut readings) in measured.tests.iter_mut().zip(planned_session(plan).unwrap()) {
        let out = out_of_place(plan, test, &values);
        let stated = bar(test);
        for row in 0..readings.rows() {
            let position = |letter: char| {
                let axis = plan.machine.axis_index(&letter.to_string()).unwrap();
                readings.positions[axis][row]
            };
            let mut length = chain.reading_mm(&position, stated.workpiece_ball.mm, stated.spindle_ball.mm, &out);
            if noise_um > 0.0 {
                let resolution = plan.resolution_mm.unwrap();
                length = ((length + noise_um * 1e-3 * normal()) / resolution).round() * resolution;
            }
            readings.observed[row] = length;
        }
        test.readings = Some(Arc::new(readings));
    }
    DrawnSession { values, measured }
}
