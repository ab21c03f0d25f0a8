//! The programs of `examples/` run, and print what they were given.

use std::process::Command;

use crate::suite::workspace;

/// What an example prints. Cargo builds the examples before it runs all tests of the package, but not for one test
/// binary alone. `None` if this example was not built.
fn output(name: &str) -> Option<String> {
    let tests = std::env::current_exe().unwrap();
    let program = tests.parent().unwrap().with_file_name("examples").join(name);
    if !program.exists() {
        test_needs::skip(name, "the example is not built; run `cargo test`, or `cargo build --examples`");
        return None;
    }
    let run = Command::new(program).current_dir(workspace()).output().unwrap();
    assert!(run.status.success(), "{name}: {}", String::from_utf8_lossy(&run.stderr));
    Some(String::from_utf8(run.stdout).unwrap())
}

/// Value and standard uncertainty in the line `id = value ± u unit`.
fn value(text: &str, id: &str) -> (f64, f64) {
    let line = text.lines().find_map(|line| line.strip_prefix(&format!("{id} = "))).unwrap();
    let words: Vec<&str> = line.split_whitespace().collect();
    (words[0].parse().unwrap(), words[2].parse().unwrap())
}

#[test]
fn simulate_recovers_the_error_that_it_simulates() {
    let Some(text) = output("simulate") else { return };
    for (id, truth) in [("EX0C", 10.0), ("EY0C", 0.0)] {
        let (value, u) = value(&text, id);
        assert!((value - truth).abs() < 4.0 * u && u < 0.1, "{text}");
    }
}

#[test]
fn fit_in_memory_finds_the_offset_of_its_closed_form() {
    let Some(text) = output("fit_in_memory") else { return };
    assert!(text.starts_with("rank 2 of 2\n"), "{text}");
    assert!((value(&text, "EX0C").0 - 12.0).abs() < 0.01, "{text}");
}

#[test]
fn trace_and_continue_lowers_the_held_out_error_to_the_noise() {
    let Some(text) = output("trace_and_continue") else { return };
    assert!(text.starts_with("explained\nEZC: "), "{text}");
    let words: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [before, after] = words[words.len() - 2..] else { panic!("{text}") };
    // The readings hold 1.5 µm · cos(2 C + 60°) and noise of 0.3 µm.
    assert!(before > 0.5 && (after - 0.3).abs() < 0.01, "{text}");
}

#[test]
fn equation_prints_the_derivatives_that_are_known() {
    let Some(text) = output("equation") else { return };
    assert!(text.contains("∂L/∂e_x0c = −R·s_c/L_0"), "{text}");
}
