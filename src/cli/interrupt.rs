//! Ctrl-C: the first one ends a search, whose results are kept; a second one, or one where there is nothing to keep, ends the program.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;

use super::failure::INTERRUPTED;
use super::message::{Kind, tell};

/// What interruptions there were, and what one does now.
#[derive(Clone)]
pub struct Interrupts {
    came: Arc<AtomicBool>,
    /// Whether the next one ends the program: there are no results yet, or they are being written.
    at_once: Arc<AtomicBool>,
}

impl Interrupts {
    /// Handles Ctrl-C from now on; messages go above a progress bar. Until [`Interrupts::keep_results`] it ends the program.
    pub fn handled(bar: ProgressBar) -> Interrupts {
        let interrupts = Interrupts {
            came: Arc::new(AtomicBool::new(false)),
            at_once: Arc::new(AtomicBool::new(true)),
        };
        let handler = interrupts.clone();
        if ctrlc::set_handler(move || handler.handle(&bar)).is_err() {
            tell(Kind::Warning, "Ctrl-C will end the program without a result");
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
            eprintln!("interrupted: the effects found until now are being fitted; Ctrl-C again ends at once")
        });
    }

    /// Whether there was one.
    pub fn came(&self) -> bool {
        self.came.load(Ordering::Relaxed)
    }

    /// From now on the first one is left to whoever asks whether it came.
    pub fn keep_results(&self) {
        self.at_once.store(false, Ordering::Relaxed);
    }

    /// From now on each one ends the program.
    pub fn end_at_once(&self) {
        self.at_once.store(true, Ordering::Relaxed);
    }
}
