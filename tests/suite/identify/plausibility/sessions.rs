//! Chapter 5 with one mistake each, on readings of the independent plant.

use std::path::Path;

use abbe::files::{self, ReadOptions};
use abbe::model::session::Session;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::plant::files::{DriverColumns, session_files};
use crate::plant::noise::{normal, traversal};
use crate::plant::recipe::Row;
use crate::plant::schedule::{Motion, with};
use crate::plant::{AxisName, Kind, Noise, Plan};

/// The bar as it is and with its extension, calibrated, mm.
const BARS_MM: [f64; 2] = [99.9881, 149.9946];
/// Pivot from the axis, mm.
const RADIUS_MM: f64 = 100.0;
/// Steps that give 136, 376 and 3,616 readings.
pub const STEPS_DEG: [f64; 3] = [30.0, 10.0, 1.0];

/// What was done wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mistake {
    None,
    /// The spindle ball 30 µm off in A100 where 1 µm is stated.
    SpindleBall,
    /// The direction of an axis.
    Reversed(&'static str),
    /// A and C exchanged in the chain.
    Exchanged,
    /// C150 from another session.
    OtherSession,
    /// The ball at −R.
    Mirrored,
    /// The sign of the deviations.
    DeviationSign,
    /// The correction of the shorter bar's calibration has the wrong sign.
    BarSign,
}

/// The ten mistakes.
pub const MISTAKES: [Mistake; 10] = [
    Mistake::SpindleBall,
    Mistake::Reversed("A"),
    Mistake::Reversed("Z"),
    Mistake::Reversed("C"),
    Mistake::Reversed("X"),
    Mistake::Exchanged,
    Mistake::OtherSession,
    Mistake::Mirrored,
    Mistake::DeviationSign,
    Mistake::BarSign,
];

/// The machine of the mistaken sessions, in the order of the plan: EY0A, EZ0A, EB0A, EC0A, EX0C, EY0C, EA0C, EB0C; µm
/// and ″.
const MACHINE: [f64; 8] = [35.3, -21.8, -1.3, 12.4, 18.6, -27.1, 6.2, -8.9];
/// Another machine, or the same on another day.
const OTHER_MACHINE: [f64; 8] = [12.0, 9.5, 7.3, -4.8, -16.2, 21.7, -11.0, 5.1];

/// The plan of chapter 5 with all readings `step_deg` apart.
pub fn plan(step_deg: f64) -> Plan {
    let mut tests = Kind::Rotary.tests(step_deg);
    let offset_mm = (BARS_MM[1].powi(2) - RADIUS_MM.powi(2)).sqrt();
    for test in &mut tests {
        test.step_deg = step_deg;
        let long = test.stated.bar_mm > 120.0;
        test.stated.bar_mm = BARS_MM[usize::from(long)];
        let (axis, at_mm) =
            if test.name.starts_with('A') { (AxisName::X, -offset_mm) } else { (AxisName::Z, offset_mm) };
        if long {
            test.motions = with(test.motions, axis, Motion::Stands(at_mm));
        }
    }
    Plan::of_tests(Kind::Rotary, Default::default(), tests, false)
}

/// The readings of a machine, its set-ups drawn from what is stated of them.
fn readings(plan: &Plan, machine: Option<&[f64; 8]>, noise: Noise, off_um: f64, seed: u64) -> Vec<Row> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut values: Vec<f64> = (plan.unknowns.iter())
        .map(|unknown| match (unknown.prior_u_um, unknown.component.unit()) {
            (Some(u_um), _) => u_um * normal(&mut random),
            (None, "arcsec") => 8.0 * normal(&mut random),
            (None, _) => 20.0 * normal(&mut random),
        })
        .collect();
    if let Some(machine) = machine {
        values[..8].copy_from_slice(machine);
    }
    let moved = plan.unknowns.iter().position(|unknown| unknown.id == "spindle_ball[A100].y");
    values[moved.unwrap()] += off_um;
    let mut rows = Vec::new();
    for run in plan.instants.chunk_by(|a, b| (a.test, a.run) == (b.test, b.run)) {
        for (instant, (noise_um, _)) in run.iter().zip(traversal(noise, run.len(), &mut random)) {
            let read_um = plan.reading_mm(instant, &values, &[]) * 1e3 + noise_um;
            rows.push(Row::taken(rows.len(), (read_um * 10.0).round() * 1e-4));
        }
    }
    rows
}

/// Writes a session with a mistake. Correct sessions draw their machines too.
pub fn write(folder: &Path, step_deg: f64, mistake: Mistake, noise: Noise, seed: u64) {
    let plan = plan(step_deg);
    let machine = (mistake != Mistake::None).then_some(&MACHINE);
    let off_um = if mistake == Mistake::SpindleBall { 30.0 } else { 0.0 };
    let mut rows = readings(&plan, machine, noise, off_um, seed);
    let others = readings(&plan, Some(&OTHER_MACHINE), noise, 0.0, seed + 1000);
    let wrong_bar_mm = 2.0 * RADIUS_MM - BARS_MM[0];
    for (row, other) in rows.iter_mut().zip(others) {
        let test = &plan.tests[plan.instants[row.instant].test];
        let bar_mm = test.stated.bar_mm;
        match mistake {
            Mistake::OtherSession if test.name == "C150" => *row = other,
            Mistake::DeviationSign => row.length_mm = 2.0 * bar_mm - row.length_mm,
            Mistake::BarSign if bar_mm == BARS_MM[0] => row.length_mm += wrong_bar_mm - bar_mm,
            _ => {}
        }
    }
    for (name, text) in session_files(&plan, &rows, DriverColumns::default(), true) {
        std::fs::write(folder.join(name), mistaken(&text, mistake, wrong_bar_mm)).unwrap();
    }
}

/// A file of the session with the mistake in it.
fn mistaken(text: &str, mistake: Mistake, wrong_bar_mm: f64) -> String {
    match mistake {
        Mistake::Reversed(axis) => {
            let Some((before, own)) = text.split_once(&format!("[axis.{axis}]\n")) else {
                return text.to_string();
            };
            let (direction, rest) = own.split_once('\n').unwrap();
            let reversed = direction.replace('1', "-1");
            format!("{before}[axis.{axis}]\n{reversed}\n{rest}")
        }
        Mistake::Exchanged => text.replace("w C A b Y X Z t", "w A C b Y X Z t"),
        Mistake::Mirrored => text.replace("[0.0, 100.0, 0.0]", "[0.0, -100.0, 0.0]"),
        Mistake::BarSign => text.replace("bar_mm = 99.9881", &format!("bar_mm = {wrong_bar_mm:.4}")),
        _ => text.to_string(),
    }
}

/// Such a session, read.
pub fn session(step_deg: f64, mistake: Mistake, noise: Noise, seed: u64) -> Session {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), step_deg, mistake, noise, seed);
    files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap()
}
