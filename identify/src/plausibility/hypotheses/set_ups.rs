//! Mistakes in the statements about balls, bars and readings.

use std::sync::Arc;

use abbe_model::instrument::SharedBy;
use abbe_model::session::{Prior, Session, Test};
use abbe_model::words::listed;

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
                    let [Some(workpiece), Some(spindle)] = test.station.points_mut() else { continue };
                    let ball = &mut (if of_workpiece { workpiece } else { spindle }).mm;
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
        reversed.clone(),
    ));
    for (number, test) in session.tests.iter().enumerate() {
        if test.readings.is_none() || measured(session).count() < 2 {
            continue;
        }
        let mut changed = session.clone();
        changed.tests[number].readings.clone_from(&reversed.tests[number].readings);
        list.push(Hypothesis::new(
            SuggestionKind::DeviationSign,
            &test.name,
            format!("the deviations of test {} have the opposite sign", test.name),
            changed,
        ));
    }
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

/// Lengths in inches: the factor by which they are off, and what their column then holds.
const INCHES: [(f64, &str); 2] = [
    (25.4, "in inches, not in mm, or in thousandths of an inch, not in µm"),
    (0.0254, "in millionths of an inch, not in µm"),
];

/// Columns of readings that are exchanged, and readings in inches.
pub(super) fn columns(session: &Session) -> Vec<Hypothesis> {
    let mut list: Vec<Hypothesis> = Vec::new();
    for misreading in measured(session).flat_map(|test| test.station.misreadings()) {
        if list.iter().any(|known| known.words == misreading.words) {
            continue;
        }
        let changed = with_readings(session, |test, _, observed| {
            if test.station.misreadings().iter().any(|own| own.words == misreading.words) {
                observed.chunks_exact_mut(test.station.channels().len()).for_each(misreading.reread);
            }
        });
        let words = misreading.words.to_string();
        list.push(Hypothesis::new(SuggestionKind::ColumnsExchanged, misreading.columns, words, changed));
    }
    if session.units().angles {
        return list;
    }
    list.extend(INCHES.map(|(factor, unit)| {
        let scaled = with_readings(session, |test, _, observed| {
            let from_mm = test.station.reference_mm();
            observed.iter_mut().for_each(|value| *value = from_mm + factor * (*value - from_mm));
        });
        let words = format!("the readings are {unit}");
        Hypothesis { factor, ..Hypothesis::new(SuggestionKind::ColumnUnit, "readings", words, scaled) }
    }));
    list
}

/// A mounted thing: its name, and what tests share its mount.
type Thing = (&'static str, SharedBy);

/// The mounted things whose place or length a session states with an uncertainty, with their mounts in the order of the tests.
fn mounted(session: &Session) -> Vec<(Thing, Vec<String>)> {
    let mut found: Vec<(Thing, Vec<String>)> = Vec::new();
    for test in measured(session) {
        for (unknown, prior) in test.station.kind().unknowns().iter().zip(&test.priors) {
            if !matches!(prior, Prior::Gaussian(_)) {
                continue;
            }
            let group = test.group(unknown.shared_by).to_string();
            match found.iter_mut().find(|((thing, _), _)| *thing == unknown.thing) {
                Some((_, groups)) if groups.contains(&group) => {}
                Some((_, groups)) => groups.push(group),
                None => found.push(((unknown.thing, unknown.shared_by), vec![group])),
            }
        }
    }
    found
}

/// Gives a thing in some tests a place or a length that may be any that is physical.
fn free(tests: &mut [Test], thing: &str, is_meant: impl Fn(&Test, SharedBy) -> bool) {
    for test in tests {
        for (place, same) in test.station.kind().unknowns().iter().enumerate() {
            if same.thing == thing
                && is_meant(test, same.shared_by)
                && let Prior::Gaussian(_) = test.priors[place]
            {
                test.priors[place] = Prior::Gaussian(physical_size(same.unit));
            }
        }
    }
}

/// What states a thing in a session file.
fn statement(thing: &str, several: bool) -> String {
    let is = if several { "are" } else { "is" };
    match thing {
        "bar" => {
            format!("{is} not as long as stated (by `bar_mm`, and in data with `length_mm` by the lengths themselves)")
        }
        "workpiece_ball" | "spindle_ball" => format!("{is} not where `{thing}_mm` states"),
        _ => format!("{is} not as stated"),
    }
}

/// Balls and bars that differ from their statements, and tests from another session.
pub(super) fn things(session: &Session) -> Vec<Hypothesis> {
    let mut list: Vec<Hypothesis> = Vec::new();
    for ((thing, _), groups) in mounted(session) {
        let name = thing.replace('_', " ");
        let all = (groups.len() > 1).then(|| groups.clone());
        for set in groups.into_iter().map(|group| vec![group]).chain(all) {
            let mut changed = session.clone();
            free(&mut changed.tests, thing, |test, by| set.iter().any(|group| group == test.group(by)));
            let several = set.len() > 1;
            let of = if set[0].is_empty() { String::new() } else { format!(" of {}", listed(&set, "and")) };
            let subject = if set[0].is_empty() { thing.to_string() } else { format!("{thing}[{}]", set.join("+")) };
            list.push(Hypothesis::new(
                SuggestionKind::WrongSetup,
                &subject,
                format!("the {name}{}{of} {}", if several { "s" } else { "" }, statement(thing, several)),
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

/// A thing that was moved or mounted anew between two tests that share its mount, for all tests from then on.
pub(super) fn moves(session: &Session) -> Vec<Hypothesis> {
    let mut list: Vec<Hypothesis> = Vec::new();
    for ((thing, by), groups) in mounted(session) {
        for group in groups {
            let of_mount: Vec<usize> = (0..session.tests.len())
                .filter(|number| session.tests[*number].readings.is_some() && session.tests[*number].group(by) == group)
                .collect();
            for (place, first) in of_mount.iter().enumerate().skip(1) {
                let mut changed = session.clone();
                let moved = format!("{group} from {}", session.tests[*first].name);
                for number in &of_mount[place..] {
                    let test = &mut changed.tests[*number];
                    match by {
                        SharedBy::Setup => test.setup.clone_from(&moved),
                        SharedBy::SpindleSetup => test.spindle_setup.clone_from(&moved),
                        SharedBy::BarSetup => test.bar_setup.clone_from(&moved),
                        SharedBy::Sensors | SharedBy::Socket | SharedBy::Session => continue,
                    }
                }
                free(&mut changed.tests, thing, |test, by| test.group(by) == moved);
                let tests: Vec<&str> =
                    of_mount[place..].iter().map(|number| session.tests[*number].name.as_str()).collect();
                list.push(Hypothesis::new(
                    SuggestionKind::SetupMoved,
                    &session.tests[*first].name,
                    format!(
                        "the {} of {group} was moved before test {}{}",
                        thing.replace('_', " "),
                        tests[0],
                        if tests.len() > 1 {
                            format!(", for {} too", listed(&tests[1..], "and"))
                        } else {
                            String::new()
                        }
                    ),
                    changed,
                ));
            }
        }
    }
    list
}
