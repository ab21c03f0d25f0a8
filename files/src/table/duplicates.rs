//! Duplicate rows of a file: copies by a mistake of export or editing, not repeated measurements.
//!
//! A row is a copy if every cell equals that of an earlier row, including the time if the file has one. Without a time
//! column the run number decides. If a state recurs within a run and every reading of it is equal to the last digit,
//! whole rows were copied. If some of them differ, they are repeats, and equal ones are due to the resolution. A file
//! with neither column is taken as it is.

use std::collections::HashMap;
use std::hash::Hasher;
use std::ops::Range;
use std::path::Path;

use abbe_model::session::readings::Readings;

/// Largest number of lines listed in a message.
const MAX_LISTED: usize = 8;

/// Hashes the cells of a row by folded products of 64 bits. A row has few short cells, for each of which the general hasher
/// takes ten times as long.
#[derive(Default)]
pub(super) struct CellHasher(u64);

impl CellHasher {
    /// Digits of π and of the golden ratio.
    const START: u64 = 0x2438_6a88_85a3_08d3;
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;

    fn mix(&mut self, word: u64) {
        let product = u128::from(self.0 ^ word ^ CellHasher::START) * u128::from(CellHasher::FACTOR);
        self.0 = (product as u64) ^ ((product >> 64) as u64);
    }
}

impl Hasher for CellHasher {
    fn write(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks::<8>();
        words.iter().for_each(|word| self.mix(u64::from_le_bytes(*word)));
        // The length separates a cell from the next one.
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        last[7] = rest.len() as u8 + 1;
        self.mix(u64::from_le_bytes(last));
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// A hash of all cells of a row, which `add` adds.
pub(super) fn hash_of(add: impl FnOnce(&mut CellHasher)) -> u64 {
    let mut hasher = CellHasher::default();
    add(&mut hasher);
    hasher.finish()
}

/// Whether every reading has a time of its own: no row is a copy of another.
pub(super) fn cannot_occur(readings: &Readings) -> bool {
    !readings.time_s.is_empty() && readings.time_s.windows(2).all(|pair| pair[0] < pair[1])
}

/// The rows without copies; `None` if there are no copies. `cells` has the hash of the cells of each row.
pub(super) fn kept(readings: &Readings, cells: &[u64]) -> Option<Vec<usize>> {
    if cannot_occur(readings) {
        return None;
    }
    let closed_runs = closed_runs(readings);
    if readings.time_s.is_empty() && (readings.run.is_empty() || has_repeats(readings, cells, &closed_runs)) {
        return None;
    }
    let mut first: HashMap<u64, usize> = HashMap::with_capacity(cells.len());
    let original: Vec<usize> = (0..cells.len()).map(|row| *first.entry(cells[row]).or_insert(row)).collect();
    // Rows repeated in the opposite order are a return traversal with equal readings.
    let backward = |row: usize| original[row - 1] < row - 1 && original[row] < original[row - 1];
    if readings.time_s.is_empty() && (1..cells.len()).any(backward) {
        return None;
    }
    let kept: Vec<usize> = (0..cells.len())
        .filter(|row| original[*row] == *row || closed_runs.get(row) == Some(&original[*row]))
        .collect();
    (kept.len() < cells.len()).then_some(kept)
}

/// The message; `line` has the line of each row.
pub(super) fn message(file: &Path, line: &[usize], kept: &[usize]) -> String {
    let mut kept = kept.iter().peekable();
    let copies: Vec<usize> =
        (0..line.len()).filter(|row| kept.next_if_eq(&row).is_none()).map(|row| line[row]).collect();
    let mut lines: Vec<String> = copies.iter().take(MAX_LISTED).map(usize::to_string).collect();
    if copies.len() > MAX_LISTED {
        lines.push("…".into());
    }
    let (count, are, copies_of, they) = match copies.len() {
        1 => ("1 row".to_string(), "is", "a copy of an earlier row", "it is"),
        many => (format!("{many} rows"), "are", "copies of earlier rows", "they are"),
    };
    format!(
        "{}: {count} {are} {copies_of} in every column (line {}); {they} removed, not treated as repeats",
        file.display(),
        lines.join(", ")
    )
}

/// Whether a state recurs within a run with a different reading.
fn has_repeats(readings: &Readings, cells: &[u64], closed_runs: &HashMap<usize, usize>) -> bool {
    let mut seen: HashMap<u64, u64> = HashMap::with_capacity(cells.len());
    (0..cells.len()).filter(|row| !closed_runs.contains_key(row)).any(|row| {
        // A hash, as that of the cells: a vector for each of millions of rows costs more than all the rest.
        let state = hash_of(|hasher| {
            hasher.write_i64(readings.run[row]);
            readings.positions.iter().for_each(|axis| hasher.write_u64(axis[row].to_bits()));
        });
        let before = seen.entry(state).or_insert(cells[row]);
        *before != cells[row]
    })
}

/// The last row of each run that ends at its start, with its first row: both may have the same reading. A time column
/// distinguishes them.
fn closed_runs(readings: &Readings) -> HashMap<usize, usize> {
    if !readings.time_s.is_empty() {
        return HashMap::new();
    }
    let closes = |run: &Range<usize>| {
        let mut axes = readings.positions.iter();
        axes.all(|axis| axis[run.start] == axis[run.end - 1])
    };
    let runs = readings.runs().into_iter();
    runs.filter(closes).map(|run| (run.end - 1, run.start)).collect()
}
