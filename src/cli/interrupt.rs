//! Ctrl-C, SIGTERM, which a scheduler sends, and SIGHUP of a terminal that is closed: Ctrl-C and SIGTERM end a search and
//! keep its results. A second one, or one without results, ends the program. No temporary file remains. A file beyond the
//! limit of its size (`ulimit -f`) is an error of the write, and no signal.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use abbe::temporary;
use indicatif::ProgressBar;

use super::message::{Kind, tell};

/// Exit status of a program that Ctrl-C ended, as in shells: 128 + SIGINT.
const INTERRUPTED: u8 = 130;
/// Exit status of a program that SIGTERM ended: 128 + SIGTERM.
const TERMINATED: u8 = 143;

type Handler = Arc<dyn Fn() + Send + Sync>;

/// Whether SIGTERM came. A signal belongs to the whole process, and so do these two.
static IS_TERMINATED: AtomicBool = AtomicBool::new(false);
/// Whether a signal ends the program.
static IS_ENDED: AtomicBool = AtomicBool::new(false);
/// What SIGTERM does; without it, it ends the program.
static HANDLER: Mutex<Option<Handler>> = Mutex::new(None);

/// Handles signals from now on.
#[cfg(unix)]
pub fn watch() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    // With a handler, the write that exceeds the limit fails, and says so.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    // What `nohup` and a script that starts a background job ignore stays ignored.
    let watched = [SIGTERM, SIGINT, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal));
    let Ok(mut signals) = signal_hook::iterator::Signals::new(watched) else { return };
    let watch = move || {
        for signal in signals.forever() {
            if signal == SIGTERM {
                IS_TERMINATED.store(true, Ordering::Relaxed);
                if let Some(handler) = HANDLER.lock().unwrap_or_else(PoisonError::into_inner).clone() {
                    handler();
                    continue;
                }
                end();
            }
            IS_ENDED.store(true, Ordering::Relaxed);
            temporary::remove_own();
            // The shell sees that a signal ended the program.
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    };
    // Without another thread the signal ends the program as it always does.
    if std::thread::Builder::new().name("signals".into()).spawn(watch).is_err() {
        tell(Kind::Warning, "signals cannot be handled; they may leave a temporary file");
    }
}

/// Handles signals from now on: other systems have only Ctrl-C, which ends the program.
#[cfg(not(unix))]
pub fn watch() {}

/// Whether the program was started with a signal ignored, where the system tells it (Linux).
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & (1 << (signal - 1)) != 0
}

/// Whether a signal ends the program. What fails from then on fails because the temporary files are being removed.
pub fn is_ended() -> bool {
    IS_ENDED.load(Ordering::Relaxed) || is_terminated()
}

fn is_terminated() -> bool {
    IS_TERMINATED.load(Ordering::Relaxed)
}

/// The exit status of an interrupted command.
pub fn status() -> u8 {
    if is_terminated() { TERMINATED } else { INTERRUPTED }
}

/// Ends the program without its temporary files.
fn end() -> ! {
    temporary::remove_own();
    std::process::exit(i32::from(status()))
}

/// Handles both signals by this function. Returns whether Ctrl-C can be handled.
fn handle_by(handler: impl Fn() + Send + Sync + 'static) -> bool {
    let handler: Handler = Arc::new(handler);
    *HANDLER.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(&handler));
    ctrlc::set_handler(move || handler()).is_ok()
}

/// The state of interrupts.
#[derive(Clone)]
pub struct Interrupts {
    came: Arc<AtomicBool>,
    /// Whether the next interrupt ends the program, because there are no results yet or they are being written.
    at_once: Arc<AtomicBool>,
}

impl Interrupts {
    /// Handles Ctrl-C and SIGTERM from now on, with messages above the progress bar. An interrupt before
    /// [`Interrupts::keep_results`] ends the program.
    pub fn handled(bar: ProgressBar) -> Interrupts {
        let interrupts =
            Interrupts { came: Arc::new(AtomicBool::new(false)), at_once: Arc::new(AtomicBool::new(true)) };
        let handler = interrupts.clone();
        if !handle_by(move || handler.handle(&bar)) {
            tell(Kind::Warning, "Ctrl-C cannot be handled; it ends the program without a result");
        }
        interrupts
    }

    /// From now on the first signal only sets the state that [`Interrupts::came`] returns; a second one ends the program.
    pub fn noticed() -> Interrupts {
        let interrupts =
            Interrupts { came: Arc::new(AtomicBool::new(false)), at_once: Arc::new(AtomicBool::new(false)) };
        let came = Arc::clone(&interrupts.came);
        let handler = move || {
            if came.swap(true, Ordering::Relaxed) {
                end();
            }
        };
        if !handle_by(handler) {
            tell(Kind::Warning, "Ctrl-C cannot be handled; it may leave a temporary file");
        }
        interrupts
    }

    fn handle(&self, bar: &ProgressBar) {
        let second = self.came.swap(true, Ordering::Relaxed);
        if second || self.at_once.load(Ordering::Relaxed) {
            bar.suspend(|| eprintln!("interrupted; nothing more is written"));
            end();
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
