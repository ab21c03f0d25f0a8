//! The mistakes that are tried on a session that its readings contradict: each is a session with one statement changed.

use abbe_model::axis::AxisKind;
use abbe_model::instrument::Station;
use abbe_model::session::{Prior, Session, Test};

use super::results::SuggestionKind;
use crate::parameters::physical_size;

/// A session with one statement changed.
pub(super) struct Hypothesis {
    pub kind: SuggestionKind,
    pub subject: String,
    pub words: String,
    pub session: Session,
}

impl Hypothesis {
    pub fn new(kind: SuggestionKind, subject: &str, words: String, session: Session) -> Hypothesis {
        let subject = subject.to_string();
        Hypothesis {
            kind,
            subject,
            words,
            session,
        }
    }
}

/// Coordinates of balls below this are zero, mm.
const ZERO_MM: f64 = 1e-6;
/// Corrections of a bar's calibration between these are plausible, mm.
const CORRECTIONS_MM: [f64; 2] = [1e-3, 0.5];

/// The mistakes that are tried where an instrument reads between table and tool.
pub(super) fn of_two_sides(session: &Session) -> Vec<Hypothesis> {
    let mut list = axes(session);
    list.extend(balls(session));
    list.extend(readings(session));
    list.extend(setups(session));
    list
}

/// Applies a change to the readings of every test; positions by axis, observed values in mm.
pub(super) fn with_readings(
    session: &Session,
    change: impl Fn(&Test, &mut Vec<Vec<f64>>, &mut Vec<f64>),
) -> Session {
    let mut changed = session.clone();
    for (test, stated) in changed.tests.iter_mut().zip(&session.tests) {
        if let Some(readings) = &mut test.readings {
            change(stated, &mut readings.positions, &mut readings.observed);
        }
    }
    changed
}

/// Axes reversed, exchanged, or read in another unit.
fn axes(session: &Session) -> Vec<Hypothesis> {
    let machine = &session.machine;
    let is_used = |axis: &usize| {
        let readings = session.tests.iter().filter_map(|test| test.readings.as_ref());
        let mut positions = readings.flat_map(|readings| &readings.positions[*axis]);
        positions.any(|position| position.abs() > ZERO_MM)
    };
    let used: Vec<usize> = (0..machine.axes.len()).filter(is_used).collect();
    let mut list = Vec::new();
    for &k in &used {
        let mut changed = session.clone();
        changed.machine.axes[k].direction = machine.axes[k].direction.map(|along| -along);
        let name = &machine.axes[k].name;
        list.push(Hypothesis::new(
            SuggestionKind::AxisReversed,
            name,
            format!("the direction of axis {name} is reversed"),
            changed,
        ));
    }
    let rotary: Vec<usize> = (0..machine.axes.len())
        .filter(|k| machine.axes[*k].kind == AxisKind::Rotary)
        .collect();
    for (place, &first) in rotary.iter().enumerate() {
        for &second in &rotary[place + 1..] {
            let mut changed = session.clone();
            changed.machine.axes.swap(first, second);
            for test in &mut changed.tests {
                test.at.swap(first, second);
                if test.at_written.len() > second {
                    test.at_written.swap(first, second);
                }
                if let Some(readings) = &mut test.readings {
                    readings.positions.swap(first, second);
                }
            }
            let names = [first, second].map(|k| machine.axes[k].name.as_str());
            list.push(Hypothesis::new(
                SuggestionKind::AxesExchanged,
                &names.join(", "),
                format!("axes {} and {} are exchanged in the chain", names[0], names[1]),
                changed,
            ));
        }
    }
    for kind in [AxisKind::Rotary, AxisKind::Linear] {
        let of_kind: Vec<usize> = used
            .iter()
            .copied()
            .filter(|k| machine.axes[*k].kind == kind)
            .collect();
        if of_kind.is_empty() {
            continue;
        }
        let names: Vec<&str> = of_kind.iter().map(|k| machine.axes[*k].name.as_str()).collect();
        for (factor, unit) in units(kind) {
            let changed = with_readings(session, |_, positions, _| {
                of_kind
                    .iter()
                    .for_each(|k| positions[*k].iter_mut().for_each(|value| *value *= factor));
            });
            list.push(Hypothesis::new(
                SuggestionKind::ColumnUnit,
                &names.join(", "),
                format!("the positions of {} are {unit}", names.join(", ")),
                changed,
            ));
        }
    }
    list
}

