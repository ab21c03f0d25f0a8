//! Numbers and units as people read them: digits by the uncertainty, symbols of units.

use abbe::model::unit::Unit;
use abbe::trace::result::ShapeParameter;

/// A number with decimal places. A number that rounds to zero has no sign.
pub fn fixed(value: f64, places: usize) -> String {
    let rounded = format!("{value:.places$}");
    let unsigned = rounded.strip_prefix('-').filter(|digits| digits.bytes().all(|digit| matches!(digit, b'0' | b'.')));
    unsigned.map_or_else(|| rounded.clone(), str::to_string)
}

/// Decimal places of a value with this standard uncertainty: two digits of the uncertainty (JCGM 100, 7.2.6).
pub fn places(u: f64) -> usize {
    if !u.is_finite() || u <= 0.0 {
        return 4;
    }
    (1.0 - u.log10().floor()).clamp(0.0, 12.0) as usize
}

/// A value and its uncertainty, rounded to the same place.
pub fn value_and_u(value: f64, u: f64) -> (String, String) {
    let places = places(u);
    (fixed(value, places), format!("{u:.places$}"))
}

/// A number with three digits; `∞` for what is not finite.
pub fn three_digits(value: f64) -> String {
    if !value.is_finite() {
        return "∞".to_string();
    }
    if value == 0.0 {
        return "0".to_string();
    }
    // The digits of the rounded number: 0.9999 and 1.0001 are both 1.00.
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    let places = (2.0 - rounded.abs().max(1e-9).log10().floor()).clamp(0.0, 5.0) as usize;
    format!("{value:.places$}")
}

/// A p-value as a statement: `p ≤ 0.005`, `p < 0.001`.
pub fn p_value(p: f64) -> String {
    if p < 5e-4 { "p < 0.001".to_string() } else { format!("p ≤ {p:.3}") }
}

/// A probability: `0.012`, `3e-7`, and `< 1e-16` where the tail is smaller than the rounding of its computation.
pub fn probability(p: f64) -> String {
    match p {
        p if p < 1e-16 => "< 1e-16".to_string(),
        p if p < 1e-3 => format!("{p:.0e}"),
        p => format!("{p:.3}"),
    }
}

/// A p-value as an equation: `p = 0.012`, `p < 1e-16`.
pub fn p_equals(p: f64) -> String {
    let shown = probability(p);
    if shown.starts_with('<') { format!("p {shown}") } else { format!("p = {shown}") }
}

/// A residual or a noise figure in µm.
pub fn micrometres(value_um: f64) -> String {
    of_readings(value_um, Unit::Micrometre)
}

/// A residual or a noise figure in the unit of the readings.
pub fn of_readings(value: f64, of: Unit) -> String {
    let places = if value >= 100.0 { 1 } else { 3 };
    of.text(value, places)
}

/// A unit, or a text with units, with its symbols: `um` becomes µm, `arcsec` becomes ″, `deg` becomes °.
pub fn unit(text: &str) -> String {
    let symbol = |word: &str| Unit::parse(word).map_or_else(|| word.to_string(), |unit| unit.symbol().to_string());
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

/// A number with the symbol of its unit: `1.2 µm`, `3.4″`.
pub fn quantity(number: &str, unit_name: &str) -> String {
    let unit = unit(unit_name);
    let space = if matches!(unit.as_str(), "″" | "°" | "") { "" } else { " " };
    format!("{number}{space}{unit}")
}

/// A sentence of a result with the symbols of its units.
pub fn with_symbols(sentence: &str) -> String {
    sentence.replace(" arcsec", "″").replace(" um", " µm")
}

/// A number or the positions of an effect's shape, to four digits: `period 13.78 mm`, `at -84.72, -40.72 mm`.
pub fn shape_number(number: &ShapeParameter) -> String {
    let to_four_digits = |value: &f64| {
        let magnitude = value.abs().max(1e-3).log10().floor() as i32;
        format!("{value:.*}", (3 - magnitude).clamp(0, 4) as usize)
    };
    let values: Vec<String> = number.values.iter().map(to_four_digits).collect();
    format!("{} {}", number.name, quantity(&values.join(", "), &number.unit))
}

/// Text with a minus sign in place of a hyphen before numbers.
pub fn with_minus_signs(text: &str) -> String {
    let word = |word: &str| match word.strip_prefix('-') {
        Some(number) if number.starts_with(|c: char| c.is_ascii_digit()) => format!("\u{2212}{number}"),
        _ => word.to_string(),
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Text with a capital first letter.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// An integer with a thin space between thousands.
pub fn integer(value: usize) -> String {
    let digits = value.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    if digits.len() < 5 { digits } else { groups.join("\u{202f}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_places_of_their_uncertainty() {
        for (value, u, shown) in [
            (35.312, 0.0213, ("35.312", "0.021")),
            (-35.38, 2.04, ("-35.4", "2.0")),
            (-0.04, 1.0, ("0.0", "1.0")),
            (-0.06, 1.0, ("-0.1", "1.0")),
            (-0.4, 20.0, ("0", "20")),
            (-1e-9, 0.0, ("0.0000", "0.0000")),
        ] {
            let (value, u) = value_and_u(value, u);
            assert_eq!((value.as_str(), u.as_str()), shown);
        }
    }

    #[test]
    fn numbers_that_rounding_parts_are_printed_alike() {
        for (value, printed) in [
            (1.0 - 1e-12, "1.00"),
            (1.0 + 1e-12, "1.00"),
            (-9.996, "-10.0"),
            (0.099_96, "0.100"),
            (0.0994, "0.0994"),
            (1234.0, "1234"),
            (1e-12, "0.00000"),
        ] {
            assert_eq!(three_digits(value), printed, "{value}");
        }
    }

    #[test]
    fn no_probability_is_zero() {
        for (p, shown) in [
            (0.0, "< 1e-16"),
            (1e-300, "< 1e-16"),
            (2e-16, "2e-16"),
            (3.2e-5, "3e-5"),
            (0.0123, "0.012"),
            (1.0, "1.000"),
        ] {
            assert_eq!(probability(p), shown);
        }
        assert_eq!((p_equals(0.0).as_str(), p_equals(0.5).as_str()), ("p < 1e-16", "p = 0.500"));
    }

    #[test]
    fn units_have_their_symbols() {
        assert_eq!(unit("um"), "µm");
        assert_eq!(unit("arcsec/um"), "″/µm");
        assert_eq!(unit("deg/mm^2"), "°/mm²");
        assert_eq!(unit("minimum, um or arcsec"), "minimum, µm or ″");
    }

    #[test]
    fn integers_have_groups_of_three_digits_from_10_000_on() {
        assert_eq!(integer(9_876), "9876");
        assert_eq!(integer(12_345), "12\u{202f}345");
        assert_eq!(integer(1_234_567), "1\u{202f}234\u{202f}567");
    }
}
