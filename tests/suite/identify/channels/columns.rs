//! One datum for one set-up; columns and units that cannot be what they say.

use super::*;

/// Tests of one set-up of a laser have one datum: their difference is theirs, and no datum takes it.
#[test]
fn tests_of_one_set_up_count_from_one_point() {
    let folder = Folder::new();
    let mut random = Pcg64::seed_from_u64(5);
    for (name, offset) in [("one", 0.0), ("two", 0.020)] {
        let mut data = String::from("run,x_mm,displacement_mm\n");
        for run in 1..=2 {
            for step in 0..=30 {
                let x = f64::from(if run == 1 { 10 * step } else { 300 - 10 * step });
                data += &format!("{run},{x},{:.6}\n", x + 431.7 + offset + 1e-4 * normal(&mut random));
            }
        }
        folder.write(&format!("{name}.csv"), &data);
    }
    let test =
        |name: &str| format!("[[test]]\nname = \"{name}\"\ndata = \"{name}.csv\"\nsetup = \"S\"\nbeam = [1, 0, 0]\n");
    let session = folder.session(&format!("{MILL}{LASER}{}{}", test("one"), test("two")));
    let (problem, found) = prepare(&session, 1).unwrap();
    let mean = |test: usize| found.residuals[test].iter().sum::<f64>() / found.residuals[test].len() as f64;
    assert!((mean(1) - mean(0) - 0.020).abs() < 1e-4, "{} {}", mean(0), mean(1));
    assert_eq!(
        problem.parameters.list.iter().filter(|one| one.id.to_string().starts_with("zero.displacement")).count(),
        1
    );
}

/// A file that cannot be what its columns say is refused with the place and what to do.
#[test]
fn readings_in_another_unit_and_channels_without_a_value_are_refused() {
    let folder = Folder::new();
    let refused = |columns: &str, row: &dyn Fn(f64) -> String, expected: &str| {
        let rows: String = (0..=20).map(|step| row(10.0 * f64::from(step)) + "\n").collect();
        folder.write("laser.csv", &format!("run,x_mm,{columns}\n{rows}"));
        folder.write(
            "session.toml",
            &format!("{MILL}{LASER}[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [1, 0, 0]\n"),
        );
        let path = folder.0.path().join("session.toml");
        let fault = files::session(&path, &ReadOptions::default()).unwrap_err();
        let fault = format!("{fault}; {}", fault.help().unwrap_or_default());
        assert!(fault.contains(expected), "{fault}");
    };
    refused("displacement_mm", &|x| format!("1,{x},{}", x / 1000.0), "differs from the travel along the beam by");
    refused("displacement_mm", &|x| format!("1,{x},{}", -x), "differs from the travel along the beam by 100.000 mm");
    refused("pitch_deg", &|x| format!("1,{x},{}", x / 20.0), "the readings of `pitch` differ from their median");
    refused("displacement_mm,pitch_arcsec", &|x| format!("1,{x},{x},"), "no row has a value of `pitch`");
    let lacks_both = |x: f64| if x == 50.0 { format!("1,{x},,") } else { format!("1,{x},{x},0") };
    refused("displacement_mm,pitch_arcsec", &lacks_both, "no channel has a value in this row");
}

/// Deviations in mm under a name in µm are smaller than any instrument resolves, and those in µm under a name in mm larger
/// than those of any axis: a warning.
#[test]
fn deviations_in_another_unit_are_a_warning() {
    let folder = Folder::new();
    let mut random = Pcg64::seed_from_u64(9);
    for (unit, doubt) in [(1.0, None), (1e-3, Some("is the column in mm")), (1e3, Some("is the column in µm"))] {
        let mut data = String::from("run,x_mm,deviation_um\n");
        for step in 0..=30 {
            let x = f64::from(10 * step);
            data += &format!("1,{x},{:.9}\n", (0.02 * x + 0.1 * normal(&mut random)) * unit);
        }
        let session = laser_session(&folder, &data, [0.0; 3], &["EXX"]);
        match doubt {
            None => assert!(session.warnings.is_empty(), "{:?}", session.warnings),
            Some(doubt) => assert!(session.warnings.iter().any(|own| own.contains(doubt)), "{:?}", session.warnings),
        }
    }
}

/// A noise of a unit in which nothing is read is named.
#[test]
fn a_noise_of_another_unit_is_a_warning() {
    let folder = Folder::new();
    folder.write("level.csv", "run,x_mm,angle_arcsec\n1,0,0.1\n1,10,0.2\n1,20,0.1\n");
    let session = folder.session(&format!(
        "{MILL}[instrument]\nkind = \"angle\"\nnoise_um = 0.2\n[[test]]\nname = \"L\"\ndata = \"level.csv\"\nabout = [0, 1, 0]\n"
    ));
    assert!(session.warnings.iter().any(|warning| warning.contains("state `noise_arcsec`")), "{:?}", session.warnings);
}

/// Angles in rad under a name in arcsec: their residual is far below the stated noise, that of the displacement is not.
/// Without noise in any channel nothing is doubted.
#[test]
fn a_channel_without_noise_beside_one_with_noise_is_a_warning() {
    let folder = Folder::new();
    for (unit, noise, doubts) in [(1.0, 1.0, false), (1.0 / 206_264.8, 1.0, true), (1.0 / 206_264.8, 1e-3, false)] {
        let mut random = Pcg64::seed_from_u64(11);
        let mut data = String::from("run,x_mm,displacement_mm,pitch_arcsec\n");
        for (run, step) in (1..=2).flat_map(|run| (0..=30).map(move |step| (run, step))) {
            let x = f64::from(if run == 1 { 10 * step } else { 300 - 10 * step });
            let displacement = x + 1e-4 * noise * normal(&mut random);
            data += &format!("{run},{x},{displacement:.9},{:.12}\n", (3.0 + 0.2 * noise * normal(&mut random)) * unit);
        }
        folder.write("laser.csv", &data);
        let session =
            folder.session(&format!("{MILL}{LASER}[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [1, 0, 0]\n"));
        let (problem, found) = prepare(&session, 1).unwrap();
        let warnings = fit::report(&problem, &found).unwrap().warnings;
        let warned = warnings.iter().any(|warning| warning.contains("the residual of pitch is"));
        assert_eq!(warned, doubts, "{warnings:?}");
    }
}
