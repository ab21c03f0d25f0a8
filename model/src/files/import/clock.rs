//! Times of day in cells.

/// Seconds of a time of day, with or without a date: `12:03:04.5`, `2024-05-01T12:03:04`.
pub(super) fn clock_s(cell: &str) -> Option<f64> {
    let (date, time) = match cell.trim().trim_end_matches('Z').split_once(['T', ' ']) {
        Some((date, time)) => (Some(date), time),
        None => (None, cell.trim()),
    };
    let parts: Vec<&str> = time.split(':').collect();
    let [hours, minutes, seconds] = parts[..] else { return None };
    let seconds: f64 = seconds.replace(',', ".").parse().ok()?;
    let of_day = hours.parse::<u32>().ok()? * 3600 + minutes.parse::<u32>().ok()? * 60;
    let days = match date.map(|date| date.split(['-', '.', '/']).collect::<Vec<_>>()) {
        None => 0,
        Some(parts) => {
            let numbers: Vec<i64> = parts.iter().filter_map(|part| part.parse().ok()).collect();
            let [a, month, b] = numbers[..] else { return None };
            let (year, day) = if a > 31 { (a, b) } else { (b, a) };
            // Days of the proleptic Gregorian calendar (Fliegel and Van Flandern, CACM 11 (1968) 657).
            let shift = (month - 14) / 12;
            1461 * (year + 4800 + shift) / 4 + 367 * (month - 2 - 12 * shift) / 12
                - 3 * ((year + 4900 + shift) / 100) / 4
                + day
        }
    };
    Some(days as f64 * 86400.0 + f64::from(of_day) + seconds)
}

#[cfg(test)]
mod tests {
    use super::clock_s;

    #[test]
    fn seconds_go_on_over_midnight_and_over_the_end_of_a_month() {
        assert_eq!(clock_s("12:03:04.5"), Some(43384.5));
        let apart = |a: &str, b: &str| clock_s(b).unwrap() - clock_s(a).unwrap();
        assert_eq!(apart("2024-02-29T23:59:59", "2024-03-01T00:00:01"), 2.0);
        assert_eq!(apart("31.12.2023 23:59:00", "01.01.2024 00:00:00"), 60.0);
        assert_eq!(clock_s("12.5"), None);
    }
}
