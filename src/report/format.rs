//! Text of values, units and noise in reports.

/// A residual or noise figure with its unit.
pub fn um(value: f64) -> String {
    crate::cli::table::micrometres(value)
}

/// A unit, or a text with units, with its symbols: `um` becomes µm, `arcsec` becomes ″, `deg` becomes °.
pub fn unit(text: &str) -> String {
    let symbol = |word: &str| match word {
        "um" => "µm".to_string(),
        "arcsec" => "″".to_string(),
        "deg" => "°".to_string(),
        other => other.to_string(),
    };
    text.split_inclusive(|c: char| !c.is_alphanumeric())
        .map(|part| match part.char_indices().last() {
            Some((end, last)) if !last.is_alphanumeric() => symbol(&part[..end]) + &part[end..],
            _ => symbol(part),
        })
        .collect::<String>()
        .replace("^2", "²")
        .replace("^3", "³")
}

/// Distinct units in the order of their first appearance.
pub fn units<'n>(names: impl Iterator<Item = &'n str>) -> Vec<&'n str> {
    let mut distinct: Vec<&str> = Vec::new();
    for name in names {
        if !distinct.contains(&name) {
            distinct.push(name);
        }
    }
    distinct
}

/// Text with a minus sign in place of a hyphen before numbers.
pub fn with_minus_signs(text: &str) -> String {
    let word = |word: &str| match word.strip_prefix('-') {
        Some(number) if number.starts_with(|c: char| c.is_ascii_digit()) => format!("\u{2212}{number}"),
        _ => word.to_string(),
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Table cells with a minus sign in place of a hyphen before numbers.
pub fn typeset(rows: Vec<Vec<String>>) -> Vec<Vec<String>> {
    let row = |row: Vec<String>| row.iter().map(|cell| with_minus_signs(cell)).collect();
    rows.into_iter().map(row).collect()
}

/// A value and its standard uncertainty, rounded to the same decimal place.
pub fn value_and_u(value: f64, u: f64) -> (String, String) {
    let (value, u) = crate::cli::table::value_and_u(value, u);
    (value.replace('-', "\u{2212}"), u)
}

/// An integer with a thin space between thousands.
pub fn integer(value: usize) -> String {
    let digits = value.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    if digits.len() < 5 { digits } else { groups.join("\u{202f}") }
}

/// The noise of a result and its source. The residual of a model is not called noise.
pub fn noise_sentence(noise_um: f64, source: &str) -> String {
    match source {
        "residual" => format!(
            "No noise is stated and there are no repeated readings. The uncertainties follow from the residual of the model, {}",
            um(noise_um)
        ),
        other => format!("Noise standard deviation {} ({other})", um(noise_um)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_have_groups_of_three_digits_from_10_000_on() {
        assert_eq!(integer(9_876), "9876");
        assert_eq!(integer(12_345), "12\u{202f}345");
        assert_eq!(integer(1_234_567), "1\u{202f}234\u{202f}567");
    }

    #[test]
    fn units_have_their_symbols() {
        assert_eq!(unit("um"), "µm");
        assert_eq!(unit("arcsec/um"), "″/µm");
        assert_eq!(unit("deg/mm^2"), "°/mm²");
        assert_eq!(unit("minimum, um or arcsec"), "minimum, µm or ″");
    }
}
