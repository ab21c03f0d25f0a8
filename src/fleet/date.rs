//! The date of a session, from the note `date` of `[about]`.

use toml::value::{Datetime, Offset};

/// A date with its time, in days since 1970-01-01 UTC. A time without an offset counts as UTC.
///
/// Forms: those of TOML (RFC 3339): `2026-11-23`, `2026-11-23T08:00:00`, `2026-11-23 08:00:00+01:00`. `None` for
/// others.
///
/// ```
/// use abbe::fleet::date::days;
///
/// assert_eq!(days("1970-01-02"), Some(1.0));
/// assert_eq!(days("2000-03-01T06:00:00+06:00"), Some(11017.0));
/// assert_eq!(days("23.11.2026"), None);
/// ```
pub fn days(text: &str) -> Option<f64> {
    let stated: Datetime = text.trim().parse().ok()?;
    let date = stated.date?;
    let (year, month, day) = (i64::from(date.year), i64::from(date.month), i64::from(date.day));
    let seconds = stated.time.map_or(0.0, |time| {
        let whole = i64::from(time.hour) * 3600 + i64::from(time.minute) * 60 + i64::from(time.second.unwrap_or(0));
        whole as f64 + f64::from(time.nanosecond.unwrap_or(0)) * 1e-9
    });
    let offset_min = match stated.offset {
        Some(Offset::Custom { minutes }) => f64::from(minutes),
        Some(Offset::Z) | None => 0.0,
    };
    Some(civil(year, month, day) as f64 + seconds / 86400.0 - offset_min / 1440.0)
}

/// The first and the last time of a date, in days since 1970-01-01 UTC: those of a date without a time are the ends of
/// its day, to a second.
///
/// ```
/// use abbe::fleet::date::interval;
///
/// assert_eq!(interval("1970-01-02T12:00:00"), Some([1.5, 1.5]));
/// assert_eq!(interval("1970-01-02"), Some([1.0, 2.0 - 1.0 / 86400.0]));
/// ```
pub fn interval(text: &str) -> Option<[f64; 2]> {
    let first = days(text)?;
    let has_time = text.trim().parse::<Datetime>().ok()?.time.is_some();
    Some([first, if has_time { first } else { first + 1.0 - 1.0 / 86400.0 }])
}

/// Days from 1970-01-01 to a date of the Gregorian calendar. March is the first month of the counted year, so that the
/// day of leap years is the last.
fn civil(year: i64, month: i64, day: i64) -> i64 {
    let counted = if month <= 2 { year - 1 } else { year };
    let days_before_month = (153 * ((month + 9) % 12) + 2) / 5;
    counted * 365 + counted.div_euclid(4) - counted.div_euclid(100) + counted.div_euclid(400) + days_before_month + day
        - 719_469
}

/// The date of a day since 1970-01-01: `2026-11-23`.
pub fn date(days: f64) -> String {
    let day = days.floor() as i64;
    // The year is found from the mean length of a year, and corrected by one.
    let mut year = 1970 + (day as f64 / 365.2425).floor() as i64;
    while civil(year + 1, 1, 1) <= day {
        year += 1;
    }
    while civil(year, 1, 1) > day {
        year -= 1;
    }
    let month = (1..=12).rev().find(|month| civil(year, *month, 1) <= day).unwrap_or(1);
    format!("{year:04}-{month:02}-{:02}", day - civil(year, month, 1) + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_agree_with_the_calendar() {
        // Counted by GNU date: `date -ud 2026-11-23 +%s` over 86400.
        for (text, count) in
            [("1970-01-01", 0.0), ("2024-02-29", 19782.0), ("2026-11-23", 20780.0), ("1969-12-31", -1.0)]
        {
            assert_eq!(days(text), Some(count), "{text}");
            assert_eq!(date(count), text);
        }
        for count in (-700_000..700_000).step_by(97).map(f64::from) {
            assert_eq!(days(&date(count)), Some(count));
        }
    }

    #[test]
    fn other_forms_are_no_dates() {
        for text in ["", "yesterday", "2026-13-01", "2026-02-30T00:00:00", "12:00:00", "1764000000"] {
            assert_eq!(days(text), None, "{text}");
        }
    }
}
