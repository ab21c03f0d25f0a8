//! Pointing observations: the reading against rotation matrices, the stars of two telescopes against the fits of TPOINT.

mod anew;
mod hysteresis;
mod panels;
mod precession;

use std::fs;
use std::path::Path;

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::tpoint::{PointingTerm, PointingTerms};
use abbe::identify::fit::{prepare, tpoint};
use abbe::model::component::ErrorName;
use abbe::model::session::Session;
use nalgebra::{DMatrix, DVector, Rotation3, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use test_needs::data;

use crate::suite::ready;

/// A ready session of a telescope, with the folder of its data.
fn telescope(name: &str, folder: &Path, edit: impl Fn(String) -> String) -> Session {
    let own = tempfile::tempdir().unwrap();
    fs::copy(ready("telescope/machine.toml"), own.path().join("machine.toml")).unwrap();
    let text = fs::read_to_string(ready(&format!("telescope/{name}"))).unwrap();
    let file = own.path().join(name);
    fs::write(&file, edit(text)).unwrap();
    let options = ReadOptions { data_directory: Some(folder.to_path_buf()), ..ReadOptions::default() };
    files::session(&file, &options).unwrap()
}

fn terms(session: &Session) -> PointingTerms {
    let (problem, fit) = prepare(session, 1).unwrap();
    tpoint::report(&problem, &fit).unwrap()
}

/// A fit of TPOINT: the sky rms, and each fitted term with value and sigma, arcsec.
fn printed(file: &Path) -> (f64, Vec<(String, f64, f64)>) {
    let text = fs::read_to_string(file).unwrap();
    let number = |word: &str| word.parse::<f64>().unwrap();
    let head: Vec<&str> = text.lines().nth(1).unwrap().split_whitespace().collect();
    let of_line = |line: &str| {
        let words: Vec<&str> = line.trim_start_matches(['&', ' ']).split_whitespace().collect();
        let [term, value, sigma] = words[..] else { return None };
        Some((term.to_string(), number(value), number(sigma)))
    };
    (number(head[2]), text.lines().skip(2).filter_map(of_line).collect())
}

fn term<'t>(found: &'t PointingTerms, name: &str) -> &'t PointingTerm {
    found.terms.iter().find(|term| term.term == name).unwrap_or_else(|| panic!("{name} in {found:?}"))
}

/// The six terms that TPOINT printed for these stars, with its sigma.
#[test]
fn auxtel_has_the_terms_that_tpoint_printed() {
    let name = "auxtel_has_the_terms_that_tpoint_printed";
    let Some(folder) = data(name, "telescopes/auxtel") else {
        return;
    };
    let found = terms(&telescope("auxtel.toml", &folder, |text| text));
    let model = folder.join("at_20220406_ia_ie_an_aw_tx10_ca.mod");
    let (sky_rms, printed) = printed(&model);
    assert_eq!((found.stars, printed.len(), found.terms.len()), (54, 6, 6));
    assert!(found.without_term.is_empty());
    for (name, value, sigma) in printed {
        // TX10 is the column of TX.
        let own = term(&found, name.trim_end_matches("10"));
        let [difference, ratio] = [own.value_arcsec.unwrap() - value, own.sigma_arcsec.unwrap() / sigma];
        println!("{name}: {difference:+.3}\u{2033} from {value}, sigma {ratio:.4} of {sigma}");
        assert!(difference.abs() < 0.05, "{name}: {difference}");
        assert!((ratio - 1.0).abs() < 0.02, "{name}: {ratio}");
    }
    println!("sky rms {} of {sky_rms}, population sd {:?}", found.sky_rms_arcsec, found.population_sd_arcsec);
    assert!((found.sky_rms_arcsec - sky_rms).abs() < 0.005);
    assert!((found.population_sd_arcsec.unwrap() - 3.33).abs() < 0.005);
}

