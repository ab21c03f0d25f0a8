//! Ctrl-C: the first interrupt ends a search and keeps its results. A second one, or one without results, ends the
//! program.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;

use super::failure::INTERRUPTED;
use super::message::{Kind, tell};

/// The state of interrupts.
#[derive(Clone)]
pub struct Interrupts {
    came: Arc<AtomicBool>,
    /// Whether the next interrupt ends the program, because there are no results yet or they are being written.
    at_once: Arc<AtomicBool>,
}

impl Interrupts {
    /// Handles Ctrl-C from now on, with messages above the progress bar. An interrupt before
    /// [`Interrupts::keep_results`] ends the program.
    pub fn handled(bar: ProgressBar) -> Interrupts {
        let interrupts =
            Interrupts { came: Arc::new(AtomicBool::new(false)), at_once: Arc::new(AtomicBool::new(true)) };
        let handler = interrupts.clone();
        if ctrlc::set_handler(move || handler.handle(&bar)).is_err() {
            tell(Kind::Warning, "Ctrl-C cannot be handled; it ends the program without a result");
        }
        interrupts
    }

    /// From now on the first Ctrl-C only sets the state that [`Interrupts::came`] returns; a second one ends the program.
    pub fn noticed() -> Interrupts {
        let interrupts =
            Interrupts { came: Arc::new(AtomicBool::new(false)), at_once: Arc::new(AtomicBool::new(false)) };
        let came = Arc::clone(&interrupts.came);
        let handler = move || {
            if came.swap(true, Ordering::Relaxed) {
                std::process::exit(i32::from(INTERRUPTED));
            }
        };
        if ctrlc::set_handler(handler).is_err() {
            tell(Kind::Warning, "Ctrl-C cannot be handled; it may leave a temporary file");
        }
        interrupts
    }

    fn handle(&self, bar: &ProgressBar) {
        let second = self.came.swap(true, Ordering::Relaxed);
        if second || self.at_once.load(Ordering::Relaxed) {
            bar.suspend(|| eprintln!("interrupted; nothing more is written"));
            std::process::exit(i32::from(INTERRUPTED));
        }
        bar.suspend(|| {
            eprintln!("interrupted: the effects found so far are being fitted; Ctrl-C again ends the program")
        });
    }

    /// Whether an interrupt occurred.
    pub fn came(&self) -> bool {
        self.came.load(Ordering::Relaxed)
    }

    /// From now on the first interrupt only sets the state that [`Interrupts::came`] returns.
    pub fn keep_results(&self) {
        self.at_once.store(false, Ordering::Relaxed);
    }

    /// From now on each interrupt ends the program.
    pub fn end_at_once(&self) {
        self.at_once.store(true, Ordering::Relaxed);
    }
}
