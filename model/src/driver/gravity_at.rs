//! `gravity-J4`: as `gravity`, with the weight at the origin of the axis J4.
//!
//! The weight of a link acts between the joints at its ends. Its moment about an axis is a sum of the moments of weights at
//! these joints, so the weights of all links and of the load are those at the origins of the joints and at the tool point
//! (`gravity`).

use super::Driver;
use super::gravity::METRE;
use super::kind::Entry;

/// Begins the word in files; the name of the axis follows.
const PREFIX: &str = "gravity-";

pub(super) const ENTRY: Entry =
    Entry { word: None, driver: |word| Driver::GravityAt(named(word).unwrap_or(word).to_string()), units: &[METRE] };

/// The axis that a word names; `None` for the word of another driver.
pub(super) fn named(word: &str) -> Option<&str> {
    word.strip_prefix(PREFIX).filter(|name| !name.is_empty())
}

/// The word of the driver in files.
pub(super) fn word(axis: &str) -> String {
    format!("{PREFIX}{axis}")
}
