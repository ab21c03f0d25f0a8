//! `abbe fit --dcc`: the certificate holds the figures of the fit and what the laboratory states, and there is none where the
//! model lacks an effect. `python/tests/test_certificate.py` reads it by another program.

use std::collections::BTreeMap;
use std::path::Path;

use abbe::certificate::EXAMPLE;
use quick_xml::Reader;
use quick_xml::events::Event;
use serde_json::Value;

use crate::suite::{abbe, ready, text};

/// A simulated session with the notes of its measurement, and the file of the laboratory beside it.
fn session(folder: &Path, certificate: &str) -> std::path::PathBuf {
    let out = folder.join("run1");
    let plan = ready("hermle-c600u/chapter5.toml");
    let arguments = ["simulate", text(&plan), "--out", text(&out), "--draw-setups", "--seed", "1", "--quiet"];
    let run = abbe(&[&arguments[..], &["--error", "EX0C=12um", "--error", "EB0A=-1.5arcsec"]].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    std::fs::write(out.join("certificate.toml"), certificate).unwrap();
    out.join("session.toml")
}

/// The texts of an XML document, each with the names of the elements that it lies in.
fn texts(xml: &str) -> Vec<(String, String)> {
    let (mut reader, mut path, mut found) = (Reader::from_str(xml), Vec::<String>::new(), Vec::new());
    loop {
        match reader.read_event().unwrap() {
            Event::Start(start) => {
                path.push(start.local_name().as_ref().to_string());
                found.push((path.join("/"), String::new()));
            }
            Event::Text(own) => {
                if let Some((_, text)) = found.last_mut() {
                    text.push_str(&own);
                }
            }
            Event::GeneralRef(entity) => {
                let letter = quick_xml::escape::resolve_predefined_entity(&entity).unwrap();
                found.last_mut().unwrap().1.push_str(letter);
            }
            Event::End(_) => _ = path.pop(),
            Event::Eof => return found,
            _ => {}
        }
    }
}

/// The one text of an element.
fn one<'t>(texts: &'t [(String, String)], ending: &str) -> &'t str {
    let mut found = texts.iter().filter(|(path, _)| path.ends_with(ending));
    let (_, own) = found.next().unwrap_or_else(|| panic!("no {ending}"));
    assert!(found.next().is_none(), "more than one {ending}");
    own.trim()
}

