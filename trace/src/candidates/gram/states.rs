//! Sums over the states of a driver: of the readings of some rows, and of the products of a column with itself.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use pulp::NullaryFnOnce;

use crate::candidates::columns::{Adjoint, Channel, DriverStates, SensitivityValues, TrainingRows};

/// Largest distance of two states whose readings one whitened row combines. Beyond it the rows are multiplied.
const MAX_BAND: usize = 32;
const NONE: u32 = u32::MAX;
/// An odd number without a pattern in its bits (2⁶⁴ over the golden ratio), for keys of sensitivities.
const MIXING: u64 = 0x9e37_79b9_7f4a_7c15;

/// The states that occur in some rows.
pub(super) struct LocalStates {
    /// The states, ascending.
    states: Vec<u32>,
    /// The index among these of each state.
    place: Vec<u32>,
    /// The scalar readings that the rows combine, by state: those of state `k` are `by_state[ends[k - 1]..ends[k]]`.
    by_state: Vec<u32>,
    ends: Vec<usize>,
    /// Readings of a state with equal sensitivities, if they were sought and are many.
    repeats: Option<Repeats>,
    /// The largest distance of two states that one whitened row combines.
    band: usize,
}

/// The readings of each state in sets of equal sensitivities in all channels of a group. Their sum is formed before it is
/// multiplied with the sensitivities: a sweep is mostly repeated over the same positions.
struct Repeats {
    /// The end of each set in `by_state`.
    ends: Vec<u32>,
    /// For each state the number of sets up to it.
    of_states: Vec<u32>,
}

/// Least number of readings of a set, on average.
const MIN_REPEATS: usize = 2;

impl LocalStates {
    /// Of some whitened rows. `rows` are the scalar readings that they combine.
    pub fn of(states: &DriverStates, training: &TrainingRows, rows: &[(u32, u32)]) -> LocalStates {
        let mut place = vec![NONE; states.samples.len()];
        let state_of = |(test, scalar): &(u32, u32)| {
            let (test, scalar) = (*test as usize, *scalar as usize);
            states.acts_in(test).then(|| states.of_scalar(test, scalar, training.channels[test]))
        };
        for state in rows.iter().filter_map(state_of) {
            place[state] = 0;
        }
        let mut present = Vec::new();
        for (state, place) in place.iter_mut().enumerate().filter(|(_, place)| **place != NONE) {
            *place = present.len() as u32;
            present.push(state as u32);
        }
        let of_rows: Vec<u32> = rows.iter().map(|row| state_of(row).map_or(NONE, |state| place[state])).collect();
        let mut ends = vec![0; present.len() + 1];
        of_rows.iter().filter(|place| **place != NONE).for_each(|place| ends[*place as usize + 1] += 1);
        (1..ends.len()).for_each(|k| ends[k] += ends[k - 1]);
        let mut next = ends.clone();
        let mut by_state = vec![0; ends[present.len()]];
        for (row, place) in of_rows.iter().enumerate().filter(|(_, place)| **place != NONE) {
            by_state[next[*place as usize]] = row as u32;
            next[*place as usize] += 1;
        }
        ends.remove(0);
        let mut local = LocalStates { states: present, place, by_state, ends, repeats: None, band: 0 };
        if training.filter.is_pointwise() {
            return local;
        }
        for block in training.blocks.iter().filter(|block| states.acts_in(block.test)) {
            for (i, _) in block.iter() {
                let places = training.filter.terms(i).map(|(raw, _)| {
                    local.place_of(states, block.test, block.start + raw, training.channels[block.test])
                });
                let (low, high) = places.fold((usize::MAX, 0), |(low, high), p| (low.min(p), high.max(p)));
                local.band = local.band.max(high - low);
            }
        }
        local
    }

