//! Limits of noise and priors: none, exact, and contradictory ones.

use super::{Case, displaced, fitted, found, session_refused, works};

/// A noise of zero means that it is estimated. Readings that repeat exactly have none, and only the rounding of a
/// double remains.
#[test]
fn a_noise_of_zero() {
    for noise in ["noise_um = 0", ""] {
        let result = works(&Case { noise, ..Case::default() });
        assert_eq!(result["noise_source"], "repeats");
        assert!((result["noise_um"].as_f64().unwrap() - 1e-6).abs() < 1e-18);
        let (_, u) = found(&result, "EX0C");
        assert!((u - 1e-6 * (2.0_f64 / 72.0).sqrt()).abs() < 1e-9, "{u}");
    }
}

/// Readings of a nominal machine that repeat to their resolution: the noise of repeats is that of the resolution, 0.1 µm/√12,
/// with which the fit begins too.
#[test]
fn repeats_within_the_resolution() {
    let case = Case { noise: "resolution_um = 0.1", ..Case::default() };
    let nominal: String = (case.angles.iter().chain(&case.angles).enumerate())
        .map(|(row, angle)| format!("{},{angle:?},{:?}\n", 1 + row / case.angles.len(), case.bar_mm))
        .collect();
    let result = fitted(&case.session(), &format!("run,c_deg,length_mm\n{nominal}"));
    assert_eq!(result["noise_source"], "repeats");
    assert!((result["noise_um"].as_f64().unwrap() - 0.1 / 12.0_f64.sqrt()).abs() < 1e-9, "{}", result["noise_um"]);
}

#[test]
fn an_invalid_noise() {
    for (noise, message) in [
        ("noise_um = 1e-300", "`noise_um` is 1e-300 µm; the least value other than 0 is 1e-6 µm"),
        ("noise_um = 5e-324", "`noise_um` is 5e-324 µm; the least value other than 0 is 1e-6 µm"),
        ("noise_um = 1e300", "`noise_um` is 1e300, which is too large; the limit is 1e12"),
        ("noise_um = inf", "`noise_um` is infinite"),
        ("noise_um = -0.1", "`noise_um` is -0.1; it cannot be negative"),
        ("resolution_um = 1e-300", "`resolution_um` is 1e-300 µm; the least value other than 0 is 1e-6 µm"),
    ] {
        session_refused(&Case { noise, ..Case::default() }, &["session.toml:6", message]);
    }
}

/// The scatter of repeats, 0.3 µm of alternating sign by run and position, is compared with the stated noise.
#[test]
fn a_stated_noise_that_differs_from_that_of_repeats() {
    let session = |noise| Case { noise, ..Case::default() };
    // Two runs that differ by ±0.3·√2 µm have a standard deviation of 0.3 µm.
    let data = |case: &Case| {
        let mut state = 7_u64;
        let mut data = String::from("run,c_deg,length_mm\n");
        for run in 1..=2 {
            for angle in &case.angles {
                // Linear congruential generator of Knuth; its upper bit is random enough.
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let sign = if state >> 63 == 0 { 1.0 } else { -1.0 };
                data += &format!("{run},{angle:?},{:?}\n", case.length_mm(*angle) + 0.3e-3 * sign);
            }
        }
        data
    };
    // Less than twice the other is no disagreement, however significant the difference is.
    for (noise, warned) in [
        ("noise_um = 3", true),
        ("noise_um = 0.03", true),
        ("noise_um = 0.3", false),
        ("noise_um = 0.5", false),
        ("noise_um = 0.18", false),
        ("", false),
    ] {
        let case = session(noise);
        let result = fitted(&case.session(), &data(&case));
        // The Birge ratio is below 1 if readings scatter less than stated; uncertainties are not reduced.
        if noise == "noise_um = 3" {
            let ratio = result["birge_ratio"].as_f64().unwrap();
            assert!((ratio - 0.1).abs() < 0.005, "{ratio}");
            assert_eq!(result["u_enlargement"], 1.0);
        }
        let warnings = result["warnings"].as_array().unwrap();
        let is_it = |warning: &&serde_json::Value| {
            let warning = warning.as_str().unwrap();
            warning.starts_with("the session states a noise of") && warning.contains("the repeatability is 0.")
        };
        assert_eq!(warnings.iter().any(|w| is_it(&w)), warned, "{noise}: {warnings:?}");
        assert_eq!(result["stderr"].as_str().unwrap().contains("the session states a noise of"), warned);
    }
}

