//! Fuzz functions for the readers of `abbe-identify` and `abbe-apply`: files of error functions and of error values, read as the command
//! reads them.
//!
//! `apply/tests/corpus.rs` replays the corpus with these functions on every test run.

use std::fs;
use std::path::PathBuf;

use abbe_apply::volumetric::{self, MachineWithErrors, functions};
use abbe_identify::quantity::{self, Given};
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::session::limits::LARGEST;

const MACHINE: &str = "chain = \"w C A b Y X Z t\"\n[axis.C]\n[axis.A]\n[axis.X]\n[axis.Y]\n[axis.Z]\n";

/// Writes the input to a file of this thread, in memory if the system has `/dev/shm`.
fn as_file<T>(input: &[u8], work: impl FnOnce(&PathBuf, &Machine) -> T) -> T {
    thread_local! {
        static FOLDER_AND_MACHINE: (tempfile::TempDir, Machine) = {
            let memory = std::path::Path::new("/dev/shm");
            let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
            let made = made.expect("a temporary folder");
            let file = made.path().join("machine.toml");
            fs::write(&file, MACHINE).expect("a file in a temporary folder");
            let machine = abbe_files::machine(&file).expect("a machine");
            (made, machine)
        };
    }
    FOLDER_AND_MACHINE.with(|(folder, machine)| {
        let file = folder.path().join("errors.toml");
        fs::write(&file, input).expect("a file in a temporary folder");
        work(&file, machine)
    })
}

/// The file of `volumetric --functions`: accepted functions give a finite volumetric error everywhere, or the map
/// returns an error.
pub fn functions(input: &[u8]) {
    as_file(input, |file, machine| match functions::read(file, machine) {
        Ok(functions) => {
            let machine_with_errors = MachineWithErrors { machine, functions: &functions, tool_mm: [0.0, 0.0, -120.0] };
            let along = |kind| match kind {
                AxisKind::Linear => vec![-250.0, 0.0, 300.0],
                AxisKind::Rotary => vec![-1.5, 0.0, 3.0],
            };
            let grid: Vec<Vec<f64>> = machine.axes.iter().map(|axis| along(axis.kind)).collect();
            match volumetric::map(&machine_with_errors, &grid, false) {
                Ok((places, summary)) => {
                    assert!(summary.error.rms_um <= summary.error.largest_um * (1.0 + 1e-12));
                    assert!(places.iter().flat_map(|place| place.error_mm).all(f64::is_finite));
                }
                Err(fault) => assert!(!fault.to_string().is_empty()),
            }
        }
        Err(fault) => assert!(!fault.to_string().is_empty()),
    });
}

/// The file of `simulate --values`, and each of its lines as an argument of `--error`.
pub fn values(input: &[u8]) {
    fn check_value(given: &Given) {
        assert!(given.value.abs() <= LARGEST);
        for unit in ["um", "arcsec", "ms", "um/h", "um/m", "arcsec/K"] {
            if let Ok(value) = given.in_unit(unit) {
                assert!(value.is_finite(), "{given:?} in {unit}");
            }
        }
    }
    as_file(input, |file, _| match quantity::read(file) {
        Ok(values) => values.iter().for_each(check_value),
        Err(fault) => assert!(!fault.to_string().is_empty()),
    });
    let Ok(text) = std::str::from_utf8(input) else {
        return;
    };
    for line in text.lines() {
        match Given::parse(line) {
            Ok(given) => check_value(&given),
            Err(fault) => assert!(!fault.to_string().is_empty()),
        }
    }
}
