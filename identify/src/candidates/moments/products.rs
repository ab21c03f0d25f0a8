//! Multiplies the columns of candidates chunk by chunk. All columns together would not fit into memory.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::transposed_product;
use crate::candidates::columns::{Columns, EffectColumns, chunked};
use crate::numerics::parallel;

/// Maximum number of stored column entries: 320 MB.
const MAX_STORED: usize = 40_000_000;

/// Consecutive candidates, with their columns if these are stored.
pub(super) struct CandidateChunk {
    candidates: Range<usize>,
    stored: Option<Mat<f64>>,
}

/// Computes the columns of candidates chunk by chunk and multiplies each chunk. Columns are stored as long as the
/// memory limit permits it, including those stored already. `go_on` is called before each chunk. Returns `None` if it
/// returns `false`.
pub(super) fn multiply(
    columns: &Columns<'_>,
    column_sets: &[&EffectColumns],
    candidates: Range<usize>,
    present: &[CandidateChunk],
    (side, null): (&Mat<f64>, &Mat<f64>),
    go_on: &(dyn Fn() -> bool + Sync),
) -> Option<(Vec<CandidateChunk>, CandidateProducts)> {
    let count: Vec<usize> = column_sets[candidates.clone()].iter().map(|column_set| column_set.count).collect();
    let mut stored: usize =
        present.iter().filter_map(|chunk| chunk.stored.as_ref()).map(|stored| stored.nrows() * stored.ncols()).sum();
    let chunks: Vec<(Range<usize>, bool)> = chunked(&column_sets[candidates.clone()])
        .into_iter()
        .map(|chunk| {
            let entries = columns.rows() * count[chunk.clone()].iter().sum::<usize>();
            let room = stored + entries <= MAX_STORED;
            stored += if room { entries } else { 0 };
            (candidates.start + chunk.start..candidates.start + chunk.end, room)
        })
        .collect();
    let computed = parallel::map(chunks.len(), &|k| {
        let (candidates, room) = chunks[k].clone();
        if !go_on() {
            return None;
        }
        let column_sets = &column_sets[candidates.clone()];
        let all = filled(columns, column_sets);
        let products = CandidateProducts {
            side: cross_by_fold(columns, column_sets, side.as_ref(), all.as_ref()),
            own: gram_by_fold(columns, column_sets, all.as_ref()),
            null: null_product(columns, column_sets, null, all.as_ref()),
        };
        let stored = room.then_some(all);
        Some((CandidateChunk { candidates, stored }, products))
    });
    let computed: Option<Vec<(CandidateChunk, CandidateProducts)>> = computed.into_iter().collect();
    let (chunks, products): (Vec<CandidateChunk>, Vec<CandidateProducts>) = computed?.into_iter().unzip();
    let products = CandidateProducts::joined(products, columns.fold_rows.len(), side.ncols(), null.ncols());
    Some((chunks, products))
}

/// For each fold `sideᵀ · candidates` of all candidates. Columns that are not stored are computed again.
pub(super) fn with_side(
    chunks: &[CandidateChunk],
    columns: &Columns<'_>,
    column_sets: &[&EffectColumns],
    side: MatRef<'_, f64>,
) -> Vec<Mat<f64>> {
    let parts = parallel::map(chunks.len(), &|k| {
        let chunk = &chunks[k];
        let column_sets = &column_sets[chunk.candidates.clone()];
        let recomputed = chunk.stored.is_none().then(|| filled(columns, column_sets));
        let all = chunk.stored.as_ref().or(recomputed.as_ref());
        all.map_or_else(Vec::new, |all| cross_by_fold(columns, column_sets, side, all.as_ref()))
    });
    joined_by_fold(&parts, columns.fold_rows.len(), side.ncols())
}

fn filled(columns: &Columns<'_>, column_sets: &[&EffectColumns]) -> Mat<f64> {
    let width: usize = column_sets.iter().map(|column_set| column_set.count).sum();
    let mut chunk = Mat::zeros(columns.rows(), width);
    columns.fill(column_sets, chunk.as_mut());
    chunk
}

