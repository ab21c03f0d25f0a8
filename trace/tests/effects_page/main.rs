//! Compares every cell of docs/reference/effects.md with the exact chain: the response of each kind of test to each
//! effect, and the aliases of each effect.
//!
//! A section of the page contains a session and a table. Its columns are:
//!
//! - `effect`;
//! - `in TEST`: amplitude by order of a full turn (`±` if it changes sign with the direction);
//! - `rms in TEST`;
//! - `aliases in TESTS` (`, one way`: forward runs alone; `, spindle ball known`): the effects that explain at least 90
//!   % of the square of the effect that remains after projection on the mounts.

mod changes;
mod page;
mod poses;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use abbe_files::ReadOptions;
use abbe_model::driver::Driver;
use abbe_model::effect::shape::{FirstOrderLag, Warmup};
use abbe_model::effect::{Effect, Shape};
use abbe_model::session::Session;
use abbe_model::session::planned::planned_session;
use changes::{At, Changes, Share, changes};
use page::{Section, effect, sections};

/// Highest order of the comparison.
const ORDERS: usize = 24;
/// Share of the greatest amplitude of a test below which an amplitude is omitted.
const SHOWN: f64 = 0.2;
/// Number of orders shown before `…`.
const MAX_SHOWN: usize = 3;
/// Shares of the square from which an alias counts as equal, and as an alias at all.
const SAME: f64 = 0.9999;
const ALIAS: f64 = 0.9;
/// Smallest significant change, µm per unit.
const NOTHING: f64 = 2e-3;
/// Number of aliases shown before `…`.
const MAX_ALIASES: usize = 6;

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// The session of a section. Its planned states are its readings, and its temperature rises by 1 K per hour.
fn session(toml: &str) -> Session {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.toml");
    let sessions = format!("\"{}/sessions/", workspace().display());
    std::fs::write(&path, toml.replace("\"sessions/", &sessions)).unwrap();
    poses::write(folder.path(), &path);
    let options = ReadOptions { allow_outside: true, ..ReadOptions::default() };
    let mut session = abbe_files::session(&path, &options).unwrap();
    let planned = planned_session(&session).unwrap();
    for (test, mut readings) in session.tests.iter_mut().zip(planned) {
        let rises = readings.time_s.iter().map(|time_s| 20.0 + time_s / 3600.0).collect();
        readings.drivers.insert("temperature_c".to_string(), rises);
        test.readings = Some(Arc::new(readings));
    }
    session
}

/// A number with two significant digits.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.1e}").parse().unwrap();
    let decimals = (1 - rounded.log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.decimals$}")
}

fn test_named(session: &Session, name: &str) -> usize {
    let found = session.tests.iter().position(|test| test.name == name);
    found.unwrap_or_else(|| panic!("no test {name}"))
}

/// Amplitudes by order, for example `1: 0.71, ±2: 0.30`.
fn orders(changes: &Changes, effect: usize, test: usize) -> String {
    let coordinates = changes.at.iter().filter(|at| at.test == test).map(|at| at.coordinate).max();
    let mut waves = Vec::new();
    for coordinate in 0..=coordinates.unwrap_or(0) {
        for (sign, amplitudes) in ["", "±"].iter().zip(changes.orders(effect, test, coordinate, ORDERS)) {
            for (order, amplitude) in amplitudes.into_iter().enumerate() {
                waves.push((coordinate, *sign, order, amplitude));
            }
        }
    }
    let greatest = waves.iter().map(|wave| wave.3).fold(0.0, f64::max);
    if greatest < NOTHING {
        return "–".into();
    }
    waves.retain(|wave| wave.3 >= SHOWN * greatest);
    let mut parts = Vec::new();
    for coordinate in 0..=coordinates.unwrap_or(0) {
        let own: Vec<_> = waves.iter().filter(|wave| wave.0 == coordinate).collect();
        let shown = own.iter().take(MAX_SHOWN);
        let mut text: Vec<String> =
            shown.map(|(_, sign, order, amplitude)| format!("{sign}{order}: {}", number(*amplitude))).collect();
        if own.len() > MAX_SHOWN {
            text.push("…".into());
        }
        let letter = if coordinates == Some(2) { ["x ", "y ", "z "][coordinate] } else { "" };
        if !text.is_empty() {
            parts.push(format!("{letter}{}", text.join(", ")));
        }
    }
    parts.join("; ")
}

