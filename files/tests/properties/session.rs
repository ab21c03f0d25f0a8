//! Properties of random sessions as files: written sessions read back equal.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use abbe_files::ReadOptions;
use abbe_files::table::csv;
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::document::edit::SessionText;
use abbe_model::driver::Driver;
use abbe_model::effect::{Component, Effect, Shape};
use abbe_model::frames::Rotation;
use abbe_model::instrument::stand::Stand;
use abbe_model::instrument::tracker::Tracker;
use abbe_model::instrument::{Station, Target};
use abbe_model::session::Session;
use abbe_model::session::readings::Readings;
use proptest::collection::vec;
use proptest::prelude::*;

use super::drawn_shapes::shapes;
use super::machines::{Drawn, cases, machines};

/// A session of a tracker as a user writes it: a tracker can observe the tool of any machine.
fn text(machine: &Machine) -> String {
    let mut text = format!(
        "[machine]\nname = \"{}\"\nchain = \"{}\"\nrotation = \"{}\"\n",
        machine.name,
        machine.code(),
        match machine.rotation {
            Rotation::Exact => "exact",
            Rotation::SmallAngle => "small-angle",
        }
    );
    for axis in &machine.axes {
        let kind = if axis.kind == AxisKind::Rotary { "rotary" } else { "linear" };
        // Writing to a String does not fail.
        let _ = writeln!(
            text,
            "[machine.axis.{}]\nkind = \"{kind}\"\ndirection = {:?}\norigin_mm = {:?}",
            axis.name, axis.direction, axis.origin_mm
        );
    }
    text + "\n[instrument]\nkind = \"tracker\"\nnoise_um = 10\n\n[[test]]\nname = \"T\"\ndata = \"T.csv\"\ntarget_mm = [1, 2, 3]\n"
}

fn read(folder: &Path) -> Result<Session, Diagnostic> {
    abbe_files::session(&folder.join("session.toml"), &ReadOptions::default())
}

/// Readings with times, runs, and the random positions and coordinates.
fn readings(machine: &Machine, rows: &[Vec<f64>]) -> Readings {
    let count = rows.len();
    Readings {
        run: (0..count).map(|row| 1 + row as i64 / 3).collect(),
        time_s: (0..count).map(|row| 0.25 * row as f64).collect(),
        drivers: [("temperature_c", 9), ("spindle_speed_rpm", 8)]
            .map(|(name, column)| (name.to_string(), rows.iter().map(|row| 20.0 + row[column]).collect()))
            .into(),
        positions: machine
            .axes
            .iter()
            .enumerate()
            .map(|(index, axis)| {
                let reach = match axis.kind {
                    AxisKind::Linear => 300.0,
                    AxisKind::Rotary => 3.0,
                };
                rows.iter().map(|row| reach * row[index]).collect()
            })
            .collect(),
        channels: 3,
        observed: rows.iter().flat_map(|row| [6, 7, 8].map(|k| 1000.0 * row[k])).collect(),
        ..Readings::default()
    }
}

/// Effects on any error motion with any axis as driver.
fn effects() -> impl Strategy<Value = Vec<(usize, usize, usize, Shape, Shape)>> {
    let places = (0_usize..6, 0_usize..6, 0_usize..6);
    let one = (places, shapes(AxisKind::Linear), shapes(AxisKind::Rotary));
    vec(one.prop_map(|((a, b, c), linear, rotary)| (a, b, c, linear, rotary)), 0..6)
}

