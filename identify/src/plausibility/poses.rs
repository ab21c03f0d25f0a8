//! Poses of a robot: how much of the variance of the measured positions the model explains, and which column may be
//! misread.

use std::collections::HashSet;

use abbe_model::axis::AxisKind;
use abbe_model::instrument::MisreadingKind;
use abbe_model::session::limits::MIN_UM;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use nalgebra::Vector3;

use super::hypotheses::{Hypothesis, columns_exchanged, conventions, lengths, units, with_readings};
use super::quick_fit::{thinned, trial};
use super::results::{Suggestion, SuggestionKind};
use crate::heldout::rms_mm;
use crate::noise::{Noise, NoiseSource};
use crate::numerics::parallel;
use crate::problem::Problem;

/// Poses that are refitted with each mistake.
const MAX_POSES: usize = 300;
/// Poses by which the nominal machine is judged with every fit.
const MAX_JUDGED: usize = 60;
/// Least factor by which a mistake lowers the residual of the nominal machine.
const LOWERED: f64 = 3.0;
/// Mistakes whose residual is below this multiple of the least residual are also listed.
const NOT_SEPARABLE: f64 = 1.5;
/// Maximum number of listed mistakes.
const MAX_LISTED: usize = 5;
/// Machines of other tables that are fitted.
const MAX_NEAREST: usize = 4;
/// Noise for the comparison of residuals, mm; its value has no influence.
const NOISE_MM: f64 = 1.0;

/// Mean square of the distances of the positions from their mean, mm²: of those measured, or, where a ball sits in
/// sockets, of those that the ball would take if the positions of the axes were combined at random. `None` if they do
/// not scatter, or if the readings are no positions.
pub(super) fn spread_mm2(problem: &Problem) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_usize);
    let mut groups: Vec<&str> = problem.tests.iter().map(|test| test.setup.as_str()).collect();
    groups.sort_unstable();
    groups.dedup();
    for group in groups {
        let mut points: Vec<Vector3<f64>> = Vec::new();
        // The tests of the session have the columns as they were read.
        let tests = problem.session.tests.iter().filter(|test| test.readings.is_some());
        for (number, test) in tests.enumerate() {
            let Some(readings) = test.readings.as_ref().filter(|_| test.setup == group) else {
                continue;
            };
            if !test.station.kind().entry().has_readings {
                let mut mixed = Readings::clone(readings);
                for (axis, column) in mixed.positions.iter_mut().enumerate() {
                    let by = (axis * 7 + 1) % column.len().max(1);
                    column.rotate_left(by);
                }
                points.extend(mixed.nominal_points(&problem.session.machine, &test.station.tool_point()));
                continue;
            }
            for (row, values) in readings.observed.chunks_exact(readings.channels).enumerate() {
                let measured = test.station.measured_mm(values)?;
                if !problem.rejected[number][row] && measured.iter().all(|value| value.is_finite()) {
                    points.push(measured);
                }
            }
        }
        let mean = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        sum += points.iter().map(|point| (point - mean).norm_squared()).sum::<f64>();
        count += points.len();
    }
    let spread = sum / count.max(1) as f64;
    // Equal positions scatter about their mean by its rounding.
    (spread > (MIN_UM * 1e-3).powi(2) && spread.is_finite()).then_some(spread)
}

/// The nominal machine before at most about so many of the poses: only the set-up is unknown.
fn nominal(problem: &Problem, most: usize) -> Session {
    let mut nominal = thinned(problem, most);
    nominal.unknowns.clear();
    nominal.effects.clear();
    nominal
}

/// The misfit of the nominal machine: see [`super::nominal_misfit`].
pub(super) fn nominal_misfit(session: &Session) -> Option<f64> {
    let noise = Noise::white(NOISE_MM, NoiseSource::Stated);
    let nominal = nominal(&Problem::new(session, noise.clone(), 1).ok()?, MAX_POSES);
    let problem = Problem::new(&nominal, noise.clone(), 1).ok()?;
    Some(trial(&nominal, &noise)?.rms_mm / spread_mm2(&problem).map_or(1.0, f64::sqrt))
}

/// What a session leaves of its poses.
pub(super) struct Left {
    /// Share of the spread of the positions: readings that are scaled leave a residual that is scaled with them.
    pub share: f64,
    /// Residual over scalar readings, mm.
    pub rms_mm: f64,
}

/// What the nominal machine leaves.
pub(super) fn left_by_nominal(problem: &Problem) -> Option<Left> {
    left(&nominal(problem, MAX_JUDGED))
}

/// Fits a session in which a turn of a radian weighs as much as the spread. The lever of a session that states no noise follows
/// from the residual, and hides orientations that are misread; that of another unit of lengths hides positions.
fn left(session: &Session) -> Option<Left> {
    let noise = Noise::white(NOISE_MM, NoiseSource::Stated);
    let spread_mm = spread_mm2(&Problem::new(session, noise.clone(), 1).ok()?).map(f64::sqrt);
    let weighed = Session { lever_mm: spread_mm.unwrap_or(session.lever_mm), ..session.clone() };
    let rms_mm = trial(&weighed, &noise)?.rms_mm;
    Some(Left { share: rms_mm / spread_mm.unwrap_or(1.0), rms_mm })
}

