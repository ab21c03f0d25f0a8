//! The products of many columns, formed over the states of their drivers.
//!
//! With `Z̃ = WᵀZ` ([`Adjoint`]), the products of all columns of a channel with `Z` are
//!
//! ```text
//! G(state) = Σ s(row) Z̃(row)  over the rows of a state,      Cᵀ Z = Bᵀ G
//! ```
//!
//! `G` needs one pass over the readings for each channel. The basis functions `B` of harmonics, periods, steps and
//! curves have one row for each state. Effects of other components share them, so that `G` of several channels is
//! multiplied at once.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

use super::states::{LocalStates, OwnProducts};
use crate::candidates::columns::{Adjoint, Channel, DriverStates, EffectColumns, TrainingRows};
use crate::numerics::parallel;

/// Columns that are copied and multiplied together: they fit into the second cache.
const CHUNK_COLUMNS: usize = 64;
/// Chunks of one task, for which the sums over states are formed once.
const CHUNKS_PER_TASK: usize = 6;
/// Largest number of entries of the sums over states of one task, if it has more than one channel.
const MAX_SUMS: usize = 500_000;
/// Largest number of entries of the sums of one channel that are kept for all tasks.
const MAX_KEPT: usize = 100_000;

/// The candidates of a segment by states, basis and channel.
pub(super) struct Layout {
    groups: Vec<Group>,
    /// First column of each candidate; the last entry is the number of columns.
    pub first: Vec<usize>,
    /// Start of each candidate's square of products; the last entry is their total length.
    pub square: Vec<usize>,
}

/// The channels that follow the same states, and the basis functions over these.
struct Group {
    states: Arc<DriverStates>,
    channels: Vec<Arc<Channel>>,
    chunks: Vec<Vec<Member>>,
}

/// Basis functions and the effects that have them: channel in the group, candidate in the segment.
struct Member {
    basis: Arc<Mat<f64>>,
    users: Vec<(usize, usize)>,
}

/// Products of the columns of a segment.
pub(super) struct Products {
    /// Vectors × columns.
    pub side: Mat<f64>,
    /// Each candidate with itself, square after square. Empty if not asked for.
    pub own: Vec<f64>,
}

/// One piece of work: some channels of a group, and some of its chunks.
struct Task {
    group: usize,
    channels: Range<usize>,
    chunks: Range<usize>,
}

impl Layout {
    /// Groups the candidates of a segment.
    pub fn of(sets: &[EffectColumns]) -> Layout {
        let mut first = vec![0];
        let mut square = vec![0];
        for set in sets {
            first.push(first[first.len() - 1] + set.count);
            square.push(square[square.len() - 1] + set.count * set.count);
        }
        let mut groups: Vec<Group> = Vec::new();
        let mut members: Vec<Vec<Member>> = Vec::new();
        let mut of_states: HashMap<usize, usize> = HashMap::new();
        let mut of_channel: HashMap<usize, usize> = HashMap::new();
        let mut of_basis: HashMap<(usize, usize), usize> = HashMap::new();
        for (candidate, set) in sets.iter().enumerate() {
            let states = &set.channel.states;
            let group = *of_states.entry(Arc::as_ptr(states) as usize).or_insert_with(|| {
                groups.push(Group { states: Arc::clone(states), channels: Vec::new(), chunks: Vec::new() });
                members.push(Vec::new());
                groups.len() - 1
            });
            let channels = &mut groups[group].channels;
            let channel = *of_channel.entry(Arc::as_ptr(&set.channel) as usize).or_insert_with(|| {
                channels.push(Arc::clone(&set.channel));
                channels.len() - 1
            });
            let members = &mut members[group];
            let member = *of_basis.entry((group, Arc::as_ptr(&set.basis) as usize)).or_insert_with(|| {
                members.push(Member { basis: Arc::clone(&set.basis), users: Vec::new() });
                members.len() - 1
            });
            members[member].users.push((channel, candidate));
        }
        for (group, members) in groups.iter_mut().zip(members) {
            let mut width = CHUNK_COLUMNS;
            for member in members {
                if width + member.basis.ncols() > CHUNK_COLUMNS {
                    group.chunks.push(Vec::new());
                    width = 0;
                }
                width += member.basis.ncols();
                if let Some(chunk) = group.chunks.last_mut() {
                    chunk.push(member);
                }
            }
        }
        Layout { groups, first, square }
    }

