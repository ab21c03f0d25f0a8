//! Units: one table of their names, symbols, sizes and dimensions.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What a unit measures. The internal units are mm, rad, 1, s, °C, Pa, 1/s and W.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Dimension {
    Length,
    Angle,
    Number,
    Time,
    Temperature,
    Pressure,
    Frequency,
    Power,
    Other,
}

impl fmt::Display for Dimension {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&format!("{self:?}").to_lowercase())
    }
}

macro_rules! units {
    ($($(#[$attribute:meta])? $unit:ident $name:literal $key:literal $symbol:literal $dimension:ident
       $above:literal $(* $pi:ident)? / $below:literal $words:literal;)+) => {
        /// A unit of files, results and texts. As text it is its name. The default is that of readings.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
        pub enum Unit { $(#[doc = $symbol] #[serde(rename = $name)] $(#[$attribute])? $unit,)+ }

        impl Unit {
            /// All units.
            pub const ALL: &[Unit] = &[$(Unit::$unit,)+];
            /// The name in results: `um`, `arcsec`, `um/m`.
            pub const fn name(self) -> &'static str { match self { $(Unit::$unit => $name,)+ } }
            /// The suffix in keys and names of columns: `um`, `arcsec`, `hpa`.
            pub const fn key(self) -> &'static str { match self { $(Unit::$unit => $key,)+ } }
            /// The symbol in texts: `µm`, `″`.
            pub const fn symbol(self) -> &'static str { match self { $(Unit::$unit => $symbol,)+ } }
            /// What it measures.
            pub const fn dimension(self) -> Dimension { match self { $(Unit::$unit => Dimension::$dimension,)+ } }
            /// Its words in the files of other programs, in lower case.
            const fn words(self) -> &'static str { match self { $(Unit::$unit => $words,)+ } }
            /// The internal value of a number is the number times the quotient of the two.
            const fn size(self) -> [f64; 2] {
                match self { $(Unit::$unit => [$above $(* std::f64::consts::$pi)?, $below],)+ }
            }
        }
    };
}

// The unit, its name in results, its suffix in keys and columns, its symbol, its dimension, its size, its words in the
// files of other programs.
units! {
    Nanometre "nm" "nm" "nm" Length 1.0 / 1e6 "nm";
    #[default]
    Micrometre "um" "um" "µm" Length 1.0 / 1e3 "um µm μm micron microns mikrometer micrometer micrometre mum";
    Millimetre "mm" "mm" "mm" Length 1.0 / 1.0 "mm millimeter millimetre millimeters millimetres";
    Centimetre "cm" "cm" "cm" Length 10.0 / 1.0 "cm";
    Metre "m" "m" "m" Length 1e3 / 1.0 "m meter metre meters metres";
    Inch "in" "in" "in" Length 25.4 / 1.0 "in inch inches zoll in.";
    Mil "mil" "mil" "mil" Length 25.4 / 1e3 "mil thou mils";
    Microradian "urad" "urad" "µrad" Angle 1.0 / 1e6 "urad µrad μrad";
    Milliradian "mrad" "mrad" "mrad" Angle 1.0 / 1e3 "mrad";
    Radian "rad" "rad" "rad" Angle 1.0 / 1.0 "rad radian radians radiant";
    Arcsecond "arcsec" "arcsec" "″" Angle 1.0 * PI / 648e3 "arcsec arcseconds ″ as bogensekunden ''";
    Arcminute "arcmin" "arcmin" "′" Angle 1.0 * PI / 10800.0 "arcmin ′";
    Degree "deg" "deg" "°" Angle 1.0 * PI / 180.0 "deg ° degree degrees º deg. degs";
    Grad "grad" "grad" "grad" Angle 1.0 * PI / 180.0 "grad";
    Gon "gon" "gon" "gon" Angle 1.0 * PI / 200.0 "gon gons grads gradian gradians neugrad";
    MicrometrePerMetre "um/m" "um_m" "µm/m" Number 1.0 / 1e6 "";
    Percent "%" "pct" "%" Number 1.0 / 100.0 "";
    One "1" "1" "1" Number 1.0 / 1.0 "- 1 # none --";
    Microsecond "us" "us" "µs" Time 1.0 / 1e6 "";
    Millisecond "ms" "ms" "ms" Time 1.0 / 1e3 "ms msec millis";
    Second "s" "s" "s" Time 1.0 / 1.0 "s sec second seconds sek sekunden";
    Minute "min" "min" "min" Time 60.0 / 1.0 "min minutes minuten";
    Hour "h" "h" "h" Time 3600.0 / 1.0 "h hours std";
    Celsius "degC" "c" "°C" Temperature 1.0 / 1.0 "°c ºc degc celsius c";
    Kelvin "K" "k" "K" Temperature 1.0 / 1.0 "k kelvin";
    Fahrenheit "degF" "f" "°F" Temperature 5.0 / 9.0 "°f degf fahrenheit f";
    Hectopascal "hPa" "hpa" "hPa" Pressure 100.0 / 1.0 "";
    Kilopascal "kPa" "kpa" "kPa" Pressure 1e3 / 1.0 "";
    Megapascal "MPa" "mpa" "MPa" Pressure 1e6 / 1.0 "";
    Bar "bar" "bar" "bar" Pressure 1e5 / 1.0 "";
    Hertz "Hz" "hz" "Hz" Frequency 1.0 / 1.0 "";
    PerMinute "rpm" "rpm" "rpm" Frequency 1.0 / 60.0 "";
    Watt "W" "w" "W" Power 1.0 / 1.0 "";
    Kilowatt "kW" "kw" "kW" Power 1e3 / 1.0 "";
    Kilogram "kg" "kg" "kg" Other 1.0 / 1.0 "";
    Newton "N" "n" "N" Other 1.0 / 1.0 "";
    NewtonMetre "N m" "nm" "N·m" Other 1.0 / 1.0 "";
    Ampere "A" "a" "A" Other 1.0 / 1.0 "";
    Volt "V" "v" "V" Other 1.0 / 1.0 "";
    SquareOfSpeed "(mm/s)^2" "mm2_s2" "(mm/s)²" Other 1.0 / 1.0 "";
    SquareOfRate "(rad/s)^2" "rad2_s2" "(rad/s)²" Other 1.0 / 1.0 "";
}

/// Internal unit of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InternalUnit {
    /// mm; displayed in µm.
    Millimetre,
    /// rad; displayed in arcsec.
    Radian,
    /// Dimensionless; displayed in µm/m.
    Ratio,
}

impl InternalUnit {
    /// The unit of results.
    pub const fn displayed(self) -> Unit {
        match self {
            InternalUnit::Millimetre => Unit::Micrometre,
            InternalUnit::Radian => Unit::Arcsecond,
            InternalUnit::Ratio => Unit::MicrometrePerMetre,
        }
    }
}

/// Micrometres in a millimetre.
pub const UM_PER_MM: f64 = Unit::Micrometre.per_internal();
/// Millimetres in a micrometre.
pub const MM_PER_UM: f64 = Unit::Micrometre.internal();
/// Arcseconds in a radian.
pub const ARCSEC_PER_RAD: f64 = Unit::Arcsecond.per_internal();
/// Radians in an arcsecond.
pub const RAD_PER_ARCSEC: f64 = Unit::Arcsecond.internal();

impl Unit {
    /// The unit of a name, such as `um` or `µm`. [`Unit::Grad`], a degree in German and a gon in English, is `None`.
    pub fn parse(text: &str) -> Option<Unit> {
        match text {
            "µm" | "μm" => Some(Unit::Micrometre),
            "ppm" => Some(Unit::MicrometrePerMetre),
            "percent" => Some(Unit::Percent),
            name => Unit::ALL.iter().find(|unit| unit.name() == name && **unit != Unit::Grad).copied(),
        }
    }

    /// The unit of a word of another program, such as `Zoll` or `[°C]` without its brackets. `grad` is [`Unit::Grad`].
    pub fn of_word(word: &str) -> Option<Unit> {
        let word = word.trim().to_lowercase();
        let has_word = |unit: &&Unit| !word.is_empty() && unit.words().split_whitespace().any(|own| own == word);
        Unit::ALL.iter().find(has_word).copied()
    }

    /// The size in the internal unit of its dimension.
    pub const fn internal(self) -> f64 {
        self.size()[0] / self.size()[1]
    }

    /// The number of this unit in the internal unit.
    pub const fn per_internal(self) -> f64 {
        self.size()[1] / self.size()[0]
    }

    /// The internal value of zero.
    const fn zero(self) -> f64 {
        match self {
            Unit::Kelvin => -273.15,
            Unit::Fahrenheit => -160.0 / 9.0,
            _ => 0.0,
        }
    }

    /// A number of this unit in the internal unit. A temperature is no difference of temperatures.
    pub const fn to_internal(self, number: f64) -> f64 {
        // Not as a sum: a negative zero stays.
        number * self.internal() - (0.0 - self.zero())
    }

    /// A number of the internal unit in this unit.
    pub const fn to_display(self, number: f64) -> f64 {
        let [above, below] = self.size();
        let number = number - self.zero();
        // One rounding: the inverse of 1000 is not exact.
        if below == 1.0 { number / above } else { number * (below / above) }
    }

    /// A number of this unit in another; `None` if they measure different things.
    pub fn convert(self, number: f64, to: Unit) -> Option<f64> {
        let ([above, below], [to_above, to_below]) = (self.size(), to.size());
        match self.dimension() == to.dimension() && (self.dimension() != Dimension::Other || self == to) {
            true if self.zero() == to.zero() => Some(number * (above / to_above) * (to_below / below)),
            true => Some(to.to_display(self.to_internal(number))),
            false => None,
        }
    }

    /// Whether it is an angle.
    pub fn is_angle(self) -> bool {
        self.dimension() == Dimension::Angle
    }

    /// Whether it is a length.
    pub fn is_length(self) -> bool {
        self.dimension() == Dimension::Length
    }

    /// The unit of a column of files with this suffix: of angle if `is_angle`, else of length.
    pub fn of_column(suffix: &str, is_angle: bool) -> Option<Unit> {
        let dimension = if is_angle { Dimension::Angle } else { Dimension::Length };
        let is_of_column =
            |unit: &Unit| unit.dimension() == dimension && unit.in_files() == *unit && unit.key() == suffix;
        Unit::parse(suffix).filter(is_of_column)
    }

    /// The unit in which a file of readings has numbers of this one.
    pub fn in_files(self) -> Unit {
        match (self, self.dimension()) {
            (Unit::Nanometre, _) => Unit::Micrometre,
            (Unit::Centimetre, _) => Unit::Millimetre,
            (Unit::Gon, _) => Unit::Degree,
            (_, Dimension::Time) => Unit::Second,
            (_, Dimension::Temperature) => Unit::Celsius,
            (unit, _) => unit,
        }
    }

    /// The symbol behind a number: `1.2 µm`, `3.4″`.
    pub fn behind(self, number: impl fmt::Display) -> String {
        let space = if matches!(self, Unit::Arcsecond | Unit::Arcminute | Unit::Degree) { "" } else { " " };
        format!("{number}{space}{}", self.symbol())
    }

    /// A figure of readings with its symbol.
    pub fn text(self, number: f64, places: usize) -> String {
        format!("{number:.places$} {}", self.symbol())
    }

    /// Whether it is the micrometre, the unit of readings that results do not state.
    pub fn is_micrometre(&self) -> bool {
        *self == Unit::Micrometre
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// The unit of the figures of readings in documents: µm or arcsec.
pub mod reading {
    use schemars::{Schema, SchemaGenerator, json_schema};
    use serde::de::Error;
    use serde::{Deserialize, Deserializer};

    use super::Unit;

    /// Reads the unit.
    ///
    /// # Errors
    /// If it is another one.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Unit, D::Error> {
        match Unit::deserialize(from)? {
            unit @ (Unit::Micrometre | Unit::Arcsecond) => Ok(unit),
            other => Err(D::Error::custom(format!("the unit of readings is {other}; `um` or `arcsec` is expected"))),
        }
    }

    /// Its schema.
    pub fn schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "string", "enum": [Unit::Micrometre.name(), Unit::Arcsecond.name()]})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_the_si_brochure_and_of_the_inch() {
        let converted = [
            (1.0, Unit::Inch, Unit::Micrometre, 25_400.0),
            (1.0, Unit::Mil, Unit::Millimetre, 0.0254),
            (7.0, Unit::Nanometre, Unit::Micrometre, 0.007),
            (1.0, Unit::Degree, Unit::Arcsecond, 3600.0),
            (1.0, Unit::Degree, Unit::Arcminute, 60.0),
            (100.0, Unit::Gon, Unit::Degree, 90.0),
            (1.0, Unit::Percent, Unit::MicrometrePerMetre, 10_000.0),
            (1.0, Unit::Hour, Unit::Second, 3600.0),
            (68.0, Unit::Fahrenheit, Unit::Celsius, 20.0),
            (1013.25, Unit::Hectopascal, Unit::Bar, 1.01325),
            (293.15, Unit::Kelvin, Unit::Celsius, 20.0),
            (-40.0, Unit::Fahrenheit, Unit::Kelvin, 233.15),
        ];
        for (number, unit, to, expected) in converted {
            let found = unit.convert(number, to).unwrap();
            assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{number} {unit}: {found} {to}");
        }
        assert_eq!(Unit::Millimetre.convert(1.0, Unit::Radian), None);
        assert_eq!(Unit::Newton.convert(1.0, Unit::NewtonMetre), None);
        assert_eq!(Unit::Degree.to_internal(180.0), std::f64::consts::PI);
        // 1 rad is 206 264.806 247 096 355 arcseconds.
        assert!((Unit::Arcsecond.to_display(1.0) - 206_264.806_247_096_36).abs() < 1e-9);
    }

    #[test]
    fn names_are_unique_and_every_unit_converts_there_and_back() {
        for unit in Unit::ALL.iter().filter(|unit| **unit != Unit::Grad) {
            assert_eq!(Unit::parse(unit.name()), Some(*unit));
            assert!((unit.to_display(unit.to_internal(7.5)) - 7.5).abs() < 1e-12, "{unit}");
            let text = serde_json::to_string(unit).unwrap();
            assert_eq!(serde_json::from_str::<Unit>(&text).unwrap(), *unit);
        }
        assert_eq!(Unit::parse("furlong"), None);
    }

    #[test]
    fn a_word_of_another_program_names_one_unit() {
        let words: Vec<(&str, Unit)> =
            Unit::ALL.iter().flat_map(|unit| unit.words().split_whitespace().map(|word| (word, *unit))).collect();
        for (word, unit) in &words {
            assert_eq!(words.iter().filter(|(other, _)| other == word).count(), 1, "{word}");
            assert_eq!(Unit::of_word(&format!(" {} ", word.to_uppercase())), Some(*unit), "{word}");
        }
        assert_eq!(Unit::of_word(""), None);
    }
}
