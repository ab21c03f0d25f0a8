//! `abbe sheet`: one page for each test, and what stands on it. The pages are counted in the PDF of a browser.

use std::process::Command;

use crate::suite::{abbe, ready, text};

fn page(plan: &str, more: &[&str]) -> String {
    let plan = ready(plan);
    let fixed = ["sheet", text(&plan), "--out", "-"];
    let output = abbe(&fixed.iter().chain(more).copied().collect::<Vec<_>>());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn a_sheet_states_what_the_operator_sets_up() {
    let page = page("hermle-c600u/chapter5.toml", &[]);
    assert_eq!(page.matches("<section class=\"sheet\">").count(), 5);
    for expected in [
        "Test C150",
        "149.9946 mm",
        "with an extension of 50 mm",
        "Workpiece ball: stays as in test",
        "Both balls coincide at",
        "The origin of R is on the axes of C and A.",
        "Set the work offset that is active",
        "Tool length: from the spindle nose to the centre of the spindle ball",
        "Mount the bar at",
        "286 °/min",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    let bad = abbe(&["sheet", text(&ready("hermle-c600u/chapter5.toml")), "--out", "-", "--setup-min=-1"]);
    assert_eq!(bad.status.code(), Some(1));
}

/// The bar of Chapter 5 has 100, 150, 100, 150 mm: its extension goes on, off and on again.
#[test]
fn the_extension_goes_on_and_off_as_the_bars_ask() {
    let page = page("hermle-c600u/chapter5.toml", &[]);
    let tests: Vec<&str> = page.split("<section class=\"sheet\">").skip(2).collect();
    for (test, expected) in tests.iter().zip([
        "Bar: assemble it without an extension",
        "Bar: put the extension of 50 mm on<",
        "Bar: take the extension of 50 mm off<",
        "Bar: put the extension of 50 mm on<",
    ]) {
        assert!(test.contains(expected), "{expected}: {test}");
        assert_eq!(test.matches("Bar: ").count(), 1, "{test}");
    }
    // Four assemblies of the bar, 5 min each, two balls, a minute for each test.
    let minutes = |more: &[&str]| {
        let page = crate::suite::plan::sheet::page("hermle-c600u/chapter5.toml", more);
        let before = page.split("min of them before the motion").next().unwrap();
        before.rsplit(", ").next().unwrap().trim().parse::<f64>().unwrap()
    };
    assert_eq!((minutes(&[]), minutes(&["--bar-min", "12"])), (16.0, 23.0));
}

/// The sheets name the programs that `abbe nc` writes with the same options, and the start that they have.
#[test]
fn sheets_name_programs_and_where_they_start() {
    let page =
        page("hermle-c600u/chapter5.toml", &["--control", "fanuc", "--program-number", "7000", "--feed-in-mm", "2"]);
    for expected in ["main.nc, O7000", "A150.nc, O7002", "C100.nc, O7003", "Set G54, and leave it active"] {
        assert!(page.contains(expected), "{expected}");
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("programs");
    let plan = ready("hermle-c600u/chapter5.toml");
    let fixed = ["nc", text(&plan), "--control", "fanuc", "--program-number", "7000", "--feed-in-mm", "2", "--quiet"];
    assert!(abbe(&[&fixed[..], &["--out", text(&out)]].concat()).status.success());
    // The positions before the stop for the bar, in the order of the axes.
    let program = std::fs::read_to_string(out.join("C100.nc")).unwrap();
    let (before, _) = program.split_once("M0 (MOUNT THE BAR").unwrap();
    let mut at = std::collections::BTreeMap::new();
    for word in before.lines().filter(|line| line.starts_with("G1 ")).flat_map(|line| line.split(' ').skip(1)) {
        let (letter, value) = word.split_at(1);
        at.insert(letter.to_string(), value.parse::<f64>().unwrap_or(0.0));
    }
    let of_test = page.split("<h1>Test C100</h1>").nth(1).unwrap();
    let unit = |letter: &str| if "AC".contains(letter) { "°" } else { "\u{a0}mm" };
    for letter in ["C", "A", "Y", "X", "Z"] {
        let value = format!("{:.3}", at[letter]).replace('-', "−");
        let expected = format!("{letter}\u{a0}{value}{}", unit(letter));
        assert!(of_test.contains(&expected), "{expected}\n{of_test}");
    }
}

/// The balls coincide where the program centres them: with the rotary axes where its motion begins, overshoot included.
#[test]
fn the_sheet_centres_where_the_program_does() {
    let mut compared = 0;
    for plan in ["hermle-c600u/chapter5.toml", "table-and-head/session.toml", "tilting-head/session.toml"] {
        let page = page(plan, &["--control", "siemens"]);
        for test in page.split("<h1>Test ").skip(1) {
            let rotary = |words: &str| {
                let after = test.split_once(words)?.1;
                let text: String = after.split('<').filter(|part| part.contains('\u{a0}')).take(1).collect();
                let text = text.rsplit('>').next()?.to_string();
                let of_axis = |part: &str| {
                    let part = part.trim().trim_end_matches('.');
                    part.ends_with('°').then(|| part.to_string())
                };
                Some(text.split(", ").filter_map(of_axis).collect::<Vec<String>>())
            };
            let (Some(coincide), Some(begins)) = (rotary("Both balls coincide at "), rotary("Motion begins at")) else {
                continue;
            };
            assert!(!coincide.is_empty() && coincide == begins, "{plan}: {coincide:?} {begins:?}");
            compared += 1;
        }
    }
    assert!(compared > 3, "{compared}");
}

/// A travel of 10⁹ degrees is none, and a file is not replaced unasked.
#[test]
fn no_travel_is_not_stated_and_files_stay() {
    let page = page("r-test/plan.toml", &[]);
    assert!(page.contains("not stated") && !page.contains("1000000000"));
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("sheets.html");
    std::fs::write(&out, "mine").unwrap();
    let plan = ready("r-test/plan.toml");
    assert!(abbe(&["sheet", text(&plan), "--out", text(&out)]).status.success());
    assert!(std::fs::read_to_string(&out).unwrap().contains("<section"));
}

/// Robots and other instruments have sheets too.
#[test]
fn every_bundled_plan_has_sheets() {
    for plan in [
        "r-test/plan.toml",
        "tilting-head/session.toml",
        "table-and-head/session.toml",
        "self-calibration/session.toml",
    ] {
        let page = page(plan, &[]);
        assert!(page.matches("<section class=\"sheet\">").count() > 1, "{plan}");
    }
}

/// The sheets of an instrument say nothing of another: no ball and no bar of a laser, a level, a camera, a tracker.
#[test]
fn sheets_have_the_words_of_their_instrument() {
    for (plan, expected) in [
        ("laser/plan.toml", "Laser, its beam along X of R and aligned over the whole travel: mount it"),
        ("angle/plan.toml", "Sensor of angles, on the tool: it reads about Y and X of R: mount it"),
        ("distance/session.toml", "Station, fixed to the bed: its place is estimated"),
        ("pose/session.toml", "Measuring system, where it sees the target at every position"),
        ("pose/tracker.toml", "Laser tracker, where it sees the target at every position"),
    ] {
        let page = page(plan, &[]);
        assert!(page.contains(expected), "{plan}: {expected}\n{page}");
        let (_, body) = page.split_once("<body>").unwrap();
        let words = body.split(|c: char| !c.is_alphanumeric()).map(str::to_lowercase);
        let of_bars = words.filter(|word| matches!(&**word, "ball" | "balls" | "bar" | "bars")).count();
        assert_eq!(of_bars, 0, "{plan}\n{page}");
    }
    // A robot has no spindle, no work offset, no program and no pivot.
    let robot = page("pose/session.toml", &[]);
    for absent in ["spindle", "work offset", "single block", "Pivot", "control shows"] {
        assert!(!robot.contains(absent), "{absent}");
    }
    let probe = page("self-calibration/session.toml", &[]);
    assert!(probe.contains("in single block and without the stylus before it is trusted."), "{probe}");
    let r_test = page("r-test/plan.toml", &[]);
    assert!(r_test.contains("in single block and without the nest with the sensors before"), "{r_test}");
}

/// A motion that the axes cannot make is a warning on the sheet, and an error where a control is stated; options that belong to
/// a control need it.
#[test]
fn errors_of_the_motion_are_told() {
    // A stated overshoot leaves the travel.
    let plan = ready("laser/plan.toml");
    let fixed = ["sheet", text(&plan), "--out", "-", "--overshoot-mm", "2"];
    let expected = "axis `X` goes to -302.000 mm";
    let output = abbe(&fixed);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("no program can be written") && said.contains(expected), "{said}");
    assert!(String::from_utf8_lossy(&output.stdout).contains(expected));
    let output = abbe(&[&fixed[..], &["--control", "siemens"]].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains(expected), "{said}");
    for option in [&["--program-number", "7000"][..], &["--tool-point"]] {
        let output = abbe(&[&["sheet", text(&plan), "--out", "-"], option].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("--control <CONTROL>"), "{said}");
    }
}

/// Every label of the drawings is within them, on small machines and large ones.
#[test]
fn labels_stay_within_their_drawings() {
    // The axis of a trunnion ends at the edge of the drawing.
    let folder = tempfile::tempdir().unwrap();
    let made = folder.path().join("trunnion");
    let code = ["new", text(&made), "--from-code", "w A b X Y Z t", "--quiet"];
    assert!(abbe(&code).status.success());
    let made = made.join("plan.toml");
    let ready = ["hermle-c600u/chapter5.toml", "tilting-head/session.toml", "laser/plan.toml", "angle/plan.toml"];
    let plans = ready.into_iter().map(crate::suite::ready).chain([made]);
    let number = |tag: &str, name: &str| {
        let (_, rest) = tag.split_once(&format!(" {name}=\"")).unwrap();
        rest.split_once('"').unwrap().0.parse::<f64>().unwrap()
    };
    for plan in plans {
        let output = abbe(&["sheet", text(&plan), "--out", "-"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let page = String::from_utf8(output.stdout).unwrap();
        let mut labels = 0;
        for drawing in page.split("<svg").skip(1) {
            let (head, rest) = drawing.split_once('>').unwrap();
            let size = head.split_once("viewBox=\"0 0 ").unwrap().1.split_once('"').unwrap().0;
            let width: f64 = size.split(' ').next().unwrap().parse().unwrap();
            let drawing = rest.split_once("</svg>").unwrap().0;
            for label in drawing.split("<text").skip(1) {
                let (tag, words) = label.split_once('>').unwrap();
                if tag.contains("middle") {
                    continue;
                }
                let words = words.split_once('<').unwrap().0;
                // Letters of 12.5 units are 7 wide on average.
                let right = number(tag, "x") + 7.0 * words.chars().count() as f64;
                assert!(number(tag, "x") >= 0.0 && right <= width, "{}: {words} at {right} of {width}", plan.display());
                assert!(number(tag, "y") >= 10.0, "{}: {words}", plan.display());
                labels += 1;
            }
        }
        assert!(labels > 5, "{}", plan.display());
    }
}

#[test]
fn a_test_is_one_printed_page() {
    let Some(browser) = test_needs::browser("a_test_is_one_printed_page") else { return };
    let folder = tempfile::tempdir().unwrap();
    for (plan, tests) in [("hermle-c600u/chapter5.toml", 4), ("r-test/plan.toml", 3)] {
        let [html, pdf] = ["sheets.html", "sheets.pdf"].map(|name| folder.path().join(name));
        let page = page(plan, &[]);
        assert_eq!(page.matches("<section class=\"sheet\">").count(), tests + 1, "{plan}");
        std::fs::write(&html, page).unwrap();
        let run = Command::new(&browser)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--no-pdf-header-footer"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
            .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
            .arg(format!("--print-to-pdf={}", pdf.display()))
            .arg(format!("file://{}", html.display()))
            .output()
            .unwrap();
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let written = std::fs::read(&pdf).unwrap();
        let text = String::from_utf8_lossy(&written);
        let pages = text.matches("/Type /Page").count() - text.matches("/Type /Pages").count();
        assert_eq!(pages, tests + 1, "{plan}");
    }
}