    /// Seeks the readings of each state that have the same sensitivities in all of some channels, and puts them one after
    /// another. `rows` are the scalar readings.
    pub fn find_repeats(&mut self, channels: &[Arc<Channel>], rows: &[(u32, u32)]) {
        let most = self.by_state.len() / MIN_REPEATS;
        if self.count() > most {
            return;
        }
        let sensitivities = Sensitivities::of(channels);
        let of_row = |row: u32| {
            let (test, scalar) = rows[row as usize];
            sensitivities.of_test(test).iter().map(move |values| values.at(scalar as usize).to_bits())
        };
        let mut firsts: Vec<u32> = Vec::new();
        let mut known: HashMap<u64, u32> = HashMap::new();
        let mut of_states = Vec::with_capacity(self.ends.len());
        let mut set_of = vec![0; self.by_state.len()];
        let mut start = 0;
        for (state, end) in self.ends.iter().enumerate() {
            let of_before = firsts.len();
            for place in start..*end {
                let row = self.by_state[place];
                let mixed = |key: u64, bits: u64| (key.rotate_left(23) ^ bits).wrapping_mul(MIXING);
                let set = *known.entry(of_row(row).fold(state as u64, mixed)).or_insert(firsts.len() as u32) as usize;
                // Other readings with the same key are sets of their own.
                let same = firsts.get(set).filter(|_| set >= of_before);
                let is_equal = same.is_some_and(|first| of_row(*first).eq(of_row(row)));
                set_of[place] = if is_equal { set as u32 } else { firsts.len() as u32 };
                if !is_equal {
                    firsts.push(row);
                }
            }
            if firsts.len() > most {
                return;
            }
            of_states.push(firsts.len() as u32);
            start = *end;
        }
        let mut ends = vec![0_u32; firsts.len()];
        set_of.iter().for_each(|set| ends[*set as usize] += 1);
        (1..ends.len()).for_each(|k| ends[k] += ends[k - 1]);
        // From the last reading back: the end of a set becomes its start.
        let mut places = ends.clone();
        let mut by_state = vec![0; self.by_state.len()];
        for (row, set) in self.by_state.iter().zip(&set_of).rev() {
            places[*set as usize] -= 1;
            by_state[places[*set as usize] as usize] = *row;
        }
        self.by_state = by_state;
        self.repeats = Some(Repeats { ends, of_states });
    }

    /// The index among these states of that of a scalar reading.
    fn place_of(&self, states: &DriverStates, test: usize, scalar: usize, channels: usize) -> usize {
        self.place[states.of_scalar(test, scalar, channels)] as usize
    }

    /// Number of these states.
    pub fn count(&self) -> usize {
        self.states.len()
    }

    /// Copies the entries of a basis function at some of these states.
    pub fn copy<T: Copy + Into<f64>>(&self, states: Range<usize>, from: &[T], to: &mut [f64]) {
        // Mostly all states occur, and every piece of them is a piece of the basis function.
        if let [first, .., last] = self.states[states.clone()]
            && (last - first) as usize + 1 == states.len()
        {
            to.iter_mut().zip(&from[first as usize..=last as usize]).for_each(|(to, from)| *to = (*from).into());
            return;
        }
        to.iter_mut().zip(&self.states[states]).for_each(|(to, state)| *to = from[*state as usize].into());
    }

    /// Sums `s · z` of some channels over the readings of each of some states: vectors of one channel after another ×
    /// states.
    pub fn gather<T: Copy + Into<f64>>(
        &self,
        states: Range<usize>,
        channels: &[Arc<Channel>],
        side: &Adjoint<T>,
        sums: MatMut<'_, f64>,
    ) {
        pulp::Arch::new().dispatch(Gathering { local: self, states, channels, side, sums });
    }
}

/// Sums over the readings of each state, compiled for each vector instruction set that the processor may have.
struct Gathering<'g, T> {
    local: &'g LocalStates,
    states: Range<usize>,
    channels: &'g [Arc<Channel>],
    side: &'g Adjoint<T>,
    sums: MatMut<'g, f64>,
}

impl<T: Copy + Into<f64>> NullaryFnOnce for Gathering<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Gathering { local, states, channels, side, mut sums } = self;
        let vectors = side.values.nrows();
        let sensitivities = Sensitivities::of(channels);
        let mut total = vec![0.0; vectors];
        sums.fill(0.0);
        for (state, to) in states.zip(sums.col_iter_mut()) {
            let Some(to) = to.try_as_col_major_mut() else { continue };
            let to = to.as_slice_mut();
            match &local.repeats {
                None => {
                    let start = if state == 0 { 0 } else { local.ends[state - 1] };
                    for row in &local.by_state[start..local.ends[state]] {
                        let values = side.values.col_as_slice(*row as usize);
                        sensitivities.add(side.rows[*row as usize], values, to);
                    }
                }
                Some(repeats) => {
                    for rows in repeats.of(state).map(|range| &local.by_state[range]) {
                        total.fill(0.0);
                        rows.iter()
                            .for_each(|row| add_multiple(&mut total, 1.0, side.values.col_as_slice(*row as usize)));
                        sensitivities.add(side.rows[rows[0] as usize], &total, to);
                    }
                }
            }
        }
    }
}

