//! Reports and plots: completeness, size, escaping of names, and agreement with the model.

use std::path::Path;

use abbe::files::{self, ReadOptions};
use abbe::identify::series::{Cause, sensitivities, views};
use abbe::model::session::Session;
use abbe::plan::states;
use test_needs::data;

use crate::plant::{Kind, Recipe};
use crate::suite::{abbe, ready, text};

fn session(path: &Path) -> Session {
    files::session(path, &ReadOptions::default()).unwrap()
}

/// `∂L/∂error` to first order, derived independently of the chain: ball at (0, R, 0), spindle ball at (−D, 0, 0), so
/// that for a rotation of A `L₀ = √(R² + D²)`, with `ca = cos A`, `sa = sin A` (Jiang (2014), Eqs. 3.20 and 3.21, to
/// first order). Jiang (2014): Xiaogeng Jiang, *Characterising Geometric Errors in Rotary Axes of 5-axis Machine
/// Tools*, PhD thesis, University of Birmingham, 2014.
#[test]
fn sensitivities_agree_with_the_closed_form() {
    let session = session(&ready("hermle-c600u/chapter5.toml"));
    let (complete, noise) = abbe::plan::prepared(&session, &Default::default()).unwrap();
    let problem = states::problem_by_test(&complete, noise).unwrap();
    let beta = vec![0.0; problem.parameters.list.len()];
    let found = sensitivities::sensitivities(&problem, &beta).unwrap();
    let (r, bar_without, bar_with) = (100.0_f64, 99.9881_f64, 149.9946_f64);
    let d = (bar_with * bar_with - r * r).sqrt();
    let arcsec = 1.0 / (3600.0 * 180.0 / std::f64::consts::PI) * 1e3;
    let mut compared = 0;
    for (name, d, _) in [("A100", 0.0, bar_without), ("A150", d, bar_with)] {
        let test = found.iter().find(|test| test.test == name).unwrap();
        let length = r.hypot(d);
        for (k, angle) in test.way.values.iter().enumerate() {
            let (sa, ca) = angle.to_radians().sin_cos();
            for pattern in &test.columns {
                let wanted = match pattern.id.as_str() {
                    "EY0A" => r * ca / length,
                    "EZ0A" => r * sa / length,
                    "EB0A" => r * sa * d / length * arcsec,
                    "EC0A" => -r * ca * d / length * arcsec,
                    "EX0C" => d / length,
                    "EY0C" => r / length,
                    other => panic!("{other} moves no reading of {name}"),
                };
                let value = pattern.values[k];
                assert!((value - wanted).abs() < 1e-6, "{name} {}: {value} {wanted}", pattern.id);
                compared += 1;
            }
        }
    }
    assert!(compared > 1000);
}

/// Coordinates of a vector: a table displaced along +X displaces its nest, so that the vector from nest to ball, in the
/// frame of a table at C, changes by −(cos C, −sin C, 0).
#[test]
fn the_sensitivities_of_an_r_test_are_those_of_each_coordinate() {
    let session = session(&ready("r-test/measured/session.toml"));
    let (problem, _) = abbe::identify::fit::prepare(&session, 1).unwrap();
    let beta = vec![0.0; problem.parameters.list.len()];
    let found = sensitivities::sensitivities(&problem, &beta).unwrap();
    for (coordinate, wanted) in [("dx", (|c: f64| -c.cos()) as fn(f64) -> f64), ("dy", |c| c.sin())] {
        let of = |test: &&sensitivities::TestSensitivities| test.test == "C-alone" && test.channel == Some(coordinate);
        let test = found.iter().find(of).unwrap();
        let own = test.columns.iter().find(|column| column.id == "EX0C").unwrap();
        for (angle, value) in test.way.values.iter().zip(&own.values) {
            let wanted = wanted(angle.to_radians());
            assert!((value - wanted).abs() < 1e-9, "{coordinate} at {angle}: {value} {wanted}");
        }
    }
    let vertical = |test: &&sensitivities::TestSensitivities| test.test == "C-alone" && test.channel == Some("dz");
    let vertical = found.iter().find(vertical).unwrap();
    assert!(vertical.columns.iter().all(|column| column.id != "EX0C"));
}

/// In every pose, a joint displaced by one micrometre displaces the target by one micrometre.
#[test]
fn the_sensitivity_of_poses_to_a_shift_is_one() {
    let Some(series) = data("the_sensitivity_of_poses_to_a_shift_is_one", "landgraf_ur10") else {
        return;
    };
    let options = ReadOptions { data_directory: series.parent().map(Path::to_path_buf), ..ReadOptions::default() };
    let session = files::session(&ready("ur10/session.toml"), &options).unwrap();
    let (problem, fit) = abbe::identify::fit::prepare(&session, 1).unwrap();
    let found = sensitivities::over_poses(&problem, &vec![0.0; fit.beta.len()]).unwrap();
    let shifts: Vec<_> = found.iter().filter(|error| error.unit == "um").collect();
    assert_eq!(shifts.len(), 18);
    for shift in shifts {
        assert!((shift.values[0] - 1.0).abs() < 1e-9, "{shift:?}");
    }
}

