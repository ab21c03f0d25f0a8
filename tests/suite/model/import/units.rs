//! Files that state no units: one unit of length and one of angle each, as the plan, the travel or the machine say. The
//! readings follow from closed forms.

use std::path::{Path, PathBuf};

use abbe::files::{self, ReadOptions};
use abbe::model::session::Session;

use super::{message, text};
use crate::suite::abbe;

/// C under the table, and X, Y, Z of the tool.
const MACHINE: &str = "name = \"M\"\nchain = \"w C b X Y Z t\"\n[axis.C]\ndirection = [0, 0, 1]\n[axis.X]\ntravel_mm = [-400, 400]\n\
                       [axis.Y]\ntravel_mm = [-400, 400]\n[axis.Z]\ntravel_mm = [-400, 400]\n";

/// The planned motion of the test: X and Y follow a nest at 100 mm from the axis of C.
const FOLLOW: &str =
    "path = { kind = \"follow\", axis = \"C\", step_deg = 10, programmed_feed_mm_min = 1000, runs = 1 }";
/// C turns alone under a nest on its axis.
const ALONE: &str = "at = { x_mm = 0, y_mm = 0, z_mm = 60 }\nsweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 10, feed_deg_min = 600, runs = 1 }";
/// No motion: the file is awaited.
const NONE: &str = "data = \"T.csv\"\nat = { x_mm = 0, y_mm = 0, z_mm = 60 }";

fn session(folder: &Path, radius_mm: f64, motion: &str) -> PathBuf {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("machine.toml"), MACHINE).unwrap();
    let plan = folder.join("plan.toml");
    let toml = format!(
        "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"r-test\"\nnoise_um = 0.3\n[[test]]\nname = \"T\"\nsetting = \"E\"\n\
         workpiece_ball_mm = [{radius_mm}, 0, 60]\nspindle_ball_mm = [0, 0, 0]\nworkpiece_ball_u_um = 10\nspindle_ball_u_um = 10\n{motion}\n"
    );
    std::fs::write(&plan, toml).unwrap();
    plan
}

/// Rows of C in degrees, the nest in mm, and deviations in mm: 5 µm upwards, and 20 µm across, under which the table with its
/// sensors turns away.
fn rows(radius_mm: f64) -> impl Iterator<Item = [f64; 7]> {
    (0..=36).map(move |k| {
        let c = f64::from(k) * 10.0;
        let (sin, cos) = c.to_radians().sin_cos();
        [c, radius_mm * cos, radius_mm * sin, 60.0, 0.02 * cos, -0.02 * sin, 0.005]
    })
}

/// A file whose unit of length and whose unit of deviation are so many mm, and whose unit of angle is so many degrees.
fn file(header: &str, radius_mm: f64, [length, deviation, angle]: [f64; 3]) -> String {
    let row = |[c, x, y, z, dx, dy, dz]: [f64; 7]| {
        let cells = [c / angle, x / length, y / length, z / length, dx / deviation, dy / deviation, dz / deviation];
        cells.map(|cell| format!("{cell:.12}")).join(",") + "\n"
    };
    format!("{header}\n{}", rows(radius_mm).map(row).collect::<String>())
}

fn imported(plan: &Path, contents: &str, more: &[&str]) -> Result<(Session, String), String> {
    let file = plan.with_file_name("in").join("T.csv");
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(&file, contents).unwrap();
    let output = abbe(&[&["import", text(&file), "--session", text(plan), "--quiet"], more].concat());
    let said = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    if !output.status.success() {
        return Err(said);
    }
    Ok((files::session(plan, &ReadOptions::default()).unwrap(), said))
}

/// Whether the readings of a session are the rows.
fn is_right(session: &Session, radius_mm: f64) -> bool {
    let readings = session.tests[0].readings.as_ref().unwrap();
    let axis = |name: &str| session.machine.axis_index(name).unwrap();
    rows(radius_mm).enumerate().all(|(row, [c, x, y, z, deviations @ ..])| {
        let position = |name: &str| readings.positions[axis(name)][row];
        let of_axes = [(position("C"), c.to_radians()), (position("X"), x), (position("Y"), y), (position("Z"), z)];
        let observed = readings.observed[3 * row..3 * row + 3].iter().copied().zip(deviations);
        of_axes.into_iter().chain(observed).all(|(found, expected)| (found - expected).abs() < 1e-8)
    })
}

const MM: f64 = 1.0;
const M: f64 = 1e3;
const INCH: f64 = 25.4;
const UM: f64 = 1e-3;
const DEG: f64 = 1.0;
const RAD: f64 = 180.0 / std::f64::consts::PI;

