//! What was wrong with a session of the independent plant is named.

use std::path::Path;

use abbe::files::{self, ReadOptions};
use abbe::identify::plausibility::{Plausibility, SuggestionKind};
use abbe::model::session::Session;
use abbe::trace::SessionFit;

use crate::plant::{Cartesian, Component, Driver, Injected, Kind, Recipe, Shape};
use crate::suite::identify::{session_of, with_length};

fn as_it_is(recipe: &Recipe) -> Session {
    session_of(recipe, &recipe.plan(), |_, _, _| {})
}

fn plausibility(session: &Session) -> Plausibility {
    SessionFit::of(session, 1).unwrap().result.plausibility
}

/// A ball that was moved between two tests is moved in all later ones.
#[test]
fn a_ball_that_was_moved_is_named_with_the_test_before_which_it_moved() {
    let moved = |component| Injected::new(component, Driver::Nothing, Shape::Remount { after_test: 1 }, 40.0);
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

/// X and Y are exchanged in the data: the bar reaches nowhere, and the message says why.
#[test]
fn exchanged_columns_are_named() {
    let recipe = Recipe::new(Kind::Simultaneous, 41).readings(400);
    let plan = recipe.plan();
    let folder = tempfile::tempdir().unwrap();
    recipe.draw_on(&plan).write(folder.path()).unwrap();
    let of = |folder: &Path| files::session(&folder.join("session.toml"), &ReadOptions::default());
    assert!(of(folder.path()).is_ok());
    for test in &plan.tests {
        let file = folder.path().join(format!("{}.csv", test.name));
        let text = std::fs::read_to_string(&file).unwrap().replacen("x_mm,y_mm", "y_mm,x_mm", 1);
        std::fs::write(&file, text).unwrap();
    }
    let help = of(folder.path()).unwrap_err().help().unwrap_or_default().to_string();
    assert!(help.contains("the columns of Y and X were exchanged"), "{help}");
}
