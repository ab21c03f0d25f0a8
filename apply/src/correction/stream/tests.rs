//! Files of commands: blocks and rows with a fault change nothing for other rows.

use std::path::Path;
use std::sync::Arc;

use abbe_files::commands::CommandFile;
use abbe_identify::model_file::errors::EstimatedEffect;
use abbe_identify::model_file::errors::EstimatedErrors;
use abbe_model::chain::Machine;
use abbe_model::driver::{Driver, Reference};
use abbe_model::effect::shape::{ReversalSpike, Shape};
use abbe_model::effect::{Component, Effect};
use abbe_model::instrument::Station;

use super::*;

/// A machine whose X lags behind its command by 1 ms, and whose Y has a spike of 3 µm after a reversal.
fn errors() -> EstimatedErrors {
    let machine = Arc::new(Machine::from_code("w C A b Y X Z t").unwrap());
    let effect = |id: &str, shape: Shape, coefficient: f64| EstimatedEffect {
        effect: Effect::new(Component::parse(id).unwrap(), Driver::Axis(id[2..].to_string()), shape),
        coefficients: vec![coefficient],
    };
    EstimatedErrors {
        constant: vec![0.0; machine.error_slots()],
        station: Station::between([0.0; 3], [0.0; 3], 1.0),
        reference: Reference::default(),
        effects: vec![
            effect("EXX", Shape::Lag, 1e-3),
            effect("EYY", Shape::ReversalSpike(ReversalSpike { width: 2.0 }), 3e-3),
        ],
        machine,
    }
}

/// The text that a file of commands gives.
fn text(path: &Path, output: Output) -> Result<String, Diagnostic> {
    let errors = errors();
    let machine = &errors.machine;
    let correction = Correction { machine, errors: &errors, tool_mm: [0.0; 3], aim: Aim::of(machine) };
    let start = vec![0.0; machine.axes.len()];
    let mut file = CommandFile::open(path, machine, start.clone()).unwrap();
    let mut written = Vec::new();
    run(&correction, &mut file, output, &start, &mut written)?;
    Ok(String::from_utf8(written).unwrap())
}

/// The last seven cells of each row that a file of commands gives: six errors and the state.
fn evaluated(path: &Path, commands: &str) -> Vec<Vec<String>> {
    std::fs::write(path, commands).unwrap();
    let text = text(path, Output::Error).unwrap();
    let cells = |line: &str| -> Vec<String> { line.rsplit(',').take(7).map(str::to_string).collect() };
    text.lines().skip(1).map(|line| cells(line).into_iter().rev().collect()).collect()
}

/// X moves as a sine over three blocks, which begin where it turns or accelerates.
#[test]
fn speeds_do_not_depend_on_the_blocks_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("commands.csv");
    let rows = 2 * BLOCK_ROWS + 9;
    let x_mm = |row: usize| (0.07 * row as f64).sin() * 100.0;
    let lines = (0..rows).map(|row| format!("{:.2},{:.9}\n", 0.01 * row as f64, x_mm(row)));
    let found = evaluated(&path, &format!("time_s,x_mm\n{}", lines.collect::<String>()));
    assert_eq!(found.len(), rows);
    for (row, cells) in found.iter().enumerate().skip(1).take(rows - 2) {
        let expected_um = (x_mm(row + 1) - x_mm(row - 1)) / 0.02;
        let found_um: f64 = cells[0].parse().unwrap();
        assert!((found_um.abs() - expected_um.abs()).abs() < 1e-4, "row {row}: {found_um} µm, not {expected_um}");
    }
}

/// The other rows have the errors that they have without the rows with a fault.
#[test]
fn a_row_with_a_fault_changes_no_other_row() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("commands.csv");
    let y_mm = ["none", "?", "0", "1", "2", "3", "none", "5", "6", "5", "4", "none"];
    let line = |(row, y): (usize, &&str)| format!("{:.2},{:.1},{y}\n", 0.01 * row as f64, 0.5 * row as f64);
    let lines: Vec<String> = y_mm.iter().enumerate().map(line).collect();
    let faulty: Vec<bool> = y_mm.iter().map(|y| y.parse::<f64>().is_err()).collect();
    let found = evaluated(&path, &format!("time_s,x_mm,y_mm\n{}", lines.concat()));
    let without: Vec<&str> =
        lines.iter().zip(&faulty).filter(|(_, faulty)| !**faulty).map(|(line, _)| line.as_str()).collect();
    let mut expected = evaluated(&path, &format!("time_s,x_mm,y_mm\n{}", without.concat())).into_iter();
    assert_eq!(found.len(), y_mm.len());
    for (row, (found, faulty)) in found.into_iter().zip(faulty).enumerate() {
        if faulty {
            assert_eq!(found[6], "not-a-number", "row {row}");
        } else {
            assert_eq!(Some(found), expected.next(), "row {row}");
        }
    }
}

/// A file that is corrected already would be corrected twice.
#[test]
fn a_corrected_file_is_no_file_of_commands() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("commands.csv");
    std::fs::write(&path, "time_s,x_mm\n0,1\n1,2\n").unwrap();
    let corrected = text(&path, Output::Command).unwrap();
    std::fs::write(&path, corrected).unwrap();
    let refused = text(&path, Output::Command).unwrap_err().to_string();
    assert!(refused.contains("a column `remaining_um`"), "{refused}");
}

/// Poses of a three-axis machine with an axis of little travel: rows beyond it are out of reach, rows with a fault are
/// not numbers, and both change no other row.
#[test]
fn poses_out_of_reach_and_poses_with_a_fault_are_told_apart() {
    let mut errors = errors();
    let mut machine = Machine::from_code("w b X Y Z t").unwrap();
    machine.axes[0].travel = Some([-10.0, 10.0]);
    errors.machine = Arc::new(machine);
    errors.constant = vec![0.0; errors.machine.error_slots()];
    errors.effects.clear();
    let machine = &errors.machine;
    let correction = Correction { machine, errors: &errors, tool_mm: [0.0; 3], aim: Aim::of(machine) };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.csv");
    let x_mm = ["1", "none", "-9", "4", "none", "7"];
    let rows = x_mm.iter().enumerate().map(|(row, x)| format!("{x},{row},-2\n"));
    std::fs::write(&path, format!("px_mm,py_mm,pz_mm\n{}", rows.collect::<String>())).unwrap();
    let start = vec![0.0; 3];
    let mut file = CommandFile::open(&path, machine, start.clone()).unwrap();
    let mut last = start;
    let mut block = file.next_block(machine, 100).unwrap().unwrap();
    assert_eq!(reach_poses(&correction, &mut file, &mut block, &mut last), [false; 6]);
    // A row with a fault stands where the last row of numbers stands.
    let wanted = [1.0, 1.0, -9.0, 4.0, 4.0, 7.0];
    assert_eq!(block.rows.positions[0], wanted);
    assert_eq!(block.rows.positions[1], [0.0, 0.0, 2.0, 3.0, 3.0, 5.0]);
    assert_eq!(block.rows.positions[2], [-2.0; 6]);
}
