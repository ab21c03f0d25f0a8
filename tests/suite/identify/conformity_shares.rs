//! The decision rule at the limit: 10,000 simulated machines whose error is exactly as large as is permitted. Readings
//! follow from a closed form, decisions from whole fits.

use std::f64::consts::TAU;

use abbe::files::read::add_node;
use abbe::files::table::memory::MemoryColumn;
use abbe::identify::tolerance::rule::Decision;
use abbe::model::chain::Machine;
use abbe::model::component::ErrorName;
use abbe::model::instrument::InstrumentKind;
use abbe::model::session::Session;
use abbe::model::session::tolerance::{Limit, Tolerance, Toleranced};
use abbe::trace::SessionFit;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde_json::json;

const MACHINES: usize = 10_000;
const ROWS: usize = 24;
const NOISE_MM: f64 = 1e-3;

/// Length of a bar from a ball at radius 100 mm on the table to a ball 75 mm above the nominal centre of C, whose axis
/// is displaced by `ex` along X.
fn length(c: f64, ex: f64) -> f64 {
    (ex - 100.0 * c.sin()).hypot(100.0 * c.cos()).hypot(75.0)
}

/// The decision about one machine with a displacement of `ex_um`.
fn decision(ex_um: f64, lower: f64, upper: f64, random: &mut Pcg64) -> Decision {
    let mut session = Session::new(Machine::from_code("[wCAbYXZt]").unwrap(), InstrumentKind::BallBar);
    session.noise_mm = Some(NOISE_MM);
    session.unknowns = ErrorName::parse("EX0C").into_iter().collect();
    session.tolerance = Some(Tolerance {
        probability: 0.95,
        limits: vec![Limit { of: Toleranced::Parameter("EX0C".into()), lower: Some(lower), upper, unit: "um" }],
    });
    let c: Vec<f64> = (0..ROWS).map(|k| TAU * k as f64 / ROWS as f64).collect();
    let mut noise = || -> f64 { StandardNormal.sample(random) };
    let length_mm: Vec<f64> = c.iter().map(|c| length(*c, ex_um * 1e-3) + NOISE_MM * noise()).collect();
    let columns = [("c_rad", &c[..]), ("length_mm", &length_mm), ("run", &[1.0; ROWS])];
    let columns = columns.map(|(name, values)| MemoryColumn::numbers(name, values));
    let test = json!({"name": "C100", "bar_mm": 125, "workpiece_ball_mm": [0, 100, 0], "spindle_ball_mm": [0, 0, 0],
                      "at": {"z_mm": 75}});
    add_node(&mut session, "test", test.into(), &columns).unwrap();
    let result = SessionFit::of(&session, 1).unwrap().result;
    result.conformity.unwrap().verdict
}

/// The shares of machines that pass and that fail.
fn shares(ex_um: f64, lower: f64, upper: f64) -> [f64; 2] {
    let decide = |number: usize| decision(ex_um, lower, upper, &mut Pcg64::seed_from_u64(number as u64));
    let decisions: Vec<Decision> = (0..MACHINES).into_par_iter().map(decide).collect();
    [Decision::Pass, Decision::Fail]
        .map(|wanted| decisions.iter().filter(|own| **own == wanted).count() as f64 / MACHINES as f64)
}

/// At the limit a pass and a fail are both wrong statements; each may be made with a probability of 5 %.
#[test]
fn wrong_statements_at_the_limit_have_their_nominal_share() {
    let sampling = (0.05_f64 * 0.95 / MACHINES as f64).sqrt();
    for (ex_um, lower, upper) in [(10.0, -10.0, 10.0), (-5.0, -5.0, 20.0)] {
        let [passed, failed] = shares(ex_um, lower, upper);
        println!("at {ex_um} um of {lower} to {upper}: {passed} pass, {failed} fail (0.05 ± {sampling:.4})");
        for share in [passed, failed] {
            assert!((share - 0.05).abs() < 3.0 * sampling, "{share}");
        }
    }
}
