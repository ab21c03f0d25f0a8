//! The fit of a simulated session recovers the simulated errors: exactly without noise, and within the stated
//! uncertainty with noise.

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::{Fit, prepare};
use abbe::identify::problem::Problem;
use abbe::identify::quantity::Given;
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::session::motion::{Motion, Moved};
use abbe::model::session::{Prior, Session};
use rayon::prelude::*;

/// Tables 5.2 and 5.3 of the thesis.
pub const THESIS: [&str; 8] = [
    "EY0A=35.3um",
    "EZ0A=-33.4um",
    "EX0C=1.3um",
    "EY0C=-52.9um",
    "θ_y0a=-1.29arcsec",
    "θ_z0a=1.20arcsec",
    "θ_x0c=-22.28arcsec",
    "θ_y0c=4.48arcsec",
];
const ISO: [&str; 8] = ["EY0A", "EZ0A", "EX0C", "EY0C", "EB0A", "EC0A", "EA0C", "EB0C"];

fn plan(chapter: &str) -> Session {
    let mut session =
        files::session(&crate::suite::ready(&format!("hermle-c600u/{chapter}.toml")), &ReadOptions::default()).unwrap();
    session.resolution_mm = None;
    session
}

fn given() -> Vec<Given> {
    THESIS.map(|text| Given::parse(text).unwrap()).to_vec()
}

/// The session with simulated readings, and the simulated values.
fn measured(plan: &Session, simulation: &Simulation) -> (Session, Vec<Given>) {
    let simulated = simulate(plan, simulation).unwrap();
    assert!(simulated.warnings.is_empty(), "{:?}", simulated.warnings);
    (plan.clone().with_readings(simulated.readings), simulated.truth)
}

/// Value and uncertainty of a parameter in its display unit.
fn found(problem: &Problem, fit: &Fit, id: &str) -> (f64, f64) {
    let list = &problem.parameters.list;
    let place = list.iter().position(|parameter| parameter.id.to_string() == id).unwrap();
    assert!(fit.rank.is_identifiable(place), "{id} is not identifiable");
    let outside = list[place].unit.display_per_internal;
    (fit.beta[place] * outside, fit.covariance[(place, place)].sqrt() * outside)
}

#[test]
fn without_noise_the_errors_of_the_thesis_are_recovered_exactly() {
    for chapter in ["chapter4", "chapter5", "chapter6"] {
        let mut plan = plan(chapter);
        // The balls are at their nominal positions, with the priors of the session.
        plan.noise_mm = Some(0.3e-3);
        let simulation = Simulation { given: given(), noise_mm: Some(0.0), ..Simulation::default() };
        let (session, truth) = measured(&plan, &simulation);
        let (problem, fit) = prepare(&session, 1).unwrap();
        let mut worst = 0.0_f64;
        for id in ISO {
            let Given { value, unit, .. } = truth.iter().find(|known| known.id == *id).unwrap();
            let (estimate, _) = found(&problem, &fit, id);
            worst = worst.max((estimate - value).abs());
            assert!((estimate - value).abs() < 1e-6, "{chapter} {id}: {estimate} for {value} {unit}");
        }
        println!("{chapter}: worst difference {worst:.1e} um or arcsec");
    }
}

#[test]
fn pulls_have_mean_0_and_standard_deviation_1_over_200_draws() {
    const DRAWS: u64 = 200;
    let mut plan = plan("chapter5");
    for test in &mut plan.tests {
        if let Some(Motion { moved: Moved::Axis(_), course }) = &mut test.motion {
            course.step *= 6.0;
        }
    }
    let draws: Vec<Vec<f64>> = (0..DRAWS)
        .into_par_iter()
        .map(|seed| {
            let simulation = Simulation { given: given(), draw_setups: true, seed, ..Simulation::default() };
            let (session, truth) = measured(&plan, &simulation);
            let (problem, fit) = prepare(&session, 1).unwrap();
            let list = &problem.parameters.list;
            assert!(list.iter().filter(|p| matches!(p.prior, Prior::Gaussian(_))).count() == 19);
            list.iter()
                .map(|parameter| {
                    let Given { value, .. } = truth.iter().find(|known| known.id == parameter.id.to_string()).unwrap();
                    let (estimate, u) = found(&problem, &fit, &parameter.id.to_string());
                    (estimate - value) / u
                })
                .collect()
        })
        .collect();
    let count = DRAWS as f64;
    let (session, _) = measured(&plan, &Simulation::default());
    let (problem, _) = prepare(&session, 1).unwrap();
    for (index, parameter) in problem.parameters.list.iter().enumerate() {
        let mean = draws.iter().map(|pulls| pulls[index]).sum::<f64>() / count;
        let square = draws.iter().map(|pulls| (pulls[index] - mean).powi(2)).sum::<f64>();
        let deviation = (square / (count - 1.0)).sqrt();
        println!("{:24} mean {mean:6.3} sd {deviation:.3}", parameter.id);
        // Three standard deviations of the mean and of the standard deviation of that many values.
        assert!(mean.abs() < 3.0 / count.sqrt(), "{}: mean {mean}", parameter.id);
        assert!((deviation - 1.0).abs() < 3.0 / (2.0 * count).sqrt(), "{}: sd {deviation}", parameter.id);
    }
}
