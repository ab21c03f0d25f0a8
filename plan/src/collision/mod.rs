//! Clearance of bar, holders and bodies along a test: capsules, boxes and surfaces of triangles.
//!
//! | against | compared with |
//! |---|---|
//! | bar | bodies of both sides and of the bed; a holder beyond `2 (r_bar + r_holder)` from the ball that they share |
//! | workpiece holder | spindle holder, bodies of the tool side and of the bed |
//! | spindle holder | workpiece holder, bodies of the workpiece side and of the bed |
//! | body of the workpiece side | bodies of the tool side and of the bed |
//! | body of the tool side | bodies of the bed |
//!
//! Bodies of one side are not compared with each other, and two parts without a moving axis between them only once.
//! Between two states of a test, axes are interpolated around the state with the least clearance.

mod along;
mod parts;
mod shape;

use std::collections::BTreeMap;

use abbe_model::Diagnostic;
use abbe_model::session::Moves;
use abbe_model::session::{Session, Test};
use schemars::JsonSchema;
use serde::Serialize;

use super::states;
pub use parts::{Bodies, Parts};
pub(crate) use shape::segment_distance;

/// The least clearance of a test.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TestClearance {
    /// The test.
    pub test: String,
    /// Least distance of two bodies over the test, mm. At most 0 if they collide.
    pub clearance_mm: f64,
    /// The two bodies: `bar`, `workpiece holder`, `spindle holder`, or names of the machine file.
    pub between: [String; 2],
    /// Positions of all axes there: `a_deg`, `x_mm`, …
    pub at: BTreeMap<String, f64>,
}

/// The least clearance of every test with states, in their order; empty if nothing is to be compared.
pub fn clearances(session: &Session) -> Vec<TestClearance> {
    let bodies = Bodies::of(&session.machine);
    let of = |test: &Test| {
        let readings = test.readings.as_ref()?;
        Parts::of(session, &bodies, test)?.least(&test.name, readings)
    };
    session.tests.iter().filter_map(of).collect()
}

/// The sentence that nothing is compared with spindle and table, although a test moves; `None` if the machine states bodies.
/// With `measured`, tests with data count, too.
pub fn unchecked(session: &Session, measured: bool) -> Option<String> {
    let moves = |test: &Test| {
        test.motion.is_some() && test.station.table_point().is_some() && (measured || test.readings.is_none())
    };
    (session.machine.bodies.is_empty() && session.tests.iter().any(moves)).then(|| {
        "clearance is not checked: the machine states no `[[body]]`, such as its table and its spindle".to_string()
    })
}

/// The sentences about tests, and moves of their programs, with less clearance than the session asks for.
///
/// # Errors
/// If the states of a test cannot be planned.
pub fn warnings_of_programs(session: &Session, moves: &[Moves]) -> Result<Vec<String>, Diagnostic> {
    let complete = states::complete(session, true)?;
    let mut found: Vec<String> = unchecked(session, true).into_iter().collect();
    found.extend(warnings(&complete, &clearances(&complete)));
    found.extend(warnings_of_moves(session, moves));
    Ok(found)
}

/// The sentences about tests with less clearance than the session asks for.
pub fn warnings(session: &Session, found: &[TestClearance]) -> Vec<String> {
    found.iter().filter_map(|found| warning(session, found, "")).collect()
}

/// The sentences about moves with less clearance than the session asks for: those of programs beside the states of a
/// test.
pub fn warnings_of_moves(session: &Session, moves: &[Moves]) -> Vec<String> {
    let bodies = Bodies::of(&session.machine);
    let of = |moves: &Moves| {
        let test = session.tests.iter().find(|test| test.name == moves.test)?;
        let found = Parts::of(session, &bodies, test)?.least_of_moves(moves)?;
        warning(session, &found, &format!("{}: ", moves.stage))
    };
    moves.iter().filter_map(of).collect()
}

fn warning(session: &Session, found: &TestClearance, stage: &str) -> Option<String> {
    if found.clearance_mm >= session.clearance.unwrap_or_default().least_mm.0 {
        return None;
    }
    let at: Vec<String> = found.at.iter().map(|(name, q)| format!("{name} = {q:.3}")).collect();
    let [one, other] = &found.between;
    let what = if found.clearance_mm <= 0.0 {
        format!("{one} and {other} collide")
    } else {
        format!("{one} and {other} come within {:.1} mm", found.clearance_mm)
    };
    Some(format!("test \"{}\": {stage}{what} at {}", found.test, at.join(", ")))
}
