//! What a trace does now, in words.

use abbe_identify::plausibility::Plausibility;
use abbe_model::unit::Unit;
use abbe_model::words::counted;

/// Progress of a trace.
#[derive(Clone, Debug)]
pub enum Progress {
    /// The declared model is being fitted.
    Fitting,
    /// The readings contradict the declared model: how. The trace ends if the caller does not accept it.
    Contradicted(Box<Plausibility>),
    /// The candidates are being screened: the number of candidates.
    Screening(usize),
    /// Draws of the null distribution of the search that are formed, and their number.
    NullDraws(usize, usize),
    /// An effect was added: the number of effects, its identifier, the held-out rms in µm.
    SelectedEffect(usize, String, f64, Unit),
    /// Searches without one fold that have ended, and their number. Each predicts the readings that it lacks.
    Folds(usize, usize),
    /// The model with the found effects is being refitted, and its residual tested.
    Judging,
    /// Tests that separate the found effects from their aliases are being compared.
    ComparingTests,
    /// No new event. Reported often, so that the caller can stop the trace soon.
    Working,
}

impl Progress {
    /// The words of a caller's display; none for no new event.
    pub fn words(&self) -> Option<String> {
        Some(match self {
            Progress::Fitting => "fitting the declared model".to_string(),
            Progress::Screening(candidates) => format!("screening {}", counted(*candidates, "candidate")),
            Progress::NullDraws(formed, all) => format!("null distribution: {formed} of {all} draws"),
            Progress::SelectedEffect(number, id, rms, unit) => {
                format!("{}: {id}, held out {}", counted(*number, "effect"), unit.text(*rms, 3))
            }
            Progress::Folds(ended, folds) => format!("searching without one fold: {ended} of {folds}"),
            Progress::Judging => "refitting and judging".to_string(),
            Progress::ComparingTests => "comparing candidate tests".to_string(),
            Progress::Contradicted(_) | Progress::Working => return None,
        })
    }
}