/// Eight terms on the stars of two nights, against least squares in the small-angle design.
#[test]
fn mmt_has_the_sky_rms_of_eight_terms() {
    let name = "mmt_has_the_sky_rms_of_eight_terms";
    let Some(folder) = data(name, "telescopes/mmt") else {
        return;
    };
    for (file, stars, sky_rms) in [("point_20210821.dat", 80, 0.93), ("point_20230702.dat", 86, 1.36)] {
        let edit = |text: String| text.replace("point_20210821.dat", file);
        let found = terms(&telescope("mmt.toml", &folder, edit));
        println!("{file}: {found:#?}");
        assert_eq!((found.stars, found.terms.len()), (stars, 8), "{file}");
        assert!((found.sky_rms_arcsec - sky_rms).abs() < 0.005, "{file}: {}", found.sky_rms_arcsec);
    }
}

/// A mount with stars of known readings: the session of a table of positions of both axes and true directions, degrees.
fn simulated(folder: &Path, stars: &[[f64; 4]], rest: &str) -> Session {
    fs::copy(ready("telescope/machine.toml"), folder.join("machine.toml")).unwrap();
    let mut csv = "az_deg,el_deg,true_azimuth_deg,true_elevation_deg\n".to_string();
    for star in stars {
        csv.push_str(&(star.map(|x| format!("{x:.15}")).join(",") + "\n"));
    }
    fs::write(folder.join("stars.csv"), csv).unwrap();
    let text = "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"pointing\"\n";
    fs::write(folder.join("session.toml"), format!("{text}{rest}[[test]]\nname = \"N\"\ndata = \"stars.csv\"\n"))
        .unwrap();
    files::session(&folder.join("session.toml"), &ReadOptions::default()).unwrap()
}

/// Positions over the sky.
fn positions() -> Vec<[f64; 2]> {
    (0..60).map(|k| [(k as f64 * 137.5) % 360.0, 20.0 + (k as f64 * 7.3) % 65.0]).collect()
}

/// The true azimuth and elevation of the line of sight, degrees, from rotation matrices multiplied in order. The errors
/// are EA, EB, EC of AZ and EA, EB of EL, and the line of sight across, rad.
fn observed([azimuth, elevation]: [f64; 2], errors: [f64; 6]) -> [f64; 2] {
    let turn =
        |about: [f64; 3], angle: f64| Rotation3::from_axis_angle(&Unit::new_normalize(Vector3::from(about)), angle);
    let small = |[a, b, c]: [f64; 3]| turn([1.0, 0.0, 0.0], a) * turn([0.0, 1.0, 0.0], b) * turn([0.0, 0.0, 1.0], c);
    let [aa, ba, ca, ae, be, across] = errors;
    let sight = Vector3::new(1.0, -across, 0.0);
    let p = small([aa, ba, ca])
        * turn([0.0, 0.0, -1.0], azimuth.to_radians())
        * small([ae, be, 0.0])
        * turn([0.0, -1.0, 0.0], elevation.to_radians())
        * sight;
    [(-p.y).atan2(p.x).to_degrees().rem_euclid(360.0), p.z.atan2(p.x.hypot(p.y)).to_degrees()]
}

