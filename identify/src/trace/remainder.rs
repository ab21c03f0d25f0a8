//! What is left when the search has ended: whether it has structure, what it looks like, and where it lies.
//!
//! The detectors look at readings, not at components: a period over an axis' position in one test, a curve that differs by direction, a slope over
//! time, a level of one run. They are tested against the same null as the search.

use std::ops::Range;

use abbe_model::effect::{Component, Driver, Effect, Shape};

use super::columns::{Columns, Layout};
use super::moments::Moments;
use super::score::{PriorMoments, Trained};
use super::tail::ln_chi_square_tail;
use crate::problem::Problem;

/// Structure in a residual.
#[derive(Clone, Debug)]
pub struct Structure {
    /// Probability of as much in readings without structure.
    pub p_value: f64,
    /// The share of the sum of squares, beyond noise, that the detectors find: `χ²` of the best detector less its expectation.
    pub excess: f64,
    /// In words: which test, over what, how large.
    pub words: String,
}

/// Significance below which a remainder counts as structured.
const STRUCTURED: f64 = 0.01;

impl Structure {
    /// Whether there is any beyond noise.
    pub fn is_there(&self) -> bool {
        self.p_value <= STRUCTURED
    }
}

/// One detector.
struct Detector {
    layout: Layout,
    words: String,
}

fn detectors(problem: &Problem<'_>, columns: &Columns<'_, '_>) -> Vec<Detector> {
    let machine = &problem.session.machine;
    let mut detectors = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let mut add = |driver: &Driver,
                       shape: Shape,
                       by_direction: bool,
                       rows: Option<&Range<usize>>,
                       words: String| {
            let effect = Effect {
                component: Component::TriggerDelay,
                driver: driver.clone(),
                shape,
                tests: vec![test.name.clone()],
            };
            for coordinate in 0..readings.coordinates {
                if let Some(layout) = columns.reading_layout(&effect, number, coordinate, by_direction, rows)
                {
                    let named = if readings.coordinates == 3 {
                        format!("{words} in {}", ["x", "y", "z"][coordinate])
                    } else {
                        words.clone()
                    };
                    detectors.push(Detector { layout, words: named });
                }
            }
        };
        for (axis, column) in readings.positions.iter().enumerate() {
            let low = column.iter().copied().fold(f64::INFINITY, f64::min);
            let high = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if high - low < 1e-6 {
                continue;
            }
            let name = &machine.axes[axis].name;
            let driver = Driver::Axis(name.clone());
            let rotary = machine.axes[axis].kind == abbe_model::axis::AxisKind::Rotary;
            for half_cycles in (2..=80).chain((84..=240).step_by(4)) {
                let period = 2.0 * (high - low) / half_cycles as f64;
                let length = if rotary {
                    format!("{:.1}°", period.to_degrees())
                } else {
                    format!("{period:.2} mm")
                };
                let words = format!("a wave over {name} with a period of {length} in {}", test.name);
                add(&driver, Shape::Periodic { period }, false, None, words.clone());
                if half_cycles <= 16 {
                    add(
                        &driver,
                        Shape::Periodic { period },
                        true,
                        None,
                        format!("{words}, opposite in the two directions"),
                    );
                }
            }
            // What comes and goes with time is in no mean over runs.
            let runs = readings.runs();
            for half_cycles in 2..=if runs.len() > 1 { 40 } else { 0 } {
                let period = 2.0 * (high - low) / half_cycles as f64;
                for (k, run) in runs.iter().enumerate() {
                    let words = format!(
                        "a wave over {name}, {half_cycles} half cycles over its way, in run {} of {}",
                        k + 1,
                        test.name
                    );
                    add(&driver, Shape::Periodic { period }, false, Some(run), words);
                }
            }
            for intervals in [6, 12, 24] {
                let shape = Shape::Curve {
                    from: low,
                    to: high,
                    intervals,
                    closed: false,
                };
                add(
                    &driver,
                    shape,
                    false,
                    None,
                    format!("a curve over {name} in {}", test.name),
                );
            }
            for share in [0.02, 0.06] {
                let width = share * (high - low);
                for k in 0..(0.5 / share) as usize {
                    let centre = low + (high - low) * (k as f64 + 0.5) * 2.0 * share;
                    let place = if rotary {
                        format!("{:.1}°", centre.to_degrees())
                    } else {
                        format!("{centre:.1} mm")
                    };
                    let shape = Shape::Local {
                        centre,
                        width,
                        recurs: None,
                    };
                    add(
                        &driver,
                        shape,
                        false,
                        None,
                        format!("a feature at {name} = {place} in {}", test.name),
                    );
                }
            }
            add(
                &driver,
                Shape::Backlash,
                false,
                None,
                format!("a difference between the directions of {name} in {}", test.name),
            );
        }
        if !readings.time_s.is_empty() && readings.rows() > 1 {
            let first = readings.time_s[0] - problem.origin.time_s;
            let last = readings.time_s[readings.rows() - 1] - problem.origin.time_s;
            add(
                &Driver::Time,
                Shape::Drift,
                false,
                None,
                format!("a drift over time in {}", test.name),
            );
            if last > first {
                let shape = Shape::Curve {
                    from: first,
                    to: last,
                    intervals: 6,
                    closed: false,
                };
                add(
                    &Driver::Time,
                    shape,
                    false,
                    None,
                    format!("a slow change over time in {}", test.name),
                );
            }
        }
    }
    detectors
}

/// Looks for structure in a residual, beside a model given by its orthonormal columns.
pub fn structure(
    problem: &Problem<'_>,
    columns: &Columns<'_, '_>,
    model: faer::Mat<f64>,
    residual: &[f64],
    null: faer::Mat<f64>,
    prior: &PriorMoments,
) -> Structure {
    let detectors = detectors(problem, columns);
    if detectors.is_empty() {
        return Structure {
            p_value: 1.0,
            excess: 0.0,
            words: "nothing to look at".to_string(),
        };
    }
    let layouts: Vec<Layout> = detectors.iter().map(|detector| detector.layout.clone()).collect();
    let rank = model.ncols();
    let moments = Moments::new(columns, &layouts, model, residual, null);
    let folds = (0..columns.fold_rows.len()).collect();
    let trained = Trained::new(&moments, prior, (0..rank).collect(), folds);
    let mut best = (0, f64::NEG_INFINITY, 0.0);
    for (index, gain) in trained.gains().iter().enumerate() {
        if gain.freedom == 0 {
            continue;
        }
        let score = -ln_chi_square_tail(gain.gain, gain.freedom);
        if score > best.1 {
            best = (index, score, gain.gain - gain.freedom as f64);
        }
    }
    let null_best = trained.null_best(&vec![0.0; layouts.len()], 1.0);
    let above = null_best.iter().filter(|score| **score >= best.1).count();
    let p_value = (above + 1) as f64 / (null_best.len() + 1) as f64;
    let size_um =
        (2.0 * best.2.max(0.0) / columns.rows().max(1) as f64).sqrt() * problem.noise.sigma_mm * 1e3;
    let words = format!("{} ({size_um:.2} µm over all readings)", detectors[best.0].words);
    Structure {
        p_value,
        excess: best.2.max(0.0),
        words,
    }
}
