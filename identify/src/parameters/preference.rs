//! The rank over the parameters of a session, and the order of preference of the pivots of its null space.

use abbe_model::Diagnostic;
use abbe_model::parameter_id::ParameterId;

use super::{Parameter, Parameters};
use crate::numerics::rank::Rank;
use crate::numerics::tolerances::MIN_IDENTIFIABLE;
use crate::numerics::triangle::Triangle;

impl Parameters {
    /// The physical size of every parameter, internal units.
    pub fn sizes(&self) -> Vec<f64> {
        self.list.iter().map(|parameter| parameter.size).collect()
    }

    /// The rank of a whitened factor over these parameters, in the gauge in which the set-up takes its part first.
    ///
    /// # Errors
    /// If the factor has entries that are not finite.
    pub fn rank(&self, triangle: &Triangle) -> Result<Rank, Diagnostic> {
        self.rank_above(triangle, (MIN_IDENTIFIABLE, 0))
    }

    /// The same with another least singular value of an identifiable direction, and with at least so many of these.
    ///
    /// # Errors
    /// If the factor has entries that are not finite.
    pub fn rank_above(&self, triangle: &Triangle, least: (f64, usize)) -> Result<Rank, Diagnostic> {
        let is_set_up: Vec<bool> = self.list.iter().map(|parameter| parameter.id.is_setup()).collect();
        let sizes = self.sizes();
        Rank::decide_above(triangle, &sizes, &pivot_preference(&self.list), least)?
            .with_set_up_first(&is_set_up, &sizes)
    }
}

/// The order in which parameters are preferred as pivots of null-space combinations (see
/// [`crate::numerics::rank`]). The pivot comes first in its combination. Holding the pivots at nominal makes the other
/// parameters identifiable.
///
/// Location errors come first, coefficients of effects next, set-up quantities last. A combination thus states what one
/// machine error is confounded with, and an error that is confounded with the set-up is stated in terms of the set-up.
/// Within each kind the order is that of the identifiers, with numbers compared by value (`EA0J2` before `EA0J10`). The
/// order of declarations has no effect.
pub fn pivot_preference(list: &[Parameter]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..list.len()).collect();
    order.sort_by_cached_key(|j| (kind(&list[*j].id), natural(&list[*j].id.to_string())));
    order
}

/// The place of its kind in the order: errors, effects, the set-up.
pub(crate) fn kind(id: &ParameterId) -> usize {
    match id {
        ParameterId::Error(_) => 0,
        ParameterId::Effect(..) => 1,
        ParameterId::Setup { .. } => 2,
    }
}

/// Splits an identifier into pieces for natural sorting: text compares as text, digits as a number.
pub fn natural(id: &str) -> Vec<(u64, String)> {
    let mut pieces: Vec<(u64, String)> = Vec::new();
    let mut rest = id;
    while let Some(first) = rest.chars().next() {
        let digits = first.is_ascii_digit();
        let end = rest.find(|c: char| c.is_ascii_digit() != digits).unwrap_or(rest.len());
        let (piece, after) = rest.split_at(end);
        pieces.push((if digits { piece.parse().unwrap_or(u64::MAX) } else { 0 }, piece.to_string()));
        rest = after;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use abbe_model::session::Prior;
    use abbe_model::unit::InternalUnit;

    use super::*;

    #[test]
    fn pivots_are_preferred_by_kind_and_name_and_not_by_declaration() {
        let parameter = |id: &str| Parameter {
            id: id.parse().unwrap(),
            unit: InternalUnit::Millimetre.displayed().into(),
            size: 1.0,
            prior: Prior::Free,
            effect: None,
            index: 0,
            found: 0.0,
        };
        let ids = ["bar[A]", "EX0J10", "EX0J2", "EZC~C:h2.sin", "EA0J2", "EZC~C:h2.cos"];
        let mut list: Vec<Parameter> = ids.into_iter().map(parameter).collect();
        let wanted = ["EA0J2", "EX0J2", "EX0J10", "EZC~C:h2.cos", "EZC~C:h2.sin", "bar[A]"];
        for _ in 0..list.len() {
            list.rotate_left(1);
            let names: Vec<String> = pivot_preference(&list).iter().map(|j| list[*j].id.to_string()).collect();
            assert_eq!(names, wanted);
        }
    }
}
