//! Mistakes in the statements about balls, bars and readings.

use std::sync::Arc;

use abbe_model::session::{Prior, Session, Test};

use super::super::results::SuggestionKind;
use super::{Hypothesis, ZERO_MM, measured, with_readings};
use crate::parameters::physical_size;

/// Plausible range of the correction of a bar's calibration, mm.
const CORRECTIONS_MM: [f64; 2] = [1e-3, 0.5];

/// Balls on the other side.
pub(super) fn balls(session: &Session) -> Vec<Hypothesis> {
    let mut list = Vec::new();
    for (thing, of_workpiece) in [("workpiece ball", true), ("spindle ball", false)] {
        let group = |test: &Test| {
            if of_workpiece { test.setup.clone() } else { test.spindle_setup.clone() }
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
                for test in changed.tests.iter_mut().filter(|test| members.contains(&group(test))) {
                    let Some([workpiece, spindle]) = test.station.balls_mut() else { continue };
                    let ball = if of_workpiece { workpiece } else { spindle };
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
pub(super) fn readings(session: &Session) -> Vec<Hypothesis> {
    let mut list = Vec::new();
    let reversed = with_readings(session, |test, _, observed| {
        let twice_mm = 2.0 * test.station.reference_mm();
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
        if let Some(bar) = test.station.bar()
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
            let (Some(bar), Some(readings)) = (test.station.bar_mut(), test.readings.as_mut().map(Arc::make_mut))
            else {
                continue;
            };
            if set.contains(&bar.bar) {
                let other = 2.0 * bar.bar.round() - bar.bar;
                readings.observed.iter_mut().for_each(|value| *value += other - bar.bar);
                bar.bar = other;
            }
        }
        let each = |to: &dyn Fn(f64) -> f64| {
            let lengths: Vec<String> = set.iter().map(|length| format!("{:.4} mm", to(*length))).collect();
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

/// Balls and bars that differ from their statements, and tests from another session.
pub(super) fn things(session: &Session) -> Vec<Hypothesis> {
    let mut list: Vec<Hypothesis> = Vec::new();
    for test in measured(session) {
        for (place, unknown) in test.station.kind().unknowns().iter().enumerate() {
            if !matches!(test.priors[place], Prior::Gaussian(_)) {
                continue;
            }
            let group = test.group(unknown.shared_by);
            let subject =
                if group.is_empty() { unknown.thing.to_string() } else { format!("{}[{group}]", unknown.thing) };
            if list.iter().any(|other| other.subject == subject) {
                continue;
            }
            let mut changed = session.clone();
            for other in &mut changed.tests {
                for (place, same) in other.station.kind().unknowns().iter().enumerate() {
                    let is_meant = same.thing == unknown.thing && other.group(same.shared_by) == group;
                    if is_meant && let Prior::Gaussian(_) = other.priors[place] {
                        other.priors[place] = Prior::Gaussian(physical_size(same.unit));
                    }
                }
            }
            let thing = unknown.thing.replace('_', " ");
            let of = if group.is_empty() { String::new() } else { format!(" of {group}") };
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
        for (prior, unknown) in alone.priors.iter_mut().zip(test.station.kind().unknowns()) {
            if let Prior::Gaussian(_) = prior {
                *prior = Prior::Gaussian(physical_size(unknown.unit));
            }
        }
        list.push(Hypothesis::new(
            SuggestionKind::OtherSession,
            &test.name,
            format!("the readings of test {} were taken with another set-up or in another session", test.name),
            changed,
        ));
    }
    list
}
