//! Units in the words of other programs.

use crate::quantity;

/// What a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dimension {
    Length,
    Angle,
    Time,
    Temperature,
    /// A number without a unit.
    Number,
}

impl std::fmt::Display for Dimension {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Dimension::Length => "length",
            Dimension::Angle => "angle",
            Dimension::Time => "time",
            Dimension::Temperature => "temperature",
            Dimension::Number => "number",
        })
    }
}

/// A unit: ours, and how a value is converted to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unit {
    /// The suffix of our name: `mm`, `deg`, `s`, `c`.
    pub own: &'static str,
    /// Ours is `factor · theirs + offset`.
    pub factor: f64,
    pub offset: f64,
}

impl Unit {
    pub const fn of_own(own: &'static str) -> Unit {
        Unit { own, factor: 1.0, offset: 0.0 }
    }

    const fn times(own: &'static str, factor: f64) -> Unit {
        Unit { own, factor, offset: 0.0 }
    }

    /// Its first word.
    pub fn word(self) -> &'static str {
        UNITS.iter().find(|(unit, _)| *unit == self).map_or(self.own, |(_, words)| words[0])
    }

    /// Whether the values are ours as they are.
    pub fn is_own(self) -> bool {
        self.factor == 1.0 && self.offset == 0.0
    }

    /// The same of an angle from the zenith, as an elevation.
    pub fn above_horizon(self) -> Unit {
        let quarter = match self.own {
            "rad" => std::f64::consts::FRAC_PI_2,
            _ => 90.0,
        };
        Unit { own: self.own, factor: -self.factor, offset: quarter - self.offset }
    }

    pub fn converted(self, value: f64) -> f64 {
        self.factor * value + self.offset
    }

    /// The word is a degree in German and a hundredth of a right angle in English: [`DEGREE_OR_GON`].
    pub fn is_ambiguous(self) -> bool {
        self.own == GRAD.own
    }

    /// Whether values of both units can be converted into each other.
    pub fn agrees_with(self, other: Unit) -> bool {
        self == other || self.dimension() == other.dimension() && !self.is_ambiguous() && !other.is_ambiguous()
    }

    pub fn dimension(self) -> Dimension {
        match self.own {
            "s" => Dimension::Time,
            "c" => Dimension::Temperature,
            "1" => Dimension::Number,
            own if quantity::Unit::of_length(own).is_some() => Dimension::Length,
            _ => Dimension::Angle,
        }
    }

    pub fn is_length(self) -> bool {
        self.dimension() == Dimension::Length
    }

    pub fn is_angle(self) -> bool {
        self.dimension() == Dimension::Angle
    }

    /// The conversion of ours to the internal unit.
    fn internal(self) -> quantity::Unit {
        quantity::Unit::of_column(self.own, self.is_angle()).unwrap_or(quantity::Unit::Times(1.0))
    }

    /// The value in the internal unit: mm, rad, s, °C.
    pub fn to_internal(self, value: f64) -> f64 {
        self.internal().to_internal(self.converted(value))
    }

    /// The value in this unit of one in the internal unit.
    pub fn of_internal(self, value: f64) -> f64 {
        (self.internal().in_unit(value) - self.offset) / self.factor
    }
}

/// A degree or a gon.
const GRAD: Unit = Unit::of_own("grad");
/// What `grad` may be.
pub(super) const DEGREE_OR_GON: [(&str, Unit); 2] = [("deg", Unit::of_own("deg")), ("gon", Unit::times("deg", 0.9))];

