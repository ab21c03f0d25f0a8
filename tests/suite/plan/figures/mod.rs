//! Every figure of a plan, recomputed from simulated readings: the columns are differences of readings, and the algebra
//! is that of another library.

mod detectability;
mod structure;

use std::collections::BTreeMap;

use abbe::identify::quantity::Given;
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::session::Session;
use abbe::plan::bias::{bias_table, usual_effects};
use abbe::plan::results::{Detectability, ErrorAnalysis, PlanAnalysis};
use abbe::plan::structure::structure;
use abbe::plan::{PlanOptions, analyse, states};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

use crate::suite::plan::help::{noise_um, session};

const NOISE_UM: f64 = 0.4;
/// Radians of an arcsecond.
const ARCSEC: f64 = std::f64::consts::PI / 180.0 / 3600.0;

const MACHINE: &str = r#"
[machine]
name = "five axes"
chain = "w C A b Y X Z t"
[machine.axis.C]
direction = [0, 0, 1]
origin_mm = [5, -10, 0]
[machine.axis.A]
direction = [1, 0, 0]
origin_mm = [0, 20, -40]
[machine.axis.X]
direction = [1, 0, 0]
[machine.axis.Y]
direction = [0, 1, 0]
[machine.axis.Z]
direction = [0, 0, 1]
"#;

/// Three tests in two set-ups, of different lengths, with a bar of known length, one of stated uncertainty and one free.
pub fn plan(unknowns: &str, effects: &str) -> Session {
    let test = |name: &str, bar: &str, balls: &str, priors: &str, at: &str, sweep: &str| {
        format!("[[test]]\nname = \"{name}\"\nbar_mm = {bar}\n{balls}\n{priors}\n{at}\nsweep = {{ {sweep} }}\n")
    };
    let p1 = "workpiece_ball_mm = [0, 100, 10]\nspindle_ball_mm = [0, 0, 0]\nsetup = \"P1\"\nspindle_setup = \"S\"";
    let p2 = "workpiece_ball_mm = [60, -80, 40]\nspindle_ball_mm = [0, 0, 0]\nsetup = \"P2\"\nspindle_setup = \"S\"";
    let u1 = "workpiece_ball_u_um = [2, 3, 4]\nspindle_ball_u_um = [1, 1.5, 0.5]\nbar_u_um = 0.7";
    let u2 = "workpiece_ball_u_um = [5, 2, 3]\nspindle_ball_u_um = [1, 1.5, 0.5]";
    let tests = [
        test(
            "A",
            "116.07",
            p1,
            u1,
            "at = { x_mm = 67.6, y_mm = 20.4, z_mm = -39.8 }",
            "axis = \"A\", from_deg = -20, to_deg = 70, step_deg = 5, feed_deg_min = 360, both_directions = false",
        ),
        test(
            "C",
            "110.2",
            p1,
            u1,
            "at = { x_mm = 6.6, y_mm = -10.2, z_mm = 12 }",
            "axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 10, feed_deg_min = 720, both_directions = true",
        ),
        test(
            "C far",
            "152.4",
            p2,
            &format!("{u2}\nbar_u_um = 0"),
            "at = { x_mm = 5.1, y_mm = -9.6, z_mm = 163.7 }",
            "axis = \"C\", from_deg = 10, to_deg = 350, step_deg = 4, feed_deg_min = 500, runs = 2, both_directions = false",
        ),
    ];
    session(&format!(
        "{MACHINE}[instrument]\nkind = \"ballbar\"\nnoise_um = {NOISE_UM}\n[unknowns]\nerrors = {unknowns}\n{}{effects}",
        tests.concat()
    ))
}

pub const EIGHT: &str = r#"["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"]"#;
const TWELVE: &str =
    r#"["EX0A", "EY0A", "EZ0A", "EB0A", "EC0A", "EA0A", "EX0C", "EY0C", "EZ0C", "EA0C", "EB0C", "EC0C"]"#;