    /// Number of columns.
    pub fn total(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    /// The range of a candidate's columns.
    pub fn columns(&self, candidate: usize) -> Range<usize> {
        self.first[candidate]..self.first[candidate + 1]
    }

    /// The range of a candidate's square.
    pub fn squares(&self, candidate: usize) -> Range<usize> {
        self.square[candidate]..self.square[candidate + 1]
    }

    /// The products of all columns with some vectors and, if `with_own`, of each candidate with itself, over some
    /// whitened rows. `None` if `go_on` returns `false`.
    pub fn products(
        &self,
        training: &TrainingRows,
        side: &Adjoint,
        with_own: bool,
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<Products> {
        let vectors = side.values.nrows();
        let local =
            parallel::map(self.groups.len(), &|k| LocalStates::of(&self.groups[k].states, training, &side.rows));
        let kept: Vec<(usize, usize)> = (self.groups.iter().enumerate())
            .filter(|(k, _)| vectors * local[*k].count() <= MAX_KEPT)
            .flat_map(|(k, group)| (0..group.channels.len()).map(move |channel| (k, channel)))
            .collect();
        let kept_sums = parallel::map(kept.len(), &|k| {
            let (group, channel) = kept[k];
            local[group].gather(&self.groups[group].channels[channel], side)
        });
        let kept_sums: HashMap<(usize, usize), Mat<f64>> = kept.into_iter().zip(kept_sums).collect();
        let mut tasks = Vec::new();
        for (number, group) in self.groups.iter().enumerate() {
            let at_once = (MAX_SUMS / (vectors * local[number].count()).max(1)).clamp(1, group.channels.len().max(1));
            for first in (0..group.channels.len()).step_by(at_once) {
                for chunk in (0..group.chunks.len()).step_by(CHUNKS_PER_TASK) {
                    tasks.push(Task {
                        group: number,
                        channels: first..(first + at_once).min(group.channels.len()),
                        chunks: chunk..(chunk + CHUNKS_PER_TASK).min(group.chunks.len()),
                    });
                }
            }
        }
        let results = parallel::map(tasks.len(), &|k| {
            go_on().then(|| self.products_of(&tasks[k], &local[tasks[k].group], training, side, &kept_sums, with_own))
        });
        let mut products = Products {
            side: Mat::zeros(vectors, self.total()),
            own: vec![0.0; if with_own { self.square[self.square.len() - 1] } else { 0 }],
        };
        for (task, result) in tasks.iter().zip(results) {
            let (sums, own) = result?;
            let mut own = own.into_iter();
            let mut column = 0;
            for member in self.groups[task.group].chunks[task.chunks.clone()].iter().flatten() {
                for (channel, candidate) in member.users_of(&task.channels) {
                    let first = (channel - task.channels.start) * vectors;
                    for (k, to) in self.columns(candidate).enumerate() {
                        let from = &sums.col_as_slice(column + k)[first..first + vectors];
                        products.side.col_as_slice_mut(to).copy_from_slice(from);
                    }
                    if with_own {
                        products.own[self.squares(candidate)].iter_mut().zip(&mut own).for_each(|(to, own)| *to = own);
                    }
                }
                column += member.basis.ncols();
            }
        }
        Some(products)
    }

    /// The sums of a task (vectors of each channel × columns) and the squares of its candidates.
    fn products_of(
        &self,
        task: &Task,
        local: &LocalStates,
        training: &TrainingRows,
        side: &Adjoint,
        kept: &HashMap<(usize, usize), Mat<f64>>,
        with_own: bool,
    ) -> (Mat<f64>, Vec<f64>) {
        let group = &self.groups[task.group];
        let vectors = side.values.nrows();
        let channels = &group.channels[task.channels.clone()];
        let mut gathered = Mat::zeros(vectors * channels.len(), local.count());
        for (k, channel) in channels.iter().enumerate() {
            let mut to = gathered.as_mut().subrows_mut(k * vectors, vectors);
            match kept.get(&(task.group, task.channels.start + k)) {
                Some(sums) => to.copy_from(sums),
                None => to.copy_from(&local.gather(channel, side)),
            }
        }
        let chunks = &group.chunks[task.chunks.clone()];
        let width = |chunk: &[Member]| -> usize { chunk.iter().map(|member| member.basis.ncols()).sum() };
        let mut sums = Mat::zeros(gathered.nrows(), chunks.iter().map(|chunk| width(chunk)).sum());
        let own: Vec<OwnProducts<'_>> = if with_own {
            channels.iter().map(|channel| OwnProducts::of(channel, local, training)).collect()
        } else {
            Vec::new()
        };
        let mut squares = Vec::new();
        let mut basis = Mat::zeros(local.count(), chunks.iter().map(|chunk| width(chunk)).max().unwrap_or(0));
        let mut column = 0;
        for chunk in chunks {
            let mut next = 0;
            for member in chunk {
                for k in 0..member.basis.ncols() {
                    local.copy(member.basis.col_as_slice(k), basis.col_as_slice_mut(next + k));
                }
                if with_own {
                    let part = basis.as_ref().subcols(next, member.basis.ncols());
                    for (channel, _) in member.users_of(&task.channels) {
                        own[channel - task.channels.start].append(part, &member.basis, &mut squares);
                    }
                }
                next += member.basis.ncols();
            }
            let to = sums.as_mut().subcols_mut(column, next);
            matmul(to, Accum::Replace, gathered.as_ref(), basis.as_ref().subcols(0, next), 1.0, Par::Seq);
            column += next;
        }
        (sums, squares)
    }
}

impl Member {
    fn users_of(&self, channels: &Range<usize>) -> impl Iterator<Item = (usize, usize)> {
        self.users.iter().copied().filter(|(channel, _)| channels.contains(channel))
    }
}
