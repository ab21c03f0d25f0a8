//! Observability indices, ranks, base parameters, combinations and near dependencies.

use super::*;

/// Indices from singular values of the information on the errors, the set-up eliminated within its priors.
#[test]
fn indices_and_ranks_follow_from_differences_of_readings() {
    let session = plan(EIGHT, "");
    let columns = Columns::of(&session);
    let found = analysis(&session, false).indices;
    let (covariance, _) = columns.covariance(NOISE_UM, |_| true);
    let errors: Vec<usize> = (0..columns.own.len()).filter(|j| columns.own[*j].is_error).collect();
    let of_errors = covariance.select_rows(&errors).select_columns(&errors);
    let scaled =
        DMatrix::from_fn(8, 8, |i, j| of_errors[(i, j)] / (columns.own[errors[i]].size * columns.own[errors[j]].size));
    let mut sigma: Vec<f64> = scaled.symmetric_eigenvalues().iter().map(|value| 1.0 / value.sqrt()).collect();
    sigma.sort_by(|a, b| b.total_cmp(a));
    assert_eq!((found.identifiable_count, found.error_count), (8, 8));
    let product: f64 = sigma.iter().map(|s| s.powf(0.125)).product();
    near(found.o1, product / (columns.tests.len() as f64).sqrt(), 1e-4, "O1");
    near(found.o2, sigma[7] / sigma[0], 1e-4, "O2");
    near(found.condition_number, sigma[0] / sigma[7], 1e-4, "condition number");
    near(found.o3, sigma[7], 1e-4, "O3");
    near(found.o4, sigma[7] * sigma[7] / sigma[0], 1e-4, "O4");
    near(found.o5, 1.0 / sigma.iter().map(|s| 1.0 / s).sum::<f64>(), 1e-4, "O5");
    let information = of_errors.try_inverse().unwrap();
    let unit = DMatrix::from_fn(8, 8, |i, j| information[(i, j)] / (information[(i, i)] * information[(j, j)]).sqrt());
    let lambda = unit.symmetric_eigenvalues();
    near(found.d_efficiency, lambda.product().powf(0.125), 1e-3, "D");
    near(found.a_efficiency, 8.0 / lambda.map(|l| 1.0 / l).sum(), 1e-3, "A");
    near(found.e_efficiency, lambda.min(), 1e-3, "E");
    let leverage = |row: usize| {
        let x = columns.jacobian.row(row);
        (x * &covariance * x.transpose())[(0, 0)] / (NOISE_UM * NOISE_UM)
    };
    let leverages: Vec<f64> = (0..columns.tests.len()).map(leverage).collect();
    let most = leverages.iter().copied().fold(0.0, f64::max);
    near(found.g_efficiency, leverages.iter().sum::<f64>() / leverages.len() as f64 / most, 1e-5, "G");

    let twelve = plan(TWELVE, "");
    let columns = Columns::of(&twelve);
    let complete = states::complete(&twelve, true).unwrap();
    let problem = states::problem_by_test(&complete, noise_um(NOISE_UM)).unwrap();
    let structure = structure(&problem).unwrap();
    let mut singular: Vec<f64> = columns.scaled(NOISE_UM, |_| true, true).singular_values().iter().copied().collect();
    singular.sort_by(|a, b| b.total_cmp(a));
    let rank = |values: &[f64]| values.iter().filter(|value| **value > 1e-9 * values[0]).count();
    assert_eq!((structure.parameter_count, structure.rank), (columns.own.len(), rank(&singular)));
    let mut of_readings: Vec<f64> =
        columns.scaled(NOISE_UM, |_| true, false).singular_values().iter().copied().collect();
    of_readings.sort_by(|a, b| b.total_cmp(a));
    println!("{of_readings:?}");
    assert_eq!(structure.rank_of_readings, rank(&of_readings));
    assert!(structure.rank_without_priors <= structure.rank_of_readings);
    for (found, wanted) in structure.singular_values.iter().zip(&singular).take(structure.rank) {
        near(*found, *wanted, 1e-4, "a singular value");
    }
    let (covariance, _) = columns.covariance(NOISE_UM, |_| true);
    assert_eq!(structure.base.len() + structure.held_at_nominal.len(), 12);
    for base in &structure.base {
        let terms: Vec<(usize, f64)> = std::iter::once((columns.place(&base.id), 1.0))
            .chain(base.terms.iter().map(|(id, share)| (columns.place(id), *share)))
            .collect();
        let variance: f64 = terms
            .iter()
            .flat_map(|(i, x)| terms.iter().map(|(j, y)| x * y * covariance[(*i, *j)]).collect::<Vec<_>>())
            .sum();
        near(base.u, variance.sqrt(), 1e-4, &format!("u of the base parameter {}", base.id));
        assert_eq!(base.unit, columns.own[terms[0].0].unit);
    }
}

