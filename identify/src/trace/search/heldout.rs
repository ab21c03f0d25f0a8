//! The held-out error: each fold, as it was read, under the model of the search that did not see it. Effects are claimed only where it falls by more than
//! the standard error of the fall.

use faer::Mat;
use rayon::prelude::*;

use super::{ALL, Search, SearchBranch, SelectedEffect};
use crate::error::IdentifyError;
use crate::trace::moments::grow;
use crate::trace::paired::{HeldOutDecrease, Units};
use crate::trace::score::TrainedModel;

/// Readings as they are, not whitened: what held-out errors are of. In units of the noise.
pub struct Plain {
    /// The base: rows × columns, extended as candidates are added.
    pub base: Mat<f64>,
    /// The residual.
    pub residual: Vec<f64>,
    /// The fold of each row.
    pub folds: Vec<usize>,
    /// What held-out errors are paired over.
    pub units: Units,
    /// Standard deviation of a reading, mm.
    pub sigma_mm: f64,
}

impl Plain {
    /// Adds base columns in mm, which the base has divided by these norms.
    pub(super) fn extend(&mut self, rows: &Mat<f64>, norms: &[f64]) {
        let old = self.base.ncols();
        let sigma_mm = self.sigma_mm;
        grow(&mut self.base, rows.nrows(), old + rows.ncols(), |i, j| {
            let norm = norms[j - old];
            if norm > 0.0 {
                rows[(i, j - old)] / (norm * sigma_mm)
            } else {
                0.0
            }
        });
    }
}

/// What the searches have added and what that leaves on held-out readings.
#[derive(Clone, Debug, Default)]
pub struct HeldOutState {
    /// The effects of every search.
    tracks: Vec<SearchBranch>,
    /// [`Search::held_out`].
    held_out: Vec<f64>,
    /// Sums of squares of held-out residuals over the variance of the noise, by unit.
    units: Vec<f64>,
}

impl HeldOutState {
    fn effects(&self) -> &[SelectedEffect] {
        self.tracks.first().map_or(&[], |all| &all.taken)
    }
}

/// An effect that scores better than readings without structure, and that was not claimed.
#[derive(Clone, Copy, Debug)]
pub struct RejectedByHeldOut {
    /// The effect.
    pub taken: SelectedEffect,
    /// What it did to the held-out error.
    pub fall: HeldOutDecrease,
}

impl Search<'_> {
    /// Sums of squares of held-out residuals over the variance of the noise, by unit: each fold under the model of the search that did not see it.
    fn held_out_by_unit(&self) -> Result<Vec<f64>, IdentifyError> {
        let models: Vec<TrainedModel<'_>> = self.tracks[ALL + 1..]
            .par_iter()
            .map(|track| self.lean_model_of(&track.chosen(), &track.folds))
            .collect::<Result<_, _>>()?;
        let predicted = |model: &TrainedModel<'_>, row: usize| -> f64 {
            let along = model.base.iter().zip(&model.coefficients);
            along.map(|(column, c)| self.plain.base[(row, *column)] * c).sum()
        };
        let squares = self.plain.folds.iter().enumerate();
        let squares =
            squares.map(|(row, fold)| (self.plain.residual[row] - predicted(&models[*fold], row)).powi(2));
        Ok(self.plain.units.sums(squares))
    }

    /// Sum of squares of held-out residuals over the variance of the noise.
    pub(super) fn held_out_now(&self) -> Result<f64, IdentifyError> {
        Ok(self.held_out_by_unit()?.iter().sum())
    }

    /// Writes down the held-out error with as many effects as there are now.
    pub(in crate::trace) fn note_held_out(&mut self) -> Result<(), IdentifyError> {
        self.units_now = self.held_out_by_unit()?;
        let held_out = self.units_now.iter().sum();
        let taken = self.taken().len();
        self.held_out.truncate(taken);
        self.held_out.resize(taken + 1, held_out);
        Ok(())
    }

    /// What the searches have added now.
    pub(super) fn standing(&self) -> HeldOutState {
        HeldOutState {
            tracks: self.tracks.clone(),
            held_out: self.held_out.clone(),
            units: self.units_now.clone(),
        }
    }

    /// Claims what the searches have added, if the held-out error says so: with more effects than are claimed it has to fall by more than the standard error of
    /// the fall, with as many or fewer it must not rise by more than that. Returns whether all that was added is claimed.
    pub(in crate::trace) fn claim(&mut self) -> bool {
        let fall = self.fall_since_claimed();
        let added = self.taken().len() > self.claimed.effects().len();
        let claimed = if added {
            fall.is_significant()
        } else {
            !fall.is_increase() && self.lowers_heldout_error()
        };
        if claimed {
            self.claimed = self.standing();
            let claimed: Vec<usize> = self.tracks[ALL].chosen();
            self.unclaimed
                .retain(|unclaimed| !claimed.contains(&unclaimed.taken.candidate));
        }
        claimed
    }

    /// How far the held-out error has fallen since effects were claimed last.
    pub(in crate::trace) fn fall_since_claimed(&self) -> HeldOutDecrease {
        self.plain.units.decrease(&self.claimed.units, &self.units_now)
    }

    /// How far the held-out error is below that of the declared model.
    pub(in crate::trace) fn fall_since_declared(&self) -> HeldOutDecrease {
        self.plain.units.decrease(&self.declared_units, &self.units_now)
    }

    /// Whether nothing was added, or the held-out error is below that of the declared model by more than the standard error of the fall.
    fn lowers_heldout_error(&self) -> bool {
        self.taken().is_empty() || self.fall_since_declared().is_significant()
    }

    /// Withdraws what was added since effects were claimed last, and remembers it as not claimed.
    pub(in crate::trace) fn withdraw_unclaimed(&mut self) {
        let fall = self.fall_since_claimed();
        let claimed: Vec<usize> = self
            .claimed
            .effects()
            .iter()
            .map(|taken| taken.candidate)
            .collect();
        for taken in self.tracks[ALL].taken.clone() {
            let known = self
                .unclaimed
                .iter()
                .any(|u| u.taken.candidate == taken.candidate);
            if !claimed.contains(&taken.candidate) && !known {
                self.unclaimed.push(RejectedByHeldOut { taken, fall });
            }
        }
        self.restore();
    }

    /// Goes back to what is claimed, where an interruption has left a round half done. From then on nothing interrupts.
    pub(in crate::trace) fn roll_back(&mut self) {
        self.restore();
        self.interrupt = None;
    }

    fn restore(&mut self) {
        let HeldOutState {
            tracks,
            held_out,
            units,
        } = self.claimed.clone();
        self.tracks = tracks;
        self.held_out = held_out;
        self.units_now = units;
    }

    /// Withdraws all effects where together they do not lower the held-out error of the declared model by more than the standard error of the fall.
    pub(in crate::trace) fn withdraw_all_unless_better(&mut self) -> Result<(), IdentifyError> {
        if !self.lowers_heldout_error() {
            self.claimed = HeldOutState::default();
            self.claimed.tracks = self.tracks.clone();
            self.claimed
                .tracks
                .iter_mut()
                .for_each(|track| track.taken.clear());
            self.claimed.held_out = self.held_out[..1].to_vec();
            self.claimed.units = self.declared_units.clone();
            self.withdraw_unclaimed();
        }
        self.claimed = self.standing();
        Ok(())
    }
}
