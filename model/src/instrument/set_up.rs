//! The set-up of an instrument in files: the keys of a test that only some instruments have, and how they are read.

use super::Station;
use serde::Deserialize;

use crate::document::fault::{Fault, Within};
use crate::document::from_node;
use crate::document::node::{Entries, Value};
use crate::document::value::{self as document, Point, Three, Uncertainty, Vector};
use crate::session::Prior;
use crate::session::expression::{Constant, Length};
use crate::session::limits;
use crate::words;

/// A micrometre in mm.
const MICROMETRE: f64 = 1e-3;

/// A nominal length, as written and in mm.
#[derive(Clone, Debug)]
pub struct Written {
    /// As an expression in the session's constants.
    pub length: Length,
    /// Its value, mm.
    pub mm: f64,
}

impl Written {
    /// A number.
    pub const fn number(value: f64) -> Written {
        Written { length: Length::Number(value), mm: value }
    }
}

/// The set-up of a test as read.
pub struct SetUp {
    /// The nominal geometry.
    pub station: Station<Written>,
    /// The prior of each parameter of the instrument, in their order.
    pub priors: Vec<Prior>,
    /// The socket, if the test states one.
    pub socket: Option<String>,
}

/// What a key of a set-up holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetUpForm {
    /// A length, mm.
    Length,
    /// Three lengths, mm.
    Point,
    /// Three numbers.
    Vector,
    /// A list of three vectors.
    Vectors,
    /// The standard uncertainty of one quantity.
    Uncertainty,
    /// The standard uncertainty of three quantities: one number or three.
    Uncertainties,
    /// A text.
    Text,
    /// One of these words.
    Words(&'static [&'static str]),
}

/// A key of a set-up.
#[derive(Clone, Copy, Debug)]
pub struct SetUpKey {
    /// The key.
    pub name: &'static str,
    /// What it holds.
    pub form: SetUpForm,
    /// Its description in the schema without a full stop, or empty.
    pub meaning: &'static str,
}

impl SetUpKey {
    pub(super) const fn new(name: &'static str, form: SetUpForm, meaning: &'static str) -> SetUpKey {
        SetUpKey { name, form, meaning }
    }
}

/// Reads the keys of a set-up. A fault has the path of its key; `what` says what to add if a required key is absent.
#[derive(Debug)]
pub struct SetUpReader<'e> {
    entries: &'e Entries,
    constants: &'e [Constant],
}