/// The cell of an effect that follows time or temperature. Each reading is checked against the constant effect of the
/// component times the time function, which this test computes itself.
fn over_time(changes: &Changes, effects: &[Effect], effect: usize, wanted: &dyn Fn(&At) -> bool) -> Option<String> {
    let own = &effects[effect];
    let grows = |time_s: f64, mean_k: f64| match own.shape {
        Shape::Drift => time_s / 3600.0,
        Shape::Warmup(Warmup { tau_s }) => 1.0 - (-time_s / tau_s).exp(),
        // The response to 1 K per hour that begins at the first reading.
        Shape::FirstOrderLag(FirstOrderLag { tau_s, .. }) => {
            (time_s - tau_s * (1.0 - (-time_s / tau_s).exp())) / 3600.0 - mean_k
        }
        Shape::Steps(ref steps) => f64::from(time_s / 3600.0 - mean_k >= steps.at[0]),
        _ => time_s / 3600.0 - mean_k,
    };
    if !matches!(own.driver, Driver::Time | Driver::Column(_)) {
        return None;
    }
    let constant = effects.iter().position(|other| other.component == own.component && other.shape == Shape::Constant);
    let constant = constant.unwrap_or_else(|| panic!("{} has no row without its driver", own.id()));
    let readings = || changes.session.tests.iter().filter_map(|test| test.readings.as_ref());
    let times: Vec<f64> =
        readings().flat_map(|r| r.time_s.iter().flat_map(|t| std::iter::repeat_n(*t, r.channels))).collect();
    let mean_k = times.iter().sum::<f64>() / times.len() as f64 / 3600.0;
    let times = times.iter().zip(&changes.at).filter(|(_, at)| wanted(at)).map(|(time, _)| *time);
    let still = changes.of(constant, wanted);
    let moved = changes.of(effect, wanted);
    for ((time_s, still), moved) in times.zip(still.iter()).zip(moved.iter()) {
        let expected = still * grows(time_s, mean_k);
        assert!((moved - expected).abs() < 1e-5, "{}: {moved} {expected}", own.id());
    }
    Some(format!("`{}`, over time", own.component))
}

/// The aliases of an effect, nearest first.
fn aliases(own: usize, ids: &[String], observable: &[bool], by_setup: &[Share], between: &[Vec<Share>]) -> String {
    if !observable[own] {
        return "not observable".into();
    }
    let mut found: Vec<(bool, String)> = Vec::new();
    let mut add = |share: Share, name: String| {
        if share.least >= ALIAS {
            let same = share.least >= SAME;
            found.push((!same, format!("{} {name}", if same { "=" } else { "≈" })));
        }
    };
    add(by_setup[own], "set-up".into());
    if by_setup[own].least < SAME {
        for (other, share) in between[own].iter().enumerate().filter(|(other, _)| *other != own) {
            if observable[other] && by_setup[other].least < SAME {
                add(*share, ids[other].clone());
            }
        }
    }
    if by_setup[own].least < ALIAS && by_setup[own].most >= SAME {
        found.push((true, "at one phase set-up".into()));
    }
    found.sort_by_key(|(inexact, _)| *inexact);
    let more = found.len() > MAX_ALIASES;
    let mut found: Vec<String> = found.into_iter().map(|(_, text)| text).take(MAX_ALIASES).collect();
    if more {
        found.push("…".into());
    }
    if found.is_empty() { "–".into() } else { found.join(", ") }
}

/// The rows of a section's table, computed from the chain.
fn computed(section: &Section) -> Vec<Vec<String>> {
    let table = section.tables.last().unwrap();
    let session = session(section.toml.as_ref().unwrap());
    let ids: Vec<String> = table.rows.iter().map(|row| row[0].clone()).collect();
    let effects: Vec<Effect> = ids.iter().map(|id| effect(&session.machine, id)).collect();
    let changes = changes(session, &effects);
    let session = &changes.session;
    let mut rows: Vec<Vec<String>> = ids.iter().map(|id| vec![id.clone()]).collect();
    for (column, title) in table.header.iter().enumerate().skip(1) {
        if let Some(name) = title.strip_prefix("in ") {
            let test = test_named(session, name);
            for (own, row) in rows.iter_mut().enumerate() {
                let cell = over_time(&changes, &effects, own, &|at| at.test == test);
                row.push(cell.unwrap_or_else(|| orders(&changes, own, test)));
            }
        } else if let Some(name) = title.strip_prefix("rms in ") {
            let test = test_named(session, name);
            for (own, row) in rows.iter_mut().enumerate() {
                let rms = changes.rms(own, |at| at.test == test);
                row.push(if rms < NOTHING { "–".into() } else { number(rms) });
            }
        } else if let Some(names) = title.strip_prefix("aliases in ") {
            let (names, known) = match names.split_once(", ") {
                Some((names, words)) => (names, words.strip_suffix(" known").map(|thing| thing.replace(' ', "_"))),
                None => (names, None),
            };
            let one_way = title.ends_with(", one way");
            let tests: Vec<usize> = match names {
                "all" => (0..session.tests.len()).collect(),
                names => names.split(" + ").map(|name| test_named(session, name)).collect(),
            };
            let wanted = |at: &At| tests.contains(&at.test) && !(one_way && at.run % 2 == 1);
            let (by_setup, between) = changes.shares(wanted, known.as_deref());
            let of_orders = |test: usize| table.header.contains(&format!("in {}", session.tests[test].name));
            let shows = |own: usize, test: usize| match of_orders(test) {
                true => orders(&changes, own, test) != "–",
                false => changes.rms(own, |at| at.test == test) >= NOTHING,
            };
            let observable: Vec<bool> = (0..ids.len()).map(|own| tests.iter().any(|test| shows(own, *test))).collect();
            for (own, row) in rows.iter_mut().enumerate() {
                row.push(aliases(own, &ids, &observable, &by_setup, &between));
            }
        } else {
            // Columns in words are not computed.
            for (row, written) in rows.iter_mut().zip(&table.rows) {
                row.push(written.get(column).cloned().unwrap_or_default());
            }
        }
    }
    rows
}