/// The mistakes with which the nominal machine fits poses far better, the best first.
pub(super) fn suggestions(problem: &Problem) -> Vec<Suggestion> {
    let mut nominal = nominal(problem, MAX_POSES);
    nominal.lever_mm = spread_mm2(problem).map_or(nominal.lever_mm, f64::sqrt);
    let base = left(&nominal).map_or(f64::INFINITY, |left| left.share);
    let hypotheses = of_poses(&nominal);
    let found = parallel::map(hypotheses.len(), &|k| left(&hypotheses[k].session));
    let mut tried: Vec<(Left, Hypothesis)> =
        found.into_iter().zip(hypotheses).filter_map(|(found, hypothesis)| Some((found?, hypothesis))).collect();
    tried.retain(|(left, _)| left.share * LOWERED < base);
    tried.sort_by(|(a, _), (b, _)| a.share.total_cmp(&b.share));
    // Many tables have one convention.
    let mut seen = HashSet::new();
    tried.retain(|(_, hypothesis)| seen.insert(hypothesis.words.clone()));
    let best = tried.first().map_or(0.0, |(left, _)| left.share);
    (tried.into_iter())
        .take_while(|(left, _)| left.share <= best * NOT_SEPARABLE)
        .take(MAX_LISTED)
        .map(|(left, hypothesis)| Suggestion {
            kind: hypothesis.kind,
            subject: hypothesis.subject,
            rms_um: left.rms_mm * 1e3,
            words: hypothesis.words,
        })
        .collect()
}

/// The hypotheses that leave least with the set-up that is found before the first iteration: a machine that is wrong takes many
/// iterations.
fn nearest(hypotheses: Vec<Hypothesis>) -> Vec<Hypothesis> {
    let left = parallel::map(hypotheses.len(), &|k| {
        let problem = Problem::new(&hypotheses[k].session, Noise::white(NOISE_MM, NoiseSource::Stated), 1).ok();
        problem.map_or(f64::INFINITY, |problem| {
            rms_mm(&problem, &problem.residuals(&vec![0.0; problem.parameters.list.len()]))
        })
    });
    let mut ranked: Vec<(f64, Hypothesis)> = left.into_iter().zip(hypotheses).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.into_iter().take(MAX_NEAREST).map(|(_, hypothesis)| hypothesis).collect()
}

/// The mistakes that are tried on poses.
fn of_poses(session: &Session) -> Vec<Hypothesis> {
    let machine = &session.machine;
    let mut list = Vec::new();
    let measures = |test: &Test| -> Option<usize> {
        let readings = test.readings.as_ref()?;
        test.station.measured_mm(readings.observed.get(..readings.channels)?)?;
        Some(readings.channels)
    };
    let measured = session.tests.iter().find(|test| measures(test).is_some());
    if let Some(columns) = measured.map(|test| test.station.columns()) {
        let names = columns[..3].iter().map(|column| column.stem).collect::<Vec<_>>().join(", ");
        let changed = |change: &dyn Fn(&Test, &mut [f64])| {
            with_readings(session, |test, _, observed| {
                if let Some(channels) = measures(test) {
                    observed.chunks_exact_mut(channels).for_each(|values| change(test, values));
                }
            })
        };
        for (factor, unit) in lengths() {
            let scaled = changed(&|test, values| {
                let read = values.iter_mut().zip(test.station.channels()).filter(|(_, channel)| !channel.is_angle());
                read.for_each(|(value, _)| *value *= factor);
            });
            let words = format!("the measured positions are {unit}");
            list.push(Hypothesis::new(SuggestionKind::ColumnUnit, &names, words, scaled));
        }
        let mirrored = changed(&|test, values| test.station.mirror(values));
        let words = format!(
            "the measured positions are left-handed: one of {names} has the opposite sign, or two are exchanged"
        );
        list.push(Hypothesis::new(SuggestionKind::ColumnSign, &names, words, mirrored));
        for misreading in measured.map_or(&[][..], |test| test.station.misreadings()) {
            let reread = changed(&|_, values| (misreading.reread)(values));
            let words = misreading.words.to_string();
            let kind = match misreading.kind {
                MisreadingKind::Sign => SuggestionKind::ColumnSign,
                MisreadingKind::Unit => SuggestionKind::ColumnUnit,
                MisreadingKind::Order => SuggestionKind::ColumnsExchanged,
            };
            list.push(Hypothesis::new(kind, misreading.columns, words, reread));
        }
    }
    let scaled = |axes: &[usize], factor: f64| {
        with_readings(session, |_, positions, _| {
            for axis in axes {
                positions[*axis].iter_mut().for_each(|value| *value *= factor);
            }
        })
    };
    for kind in [AxisKind::Rotary, AxisKind::Linear] {
        let axes: Vec<usize> = (0..machine.axes.len()).filter(|k| machine.axes[*k].kind == kind).collect();
        let mut sets: Vec<Vec<usize>> = vec![axes.clone()];
        if axes.len() > 1 {
            sets.extend(axes.iter().map(|axis| vec![*axis]));
        }
        for set in sets.iter().filter(|set| !set.is_empty()) {
            let names: Vec<&str> = set.iter().map(|k| machine.axes[*k].name.as_str()).collect();
            let names = names.join(", ");
            for (factor, unit) in units(kind) {
                let words = format!("the positions of {names} are {unit}");
                list.push(Hypothesis::new(SuggestionKind::ColumnUnit, &names, words, scaled(set, factor)));
            }
            let words = format!("the positions of {names} have the opposite sign");
            list.push(Hypothesis::new(SuggestionKind::ColumnSign, &names, words, scaled(set, -1.0)));
        }
        list.extend(columns_exchanged(session, &axes));
    }
    list.extend(nearest(conventions(session)));
    list
}