/// The page shows the figures of the JSON result.
#[test]
fn methods_and_next_tests_have_reports() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let written = |arguments: &[&str], name: &str| {
        let (page, json, plots) = (at(&format!("{name}.html")), at(&format!("{name}.json")), at(name));
        let outputs = [["--report", text(&page)], ["--json", text(&json)], ["--plots", text(&plots)]];
        let output = abbe(&[arguments, &["-q"], &outputs.concat()].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
        (std::fs::read_to_string(page).unwrap(), json)
    };
    let measured = ready("hermle-c600u/measured/session.toml");
    let (page, json) = written(&["fit", text(&measured), "--method", "cone"], "cone");
    let error = json["errors"].as_array().unwrap().iter().find(|error| error["id"] == "EB0A").unwrap();
    let bias = format!("{:.4}", error["bias"].as_f64().unwrap()).replace('-', "\u{2212}");
    assert!(page.contains(&bias), "no bias {bias}");
    assert!(page.contains("cone, ± 2 u") && page.contains("full fit, ± 2 u"));
    assert!(at("cone/errors-arcsec.svg").exists());
    let plan = ready("hermle-c600u/chapter5.toml");
    let (page, json) = written(&["plan", text(&plan), "--improve", "1", "--range"], "next");
    let step = &json["improvement"]["steps"][0];
    let test = step["test"].as_str().unwrap().replace('&', "&amp;");
    assert!(page.contains(&test), "no test {test}");
    let after = step["after"].as_f64().unwrap();
    let cells = page.split("<td").filter_map(|cell| cell.split_once('>')?.1.split('<').next());
    let mut shown = cells.filter_map(|cell| cell.parse::<f64>().ok());
    assert!(shown.any(|value| (value / after - 1.0).abs() < 0.006), "no figure {after}");
    assert!(page.contains("Minimum sweep ranges"));
    assert!(at("next/next-test.svg").exists());
}

/// The first screen of a page: sentences, and cards with a figure and at most eight words.
#[test]
fn a_page_opens_with_sentences_and_short_cards() {
    let folder = tempfile::tempdir().unwrap();
    let measured = ready("hermle-c600u/measured/session.toml");
    let (fit, trace) = (["fit", text(&measured)], ["trace", text(&measured), "--only", "EZC"]);
    let plan = ready("hermle-c600u/chapter5.toml");
    let plan = ["plan", text(&plan), "--no-effects"];
    for (name, command) in [("fit", &fit[..]), ("trace", &trace[..]), ("plan", &plan[..])] {
        let page = folder.path().join(format!("{name}.html"));
        assert!(abbe(&[command, &["-q", "--report", text(&page)]].concat()).status.success());
        let page = std::fs::read_to_string(page).unwrap();
        let (opening, _) = page.split_once("<dl class=\"key-figures\">").unwrap();
        assert!(opening.matches("<p class=\"verdict\">").count() >= 2, "{name}");
        let cards: Vec<&str> =
            page.split("<div><dt>").skip(1).take_while(|card| card.contains("class=\"note\"")).collect();
        assert!(cards.len() >= 4, "{name}: {} cards", cards.len());
        for card in cards {
            let (label, rest) = card.split_once("</dt>").unwrap();
            let note = rest.split("<dd class=\"note\">").nth(1).unwrap().split("</dd>").next().unwrap();
            let words = [label, note].join(" ");
            let words = words.split([' ', ',', ';']).filter(|word| word.chars().any(char::is_alphabetic));
            assert!(words.clone().count() <= 8, "{name}: {}", words.collect::<Vec<_>>().join(" "));
        }
    }
}

/// A share is the change of the modelled readings if the parameters of the share are set to zero: a difference, not a
/// derivative.
#[test]
fn shares_agree_with_differences_of_the_model() {
    let session = session(&ready("hermle-c600u/measured/session.toml"));
    let (problem, fit) = abbe::identify::fit::prepare(&session, 1).unwrap();
    let views = views(&problem, &fit, None).unwrap();
    assert!(views.second_order_um < 0.05, "{}", views.second_order_um);
    assert_eq!(views.shares.iter().filter(|share| share.cause == Cause::Error).count(), 8);
    for (k, share) in views.shares.iter().enumerate() {
        let mut without = fit.beta.clone();
        share.unknowns.iter().for_each(|j| without[*j] = 0.0);
        let residuals = problem.residuals(&without);
        for (test, view) in views.tests.iter().enumerate() {
            for (i, share_um) in view.shares_um[k].iter().enumerate() {
                let lost_um = (residuals[test][i] - fit.residuals[test][i]) * 1e3;
                assert!((lost_um - share_um).abs() < 0.05, "{} in {}: {lost_um} {share_um}", share.id, view.name);
            }
        }
    }
}

