//! Dates and times of day in texts, in days and seconds since 1970-01-01 UTC.

/// A date, a time of day, or both, as a text states them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Days from 1970-01-01 to the date, if one is stated.
    pub day: Option<i64>,
    /// Seconds since midnight, if a time is stated.
    pub second: Option<f64>,
    /// The offset of the zone from UTC, s; 0 if none is stated.
    pub offset_s: f64,
}

impl Moment {
    /// Seconds since 1970-01-01 UTC, or since midnight UTC without a date.
    pub fn seconds(self) -> f64 {
        self.day.unwrap_or(0) as f64 * DAY_S + self.second.unwrap_or(0.0) - self.offset_s
    }
}

/// Seconds of a day.
pub const DAY_S: f64 = 86400.0;

/// The order of the numbers of a date whose year is the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DateOrder {
    /// `31.12.2026`, `31/12/2026`.
    DayFirst,
    /// `12/31/2026`.
    MonthFirst,
}

/// Days from 1970-01-01 to a date of the proleptic Gregorian calendar; `None` for a date that does not exist.
///
/// ```
/// use abbe_model::calendar::day_number;
///
/// assert_eq!(day_number(1970, 1, 2), Some(1));
/// assert_eq!(day_number(2026, 2, 30), None);
/// ```
pub fn day_number(year: i64, month: i64, day: i64) -> Option<i64> {
    if !(-9999..=9999).contains(&year) || !(1..=12).contains(&month) || day < 1 {
        return None;
    }
    let number = civil(year, month, day);
    let (next_year, next_month) = if month == 12 { (year + 1, 1) } else { (year, month + 1) };
    (number < civil(next_year, next_month, 1)).then_some(number)
}

/// March is the first month of the counted year, so that the day of leap years is the last.
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

/// A moment in the forms of ISO 8601 with separators: `2026-11-23`, `2026-11-23T08:00:00.5+01:00`, `2026-11-23 08:00Z`,
/// `08:00:00`. `None` for others.
pub fn iso(text: &str) -> Option<Moment> {
    let (date, time) = parts(text.trim());
    let day = match date {
        Some(date) => Some(iso_date(date)?),
        None => None,
    };
    moment(day, time)
}

/// As [`iso`], and the forms of instruments: `31.12.2026 23:59:00`, `12/31/2026 11:59:00 PM`, `23:59:00,250`. A date whose
/// year is the last is read in this order; with points or hyphens the day is the first.
pub fn clock(text: &str, order: DateOrder) -> Option<Moment> {
    let (date, time) = parts(text.trim());
    let day = match date {
        Some(date) => Some(iso_date(date).or_else(|| other_date(date, order))?),
        None => None,
    };
    moment(day, time)
}

/// The date and the time of a text.
fn parts(text: &str) -> (Option<&str>, Option<&str>) {
    match text.split_once(['T', 't', ' ', ',']) {
        Some((date, time)) if !date.contains(':') => (Some(date.trim()), Some(time.trim())),
        _ if text.contains(':') => (None, Some(text)),
        _ => (Some(text), None),
    }
}

fn moment(day: Option<i64>, time: Option<&str>) -> Option<Moment> {
    let Some(time) = time else {
        return Some(Moment { day, second: None, offset_s: 0.0 });
    };
    let (time, offset_s) = zone(time)?;
    // A time without seconds may be one in minutes and seconds, unless it has a date.
    Some(Moment { day, second: Some(time_of_day(time, day.is_some())?), offset_s })
}

/// Digits only, at most as many.
fn digits(text: &str, most: usize) -> Option<i64> {
    let is_number = !text.is_empty() && text.len() <= most && text.bytes().all(|byte| byte.is_ascii_digit());
    is_number.then(|| text.parse().ok()).flatten()
}

fn iso_date(text: &str) -> Option<i64> {
    let numbers: Vec<&str> = text.split('-').collect();
    match numbers[..] {
        [year, month, day] if year.len() == 4 && month.len() == 2 && day.len() == 2 => {
            day_number(digits(year, 4)?, digits(month, 2)?, digits(day, 2)?)
        }
        _ => None,
    }
}

/// `2026/12/31`, `2026.12.31`, `31.12.2026`, `31-12-26`, and with slashes in the order.
fn other_date(text: &str, order: DateOrder) -> Option<i64> {
    let separator = ['.', '/', '-'].into_iter().find(|separator| text.contains(*separator))?;
    let numbers: Vec<&str> = text.split(separator).collect();
    let [a, b, c] = numbers[..] else { return None };
    if a.len() == 4 {
        return day_number(digits(a, 4)?, digits(b, 2)?, digits(c, 2)?);
    }
    let year = match c.len() {
        2 => 2000 + digits(c, 2)?,
        4 => digits(c, 4)?,
        _ => return None,
    };
    let (day, month) = if separator == '/' && order == DateOrder::MonthFirst { (b, a) } else { (a, b) };
    day_number(year, digits(month, 2)?, digits(day, 2)?)
}

