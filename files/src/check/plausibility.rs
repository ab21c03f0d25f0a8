//! Plausibility of the set-up: whether the bar spans its balls, the stylus is in front of its artefact, and the ball is
//! in its nest.

use abbe_model::axis::AxisKind;
use abbe_model::chain::{BodyErrors, Machine};
use abbe_model::instrument::{Checked, Fault};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Prior, Test};
use abbe_model::unit::Unit;

/// Checks that the instrument nominally fits: the distance between the balls is the length of the bar, the stylus is in
/// front of its artefact, the ball is in its nest. If a single mistake in the positions of an axis (its sign, its unit, its
/// column) explains the deviation, the help names it.
pub(super) fn check(machine: &Machine, test: &Test, readings: &Readings) -> Result<(), Fault> {
    let Err((message, help)) = check_nominal(machine, test, readings) else {
        return Ok(());
    };
    let help = match mistakes(machine, test, readings) {
        found if found.is_empty() => help,
        found => format!("it would fit if {}; {help}", found.join(", or if ")),
    };
    Err((message, help))
}

/// The factor by which a mistake changes the positions of an axis, and its description.
type Mistake = (f64, &'static str);

const SIGN: &str = "with the opposite sign (check its `direction` and its column)";
/// Mistakes that are tried on linear axes. Sign and unit errors both multiply the positions by a factor.
const LINEAR: [Mistake; 7] = [
    (-1.0, SIGN),
    (Unit::Metre.internal(), "in m rather than mm"),
    (Unit::Micrometre.internal(), "in µm rather than mm"),
    (Unit::Inch.internal(), "in inches rather than mm"),
    (Unit::Mil.internal(), "in mil rather than mm"),
    (Unit::Inch.per_internal(), "in mm rather than inches"),
    (Unit::Mil.per_internal(), "in mm rather than mil"),
];
/// Mistakes that are tried on rotary axes.
const ROTARY: [Mistake; 3] = [
    (-1.0, SIGN),
    (Unit::Degree.per_internal(), "in radians rather than degrees"),
    (Unit::Degree.internal(), "in degrees rather than radians"),
];

/// Largest number of readings on which mistakes are tried.
const MAX_TRIED: usize = 500;

/// The mistakes, of one axis, of all axes of a kind, or of two exchanged columns, whose correction makes the instrument fit.
fn mistakes(machine: &Machine, test: &Test, readings: &Readings) -> Vec<String> {
    let rows: Vec<usize> = (0..readings.rows()).step_by(readings.rows().div_ceil(MAX_TRIED).max(1)).collect();
    let readings = readings.of_rows(&rows);
    let matters = |axis: usize| readings.positions[axis].iter().any(|q| *q != 0.0);
    let mut found: Vec<(f64, String)> = Vec::new();
    for (kind, mistakes) in [(AxisKind::Linear, &LINEAR[..]), (AxisKind::Rotary, &ROTARY[..])] {
        let axes: Vec<usize> =
            (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == kind && matters(*axis)).collect();
        let together = (axes.len() > 1).then(|| axes.clone());
        let groups = axes.iter().map(|axis| vec![*axis]).chain(together);
        for group in groups.collect::<Vec<_>>() {
            let names: Vec<&str> = group.iter().map(|axis| machine.axes[*axis].name.as_str()).collect();
            for (factor, words) in mistakes {
                let mut corrected = readings.clone();
                for axis in &group {
                    for position in &mut corrected.positions[*axis] {
                        *position *= factor;
                    }
                }
                if check_nominal(machine, test, &corrected).is_ok() {
                    let description = format!("the positions of {} were read {words}", names.join(" and "));
                    found.push((misfit(machine, test, &corrected), description));
                }
            }
        }
    }
    for first in 0..machine.axes.len() {
        for second in first + 1..machine.axes.len() {
            let [one, other] = [first, second].map(|axis| &machine.axes[axis]);
            if one.kind != other.kind || !(matters(first) || matters(second)) {
                continue;
            }
            let mut corrected = readings.clone();
            corrected.positions.swap(first, second);
            if check_nominal(machine, test, &corrected).is_ok() {
                let description = format!("the columns of {} and {} were exchanged", one.name, other.name);
                found.push((misfit(machine, test, &corrected), description));
            }
        }
    }
    // A scale that nearly stops an axis makes many set-ups fit, so only corrections about as good as the best are kept.
    let best = found.iter().map(|(misfit, _)| *misfit).fold(f64::INFINITY, f64::min);
    found.retain(|(misfit, _)| *misfit <= EQUIVALENT_FACTOR * best + EQUIVALENT_MM);
    found.into_iter().map(|(_, description)| description).collect()
}

/// Corrections are equivalent if their misfits differ by less than this factor and this length, mm.
const EQUIVALENT_FACTOR: f64 = 2.0;
const EQUIVALENT_MM: f64 = 0.05;

/// Nominal misfit of the instrument, mm: rms over the readings.
fn misfit(machine: &Machine, test: &Test, readings: &Readings) -> f64 {
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let mut state = Vec::new();
    let mut sum = 0.0;
    for row in 0..readings.rows() {
        readings.state(machine, row, &mut state);
        let reading = test.station.read::<f64>(machine, &state, &none, |_| None);
        let nominal = test.station.reference_mm();
        sum += reading.channels().iter().map(|x| (x - nominal).powi(2)).sum::<f64>();
    }
    (sum / readings.rows().max(1) as f64).sqrt()
}

/// A point without a prior may be anywhere: the fit finds it.
fn check_nominal(machine: &Machine, test: &Test, readings: &Readings) -> Result<(), Fault> {
    let is_free = |first: usize| test.priors.iter().skip(first).take(3).any(|prior| *prior == Prior::Free);
    if test.station.points().iter().flatten().any(|point| is_free(point.first)) {
        return Ok(());
    }
    test.station.check_set_up(&Checked { machine, test: &test.name, readings })
}
