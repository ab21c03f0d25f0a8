//! A fleet of machines as files, made by the plant, for measurements of `abbe run` and of the Python package.

use std::path::PathBuf;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Recipe, Shape};

const MACHINES: usize = 50;

/// Writes `ABBE_FLEET_SESSIONS` sessions (1,000 by default) of 50 machines with 400 readings each into the folder
/// `ABBE_FLEET`. A machine has one session a month. Every fourth machine has an axial motion of the table, every fifth
/// one a drift of its table's position.
#[test]
fn a_fleet_is_written() {
    let Some(folder) = std::env::var_os("ABBE_FLEET").map(PathBuf::from) else {
        println!("skipped: ABBE_FLEET names the folder");
        return;
    };
    let count = std::env::var("ABBE_FLEET_SESSIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(1000);
    let plan = Recipe::new(Kind::Rotary, 0).readings(400).plan();
    for number in 0..count {
        let (machine, month) = (number % MACHINES, number / MACHINES);
        let mut recipe = Recipe::new(Kind::Rotary, 90_000 + number as u64).readings(400);
        if machine % 4 == 0 {
            let shape = Shape::Harmonic { order: 2, phase_deg: 60.0 };
            let axial = Component::Motion(Freedom::Z, AxisName::C);
            recipe = recipe.with(Injected::new(axial, Driver::Axis(AxisName::C), shape, 1.5));
        }
        let drawn = recipe.draw_of(&plan, |id| {
            let own = id.bytes().fold(machine as u64, |seed, byte| seed.wrapping_mul(131) + u64::from(byte));
            let normal: f64 = StandardNormal.sample(&mut Pcg64Mcg::seed_from_u64(own));
            let drift = if machine % 5 == 0 && id == "EX0C" { month as f64 / 12.0 } else { 0.0 };
            // The set-up is new in every session.
            (!id.contains('[')).then_some(20.0 * normal + drift)
        });
        let place = folder.join(format!("machine{machine:02}")).join(format!("{month:03}"));
        std::fs::create_dir_all(&place).unwrap();
        for (name, text) in &drawn.files {
            let mut text = text.clone();
            if name == "session.toml" {
                let (year, month) = (2020 + month / 12, month % 12 + 1);
                let about =
                    format!("[about]\nserial_number = \"M{machine:02}\"\ndate = {year}-{month:02}-05T08:00:00\n\n");
                text = about + &text;
            }
            std::fs::write(place.join(name), text).unwrap();
        }
    }
}