/// A time without its zone, and the offset from UTC, s.
fn zone(text: &str) -> Option<(&str, f64)> {
    if let Some(time) = text.strip_suffix(['Z', 'z']) {
        return Some((time.trim_end(), 0.0));
    }
    let Some(place) = text.rfind(['+', '-']) else { return Some((text, 0.0)) };
    let (time, offset) = text.split_at(place);
    let sign = if offset.starts_with('-') { -1.0 } else { 1.0 };
    let plain = offset[1..].replace(':', "");
    let (hours, minutes) = match plain.len() {
        2 => (digits(&plain, 2)?, 0),
        4 => (digits(plain.get(..2)?, 2)?, digits(plain.get(2..)?, 2)?),
        _ => return None,
    };
    (hours < 24 && minutes < 60).then_some((time.trim_end(), sign * (hours * 3600 + minutes * 60) as f64))
}

/// Seconds since midnight of `HH:MM:SS`, with a fraction of the second and AM or PM if stated.
fn time_of_day(text: &str, may_lack_seconds: bool) -> Option<f64> {
    let lower = text.to_ascii_lowercase();
    let (time, half) = match (lower.strip_suffix("am"), lower.strip_suffix("pm")) {
        (Some(time), _) => (time.trim_end(), Some(0)),
        (_, Some(time)) => (time.trim_end(), Some(12)),
        _ => (lower.as_str(), None),
    };
    let parts: Vec<&str> = time.split(':').collect();
    let (hours, minutes, seconds) = match parts[..] {
        [hours, minutes, seconds] => (hours, minutes, seconds),
        [hours, minutes] if may_lack_seconds => (hours, minutes, "0"),
        _ => return None,
    };
    let hours = match (digits(hours, 2)?, half) {
        (hours @ 1..=12, Some(half)) => hours % 12 + half,
        (hours @ 0..=23, None) => hours,
        _ => return None,
    };
    let minutes = digits(minutes, 2).filter(|minutes| *minutes < 60)?;
    let (whole, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds, "0"));
    // 60 is a leap second.
    let whole = digits(whole, 2).filter(|seconds| *seconds <= 60)?;
    let is_fraction = !fraction.is_empty() && fraction.bytes().all(|byte| byte.is_ascii_digit());
    let fraction: f64 = is_fraction.then(|| format!("0.{fraction}").parse().ok()).flatten()?;
    Some((hours * 3600 + minutes * 60 + whole) as f64 + fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_agree_with_the_calendar() {
        // Counted by GNU date: `date -ud 2026-11-23 +%s` over 86400.
        for (text, count) in [("1970-01-01", 0), ("2024-02-29", 19782), ("2026-11-23", 20780), ("1969-12-31", -1)] {
            assert_eq!(iso(text).and_then(|moment| moment.day), Some(count), "{text}");
            assert_eq!(date(count as f64), text);
        }
        for count in (-700_000..700_000).step_by(97) {
            assert_eq!(iso(&date(count as f64)).and_then(|moment| moment.day), Some(count));
        }
    }

    #[test]
    fn moments_of_files_are_read_as_gnu_date_reads_them() {
        // `date -ud TEXT +%s.%N`.
        for (text, seconds) in [
            ("2024-02-29T23:59:59Z", 1_709_251_199.0),
            ("2024-03-01T00:59:59.250+01:00", 1_709_251_199.25),
            ("2024-02-29 18:59:59-0500", 1_709_251_199.0),
            ("2024-02-29T23:59:59+02", 1_709_243_999.0),
            ("2024-02-29T23:59", 1_709_251_140.0),
            ("29.02.2024 23:59:59", 1_709_251_199.0),
            ("29/02/24 23:59:59", 1_709_251_199.0),
            ("2024/02/29, 11:59:59 PM", 1_709_251_199.0),
            ("12:03:04,5", 43384.5),
            ("12:00:01 am", 1.0),
        ] {
            assert_eq!(clock(text, DateOrder::DayFirst).map(Moment::seconds), Some(seconds), "{text}");
        }
        let of = |order| clock("01/02/2024 00:00:00", order).and_then(|moment| moment.day);
        assert_eq!(of(DateOrder::DayFirst), day_number(2024, 2, 1));
        assert_eq!(of(DateOrder::MonthFirst), day_number(2024, 1, 2));
    }

    #[test]
    fn other_texts_are_no_moments() {
        for text in
            ["", "yesterday", "12.5", "12:03", "24:00:00", "12:60:00", "1:2:3:4", "31.02.2024 12:00:00", "13:00:00 PM"]
        {
            assert_eq!(clock(text, DateOrder::DayFirst), None, "{text}");
        }
        for text in [
            "2026-11-23T08:00:00+1é5",
            "08:00:00+1é5",
            "23.11.2026",
            "2026-13-01",
            "2026-02-30T00:00:00",
            "2026-11-23T",
            "1764000000",
            "2026-11-23T08",
        ] {
            assert_eq!(iso(text), None, "{text}");
        }
    }
}