/// Factors by which positions are off where their unit is another, and what the column then holds.
pub(super) fn units(kind: AxisKind) -> Vec<(f64, &'static str)> {
    match kind {
        AxisKind::Rotary => vec![
            (180.0 / std::f64::consts::PI, "in radians, not in degrees"),
            (std::f64::consts::PI / 180.0, "in degrees, not in radians"),
        ],
        AxisKind::Linear => lengths().to_vec(),
    }
}

/// The same for lengths.
pub(super) fn lengths() -> [(f64, &'static str); 4] {
    [
        (1e3, "1,000 times too small: in m, not in mm, or in mm, not in µm"),
        (
            1e-3,
            "1,000 times too large: in µm, not in mm, or in mm, not in m",
        ),
        (25.4, "in inches, not in mm"),
        (1.0 / 25.4, "in mm, not in inches"),
    ]
}

/// Balls on the other side.
fn balls(session: &Session) -> Vec<Hypothesis> {
    let mut list = Vec::new();
    for (thing, of_workpiece) in [("workpiece ball", true), ("spindle ball", false)] {
        let group = |test: &Test| {
            if of_workpiece {
                test.setup.clone()
            } else {
                test.spindle_setup.clone()
            }
        };
        let mut groups: Vec<Vec<String>> = Vec::new();
        for test in measured(session) {
            if !groups.contains(&vec![group(test)]) {
                groups.push(vec![group(test)]);
            }
        }
        if groups.len() > 1 {
            groups.push(groups.concat());
        }
        for members in groups {
            for (i, letter) in ["x", "y", "z"].into_iter().enumerate() {
                let mut changed = session.clone();
                let mut stated_mm = None;
                for test in changed
                    .tests
                    .iter_mut()
                    .filter(|test| members.contains(&group(test)))
                {
                    let ball = match &mut test.station {
                        Station::BallBar(bar) if of_workpiece => &mut bar.workpiece_ball,
                        Station::BallBar(bar) => &mut bar.spindle_ball,
                        Station::RTest(rtest) if of_workpiece => &mut rtest.workpiece_ball,
                        Station::RTest(rtest) => &mut rtest.spindle_ball,
                        Station::Probe(_) | Station::Tracker(_) | Station::Socket(_) => continue,
                    };
                    if ball[i].abs() > ZERO_MM {
                        stated_mm = stated_mm.or(Some(ball[i]));
                        ball[i] = -ball[i];
                    }
                }
                let Some(stated_mm) = stated_mm else { continue };
                let names = members.join(", ");
                let side = if stated_mm > 0.0 { "−" } else { "+" };
                list.push(Hypothesis::new(
                    SuggestionKind::BallMirrored,
                    &names,
                    format!(
                        "the {thing} of {names} lies at {letter} = {side}{:.3} mm, not at {stated_mm:.3} mm",
                        stated_mm.abs()
                    ),
                    changed,
                ));
            }
        }
    }
    list
}

/// Readings of the opposite sign, and bars whose calibration was applied with the opposite sign.
fn readings(session: &Session) -> Vec<Hypothesis> {
    let mut list = Vec::new();
    let reversed = with_readings(session, |test, _, observed| {
        let twice_mm = match &test.station {
            Station::BallBar(bar) => 2.0 * bar.bar,
            _ => 0.0,
        };
        observed.iter_mut().for_each(|value| *value = twice_mm - *value);
    });
    list.push(Hypothesis::new(
        SuggestionKind::DeviationSign,
        "session",
        "the deviations have the opposite sign".to_string(),
        reversed,
    ));
    let mut bars_mm: Vec<f64> = Vec::new();
    for test in measured(session) {
        if let Station::BallBar(bar) = &test.station
            && !bars_mm.contains(&bar.bar)
        {
            bars_mm.push(bar.bar);
        }
    }
    bars_mm.retain(|length| {
        let correction = (length - length.round()).abs();
        (CORRECTIONS_MM[0]..CORRECTIONS_MM[1]).contains(&correction)
    });
    let mut sets: Vec<Vec<f64>> = bars_mm.iter().map(|length| vec![*length]).collect();
    if bars_mm.len() > 1 {
        sets.push(bars_mm);
    }
    for set in sets {
        let mut changed = session.clone();
        for test in &mut changed.tests {
            let (Station::BallBar(bar), Some(readings)) = (&mut test.station, &mut test.readings) else {
                continue;
            };
            if set.contains(&bar.bar) {
                let other = 2.0 * bar.bar.round() - bar.bar;
                readings
                    .observed
                    .iter_mut()
                    .for_each(|value| *value += other - bar.bar);
                bar.bar = other;
            }
        }
        let each = |to: &dyn Fn(f64) -> f64| {
            let lengths: Vec<String> = set
                .iter()
                .map(|length| format!("{:.4} mm", to(*length)))
                .collect();
            lengths.join(" and ")
        };
        let stated = each(&|length| length);
        list.push(Hypothesis::new(
            SuggestionKind::BarCalibrationSign,
            &stated,
            format!(
                "the bar of {stated} is {} long: the correction of its calibration has the opposite sign",
                each(&|length| 2.0 * length.round() - length)
            ),
            changed,
        ));
    }
    list
}

/// Things of the set-up that are not where they are stated, and tests from another session.
fn setups(session: &Session) -> Vec<Hypothesis> {
    let unknowns = session.instrument.unknowns();
    let mut list: Vec<Hypothesis> = Vec::new();
    for test in measured(session) {
        for (place, unknown) in unknowns.iter().enumerate() {
            if !matches!(test.priors[place], Prior::Gaussian(_)) {
                continue;
            }
            let group = test.group(unknown.shared_by);
            let subject = if group.is_empty() {
                unknown.thing.to_string()
            } else {
                format!("{}[{group}]", unknown.thing)
            };
            if list.iter().any(|other| other.subject == subject) {
                continue;
            }
            let mut changed = session.clone();
            for other in &mut changed.tests {
                for (place, same) in unknowns.iter().enumerate() {
                    let is_meant = same.thing == unknown.thing && other.group(same.shared_by) == group;
                    if is_meant && let Prior::Gaussian(_) = other.priors[place] {
                        other.priors[place] = Prior::Gaussian(physical_size(same.unit));
                    }
                }
            }
            let thing = unknown.thing.replace('_', " ");
            let of = if group.is_empty() {
                String::new()
            } else {
                format!(" of {group}")
            };
            list.push(Hypothesis::new(
                SuggestionKind::WrongSetup,
                &subject,
                format!("the {thing}{of} is not as it is stated"),
                changed,
            ));
        }
    }
    for (number, test) in session.tests.iter().enumerate() {
        if test.readings.is_none() || measured(session).count() < 2 {
            continue;
        }
        let mut changed = session.clone();
        let alone = &mut changed.tests[number];
        let own = format!("{} alone", test.name);
        alone.setup.clone_from(&own);
        alone.spindle_setup.clone_from(&own);
        alone.bar_setup = own;
        for (prior, unknown) in alone.priors.iter_mut().zip(unknowns) {
            if let Prior::Gaussian(_) = prior {
                *prior = Prior::Gaussian(physical_size(unknown.unit));
            }
        }
        list.push(Hypothesis::new(
            SuggestionKind::OtherSession,
            &test.name,
            format!(
                "the readings of test {} were taken with another set-up or in another session",
                test.name
            ),
            changed,
        ));
    }
    list
}

/// The tests with readings.
fn measured(session: &Session) -> impl Iterator<Item = &Test> {
    session.tests.iter().filter(|test| test.readings.is_some())
}
