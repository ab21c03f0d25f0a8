//! Noise of lengths and of angles, each in its unit; values that were not read.

use super::*;

/// A residual of 10 µm that no effect explains: the value that was not read is no outlier beside it, and the pitch of its
/// row stays.
#[test]
fn a_value_that_was_not_read_is_no_outlier() {
    let folder = Folder::new();
    let mut random = Pcg64::seed_from_u64(3);
    let mut data = String::from("run,x_mm,deviation_um,pitch_arcsec\n");
    for row in 0..60 {
        let x = f64::from(row) * 5.0;
        let deviation = 10.0 + 0.1 * normal(&mut random) + 0.02 * x;
        let cell = if row == 10 { String::new() } else { format!("{deviation:.4}") };
        data += &format!("1,{x},{cell},{:.4}\n", 0.2 * normal(&mut random));
    }
    let session = laser_session(&folder, &data, [0.0; 3], &[]);
    let (problem, _) = prepare(&session, 1).unwrap();
    let rejected: Vec<usize> = (0..60).filter(|row| problem.rejected[0][*row]).collect();
    assert!(rejected.is_empty(), "{rejected:?}");
    assert_eq!((problem.readings(), problem.scalars()), (60, 119));
}

/// Where neither noise is stated, that of each unit follows from its own repeats: readings with 0.4 µm and 0.1″, over
/// sessions. The lever is their ratio, and the figures of each unit are its own.
#[test]
fn the_noise_of_lengths_and_angles_is_found_apart() {
    let folder = Folder::new();
    let mut random = Pcg64::seed_from_u64(19);
    let (mut lengths, mut angles, mut chi) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..20 {
        let mut data = String::from("run,x_mm,deviation_um,pitch_arcsec\n");
        for run in 1..=6 {
            for step in 0..=20 {
                let x = f64::from(if run % 2 == 1 { 10 * step } else { 200 - 10 * step });
                let (deviation, pitch) = (0.4 * normal(&mut random), 0.1 * normal(&mut random));
                data += &format!("{run},{x},{deviation:.5},{pitch:.5}\n");
            }
        }
        folder.write("laser.csv", &data);
        let session = folder.session(&format!(
            "{MILL}[instrument]\nkind = \"laser\"\n[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [1, 0, 0]\n"
        ));
        let (problem, found) = prepare(&session, 1).unwrap();
        let result = fit::report(&problem, &found).unwrap();
        lengths.push(result.model.noise.value);
        angles.push(result.model.of_angles.unwrap().noise_arcsec);
        chi.push(result.model.chi_square / result.model.degrees_of_freedom as f64);
        // A plan and a validation of this session weigh its angles alike.
        let (complete, noise) = abbe::plan::prepared(&session, &Default::default()).unwrap();
        assert!((complete.lever_mm / problem.session.lever_mm - 1.0).abs() < 1e-12);
        assert!((noise.sigma_mm * 1e3 / result.model.noise.value - 1.0).abs() < 1e-9);
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    // Twenty sessions of about 80 degrees of freedom a unit: 1.8 % of sampling error.
    assert!((mean(&lengths) / 0.4 - 1.0).abs() < 0.055, "{}", mean(&lengths));
    assert!((mean(&angles) / 0.1 - 1.0).abs() < 0.055, "{}", mean(&angles));
    assert!((mean(&chi) - 1.0).abs() < 0.06, "{}", mean(&chi));
}

/// Noise and resolution of a simulation hold for the columns, each unit its own, and the session that is written states
/// them.
#[test]
fn simulated_noise_and_resolution_are_those_of_each_unit() {
    use abbe::identify::simulate::{Simulation, simulate};
    let folder = Folder::new();
    let text = format!(
        "{MILL}[instrument]\nkind = \"laser\"\nnoise_um = 0.5\nnoise_arcsec = 3\nresolution_um = 0.1\nresolution_arcsec = 0.5\n[[test]]\n\
         name = \"L\"\nbeam = [1, 0, 0]\nreflector_mm = [0, 7.77777, -120.123456]\nchannels = [\"vertical\", \"pitch\"]\n\
         sweep = {{ axis = \"X\", from_mm = 0, to_mm = 1000, step_mm = 1, runs = 1, both_directions = false }}\n"
    );
    let session = folder.session(&text);
    let of = |simulation: &Simulation| -> [f64; 2] {
        let drawn = simulate(&session, simulation).unwrap();
        let observed = &drawn.readings[0].observed;
        let deviation = |place: usize, unit: f64, step: f64| {
            let values: Vec<f64> = observed.iter().skip(place).step_by(2).map(|value| value / unit).collect();
            for value in &values {
                assert!((value / step - (value / step).round()).abs() < 1e-6, "{value} is no multiple of {step}");
            }
            (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
        };
        [deviation(0, 1e-3, 0.1), deviation(1, ARCSECOND, 0.5)]
    };
    // 1001 readings: 2.2 % of sampling error.
    let [vertical, pitch] = of(&Simulation { seed: 1, ..Simulation::default() });
    assert!((vertical / 0.5 - 1.0).abs() < 0.07 && (pitch / 3.0 - 1.0).abs() < 0.07, "{vertical} {pitch}");
    let [vertical, pitch] = of(&Simulation { noise_mm: Some(2e-3), seed: 2, ..Simulation::default() });
    assert!((vertical / 2.0 - 1.0).abs() < 0.07 && (pitch / 3.0 - 1.0).abs() < 0.07, "{vertical} {pitch}");
    let [vertical, pitch] = of(&Simulation { noise_rad: Some(10.0 * ARCSECOND), seed: 3, ..Simulation::default() });
    assert!((vertical / 0.5 - 1.0).abs() < 0.07 && (pitch / 10.0 - 1.0).abs() < 0.07, "{vertical} {pitch}");
}
