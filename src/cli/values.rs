//! Quantities that options state, each with its limits. A number that cannot be one is refused with the option.

use abbe::model::Diagnostic;
use abbe::model::chain::Machine;
use abbe::model::session::limits::{LARGEST, MAX_LENGTH_MM, MIN_UM};
use abbe::model::words::number;
use clap::builder::{PossibleValuesParser, TypedValueParser};

/// A quantity: its words and its limits.
#[derive(Clone, Copy)]
pub struct Quantity {
    /// Words before the limits: `a length`.
    words: &'static str,
    /// Words after the limits: `mm`.
    unit: &'static str,
    least: f64,
    most: f64,
    /// Whether 0 is allowed beside the limits.
    or_zero: bool,
    /// Whether the least value itself is excluded.
    above: bool,
}

/// A quantity within limits that belong to it.
const fn within(words: &'static str, unit: &'static str, least: f64, most: f64) -> Quantity {
    Quantity { words, unit, least, most, or_zero: false, above: false }
}

/// A coordinate or a position along a direction.
pub const COORDINATE_MM: Quantity = within("a length", " mm", -MAX_LENGTH_MM, MAX_LENGTH_MM);
/// A distance that may be 0.
pub const DISTANCE_MM: Quantity = within("a length", " mm", 0.0, MAX_LENGTH_MM);
/// The length of a bar, or the radius of a circle.
pub const LENGTH_MM: Quantity = within("a length", " mm", 1.0, MAX_LENGTH_MM);
/// The bar of a set-up sheet.
pub const BAR_MM: Quantity = within("a length", " mm", 1.0, 1e4);
/// A size of a part.
pub const SIZE_MM: Quantity = Quantity { above: true, ..within("a length", " mm", 0.0, MAX_LENGTH_MM) };
/// A standard deviation or a standard uncertainty.
pub const DEVIATION_UM: Quantity = within("a number of µm", "", MIN_UM, LARGEST);
/// A standard deviation of simulated noise.
pub const NOISE_UM: Quantity = Quantity { or_zero: true, ..within("a standard deviation in µm", "", MIN_UM, LARGEST) };
/// The same of angles.
pub const NOISE_ARCSEC: Quantity =
    Quantity { or_zero: true, ..within("a standard deviation in arcsec", "", MIN_UM, LARGEST) };
/// A time that a person takes.
pub const MINUTES: Quantity = within("a number of minutes", "", 0.0, 1e4);
/// A limit of the time of a computation: at most ten years.
pub const SECONDS: Quantity = Quantity { above: true, ..within("a time", " s", 0.0, 3.2e8) };
/// A multiple of a feed.
pub const FEED: Quantity = Quantity { above: true, ..within("a multiple of the feed", "", 0.0, 1e3) };
/// A share of a range.
pub const SHARE: Quantity = Quantity { above: true, ..within("a share of the range", "", 0.0, 1.0) };
/// A position of an axis, mm or degrees.
pub const POSITION: Quantity = within("a position in mm or degrees", "", -MAX_LENGTH_MM, MAX_LENGTH_MM);

impl Quantity {
    /// The value, if it can be this quantity.
    pub fn check(&self, option: &str, value: f64) -> Result<f64, Diagnostic> {
        self.reason(value).map_or(Ok(value), |expected| {
            let space = if option.ends_with('=') { "" } else { " " };
            Err(Diagnostic::other(format!("`{option}{space}{}`: {expected}", number(value))))
        })
    }

    /// The values, if each can be this quantity.
    pub fn all(&self, option: &str, values: &[f64]) -> Result<Vec<f64>, Diagnostic> {
        values.iter().map(|value| self.check(option, *value)).collect()
    }

    /// What is expected, if the value cannot be this quantity.
    pub fn reason(&self, value: f64) -> Option<String> {
        let least = if self.above { value > self.least } else { value >= self.least };
        if (least && value <= self.most) || (self.or_zero && value == 0.0) {
            return None;
        }
        let Quantity { words, unit, .. } = self;
        let limits = match (self.above, self.or_zero) {
            (true, _) => format!("above {} and at most {}{unit}", number(self.least), number(self.most)),
            (_, true) => format!("0, or {} to {}{unit}", number(self.least), number(self.most)),
            _ => format!("from {} to {}{unit}", number(self.least), number(self.most)),
        };
        Some(match self.or_zero {
            true => format!("{words} is expected: {limits}"),
            false => format!("{words} {limits} is expected"),
        })
    }
}

