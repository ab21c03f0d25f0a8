//! Layouts of data files: readings of several traversals side by side, a polar angle in place of positions on a circle.

use super::*;

/// A refusal with what to do.
pub(super) fn refusal(folder: &Folder, text: &str) -> String {
    folder.write("session.toml", text);
    let fault = files::session(&folder.0.path().join("session.toml"), &ReadOptions::default()).unwrap_err();
    format!("{fault}; {}", fault.help().unwrap_or_default())
}

/// Forward and backward readings in columns of their own are the runs that a file with one reading in a row has: forward in
/// the order of the rows, backward against it. An empty cell was not read.
#[test]
fn columns_of_traversals_are_runs() {
    let folder = Folder::new();
    let [mut side, mut long] = [String::from("position;F1;B1;F2;B2\n"), String::from("run,x_mm,deviation_um\n")];
    let value = |run: usize, step: usize| 10.0 * run as f64 + 0.25 * (step * step) as f64;
    for step in 0..=6 {
        let cell = |run| if (run, step) == (2, 3) { String::new() } else { value(run, step).to_string() };
        side += &format!("{};{};{};{};{}\n", 50 * step, cell(1), cell(2), cell(3), cell(4));
    }
    for run in 1..=4 {
        for place in 0..=6 {
            let step = if run % 2 == 1 { place } else { 6 - place };
            if (run, step) != (2, 3) {
                long += &format!("{run},{},{}\n", 50 * step, value(run, step));
            }
        }
    }
    folder.write("side.csv", &side);
    folder.write("long.csv", &long);
    let test = "[[test]]\nname = \"L\"\nbeam = [1, 0, 0]\n";
    let layout = |columns: &str| {
        format!("{MILL}{LASER}[format]\nseparator = \";\"\n[columns]\n{columns}\n{test}data = \"side.csv\"\n")
    };
    let long = folder.session(&format!("{MILL}{LASER}{test}data = \"long.csv\"\n"));
    let both = "x_mm = \"position\"\ndeviation_um = { forward = [\"F1\", \"F2\"], backward = [\"B1\", 5] }";
    let side = folder.session(&layout(both));
    let [long, side] = [long, side].map(|session| session.tests[0].readings.clone().unwrap());
    assert_eq!(side.rows(), 27);
    assert_eq!((&side.run, &side.positions, &side.observed), (&long.run, &long.positions, &long.observed));

    let one = folder.session(&layout("x_mm = \"position\"\ndeviation_um = { forward = \"F1\", backward = 5 }"));
    assert_eq!(one.tests[0].readings.as_ref().unwrap().run.last(), Some(&2));
    let refused = |columns: &str| refusal(&folder, &layout(columns));
    let position = "x_mm = { forward = \"position\" }\ndeviation_um = \"F1\"";
    assert!(refused(position).contains("belong to a column of readings"), "{}", refused(position));
    let none = "x_mm = \"position\"\ndeviation_um = { forward = [] }";
    assert!(refused(none).contains("names a column"), "{}", refused(none));
    let uneven = "x_mm = \"position\"\ndeviation_um = { forward = \"F1\", backward = \"B1\" }\npitch_arcsec = \"F2\"";
    assert!(refused(uneven).contains("different numbers of traversals"), "{}", refused(uneven));
    let run = "x_mm = \"position\"\nrun = \"F2\"\ndeviation_um = { forward = \"F1\", backward = \"B1\" }";
    assert!(refused(run).contains("a time or a run"), "{}", refused(run));
    let twice = "x_mm = \"position\"\ndeviation_um = { forward = \"F1\", backward = \"B1\" }\npitch_arcsec = { forward = \"B1\", backward = \"F2\" }";
    assert!(refused(twice).contains("twice"), "{}", refused(twice));
    let unknown = "x_mm = \"position\"\ndeviation_um = { forwards = \"F1\" }";
    assert!(refused(unknown).contains("forwards"), "{}", refused(unknown));
}

/// A polar angle on the circle that a test states: the positions of its two axes.
#[test]
fn a_polar_angle_gives_the_positions_on_the_circle() {
    let folder = Folder::new();
    let mut data = String::from("run,angle,deviation_um\n");
    for degrees in (0..=360).step_by(10) {
        data += &format!("1,{degrees},{}\n", f64::from(degrees % 7) - 3.0);
    }
    folder.write("circle.csv", &data);
    let text = |path: &str| {
        format!(
            "{MILL}[instrument]\nkind = \"ballbar\"\nnoise_um = 0.1\n[columns]\nrun = \"run\"\npolar_deg = \"angle\"\n\
             deviation_um = \"deviation_um\"\n[[test]]\nname = \"XY\"\ndata = \"circle.csv\"\nbar_mm = 150\n\
             workpiece_ball_mm = [20, -10, 5]\nspindle_ball_mm = [0, 0, 0]\n{path}"
        )
    };
    let path = "path = { kind = \"circle\", plane = \"XY\", radius_mm = 150, centre_mm = [0, 0, 0], step_deg = 10, runs = 1, \
                both_directions = false, feed_mm_min = 1000 }\n";
    let session = folder.session(&text(path));
    let readings = session.tests[0].readings.as_ref().unwrap();
    assert_eq!(readings.rows(), 37);
    for (row, degrees) in (0..=360).step_by(10).enumerate() {
        let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
        let expected = [20.0 + 150.0 * cos, -10.0 + 150.0 * sin, 5.0];
        for (axis, expected) in expected.into_iter().enumerate() {
            assert!((readings.positions[axis][row] - expected).abs() < 1e-9, "{degrees}°");
        }
    }
    assert!(refusal(&folder, &text("")).contains("the test states no circle"), "{}", refusal(&folder, &text("")));
}

/// A parabola of 2.5 µm at 300 mm in both directions of travel, with a slope and a zero of the set-up: a quarter of what it
/// bends over half the range, about either line.
#[test]
fn straightness_is_the_range_about_a_line() {
    let folder = Folder::new();
    let mut data = String::from("run,x_mm,vertical_um\n");
    for run in 1..=2 {
        for step in 0..=30 {
            let x = f64::from(10 * if run == 1 { step } else { 30 - step });
            data += &format!(
                "{run},{x},{:.6}\n",
                2.5 * (x / 300.0).powi(2) + 0.01 * x - 4.0 + if run == 1 { 0.1 } else { -0.1 }
            );
        }
    }
    let session = laser_session(&folder, &data, [0.0; 3], &["EZX"]);
    let (problem, found) = prepare(&session, 1).unwrap();
    let result = fit::report(&problem, &found).unwrap();
    let [figures] = &result.straightness[..] else { panic!("{:?}", result.straightness) };
    assert_eq!((figures.axis.as_str(), figures.channel.as_str(), figures.positions.len()), ("X", "vertical", 31));
    assert_eq!(
        figures.figures.iter().map(|figure| figure.definition.id).collect::<Vec<_>>(),
        ["least_squares", "end_points"]
    );
    for figure in &figures.figures {
        assert!((figure.value - 0.625).abs() < 1e-6 && figure.unit == "um", "{figure:?}");
    }
    assert!((figures.positions[15].end_points_um + 0.625).abs() < 1e-6);
}