#[test]
fn a_certificate_holds_the_figures_of_the_fit() {
    let folder = tempfile::tempdir().unwrap();
    let own = EXAMPLE
        .replace("Example Aerospace", "Müller & Söhne <Ulm>")
        .replace("country = \"DE\"\nbegin", "country = \"DE\"\nplace = \"laboratory-branch\"\nbegin");
    let session = session(folder.path(), &own);
    let (file, json) = (folder.path().join("certificate.xml"), folder.path().join("fit.json"));
    let run = abbe(&["fit", text(&session), "--dcc", text(&file), "--json", text(&json), "--quiet"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let texts = texts(&std::fs::read_to_string(&file).unwrap());
    assert_eq!(one(&texts, "/uniqueIdentifier"), "2026-0042");
    assert_eq!(one(&texts, "/beginPerformanceDate"), "2026-11-23");
    assert_eq!(one(&texts, "/endPerformanceDate"), "2026-11-23");
    assert_eq!(one(&texts, "/performanceLocation"), "laboratoryBranch");
    assert_eq!(one(&texts, "/customer/name/content"), "Müller & Söhne <Ulm>");
    assert_eq!(one(&texts, "/item/identifications/identification/value"), "17-331");
    let fit: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let expected: BTreeMap<&str, (f64, f64)> = fit["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|own| !own["id"].as_str().unwrap().contains('['))
        .map(|own| {
            let number = |key: &str| own[key].as_f64().unwrap();
            (own["id"].as_str().unwrap(), (number("value"), 2.0 * number("u")))
        })
        .collect();
    assert_eq!(expected.len(), 8, "{expected:?}");
    let of =
        |ending: &'static str| texts.iter().filter(move |(path, _)| path.ends_with(ending)).map(|(_, own)| own.trim());
    let labels = of("/result/data/quantity/real/label");
    let values = of("/result/data/quantity/real/value").map(|own| own.parse::<f64>().unwrap());
    let expanded = of("/real/expandedUnc/uncertainty").map(|own| own.parse::<f64>().unwrap());
    let found: BTreeMap<&str, (f64, f64)> = labels.zip(values.zip(expanded)).collect();
    assert_eq!(found, expected);
    assert!(of("/expandedUnc/coverageFactor").all(|own| own == "2"));
    let units: BTreeMap<&str, &str> =
        of("/result/data/quantity/real/label").zip(of("/quantity/real/unit").skip(2)).collect();
    assert_eq!(units["EX0C"], "\\micro\\metre");
    assert_eq!(units["EB0A"], "\\arcsecond");
    let description = one(&texts, "/measurementResult/description/content");
    assert!(description.contains("uncertainties of the set-up: EY0A, EZ0A,"), "{description}");
    let temperatures: Vec<&str> = of("/influenceCondition/data/quantity/real/value").collect();
    assert_eq!(temperatures, ["19.6", "20.3"]);
}

#[test]
fn what_no_measurement_tells_is_asked_for_before_the_fit() {
    let folder = tempfile::tempdir().unwrap();
    let session = session(folder.path(), EXAMPLE);
    let stated = session.with_file_name("certificate.toml");
    let out = folder.path().join("certificate.xml");
    let refused = |contents: Option<&str>, wanted: &[&str]| {
        match contents {
            Some(contents) => std::fs::write(&stated, contents).unwrap(),
            None => std::fs::remove_file(&stated).unwrap(),
        }
        // The table of residuals is written as soon as there is a fit.
        let residuals = folder.path().join("residuals.csv");
        let run = abbe(&["fit", text(&session), "--dcc", text(&out), "--residuals", text(&residuals)]);
        let message = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && !out.exists() && !residuals.exists(), "{message}");
        for words in wanted {
            assert!(message.contains(words), "{words}: {message}");
        }
    };
    refused(Some(&EXAMPLE.replace("\"DE\"", "\"Germany\"")), &["certificate.toml:3", "country", "ISO 3166-1"]);
    refused(Some(&EXAMPLE.replace("2026-11-23", "23.11.2026")), &["certificate.toml:4", "begin", "\"2026-11-23\""]);
    refused(Some(&EXAMPLE.replace("custome", "costume")), &["costumer", "customer"]);
    refused(Some(&EXAMPLE.replace("serial_number = \"17-331\"\n", "")), &["serial_number", "[item]", "[about]"]);
    let ended = EXAMPLE.replace("begin = \"2026-11-23\"", "begin = \"2026-11-23\"\nend = \"2026-01-01\"");
    refused(Some(&ended), &["`end` on 2026-01-01", "`begin` on 2026-11-23"]);
    refused(Some(&EXAMPLE.replace("[19.6, 20.3]", "[20.3, 19.6]")), &["temperature_c", "lowest and the highest"]);
    refused(Some(&EXAMPLE.replace("A. Example", "")), &["name", "text without blanks"]);
    refused(None, &["certificate.toml", "[laboratory]", "[[person]]"]);
}

/// The file of the laboratory is read, so that no output takes its place.
#[test]
fn no_output_replaces_the_file_of_the_laboratory() {
    let folder = tempfile::tempdir().unwrap();
    let session = session(folder.path(), EXAMPLE);
    let laboratory = session.with_file_name("certificate.toml");
    let other = folder.path().join("certificate.xml");
    for outputs in [&["--dcc", text(&laboratory)][..], &["--dcc", text(&other), "--json", text(&laboratory)]] {
        let run = abbe(&[&["fit", text(&session)], outputs].concat());
        assert!(!run.status.success(), "{outputs:?}");
        assert_eq!(std::fs::read_to_string(&laboratory).unwrap(), EXAMPLE);
    }
}

#[test]
fn notes_of_the_session_state_day_and_serial_number() {
    let folder = tempfile::tempdir().unwrap();
    let own = EXAMPLE.replace("serial_number = \"17-331\"\n", "").replace("begin = \"2026-11-23\"\n", "");
    let session = session(folder.path(), &own);
    let old = std::fs::read_to_string(&session).unwrap();
    let about = "[about]\nserial_number = \"S 4711\"\ndate = 2026-10-02T08:30:00\n\n";
    let place = old.find("\n[").unwrap() + 1;
    std::fs::write(&session, format!("{}{about}{}", &old[..place], &old[place..])).unwrap();
    let out = folder.path().join("certificate.xml");
    let run = abbe(&["fit", text(&session), "--dcc", text(&out), "--quiet"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let texts = texts(&std::fs::read_to_string(&out).unwrap());
    assert_eq!(one(&texts, "/beginPerformanceDate"), "2026-10-02");
    assert_eq!(one(&texts, "/item/identifications/identification/value"), "S 4711");
}

#[test]
fn nothing_is_certified_while_the_model_lacks_an_effect() {
    let folder = tempfile::tempdir().unwrap();
    let session = session(folder.path(), EXAMPLE);
    let data = std::fs::read_dir(session.parent().unwrap()).unwrap().map(|entry| entry.unwrap().path());
    let file = data.into_iter().find(|path| path.extension().is_some_and(|ending| ending == "csv")).unwrap();
    let changed: String = std::fs::read_to_string(&file)
        .unwrap()
        .lines()
        .enumerate()
        .map(|(number, line)| {
            let Some((rest, last)) = line.rsplit_once(',') else { return format!("{line}\n") };
            match last.parse::<f64>() {
                // A wave of 20 µm that no declared parameter has.
                Ok(value) if value > 50.0 => format!("{rest},{}\n", value + 0.02 * (number as f64 * 0.35).sin()),
                _ => format!("{line}\n"),
            }
        })
        .collect();
    std::fs::write(&file, changed).unwrap();
    let (out, json) = (folder.path().join("certificate.xml"), folder.path().join("fit.json"));
    let run = abbe(&["fit", text(&session), "--dcc", text(&out), "--json", text(&json)]);
    let message = String::from_utf8_lossy(&run.stderr);
    // The fit that shows it is kept.
    assert!(!run.status.success() && !out.exists() && json.exists());
    assert!(message.contains("the model lacks an effect"), "{message}");
    // Without a noise there is no telling, and χ²/ν is 1 by construction.
    let stated = std::fs::read_to_string(&session).unwrap();
    let without: String =
        stated.lines().filter(|line| !line.starts_with("noise_um")).map(|line| format!("{line}\n")).collect();
    assert!(without.len() < stated.len());
    std::fs::write(
        &session,
        without.replace("both_directions = true", "both_directions = false").replace("runs = 2", "runs = 1"),
    )
    .unwrap();
    let run = abbe(&["fit", text(&session), "--dcc", text(&out)]);
    assert!(!run.status.success() && !out.exists(), "{}", String::from_utf8_lossy(&run.stderr));
}
