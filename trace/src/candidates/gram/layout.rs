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

use abbe_identify::numerics::parallel;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

use super::states::{LocalStates, OwnProducts};
use crate::candidates::columns::{Adjoint, Channel, DriverStates, EffectColumns, TrainingRows};

/// Columns that are copied and multiplied together: they fit into the second cache.
const CHUNK_COLUMNS: usize = 64;
/// Chunks of one task, for which the sums over states are formed once.
const CHUNKS_PER_TASK: usize = 12;
/// States whose sums are formed and multiplied together.
const STATES_AT_ONCE: usize = 256;
/// Largest number of vectors of one task over all its channels, if it has more than one channel.
const MAX_VECTORS: usize = 512;
/// Smallest number of states of a task, if it has not all. With more, a long session has enough tasks for all processors.
const MIN_STATES_PER_TASK: usize = 4096;
/// Largest number of tasks among which the states are shared. Each holds the sums of its columns.
const MAX_PIECES: usize = 8;

/// Least number of vectors for which readings of equal sensitivities are sought.
const MIN_VECTORS_OF_REPEATS: usize = 16;

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
    basis: Arc<Mat<f32>>,
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
    work: Work,
}

/// What a task forms.
enum Work {
    /// The products with the vectors, summed over some states.
    Sums(Range<usize>),
    /// The products of each candidate with itself.
    Squares,
}

/// What a task has formed.
enum Formed {
    /// Vectors of each channel × columns.
    Sums(Mat<f64>),
    /// Square after square.
    Squares(Vec<f64>),
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

    /// The states of each group in some whitened rows, which combine the scalar readings `rows`, for products with so many
    /// vectors.
    pub fn places(&self, training: &TrainingRows, rows: &[(u32, u32)], vectors: usize) -> Vec<LocalStates> {
        parallel::map(self.groups.len(), &|k| {
            let Group { states, channels, .. } = &self.groups[k];
            let mut local = LocalStates::of(states, training, rows);
            if vectors >= MIN_VECTORS_OF_REPEATS {
                local.find_repeats(channels, rows);
            }
            local
        })
    }