/// A parameter as this test knows it.
struct Own {
    id: String,
    unit: &'static str,
    /// Physical size in the unit.
    size: f64,
    /// Prior standard uncertainty in the unit.
    prior: Option<f64>,
    is_error: bool,
}

/// A plan with its columns: µm of reading per unit of each parameter.
struct Columns {
    own: Vec<Own>,
    tests: Vec<usize>,
    jacobian: DMatrix<f64>,
}

impl Columns {
    fn of(session: &Session) -> Columns {
        let complete = states::complete(session, true).unwrap();
        let problem = states::problem_by_test(&complete, noise_um(NOISE_UM)).unwrap();
        let own: Vec<Own> = problem.parameters.list.iter().map(|parameter| own(&parameter.id.to_string())).collect();
        let tests = simulated(session, &own[0].id, 0.0, own[0].unit);
        let tests: Vec<usize> = (0..).zip(&tests).flat_map(|(test, values)| values.iter().map(move |_| test)).collect();
        let columns: Vec<DVector<f64>> = own.iter().map(|own| column(session, own, tests.len())).collect();
        Columns { jacobian: DMatrix::from_columns(&columns), own, tests }
    }

    fn place(&self, id: &str) -> usize {
        self.own.iter().position(|own| own.id == id).unwrap_or_else(|| panic!("{id}"))
    }

    /// Readings over their noise, then priors, per physical size of each parameter, with the readings of some tests.
    fn scaled(&self, noise: f64, keeps: impl Fn(usize) -> bool, with_priors: bool) -> DMatrix<f64> {
        let kept: Vec<usize> = (0..self.tests.len()).filter(|row| keeps(self.tests[*row])).collect();
        let count = self.own.len();
        let mut rows = DMatrix::zeros(kept.len() + count, count);
        for (j, own) in self.own.iter().enumerate() {
            for (i, row) in kept.iter().enumerate() {
                rows[(i, j)] = self.jacobian[(*row, j)] / noise * own.size;
            }
            rows[(kept.len() + j, j)] = own.prior.filter(|_| with_priors).map_or(0.0, |u| own.size / u);
        }
        rows
    }

    /// Covariance in units of the parameters, and whether each parameter is identifiable.
    fn covariance(&self, noise: f64, keeps: impl Fn(usize) -> bool) -> (DMatrix<f64>, Vec<bool>) {
        let svd = self.scaled(noise, keeps, true).svd(false, true);
        let right = svd.v_t.unwrap();
        let count = self.own.len();
        let mut covariance = DMatrix::zeros(count, count);
        let mut identifiable = vec![true; count];
        for (k, sigma) in svd.singular_values.iter().enumerate() {
            let row = right.row(k);
            // One standard deviation per physical size, as in the documentation of the rank.
            if *sigma >= 1.0 {
                covariance += row.transpose() * row / (sigma * sigma);
            } else {
                identifiable.iter_mut().enumerate().for_each(|(j, is)| *is &= row[j].abs() < 1e-5);
            }
        }
        let size = DVector::from_iterator(count, self.own.iter().map(|own| own.size));
        (DMatrix::from_fn(count, count, |i, j| covariance[(i, j)] * size[i] * size[j]), identifiable)
    }

    /// The change of all readings and priors along a combination, over the sum of its parts.
    fn along(&self, combination: &BTreeMap<String, f64>, with_priors: bool) -> f64 {
        let mut sum = DVector::zeros(self.tests.len());
        let mut parts = 0.0;
        for (id, value) in combination {
            let j = self.place(id);
            sum += self.jacobian.column(j) * *value;
            parts += (self.jacobian.column(j) * *value).norm();
            if with_priors {
                assert!(self.own[j].prior.is_none(), "{id} has a prior");
            }
        }
        sum.norm() / parts.max(1e-9)
    }
}

