//! Independent items on all threads, with results in the order of the items.
//!
//! Sums over the results are formed by the caller, in that order, so that no number depends on the count of threads.

use std::sync::Mutex;

use rayon::prelude::*;

/// `of(0)`, `of(1)`, … in order.
///
/// The work is passed on without its type, so that the scheduler of the threads is compiled once for all callers.
pub fn map<T: Send>(count: usize, of: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    let results: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let each: &(dyn Fn(usize) + Sync) = &|index| {
        let result = of(index);
        if let Ok(mut place) = results[index].lock() {
            *place = Some(result);
        }
    };
    (0..count).into_par_iter().for_each(each);
    results.into_iter().filter_map(|result| result.into_inner().ok().flatten()).collect()
}

/// Two independent computations at the same time.
pub fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order_of_the_items() {
        let squares = map(1000, &|index| map(index % 5, &|inner| inner).len() + index * index);
        assert!(squares.iter().enumerate().all(|(index, square)| *square == index * index + index % 5));
        assert!(map(0, &|index| index).is_empty());
    }
}