/// The simulator added `EZC~C:h2`. With one height of the ball, a tilt of the next lower order is confounded with it.
#[test]
fn a_trace_reports_the_steps_of_its_search_and_the_competing_explanations() {
    let session = session(&ready("hermle-c600u/measured/session.toml"));
    let trace = abbe::trace::trace(&session, &Default::default(), &|_| true).unwrap();
    let [competing_effects] = trace.competing_effects.as_slice() else {
        panic!("one effect was simulated, {} were found", trace.competing_effects.len());
    };
    let of = |id: &str| competing_effects.iter().find(|effect| effect.id == id).unwrap();
    assert!(of("EZC~C:h2").named && !of("EZC~C:h2").alias);
    for id in ["EAC~C:h1", "EBC~C:h1"] {
        assert!(of(id).alias && !of(id).named, "{id}");
    }
    assert!(competing_effects.is_sorted_by(|a, b| a.evidence >= b.evidence));
    let rejected = competing_effects.iter().filter(|effect| !effect.named && !effect.alias);
    for effect in rejected {
        assert!(effect.evidence < of("EZC~C:h2").evidence - 2.0, "{}", effect.id);
    }
    assert_eq!(trace.steps[0].id, "EZC~C:h2");
    let (last, after) = (trace.steps.last().unwrap(), &trace.result.after);
    assert!((last.heldout_um / after.fit.heldout_rms_um - 1.0).abs() < 0.02);
}

/// The bundled session with markup in its names.
pub fn with_markup_in_names(folder: &Path) {
    let from = ready("hermle-c600u/measured");
    for entry in std::fs::read_dir(&from).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
    }
    let edit = |file: &str, old: &str, new: &str| {
        let path = folder.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(old), "{file} has no {old}");
        std::fs::write(&path, text.replacen(old, new, 1)).unwrap();
    };
    edit("machine.toml", "name = \"Hermle C600U\"", "name = '''<script>window.hit = 1</script>'''");
    edit("session.toml", "name = \"C150\"", "name = '''C150</script><img src=x onerror=\"window.hit=2\">&amp;'''");
    edit("session.toml", "setup = \"P1\"", "setup = '''P1<img src=x onerror=\"window.hit=3\">'''");
    let data = "A100<img src=x onerror=\"window.hit=4\">.csv";
    std::fs::rename(folder.join("A100.csv"), folder.join(data)).unwrap();
    edit("session.toml", "\"A100.csv\"", &format!("'{data}'"));
}

#[test]
fn names_with_markup_are_text_in_a_report() {
    let folder = tempfile::tempdir().unwrap();
    with_markup_in_names(folder.path());
    let (report, plots) = (folder.path().join("fit.html"), folder.path().join("plots"));
    let output =
        abbe(&["fit", text(&folder.path().join("session.toml")), "--report", text(&report), "--plots", text(&plots)]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page = std::fs::read_to_string(&report).unwrap();
    assert!(!page.contains("<script>window") && !page.contains("<img"));
    assert!(page.contains("&lt;script&gt;window.hit = 1&lt;/script&gt;"));
    for entry in std::fs::read_dir(&plots).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        assert!(!name.contains(['<', '>', '"', '/', '&', ' ']), "{name}");
        if path.extension().is_some_and(|extension| extension == "svg") {
            let drawing = std::fs::read_to_string(&path).unwrap();
            assert!(!drawing.contains("<img") && !drawing.contains("<script"));
        }
    }
}