/// The words of an option, each with its value.
pub type Words<T> = &'static [(&'static str, T)];

/// The value of one of these words.
pub fn words<T: Clone + Send + Sync>(words: Words<T>) -> impl TypedValueParser<Value = T> {
    let value = move |text: String| {
        words.iter().find(|(word, _)| *word == text).map(|(_, value)| value.clone()).ok_or("no such word")
    };
    PossibleValuesParser::new(words.iter().map(|(word, _)| *word)).try_map(value)
}

/// A positive length in µm, converted to mm.
pub fn length_um(option: &str, um: f64) -> Result<f64, Diagnostic> {
    Ok(DEVIATION_UM.check(option, um)? * 1e-3)
}

/// A number of things from 1 to the most.
pub fn count(option: &str, things: &str, value: usize, most: usize) -> Result<usize, Diagnostic> {
    if (1..=most).contains(&value) {
        return Ok(value);
    }
    let of = if things.is_empty() { String::new() } else { format!(" of {things}") };
    Err(Diagnostic::other(format!("`{option} {value}`: a number{of} from 1 to {most} is expected")))
}

/// A number of threads.
pub fn threads() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=1024)
}

/// A point that an option states by three coordinates; `usual` if it is not stated.
pub fn point_mm(option: &str, stated: &[f64], usual: [f64; 3]) -> Result<[f64; 3], Diagnostic> {
    match *stated {
        [] => Ok(usual),
        [x, y, z] => {
            COORDINATE_MM.all(option, stated)?;
            Ok([x, y, z])
        }
        _ => Err(Diagnostic::other(format!("`{option}`: three numbers are expected, as in 0,0,-120"))),
    }
}

/// The positions of axes that options `--at AXIS=POSITION` state, zero for the others, mm or rad.
pub fn positions(machine: &Machine, stated: &[String]) -> Result<Vec<f64>, Diagnostic> {
    let mut at = vec![None; machine.axes.len()];
    for text in stated {
        let fault =
            || Diagnostic::other(format!("--at {text}: write an axis and its position in mm or degrees, `A=30`"));
        let (name, number) = text.split_once('=').ok_or_else(fault)?;
        let number: f64 = number.trim().parse().map_err(|_| fault())?;
        POSITION.check(&format!("--at {}=", name.trim()), number)?;
        let Some(axis) = machine.axis_index(name.trim()) else {
            let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            let axes = names.join(", ");
            return Err(Diagnostic::other(format!(
                "--at {text}: the machine has no axis `{}`; its axes are {axes}",
                name.trim()
            )));
        };
        if at[axis].replace(machine.axes[axis].kind.to_internal(number)).is_some() {
            return Err(Diagnostic::other(format!("--at {text}: the position of {} is stated twice", name.trim())));
        }
    }
    Ok(at.into_iter().map(Option::unwrap_or_default).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_cannot_be_the_quantity_is_refused_with_option_and_limits() {
        for (quantity, refused, accepted, expected) in [
            (COORDINATE_MM, 1e9, -1e6, "`--x 1e9`: a length from -1000000 to 1000000 mm is expected"),
            (LENGTH_MM, 1e300, 1.0, "`--x 1e300`: a length from 1 to 1000000 mm is expected"),
            (SIZE_MM, 0.0, 0.5, "`--x 0`: a length above 0 and at most 1000000 mm is expected"),
            (SECONDS, 1e300, 10.0, "`--x 1e300`: a time above 0 and at most 3.2e8 s is expected"),
            (SHARE, 1.5, 1.0, "`--x 1.5`: a share of the range above 0 and at most 1 is expected"),
            (NOISE_UM, -1.0, 0.0, "`--x -1`: a standard deviation in µm is expected: 0, or 1e-6 to 1e12"),
        ] {
            assert_eq!(quantity.check("--x", refused).unwrap_err().to_string(), expected);
            assert_eq!(quantity.check("--x", accepted).unwrap(), accepted);
            for never in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(quantity.check("--x", never).is_err());
            }
        }
        assert!(point_mm("--tool-mm", &[0.0, 0.0], [0.0; 3]).is_err());
        assert_eq!(point_mm("--tool-mm", &[], [1.0; 3]).unwrap(), [1.0; 3]);
    }
}
