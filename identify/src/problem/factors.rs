//! The triangular factors and the products of the folds, block by block.

use std::collections::BTreeMap;

use abbe_model::Diagnostic;
use abbe_model::sensitivity::SlotValues;
use faer::Mat;

use super::{Problem, RowBlock};
use crate::numerics::parallel;
use crate::numerics::products::{Products, RowSum};
use crate::numerics::triangle::{BLOCK_ROWS, Triangle};

/// Sums of rows over the parameters of each test, by test and fold.
type SumsByTestAndFold<S> = BTreeMap<(usize, usize), S>;

/// Number of blocks that one parallel task reduces to triangular factors, and to products: factors cost most to merge.
const BLOCKS_OF_FACTORS: usize = 16;
const BLOCKS_OF_PRODUCTS: usize = 4;
/// Number of tasks whose sums are held at the same time: with hundreds of parameters each has many MB.
const SEGMENTS_AT_ONCE: usize = 64;

/// Some rows of a block.
struct Piece {
    block: RowBlock,
    /// The number of rows at its start that only whiten those after them.
    lead: usize,
}

impl Problem {
    /// The triangular factor of each fold at the parameters `beta`, in internal units of the parameters.
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    pub fn triangles(&self, beta: &[f64]) -> Result<Vec<Triangle>, Diagnostic> {
        self.sums_of_folds(beta, BLOCKS_OF_FACTORS)
    }

    /// The products of the rows of each fold at the parameters `beta`, in internal units of the parameters.
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    pub(crate) fn products(&self, beta: &[f64]) -> Result<Vec<Products>, Diagnostic> {
        self.sums_of_folds(beta, BLOCKS_OF_PRODUCTS)
    }

    fn sums_of_folds<S: RowSum>(&self, beta: &[f64], blocks_per_segment: usize) -> Result<Vec<S>, Diagnostic> {
        let values = self.slot_values(beta);
        // Segments have a fixed length, so that the sums do not depend on the number of threads.
        let pieces: Vec<Piece> = self.blocks().iter().flat_map(|block| self.pieces(block)).collect();
        let segments: Vec<&[Piece]> = pieces.chunks(blocks_per_segment).collect();
        let mut sums = BTreeMap::<(usize, usize), Vec<S>>::new();
        for together in segments.chunks(SEGMENTS_AT_ONCE) {
            let of_segments = parallel::map(together.len(), &|k| self.sums_of_pieces::<S>(&values, together[k]));
            for of_segment in of_segments {
                of_segment?.into_iter().for_each(|(place, own)| sums.entry(place).or_default().push(own));
            }
            let parts: Vec<&Vec<S>> = sums.values().collect();
            let merged = parallel::map(parts.len(), &|k| merged(parts[k]));
            sums.values_mut().zip(merged).for_each(|(parts, sum)| *parts = sum.into_iter().collect());
        }
        let count = self.parameters.list.len();
        Ok(parallel::map(self.folds.count, &|fold| {
            let mut of_fold = S::new(count);
            for ((test, _), sum) in sums.iter().filter(|((_, of), _)| *of == fold) {
                let wide = sum.iter().map(|sum| sum.over_columns(&self.test_parameters[*test].parameters, count));
                wide.for_each(|sum| of_fold.merge(&sum));
            }
            of_fold
        }))
    }

    /// A block in pieces that a factor absorbs at once. A whitening filter needs the rows before a piece too.
    fn pieces(&self, block: &RowBlock) -> impl Iterator<Item = Piece> {
        let RowBlock { test, rows } = block.clone();
        let past = self.noise.ar_coefficients.len();
        let most = (BLOCK_ROWS / self.channels(test)).max(1);
        rows.clone().step_by(most).map(move |start| {
            let lead = past.min(start - rows.start);
            Piece { block: RowBlock { test, rows: start - lead..(start + most).min(rows.end) }, lead }
        })
    }