    /// The products of all columns with some vectors and, if `with_own`, of each candidate with itself, over some
    /// whitened rows. `None` if `should_continue` returns `false`.
    pub fn products<T: Copy + Into<f64> + Sync>(
        &self,
        training: &TrainingRows,
        side: &Adjoint<T>,
        with_own: bool,
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Option<Products> {
        let places = self.places(training, &side.rows, side.values.nrows());
        self.products_at(&places, training, side, with_own, should_continue)
    }

    /// The same at known [`Layout::places`].
    pub fn products_at<T: Copy + Into<f64> + Sync>(
        &self,
        local: &[LocalStates],
        training: &TrainingRows,
        side: &Adjoint<T>,
        with_own: bool,
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Option<Products> {
        let vectors = side.values.nrows();
        let mut tasks = Vec::new();
        for (number, group) in self.groups.iter().enumerate() {
            let at_once = (MAX_VECTORS / vectors.max(1)).max(1);
            for first in (0..group.channels.len()).step_by(at_once) {
                for chunk in (0..group.chunks.len()).step_by(CHUNKS_PER_TASK) {
                    let task = |work: Work| Task {
                        group: number,
                        channels: first..(first + at_once).min(group.channels.len()),
                        chunks: chunk..(chunk + CHUNKS_PER_TASK).min(group.chunks.len()),
                        work,
                    };
                    let states = local[number].count();
                    let piece = states.div_ceil(MAX_PIECES).max(MIN_STATES_PER_TASK);
                    let pieces = (0..states).step_by(piece).map(|first| first..(first + piece).min(states));
                    tasks.extend(pieces.map(|states| task(Work::Sums(states))));
                    if with_own {
                        tasks.push(task(Work::Squares));
                    }
                }
            }
        }
        let formed = |k: usize| {
            should_continue().then(|| {
                let local = &local[tasks[k].group];
                match &tasks[k].work {
                    Work::Sums(states) => Formed::Sums(self.sums_of(&tasks[k], local, states, side)),
                    Work::Squares => Formed::Squares(self.squares_of(&tasks[k], local, training)),
                }
            })
        };
        let mut products = Products {
            side: Mat::zeros(vectors, self.total()),
            own: vec![0.0; if with_own { self.square[self.square.len() - 1] } else { 0 }],
        };
        let mut is_complete = true;
        parallel::in_order(tasks.len(), &formed, &mut |k, formed| match formed {
            Some(formed) => self.add(&tasks[k], formed, &mut products),
            None => is_complete = false,
        });
        is_complete.then_some(products)
    }

    /// Adds what a task has formed.
    fn add(&self, task: &Task, formed: Formed, products: &mut Products) {
        let vectors = products.side.nrows();
        let members = self.groups[task.group].chunks[task.chunks.clone()].iter().flatten();
        match formed {
            Formed::Sums(sums) => {
                let mut column = 0;
                for member in members {
                    for (channel, candidate) in member.users_of(&task.channels) {
                        let first = (channel - task.channels.start) * vectors;
                        for (k, to) in self.columns(candidate).enumerate() {
                            let from = &sums.col_as_slice(column + k)[first..first + vectors];
                            let to = products.side.col_as_slice_mut(to);
                            to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
                        }
                    }
                    column += member.basis.ncols();
                }
            }
            Formed::Squares(squares) => {
                let mut squares = squares.into_iter();
                for (_, candidate) in members.flat_map(|member| member.users_of(&task.channels)) {
                    let to = products.own[self.squares(candidate)].iter_mut();
                    to.zip(&mut squares).for_each(|(to, square)| *to = square);
                }
            }
        }
    }

    /// The products of the columns of a task with the vectors over some states: vectors of each channel × columns.
    fn sums_of<T: Copy + Into<f64>>(
        &self,
        task: &Task,
        local: &LocalStates,
        states: &Range<usize>,
        side: &Adjoint<T>,
    ) -> Mat<f64> {
        let group = &self.groups[task.group];
        let vectors = side.values.nrows();
        let channels = &group.channels[task.channels.clone()];
        let chunks = &group.chunks[task.chunks.clone()];
        let widths: Vec<usize> =
            chunks.iter().map(|chunk| chunk.iter().map(|member| member.basis.ncols()).sum()).collect();
        let mut sums = Mat::zeros(vectors * channels.len(), widths.iter().sum());
        let at_once = STATES_AT_ONCE.min(states.len());
        let mut gathered = Mat::zeros(sums.nrows(), at_once);
        let mut basis = Mat::zeros(at_once, widths.iter().copied().max().unwrap_or(0));
        for first in states.clone().step_by(at_once.max(1)) {
            let states = first..(first + at_once).min(states.end);
            local.gather(states.clone(), channels, side, gathered.as_mut().subcols_mut(0, states.len()));
            let gathered = gathered.as_ref().subcols(0, states.len());
            let mut column = 0;
            for (chunk, width) in chunks.iter().zip(&widths) {
                let columns =
                    chunk.iter().flat_map(|member| (0..member.basis.ncols()).map(|k| member.basis.col_as_slice(k)));
                for (k, from) in columns.enumerate() {
                    local.copy(states.clone(), from, basis.col_as_slice_mut(k));
                }
                let to = sums.as_mut().subcols_mut(column, *width);
                let basis = basis.as_ref().submatrix(0, 0, states.len(), *width);
                matmul(to, Accum::Add, gathered, basis, 1.0, Par::Seq);
                column += width;
            }
        }
        sums
    }

    /// The products with themselves of the candidates of a task.
    fn squares_of(&self, task: &Task, local: &LocalStates, training: &TrainingRows) -> Vec<f64> {
        let group = &self.groups[task.group];
        let channels = &group.channels[task.channels.clone()];
        let own: Vec<OwnProducts<'_>> =
            channels.iter().map(|channel| OwnProducts::of(channel, local, training)).collect();
        let mut squares = Vec::new();
        let mut basis = Mat::zeros(0, 0);
        for member in group.chunks[task.chunks.clone()].iter().flatten() {
            let count = member.basis.ncols();
            basis.resize_with(local.count(), basis.ncols().max(count), |_, _| 0.0);
            for k in 0..count {
                local.copy(0..local.count(), member.basis.col_as_slice(k), basis.col_as_slice_mut(k));
            }
            for (channel, _) in member.users_of(&task.channels) {
                let own = &own[channel - task.channels.start];
                own.append(basis.as_ref().subcols(0, count), &member.basis, &mut squares);
            }
        }
        squares
    }
}

impl Member {
    fn users_of(&self, channels: &Range<usize>) -> impl Iterator<Item = (usize, usize)> {
        self.users.iter().copied().filter(|(channel, _)| channels.contains(channel))
    }
}