fn own(id: &str) -> Own {
    let (thing, of) = id.split_once('[').unwrap_or((id, ""));
    let prior = match thing {
        "bar" => Some(0.7),
        "workpiece_ball.x" => Some(if of == "P1]" { 2.0 } else { 5.0 }),
        "workpiece_ball.y" => Some(if of == "P1]" { 3.0 } else { 2.0 }),
        "workpiece_ball.z" => Some(if of == "P1]" { 4.0 } else { 3.0 }),
        "spindle_ball.x" => Some(1.0),
        "spindle_ball.y" => Some(1.5),
        "spindle_ball.z" => Some(0.5),
        _ => None,
    };
    let is_angle = prior.is_none() && matches!(id.as_bytes()[1], b'A' | b'B' | b'C');
    let (unit, size) = if is_angle { ("arcsec", 0.01 / ARCSEC) } else { ("um", 1e3) };
    Own { id: id.into(), unit, size, prior, is_error: prior.is_none() }
}

/// Change of all readings by a value, µm per unit: central differences at two steps, extrapolated.
fn column(session: &Session, own: &Own, rows: usize) -> DVector<f64> {
    let step = if own.unit == "um" { 50.0 } else { 20.0 };
    let [near, far] = [step, 2.0 * step].map(|step| {
        let [plus, minus] = [step, -step].map(|value| simulated(session, &own.id, value, own.unit).concat());
        DVector::from_iterator(rows, plus.iter().zip(&minus).map(|(plus, minus)| (plus - minus) * 1e3 / (2.0 * step)))
    });
    (4.0 * near - far) / 3.0
}

/// Noise-free readings of each test with one value, mm.
fn simulated(session: &Session, id: &str, value: f64, unit: &str) -> Vec<Vec<f64>> {
    let given = vec![Given { id: id.to_string(), value, unit: unit.to_string() }];
    let drawn = simulate(session, &Simulation { given, noise_mm: Some(0.0), ..Simulation::default() }).unwrap();
    drawn.readings.iter().map(|readings| readings.observed.clone()).collect()
}

fn near(found: f64, wanted: f64, within: f64, what: &str) {
    assert!((found - wanted).abs() <= within * wanted.abs().max(1e-12), "{what}: {found} instead of {wanted}");
}

fn analysis(session: &Session, effects: bool) -> PlanAnalysis {
    analyse(session, &PlanOptions { effects, planned_only: true, ..PlanOptions::default() }).unwrap()
}

/// What an error has of its own: sensitivities, curves, uncertainty, budget and correlations.
#[test]
fn figures_of_errors_follow_from_differences_of_readings() {
    let session = plan(EIGHT, "");
    let columns = Columns::of(&session);
    let found = analysis(&session, false);
    let names = ["A", "C", "C far"];
    assert_eq!(found.readings, columns.tests.len());
    assert_eq!((found.parameter_count, found.rank, found.setup_count), (columns.own.len(), columns.own.len(), 2));
    near(found.noise.value, NOISE_UM, 1e-12, "noise");
    let (covariance, identifiable) = columns.covariance(NOISE_UM, |_| true);
    assert!(identifiable.iter().all(|is| *is));
    assert_eq!(found.errors.iter().map(|error| error.id.as_str()).collect::<Vec<_>>(), found.correlation.ids);
    for (row, error) in found.errors.iter().enumerate() {
        let j = columns.place(&error.id);
        let own = &columns.own[j];
        let what = |figure: &str| format!("{} {figure}", error.id);
        assert_eq!(error.unit, own.unit);
        let variance = covariance[(j, j)];
        near(error.u.unwrap(), variance.sqrt(), 1e-5, &what("u"));
        check_sensitivity(error, &columns, j, &names);
        check_budget(error, &columns, &covariance, j);
        // The other errors are known: their rows leave the inverse.
        let information = {
            let inverse = covariance.clone().try_inverse().unwrap();
            let kept: Vec<usize> = (0..columns.own.len()).filter(|k| *k == j || !columns.own[*k].is_error).collect();
            inverse.select_rows(&kept).select_columns(&kept).try_inverse().unwrap()
        };
        let place = (0..columns.own.len()).filter(|k| *k == j || !columns.own[*k].is_error).position(|k| k == j);
        let place = place.unwrap();
        near(error.conditional_u.unwrap(), information[(place, place)].sqrt(), 1e-4, &what("conditional u"));
        let mut listed = BTreeMap::new();
        for other in found.errors.iter().filter(|other| other.id != error.id) {
            let k = columns.place(&other.id);
            let rho = covariance[(j, k)] / (variance * covariance[(k, k)]).sqrt();
            let column = found.correlation.ids.iter().position(|id| *id == other.id).unwrap();
            assert!((found.correlation.matrix[row][column].unwrap() - rho).abs() < 1e-5, "{} {}", error.id, other.id);
            if rho.abs() >= 0.1 {
                listed.insert(other.id.clone(), rho);
            }
        }
        assert_eq!(found.correlation.matrix[row][row], Some(1.0));
        assert!(error.correlated_with.is_sorted_by(|a, b| a.correlation.abs() >= b.correlation.abs() - 1e-7));
        assert_eq!(error.correlated_with.len(), listed.len(), "{}", error.id);
        error.correlated_with.iter().for_each(|c| near(c.correlation, listed[&c.id], 1e-4, &what(&c.id)));
    }
    let worst = found.errors.iter().max_by(|a, b| a.u.unwrap().total_cmp(&b.u.unwrap())).unwrap();
    assert_eq!(found.worst().unwrap().id, worst.id);
}

