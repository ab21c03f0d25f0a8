//! NC programs of planned tests: the motion of a plan as data, written for a control.
//!
//! A program moves the axes through the states of the session's `sweep` or `path`, so that the readings belong to the
//! positions that the session states. Before and after the measured path the motion continues by an overshoot, which
//! keeps acceleration out of the readings. What the interpreters of controls make of a path that no single block
//! describes is a polyline, whose chord error is bounded:
//!
//! ```text
//! | ‖P_w − P_s‖ at the middle of a segment − ‖P_w − P_s‖ at its ends |  ≤  chord error
//! ```
//!
//! - [`options`]: what the user may choose; [`block`], [`program`]: the blocks of a test, and where they come from;
//! - `comment`: which parts of a name a program may contain;
//! - [`CONTROLS`]: controls that read G codes, after ISO 6983-1, and the plain text of the TNC.

pub mod block;
mod comment;
mod heidenhain;
mod iso;
pub mod options;
mod path;
pub mod program;

use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::session::Moves;
use abbe_model::session::{Session, Test};
use abbe_model::words::listed;

use crate::error;

pub use options::NcOptions;
pub use program::Program;

/// A control that programs are written for.
pub trait Control: Sync {
    /// Its name in options.
    fn word(&self) -> &'static str;
    /// The ending of its files.
    fn extension(&self) -> &'static str;
    /// The source of its syntax.
    fn source(&self) -> &'static str;
    /// Decimals of a position, mm or degrees, unless the options state the increment of the control.
    fn decimals(&self) -> usize;
    /// Whether an interpreter of this control has run its programs in the project's tests.
    fn is_run(&self) -> bool;
    /// The work offset that gives its programs their positions, in the words of its operators.
    fn work_offset(&self) -> &'static str;
    /// Whether its programs have numbers.
    fn has_numbers(&self) -> bool;
    /// Whether circles are possible in a plane of these two axes.
    fn has_arc(&self, plane: Plane) -> bool;
    /// Whether the control moves the tool point over the table while rotary axes turn.
    fn has_tool_point(&self) -> bool;
    /// The name of a program by the name of its test, without the ending.
    fn name(&self, test: &str) -> String;
    /// The text of a program.
    fn text(&self, number: usize, program: &Program, options: &NcOptions) -> String;
    /// The program that calls the others, by name and title.
    fn main(&self, calls: &[(String, String)], options: &NcOptions) -> String;
}

/// A plane of two linear axes, in the order in which a counterclockwise turn goes from the first to the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// X to Y.
    Xy,
    /// Z to X.
    Zx,
    /// Y to Z.
    Yz,
}

/// The controls.
pub static CONTROLS: [&dyn Control; 4] = [&iso::LINUXCNC, &iso::FANUC, &iso::SIEMENS, &heidenhain::Heidenhain];

/// The control of a name.
///
/// # Errors
/// If there is none.
pub fn control(word: &str) -> Result<&'static dyn Control, Diagnostic> {
    CONTROLS.into_iter().find(|control| control.word() == word).ok_or_else(|| {
        let known: Vec<&str> = CONTROLS.iter().map(|control| control.word()).collect();
        error::nc(format!("no control is called `{word}`"), format!("the controls are {}", known.join(", ")))
    })
}

/// A file of a program: its name and its text.
pub type NcFile = (String, String);

/// What an operator has to know of the program of a test.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The test.
    pub test: String,
    /// The file of its program.
    pub file: String,
    /// The number of its program, on a control whose programs have numbers.
    pub number: Option<u32>,
    /// Positions of all axes where the instrument is mounted, with overshoot and feed-in, mm and degrees.
    pub mounted_at: Vec<f64>,
    /// Positions of all axes where the motion begins, with overshoot, mm and degrees.
    pub start: Vec<f64>,
    /// Positions of all axes at which the balls of a bar coincide, mm and degrees; `None` if they cannot.
    pub centring: Option<Vec<f64>>,
    /// The feed of the measured path and its unit.
    pub feed: (f64, &'static str),
    /// Duration of all traversals with overshoot and pauses, min.
    pub minutes: f64,
}

/// The programs of a session.
#[derive(Clone, Debug)]
pub struct NcFiles {
    /// `main`, then the programs of the tests in their order.
    pub files: Vec<NcFile>,
    /// What the programs remark about their tests, each with the name of the test.
    pub warnings: Vec<String>,
    /// The moves of the programs beside the measured paths.
    pub moves: Vec<Moves>,
    /// What the operator has to know of the program of each test, in their order.
    pub runs: Vec<Run>,
}

/// Whether every axis has a letter of NC programs: joints of robots are moved by other means.
pub fn has_letters(machine: &Machine) -> bool {
    program::letters(machine).is_ok()
}

/// Whether programs of a session can be written: every axis has a letter, and every test that is not measured states a
/// motion.
pub fn has_programs(session: &Session) -> bool {
    has_letters(&session.machine)
        && session.tests.iter().any(states_motion)
        && session.tests.iter().all(|test| states_motion(test) || test.readings.is_some())
}

/// Whether a program can follow from what the session states of a test.
fn states_motion(test: &Test) -> bool {
    test.motion.is_some()
}

/// The programs of every test of a session, and `main`, which calls them. A test whose positions stand in its readings alone
/// has been measured: beside others it has no program.
///
/// # Errors
/// If a test has neither a motion nor readings, no test has a motion, an axis has no letter, an axis would leave its
/// travel, or the control lacks what the options ask for.
pub fn files(session: &Session, control: &dyn Control, options: &NcOptions) -> Result<NcFiles, Diagnostic> {
    options.check(control, session.tests.len())?;
    let (mut files, mut warnings, mut moves, mut runs) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut calls: Vec<(String, String)> = Vec::new();
    let mut seen: Vec<&str> = Vec::new();
    let (planned, measured): (Vec<&Test>, Vec<&Test>) =
        session.tests.iter().partition(|test| states_motion(test) || test.readings.is_none());
    let measured: Vec<&str> = measured.iter().map(|test| test.name.as_str()).collect();
    let planned = if planned.is_empty() { session.tests.iter().collect() } else { planned };
    if planned.len() < session.tests.len() {
        warnings.push(format!(
            "no program for {}: measured, and without a motion in the session",
            listed(&measured, "and")
        ));
    }
    for (number, test) in planned.into_iter().enumerate() {
        // The workpiece ball is centred once for each of its places.
        let centred = seen.contains(&test.setup.as_str());
        seen.push(&test.setup);
        let program = Program::of(session, test, control, options, centred)?;
        warnings.extend(program.warnings.iter().map(|warning| format!("test \"{}\": {warning}", test.name)));
        moves.extend(program.moves.iter().cloned());
        let mut name = control.name(&test.name);
        if name == "main" || calls.iter().any(|(other, _)| other.eq_ignore_ascii_case(&name)) {
            name = format!("{name}{}", number + 1);
        }
        let file = format!("{name}.{}", control.extension());
        runs.push(Run {
            test: test.name.clone(),
            file: file.clone(),
            number: control.has_numbers().then(|| options.number() + number as u32 + 1),
            mounted_at: program.mounted_at.clone(),
            start: program.start.clone(),
            centring: program.centring.clone(),
            feed: program.feed,
            minutes: program.minutes,
        });
        files.push((file, control.text(number + 1, &Program { name: name.clone(), ..program }, options)));
        calls.push((name, test.name.clone()));
    }
    files.insert(0, (format!("main.{}", control.extension()), control.main(&calls, options)));
    Ok(NcFiles { files, warnings, moves, runs })
}
