//! One measurement that is written in other ways has one result, for every kind of instrument. `metamorphic.py` simulates
//! sessions on machines that it draws, changes their files, and knows without a fit what becomes of the estimates.
//!
//! `ABBE_STUDY` is the number of machines of each kind (1 by default; the record is that of 40).

use std::process::Command;

use crate::suite::{ready, workspace};

#[test]
fn a_measurement_that_is_written_in_other_ways_has_one_result() {
    let test = "a_measurement_that_is_written_in_other_ways_has_one_result";
    let Some(python) = test_needs::python(test, "tomllib") else { return };
    let count = std::env::var("ABBE_STUDY").unwrap_or_else(|_| "1".into());
    let script = workspace().join("tests/suite/identify/metamorphic.py");
    let run = Command::new(python)
        .args([script.as_path(), env!("CARGO_BIN_EXE_abbe").as_ref(), &ready(""), count.as_ref()])
        .output()
        .unwrap();
    let found = String::from_utf8_lossy(&run.stdout);
    println!("{found}");
    assert!(run.status.success(), "{found}{}", String::from_utf8_lossy(&run.stderr));
}