fn declared(machine: &Machine, drawn: Vec<(usize, usize, usize, Shape, Shape)>) -> Vec<Effect> {
    let axes = machine.axes.len();
    let effects = drawn.into_iter().map(|(freedom, of, driver, linear, rotary)| {
        let driver = &machine.axes[driver % axes];
        Effect::new(
            Component::Axis(ErrorName {
                kind: ErrorKind::Motion,
                freedom: Freedom::ALL[freedom],
                axis: machine.axes[of % axes].name.clone(),
            }),
            Driver::Axis(driver.name.clone()),
            if driver.kind == AxisKind::Rotary { rotary } else { linear },
        )
    });
    effects.collect()
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * a.abs().max(1.0)
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn a_written_session_reads_back_equal(
        drawn in machines(),
        effects in effects(),
        rows in vec(vec(-1.0..1.0, 10), 4..12),
    ) {
        let Drawn { machine, .. } = drawn;
        let folder = tempfile::tempdir().unwrap();
        let effects = declared(&machine, effects);
        let readings = readings(&machine, &rows);
        let mut session = SessionText::new(&text(&machine), folder.path()).unwrap();
        session.add_effects(&effects, &machine).unwrap();
        let session = session.to_string();
        fs::write(folder.path().join("session.toml"), &session).unwrap();
        let station = Station::Tracker(Tracker {
            target: Target::on_tool([1.0, 2.0, 3.0]),
            stand: Stand { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], origin: [0.0; 3] },
            is_polar: false,
        });
        let data = folder.path().join("T.csv");
        std::fs::write(&data, csv::text(&machine, &station, &readings)).unwrap();

        let back = read(folder.path()).map_err(|fault| TestCaseError::fail(format!("{fault}\n{session}")))?;
        prop_assert_eq!(back.machine.code(), machine.code());
        prop_assert_eq!(back.machine.rotation, machine.rotation);
        for (back, axis) in back.machine.axes.iter().zip(&machine.axes) {
            prop_assert_eq!((&back.name, back.kind, back.origin_mm), (&axis.name, axis.kind, axis.origin_mm));
            // Reading normalises a direction again.
            for (back, part) in back.direction.iter().zip(axis.direction) {
                prop_assert!((back - part).abs() < 1e-15);
            }
        }
        prop_assert_eq!(&back.effects, &effects);
        let found = back.tests[0].readings.as_ref().unwrap();
        prop_assert_eq!(&found.run, &readings.run);
        prop_assert_eq!(found.channels, 3);
        let pairs = [
            (&found.observed, &readings.observed),
            (&found.time_s, &readings.time_s),
            (&found.drivers["temperature_c"], &readings.drivers["temperature_c"]),
            (&found.drivers["spindle_speed_rpm"], &readings.drivers["spindle_speed_rpm"]),
        ];
        let positions = found.positions.iter().zip(&readings.positions);
        for (found, written) in pairs.into_iter().chain(positions) {
            prop_assert_eq!(found.len(), written.len());
            prop_assert!(found.iter().zip(written).all(|(a, b)| near(*a, *b)));
        }

        // Written again, the result is equal to the byte.
        let first = fs::read(&data).unwrap();
        std::fs::write(&data, csv::text(&back.machine, &back.tests[0].station, found)).unwrap();
        let again = read(folder.path()).unwrap();
        let found = again.tests[0].readings.as_ref().unwrap();
        std::fs::write(&data, csv::text(&again.machine, &again.tests[0].station, found)).unwrap();
        prop_assert_eq!(first, fs::read(&data).unwrap());
    }

    /// The unit is part of the column name: degrees or radians, mm or µm give the same readings.
    #[test]
    fn a_column_in_another_unit_is_the_same_column(angles in vec(-360.0..360.0, 4..12), lengths in vec(-1.0..1.0, 12)) {
        let machine = "[machine]\nchain = \"w C b X t\"\n[machine.axis.C]\n[machine.axis.X]\n\n[instrument]\nkind = \"ballbar\"\n\n\
                       [[test]]\nname = \"T\"\ndata = \"T.csv\"\nbar_mm = 100\nworkpiece_ball_mm = [0, 100, 0]\nspindle_ball_mm = [0, 0, 0]\n";
        let of = |header: &str, cells: &dyn Fn(f64, f64) -> String| {
            let folder = tempfile::tempdir().unwrap();
            let rows: Vec<String> = angles.iter().zip(&lengths).map(|(angle, length)| cells(*angle, *length)).collect();
            fs::write(folder.path().join("session.toml"), machine).unwrap();
            fs::write(folder.path().join("T.csv"), format!("{header}\n{}\n", rows.join("\n"))).unwrap();
            read(folder.path()).unwrap().tests.remove(0).readings.unwrap()
        };
        let plain = of("c_deg,length_mm", &|angle, length| format!("{angle},{}", 100.0 + length));
        for (header, cells) in [
            ("c_rad,length_mm", &(|angle: f64, length: f64| format!("{},{}", angle.to_radians(), 100.0 + length)) as &dyn Fn(f64, f64) -> String),
            ("c_deg,deviation_um", &|angle, length| format!("{angle},{}", 1e3 * length)),
        ] {
            let other = of(header, cells);
            for (a, b) in other.positions.iter().flatten().zip(plain.positions.iter().flatten()) {
                prop_assert!(near(*a, *b), "{header}: {a} {b}");
            }
            for (a, b) in other.observed.iter().zip(&plain.observed) {
                prop_assert!((a - b).abs() < 1e-12 * 100.0, "{header}: {a} {b}");
            }
        }
    }
}
