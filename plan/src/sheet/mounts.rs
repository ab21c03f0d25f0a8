//! What an operator mounts and changes before each test.

use abbe_model::chain::Machine;
use abbe_model::session::Test;

/// Lengths of the bar that differ by no more have the same extension, mm: calibration changes a length by less.
const SAME_MM: f64 = 1.0;

/// What has to be done before a test.
#[derive(Clone, Debug, PartialEq)]
pub struct Mounting {
    /// A sentence for each object.
    pub words: Vec<String>,
    /// Balls or devices that are mounted.
    pub mounted: usize,
    /// Whether the bar is assembled anew, or its extension put on, taken off or replaced.
    pub bar_changes: bool,
}

/// What has to be done before a test that follows others. `basic_mm` is the length of the bar without an extension.
pub(super) fn mounting(machine: &Machine, earlier: &[Test], test: &Test, basic_mm: Option<f64>) -> Mounting {
    let mut found = Mounting { words: Vec::new(), mounted: 0, bar_changes: false };
    let last = earlier.last();
    let shared = |of: fn(&Test) -> &str| earlier.iter().rev().find(|other| of(other) == of(test));
    let mut note = |thing: &str, other: Option<&Test>, stays: bool| match other {
        Some(other) if stays => found.words.push(format!("{thing}: stays as in test {}", other.name)),
        Some(other) => {
            found.mounted += 1;
            found.words.push(format!("{thing}: mount it again as in test {}", other.name));
        }
        None => {
            found.mounted += 1;
            found.words.push(format!("{thing}: mount it"));
        }
    };
    // Several balls can stand on the table; the spindle holds one.
    let in_spindle = last.is_some_and(|last| last.spindle_setup == test.spindle_setup);
    let groups: [(fn(&Test) -> &str, bool); 2] = [(|test| &test.setup, true), (|test| &test.spindle_setup, in_spindle)];
    for (point, (group, stays)) in test.station.points().iter().zip(groups) {
        if let Some(point) = point {
            let (first, rest) = point.name.split_at(1);
            let thing = format!("{}{rest}{}", first.to_uppercase(), point.target.mounted(machine));
            note(&thing, shared(group), stays);
        }
    }
    if let Some(beside) = test.station.handling().beside {
        // One stands; what stood elsewhere in between is set up again.
        note(&beside, shared(|test| &test.setup), last.is_some_and(|last| last.setup == test.setup));
    }
    if let Some(bar) = test.station.bar() {
        let (words, changes) = of_bar(earlier, test, bar.bar, basic_mm.unwrap_or(bar.bar));
        found.words.push(words);
        found.bar_changes = changes;
    }
    found
}

/// What is done to the bar, and whether that is a change.
fn of_bar(earlier: &[Test], test: &Test, bar_mm: f64, basic_mm: f64) -> (String, bool) {
    let extension = |mm: f64| Some(mm - basic_mm).filter(|extension| *extension > SAME_MM);
    let with = |mm: f64| match extension(mm) {
        Some(extension) => format!("with the extension of {extension:.0} mm"),
        None => "without an extension".to_string(),
    };
    let before = earlier.iter().rev().find_map(|other| Some((other, other.station.bar()?.bar)));
    let Some((last, last_mm)) = before else {
        return (format!("Bar: assemble it {}", with(bar_mm)), true);
    };
    if last.bar_setup == test.bar_setup {
        return (format!("Bar: stays assembled as in test {}", last.name), false);
    }
    let again = earlier.iter().rev().find(|other| other.bar_setup == test.bar_setup);
    let as_in = again.map_or(String::new(), |other| format!(", as in test {}", other.name));
    let words = match (extension(last_mm), extension(bar_mm)) {
        (None, Some(on)) => format!("Bar: put the extension of {on:.0} mm on{as_in}"),
        (Some(off), None) => format!("Bar: take the extension of {off:.0} mm off{as_in}"),
        (Some(off), Some(on)) if (on - off).abs() > SAME_MM => {
            format!("Bar: replace the extension of {off:.0} mm by that of {on:.0} mm{as_in}")
        }
        _ => format!("Bar: assemble it anew {}", with(bar_mm)),
    };
    (words, true)
}