fn check_sensitivity(error: &ErrorAnalysis, columns: &Columns, j: usize, names: &[&str]) {
    let column = columns.jacobian.column(j);
    let (row, largest) = column.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap();
    let sensitivity = &error.sensitivity;
    near(sensitivity.largest, *largest, 1e-5, &format!("{} largest", error.id));
    assert_eq!(sensitivity.largest_in_test, names[columns.tests[row]], "{}", error.id);
    near(sensitivity.rms, column.norm() / (column.len() as f64).sqrt(), 1e-5, &format!("{} rms", error.id));
    assert_eq!(sensitivity.unit, format!("um/{}", columns.own[j].unit));
    let mut of_tests = Vec::new();
    for (test, name) in names.iter().enumerate() {
        let values: Vec<f64> =
            column.iter().zip(&columns.tests).filter(|(_, of)| **of == test).map(|(value, _)| *value).collect();
        // The first of two runs of 86, each second reading; the others have one run in one or two directions.
        let first: Vec<f64> = match test {
            0 => values.clone(),
            1 => values[..37].to_vec(),
            _ => values[..86].iter().step_by(2).copied().collect(),
        };
        let Some(curve) = error.curves.iter().find(|curve| curve.test == *name) else {
            assert!(values.iter().all(|value| value.abs() < 1e-8), "{} {name}", error.id);
            continue;
        };
        of_tests.push(test);
        assert_eq!(curve.values.len(), first.len(), "{} {name}", error.id);
        let scale = first.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        for (found, wanted) in curve.values.iter().zip(&first) {
            assert!((found - wanted).abs() < 1e-5 * scale, "{} {name}: {found} instead of {wanted}", error.id);
        }
    }
    assert!(!of_tests.is_empty());
}