/// Products with the columns of consecutive candidates.
pub(super) struct CandidateProducts {
    /// For each fold `sideᵀ · candidates`.
    pub side: Vec<Mat<f64>>,
    /// For each fold each candidate's product with itself.
    pub own: Vec<Vec<Mat<f64>>>,
    /// Null draws with candidates, over all folds.
    pub null: Mat<f64>,
}

impl CandidateProducts {
    /// Joins the products of consecutive chunks. `side` is the number of side columns, `draws` that of null draws.
    fn joined(parts: Vec<CandidateProducts>, folds: usize, side: usize, draws: usize) -> CandidateProducts {
        let null = joined(draws, parts.iter().map(|part| &part.null));
        let mut sides = Vec::with_capacity(parts.len());
        let mut own = vec![Vec::new(); folds];
        for part in parts {
            sides.push(part.side);
            own.iter_mut().zip(part.own).for_each(|(own, more)| own.extend(more));
        }
        CandidateProducts { side: joined_by_fold(&sides, folds, side), own, null }
    }
}

/// Joins the products of chunks side by side, for each fold.
fn joined_by_fold(parts: &[Vec<Mat<f64>>], folds: usize, rows: usize) -> Vec<Mat<f64>> {
    let of_fold = |fold: usize| joined(rows, parts.iter().filter_map(|part| part.get(fold)));
    parallel::map(folds, &of_fold)
}

/// Joins matrices with the same number of rows side by side.
fn joined<'p>(rows: usize, parts: impl Iterator<Item = &'p Mat<f64>> + Clone) -> Mat<f64> {
    let mut whole = Mat::zeros(rows, parts.clone().map(Mat::ncols).sum());
    let mut column = 0;
    for part in parts {
        whole.as_mut().subcols_mut(column, part.ncols()).copy_from(part);
        column += part.ncols();
    }
    whole
}

/// For each fold `sideᵀ · candidates`. The product is zero without computation if none of the candidates acts in the
/// fold.
fn cross_by_fold(
    columns: &Columns<'_>,
    column_sets: &[&EffectColumns],
    side: MatRef<'_, f64>,
    all: MatRef<'_, f64>,
) -> Vec<Mat<f64>> {
    let moved = columns.moved_rows(column_sets).into_iter();
    moved
        .map(|rows| {
            let part = |of: MatRef<'_, f64>| transposed_product(of, all.subrows(rows.start, rows.len()));
            part(side.subrows(rows.start, rows.len()))
        })
        .collect()
}

/// For each fold each candidate's product with itself.
fn gram_by_fold(columns: &Columns<'_>, column_sets: &[&EffectColumns], all: MatRef<'_, f64>) -> Vec<Vec<Mat<f64>>> {
    let moved = columns.moved_rows(column_sets).into_iter();
    moved
        .map(|rows| {
            let part = all.subrows(rows.start, rows.len());
            let mut start = 0;
            let own = |column_set: &&EffectColumns| {
                let of = part.subcols(start, column_set.count);
                start += column_set.count;
                transposed_product(of, of)
            };
            column_sets.iter().map(own).collect()
        })
        .collect()
}

/// Null draws with candidates, over all folds in which any of them acts.
fn null_product(
    columns: &Columns<'_>,
    column_sets: &[&EffectColumns],
    null: &Mat<f64>,
    all: MatRef<'_, f64>,
) -> Mat<f64> {
    let mut product = Mat::zeros(null.ncols(), all.ncols());
    for rows in columns.moved_stretches(column_sets, 0..columns.fold_rows.len()) {
        let draws = null.as_ref().subrows(rows.start, rows.len());
        let part = all.subrows(rows.start, rows.len());
        matmul(product.as_mut(), Accum::Add, draws.transpose(), part, 1.0, Par::Seq);
    }
    product
}
