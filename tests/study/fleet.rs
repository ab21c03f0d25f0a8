//! A fleet of machines as files, made by the plant, for measurements of `abbe fleet run` and of the Python package.
//!
//! ```text
//! ABBE_FLEET=/tmp/fleet cargo test --profile checked --test main a_fleet_is_written
//! ```
//!
//! Without `ABBE_FLEET` a few sessions go to a temporary folder.

use std::path::{Path, PathBuf};

use abbe::files::{ReadOptions, session};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Plan, Recipe, Shape, SimulatedSession};

const MACHINES: usize = 50;
/// Sessions without `ABBE_FLEET`: the first two machines have two.
const FEW: usize = MACHINES + 2;

fn machine_and_month(number: usize) -> (usize, usize) {
    (number % MACHINES, number / MACHINES)
}

/// A session of a machine, one a month. Every fourth machine has an axial motion of the table, every fifth one a drift
/// of its table's position.
fn drawn(number: usize, plan: &Plan) -> SimulatedSession {
    let (machine, month) = machine_and_month(number);
    let mut recipe = Recipe::new(Kind::Rotary, 90_000 + number as u64).readings(400);
    if machine % 4 == 0 {
        let shape = Shape::Harmonic { order: 2, phase_deg: 60.0 };
        let axial = Component::Motion(Freedom::Z, AxisName::C);
        recipe = recipe.with(Injected::new(axial, Driver::Axis(AxisName::C), shape, 1.5));
    }
    recipe.draw_of(plan, |id| {
        let own = id.bytes().fold(machine as u64, |seed, byte| seed.wrapping_mul(131) + u64::from(byte));
        let normal: f64 = StandardNormal.sample(&mut Pcg64Mcg::seed_from_u64(own));
        let drift = if machine % 5 == 0 && id == "EX0C" { month as f64 / 12.0 } else { 0.0 };
        // The set-up is new in every session.
        (!id.contains('[')).then_some(20.0 * normal + drift)
    })
}

fn folder_of(fleet: &Path, number: usize) -> PathBuf {
    let (machine, month) = machine_and_month(number);
    fleet.join(format!("machine{machine:02}")).join(format!("{month:03}"))
}

/// Serial number and date of a session.
fn stated(number: usize) -> [String; 2] {
    let (machine, month) = machine_and_month(number);
    [format!("M{machine:02}"), format!("{}-{:02}-05T08:00:00", 2020 + month / 12, month % 12 + 1)]
}

fn write(fleet: &Path, number: usize, drawn: &SimulatedSession) {
    let place = folder_of(fleet, number);
    drawn.write(&place).unwrap();
    let [serial, date] = stated(number);
    let file = place.join("session.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, format!("[about]\nserial_number = \"{serial}\"\ndate = {date}\n\n{text}")).unwrap();
}

/// Writes `ABBE_FLEET_SESSIONS` sessions (1,000 by default) of 50 machines with 400 readings each into the folder
/// `ABBE_FLEET`. Each reads as the session of its machine and month; a machine keeps its errors, and its drift is that of
/// the month.
#[test]
fn a_fleet_is_written() {
    let temporary = tempfile::tempdir().unwrap();
    let asked = std::env::var_os("ABBE_FLEET").map(PathBuf::from);
    let count = std::env::var("ABBE_FLEET_SESSIONS").map(|text| text.parse().expect("ABBE_FLEET_SESSIONS is a number"));
    let count: usize = count.unwrap_or(if asked.is_some() { 1000 } else { FEW });
    let fleet = asked.unwrap_or_else(|| temporary.path().to_path_buf());
    let plan = Recipe::new(Kind::Rotary, 0).readings(400).plan();
    let mut first: Vec<SimulatedSession> = Vec::new();
    for number in 0..count {
        let drawn = drawn(number, &plan);
        write(&fleet, number, &drawn);
        let read = session(&folder_of(&fleet, number).join("session.toml"), &ReadOptions::default()).unwrap();
        let note = |name: &str| read.about.iter().find(|(known, _)| known == name).map(|(_, text)| text.clone());
        let [serial, date] = stated(number).map(Some);
        assert_eq!((note("serial_number"), note("date")), (serial, date), "session {number}");
        let readings: usize = read.tests.iter().map(|test| test.readings.as_ref().unwrap().rows()).sum();
        assert!((380..=440).contains(&readings), "session {number}: {readings} readings");
        assert!(read.effects.is_empty(), "session {number} declares an effect");

        let (machine, month) = machine_and_month(number);
        assert_eq!(drawn.truth.effects.len(), usize::from(machine % 4 == 0), "session {number}");
        let Some(january) = first.get(machine) else {
            first.push(drawn);
            continue;
        };
        for ((id, now, _), (_, then, _)) in drawn.truth.piges().zip(january.truth.piges()) {
            let drift_um = if machine % 5 == 0 && id == "EX0C" { month as f64 / 12.0 } else { 0.0 };
            assert!((now - then - drift_um).abs() < 1e-12, "session {number}, {id}: {then} and {now}");
        }
        let set_up = |drawn: &SimulatedSession| drawn.truth.value("bar[A100]").unwrap();
        assert_ne!(set_up(&drawn), set_up(january), "session {number} has the set-up of another");
    }
    assert!(count > 0, "no session is asked for");
}