/// `Cov = Cov·JᵀJ/σ²·Cov + Σ (Cov e)(Cov e)ᵀ/u²`.
fn check_budget(error: &ErrorAnalysis, columns: &Columns, covariance: &DMatrix<f64>, j: usize) {
    let variance = covariance[(j, j)];
    let noise = (&columns.jacobian * covariance.column(j)).norm_squared() / (NOISE_UM * NOISE_UM);
    let of_setup = columns.own.iter().enumerate().filter_map(|(s, own)| {
        let u = own.prior?;
        Some((own.id.clone(), (covariance[(j, s)] / u).powi(2)))
    });
    let mut wanted: Vec<(String, f64)> = of_setup.chain([("noise".to_string(), noise)]).collect();
    near(wanted.iter().map(|part| part.1).sum::<f64>(), variance, 1e-6, "the parts");
    wanted.retain(|(source, part)| *part >= 1e-4 * variance || source == "noise");
    assert_eq!(error.budget.len(), wanted.len(), "{}", error.id);
    assert!(error.budget.is_sorted_by(|a, b| a.share >= b.share - 1e-9), "{}", error.id);
    for part in &error.budget {
        let (_, square) = wanted.iter().find(|(source, _)| *source == part.source).unwrap();
        near(part.u, square.sqrt(), 1e-3, &format!("{} {}", error.id, part.source));
        near(part.share, square / variance, 2e-3, &format!("{} {}", error.id, part.source));
        assert_eq!(part.is_noise(), part.source == "noise");
    }
    near(error.noise_share(), noise / variance, 1e-3, "the share of the noise");
}

/// What a test has of its own: its readings, its time, the travel of its sensor, and what is lost without it.
#[test]
fn figures_of_tests_follow_from_differences_of_readings() {
    let session = plan(EIGHT, "");
    let columns = Columns::of(&session);
    let found = analysis(&session, false);
    let nominal = simulated(&session, "EY0A", 0.0, "um");
    let bars = [116.07, 110.2, 152.4];
    // 90° at 360 °/min; 360° at 720 °/min there and back; 340° at 500 °/min twice. 3 s between two runs.
    let [counts, minutes] = [[19.0, 74.0, 172.0], [0.25, 1.05, 2.0 * 340.0 / 500.0 + 0.05]];
    let mut moving = 0.0;
    for (k, test) in found.tests.iter().enumerate() {
        assert_eq!((test.name.as_str(), test.setup.as_str()), [("A", "P1"), ("C", "P1"), ("C far", "P2")][k]);
        assert_eq!(test.readings as f64, counts[k], "{}", test.name);
        let minute = test.moving_min.unwrap();
        near(minute, minutes[k], 1e-9, &test.name);
        moving += minute;
        let reach = nominal[k].iter().fold(0.0_f64, |most, reading| most.max((reading - bars[k]).abs()));
        near(test.reach_mm.unwrap(), reach, 1e-9, &test.name);
        let warned = found.warnings.iter().any(|warning| warning.starts_with(&format!("{}: the distance", test.name)));
        assert_eq!(warned, reach > 1.0, "{} {reach} {:?}", test.name, found.warnings);
    }
    near(found.moving_min.unwrap(), moving, 1e-12, "the time of all tests");
    let (covariance, _) = columns.covariance(NOISE_UM, |_| true);
    assert_eq!(found.leave_one_out.len(), 3);
    for (test, loss) in found.leave_one_out.iter().enumerate() {
        assert_eq!(loss.test, found.tests[test].name);
        let (without, identifiable) = columns.covariance(NOISE_UM, |row| row != test);
        assert_eq!(loss.variance_inflation.len(), 8);
        let (mut lost, mut grown) = (0, 0);
        for inflation in &loss.variance_inflation {
            let j = columns.place(&inflation.id);
            assert_eq!(inflation.factor.is_some(), identifiable[j], "{} without {}", inflation.id, loss.test);
            let Some(factor) = inflation.factor else {
                lost += 1;
                continue;
            };
            let wanted = without[(j, j)] / covariance[(j, j)];
            near(factor, wanted, 1e-4, &format!("{} without {}", inflation.id, loss.test));
            if wanted >= 1.5 {
                grown += 1;
                assert!(loss.why.contains(&format!("{} {wanted:.1} times", inflation.id)), "{}", loss.why);
            } else {
                assert!(!loss.why.contains(&inflation.id), "{}", loss.why);
            }
        }
        assert_eq!(loss.why.contains("only "), lost > 0, "{}", loss.why);
        assert_eq!(loss.why.contains("the variance increases"), grown > 0, "{}", loss.why);
        assert_eq!(loss.why.contains("no variance increases by 50 %"), lost + grown == 0, "{}", loss.why);
    }
}