impl Repeats {
    /// The sets of a state, as ranges of the readings by state.
    fn of(&self, state: usize) -> impl Iterator<Item = Range<usize>> {
        let first = if state == 0 { 0 } else { self.of_states[state - 1] as usize };
        (first..self.of_states[state] as usize).map(|set| {
            let start = if set == 0 { 0 } else { self.ends[set - 1] };
            start as usize..self.ends[set] as usize
        })
    }
}

/// The sensitivities of some channels, by test.
struct Sensitivities<'c>(Vec<Vec<SensitivityValues<'c>>>);

impl<'c> Sensitivities<'c> {
    fn of(channels: &'c [Arc<Channel>]) -> Sensitivities<'c> {
        let tests = channels.first().map_or(0, |channel| channel.sensitivity.len());
        let of_test = |test: usize| channels.iter().map(|channel| channel.sensitivity[test].values()).collect();
        Sensitivities((0..tests).map(of_test).collect())
    }

    fn of_test(&self, test: u32) -> &[SensitivityValues<'c>] {
        &self.0[test as usize]
    }

    /// Adds values at a scalar reading times the sensitivity of each channel.
    #[inline(always)]
    fn add<T: Copy + Into<f64>>(&self, (test, scalar): (u32, u32), values: &[T], to: &mut [f64]) {
        for (sensitivity, to) in self.of_test(test).iter().zip(to.chunks_exact_mut(values.len().max(1))) {
            let factor = sensitivity.at(scalar as usize);
            // Most readings are outside the run of a term of one run.
            if factor != 0.0 {
                add_multiple(to, factor, values);
            }
        }
    }
}

/// Adds a multiple of some values. Whole pieces are vectors of the processor.
#[inline(always)]
fn add_multiple<T: Copy + Into<f64>>(to: &mut [f64], factor: f64, values: &[T]) {
    let (to, to_rest) = to.as_chunks_mut::<LANES>();
    let (values, rest) = values.as_chunks::<LANES>();
    for (to, values) in to.iter_mut().zip(values) {
        for k in 0..LANES {
            to[k] += factor * values[k].into();
        }
    }
    to_rest.iter_mut().zip(rest).for_each(|(sum, value)| *sum += factor * (*value).into());
}

/// The products of a channel's columns with themselves over some rows: `CᵀC = Bᵀ H B`, where `H` has a band. If
/// states far from each other are combined, the columns themselves are multiplied.
pub(super) struct OwnProducts<'r> {
    channel: &'r Channel,
    training: &'r TrainingRows,
    /// `H`: for each distance of two states the entries by the lower state. Empty without a band.
    band: Vec<Vec<f64>>,
    states: usize,
}

