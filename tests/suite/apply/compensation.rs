//! Compensation tables evaluated as by the control: the correction of the command is the identified curve with the
//! opposite sign.

use std::path::Path;

use serde_json::Value;

use crate::suite::{abbe, text};

/// A session of circles and a rotary sweep with known error motions, simulated without noise.
fn identified(folder: &Path) -> std::path::PathBuf {
    let plan = folder.join("plan.toml");
    let text_of = "[machine]\nchain = \"w C b X Y Z t\"\naxis.C = {}\naxis.X = {}\naxis.Y = { direction = [0, -1, 0] }\naxis.Z = {}\n\
        [instrument]\nkind = \"ballbar\"\nnoise_um = 0.1\n[unknowns]\nerrors = [\"EX0C\", \"EC0Y\"]\n\
        [[effect]]\ncomponent = \"EXX\"\nshape = \"polynomial\"\norder = 3\n\
        [[effect]]\ncomponent = \"EYY\"\nshape = \"backlash\"\n\
        [[effect]]\ncomponent = \"EYX\"\nshape = \"periodic\"\nperiod_mm = 40\n\
        [[effect]]\ncomponent = \"ECC\"\nshape = \"harmonic\"\norder = 3\n\
        [[effect]]\ncomponent = \"bar\"\ndriver = \"time\"\nshape = \"drift\"\n\
        [[effect]]\ncomponent = \"EXX\"\nshape = \"lag\"\n\
        [[test]]\nname = \"XY\"\nbar_mm = 100\nworkpiece_ball_mm = [0, 0, 0]\nspindle_ball_mm = [0, 0, 0]\n\
        path = { kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 1 }\n\
        [[test]]\nname = \"XY off centre\"\nbar_mm = 100\nworkpiece_ball_mm = [60, 0, 0]\nspindle_ball_mm = [0, 0, 0]\n\
        path = { kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 1, feed_mm_min = 3000 }\n\
        [[test]]\nname = \"C\"\nbar_mm = 100\nworkpiece_ball_mm = [100, 0, 0]\nspindle_ball_mm = [0, 0, 0]\n\
        path = { kind = \"follow\", axis = \"C\", offset = \"tangential\", step_deg = 1 }\n";
    std::fs::write(&plan, text_of).unwrap();
    let out = folder.join("run");
    let mut arguments = vec!["simulate".to_string(), text(&plan).into(), "--out".into(), text(&out).into()];
    for (flag, value) in [
        ("--error", "EX0C=12um"),
        ("--error", "EC0Y=5arcsec"),
        ("--effect", "EXX~X:p3.1=6um"),
        ("--effect", "EXX~X:p3.2=-3um"),
        ("--effect", "EXX~X:p3.3=2um"),
        ("--effect", "EYY~Y:backlash=4um"),
        ("--effect", "ECC~C:h3.amplitude=4arcsec"),
        ("--effect", "ECC~C:h3.phase=30deg"),
    ] {
        arguments.extend([flag.to_string(), value.to_string()]);
    }
    arguments.extend(["--noise-um", "0.02"].map(str::to_string));
    let run = abbe(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    out.join("session.toml")
}

/// The coefficients that `abbe fit` reports; the expected curves use only these.
fn coefficients(folder: &Path, session: &Path) -> impl Fn(&str) -> f64 {
    let file = folder.join("fit.json");
    assert!(abbe(&["fit", text(session), "--json", text(&file)]).status.success());
    let fit: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    move |id: &str| {
        let parameters = fit["parameters"].as_array().unwrap();
        let found = parameters.iter().find(|parameter| parameter["id"] == id);
        found.unwrap_or_else(|| panic!("{id} in {parameters:?}"))["value"].as_f64().unwrap()
    }
}

fn tables(session: &Path, out: &Path, control: &str) -> String {
    let run = exported(session, &["--as", &format!("{control}-tables"), "--out", text(out), "--places", "41"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).unwrap()
}

/// The output of `abbe export` of the model of a session.
fn exported(session: &Path, arguments: &[&str]) -> std::process::Output {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("model.json");
    assert!(abbe(&["fit", text(session), "--save", text(&model)]).status.success());
    abbe(&[&["export", text(&model)], arguments].concat())
}

fn numbers(line: &str) -> Vec<f64> {
    line.split_whitespace().map(|cell| cell.parse().unwrap()).collect()
}

#[test]
fn tables_correct_by_the_negative_identified_curve() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let session = identified(folder);
    let value = coefficients(folder, &session);
    // Display units to mm and rad; a polynomial has the scale 100 mm.
    let exx = |x: f64| {
        let q = x / 100.0;
        1e-3 * (value("EXX~X:p3.1") * q + value("EXX~X:p3.2") * q * q + value("EXX~X:p3.3") * q.powi(3))
    };
    let eyy = |direction: f64| -0.5e-3 * value("EYY~Y:backlash") * direction;
    let ecc_deg = |c_deg: f64| {
        let phase = (3.0 * c_deg + value("ECC~C:h3.phase")).to_radians();
        value("ECC~C:h3.amplitude") * phase.cos() / 3600.0
    };

    // LinuxCNC adds nominal minus actual (`comp_forward = nom - fwd` for type 0).
    let out = folder.join("linuxcnc");
    let printed = tables(&session, &out, "linuxcnc");
    assert!(printed.contains("COMP_FILE_TYPE = 0"), "{printed}");
    assert!(printed.contains("EYX: COMP_FILE compensates the positioning of a joint only"), "{printed}");
    assert!(printed.contains("EXX~X:lag: a table over the position"), "{printed}");
    assert!(printed.contains("EX0C: a location error belongs in the kinematics"), "{printed}");
    type Curve<'c> = &'c dyn Fn(f64, f64) -> f64;
    // Y counts against Y of R: an error of +e of its body in R is a positioning error of −e.
    let expected: [(&str, Curve<'_>); 3] =
        [("X", &|x, _| exx(x)), ("Y", &|_, direction| -eyy(direction)), ("C", &|c, _| ecc_deg(c))];
    for (axis, error) in expected {
        let table = std::fs::read_to_string(out.join(format!("{axis}.comp"))).unwrap();
        // The uncertainty follows the three numbers that the control reads.
        let rows: Vec<Vec<f64>> = table.lines().map(|line| numbers(&line.replace("# u", ""))).collect();
        assert_eq!(rows.len(), 41);
        // The uncertainty of a polynomial is zero at its zero.
        assert!(rows.iter().all(|row| (0.0..1e-3).contains(&row[3])) && rows[0][3] > 0.0);
        assert!(rows.iter().all(|row| row.len() == 4) && rows.windows(2).all(|pair| pair[0][0] < pair[1][0]));
        for row in rows {
            for (column, direction) in [(1, 1.0), (2, -1.0)] {
                let correction = row[0] - row[column];
                let error = error(row[0], direction);
                assert!((correction + error).abs() < 2e-6, "{axis} at {}: {correction}, error {error}", row[0]);
            }
        }
    }

    // Heidenhain reads points of the error curve and applies the opposite.
    let out = folder.join("heidenhain");
    tables(&session, &out, "heidenhain");
    let table = std::fs::read_to_string(out.join("X.COM")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next().unwrap().split_whitespace().collect::<Vec<_>>(), ["AXISPOS", "X", "Y"]);
    for row in lines.map(numbers) {
        assert!((row[1] - exx(row[0])).abs() < 2e-6, "{row:?}");
    }
    let table = std::fs::read_to_string(out.join("Y.COM")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next().unwrap().split_whitespace().collect::<Vec<_>>(), ["AXISPOS", "BACKLASH", "Y"]);
    for row in lines.map(numbers) {
        assert!((row[1] + eyy(-1.0)).abs() < 2e-6 && (row[2] + eyy(1.0)).abs() < 2e-6, "{row:?}");
    }

    // Beckhoff reads the errors, mm and rad, in blocks separated by #.
    let out = folder.join("beckhoff");
    let printed = tables(&session, &out, "beckhoff");
    assert!(
        printed.contains("EYY: the difference between the directions; the table contains the mean of both"),
        "{printed}"
    );
    let file = std::fs::read_to_string(out.join("volcomp.csv")).unwrap();
    assert!(file.contains("// standard uncertainty (k = 1), mm and rad: position, EXX, EYX"), "{file}");
    let blocks: Vec<Vec<&str>> =
        file.split("#\n").map(|block| block.lines().filter(|line| !line.starts_with("//")).collect()).collect();
    assert_eq!(blocks[0][0].split_whitespace().collect::<Vec<_>>(), ["X0C", "C0Y"]);
    let location = numbers(blocks[0][1]);
    assert!((location[0] - 1e-3 * value("EX0C")).abs() < 1e-8);
    assert!((location[1] - (value("EC0Y") / 3600.0).to_radians()).abs() < 1e-9);
    let block = |axis: &str| blocks.iter().find(|block| block[0].split_whitespace().next() == Some(axis)).unwrap();
    for row in block("X")[1..].iter().map(|line| numbers(line)) {
        assert!((row[1] - exx(row[0])).abs() < 1e-7, "{row:?}");
    }
    for row in block("C")[1..].iter().map(|line| numbers(line)) {
        assert!((row[1] - ecc_deg(row[0]).to_radians()).abs() < 1e-8, "{row:?}");
    }
}

#[test]
fn csv_and_json_hold_the_same_results() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let session = identified(folder);
    let (csv, json) = (folder.join("fit.csv"), folder.join("fit.json"));
    let run = abbe(&["fit", text(&session), "--csv", text(&csv), "--json", text(&json)]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let written = std::fs::read_to_string(csv).unwrap();
    assert!(written.starts_with("# Errors by their names of ISO 230-1") && written.contains("actual less nominal"));
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(written.as_bytes());
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let fit: Value = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    for parameter in fit["parameters"].as_array().unwrap() {
        let row = rows.iter().find(|row| parameter["id"] == row[1]).unwrap();
        assert_eq!(row[3].parse::<f64>().unwrap(), parameter["value"].as_f64().unwrap());
        assert_eq!(row[4].parse::<f64>().unwrap(), parameter["u"].as_f64().unwrap());
        assert_eq!(parameter["unit"], row[5]);
        assert_eq!(parameter["meaning"], row[2]);
    }
    assert!(rows.iter().any(|row| &row[0] == "circle XY" && &row[1] == "G(b)"));
}

#[test]
fn effects_without_a_curve_have_no_table() {
    let measured = crate::suite::ready("hermle-c600u/measured/session.toml");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tables");
    let run = exported(&measured, &["--as", "linuxcnc-tables", "--out", text(&out)]);
    assert_eq!(run.status.code(), Some(1));
    let message = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(
        message.contains("no error can be compensated in this format") && message.contains("EY0A: a location error"),
        "{message}"
    );
    assert!(!out.exists());
    let run = exported(&measured, &["--as", "beckhoff-tables", "--out", text(&out), "--places", "1"]);
    assert_eq!(run.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&run.stderr).contains("a table of 1 places: a number from 2 to 256"));
}

/// A session in which X moves over ±100 mm in one test and is stationary at −300 mm in another; EXX is a polynomial
/// over X.
fn standing_apart(folder: &Path, seed: u64) -> std::path::PathBuf {
    let plan = folder.join("plan.toml");
    let text_of = "[machine]\nchain = \"w C b X Y Z t\"\naxis.C = { origin_mm = [-300, 0, 0] }\naxis.X = {}\naxis.Y = {}\naxis.Z = {}\n\
        [instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n[unknowns]\nerrors = [\"EC0Y\"]\n\
        [[effect]]\ncomponent = \"EXX\"\nshape = \"polynomial\"\norder = 2\n\
        [[test]]\nname = \"XY\"\nbar_mm = 100\nworkpiece_ball_mm = [0, 0, 0]\nspindle_ball_mm = [0, 0, 0]\n\
        path = { kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 2 }\n\
        [[test]]\nname = \"C\"\nbar_mm = 100\nworkpiece_ball_mm = [-200, 0, 0]\nspindle_ball_mm = [0, 0, 0]\nat = { x_mm = -300, y_mm = 0, z_mm = 0 }\n\
        sweep = { axis = \"C\", from_deg = 0, to_deg = 300, step_deg = 5 }\n";
    std::fs::write(&plan, text_of).unwrap();
    let out = folder.join(format!("run{seed}"));
    let seed = seed.to_string();
    let run = abbe(&[
        "simulate",
        text(&plan),
        "--out",
        text(&out),
        "--seed",
        &seed,
        "--effect",
        "EXX~X:p2.1=6um",
        "--effect",
        "EXX~X:p2.2=8um",
    ]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    out.join("session.toml")
}

/// The rows of a table of uncertainties: error, position, direction, value, u.
fn points(out: &Path) -> Vec<(String, f64, String, f64, f64)> {
    let mut reader = csv::Reader::from_path(out.join("uncertainty.csv")).unwrap();
    let rows = reader.records().map(Result::unwrap);
    rows.map(|row| {
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        assert_eq!((&row[2], &row[6]), ("mm", "um"));
        (row[0].to_string(), number(1), row[3].to_string(), number(4), number(5))
    })
    .collect()
}

#[test]
fn a_table_ends_at_the_travel_of_its_axis_and_states_its_uncertainty() {
    let folder = tempfile::tempdir().unwrap();
    let mut pulls = Vec::new();
    for seed in 0..6 {
        let session = standing_apart(folder.path(), seed);
        let out = folder.path().join(format!("tables{seed}"));
        tables(&session, &out, "linuxcnc");
        let table = std::fs::read_to_string(out.join("X.comp")).unwrap();
        let at: Vec<f64> = table.lines().map(|line| numbers(&line.replace("# u", ""))[0]).collect();
        // The circle moves X from −100 to 100 mm; at −300 mm it is stationary.
        assert!((at[0] + 100.0).abs() < 1.5 && (at[40] - 100.0).abs() < 1.5, "{at:?}");
        let found = points(&out);
        assert_eq!(found.len(), 41);
        for (error, position, direction, value, u) in found {
            assert_eq!((error.as_str(), direction.as_str()), ("EXX", "both"));
            let q = position / 100.0;
            assert!(u > 0.0 || q == 0.0, "{position}");
            // Each end point of each session gives one pull.
            if (q.abs() - 1.0).abs() < 0.02 {
                pulls.push((value - (6.0 * q + 8.0 * q * q)) / u);
            }
        }
    }
    let rms = (pulls.iter().map(|pull| pull * pull).sum::<f64>() / pulls.len() as f64).sqrt();
    assert_eq!(pulls.len(), 12);
    assert!((0.4..1.7).contains(&rms), "{pulls:?}");
}

#[test]
fn a_stationary_axis_has_no_table() {
    let folder = tempfile::tempdir().unwrap();
    let session = standing_apart(folder.path(), 7);
    let text_of = std::fs::read_to_string(&session).unwrap();
    let tests: Vec<usize> = text_of.match_indices("[[test]]").map(|(at, _)| at).collect();
    let only_c = format!("{}{}", &text_of[..tests[0]], &text_of[tests[1]..]);
    std::fs::write(&session, only_c.replace("order = 2", "order = 1")).unwrap();
    let out = folder.path().join("none");
    let run = exported(&session, &["--as", "linuxcnc-tables", "--out", text(&out)]);
    let printed = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(1), "{printed}");
    assert!(
        printed.contains("no error can be compensated in this format")
            && printed.contains("EXX~X:power1: its axis stands still wherever readings observe it"),
        "{printed}"
    );
    assert!(!out.exists());
}

/// Columns that nothing is read from are told, and one with the name of an axis alone is refused: the axis would be taken
/// to stand at 0. A row that begins with the error of a cell is a row.
#[test]
fn columns_and_rows_of_commands_are_read_or_named() {
    let folder = tempfile::tempdir().unwrap();
    let session = super::super::ready("hermle-c600u/measured/session.toml");
    let [model, commands, out] = ["m.json", "c.csv", "o.csv"].map(|name| folder.path().join(name));
    assert!(abbe(&["fit", text(&session), "--save", text(&model), "--quiet"]).status.success());
    let run = |contents: &str| {
        std::fs::write(&commands, contents).unwrap();
        let run = abbe(&["compensate", text(&model), text(&commands), "--out", text(&out), "--quiet"]);
        let said = String::from_utf8_lossy(&run.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        (run.status.code(), said)
    };
    let (code, said) = run("a_deg,c_deg,X,Y,Z\n30,45,10,20,30\n");
    assert!(code == Some(1) && !out.exists(), "{said}");
    assert!(
        said.contains("c.csv:1: column `X` has the name of axis X, and no unit") && said.contains("`x_mm`"),
        "{said}"
    );
    let (code, said) =
        run("# commands\na_deg,c_deg,x_mm,y_mm,z_mm,X,feed\n30,45,10,20,30,1,2\n#REF!,45,10,20,30,1,2\n# end\n");
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.contains("warning: ")
            && said.contains("c.csv:2: columns that are not read, and kept as they are: X, feed"),
        "{said}"
    );
    let written = std::fs::read_to_string(&out).unwrap();
    assert_eq!(written.lines().count(), 3, "{written}");
    assert!(
        written.lines().nth(2).is_some_and(|line| line.starts_with("#REF!,45") && line.ends_with("not-a-number")),
        "{written}"
    );
}

/// The error of [`laser_from_100`], µm at mm.
fn error_um(x: f64) -> f64 {
    7.0 + 0.03 * x + 1e-4 * x * x
}

/// A laser measures X from 100 to 500 mm: the zero of the axis is not among the positions, and the error at it an
/// extrapolation.
fn laser_from_100(folder: &Path) -> std::path::PathBuf {
    let mut rows = "run,x_mm,deviation_um\n".to_string();
    for run in 0..2 {
        for k in 0..=16 {
            let x = 100.0 + 25.0 * f64::from(if run == 0 { k } else { 16 - k });
            let noise = 0.05 * (x * 12.9898 + f64::from(run)).sin();
            rows.push_str(&format!("{},{x},{:.4}\n", run + 1, error_um(x) + noise));
        }
    }
    std::fs::write(folder.join("x.csv"), rows).unwrap();
    let session = folder.join("session.toml");
    let text_of = "[machine]\nchain = \"w b X Y Z t\"\naxis.X = {}\naxis.Y = {}\naxis.Z = {}\n\
        [instrument]\nkind = \"laser\"\nnoise_um = 0.05\n[unknowns]\nerrors = []\n\
        [[effect]]\ncomponent = \"EXX\"\nshape = \"polynomial\"\norder = 2\n\
        [[test]]\nname = \"LX\"\ndata = \"x.csv\"\nreflector_mm = [0, 0, 0]\nbeam = [1, 0, 0]\n";
    std::fs::write(&session, text_of).unwrap();
    session
}

/// The table is zero at its first entry, with a small uncertainty.
#[test]
fn a_table_away_from_the_zero_of_its_axis_begins_with_zero() {
    let folder = tempfile::tempdir().unwrap();
    let session = laser_from_100(folder.path());
    let out = folder.path().join("tables");
    let run = exported(&session, &["--as", "linuxcnc-tables", "--out", text(&out), "--places", "17"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let printed = String::from_utf8(run.stdout).unwrap();
    assert!(printed.contains("EXX at 100.000 mm: the zero of the table"), "{printed}");
    let table = std::fs::read_to_string(out.join("X.comp")).unwrap();
    let rows: Vec<Vec<f64>> = table.lines().map(|line| numbers(&line.replace("# u", ""))).collect();
    assert_eq!((rows.len(), rows[0][0]), (17, 100.0));
    for row in rows {
        let expected_mm = 1e-3 * (error_um(row[0]) - error_um(100.0));
        assert!((row[1] - row[0] - expected_mm).abs() < 1e-4, "{row:?}: {expected_mm}");
        assert!(row[3] < 1e-4, "{row:?}");
    }
}

/// The control has its zero at X = 300 mm: there the entries of every format and their uncertainty are zero, and elsewhere they are
/// the error less that at 300 mm.
#[test]
fn a_table_has_its_zero_at_the_reference_position() {
    let folder = tempfile::tempdir().unwrap();
    let session = laser_from_100(folder.path());
    for (control, file) in [("linuxcnc", "X.comp"), ("heidenhain", "X.COM"), ("beckhoff", "volcomp.csv")] {
        let out = folder.path().join(control);
        let format = format!("{control}-tables");
        let options = ["--as", &format, "--out", text(&out), "--places", "17", "--reference", "X=300"];
        let run = exported(&session, &options);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let printed = String::from_utf8(run.stdout).unwrap();
        assert!(!printed.contains("the zero of the table"), "{printed}");
        let table = std::fs::read_to_string(out.join(file)).unwrap();
        let lines = table.lines().filter(|line| !line.starts_with("//")).map(|line| line.replace("# u", ""));
        let numeric = lines.filter_map(|line| line.split_whitespace().map(|cell| cell.parse().ok()).collect());
        let rows: Vec<Vec<f64>> = numeric.filter(|row: &Vec<f64>| !row.is_empty()).collect();
        assert_eq!(rows.len(), 17, "{table}");
        for row in &rows {
            let entry_mm = if control == "linuxcnc" { row[1] - row[0] } else { row[1] };
            let expected_mm = 1e-3 * (error_um(row[0]) - error_um(300.0));
            assert!((entry_mm - expected_mm).abs() < 1e-4, "{control}: {row:?}, {expected_mm}");
            assert!(row[0] != 300.0 || entry_mm.abs() < 1e-12, "{control}: {row:?}");
        }
        // error,position,position_unit,direction,value,u,unit
        let uncertainty = std::fs::read_to_string(out.join("uncertainty.csv")).unwrap();
        let rows: Vec<Vec<&str>> = uncertainty.lines().skip(1).map(|line| line.split(',').collect()).collect();
        for row in &rows {
            let [position, u] = [row[1], row[5]].map(|cell| cell.parse::<f64>().unwrap());
            assert_eq!(u == 0.0, position == 300.0, "{row:?}");
        }
        assert_eq!(rows.len(), 17, "{uncertainty}");
    }
    let out = folder.path().join("none");
    for (format, reference, code, expected) in [
        ("linuxcnc-tables", "X=600", 1, "the reference position of X in the table of EXX"),
        ("linuxcnc-tables", "Y=0", 1, "axis `Y`: the model has no compensation table over it"),
        ("linuxcnc-tables", "W=0", 1, "no axis `W`"),
        ("linuxcnc-tables", "X", 2, "AXIS=POSITION is expected"),
        ("table", "X=300", 2, "`--reference` belongs to `--as linuxcnc-tables`"),
    ] {
        let run = exported(&session, &["--as", format, "--out", text(&out), "--reference", reference]);
        let said = String::from_utf8_lossy(&run.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(run.status.code(), Some(code), "{said}");
        assert!(said.contains(expected) && !out.exists(), "{said}");
    }
}
