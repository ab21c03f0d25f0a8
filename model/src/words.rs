//! Counts with correct number agreement, for messages.

/// A count with its noun, singular or plural.
///
/// ```
/// use abbe_model::words::counted;
///
/// assert_eq!(counted(1, "effect"), "1 effect");
/// assert_eq!(counted(0, "effect"), "0 effects");
/// assert_eq!(counted(2, "boundary"), "2 boundaries");
/// assert_eq!(counted(3, "set-up"), "3 set-ups");
/// assert_eq!(counted(1, "degree of freedom"), "1 degree of freedom");
/// assert_eq!(counted(7, "degree of freedom"), "7 degrees of freedom");
/// ```
#[must_use]
pub fn counted(count: impl TryInto<u64> + std::fmt::Display + Copy, thing: &str) -> String {
    if matches!(count.try_into(), Ok(1)) {
        return format!("{count} {thing}");
    }
    let (noun, rest) = match thing.find(" of ") {
        Some(place) => thing.split_at(place),
        None => (thing, ""),
    };
    let plural = match noun.strip_suffix('y') {
        Some(stem) if !stem.ends_with(['a', 'e', 'o']) => format!("{stem}ies"),
        _ => format!("{noun}s"),
    };
    format!("{count} {plural}{rest}")
}
