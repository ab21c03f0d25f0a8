//! What was wrong with a session of the independent plant is named.

use abbe::files::{self, ReadOptions};
use abbe::identify::plausibility::{Plausibility, SuggestionKind};
use abbe::model::session::Session;
use abbe::trace::SessionFit;
use serde_json::Value;

use crate::plant::{AxisName, Cartesian, Component, Driver, Freedom, Injected, Kind, Recipe, Shape};
use crate::suite::identify::{result_and_screen, session_of, with_length};
use crate::suite::ready;

fn as_it_is(recipe: &Recipe) -> Session {
    session_of(recipe, &recipe.plan(), |_, _, _| {})
}

fn plausibility(session: &Session) -> Plausibility {
    SessionFit::of(session, 1).unwrap().result.plausibility
}

/// A ball that is moved by 40 µm between the second test and the third.
fn moved(component: Component) -> Injected {
    Injected::new(component, Driver::Nothing, Shape::Remount { after_test: 1 }, 40.0)
}

/// A ball that was moved between two tests is moved in all later ones.
#[test]
fn a_ball_that_was_moved_is_named_with_the_test_before_which_it_moved() {
    for (component, thing) in [
        (Component::WorkpieceBall(Cartesian(2)), "workpiece ball of P1"),
        (Component::SpindleBall(Cartesian(2)), "spindle ball of S1"),
    ] {
        let recipe = Recipe { shared_mounts: true, ..Recipe::new(Kind::Rotary, 21) }.with(moved(component));
        let found = plausibility(&as_it_is(&recipe));
        let words: Vec<&str> = found.suggestions.iter().map(|one| one.words.as_str()).collect();
        let wanted = format!("the {thing} was moved before test C100, for C150 too");
        assert!(words.contains(&wanted.as_str()), "{words:#?}\n{:#?}", found.conflicts);
    }
}

/// A trace names the move too, beside the axial motion that the table has; in Y, where the residual shows the move, it finds the
/// move itself, and claims nothing else.
#[test]
fn a_trace_names_a_ball_that_was_moved() {
    let wave = Shape::Harmonic { order: 2, phase_deg: 30.0 };
    let table = Component::Motion(Freedom::Z, AxisName::C);
    let axial = Injected::new(table, Driver::Axis(AxisName::C), wave, 2.0);
    for (letter, axial, seed) in [(2, Some(axial), 22), (1, None, 23)] {
        let recipe = Recipe { shared_mounts: true, ..Recipe::new(Kind::Rotary, seed) };
        let ball = moved(Component::WorkpieceBall(Cartesian(letter)));
        let recipe = axial.iter().cloned().fold(recipe.with(ball), Recipe::with);
        let folder = tempfile::tempdir().unwrap();
        recipe.draw().write(folder.path()).unwrap();
        let (found, screen) = result_and_screen("trace", &folder.path().join("session.toml"), &["--all"]);
        let words = "the workpiece ball of P1 was moved before test C100, for C150 too";
        // The model before is that of a fit, also where the search uses no prior that the readings contradict.
        let (fitted, _) = result_and_screen("fit", &folder.path().join("session.toml"), &[]);
        for key in ["chi_square", "degrees_of_freedom", "noise_um"] {
            let [of_fit, before] = [&fitted[key], &found["before"][key]].map(|value| value.as_f64().unwrap());
            assert!((before / of_fit - 1.0).abs() < 1e-6, "{key}: {of_fit} and {before}");
        }
        if axial.is_some() {
            let mut suggestions = found["suggestions"].as_array().into_iter().flatten();
            let of_move = suggestions.find(|own| own["description"] == words);
            assert!(of_move.is_some_and(|own| own["kind"] == "setup-moved") && screen.contains(words), "{screen}");
        }
        let [effect] = &found["effects"].as_array().unwrap()[..] else { panic!("{screen}") };
        let estimate = &effect["parameters"][0];
        let [value, u] = ["value", "u"].map(|key| estimate[key].as_f64().unwrap());
        let truth = if axial.is_some() { 2.0 } else { 40.0 };
        assert!((value.abs() - truth).abs() < 4.0 * u, "{estimate}");
        let mut all = std::iter::once(effect).chain(effect["aliases"].as_array().unwrap());
        let is_truth = |own: &Value| match axial {
            Some(_) => own["component"] == "EZC" && own["order"] == 2,
            None => own["component"] == "workpiece_ball.y" && own["tests"] == serde_json::json!(["C100", "C150"]),
        };
        assert!(all.any(is_truth), "{screen}");
    }
}

/// The sign of one test is the first of what is suggested, and of two bars that are off both are named.
#[test]
fn the_simplest_mistake_that_explains_all_tests_comes_first() {
    let recipe = Recipe { shared_mounts: true, ..Recipe::new(Kind::Rotary, 31) };
    let plan = recipe.plan();
    for test in ["C100", "A150"] {
        let bar_mm = plan.tests.iter().find(|own| own.name == test).unwrap().stated.bar_mm;
        let session = session_of(&recipe, &plan, |own, _, cells| {
            if own == test {
                with_length(cells, |length| 2.0 * bar_mm - length);
            }
        });
        let found = plausibility(&session);
        let first = &found.suggestions[0];
        assert_eq!((first.kind, first.subject.as_str()), (SuggestionKind::DeviationSign, test), "{found:#?}");
    }
    for off_um in [12.3, -9.0] {
        let session = session_of(&recipe, &plan, |_, _, cells| with_length(cells, |length| length + off_um * 1e-3));
        let found = plausibility(&session);
        // A single bar explains nothing; the readings do not separate both from the ball that they turn about.
        let bars: Vec<_> = found.suggestions.iter().filter(|one| one.subject.starts_with("bar[")).collect();
        assert!(bars.first().is_some_and(|one| one.subject == "bar[B100+B150]"), "{found:#?}");
        let words = &bars[0].words;
        assert!(words.contains("`bar_mm`") && words.contains("`length_mm`"), "{words}");
    }
}

