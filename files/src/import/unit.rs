//! Units in the words of other programs.

use abbe_model::unit::Unit;

/// What `grad` may be.
pub(super) const DEGREE_OR_GON: [Unit; 2] = [Unit::Degree, Unit::Gon];

/// The name of a column without its unit, and the unit: in brackets, behind a slash, a comma or "in", or as the last word.
/// A unit of one letter that is no more than a last word may be a part of the name; it is `weak`.
pub(crate) struct Named<'n> {
    pub base: &'n str,
    pub unit: Option<Unit>,
    pub weak: bool,
}

pub(crate) fn split(name: &str) -> Named<'_> {
    let plain = Named { base: name, unit: None, weak: false };
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')] {
        if let (Some(start), Some(end)) = (name.find(open), name.rfind(close))
            && start < end
            && let Some(unit) = Unit::of_word(&name[start + open.len_utf8()..end])
        {
            return Named { base: name[..start].trim(), unit: Some(unit), weak: false };
        }
    }
    for between in [" / ", "/", ", ", " in ", ": "] {
        if let Some((base, last)) = name.rsplit_once(between)
            && !base.trim().is_empty()
            && let Some(unit) = Unit::of_word(last)
        {
            return Named { base: base.trim(), unit: Some(unit), weak: false };
        }
    }
    for between in ['_', ' ', '.', '-'] {
        if let Some((base, last)) = name.rsplit_once(between)
            && !base.trim().is_empty()
            && let Some(unit) = Unit::of_word(last).filter(|unit| *unit != Unit::One)
        {
            return Named { base: base.trim(), unit: Some(unit), weak: last.chars().count() < 2 };
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_found_where_programs_write_it() {
        for (name, base, key) in [
            ("Länge [mm]", "Länge", "mm"),
            ("C (°)", "C", "deg"),
            ("Zeit / s", "Zeit", "s"),
            ("deviation_um", "deviation", "um"),
            ("Temp. [°C]", "Temp.", "c"),
            ("Length in inch", "Length", "in"),
            ("X", "X", ""),
        ] {
            let found = split(name);
            assert_eq!((found.base, found.unit.map_or("", Unit::key)), (base, key), "{name}");
        }
    }

    #[test]
    fn other_units_are_converted() {
        let converted = |word: &str, value: f64| {
            let unit = Unit::of_word(word).unwrap();
            unit.convert(value, unit.in_files()).unwrap()
        };
        assert!((converted("°F", 68.0) - 20.0).abs() < 1e-12);
        assert!((converted("K", 293.15) - 20.0).abs() < 1e-12);
        assert_eq!(converted("gon", 100.0), 90.0);
        assert_eq!(Unit::of_word("Grad"), Some(Unit::Grad));
        assert_eq!(converted("ms", 1500.0), 1.5);
        assert_eq!(converted("cm", 2.0), 20.0);
    }
}
