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

/// Items of one thread that are computed before their results are taken.
const ITEMS_OF_A_THREAD: usize = 8;

/// `put(0, of(0))`, `put(1, of(1))`, … in order, for large results: those of few items are held at the same time.
pub fn in_order<T: Send>(count: usize, of: &(dyn Fn(usize) -> T + Sync), put: &mut dyn FnMut(usize, T)) {
    let at_once = ITEMS_OF_A_THREAD * rayon::current_num_threads();
    for first in (0..count).step_by(at_once) {
        let results = map(at_once.min(count - first), &|k| of(first + k));
        results.into_iter().enumerate().for_each(|(k, result)| put(first + k, result));
    }
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
        let mut taken = Vec::new();
        in_order(1000, &|index| index * index, &mut |index, square| taken.push((index, square)));
        assert!(taken.iter().enumerate().all(|(place, taken)| *taken == (place, place * place)) && taken.len() == 1000);
    }
}