#[test]
fn plots_are_written_completely_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let plots = folder.path().join("plots");
    let session = ready("hermle-c600u/measured/session.toml");
    let arguments = ["trace", text(&session), "--quiet", "--plots", text(&plots)];
    assert!(abbe(&arguments).status.success());
    let mut names: Vec<String> =
        std::fs::read_dir(&plots).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    for wanted in [
        "trace-C150",
        "deviation-C150-over-C",
        "residual-C150-over-C",
        "residual-over-time",
        "spectrum-C150-C",
        "sensitivity-C150",
        "patterns-C150",
        "correlation",
        "ranking-EZC-C-h2",
        "convergence",
        "machine",
    ] {
        assert!(names.contains(&format!("{wanted}.svg")), "{wanted}");
    }
    for name in names.iter().filter_map(|name| name.strip_suffix(".svg")) {
        assert!(names.contains(&format!("{name}.csv")), "{name}");
        let png = std::fs::read(plots.join(format!("{name}.png")));
        assert_eq!(png.is_ok(), cfg!(feature = "png"), "{name}");
        if let Ok(png) = png {
            assert_eq!(png[..8], [0x89, b'P', b'N', b'G', 13, 10, 26, 10]);
        }
    }
    let wanted = folder.path().join("asked");
    let asked = ["fit", text(&session), "--plots", text(&wanted), "--png"];
    let output = abbe(&asked);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    if cfg!(feature = "png") {
        assert!(output.status.success(), "{message}");
    } else {
        assert_eq!(output.status.code(), Some(2));
        assert!(output.stdout.is_empty() && message.contains("--features png"), "{message}");
    }
    // A folder that is not empty is refused before the calculation.
    let again = abbe(&arguments);
    let message = String::from_utf8_lossy(&again.stderr).into_owned();
    assert_eq!(again.status.code(), Some(1));
    assert!(again.stdout.is_empty() && message.contains("not empty; name another"), "{message}");
    let nowhere = folder.path().join("no/such/report.html");
    let refused = abbe(&["fit", text(&session), "--report", text(&nowhere)]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(refused.stdout.is_empty(), "refused before the calculation");
}

/// The ball is at radius 100 mm about C and the spindle ball on the axis, so that the nominal reading is 100 mm in every
/// row of the measured file. A plot shows a part of the rows, and both extremes.
#[test]
fn the_data_of_a_plot_are_those_of_the_measured_file() {
    let folder = tempfile::tempdir().unwrap();
    let plots = folder.path().join("plots");
    let session = ready("hermle-c600u/measured/session.toml");
    assert!(abbe(&["fit", text(&session), "--quiet", "--plots", text(&plots)]).status.success());
    let rows = |path: &Path, wanted: [&str; 2]| -> Vec<[f64; 2]> {
        let table = std::fs::read_to_string(path).unwrap();
        let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let header = lines.next().unwrap();
        let place = |name: &str| header.iter().position(|column| *column == name).unwrap();
        let places = wanted.map(place);
        lines.map(|cells| places.map(|place| cells[place].parse().unwrap())).collect()
    };
    let measured = rows(&session.with_file_name("C100.csv"), ["c_deg", "length_mm"]);
    let measured: Vec<[f64; 2]> = measured.iter().map(|[deg, mm]| [*deg, (mm - 100.0) * 1e3]).collect();
    let drawn = rows(&plots.join("deviation-C100-over-C.csv"), ["C_deg", "deviation_um"]);
    assert_eq!(drawn, rows(&plots.join("trace-C100.csv"), ["C_deg", "deviation_um"]));
    assert!(drawn.len() > 100);
    for [deg, um] in &drawn {
        let is_row = |row: &&[f64; 2]| (row[0] - deg).abs() < 1e-6 && (row[1] - um).abs() < 1e-6;
        assert!(measured.iter().any(|row| is_row(&row)), "{deg}° {um} µm");
    }
    for largest in [f64::max, f64::min] {
        let of = |rows: &[[f64; 2]]| rows.iter().map(|row| row[1]).fold(0.0, largest);
        assert!((of(&drawn) - of(&measured)).abs() < 1e-6);
    }
}

/// Maximum size of a page.
const MAX_BYTES: usize = 3_000_000;

#[test]
fn a_report_of_6000_readings_is_under_3_mb() {
    let folder = tempfile::tempdir().unwrap();
    let draw = Recipe::new(Kind::Rotary, 5).readings(6000).draw();
    draw.write(folder.path()).unwrap();
    let path = folder.path().join("session.toml");
    let tests = session(&path).tests;
    let rows: usize = tests.iter().flat_map(|test| &test.readings).map(|r| r.rows()).sum();
    assert!(rows >= 5_900, "{rows} readings");
    let report = folder.path().join("fit.html");
    assert!(abbe(&["fit", text(&path), "--report", text(&report)]).status.success());
    let bytes = std::fs::metadata(&report).unwrap().len() as usize;
    assert!(bytes < MAX_BYTES, "{bytes} bytes");
}

#[test]
fn a_report_of_11911_poses_is_under_3_mb_and_names_its_inputs() {
    let name = "a_report_of_11911_poses_is_under_3_mb_and_names_its_inputs";
    let Some(measured) = data(name, "landgraf_ur10/Series_A/measurements_grid.csv") else {
        return;
    };
    let root = measured.ancestors().nth(3).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("fit.html");
    let path = ready("ur10/session.toml");
    let output = abbe(&["fit", text(&path), "--data", text(root), "--report", text(&report)]);
    assert!(output.status.success());
    let page = std::fs::read_to_string(&report).unwrap();
    assert!(page.len() < MAX_BYTES, "{} bytes", page.len());
    for input in ["sessions/ur10/session.toml", "sessions/ur10/machine.toml", "measurements_grid.csv"] {
        assert!(page.contains(input), "{input}");
    }
}
