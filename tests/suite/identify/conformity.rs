//! `[tolerance]`: decisions of conformity in every output, and limits that cannot be used. Shares of wrong decisions are
//! tested in `conformity_shares.rs`.

use serde_json::Value;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::suite::{abbe, ready, text};

/// The bundled session with limits.
fn with_limits(folder: &std::path::Path, limits: &str) -> std::path::PathBuf {
    let measured = ready("hermle-c600u/measured/session.toml");
    for entry in std::fs::read_dir(measured.parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
    }
    let file = folder.join("session.toml");
    let session = std::fs::read_to_string(measured).unwrap();
    std::fs::write(&file, format!("{session}\n{limits}")).unwrap();
    file
}

/// The effect that the bundled session does not declare.
const EFFECT: &str = "[[effect]]\ncomponent = \"EZC\"\nshape = \"harmonic\"\norder = 2\n";

fn json(command: &str, session: &std::path::Path, more: &[&str]) -> Value {
    let file = session.with_extension("json");
    let fixed = [command, text(session), "--quiet", "--json", text(&file)];
    let run = abbe(&fixed.iter().chain(more).copied().collect::<Vec<_>>());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap()
}

/// Every decision follows from value, uncertainty and limits of the document by the normal distribution.
#[test]
fn decisions_follow_from_value_and_uncertainty() {
    let folder = tempfile::tempdir().unwrap();
    let limits = "[tolerance]\nprobability = 0.95\n[tolerance.errors]\nEY0A_um = 60\nEX0C_um = [-0.01, 0.01]\nEB0A_um_m = 1\n\
                  EC0B_arcsec = 5\n[tolerance.tests.C150]\nbidirectional_circular_deviation_um = 20\nradial_deviation_um = 50\n\
                  synchronous_error_motion_um = 0.1\nasynchronous_error_motion_um = 0.2\ninstrument_u_um = 0.2\n";
    let session = with_limits(folder.path(), &(limits.replace("EC0B_arcsec = 5\n", "") + EFFECT));
    let fit = json("fit", &session, &[]);
    let normal = Normal::standard();
    let items = fit["conformity"]["items"].as_array().unwrap();
    assert_eq!(items.len(), 7);
    let mut decisions = Vec::new();
    for item in items {
        let number = |key: &str| item[key].as_f64();
        let (Some(value), Some(u)) = (number("value"), number("u")) else {
            // The bar is not radial to the axis.
            assert!(item["id"].as_str().unwrap().contains("synchronous_error_motion"), "{item}");
            assert_eq!(item["decision"], "undecided", "{item}");
            assert!(item["why"].as_str().unwrap().contains("the bar radial to the axis"), "{item}");
            decisions.push("undecided");
            continue;
        };
        let (lower, upper) = (number("lower").unwrap_or(f64::NEG_INFINITY), number("upper").unwrap());
        let inside = normal.cdf((upper - value) / u) - normal.cdf((lower - value) / u);
        assert!((inside - number("conformance_probability").unwrap()).abs() < 1e-9, "{item}");
        let beyond = value > upper + 1.6449 * u || value < lower - 1.6449 * u;
        let expected = if inside >= 0.95 {
            "pass"
        } else if beyond {
            "fail"
        } else {
            "undecided"
        };
        assert_eq!(item["decision"], expected, "{item}");
        decisions.push(expected);
    }
    // The three decisions occur.
    assert_eq!(decisions[0], "pass");
    assert!(decisions.contains(&"fail") && decisions.contains(&"undecided"), "{decisions:?}");
    assert_eq!(fit["conformity"]["verdict"], "fail");
    // 1 µm/m is 1 µrad.
    let slope = &items[2];
    assert!((slope["upper"].as_f64().unwrap() - 0.206_265).abs() < 1e-5, "{slope}");
    let trace = json("trace", &session, &["--only", "EZC~C:h"]);
    assert_eq!(trace["conformity"]["items"].as_array().unwrap().len(), 7);
    // Without the effect the model is not complete: no parameter is decided, and figures of tests are as before.
    let incomplete = tempfile::tempdir().unwrap();
    let incomplete = with_limits(incomplete.path(), &limits.replace("EC0B_arcsec = 5\n", ""));
    let fit = json("fit", &incomplete, &[]);
    for (item, before) in fit["conformity"]["items"].as_array().unwrap().iter().zip(items) {
        if item["id"].as_str().unwrap().contains('[') {
            assert_eq!(item["decision"], before["decision"], "{item}");
        } else {
            assert_eq!(item["decision"], "undecided", "{item}");
            assert!(item["why"].as_str().unwrap().contains("the model lacks an effect"), "{item}");
        }
    }
}

