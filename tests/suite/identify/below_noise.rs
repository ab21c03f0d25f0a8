//! A residual far below the noise is not judged: nothing passes, is certified or needs no correction. Readings of the
//! independent simulator, whose files name a wrong unit.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::plant::{Kind, Noise, Recipe, SimulatedSession};
use crate::suite::identify::result_and_screen;
use crate::suite::{abbe, text};

const LIMITS: &str = "[tolerance.errors]\nEX0C_um = 1000\nEB0C_arcsec = 500\n[tolerance.tests.C150]\n\
                      bidirectional_circular_deviation_um = 900\ninstrument_u_um = 0.2\n";

fn drawn(noise_um: f64) -> SimulatedSession {
    Recipe::new(Kind::Rotary, 31).readings(400).noise(Noise::White { sigma_um: noise_um }).draw()
}

fn written(folder: &Path, session: &SimulatedSession) -> std::path::PathBuf {
    session.write(folder).unwrap();
    let file = folder.join("session.toml");
    let own = fs::read_to_string(&file).unwrap();
    fs::write(&file, own + LIMITS).unwrap();
    file
}

/// The bar that the session states for a test.
fn bar_mm(session: &SimulatedSession, test: &str) -> f64 {
    let (_, toml) = session.files.iter().find(|(name, _)| name == "session.toml").unwrap();
    let (_, of_test) = toml.split_once(&format!("name = \"{test}\"")).unwrap();
    let (_, of_bar) = of_test.split_once("bar_mm = ").unwrap();
    of_bar.lines().next().unwrap().parse().unwrap()
}

/// The lengths as deviations in another unit, in a column that states µm.
fn under_um(session: &mut SimulatedSession, unit_mm: f64) {
    let bars: Vec<Option<f64>> =
        (session.files.iter()).map(|(name, _)| name.strip_suffix(".csv").map(|test| bar_mm(session, test))).collect();
    for ((_, data), bar_mm) in session.files.iter_mut().zip(bars) {
        let Some(bar_mm) = bar_mm else { continue };
        let lines = data.lines().map(|line| {
            let (rest, last) = line.rsplit_once(',').unwrap();
            match last.parse::<f64>() {
                Ok(length_mm) => format!("{rest},{:.4}\n", (length_mm - bar_mm) / unit_mm),
                Err(_) => format!("{rest},deviation_um\n"),
            }
        });
        *data = lines.collect();
    }
}

fn nothing_passes(found: &Value, screen: &str, why: &str) {
    let good = &found["statements"]["good"];
    assert_eq!((&good["goodness"]["verdict"], &good["goodness"]["not_judged"]), (&"not-judged".into(), &why.into()));
    assert_ne!(good["decision"], "pass");
    for said in ["all limits pass", "What to correct: nothing;"] {
        assert!(!screen.contains(said), "{screen}");
    }
}

/// A certificate is refused for this reason.
fn no_certificate(session: &Path, why: &str) {
    fs::write(session.with_file_name("certificate.toml"), abbe::certificate::EXAMPLE).unwrap();
    let out = session.with_file_name("certificate.xml");
    let run = abbe(&["fit", text(session), "--dcc", text(&out)]);
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(!run.status.success() && !out.exists() && said.contains(why), "{said}");
}

#[test]
fn deviations_in_mm_under_um_pass_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = drawn(0.3);
    under_um(&mut session, 1.0);
    let file = written(folder.path(), &session);
    for command in ["fit", "trace"] {
        let (found, screen) = result_and_screen(command, &file, &[]);
        nothing_passes(&found, &screen, "wrong-unit");
        for item in found["conformity"]["items"].as_array().unwrap() {
            assert_eq!(item["decision"], "undecided", "{command}: {item}");
        }
        for parameter in found["parameters"].as_array().into_iter().flatten() {
            assert_eq!(parameter["quotable"], false, "{parameter}");
        }
        assert_eq!(found["conflicts"][0]["kind"], "unit");
        let advice = "nothing before the unit of the readings is checked: possibly mm in a column named µm";
        assert!(screen.contains(advice) && !screen.contains("or state"), "{screen}");
        assert_eq!(found["statements"]["measure"]["step"], "check-unit");
    }
    no_certificate(&file, "less than a tenth of the noise");
    // Without a stated noise the size of the readings tells: no ball bar scatters by nanometres.
    let stated = fs::read_to_string(&file).unwrap();
    fs::write(&file, stated.lines().filter(|line| !line.starts_with("noise_um")).collect::<Vec<_>>().join("\n"))
        .unwrap();
    let (found, screen) = result_and_screen("fit", &file, &[]);
    nothing_passes(&found, &screen, "wrong-unit");
    assert_eq!(found["statements"]["measure"]["step"], "check-unit");
    assert!(screen.contains("is the column in mm, and its name in µm?") && !screen.contains("or state"), "{screen}");
}

/// Thousandths of an inch leave a 25th of the noise, and are the unit that is named.
#[test]
fn deviations_in_thousandths_of_an_inch_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = drawn(0.3);
    under_um(&mut session, 0.0254);
    let (found, screen) = result_and_screen("fit", &written(folder.path(), &session), &[]);
    nothing_passes(&found, &screen, "wrong-unit");
    let unit = "possibly inches in a column named mm, or thousandths of an inch in one named µm";
    assert!(screen.contains(&format!("the unit of the readings is checked: {unit}")), "{screen}");
}

/// A noise that is stated three times too large is no other unit: the estimates may be quoted, and nothing is decided. One that
/// is stated by a tenth too large agrees.
#[test]
fn a_noise_that_is_stated_too_large_is_not_judged() {
    let folder = tempfile::tempdir().unwrap();
    let file = written(folder.path(), &drawn(0.1));
    let (found, screen) = result_and_screen("fit", &file, &[]);
    nothing_passes(&found, &screen, "below-noise");
    assert_eq!(found["statements"]["good"]["goodness"]["quotable"], true);
    let items = found["conformity"]["items"].as_array().unwrap();
    let decisions: Vec<&str> = items.iter().map(|item| item["decision"].as_str().unwrap()).collect();
    assert_eq!(decisions, ["undecided"; 3]);
    assert!(found["conflicts"].as_array().is_none_or(Vec::is_empty), "{}", found["conflicts"]);
    no_certificate(&file, "far below the noise");
    let agrees = tempfile::tempdir().unwrap();
    let file = written(agrees.path(), &drawn(0.27));
    let (found, screen) = result_and_screen("fit", &file, &[]);
    assert_eq!(found["statements"]["good"]["goodness"]["verdict"], "agrees");
    assert!(screen.contains("all limits pass"), "{screen}");
}
