//! The nine panels of a mount in the figures of a fit, against the simulated stars.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::{positions, simulated};
use crate::suite::{abbe, text};

/// The rows of a figure's table whose series is this one, as two numbers.
fn points(folder: &Path, figure: &str, series: &str) -> Vec<[f64; 2]> {
    let mut reader = csv::Reader::from_path(folder.join(format!("{figure}.csv"))).unwrap();
    let rows = reader.records().map(Result::unwrap).filter(|row| &row[0] == series);
    rows.map(|row| [1, 2].map(|cell| row[cell].parse().unwrap())).collect()
}

/// Stars whose true direction is off by known amounts, so that the residual is not zero.
#[test]
fn the_panels_show_the_stars_and_their_sky_rms() {
    let stars: Vec<[f64; 4]> = (positions().into_iter().enumerate())
        .map(|(k, [azimuth, elevation])| {
            let [across, up] = [(k * k) as f64, (k * k * k) as f64].map(|x| (x * 0.7).sin() * 4.0 / 3600.0);
            [azimuth, elevation, azimuth + across / elevation.to_radians().cos(), elevation + up]
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    simulated(folder.path(), &stars, "noise_arcsec = 3\n");
    let [session, json, plots] = ["session.toml", "fit.json", "plots"].map(|name| folder.path().join(name));
    let done = abbe(&["fit", text(&session), "--json", text(&json), "--plots", text(&plots), "--quiet"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let fit: Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    let panels = fs::read_dir(&plots).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap());
    assert_eq!(panels.filter(|name| name.starts_with("sky-") && name.ends_with(".svg")).count(), 9);
    // Residuals: the sky rms is that of both channels together.
    let residuals = points(&plots, "sky-scatter", "after");
    assert_eq!(residuals.len(), stars.len());
    let square = residuals.iter().map(|[across, up]| across * across + up * up).sum::<f64>() / stars.len() as f64;
    let rms = fit["rms_arcsec"].as_f64().unwrap();
    assert!((square.sqrt() / (rms * 2.0_f64.sqrt()) - 1.0).abs() < 1e-9, "{square} {rms}");
    for (channel, name) in ["across", "up"].into_iter().enumerate() {
        for (over, of_star) in [("azimuth", 0), ("elevation", 1)] {
            let shown = points(&plots, &format!("sky-{name}-over-{over}"), "after");
            for ((shown, residual), star) in shown.iter().zip(&residuals).zip(&stars) {
                assert!((shown[0] - star[of_star]).abs() < 1e-9 && shown[1] == residual[channel], "{shown:?} {star:?}");
            }
        }
    }
    // On the map, the zenith is at the centre, north is up and east to the right.
    let vectors = points(&plots, "sky-map", "after");
    for (vector, star) in vectors.chunks(2).zip(&stars) {
        let (sin, cos) = star[0].to_radians().sin_cos();
        let away = 90.0 - star[1];
        let [east, north] = vector[0];
        assert!((east - away * sin).abs() < 1e-9 && (north - away * cos).abs() < 1e-9, "{vector:?} {star:?}");
    }
    // The longest residual is at the end of the distribution.
    let longest = residuals.iter().map(|[across, up]| across.hypot(*up)).fold(0.0, f64::max);
    assert_eq!(points(&plots, "sky-distribution", "after").last(), Some(&[longest, 100.0]));
}