/// Errors of a degree and more come back, since the chain is exact.
#[test]
fn large_errors_of_a_mount_are_those_of_rotation_matrices() {
    let errors = [0.02, -0.015, 0.03, 0.01, -0.025, 0.012];
    let stars: Vec<[f64; 4]> = positions()
        .into_iter()
        .map(|at| {
            let [azimuth, elevation] = observed(at, errors);
            [at[0], at[1], azimuth, elevation]
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let session = simulated(folder.path(), &stars, "noise_arcsec = 0.1\n");
    let ids: Vec<String> = session.unknowns.iter().map(ErrorName::to_string).collect();
    assert_eq!(ids, ["EA0AZ", "EB0AZ", "EC0AZ", "EA0EL", "EB0EL"]);
    let (problem, fit) = prepare(&session, 1).unwrap();
    assert_eq!(fit.rank.identifiable_basis.ncols(), 6);
    let truth = ["EA0AZ", "EB0AZ", "EC0AZ", "EA0EL", "EB0EL", "line_of_sight.across"].into_iter().zip(errors);
    for (id, value) in truth {
        let place =
            problem.parameters.list.iter().position(|parameter| parameter.id.to_string().starts_with(id)).unwrap();
        assert!((fit.beta[place] - value).abs() < 1e-10, "{id}: {} instead of {value}", fit.beta[place]);
    }
    // Signs: IA = EC0AZ, IE = −EB0EL, AN = EB0AZ, AW = −EA0AZ, NPAE = −EA0EL, CA = −across.
    let found = tpoint::report(&problem, &fit).unwrap();
    let expected = [("IA", errors[2]), ("IE", -errors[4]), ("AN", errors[1]), ("AW", -errors[0])];
    for (name, value) in expected.into_iter().chain([("NPAE", -errors[3]), ("CA", -errors[5])]) {
        let own = term(&found, name).value_arcsec.unwrap() / 3600.0;
        assert!((own - value.to_degrees()).abs() < 1e-7, "{name}: {own}");
    }
}

/// A line of sight without prior is found wherever it is stated, the opposite direction included.
#[test]
fn a_line_of_sight_is_found_from_any_start() {
    let errors = [4e-3, -3e-3, 2e-3, 1e-3, -2.5e-3, 1.2e-3];
    let star = |at: [f64; 2]| {
        let [azimuth, elevation] = observed(at, errors);
        [at[0], at[1], azimuth, elevation]
    };
    let stars: Vec<[f64; 4]> = positions().into_iter().map(star).collect();
    let folder = tempfile::tempdir().unwrap();
    simulated(folder.path(), &stars, "noise_arcsec = 0.1\n");
    let file = folder.path().join("session.toml");
    let stated = fs::read_to_string(&file).unwrap();
    for (sight, is_found) in [("1, 0, 0", false), ("0.8, 0.6, 0", true), ("0, 0, 1", true), ("-1, 0, 0", true)] {
        fs::write(&file, format!("{stated}line_of_sight = [{sight}]\n")).unwrap();
        let session = files::session(&file, &ReadOptions::default()).unwrap();
        let said = session.warnings.join(" ");
        assert_eq!(
            said.contains("state `line_of_sight = [1.000000, 0.000000, 0.000000]`"),
            is_found,
            "{sight}: {said}"
        );
        let (problem, fit) = prepare(&session, 1).unwrap();
        let truth = ["EA0AZ", "EB0AZ", "EC0AZ", "EA0EL", "EB0EL", "line_of_sight.across"].into_iter().zip(errors);
        for (id, value) in truth {
            let place =
                problem.parameters.list.iter().position(|parameter| parameter.id.to_string().starts_with(id)).unwrap();
            assert!((fit.beta[place] - value).abs() < 1e-10, "{sight}, {id}: {} instead of {value}", fit.beta[place]);
        }
    }
}

/// A tube that bends by 20″ cos E, and by 15″ cot E: the line of sight points lower than the encoder says, and the terms are
/// positive.
#[test]
fn a_bending_tube_is_a_positive_term() {
    for (name, shape, arcsec, power) in [("TF", "cosine\"\norder = 1", 20.0, 0), ("TX", "cotangent\"", 15.0, 1)] {
        let bend = |e: f64| arcsec * e.cos() / e.sin().powi(power);
        let sight = |at: [f64; 2]| [at[0], at[1], at[0], at[1] - bend(at[1].to_radians()) / 3600.0];
        let stars: Vec<[f64; 4]> = positions().into_iter().map(sight).collect();
        let folder = tempfile::tempdir().unwrap();
        let effect = format!("[[effect]]\ncomponent = \"EBEL\"\ndriver = \"EL\"\nshape = \"{shape}\n");
        let session = simulated(folder.path(), &stars, &format!("noise_arcsec = 0.1\n{effect}"));
        let found = terms(&session);
        let own = term(&found, name).value_arcsec.unwrap();
        assert!((own - arcsec).abs() < 0.01, "{name}: {own}");
    }
}

/// The index error of the elevation and a line of sight that is high have one column: neither has a value, their sum does.
#[test]
fn a_term_of_confounded_parameters_is_their_sum() {
    let stars: Vec<[f64; 4]> = positions()
        .into_iter()
        .map(|at| {
            let [azimuth, elevation] = observed(at, [0.0, 0.0, 0.0, 0.0, -1e-3, 0.0]);
            [at[0], at[1], azimuth, elevation]
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    simulated(folder.path(), &stars, "noise_arcsec = 0.1\n");
    let file = folder.path().join("session.toml");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, format!("{text}line_of_sight_u_arcsec = inf\n")).unwrap();
    let session = files::session(&file, &ReadOptions::default()).unwrap();
    let (problem, fit) = prepare(&session, 1).unwrap();
    assert!(fit.rank.identifiable_basis.ncols() < problem.parameters.list.len());
    let found = tpoint::report(&problem, &fit).unwrap();
    let index = term(&found, "IE");
    assert_eq!(index.parameters.len(), 2, "{index:?}");
    assert!((index.value_arcsec.unwrap() - 1e-3_f64.to_degrees() * 3600.0).abs() < 1e-3, "{index:?}");
}

/// Stars between 47° and 53° do not separate IA, CA and NPAE in a noise of 60″. The other terms have values, which are those
/// of least squares in the small-angle design without NPAE.
#[test]
fn confounded_terms_leave_the_others_their_values() {
    let errors = [-3e-3, 2e-3, 0.0, 0.0, -4e-3, 0.0];
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let mut noise = || random.sample::<f64, _>(StandardNormal) / 60.0;
    let mut stars = Vec::new();
    for k in 0..40 {
        let at = [10.0 + (k as f64 * 41.3) % 120.0, 50.0 + 3.0 * (k as f64).sin()];
        let [azimuth, elevation] = observed(at, errors);
        stars.push([at[0], at[1], azimuth + noise() / at[1].to_radians().cos(), elevation + noise()]);
    }
    let folder = tempfile::tempdir().unwrap();
    let found = terms(&simulated(folder.path(), &stars, "noise_arcsec = 60\n"));
    for name in ["IA", "CA", "NPAE"] {
        assert_eq!(term(&found, name).value_arcsec, None, "{found:?}");
    }
    let mut design = DMatrix::<f64>::zeros(80, 5);
    let mut right = DVector::<f64>::zeros(80);
    for (k, [a, e, azimuth, elevation]) in stars.into_iter().enumerate() {
        let ((sin_a, cos_a), (sin_e, cos_e)) = (a.to_radians().sin_cos(), e.to_radians().sin_cos());
        let columns = [[0.0, 1.0], [-sin_a * sin_e, -cos_a], [-cos_a * sin_e, sin_a], [-cos_e, 0.0], [-1.0, 0.0]];
        for (j, [across, up]) in columns.into_iter().enumerate() {
            (design[(2 * k, j)], design[(2 * k + 1, j)]) = (across, up);
        }
        right[2 * k] = (azimuth - a) * 3600.0 * cos_e;
        right[2 * k + 1] = (elevation - e) * 3600.0;
    }
    let expected = design.svd(true, true).solve(&right, 1e-12).unwrap();
    for (k, name) in ["IE", "AN", "AW"].into_iter().enumerate() {
        let own = term(&found, name);
        let [value, u] = [own.value_arcsec, own.u_arcsec].map(Option::unwrap);
        // The combination that is held at nominal is one of five terms there.
        assert!((value - expected[k]).abs() < 0.3 * u, "{name}: {value} \u{b1} {u} instead of {}", expected[k]);
        assert!((5.0..60.0).contains(&u), "{name}: {u}");
    }
}
