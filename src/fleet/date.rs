//! The date of a session, from the note `date` of `[about]`.

use abbe_model::calendar::{DAY_S, iso};

/// The first and the last time of a date, in days since 1970-01-01 UTC: those of a date without a time are the ends of
/// its day, to a second. A time without an offset counts as UTC.
///
/// Forms: those of [`iso`] that have a date, such as `2026-11-23`, `2026-11-23T08:00:00`, `2026-11-23 08:00:00+01:00`.
/// `None` for others.
///
/// ```
/// use abbe::fleet::date::interval;
///
/// assert_eq!(interval("1970-01-02T12:00:00"), Some([1.5, 1.5]));
/// assert_eq!(interval("1970-01-02"), Some([1.0, 2.0 - 1.0 / 86400.0]));
/// assert_eq!(interval("2000-03-01T06:00:00+06:00"), Some([11017.0, 11017.0]));
/// assert_eq!(interval("23.11.2026"), None);
/// ```
pub fn interval(text: &str) -> Option<[f64; 2]> {
    let stated = iso(text)?;
    let first = stated.day? as f64 + (stated.second.unwrap_or(0.0) - stated.offset_s) / DAY_S;
    Some([first, if stated.second.is_some() { first } else { first + 1.0 - 1.0 / DAY_S }])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_forms_are_no_dates() {
        for text in ["", "yesterday", "2026-13-01", "2026-02-30T00:00:00", "12:00:00", "1764000000"] {
            assert_eq!(interval(text), None, "{text}");
        }
    }
}
