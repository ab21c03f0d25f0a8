//! Gross readings of a laser tracker: they are outliers, and the fit goes on. The readings are those of a machine with three
//! linear axes at right angles but for one squareness, seen from a tracker at a known place.

use std::fmt::Write;

use crate::suite::{abbe, text};

/// Where the tracker stands, mm: upright.
const TRACKER_MM: [f64; 3] = [-1500.0, -900.0, 250.0];
/// The squareness of Y to X: Y leans towards −X.
const SQUARENESS: f64 = 60e-6;

/// Range, azimuth and elevation of the target at a position of the axes, mm and rad.
fn seen([x, y, z]: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = [x - SQUARENESS * y - TRACKER_MM[0], y - TRACKER_MM[1], z - TRACKER_MM[2]];
    let level = x.hypot(y);
    [level.hypot(z), y.atan2(x), z.atan2(level)]
}

/// A session of 60 poses, some rows changed.
fn session(folder: &std::path::Path, change: impl Fn(usize, &mut [f64; 3])) -> std::path::PathBuf {
    let machine = "name = \"Mill\"\nchain = \"w b X Y Z t\"\n[axis.X]\ndirection = [1, 0, 0]\n\
                   [axis.Y]\ndirection = [0, 1, 0]\n[axis.Z]\ndirection = [0, 0, 1]\n";
    std::fs::write(folder.join("machine.toml"), machine).unwrap();
    let mut table = "x_mm,y_mm,z_mm,range_mm,azimuth_deg,elevation_deg\n".to_string();
    for row in 0..60_usize {
        let at = [37, 53, 71].map(|step| (row * step % 61) as f64 * 10.0 - 300.0);
        let mut reading = seen(at);
        // A pattern in place of noise: 5 µm, 1″.
        let small = |k: usize| ((row * k % 11) as f64 - 5.0) / 3.3;
        reading[0] += 5e-3 * small(3);
        reading[1] += 4.85e-6 * small(5);
        reading[2] += 4.85e-6 * small(7);
        change(row, &mut reading);
        let [range, azimuth, elevation] = reading;
        let (azimuth, elevation) = (azimuth.to_degrees(), elevation.to_degrees());
        let _ = writeln!(table, "{},{},{},{range:.6},{azimuth:.8},{elevation:.8}", at[0], at[1], at[2]);
    }
    std::fs::write(folder.join("poses.csv"), table).unwrap();
    let file = folder.join("session.toml");
    let session = "[machine]\nfile = \"machine.toml\"\n\n[instrument]\nkind = \"tracker\"\nnoise_um = 5\nnoise_arcsec = 1\n\n\
                   [unknowns]\nerrors = [\"EC0Y\"]\n\n[[test]]\nname = \"poses\"\ndata = \"poses.csv\"\ntarget_mm = [0, 0, 0]\n";
    std::fs::write(&file, session).unwrap();
    file
}

/// The fit of a session: the squareness with its uncertainty, rad, and the rows of the outliers.
fn fitted(session: &std::path::Path) -> ([f64; 2], Vec<u64>) {
    let json = session.with_file_name("fit.json");
    let output = abbe(&["fit", text(session), "--json", text(&json), "--quiet"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let fit: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let found = fit["parameters"].as_array().unwrap().iter().find(|parameter| parameter["id"] == "EC0Y").unwrap();
    let rad = |key: &str| (found[key].as_f64().unwrap() / 3600.0).to_radians();
    let mut rows: Vec<u64> =
        fit["outliers"].as_array().into_iter().flatten().map(|outlier| outlier["line"].as_u64().unwrap()).collect();
    rows.sort_unstable();
    ([rad("value"), rad("u")], rows)
}

#[test]
fn gross_readings_are_outliers_and_the_fit_goes_on() {
    use std::f64::consts::{FRAC_PI_2, PI};
    let folder = tempfile::tempdir().unwrap();
    let ([clean, u], outliers) = fitted(&session(folder.path(), |_, _| {}));
    assert!((clean - SQUARENESS).abs() < 4.0 * u && outliers.is_empty(), "{clean} {u} {outliers:?}");
    type Blunder = fn(&mut [f64; 3]);
    let blunders: [(&str, Blunder); 3] = [
        ("straight up", |reading| reading[2] = FRAC_PI_2),
        ("behind", |reading| *reading = [reading[0], reading[1] + PI, -reading[2]]),
        ("aside", |reading| reading[1] += FRAC_PI_2),
    ];
    for (name, blunder) in blunders {
        let gross = session(folder.path(), |row, reading| {
            if row == 17 {
                blunder(reading);
            }
        });
        let ([found, u], outliers) = fitted(&gross);
        // A line of the file: a header, and rows from 0.
        assert_eq!(outliers, [19], "{name}");
        assert!((found - clean).abs() < u, "{name}: {found} against {clean} ± {u}");
    }
}
