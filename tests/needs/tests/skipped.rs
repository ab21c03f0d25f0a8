//! Prints which tests of this run of `cargo test` were skipped, and why. Not a test of the standard harness, which hides
//! what a test prints if it passes.

fn main() {
    // `cargo test -- --list` asks for names.
    if !std::env::args().any(|argument| argument == "--list") {
        print!("{}", test_needs::summary(&test_needs::taken(&test_needs::here())));
    }
}
