//! The sessions of the table "Trace" in `docs/development/speed.md`. The table holds the time of trace, no test does.
//!
//! ```text
//! ABBE_SESSIONS=/tmp/speed cargo test --profile checked --test main sessions_for_speed
//! ```
//!
//! Without `ABBE_SESSIONS` the sessions go to a temporary folder, only their sizes are checked, and the longest is left
//! out.

use std::path::PathBuf;

use crate::plant::component::Cartesian;
use crate::plant::machine::{Machine, Stated};
use crate::plant::schedule::{Motion, Test, all_stand, with};
use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Noise, Plan, Recipe, Shape};

const WHITE: Noise = Noise::White { sigma_um: 0.3 };

/// A test of one turning axis: its reading is of a bar of `bar_mm` from a ball at `radius_mm` from the axis.
fn turning(axis: AxisName, radius_mm: f64, bar_mm: f64, range_deg: [f64; 2], step_deg: f64, traversals: u32) -> Test {
    let offset_mm = (bar_mm * bar_mm - radius_mm * radius_mm).sqrt();
    let (ball_mm, setup, beside, offset_mm) = match axis {
        AxisName::A => ([0.0, radius_mm, 0.0], format!("A{radius_mm}"), AxisName::X, -offset_mm),
        _ => ([radius_mm, 0.0, 0.0], format!("C{radius_mm}"), AxisName::Z, offset_mm),
    };
    let motions = with(with(all_stand(), axis, Motion::Turns), beside, Motion::Stands(offset_mm));
    Test {
        name: format!("{axis:?}{radius_mm}-{bar_mm}"),
        stated: Stated {
            workpiece_ball_mm: ball_mm,
            workpiece_ball_on: AxisName::C,
            spindle_ball_mm: [0.0; 3],
            bar_mm,
        },
        setup,
        motions,
        range_deg,
        step_deg,
        speed_deg_s: 2.0,
        traversals,
    }
}

/// Two tests of A in steps of `steps_deg[0]` and two of C in steps of `steps_deg[1]`, radii and bars of 100 to 300 mm.
fn four_tests(to_deg: [f64; 2], steps_deg: [f64; 2], traversals: u32) -> Plan {
    let of = |axis, radius_mm, bar_mm| {
        let (from_deg, which) = if axis == AxisName::A { (-20.0, 0) } else { (0.0, 1) };
        turning(axis, radius_mm, bar_mm, [from_deg, to_deg[which]], steps_deg[which], traversals)
    };
    let tests = vec![
        of(AxisName::A, 200.0, 200.0),
        of(AxisName::A, 200.0, 300.0),
        of(AxisName::C, 100.0, 100.0),
        of(AxisName::C, 100.0, 150.0),
    ];
    Plan::of_tests(Kind::Chapter4, Machine::default(), tests, false)
}

fn harmonic(order: u32, amplitude_um: f64) -> Injected {
    let component = Component::Motion(Freedom::Z, AxisName::C);
    Injected::new(component, Driver::Axis(AxisName::C), Shape::Harmonic { order, phase_deg: 40.0 }, amplitude_um)
}

fn drift(component: Component, amplitude_um: f64) -> Injected {
    Injected::new(component, Driver::Time, Shape::Drift, amplitude_um)
}

/// Three runs each way. Name, plan, noise, effects.
fn cases() -> Vec<(&'static str, Plan, Noise, Vec<Injected>)> {
    let large = || four_tests([80.0, 360.0], [0.5, 0.75], 6);
    let correlated = Noise::Serial { sigma_um: 0.3, coefficient: 0.8 };
    let drift_of_c = drift(Component::Location(Freedom::X, AxisName::C), 3.0);
    let drift_of_ball = drift(Component::SpindleBall(Cartesian(1)), 3.0);
    let smaller = four_tests([70.0, 225.0], [0.5, 0.75], 6);
    let empty = four_tests([70.0, 238.5], [0.5, 0.75], 6);
    let long = |step_deg| four_tests([70.0, 360.0], [step_deg; 2], 11);
    vec![
        ("harmonic-correlated", large(), correlated, vec![harmonic(3, 1.0)]),
        ("drift-harmonic-8", large(), WHITE, vec![drift_of_c, harmonic(8, 0.5)]),
        ("ball-drift-harmonic-6", smaller, WHITE, vec![drift_of_ball, harmonic(6, 0.5)]),
        ("nothing-6000", empty, WHITE, Vec::new()),
        ("nothing-100000", long(0.1), WHITE, Vec::new()),
        ("harmonic-100000", long(0.1), WHITE, vec![harmonic(3, 0.3)]),
        ("nothing-1000000", long(0.01), WHITE, Vec::new()),
    ]
}

/// The sessions have the numbers of readings that the table states. They go to `ABBE_SESSIONS` if that is set.
#[test]
fn sessions_for_speed() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = std::env::var("ABBE_SESSIONS").map_or_else(|_| temporary.path().to_path_buf(), PathBuf::from);
    let stated = [8184, 8184, 5784, 6000, 99_044, 99_044, 990_044];
    for ((seed, (name, plan, noise, effects)), readings) in (1..).zip(cases()).zip(stated) {
        if readings > 100_000 && std::env::var_os("ABBE_SESSIONS").is_none() {
            continue;
        }
        let recipe = Recipe { effects, noise, ..Recipe::new(plan.kind, seed) };
        assert_eq!(plan.instants.len(), readings, "{name}");
        recipe.draw_on(&plan).write(&folder.join(name)).expect("the session is written");
    }
}