impl<'r> OwnProducts<'r> {
    /// Sums the products of the sensitivities by the states that one whitened row combines.
    pub fn of(channel: &'r Channel, local: &LocalStates, training: &'r TrainingRows) -> OwnProducts<'r> {
        let states = local.count();
        let mut band = Vec::new();
        if local.band <= MAX_BAND {
            band = vec![vec![0.0; states]; local.band + 1];
            let mut terms: Vec<(usize, f64)> = Vec::new();
            for block in training.blocks.iter().filter(|block| channel.acts_in(block.test)) {
                let sensitivity = &channel.sensitivity[block.test];
                for (i, _) in block.iter() {
                    terms.clear();
                    terms.extend(training.filter.terms(i).map(|(raw, factor)| {
                        let scalar = block.start + raw;
                        (
                            local.place_of(&channel.states, block.test, scalar, training.channels[block.test]),
                            factor * sensitivity.at(scalar),
                        )
                    }));
                    for (k, (p, a)) in terms.iter().enumerate() {
                        band[0][*p] += a * a;
                        for (q, b) in &terms[k + 1..] {
                            // An entry off the diagonal stands for both orders, one on it for two equal terms.
                            let twice = if p == q { 2.0 } else { 1.0 };
                            band[p.abs_diff(*q)][*p.min(q)] += twice * a * b;
                        }
                    }
                }
            }
        }
        OwnProducts { channel, training, band, states }
    }

    /// Appends the square of the products of some columns: `local` at the states of these rows, `basis` at all states.
    pub fn append<T: Copy + Into<f64>>(&self, local: MatRef<'_, f64>, basis: &Mat<T>, squares: &mut Vec<f64>) {
        let count = local.ncols();
        let column = |k: usize| local.col(k).try_as_col_major().map_or(&[][..], |column| column.as_slice());
        if self.band.is_empty() && self.states > 0 {
            let rows = self.rows(basis);
            squares
                .extend((0..count * count).map(|at| dot(rows.col_as_slice(at / count), rows.col_as_slice(at % count))));
        } else if count <= 2 {
            let start = squares.len();
            squares.resize(start + count * count, 0.0);
            for (k, l) in (0..count).flat_map(|k| (k..count).map(move |l| (k, l))) {
                let value = self.product(column(k), column(l));
                squares[start + k * count + l] = value;
                squares[start + l * count + k] = value;
            }
        } else {
            let mut applied = Mat::zeros(self.states, count);
            for k in 0..count {
                self.apply(column(k), applied.col_as_slice_mut(k));
            }
            let mut product = Mat::zeros(count, count);
            matmul(product.as_mut(), Accum::Replace, local.transpose(), applied.as_ref(), 1.0, Par::Seq);
            squares.extend((0..count * count).map(|at| {
                let (k, l) = (at / count, at % count);
                0.5 * (product[(k, l)] + product[(l, k)])
            }));
        }
    }

    /// The product of two columns, given at the states of these rows and at all states.
    pub fn between(&self, a: (&[f64], &[f64]), b: (&[f64], &[f64])) -> f64 {
        if !self.band.is_empty() || self.states == 0 {
            return self.product(a.0, b.0);
        }
        let basis = Mat::from_fn(a.1.len(), 2, |i, k| if k == 0 { a.1[i] } else { b.1[i] });
        let rows = self.rows(&basis);
        dot(rows.col_as_slice(0), rows.col_as_slice(1))
    }

    /// `aᵀ H b` with two basis functions at the states of these rows.
    fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        let diagonal = self.band.first().map_or(0.0, |band| dot3(band, a, b));
        let off = self.band.iter().enumerate().skip(1).filter(|(distance, _)| *distance < a.len());
        off.fold(diagonal, |sum, (distance, band)| sum + dot3(band, a, &b[distance..]) + dot3(band, &a[distance..], b))
    }

    /// `H b`.
    fn apply(&self, b: &[f64], to: &mut [f64]) {
        for (distance, band) in self.band.iter().enumerate() {
            for (p, h) in band[..band.len().saturating_sub(distance)].iter().enumerate() {
                to[p] += h * b[p + distance];
                if distance > 0 {
                    to[p + distance] += h * b[p];
                }
            }
        }
    }

    /// The whitened columns of some basis functions.
    fn rows<T: Copy + Into<f64>>(&self, basis: &Mat<T>) -> Mat<f64> {
        let training = self.training;
        let rows: usize = training.blocks.iter().map(|block| block.count()).sum();
        let mut columns = Mat::zeros(rows, basis.ncols());
        for k in 0..basis.ncols() {
            let (basis, column) = (basis.col_as_slice(k), columns.col_as_slice_mut(k));
            let mut next = column.iter_mut();
            for block in &training.blocks {
                let acts = self.channel.acts_in(block.test);
                let (sensitivity, states) = (&self.channel.sensitivity[block.test], &self.channel.states);
                let channels = training.channels[block.test];
                for ((i, _), value) in block.iter().zip(&mut next) {
                    if acts {
                        let term = |(raw, factor): (usize, f64)| {
                            let scalar = block.start + raw;
                            let value: f64 = basis[states.of_scalar(block.test, scalar, channels)].into();
                            factor * sensitivity.at(scalar) * value
                        };
                        *value = training.filter.terms(i).map(term).sum();
                    }
                }
            }
        }
        columns
    }
}

/// Number of partial sums, which the compiler keeps in vector registers.
const LANES: usize = 8;

/// `Σ a b`.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `Σ h a b` over the shortest of the three.
fn dot3(h: &[f64], a: &[f64], b: &[f64]) -> f64 {
    let length = h.len().min(a.len()).min(b.len());
    let (h, a, b) = (&h[..length], &a[..length], &b[..length]);
    let mut lanes = [0.0; LANES];
    let (h, h_rest) = h.as_chunks::<LANES>();
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    for ((h, a), b) in h.iter().zip(a).zip(b) {
        for k in 0..LANES {
            lanes[k] += h[k] * a[k] * b[k];
        }
    }
    let rest: f64 = h_rest.iter().zip(a_rest).zip(b_rest).map(|((h, a), b)| h * a * b).sum();
    lanes.iter().sum::<f64>() + rest
}
