//! The threads of the module: workers of the browser with the module and its memory.
//!
//! WebAssembly starts no thread. The worker that computes starts others, each of which calls [`work_in_pool`] and waits.
//! [`make_pool`] then gives one thread of the pool to each. Without shared memory the pool is the first worker alone.

use std::sync::{Condvar, Mutex, PoisonError};

use rayon::{ThreadBuilder, ThreadPoolBuilder};
use wasm_bindgen::prelude::*;

use crate::failed::Failed;

/// Threads without a worker. Workers share nothing but the memory of the module, so the place is a static one.
static WAITING: (Mutex<Vec<ThreadBuilder>>, Condvar) = (Mutex::new(Vec::new()), Condvar::new());

/// Makes the pool of all computations: this worker, and `threads - 1` others that call [`work_in_pool`].
///
/// # Errors
/// If there is a pool.
#[wasm_bindgen(js_name = makePool)]
pub fn make_pool(threads: usize) -> Result<(), Failed> {
    let (waiting, arrived) = &WAITING;
    let give = |thread| {
        waiting.lock().unwrap_or_else(PoisonError::into_inner).push(thread);
        arrived.notify_one();
        Ok(())
    };
    let pool = ThreadPoolBuilder::new().num_threads(threads).use_current_thread().spawn_handler(give);
    pool.build_global().map_err(|error| Failed::from(error.to_string()))
}

/// Works as a thread of the pool, until the worker is ended.
#[wasm_bindgen(js_name = workInPool)]
pub fn work_in_pool() {
    let (waiting, arrived) = &WAITING;
    let mut threads = waiting.lock().unwrap_or_else(PoisonError::into_inner);
    let thread = loop {
        if let Some(thread) = threads.pop() {
            break thread;
        }
        threads = arrived.wait(threads).unwrap_or_else(PoisonError::into_inner);
    };
    drop(threads);
    thread.run();
}
