//! The triangular factors of the folds, block by block.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use abbe_model::sensitivity::SlotValues;
use faer::Mat;

use super::{Problem, RowBlock};
use crate::error::IdentifyError;
use crate::numerics::parallel;
use crate::numerics::triangle::Triangle;

/// Triangular factors over the parameters of each test, by test and fold.
type FactorsByTestAndFold = BTreeMap<(usize, usize), Triangle>;

/// Number of blocks that one parallel task evaluates.
const BLOCKS_PER_SEGMENT: usize = 16;

impl Problem {
    /// The triangular factor of each fold at the parameters `beta`, in internal units of the parameters.
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    pub fn triangles(&self, beta: &[f64]) -> Result<Vec<Triangle>, IdentifyError> {
        let values = self.slot_values(beta);
        // Segments have a fixed length, so that the sums do not depend on the number of threads.
        let blocks = self.blocks();
        let segments: Vec<&[RowBlock]> = blocks.chunks(BLOCKS_PER_SEGMENT).collect();
        let of_segments = parallel::map(segments.len(), &|k| self.factors_of_blocks(&values, segments[k]));
        let mut factors = FactorsByTestAndFold::new();
        for of_segment in of_segments {
            for (place, triangle) in of_segment? {
                match factors.entry(place) {
                    Entry::Vacant(entry) => {
                        entry.insert(triangle);
                    }
                    Entry::Occupied(mut sum) => sum.get_mut().merge(&triangle),
                }
            }
        }
        let count = self.parameters.list.len();
        let mut triangles = vec![Triangle::new(count); self.folds.count];
        for ((test, fold), triangle) in factors {
            triangles[fold].merge(&triangle.over_columns(&self.test_parameters[test].parameters, count));
        }
        Ok(triangles)
    }

    /// The triangular factors of some blocks over the parameters of their tests, by test and fold.
    fn factors_of_blocks(
        &self,
        values: &[SlotValues],
        blocks: &[RowBlock],
    ) -> Result<FactorsByTestAndFold, IdentifyError> {
        let mut factors = FactorsByTestAndFold::new();
        for block in blocks {
            let rows = self.own_rows(&values[block.test], block)?;
            let kept = self.kept_rows(block);
            let folds: Vec<usize> = self.folds_of(&kept, block).collect();
            let white = self.whitened(rows, &kept);
            let mut present = folds.clone();
            present.dedup();
            present.sort_unstable();
            present.dedup();
            for fold in &present {
                let triangle = factors
                    .entry((block.test, *fold))
                    .or_insert_with(|| Triangle::new(self.test_parameters[block.test].parameters.len()));
                if present.len() == 1 {
                    triangle.absorb(white.as_ref());
                } else {
                    let chosen: Vec<usize> = (0..folds.len()).filter(|i| folds[*i] == *fold).collect();
                    triangle.absorb(Mat::from_fn(chosen.len(), white.ncols(), |i, j| white[(chosen[i], j)]).as_ref());
                }
            }
        }
        Ok(factors)
    }
}
