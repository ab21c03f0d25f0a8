//! Missing readings of columns in memory: what their owner marks as missing, such as the mask of an array of NumPy.

use abbe_model::instrument::Fault;

use super::memory::MemoryColumn;

/// Largest number of intervals of items that a message lists for a column.
const MAX_LISTED: usize = 8;

/// The rows of which no value is missing; `None` if no value is missing at all.
pub(super) fn present(given: &[MemoryColumn<'_>], rows: usize) -> Result<Option<Vec<usize>>, Fault> {
    for column in given.iter().filter(|column| !column.missing.is_empty()) {
        let marks = column.missing.len();
        if marks != rows {
            let message = format!("`{}` has {rows} values, and marks {marks} of them as missing or not", column.name);
            return Err((message, "one mark for each value".into()));
        }
    }
    let is_missing = |row: usize| given.iter().any(|column| column.missing.get(row) == Some(&true));
    let present: Vec<usize> = (0..rows).filter(|row| !is_missing(*row)).collect();
    Ok((present.len() < rows).then_some(present))
}

/// How many readings are missing, and where.
pub(super) fn warning(given: &[MemoryColumn<'_>], rows: usize, present: usize) -> String {
    let named = given.iter().filter(|column| column.missing.contains(&true));
    let places: Vec<String> = named.map(|column| format!("`{}` {}", column.name, items(column.missing))).collect();
    let missing = rows - present;
    let are = if missing == 1 { "is" } else { "are" };
    format!("{missing} of {rows} readings {are} missing: {}", places.join("; "))
}

/// The marked items, counted from 0: `item 3`, `items 7 to 9, 20`.
fn items(missing: &[bool]) -> String {
    let marked: Vec<usize> = (0..missing.len()).filter(|item| missing[*item]).collect();
    let intervals: Vec<String> = marked
        .chunk_by(|a, b| a + 1 == *b)
        .map(|run| match run {
            [one] => one.to_string(),
            [one, two] => format!("{one}, {two}"),
            [first, .., last] => format!("{first} to {last}"),
            [] => String::new(),
        })
        .collect();
    let more = if intervals.len() > MAX_LISTED { ", …" } else { "" };
    let listed = intervals[..intervals.len().min(MAX_LISTED)].join(", ");
    format!("item{} {listed}{more}", if marked.len() == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::items;

    #[test]
    fn items_are_listed_as_intervals() {
        let of = |marked: &[usize]| items(&(0..100).map(|item| marked.contains(&item)).collect::<Vec<_>>());
        assert_eq!(of(&[3]), "item 3");
        assert_eq!(of(&[0, 1, 99]), "items 0, 1, 99");
        assert_eq!(of(&[7, 8, 9, 20]), "items 7 to 9, 20");
        assert_eq!(of(&[1, 3, 5, 7, 9, 11, 13, 15]), "items 1, 3, 5, 7, 9, 11, 13, 15");
        assert_eq!(of(&[1, 3, 5, 7, 9, 11, 13, 15, 17]), "items 1, 3, 5, 7, 9, 11, 13, 15, …");
    }
}
