//! Computations without the GIL.
//!
//! A computation runs on a thread of its own, on a pool of the stated size. The calling thread waits, passes progress
//! to Python and lets Python handle signals every 20 ms. After Ctrl-C, or an exception of the progress function, the
//! call returns at once; the computation is told to stop, and its result is dropped.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::failed::Failed;

/// Time between two looks at signals.
const SIGNALS: Duration = Duration::from_millis(20);
/// Largest number of threads.
const MAX_THREADS: usize = 1024;

/// The pool of a process. A child process made by `fork` has none of its threads, and gets a pool of its own.
struct Pool {
    process: u32,
    threads: Option<usize>,
    pool: Option<Arc<ThreadPool>>,
}

static POOL: Mutex<Pool> = Mutex::new(Pool { process: 0, threads: None, pool: None });

/// Bound the number of threads of every computation from now on. `None` is one thread per processor.
#[pyfunction]
#[pyo3(signature = (count=None))]
pub fn set_threads(count: Option<usize>) -> PyResult<()> {
    if count.is_some_and(|count| !(1..=MAX_THREADS).contains(&count)) {
        return Err(PyValueError::new_err(format!("count: a number of threads from 1 to {MAX_THREADS} is expected")));
    }
    let mut pool = POOL.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    (pool.threads, pool.pool) = (count, None);
    Ok(())
}

/// The number of threads of a computation.
#[pyfunction]
pub fn threads() -> Result<usize, Failed> {
    Ok(pool()?.current_num_threads())
}

fn pool() -> Result<Arc<ThreadPool>, Failed> {
    let mut own = POOL.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let process = std::process::id();
    if let Some(pool) = own.pool.as_ref().filter(|_| own.process == process) {
        return Ok(Arc::clone(pool));
    }
    let builder = ThreadPoolBuilder::new().num_threads(own.threads.unwrap_or(0));
    let pool = builder.build().map_err(|cause| Failed::new(format!("the threads cannot be started: {cause}")))?;
    let pool = Arc::new(pool);
    if own.process == process || own.pool.is_none() {
        own.pool = Some(Arc::clone(&pool));
    } else if let Some(parent) = own.pool.replace(Arc::clone(&pool)) {
        // Its threads are in the parent process: to wait for them would take forever.
        std::mem::forget(parent);
    }
    own.process = process;
    Ok(pool)
}

/// A short computation: without the GIL, on the threads of the pool.
pub fn at_once<T: Send>(py: Python<'_>, task: impl FnOnce() -> Result<T, Failed> + Send) -> PyResult<T> {
    let pool = pool()?;
    Ok(py.detach(|| pool.install(task))?)
}

/// What a computation reports to the caller.
#[derive(Clone)]
pub struct Caller {
    stop: Arc<AtomicBool>,
    progress: Sender<String>,
}

impl Caller {
    /// Whether to go on.
    pub fn should_continue(&self) -> bool {
        !self.stop.load(Ordering::Relaxed)
    }

    /// Reports progress in words, and returns whether to go on.
    pub fn report(&self, words: String) -> bool {
        // The caller has left if nobody receives it.
        let _ = self.progress.send(words);
        self.should_continue()
    }
}

/// Runs a computation as this module describes it. `progress` is called with words.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    task: impl FnOnce(&Caller) -> Result<T, Failed> + Send + 'static,
) -> PyResult<T> {
    let pool = pool()?;
    let (words, heard) = channel();
    let (done, result) = channel();
    let caller = Caller { stop: Arc::new(AtomicBool::new(false)), progress: words };
    let own = caller.clone();
    let thread = std::thread::Builder::new().name("abbe".to_string()).spawn(move || {
        let found = catch_unwind(AssertUnwindSafe(|| pool.install(|| task(&own))));
        let _ = done.send(found);
    });
    thread.map_err(|cause| Failed::new(format!("a thread cannot be started: {cause}")))?;
    // The receiver of the result is used by this thread alone, but has to pass `detach`.
    let result = Mutex::new(result);
    let found = loop {
        let received = py.detach(|| received(&result));
        let attended = pass_on(py, progress.as_ref(), &heard).and_then(|()| py.check_signals());
        if let Err(exception) = attended {
            caller.stop.store(true, Ordering::Relaxed);
            return Err(exception);
        }
        match received {
            Ok(found) => break found,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break Err(Box::new(())),
        }
    };
    match found {
        Ok(found) => Ok(found?),
        Err(_) => Err(PyRuntimeError::new_err("a fault of abbe: the computation broke off; please report it")),
    }
}

fn received<T>(result: &Mutex<Receiver<T>>) -> Result<T, RecvTimeoutError> {
    result.lock().unwrap_or_else(std::sync::PoisonError::into_inner).recv_timeout(SIGNALS)
}

/// Calls the progress function with everything that was heard.
fn pass_on(py: Python<'_>, progress: Option<&Py<PyAny>>, heard: &Receiver<String>) -> PyResult<()> {
    for words in heard.try_iter() {
        if let Some(progress) = progress {
            progress.call1(py, (words,))?;
        }
    }
    Ok(())
}