#[test]
fn the_page_agrees_with_the_chain() {
    let text = std::fs::read_to_string(workspace().join("docs/reference/effects.md")).unwrap();
    let mut wrong = String::new();
    for section in sections(&text).iter().filter(|section| section.toml.is_some()) {
        let rows = computed(section);
        if rows != section.tables.last().unwrap().rows {
            wrong += &format!("\n## {}\n", section.title);
            for row in rows {
                wrong += &format!("| {} |\n", row.join(" | "));
            }
        }
    }
    assert!(wrong.is_empty(), "docs/reference/effects.md differs from the chain, which gives{wrong}");
}

#[test]
fn every_family_of_the_library_is_on_the_page() {
    let text = std::fs::read_to_string(workspace().join("docs/reference/effects.md")).unwrap();
    let sections = sections(&text);
    let listed = &sections.iter().find(|section| section.title == "The library").unwrap().tables[0];
    let families = abbe_trace::candidates::library::families().unwrap();
    let names: Vec<&str> = families.iter().map(|family| family.name.as_str()).collect();
    let written: Vec<&str> = listed.rows.iter().map(|row| row[0].as_str()).collect();
    assert_eq!(names, written);
    let rows: Vec<&String> = sections
        .iter()
        .filter(|section| section.toml.is_some())
        .flat_map(|section| section.tables.last().unwrap().rows.iter().map(|row| &row[0]))
        .collect();
    for row in &listed.rows {
        for example in row[1].split(", ") {
            assert!(rows.iter().any(|shown| *shown == example), "{example} has no row in any table");
        }
    }
}

/// Closed forms for a circle of X and Y with radius R at feed v: δL at path angle θ in direction s, µm per unit.
#[test]
fn circles_follow_their_closed_forms() {
    const R: f64 = 100.0;
    let v = 1000.0 / 60.0;
    let arcsec_um = 1e3 * std::f64::consts::PI / 648_000.0;
    let cases: [(&str, &dyn Fn(f64, f64) -> f64); 9] = [
        ("EC0Y", &|t, _| -0.5 * arcsec_um * R * (2.0 * t).sin()),
        ("EXX~X:power1", &|t, _| t.cos().powi(2)),
        ("EYX~X:power2", &|t, _| t.cos().powi(2) * t.sin()),
        ("EXX~X:backlash", &|t, s| 0.5 * s * t.sin().signum() * t.cos()),
        ("EYX~X:backlash", &|t, s| 0.5 * s * t.sin().abs()),
        ("EXX~X:lag", &|t, s| 0.5 * s * v * (2.0 * t).sin()),
        ("EYY~Y:lag", &|t, s| -0.5 * s * v * (2.0 * t).sin()),
        ("workpiece_ball.x", &|t, _| -t.cos()),
        ("bar", &|_, _| -1.0),
    ];
    let text = std::fs::read_to_string(workspace().join("docs/reference/effects.md")).unwrap();
    let sections = sections(&text);
    let circles = sections.iter().find(|section| section.title.contains("circles of X and Y")).unwrap();
    let session = session(circles.toml.as_ref().unwrap());
    let effects: Vec<Effect> = cases.iter().map(|(id, _)| effect(&session.machine, id)).collect();
    let changes = changes(session, &effects);
    let test = test_named(&changes.session, "F1000");
    for (own, (id, form)) in cases.iter().enumerate() {
        for (run, direction) in [(0, 1.0), (1, -1.0)] {
            let change = changes.of(own, |at| at.test == test && at.run == run);
            let turn = change.nrows() - 1;
            // The first and last reading of a run take direction and speed from their neighbours, and an axis has no
            // direction where it reverses.
            for k in (1..turn).filter(|k| 2 * k % turn != 0) {
                let along = if direction > 0.0 { k } else { turn - k };
                let angle = std::f64::consts::TAU * along as f64 / turn as f64;
                let (found, expected) = (change[(k, 0)], form(angle, direction));
                assert!((found - expected).abs() < 1e-3, "{id} at {angle}: {found} {expected}");
            }
        }
    }
}