#[test]
fn decisions_stand_on_the_terminal_in_csv_and_in_the_report() {
    let folder = tempfile::tempdir().unwrap();
    let session = with_limits(folder.path(), "[tolerance.errors]\nEY0A_um = 60\n\"EZC~C:h2.amplitude_um\" = 3\n");
    let [csv, page] = ["fit.csv", "fit.html"].map(|name| folder.path().join(name));
    let run = abbe(&["fit", text(&session), "--csv", text(&csv), "--report", text(&page)]);
    let shown = String::from_utf8_lossy(&run.stdout).into_owned();
    let sentence = "undecided: 0 of 2 items pass, 0 fail, 2 undecided (rule of ISO 14253-1, probability 95 %)";
    assert!(shown.contains(&format!("Conformity: {sentence}")), "{shown}");
    assert!(
        shown.contains("EZC~C:h2.amplitude is not identifiable from these readings, or is no parameter"),
        "{shown}"
    );
    let csv = std::fs::read_to_string(csv).unwrap();
    assert!(csv.contains("conformity,EY0A,undecided,"), "{csv}");
    assert!(std::fs::read_to_string(page).unwrap().contains("<section id=\"conformity\">"));
    // The effect has a value after the trace.
    let trace = json("trace", &session, &["--only", "EZC~C:h"]);
    assert_eq!(trace["conformity"]["verdict"], "pass", "{}", trace["conformity"]);
}

#[test]
fn limits_that_cannot_be_used_are_errors_at_their_line() {
    for (limits, expected) in [
        ("[tolerance]\nprobability = 0.4\n", "`probability` is 0.4"),
        ("[tolerance.errors]\nEY0A = 5\n", "`EY0A` of [tolerance.errors] has no unit"),
        ("[tolerance.errors]\nEY0A_arcsec = 5\n", "`EY0A` is a length"),
        ("[tolerance.errors]\nEZ0X_um = 5\n", "`EZ0X` has a limit, but the session does not estimate it"),
        ("[tolerance.errors]\nnonsense_um = 5\n", "`nonsense` of [tolerance.errors] is not the name of an error"),
        ("[tolerance.errors]\nEY0A_um = [5, -5]\n", "is not a number above 0 or a list"),
        ("[tolerance.errors]\nEY0A_um = 5\ne_y0a_mm = 1\n", "EY0A has two limits"),
        ("[tolerance.tests.C151]\nhysteresis_um = 5\n", "names the test `C151`, which the session does not have"),
        ("[tolerance.tests.C150]\nhysteresis_mm = 5\n", "has the unknown key `hysteresis_mm`"),
        ("[tolerance.tests.C150]\nhysteresis_um = -5\n", "must be greater than 0"),
        ("[tolerance.tests.C150]\ninstrument_u_um = -5\n", "cannot be negative"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let session = with_limits(folder.path(), limits);
        let run = abbe(&["fit", text(&session)]);
        let message = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(1), "{limits}: {message}");
        assert!(message.replace('\n', " ").contains(expected), "{limits}: {message}");
        assert!(message.contains("session.toml:"), "{message}");
    }
}