#[test]
fn a_file_has_one_unit_of_length_and_one_of_angle() {
    let place = tempfile::tempdir().unwrap();
    let bare = "c,x,y,z,dx,dy,dz";
    for (number, (header, radius, motion, units)) in [
        (bare, 100.0, FOLLOW, [MM, MM, DEG]),
        // Deviations of 20 µm in m are 0.00002: in mm they would be nothing.
        (bare, 100.0, FOLLOW, [M, M, DEG]),
        (bare, 100.0, FOLLOW, [M, M, RAD]),
        (bare, 100.0, FOLLOW, [INCH, INCH, DEG]),
        // Deviations of 20 are in µm, whatever the positions are in.
        (bare, 100.0, FOLLOW, [M, UM, DEG]),
        (bare, 100.0, FOLLOW, [MM, UM, RAD]),
        // The header says so.
        ("c_deg,x_m,y_m,z_m,dx,dy,dz", 100.0, FOLLOW, [M, M, DEG]),
        ("c,x_m,y_m,z_m,dx_um,dy_um,dz_um", 100.0, FOLLOW, [M, UM, RAD]),
        // The nominal reading of a nest on the axis does not depend on C: the plan decides.
        (bare, 0.0, ALONE, [MM, MM, DEG]),
        (bare, 0.0, ALONE, [M, M, RAD]),
        // The nest follows C: the machine decides without a plan.
        ("c,x_mm,y_mm,z_mm,dx_um,dy_um,dz_um", 100.0, NONE, [MM, UM, RAD]),
        (bare, 100.0, NONE, [M, M, RAD]),
    ]
    .into_iter()
    .enumerate()
    {
        let plan = session(&place.path().join(number.to_string()), radius, motion);
        let (session, said) =
            imported(&plan, &file(header, radius, units), &[]).unwrap_or_else(|said| panic!("{number}: {said}"));
        assert!(is_right(&session, radius), "{number}: {said}");
        // A guess is told, also with --quiet.
        assert!(said.contains("warning: T.csv: the unit of"), "{number}: {said}");
    }
}

#[test]
fn a_file_that_two_units_explain_is_a_question() {
    let place = tempfile::tempdir().unwrap();
    // Nothing that is known depends on C.
    let plan = session(&place.path().join("rotary"), 0.0, NONE);
    let header = "c,x_mm,y_mm,z_mm,dx_um,dy_um,dz_um";
    let said = imported(&plan, &file(header, 0.0, [MM, UM, RAD]), &[]).unwrap_err();
    assert!(said.contains("units are not stated, and two readings fit as well"), "{said}");
    assert!(said.contains("the unit of `c` is not stated: deg is read") && said.contains("rad is read"), "{said}");
    assert!(said.contains("c_deg=c or c_rad=c") || said.contains("c_rad=c or c_deg=c"), "{said}");
    let (session, said) = imported(&plan, &file(header, 0.0, [MM, UM, RAD]), &["--column", "c_rad=c"]).unwrap();
    assert!(is_right(&session, 0.0) && !said.contains("is not stated"), "{said}");
    // An axis that stands still has no unit to be asked for.
    let plan = self::session(&place.path().join("still"), 0.0, NONE);
    let still: String = (0..20).map(|k| format!("0,0,0,60,{},0,0\n", f64::from(k % 3))).collect();
    assert!(imported(&plan, &format!("{header}\n{still}"), &[]).is_ok());
}

/// What is not read is told with file and line, and `#REF!` is no comment.
#[test]
fn rows_and_columns_that_are_not_read_are_told() {
    let place = tempfile::tempdir().unwrap();
    let plan = session(&place.path().join("lost"), 100.0, FOLLOW);
    let whole = file("c_deg,x_mm,y_mm,z_mm,dx_um,dy_um,dz_um,note", 100.0, [MM, UM, DEG]).replace("00\n", "00,7\n");
    let lines: Vec<&str> = whole.lines().collect();
    let with_error = |first: &str| {
        let mut lines: Vec<String> = lines.iter().map(ToString::to_string).collect();
        let rest = lines[5].split_once(',').unwrap().1.to_string();
        lines[5] = format!("{first},{rest}");
        lines.join("\n") + "\n"
    };
    for error in ["#REF!", "#N/A", "#BEZUG!", ""] {
        let plan = session(&place.path().join(format!("lost{}", error.len())), 100.0, FOLLOW);
        let (_, said) = imported(&plan, &with_error(error), &[]).unwrap();
        assert!(said.contains("warning: T.csv: 1 row without a number, line 6 the first, left out"), "{error}: {said}");
        assert!(said.contains("warning: T.csv: not read: note"), "{error}: {said}");
    }
    let (_, said) = imported(&plan, &whole, &[]).unwrap();
    assert!(!said.contains("left out"), "{said}");
    // A table with our columns is refused instead, with its line.
    let plan = session(&place.path().join("ours"), 100.0, FOLLOW);
    let toml = std::fs::read_to_string(&plan).unwrap().replace("name = \"T\"", "name = \"T\"\ndata = \"T.csv\"");
    std::fs::write(&plan, toml).unwrap();
    let ours =
        with_error("#REF!").lines().map(|line| line.rsplit_once(',').unwrap().0.to_string() + "\n").collect::<String>();
    std::fs::write(plan.with_file_name("T.csv"), ours).unwrap();
    let output = abbe(&["fit", text(&plan)]);
    let said = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        !output.status.success() && said.contains("T.csv:6:") && said.contains("`#REF!` is not a number"),
        "{said}"
    );
}