impl<'e> SetUpReader<'e> {
    /// The keys of a set-up whose lengths may be expressions in the constants.
    pub fn new(entries: &'e Entries, constants: &'e [Constant]) -> SetUpReader<'e> {
        SetUpReader { entries, constants }
    }

    fn get<T: Deserialize<'e>>(&self, key: &str) -> Result<Option<T>, Fault> {
        self.entries.get(key).map(|node| from_node(node).within(key)).transpose()
    }

    fn require<T: Deserialize<'e>>(&self, key: &str, what: &str) -> Result<T, Fault> {
        self.get(key)?.ok_or_else(|| Fault::missing(key, what))
    }

    fn written(&self, length: &document::Length) -> Result<Written, Fault> {
        let (length, mm) = length.in_mm(self.constants)?;
        Ok(Written { length, mm })
    }

    fn coordinates(&self, key: &str, point: &Point) -> Result<[Written; 3], Fault> {
        let mut coordinates = [const { Written::number(0.0) }; 3];
        for (item, (coordinate, length)) in coordinates.iter_mut().zip(&point.0).enumerate() {
            *coordinate = self.written(length).within_item(item).within(key)?;
        }
        Ok(coordinates)
    }

    /// A length above zero.
    ///
    /// # Errors
    /// If it is absent, no length or not above zero.
    pub fn positive_length(&self, key: &str, what: &str) -> Result<Written, Fault> {
        let length = self.written(&self.require(key, what)?).within(key)?;
        limits::positive(length.mm).within(key)?;
        Ok(length)
    }

    /// A point.
    ///
    /// # Errors
    /// If it is absent or not three lengths.
    pub fn point(&self, key: &str, what: &str) -> Result<[Written; 3], Fault> {
        self.coordinates(key, &self.require(key, what)?)
    }

    /// A point that need not be stated.
    ///
    /// # Errors
    /// If it is not three lengths.
    pub fn stated_point(&self, key: &str) -> Result<Option<[Written; 3]>, Fault> {
        self.get(key)?.map(|point| self.coordinates(key, &point)).transpose()
    }

    /// A direction of three numbers, normalised to unit length.
    ///
    /// # Errors
    /// If it is not three numbers, or zero.
    pub fn direction(&self, key: &str) -> Result<Option<[f64; 3]>, Fault> {
        self.get::<Vector>(key)?.map(|vector| unit(&vector).within(key)).transpose()
    }

    /// Three directions, normalised to unit length.
    ///
    /// # Errors
    /// As [`SetUpReader::direction`].
    pub fn three_directions(&self, key: &str) -> Result<Option<[[f64; 3]; 3]>, Fault> {
        let Some(vectors) = self.get::<Three<Vector>>(key)? else { return Ok(None) };
        let mut rows = [[0.0; 3]; 3];
        for (item, (row, vector)) in rows.iter_mut().zip(&vectors.0).enumerate() {
            *row = unit(vector).within_item(item).within(key)?;
        }
        Ok(Some(rows))
    }

    /// Three angles, converted from degrees to radians.
    ///
    /// # Errors
    /// If it is not three numbers; `what` names them.
    pub fn three_angles(&self, key: &str, what: &str) -> Result<Option<[f64; 3]>, Fault> {
        match self.get::<Vec<f64>>(key)?.map(<[f64; 3]>::try_from) {
            None => Ok(None),
            Some(Ok(degrees)) => Ok(Some(degrees.map(f64::to_radians))),
            Some(Err(_)) => Err(Fault::unexpected(what).at(key)),
        }
    }

    /// The place of one of the words in their list.
    ///
    /// # Errors
    /// If it is absent or another word; `what` says which words there are.
    pub fn choice(&self, key: &str, what: &str, words: &[&str]) -> Result<usize, Fault> {
        let text: String = self.require(key, what)?;
        words.iter().position(|word| *word == text).ok_or_else(|| Fault::unexpected(what).at(key))
    }

    /// A text.
    ///
    /// # Errors
    /// If it is none.
    pub fn text(&self, key: &str) -> Result<Option<String>, Fault> {
        self.get(key)
    }

    /// `…_u_um`: a number for all coordinates or a list with one for each. Absent or 0 is known, `inf` is no prior.
    ///
    /// # Errors
    /// If it is neither, or negative.
    pub fn priors(&self, key: &str, count: usize) -> Result<Vec<Prior>, Fault> {
        let Some(node) = self.entries.get(key) else {
            return Ok(vec![Prior::Known; count]);
        };
        if !matches!(node.value, Value::List(_)) {
            return Ok(vec![from_node(node).and_then(prior).within(key)?; count]);
        }
        if count == 1 {
            return Err(Fault::unexpected("a number").at(key));
        }
        if node.items().len() != count {
            return Err(Fault::unexpected("a number or a list of three").at(key));
        }
        let items = node.items().iter().enumerate();
        items.map(|(item, node)| from_node(node).and_then(prior).within_item(item).within(key)).collect()
    }

    /// `…_u_arcsec` of three angles, as [`SetUpReader::priors`].
    ///
    /// # Errors
    /// As [`SetUpReader::priors`].
    pub fn angle_priors(&self, key: &str) -> Result<Vec<Prior>, Fault> {
        const ARCSECOND: f64 = std::f64::consts::PI / (180.0 * 3600.0);
        let in_mm = self.priors(key, 3)?.into_iter();
        Ok(in_mm
            .map(|prior| match prior {
                Prior::Gaussian(u) => Prior::Gaussian(u / MICROMETRE * ARCSECOND),
                other => other,
            })
            .collect())
    }

    /// Refuses two keys of which a test has at most one.
    ///
    /// # Errors
    /// If it has both.
    pub fn not_both(&self, first: &str, second: &str, help: &str) -> Result<(), Fault> {
        match (self.entries.get(first), self.entries.get(second)) {
            (Some(_), Some(_)) => {
                let message = format!("both `{first}` and `{second}`");
                Err(Fault::new(message, help).on_key().at(second))
            }
            _ => Ok(()),
        }
    }
}

/// A direction, normalised to unit length.
fn unit(vector: &Vector) -> Result<[f64; 3], Fault> {
    let length = vector.0.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length < 1e-9 { Err(Fault::is("zero")) } else { Ok(vector.0.map(|x| x / length)) }
}

fn prior(Uncertainty(u): Uncertainty) -> Result<Prior, Fault> {
    if u < 0.0 {
        let help = "0 means exactly known, `inf` means unknown";
        return Err(Fault::of_key(format!("is {}; an uncertainty cannot be negative", words::number(u)), help));
    }
    if let Some(fault) = limits::too_small_um(u) {
        return Err(Fault::of_key(format!("is {fault}"), "0 means exactly known"));
    }
    Ok(if u == 0.0 {
        Prior::Known
    } else if u.is_infinite() {
        Prior::Free
    } else {
        Prior::Gaussian(u * MICROMETRE)
    })
}

/// The points on the table and in the spindle of a ball bar or an R-test, and their priors.
pub(super) struct Balls {
    pub workpiece_ball: [Written; 3],
    pub spindle_ball: [Written; 3],
    pub priors: Vec<Prior>,
}

impl Balls {
    pub fn read(keys: &SetUpReader<'_>) -> Result<Balls, Fault> {
        let workpiece_ball =
            keys.point("workpiece_ball_mm", "the workpiece ball in the table frame, such as [0, 100, 0]")?;
        let spindle_ball = keys.point("spindle_ball_mm", "the spindle ball in the tool frame, such as [0, 0, 0]")?;
        let mut priors = keys.priors("workpiece_ball_u_um", 3)?;
        priors.extend(keys.priors("spindle_ball_u_um", 3)?);
        Ok(Balls { workpiece_ball, spindle_ball, priors })
    }
}
