//! The cells of a table of Denavit–Hartenberg parameters.

use std::f64::consts::PI;

/// A cell: a number in the unit of its column, a multiple of π or a number of degrees in rad, and whether the joint moves it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Value {
    pub plain: f64,
    pub of_pi: f64,
    pub moves: bool,
}

impl Value {
    /// `1.5`, `-pi/2`, `q2`, `θ2 - 90`, `d3 + 0.1`; an empty cell is 0.
    pub fn parse(text: &str) -> Option<Value> {
        let plain: String =
            text.to_lowercase().replace('π', "pi").replace(['−', '–'], "-").split_whitespace().collect();
        let is_degree = plain.contains('°');
        let plain = plain.trim_end_matches(['°', '*']);
        let mut value = Value::default();
        let mut rest = plain.trim_start_matches('+');
        for variable in ["theta", "θ", "q", "d", "var"] {
            if let Some(after) = rest.strip_prefix(variable) {
                rest = after
                    .trim_start_matches(['_', '{', '}'])
                    .trim_start_matches(|c: char| c.is_ascii_digit() || c == '}');
                value.moves = true;
                break;
            }
        }
        while !rest.is_empty() {
            let sign = if rest.starts_with('-') { -1.0 } else { 1.0 };
            let term = rest.trim_start_matches(['+', '-']);
            if rest.len() - term.len() > 1 || term.is_empty() {
                return None;
            }
            // An exponent has a sign of its own.
            let is_end = |(k, c): &(usize, char)| *k > 0 && "+-".contains(*c) && !term[..*k].ends_with('e');
            let end = term.char_indices().find(is_end).map_or(term.len(), |(k, _)| k);
            let (number, is_of_pi) = term_of(&term[..end])?;
            *(if is_of_pi { &mut value.of_pi } else { &mut value.plain }) += sign * number;
            rest = &term[end..];
        }
        if is_degree {
            (value.plain, value.of_pi) = (0.0, value.of_pi + value.plain.to_radians());
        }
        (value.plain.is_finite() && value.of_pi.is_finite()).then_some(value)
    }
}

/// `90`, `pi`, `pi/2`, `0.5*pi`, `3pi/4`.
fn term_of(text: &str) -> Option<(f64, bool)> {
    let Some((before, after)) = text.split_once("pi") else { return Some((text.parse().ok()?, false)) };
    let factor = match before.trim_end_matches('*') {
        "" => 1.0,
        factor => factor.parse().ok()?,
    };
    let divisor = match after.strip_prefix('/') {
        Some(divisor) => divisor.parse().ok()?,
        None if after.is_empty() => 1.0,
        None => return None,
    };
    Some((factor * PI / divisor, true))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn a_cell_is_a_number_or_an_expression() {
        let of = |text: &str| Value::parse(text).map(|value| (value.plain, value.of_pi, value.moves));
        assert_eq!(of(""), Some((0.0, 0.0, false)));
        assert_eq!(of("-612.5"), Some((-612.5, 0.0, false)));
        assert_eq!(of("pi/2"), Some((0.0, FRAC_PI_2, false)));
        assert_eq!(of("-π/2"), Some((0.0, -FRAC_PI_2, false)));
        assert_eq!(of("q2 - 90"), Some((-90.0, 0.0, true)));
        assert_eq!(of("pi/2 - 3.5"), Some((-3.5, FRAC_PI_2, false)));
        assert_eq!(of("θ3 + 0.5*pi"), Some((0.0, FRAC_PI_2, true)));
        assert_eq!(of("1e-3"), Some((1e-3, 0.0, false)));
        assert_eq!(of("d3"), Some((0.0, 0.0, true)));
        assert_eq!(of("q2 - 90°"), Some((0.0, -FRAC_PI_2, true)));
        for text in ["ninety", "nan", "inf", "1e400", "pi/0"] {
            assert_eq!(of(text), None, "{text}");
        }
    }
}
