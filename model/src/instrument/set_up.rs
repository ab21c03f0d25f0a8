//! The set-up of an instrument in files: the keys of a test that only some instruments have, and how they are read.

use super::Station;
use crate::error::ModelError;
use crate::session::Prior;
use crate::session::expression::Length;

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

/// Reads the keys of a set-up. Errors point at the place in the file; `what` says what to add if a required key is
/// absent.
pub trait SetUpReader {
    /// A length above zero.
    ///
    /// # Errors
    /// If it is absent, no length or not above zero.
    fn positive_length(&mut self, key: &'static str, what: &str) -> Result<Written, ModelError>;
    /// A point.
    ///
    /// # Errors
    /// If it is absent or not three lengths.
    fn point(&mut self, key: &'static str, what: &str) -> Result<[Written; 3], ModelError>;
    /// A point that need not be stated.
    ///
    /// # Errors
    /// If it is not three lengths.
    fn stated_point(&mut self, key: &'static str) -> Result<Option<[Written; 3]>, ModelError>;
    /// A direction of three numbers, normalised to unit length.
    ///
    /// # Errors
    /// If it is not three numbers, or zero.
    fn direction(&mut self, key: &'static str) -> Result<Option<[f64; 3]>, ModelError>;
    /// Three directions, normalised to unit length.
    ///
    /// # Errors
    /// As [`SetUpReader::direction`].
    fn three_directions(&mut self, key: &'static str) -> Result<Option<[[f64; 3]; 3]>, ModelError>;
    /// Three angles, converted from degrees to radians.
    ///
    /// # Errors
    /// If it is not three numbers; `what` names them.
    fn three_angles(&mut self, key: &'static str, what: &str) -> Result<Option<[f64; 3]>, ModelError>;
    /// The place of one of two words in the list.
    ///
    /// # Errors
    /// If it is absent or another word; `what` says which words there are.
    fn choice(&mut self, key: &'static str, what: &str, words: &[&str]) -> Result<usize, ModelError>;
    /// A text.
    ///
    /// # Errors
    /// If it is none.
    fn text(&mut self, key: &'static str) -> Result<Option<String>, ModelError>;
    /// `…_u_um`: a number for all coordinates or a list with one for each. Absent or 0 is known, `inf` is no prior.
    ///
    /// # Errors
    /// If it is neither, or negative.
    fn priors(&mut self, key: &'static str, count: usize) -> Result<Vec<Prior>, ModelError>;
    /// `…_u_arcsec` of three angles, as [`SetUpReader::priors`].
    ///
    /// # Errors
    /// As [`SetUpReader::priors`].
    fn angle_priors(&mut self, key: &'static str) -> Result<Vec<Prior>, ModelError>;
    /// Refuses two keys of which a test has at most one.
    ///
    /// # Errors
    /// If it has both.
    fn not_both(&mut self, first: &'static str, second: &'static str, help: &str) -> Result<(), ModelError>;
    /// The error that the value of a key that was read is invalid.
    fn fault(&self, key: &'static str, message: String, help: &str) -> ModelError;
}

/// The points on the table and in the spindle of a ball bar or an R-test, and their priors.
pub(super) struct Balls {
    pub workpiece_ball: [Written; 3],
    pub spindle_ball: [Written; 3],
    pub priors: Vec<Prior>,
}

impl Balls {
    pub fn read(keys: &mut dyn SetUpReader) -> Result<Balls, ModelError> {
        let workpiece_ball =
            keys.point("workpiece_ball_mm", "the workpiece ball in the table frame, such as [0, 100, 0]")?;
        let spindle_ball = keys.point("spindle_ball_mm", "the spindle ball in the tool frame, such as [0, 0, 0]")?;
        let mut priors = keys.priors("workpiece_ball_u_um", 3)?;
        priors.extend(keys.priors("spindle_ball_u_um", 3)?);
        Ok(Balls { workpiece_ball, spindle_ball, priors })
    }
}
