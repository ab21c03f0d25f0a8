//! Names of error components according to ISO 230-1, and the short names of the literature.
//!
//! `EX0C` is the location error of C in X (a position-independent error, PIGE), `EXC` its error motion in X
//! (position-dependent, PDGE). The literature writes `e_x0c` for the first and `θ_x0c` for `EA0C`.

use std::fmt;

use crate::unit::InternalUnit;

/// One of the six degrees of freedom of a rigid body: translations along and rotations about R's X, Y, Z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Freedom {
    X,
    Y,
    Z,
    A,
    B,
    C,
}

impl Freedom {
    /// In the order in which errors are applied: X, Y, Z, A, B, C.
    pub const ALL: [Freedom; 6] = [Freedom::X, Freedom::Y, Freedom::Z, Freedom::A, Freedom::B, Freedom::C];

    /// The index, 0 to 5.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The unit of its errors: mm or rad.
    pub fn unit(self) -> InternalUnit {
        if self.is_angle() { InternalUnit::Radian } else { InternalUnit::Millimetre }
    }

    /// Whether it is a rotation (A, B, C).
    pub fn is_angle(self) -> bool {
        self.index() >= 3
    }

    /// The letter of ISO 230-1.
    pub fn letter(self) -> char {
        ['X', 'Y', 'Z', 'A', 'B', 'C'][self.index()]
    }
}

/// Location error or error motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ErrorKind {
    /// Position-independent (PIGE): position and orientation of the axis; squareness for a linear axis.
    Location,
    /// Position-dependent (PDGE): error motion of the moving body.
    Motion,
}

/// The name of an error of an axis: `EX0C`, `EZC`, `EBJ2`.
///
/// ```
/// use abbe_model::component::{ErrorKind, ErrorName};
///
/// let name = ErrorName::parse("θ_y0a").unwrap();
/// assert_eq!((name.to_string().as_str(), name.kind), ("EB0A", ErrorKind::Location));
/// assert_eq!(ErrorName::parse("EBJ2").unwrap().kind, ErrorKind::Motion);
/// assert_eq!(ErrorName::parse("EW0A"), None);
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ErrorName {
    /// Location error or error motion.
    pub kind: ErrorKind,
    /// The degree of freedom of the moved body.
    pub freedom: Freedom,
    /// The axis of the error.
    pub axis: String,
}

impl ErrorName {
    /// Parses an ISO 230-1 name (`EX0C`, `EBJ2`) or a literature alias (`e_x0c`, `e_x,0c`, `θ_y0a`, `theta_y0a`).
    /// Returns `None` for any other text. Does not check that the axis exists.
    pub fn parse(text: &str) -> Option<ErrorName> {
        let text = text.trim();
        let iso = || {
            let mut characters = text.strip_prefix('E')?.chars();
            let letter = characters.next()?;
            let freedom = Freedom::ALL.into_iter().find(|f| f.letter() == letter)?;
            ErrorName::with_rest(freedom, characters.as_str())
        };
        let literature = || {
            let (rest, angle) = if let Some(rest) = text.strip_prefix("e_") {
                (rest, false)
            } else {
                let rest = text.strip_prefix("θ_").or_else(|| text.strip_prefix("theta_"))?;
                (rest, true)
            };
            let mut characters = rest.chars();
            let index = ['x', 'y', 'z'].iter().position(|c| characters.clone().next() == Some(*c))?;
            characters.next();
            let freedom = Freedom::ALL[index + if angle { 3 } else { 0 }];
            let rest = characters.as_str().trim_start_matches(',');
            ErrorName::with_rest(freedom, &rest.to_uppercase())
        };
        iso().or_else(literature)
    }

    fn with_rest(freedom: Freedom, rest: &str) -> Option<ErrorName> {
        let (kind, axis) = match rest.strip_prefix('0') {
            Some(axis) => (ErrorKind::Location, axis),
            None => (ErrorKind::Motion, rest),
        };
        let valid = axis.chars().next().is_some_and(char::is_alphabetic) && axis.chars().all(char::is_alphanumeric);
        valid.then(|| ErrorName { kind, freedom, axis: axis.to_string() })
    }

    /// The short name of the literature: `e_x0c`, `θ_z0c`.
    pub fn literature(&self) -> String {
        let index = self.freedom.index();
        let symbol = if self.freedom.is_angle() { "θ" } else { "e" };
        let zero = if self.kind == ErrorKind::Location { "0" } else { "" };
        format!("{symbol}_{}{zero}{}", ['x', 'y', 'z'][index % 3], self.axis.to_lowercase())
    }
}

impl fmt::Display for ErrorName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let zero = if self.kind == ErrorKind::Location { "0" } else { "" };
        write!(formatter, "E{}{zero}{}", self.freedom.letter(), self.axis)
    }
}