/// The units with their words, in lower case.
const UNITS: [(Unit, &[&str]); 23] = [
    (Unit::of_own("mm"), &["mm", "millimeter", "millimetre", "millimeters", "millimetres"]),
    (Unit::of_own("um"), &["um", "µm", "μm", "micron", "microns", "mikrometer", "micrometer", "micrometre", "mum"]),
    (Unit::of_own("m"), &["m", "meter", "metre", "meters", "metres"]),
    (Unit::of_own("in"), &["in", "inch", "inches", "zoll", "in."]),
    (Unit::of_own("mil"), &["mil", "thou", "mils"]),
    (Unit::times("mm", 10.0), &["cm"]),
    (Unit::times("um", 1e-3), &["nm"]),
    (Unit::of_own("deg"), &["deg", "°", "degree", "degrees", "º", "deg.", "degs"]),
    (Unit::of_own("rad"), &["rad", "radian", "radians", "radiant"]),
    (Unit::of_own("mrad"), &["mrad"]),
    (Unit::of_own("urad"), &["urad", "µrad", "μrad"]),
    (Unit::of_own("arcsec"), &["arcsec", "arcseconds", "″", "as", "bogensekunden", "''"]),
    (Unit::of_own("arcmin"), &["arcmin", "′"]),
    (Unit::times("deg", 0.9), &["gon", "gons", "grads", "gradian", "gradians", "neugrad"]),
    (GRAD, &["grad"]),
    (Unit::of_own("s"), &["s", "sec", "second", "seconds", "sek", "sekunden"]),
    (Unit::times("s", 1e-3), &["ms", "msec", "millis"]),
    (Unit::times("s", 60.0), &["min", "minutes", "minuten"]),
    (Unit::times("s", 3600.0), &["h", "hours", "std"]),
    (Unit::of_own("c"), &["°c", "ºc", "degc", "celsius", "c"]),
    (Unit { own: "c", factor: 1.0, offset: -273.15 }, &["k", "kelvin"]),
    (Unit { own: "c", factor: 5.0 / 9.0, offset: -160.0 / 9.0 }, &["°f", "degf", "fahrenheit", "f"]),
    (Unit { own: "1", factor: 1.0, offset: 0.0 }, &["-", "1", "#", "none", "--"]),
];

/// The unit of a word.
pub(super) fn of(word: &str) -> Option<Unit> {
    let word = word.trim().to_lowercase();
    UNITS.iter().find(|(_, words)| words.contains(&word.as_str())).map(|(unit, _)| *unit)
}

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
            && let Some(unit) = of(&name[start + open.len_utf8()..end])
        {
            return Named { base: name[..start].trim(), unit: Some(unit), weak: false };
        }
    }
    for between in [" / ", "/", ", ", " in ", ": "] {
        if let Some((base, last)) = name.rsplit_once(between)
            && !base.trim().is_empty()
            && let Some(unit) = of(last)
        {
            return Named { base: base.trim(), unit: Some(unit), weak: false };
        }
    }
    for between in ['_', ' ', '.', '-'] {
        if let Some((base, last)) = name.rsplit_once(between)
            && !base.trim().is_empty()
            && let Some(unit) = of(last).filter(|unit| unit.own != "1")
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
        for (name, base, own) in [
            ("Länge [mm]", "Länge", "mm"),
            ("C (°)", "C", "deg"),
            ("Zeit / s", "Zeit", "s"),
            ("deviation_um", "deviation", "um"),
            ("Temp. [°C]", "Temp.", "c"),
            ("Length in inch", "Length", "in"),
            ("X", "X", ""),
        ] {
            let found = split(name);
            assert_eq!((found.base, found.unit.map_or("", |unit| unit.own)), (base, own), "{name}");
        }
    }

    #[test]
    fn other_units_are_converted() {
        let of = |word: &str, value: f64| of(word).unwrap().converted(value);
        assert!((of("°F", 68.0) - 20.0).abs() < 1e-12);
        assert!((of("K", 293.15) - 20.0).abs() < 1e-12);
        assert_eq!(of("gon", 100.0), 90.0);
        assert!(super::of("Grad").unwrap().is_ambiguous());
        assert_eq!(of("ms", 1500.0), 1.5);
        assert_eq!(of("cm", 2.0), 20.0);
        let internal = |word: &str, value: f64| super::of(word).unwrap().to_internal(value);
        assert!((internal("mil", 1.0) - 0.0254).abs() < 1e-15);
        assert!((internal("gon", 200.0) - std::f64::consts::PI).abs() < 1e-12);
        assert!((internal("mrad", 3.0) - 3e-3).abs() < 1e-15);
        for word in ["nm", "gon", "°F", "h", "mil", "arcmin"] {
            let unit = super::of(word).unwrap();
            assert!((unit.of_internal(unit.to_internal(7.5)) - 7.5).abs() < 1e-12, "{word}");
        }
    }
}