    /// The sums of the rows of some pieces over the parameters of their tests, by test and fold.
    fn sums_of_pieces<S: RowSum>(
        &self,
        values: &[SlotValues],
        pieces: &[Piece],
    ) -> Result<SumsByTestAndFold<S>, Diagnostic> {
        let mut sums = SumsByTestAndFold::<S>::new();
        let (most_rows, most_columns) = (pieces.iter().map(|piece| self.shape(&piece.block)))
            .fold((0, 0), |most, (rows, columns)| (most.0.max(rows), most.1.max(columns)));
        let mut memory = Mat::zeros(most_rows, most_columns);
        for Piece { block, lead } in pieces {
            let (count, columns) = self.shape(block);
            let mut rows = memory.get_mut(..count, ..columns);
            self.own_rows_into(&values[block.test], block, rows.as_mut())?;
            let mut kept = self.kept_rows(block);
            kept.drain(..kept.partition_point(|row| *row < lead * self.channels(block.test)));
            let folds: Vec<usize> = self.folds_of(&kept, block).collect();
            self.whiten_in_place(rows.as_mut(), &kept);
            let rows = rows.as_ref().get(..kept.len(), ..);
            let Some(first) = folds.first() else { continue };
            let none = || S::new(self.test_parameters[block.test].parameters.len());
            if folds.iter().all(|fold| fold == first) {
                sums.entry((block.test, *first)).or_insert_with(none).absorb(rows);
                continue;
            }
            let mut present = folds.clone();
            present.sort_unstable();
            present.dedup();
            for fold in present {
                let chosen: Vec<usize> = (0..folds.len()).filter(|i| folds[*i] == fold).collect();
                let of_fold = Mat::from_fn(chosen.len(), rows.ncols(), |i, j| rows[(chosen[i], j)]);
                sums.entry((block.test, fold)).or_insert_with(none).absorb(of_fold.as_ref());
            }
        }
        Ok(sums)
    }
}

/// The sum of some sums, in order.
fn merged<S: RowSum>(parts: &[S]) -> Option<S> {
    let (first, others) = parts.split_first()?;
    let mut sum = first.clone();
    others.iter().for_each(|other| sum.merge(other));
    Some(sum)
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use abbe_files::ReadOptions;

    use super::*;
    use crate::fit::prepare;

    /// A run of autocorrelated noise that is longer than a piece, with outliers about the ends of the pieces: the products of
    /// its factors are those of its rows whitened as a whole.
    #[test]
    fn pieces_of_a_run_are_whitened_as_the_whole_run() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let test = session.tests.last_mut().unwrap();
        let readings = test.readings.as_ref().unwrap();
        let twice: Vec<usize> = (0..readings.rows()).chain(0..readings.rows()).collect();
        let mut long = readings.of_rows(&twice);
        long.run = vec![1; twice.len()];
        assert!(twice.len() > BLOCK_ROWS + BLOCK_ROWS / 4);
        test.readings = Some(Arc::new(long));
        let (mut problem, fit) = prepare(&session, 1).unwrap();
        problem.noise.ar_coefficients = vec![0.6, 0.25];
        let number = problem.models.len() - 1;
        [BLOCK_ROWS - 1, BLOCK_ROWS + 1].iter().for_each(|row| problem.rejected[number][*row] = true);
        let problem = problem.folded_by_test();
        let product = |rows: faer::MatRef<'_, f64>| rows.transpose() * rows;
        let found = product(problem.triangles(&fit.beta).unwrap()[number].rows());
        let values = problem.slot_values(&fit.beta);
        let blocks = problem.blocks();
        let of_test: Vec<&RowBlock> = blocks.iter().filter(|block| block.test == number).collect();
        assert!(of_test.len() == 1 && problem.pieces(of_test[0]).count() == 2);
        let (white, _) = problem.whiten(&problem.rows(&values, of_test[0]).unwrap(), of_test[0]);
        let wanted = product(white.as_ref());
        // Two outliers, and the readings after them within the order of the filter: all from one before the end of the piece.
        assert_eq!(white.nrows(), twice.len() - 5);
        let width = wanted.nrows();
        for (i, j) in (0..width).flat_map(|i| (0..width).map(move |j| (i, j))) {
            let size = (wanted[(i, i)] * wanted[(j, j)]).sqrt();
            assert!((found[(i, j)] - wanted[(i, j)]).abs() <= 1e-10 * size, "{i} {j}");
        }
    }
}
