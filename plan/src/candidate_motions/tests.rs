use std::path::Path;

use abbe_files::ReadOptions;
use abbe_model::instrument::InstrumentKind;

use super::*;
use crate::error::TOO_MANY;

/// Candidates are counted before their places are: 10¹⁰ of these would fill the memory.
#[test]
fn more_candidates_than_the_limit_are_refused_at_once() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/r-test/plan.toml");
    let session = abbe_files::session(&file, &ReadOptions { read_data: false, ..ReadOptions::default() }).unwrap();
    let many: Vec<f64> = (1..=100_000).map(f64::from).collect();
    let variations = TestVariations { radii_mm: many.clone(), heights_mm: many, ..TestVariations::default() };
    let found = drafts(&session, &variations, InstrumentKind::RTest);
    assert!(
        matches!(&found, Err(error) if error.code == TOO_MANY && error.message.contains(&MAX_DRAFTS.to_string())),
        "{:?}",
        found.map(|drafts| drafts.len())
    );
}

/// No draft is left out of the count.
#[test]
fn the_count_is_no_less_than_the_candidates() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/r-test/plan.toml");
    let session = abbe_files::session(&file, &ReadOptions { read_data: false, ..ReadOptions::default() }).unwrap();
    let variations = TestVariations { feeds: vec![1.0, 0.5], ranges: vec![1.0, 0.5], ..TestVariations::default() };
    let station = start::stations(&session, &session.tests).pop().unwrap();
    let test = session.tests.last().unwrap();
    let template = Template { session: &session, variations: &variations, test, station: &station };
    let made = template.contacts().unwrap().drafts().len() as f64;
    let count = template.count_in_contact();
    println!("{made} of {count}");
    assert!(made <= count && count < 3.0 * made, "{made} of {count}");
}

#[test]
fn steps_are_round() {
    for (step, wanted) in [(20.0, 20.0), (19.9, 10.0), (6.7, 5.0), (12.0, 10.0), (0.3, 0.2), (100.0, 100.0)] {
        assert!((nice(step) / wanted - 1.0).abs() < 1e-12, "{step}: {}", nice(step));
    }
}