/// X and Y are exchanged in the data of a bar or of an R-test, or the data are in inches: neither instrument reaches its place,
/// and the message says why.
#[test]
fn exchanged_columns_and_inches_are_named() {
    let recipe = Recipe::new(Kind::Simultaneous, 41).readings(400);
    let bundled = ready("r-test/measured");
    for of_bar in [true, false] {
        let told = |change: &dyn Fn(&str) -> String| {
            let folder = tempfile::tempdir().unwrap();
            if of_bar {
                recipe.draw_on(&recipe.plan()).write(folder.path()).unwrap();
            } else {
                for entry in std::fs::read_dir(&bundled).unwrap() {
                    let path = entry.unwrap().path();
                    std::fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
                }
            }
            for entry in std::fs::read_dir(folder.path()).unwrap() {
                let path = entry.unwrap().path();
                if path.extension().is_some_and(|extension| extension == "csv") {
                    std::fs::write(&path, change(&std::fs::read_to_string(&path).unwrap())).unwrap();
                }
            }
            let read = files::session(&folder.path().join("session.toml"), &ReadOptions::default());
            read.err().map_or_else(String::new, |error| error.help().unwrap_or_default().to_string())
        };
        assert_eq!(told(&str::to_string), "");
        let exchanged = |table: &str| {
            let (header, rows) = table.split_once('\n').unwrap();
            let named = |name: &str| match name {
                "x_mm" => "y_mm".to_string(),
                "y_mm" => "x_mm".to_string(),
                name => name.to_string(),
            };
            header.split(',').map(named).collect::<Vec<_>>().join(",") + "\n" + rows
        };
        let help = told(&exchanged);
        assert!(help.contains("the columns of Y and X were exchanged"), "{help}");
        let help = told(&in_inches);
        let axes = if of_bar { "Y and X" } else { "X and Z" };
        assert!(help.contains(&format!("the positions of {axes} were read in inches rather than mm")), "{help}");
    }
}

/// The session of the bundled R-test with a change of the header and of each reading in mm.
fn of_r_test(header: impl Fn(&str) -> String, reading: impl Fn(f64) -> f64) -> Session {
    let folder = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(ready("r-test/measured")).unwrap() {
        let path = entry.unwrap().path();
        let mut text = std::fs::read_to_string(&path).unwrap();
        if path.extension().is_some_and(|extension| extension == "csv") {
            let (names, rows) = text.split_once('\n').unwrap();
            let is_reading: Vec<bool> = names.split(',').map(|name| name.starts_with('d')).collect();
            let row = |line: &str| {
                let cells = line.split(',').zip(&is_reading).map(|(cell, is_reading)| match is_reading {
                    true => format!("{:.9}", reading(cell.parse().unwrap())),
                    false => cell.to_string(),
                });
                cells.collect::<Vec<_>>().join(",") + "\n"
            };
            text = header(names) + "\n" + &rows.lines().map(row).collect::<String>();
        }
        std::fs::write(folder.path().join(path.file_name().unwrap()), text).unwrap();
    }
    files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap()
}

/// Two columns of the readings of an R-test are exchanged, or its readings are in inches: each is what is suggested. As they are,
/// nothing is.
#[test]
fn exchanged_readings_and_readings_in_inches_are_named() {
    let same = |value: f64| value;
    let found = plausibility(&of_r_test(str::to_string, same));
    assert!(found.suggestions.is_empty(), "{found:#?}");
    for (one, other) in [("dx_mm", "dy_mm"), ("dx_mm", "dz_mm"), ("dy_mm", "dz_mm")] {
        let exchanged = |names: &str| names.replace(one, "?").replace(other, one).replace('?', other);
        let found = plausibility(&of_r_test(exchanged, same));
        let words = format!("the columns {} and {} are exchanged", &one[..2], &other[..2]);
        let first = &found.suggestions[0];
        assert_eq!((first.kind, &first.words), (SuggestionKind::ColumnsExchanged, &words), "{found:#?}");
    }
    // Millionths of an inch under µm.
    let in_um = |names: &str| {
        ["dx", "dy", "dz"]
            .iter()
            .fold(names.to_string(), |names, axis| names.replace(&format!("{axis}_mm"), &format!("{axis}_um")))
    };
    let found = plausibility(&of_r_test(in_um, |mm| mm / 25.4e-6));
    let first = &found.suggestions[0];
    assert_eq!(first.words, "the readings are in millionths of an inch, not in µm", "{found:#?}");
}

/// A table whose linear axes are in inches under names in mm.
fn in_inches(table: &str) -> String {
    let (header, rows) = table.split_once('\n').unwrap();
    let is_length: Vec<bool> = header.split(',').map(|name| ["x_mm", "y_mm", "z_mm"].contains(&name)).collect();
    let scaled = rows.lines().map(|line| {
        let cells = line.split(',').zip(&is_length).map(|(cell, is_length)| match is_length {
            true => format!("{:.9}", cell.parse::<f64>().unwrap() / 25.4),
            false => cell.to_string(),
        });
        cells.collect::<Vec<_>>().join(",") + "\n"
    });
    format!("{header}\n{}", scaled.collect::<String>())
}
