//! Uninformative readings: too few, all equal, or with collinear parameters.

use super::{Case, fitted, found, works};

/// The position of a spindle ball without a prior is confounded with that of the axis.
#[test]
fn exactly_collinear_columns() {
    let case = Case { more: "spindle_ball_u_um = inf", ..Case::default() };
    let result = fitted(&case.session(), &case.data());
    assert_eq!((&result["rank"], &result["parameter_count"]), (&2.into(), &5.into()));
    assert_eq!(result["parameters"].as_array().unwrap().len(), 0);
    let whys: Vec<&str> =
        result["unobservable"].as_array().unwrap().iter().map(|u| u["why"].as_str().unwrap()).collect();
    for (error, ball) in [("EX0C", "spindle_ball.x[C]"), ("EY0C", "spindle_ball.y[C]")] {
        let found = whys.iter().any(|why| why.starts_with(&format!("{error} is confounded with {ball}")));
        assert!(found, "{whys:?}");
    }
    assert!(whys.contains(&"no reading of these tests changes with spindle_ball.z[C]"), "{whys:?}");
    // Their combined effect is identifiable.
    assert!(result["rms_um"].as_f64().unwrap() < 1e-3);
}

#[test]
fn more_parameters_than_readings() {
    let case = Case {
        errors: "[\"EX0C\", \"EY0C\", \"EZ0C\", \"EA0C\", \"EB0C\", \"EC0C\"]",
        more: "bar_u_um = inf",
        angles: vec![0.0, 90.0],
        runs: 1,
        ..Case::default()
    };
    let result = fitted(&case.session(), &case.data());
    assert_eq!((&result["readings"], &result["rank"], &result["parameter_count"]), (&2.into(), &2.into(), &7.into()));
    assert!(result["rms_um"].as_f64().unwrap() < 1e-3);
    assert!(!result["unobservable"].as_array().unwrap().is_empty());
}

/// A perfect circle about the nominal axis: no displacement and no scatter.
#[test]
fn all_readings_equal() {
    for noise in ["noise_um = 0.3", "noise_um = 0", ""] {
        let case = Case { noise, ..Case::default() };
        let data: String = case.data().lines().enumerate().fold(String::new(), |mut data, (number, line)| {
            let (place, length) = line.rsplit_once(',').unwrap();
            data += &format!("{place},{}\n", if number == 0 { length } else { "100" });
            data
        });
        let result = fitted(&case.session(), &data);
        for id in ["EX0C", "EY0C"] {
            assert!(found(&result, id).0.abs() < 1e-6, "{result:#}");
        }
    }
}

#[test]
fn one_run() {
    let result = works(&Case { runs: 1, ..Case::default() });
    let by = result["heldout_by"].as_str().unwrap();
    assert_eq!(by, "one of five contiguous blocks of each test at a time");
    assert!(result["heldout_rms_um"].as_f64().unwrap() < 1e-3);
}
