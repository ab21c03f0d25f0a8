//! Plausibility of the set-up: whether the bar spans its balls, the stylus is in front of its artefact, and the ball is
//! in its nest.

use super::Test;
use super::readings::Readings;
use crate::axis::AxisKind;
use crate::chain::{BodyErrors, Machine};
use crate::instrument::Station;

/// The sensor range is one to two millimetres for a ball bar and a few for an R-test. A larger deviation is not an
/// error of the machine, mm.
const MAX_MM: f64 = 5.0;

/// Balls that are closer to each other than this coincide, mm.
const MIN_MM: f64 = 1e-6;

/// The calibrated length of a ball bar; 0 for other instruments.
pub(crate) fn bar_mm(station: &Station<f64>) -> f64 {
    match station {
        Station::BallBar(bar) => bar.bar,
        _ => 0.0,
    }
}

/// Checks that the instrument nominally fits: the distance between the balls is the length of the bar, the stylus is in
/// front of its artefact, the ball is in its nest. If a single mistake in the positions of an axis (its sign, its unit)
/// explains the deviation, the help names it.
pub(crate) fn check(machine: &Machine, test: &Test, readings: &Readings) -> Result<(), (String, String)> {
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
    (1e3, "in m rather than mm"),
    (1e-3, "in µm rather than mm"),
    (25.4, "in inches rather than mm"),
    (0.0254, "in mil rather than mm"),
    (1.0 / 25.4, "in mm rather than inches"),
    (1.0 / 0.0254, "in mm rather than mil"),
];
/// Mistakes that are tried on rotary axes.
const ROTARY: [Mistake; 3] = [
    (-1.0, SIGN),
    (180.0 / std::f64::consts::PI, "in radians rather than degrees"),
    (std::f64::consts::PI / 180.0, "in degrees rather than radians"),
];

/// Largest number of readings on which mistakes are tried.
const MAX_TRIED: usize = 500;

/// The mistakes, of one axis or of all axes of a kind, whose correction makes the instrument fit.
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
        let nominal = bar_mm(&test.station);
        sum += reading.coordinates().iter().map(|x| (x - nominal).powi(2)).sum::<f64>();
    }
    (sum / readings.rows().max(1) as f64).sqrt()
}

fn check_nominal(machine: &Machine, test: &Test, readings: &Readings) -> Result<(), (String, String)> {
    let bar = match &test.station {
        Station::BallBar(bar) => bar,
        Station::Probe(_) => return check_stylus(machine, test, readings),
        Station::RTest(_) => return check_nest(machine, test, readings),
        Station::Tracker(_) | Station::Socket(_) => return Ok(()),
    };
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let mut state = Vec::new();
    let mut deviations: Vec<f64> = Vec::with_capacity(readings.rows());
    for row in 0..readings.rows() {
        readings.state(machine, row, &mut state);
        let length = bar.read::<f64>(machine, &state, &none, |_| None);
        // A length of zero has no direction, so that no error changes it to first order.
        if length < MIN_MM {
            return Err((
                format!(
                    "test \"{}\", reading {}: the two balls nominally coincide, but the bar is {:e} mm long",
                    test.name,
                    row + 1,
                    bar.bar
                ),
                "check `bar_mm`, the two ball positions and the axis positions in `at` and the data".into(),
            ));
        }
        deviations.push(length - bar.bar);
    }
    let nominal = bar.bar + median(&mut deviations);
    if (nominal - bar.bar).abs() <= MAX_MM {
        return Ok(());
    }
    Err((
        format!(
            "test \"{}\": a bar of {:.4} mm cannot reach between its balls, which nominally lie {nominal:.3} mm apart \
             (median of {} positions)",
            test.name,
            bar.bar,
            deviations.len()
        ),
        "possible causes are degrees read as radians (or radians as degrees), and a ball position, an axis position \
         in `at` or an axis direction that is not as on the machine"
            .into(),
    ))
}

/// Checks that the stylus is in front of the artefact and near it at every reading.
fn check_stylus(machine: &Machine, test: &Test, readings: &Readings) -> Result<(), (String, String)> {
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let mut state = Vec::new();
    for row in 0..readings.rows() {
        readings.state(machine, row, &mut state);
        let reading = test.station.read::<f64>(machine, &state, &none, |_| None);
        let distance = reading.coordinates()[0];
        if distance.abs() <= MAX_MM {
            continue;
        }
        let found = if distance.is_finite() {
            format!("is {distance:.3} mm from the artefact's nominal surface; the limit is {MAX_MM} mm")
        } else {
            "misses the artefact, or is on its axis without a `direction`".into()
        };
        return Err((
            format!("test \"{}\", reading {}: the stylus {found}", test.name, row + 1),
            "check `radius_mm` (including the stylus radius), `artefact_mm`, `stylus_mm`, `direction` and the axis \
             positions in `at` and the data"
                .into(),
        ));
    }
    Ok(())
}

/// Checks that the master ball is nominally in the nest at every reading.
fn check_nest(machine: &Machine, test: &Test, readings: &Readings) -> Result<(), (String, String)> {
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let mut state = Vec::new();
    for row in 0..readings.rows() {
        readings.state(machine, row, &mut state);
        let reading = test.station.read::<f64>(machine, &state, &none, |_| None);
        let apart = reading.coordinates().iter().map(|x| x * x).sum::<f64>().sqrt();
        if apart > MAX_MM {
            return Err((
                format!(
                    "test \"{}\", reading {}: the master ball nominally lies {apart:.3} mm from the centre of the sensors; the limit is {MAX_MM} mm",
                    test.name,
                    row + 1
                ),
                "check `workpiece_ball_mm`, `spindle_ball_mm` and the axis positions in `at` and the data: the linear axes must follow the rotary axis"
                    .into(),
            ));
        }
    }
    Ok(())
}

/// Checks that the readings are near the length of the bar, or within the range of an R-test's sensors.
pub(crate) fn check_lengths(test: &Test, readings: &Readings) -> Result<(), (String, String)> {
    let bar = match &test.station {
        Station::BallBar(bar) => bar,
        Station::RTest(_) => return check_sensors(test, readings),
        _ => return Ok(()),
    };
    let mut deviations: Vec<f64> = readings.observed.iter().map(|length| length - bar.bar).collect();
    let read = bar.bar + median(&mut deviations);
    if (read - bar.bar).abs() <= MAX_MM {
        return Ok(());
    }
    Err((
        format!(
            "test \"{}\": a bar of {:.4} mm read {read:.3} mm (median of {} readings)",
            test.name,
            bar.bar,
            deviations.len()
        ),
        "is the column a deviation from `bar_mm` rather than a length, or in another unit than its name says?".into(),
    ))
}

fn check_sensors(test: &Test, readings: &Readings) -> Result<(), (String, String)> {
    let mut sizes: Vec<f64> = readings.observed.iter().map(|value| value.abs()).collect();
    let read = median(&mut sizes);
    if read <= MAX_MM {
        return Ok(());
    }
    Err((
        format!(
            "test \"{}\": the sensors read {read:.3} mm (median of {} values); the limit is {MAX_MM} mm",
            test.name,
            sizes.len()
        ),
        "are the columns in another unit than their name says, or relative to another zero than the ball in the middle \
         of the nest?"
            .into(),
    ))
}

fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
