//! Candidates that the search added and that are rejected by the held-out error.

use abbe_model::chain::Machine;

use super::{HeldOut, effect_name};
use crate::paired::HeldOutDecrease;
use crate::result::RejectedCandidate;
use crate::state::SearchState;

/// Candidates beyond the null distribution of the search that are rejected, because the held-out error does not
/// decrease by more than its standard error.
pub(super) fn candidates(
    machine: &Machine,
    search: &SearchState<'_>,
    held_out: &HeldOut<'_>,
) -> Vec<RejectedCandidate> {
    let rejected = search.rejected.iter().map(|rejected| {
        let (heldout_decrease_um, u_heldout_decrease_um) = held_out.decrease_um(rejected.decrease);
        RejectedCandidate {
            name: effect_name(machine, search.effect(rejected.selected.candidate)),
            p_value: rejected.selected.p_value,
            heldout_decrease_um,
            u_heldout_decrease_um,
        }
    });
    rejected.collect()
}

impl HeldOut<'_> {
    /// A decrease of the sum of squares as a decrease of the rms, with its standard error: `Δ(rms²) = 2 rms Δrms`.
    fn decrease_um(&self, fall: HeldOutDecrease) -> (f64, f64) {
        let by_um = |by: f64| {
            let squares_um = by / self.rows * self.scale_um * self.scale_um;
            squares_um / (2.0 * self.last_um()).max(f64::MIN_POSITIVE)
        };
        (by_um(fall.by), by_um(fall.standard_error))
    }
}