/// Combinations, in the units of their members: nothing changes along those without readings, whatever the priors, nor
/// along those that only priors determine.
#[test]
fn combinations_leave_the_readings_unchanged_in_their_units() {
    let session = plan(TWELVE, "");
    let columns = Columns::of(&session);
    let found = analysis(&session, false);
    let (_, identifiable) = columns.covariance(NOISE_UM, |_| true);
    assert_eq!(found.unidentifiable.len(), found.parameter_count - found.rank);
    assert!(found.unidentifiable.iter().any(|one| one.combination.len() > 1), "{:?}", found.unidentifiable);
    let mut named = std::collections::BTreeSet::new();
    for one in &found.unidentifiable {
        let combination: BTreeMap<String, f64> = one.combination.iter().map(|(id, v)| (id.clone(), *v)).collect();
        assert!(columns.along(&combination, true) < 1e-6, "{combination:?}");
        assert!(combination.values().any(|value| *value == 1.0), "{combination:?}");
        for id in combination.keys() {
            // A description has six quantities at most, or five and the number of the others.
            assert!(combination.len() > 6 || one.why.contains(id.as_str()), "{}", one.why);
            named.insert(id.clone());
        }
    }
    for error in &found.errors {
        let j = columns.place(&error.id);
        assert_eq!(error.u.is_some(), identifiable[j], "{}", error.id);
        assert_eq!(named.contains(&error.id), !identifiable[j], "{}", error.id);
        assert_eq!(error.budget.is_empty(), error.u.is_none());
        assert_eq!(error.conditional_u.is_some(), error.u.is_some());
        let row = found.correlation.ids.iter().position(|id| *id == error.id).unwrap();
        assert_eq!(found.correlation.matrix[row][row].is_some(), error.u.is_some());
    }
    assert_eq!(
        found.indices.identifiable_count,
        identifiable.iter().zip(&columns.own).filter(|(is, own)| **is && own.is_error).count()
    );
    assert_eq!(found.indices.error_count, 12);
    // One test of C alone: where the balls are is told by their priors only.
    let mut session = plan("[\"EX0C\", \"EY0C\", \"EA0C\"]", "");
    session.tests.drain(..1);
    session.tests.truncate(1);
    let columns = Columns::of(&session);
    let found = analysis(&session, false);
    assert!(!found.determined_by_prior.is_empty());
    for one in &found.determined_by_prior {
        let combination: BTreeMap<String, f64> = one.combination.iter().map(|(id, v)| (id.clone(), *v)).collect();
        assert!(columns.along(&combination, false) < 1e-6, "{combination:?}");
        assert_eq!(combination[&one.error], 1.0);
        assert!(combination.keys().all(|id| *id == one.error || columns.own[columns.place(id)].prior.is_some()));
        assert!(one.why.starts_with(&format!("{} is confounded with ", one.error)), "{}", one.why);
    }
}

/// Short arcs of C: its position and its orientation are nearly collinear. The combination in its units has the ratio
/// of its sensitivity to that of the strongest one.
#[test]
fn near_dependencies_have_their_condition_index() {
    let text = format!(
        "{MACHINE}[instrument]\nkind = \"ballbar\"\nnoise_um = {NOISE_UM}\n[unknowns]\nerrors = [\"EX0C\", \"EY0C\", \"EA0C\", \"EB0C\"]\n\
         [[test]]\nname = \"C\"\nbar_mm = 150\nat = {{ x_mm = 5, y_mm = -10, z_mm = 122 }}\nworkpiece_ball_mm = [0, 90, 10]\nspindle_ball_mm = [0, 0, 0]\n\
         workpiece_ball_u_um = [0, 0, 0]\nspindle_ball_u_um = [0, 0, 0]\nbar_u_um = 0\n\
         sweep = {{ axis = \"C\", from_deg = 0, to_deg = 25, step_deg = 0.5, feed_deg_min = 100 }}\n\
         [[test]]\nname = \"C low\"\nbar_mm = 100\nat = {{ x_mm = 5, y_mm = -10, z_mm = 30 }}\nworkpiece_ball_mm = [0, 90, 30]\nspindle_ball_mm = [0, 0, 0]\n\
         workpiece_ball_u_um = [0, 0, 0]\nspindle_ball_u_um = [0, 0, 0]\nbar_u_um = 0\n\
         sweep = {{ axis = \"C\", from_deg = 0, to_deg = 25, step_deg = 0.5, feed_deg_min = 100 }}\n"
    );
    let session = session(&text);
    let columns = Columns::of(&session);
    let found = analysis(&session, false);
    assert!(!found.nearly_collinear.is_empty(), "{:?}", found.indices);
    let unit = DMatrix::from_columns(&columns.jacobian.column_iter().map(|c| c.normalize()).collect::<Vec<_>>());
    let singular = unit.singular_values();
    let mut indices: Vec<f64> = singular.iter().map(|sigma| singular.max() / sigma).collect();
    indices.sort_by(f64::total_cmp);
    for near_dependency in &found.nearly_collinear {
        let index = near_dependency.condition_index;
        assert!(index >= 10.0);
        assert!(indices.iter().any(|wanted| (wanted / index - 1.0).abs() < 1e-4), "{index} {indices:?}");
        let mut moved = DVector::zeros(columns.tests.len());
        let mut square = 0.0;
        for (id, value) in &near_dependency.combination {
            let column = columns.jacobian.column(columns.place(id));
            moved += column * *value;
            square += (column.norm() * value).powi(2);
        }
        let ratio = singular.max() * square.sqrt() / moved.norm();
        println!("{index:.1}, of the combination {ratio:.1}: {}", near_dependency.why);
        // Parts below a tenth of the largest are left out of the combination.
        assert!(ratio > 0.2 * index && ratio < 1.5 * index, "{ratio} {index}");
        assert_eq!(near_dependency.combination[0].1, 1.0);
    }
    assert_eq!(found.nearly_collinear.len(), indices.iter().filter(|index| **index >= 10.0).count());
}