/// The smallest and the largest accepted noise give correct results.
#[test]
fn noises_at_their_limits() {
    let least = works(&Case { noise: "noise_um = 1e-6", ..Case::default() });
    let (_, u) = found(&least, "EX0C");
    assert!((u / (1e-6 * (2.0_f64 / 72.0).sqrt()) - 1.0).abs() < 1e-3, "{u}");
    // At a noise of a kilometre an error of a millimetre is not identifiable, and the result says so.
    let case = Case { noise: "noise_um = 1e9", ..Case::default() };
    let greatest = fitted(&case.session(), &case.data());
    assert_eq!(greatest["rank"], 0);
    assert_eq!(greatest["parameters"].as_array().unwrap().len(), 0);
    assert_eq!(greatest["unobservable"].as_array().unwrap().len(), 2);
}

#[test]
fn priors_of_zero_and_of_infinity() {
    let known = works(&Case { more: "bar_u_um = 0", ..Case::default() });
    assert_eq!(known["parameters"].as_array().unwrap().len(), 2);
    // Without a prior the mean of 72 readings determines the bar length.
    let free = works(&Case { more: "bar_u_um = inf", longer_mm: 0.05, ..Case::default() });
    let (value, u) = found(&free, "bar[C]");
    assert!((value + 50.0).abs() < 1e-3, "{value}");
    assert!((u - 0.3 / 72.0_f64.sqrt()).abs() < 1e-3, "{u}");
}

#[test]
fn invalid_priors() {
    for (more, message) in [
        ("bar_u_um = -1", "`bar_u_um` is -1; an uncertainty cannot be negative"),
        ("bar_u_um = nan", "`bar_u_um` is NaN"),
        ("bar_u_um = 1e-300", "`bar_u_um` is 1e-300 µm; the least value other than 0 is 1e-6 µm"),
        ("bar_u_um = 1e300", "`bar_u_um` is 1e300, which is too large; the limit is 1e12"),
    ] {
        session_refused(&Case { more, ..Case::default() }, &["session.toml:17", message]);
    }
}

/// A bar with u = 0.1 µm that is 50 µm longer: the weighted mean of both, and uncertainties enlarged by their
/// disagreement.
#[test]
fn a_prior_that_the_readings_contradict() {
    let case = Case { more: "bar_u_um = 0.1", longer_mm: 0.05, ..Case::default() };
    let result = fitted(&case.session(), &case.data());
    displaced(&result, 0.05);
    let (from_prior, from_readings) = (1.0 / 0.1_f64.powi(2), 72.0 / 0.3_f64.powi(2));
    let (value, _) = found(&result, "bar[C]");
    let wanted = -50.0 * from_readings / (from_prior + from_readings);
    assert!((value - wanted).abs() < 0.01, "{value} {wanted}");
    assert!(result["birge_ratio"].as_f64().unwrap() > 10.0);
    assert_eq!(result["u_enlargement"], result["birge_ratio"]);
    assert!(result["stderr"].as_str().unwrap().contains("the residual exceeds the noise"));
}

/// Two statements on one bar: a warning, and the tighter statement holds.
#[test]
fn priors_that_contradict_each_other() {
    let case = Case { more: "bar_u_um = 1\nbar_setup = \"B\"", ..Case::default() };
    let session = case.session();
    let test = &session[session.find("[[test]]").unwrap()..];
    let second = test.replace("name = \"C\"", "name = \"D\"").replace("bar_u_um = 1", "bar_u_um = 0.001");
    let result = fitted(&format!("{session}\n{second}"), &case.data());
    displaced(&result, 1e-3);
    let stderr = result["stderr"].as_str().unwrap();
    assert!(stderr.contains("tests \"C\" and \"D\" share the set-up \"B\" and describe it differently"), "{stderr}");
    let (_, u) = found(&result, "bar[B]");
    assert!((u - 0.001).abs() < 1e-5, "{u}");
}
