//! Tables on the terminal: aligned columns, values rounded to the digits of their uncertainty, units by their symbols.

use abbe::identify::results::ShapeParameter;

/// Prints rows under a header. The first column is aligned left, the others right.
pub fn print(header: &[&str], rows: &[Vec<String>]) {
    print_aligned(header, rows, &[0]);
}

/// Prints rows under a header. The columns in `left` are aligned left, the others right.
pub fn print_aligned(header: &[&str], rows: &[Vec<String>], left: &[usize]) {
    let mut width: Vec<usize> = header.iter().map(|cell| cell.chars().count()).collect();
    for row in rows {
        for (w, cell) in width.iter_mut().zip(row) {
            *w = (*w).max(cell.chars().count());
        }
    }
    let line = |cells: &[String]| {
        let mut text = String::from("  ");
        for (column, cell) in cells.iter().enumerate() {
            let padding = " ".repeat(width[column].saturating_sub(cell.chars().count()));
            if column > 0 {
                text.push_str("  ");
            }
            if left.contains(&column) {
                text.push_str(cell);
                text.push_str(&padding);
            } else {
                text.push_str(&padding);
                text.push_str(cell);
            }
        }
        say!("{}", text.trim_end());
    };
    line(&header.iter().map(|cell| cell.to_string()).collect::<Vec<_>>());
    for row in rows {
        line(row);
    }
}

/// The symbol for the unit in a result: `µm` for `um`, `″` for `arcsec`, `°` for `deg`.
pub fn unit(name: &str) -> String {
    name.replace("arcsec", "″").replace("um", "µm").replace("deg", "°")
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

/// Decimal places of a value with this standard uncertainty: two digits of the uncertainty (JCGM 100, 7.2.6).
fn places(u: f64) -> usize {
    if !u.is_finite() || u <= 0.0 {
        return 4;
    }
    (1.0 - u.log10().floor()).clamp(0.0, 12.0) as usize
}

/// A value and its uncertainty, rounded to the same place. A value that rounds to zero has no sign.
pub fn value_and_u(value: f64, u: f64) -> (String, String) {
    let places = places(u);
    let rounded = format!("{value:.places$}");
    let unsigned = rounded.strip_prefix('-').filter(|digits| digits.bytes().all(|digit| matches!(digit, b'0' | b'.')));
    let value = unsigned.map_or_else(|| rounded.clone(), str::to_string);
    (value, format!("{u:.places$}"))
}

/// A residual or a noise figure in µm.
pub fn micrometres(value_um: f64) -> String {
    let places = if value_um >= 100.0 { 1 } else { 3 };
    format!("{value_um:.places$} µm")
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

#[cfg(test)]
mod tests {
    use super::value_and_u;

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
}
