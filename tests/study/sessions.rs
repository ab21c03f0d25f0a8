//! Simulates sessions with the plant and runs trace on their files.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Instant;

use abbe::files::{ReadOptions, session};
use abbe::trace::result::TraceResult;
use abbe::trace::{TraceOptions, trace};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use crate::plant::{Injected, Kind, Noise, Oracle, Recipe, SimulatedSession};

/// The kinds of noise of a study.
pub const NOISES: [Noise; 3] = [
    Noise::White { sigma_um: 0.3 },
    Noise::Serial { sigma_um: 0.3, coefficient: 0.8 },
    Noise::Outliers { sigma_um: 0.3, share: 0.01 },
];

/// The significance level that defines the smallest significant size, 0.5 % two-sided, in standard deviations.
pub const LEVEL: f64 = 2.8070;

/// Sessions per study without `ABBE_STUDY`: enough to detect a regression, too few for figures.
const FEW: usize = 8;

/// Sessions per study, from `ABBE_STUDY`; 0 skips the studies.
pub fn sessions() -> usize {
    number("ABBE_STUDY").unwrap_or(FEW)
}

/// Whether studies are skipped.
pub fn skipped(study: &str) -> bool {
    let skipped = sessions() == 0;
    if skipped {
        test_needs::skip(study, "ABBE_STUDY is 0");
    }
    skipped
}

/// Whether to print every session.
pub fn verbose() -> bool {
    number("ABBE_STUDY_VERBOSE").is_some()
}

fn number(name: &str) -> Option<usize> {
    std::env::var(name).ok().and_then(|text| text.parse().ok())
}

/// Kind of session and of noise of one session of a study: all combinations in turn.
pub fn case(number: usize) -> (Kind, Noise) {
    let kinds = Kind::ALL.len();
    (Kind::ALL[number % kinds], NOISES[number / kinds % NOISES.len()])
}

/// The random generator of one session, except for its noise.
pub fn random(study: u64, number: usize) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(study * 1_000_003 + number as u64)
}

/// The oracle of a kind of session and noise, computed once.
pub fn oracle(kind: Kind, noise: Noise) -> Arc<Oracle> {
    type Shared = Mutex<HashMap<String, Arc<OnceLock<Arc<Oracle>>>>>;
    static ORACLES: OnceLock<Shared> = OnceLock::new();
    let key = format!("{kind:?} {noise:?}");
    let place = ORACLES.get_or_init(Shared::default).lock().unwrap().entry(key).or_default().clone();
    place.get_or_init(|| Arc::new(Oracle::new(&Recipe::new(kind, 0).noise(noise)))).clone()
}

/// The effect at a multiple of the smallest amplitude that is significant for the oracle at that level.
pub fn at_multiple(oracle: &Oracle, effect: &Injected, factor: f64) -> Injected {
    effect.with_amplitude(factor * oracle.smallest_significant_amplitude(effect, LEVEL))
}

/// A simulated session and the result of trace.
pub struct TracedSession {
    /// Its number in the study.
    pub number: usize,
    /// Its kind.
    pub kind: Kind,
    /// Its noise.
    pub noise: Noise,
    /// The readings, with the true values.
    pub draw: SimulatedSession,
    /// The result of trace.
    pub result: TraceResult,
    /// Duration of trace, s.
    pub seconds: f64,
}

/// The number of the first session: `ABBE_STUDY_FIRST`.
pub fn first_number() -> usize {
    number("ABBE_STUDY_FIRST").unwrap_or(0)
}

/// The only session to run: `ABBE_STUDY_ONLY`.
pub fn only() -> Option<usize> {
    number("ABBE_STUDY_ONLY")
}

/// Runs a study: `make` gives kind, noise and effects for each number. `ABBE_STUDY_FIRST` is added to every number, so
/// that a rule can be tuned on other sessions than those that validate it.
pub fn run(
    numbers: std::ops::Range<usize>,
    make: impl Fn(usize) -> (Kind, Noise, Vec<Injected>) + Sync,
) -> Vec<TracedSession> {
    let only = only();
    let first = first_number();
    numbers
        .into_par_iter()
        .map(|session| session + first)
        .filter(|session| only.is_none_or(|only| only == *session))
        .map(|number| {
            let (kind, noise, effects) = make(number);
            let oracle = oracle(kind, noise);
            let recipe = Recipe { effects, ..Recipe::new(kind, 7000 + number as u64) }.noise(noise);
            let draw = recipe.draw_on(&oracle.plan);
            let (result, seconds) = traced(&draw, number);
            TracedSession { number, kind, noise, draw, result, seconds }
        })
        .collect()
}

/// Runs trace on the files of a simulated session. Returns its result and duration, s.
pub fn traced(draw: &SimulatedSession, session_number: usize) -> (TraceResult, f64) {
    let folder = tempfile::tempdir().unwrap();
    draw.write(folder.path()).unwrap();
    if number("ABBE_STUDY_KEEP") == Some(session_number) {
        let kept = std::env::temp_dir().join(format!("abbe-study-{session_number}"));
        draw.write(&kept).unwrap();
    }
    let start = Instant::now();
    let read = session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
    let found = trace(&read, &TraceOptions::default(), &|_| true)
        .unwrap_or_else(|error| panic!("session {session_number}: {error}"));
    (found.result, start.elapsed().as_secs_f64())
}
