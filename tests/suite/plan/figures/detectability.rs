//! Detectable effects and their biases.

use super::*;

/// Probability that χ² of one or two coefficients exceeds its critical value, by the normal distribution: outside an
/// interval, or outside a circle.
fn power(freedom: usize, significance: f64, noncentrality: f64) -> f64 {
    let normal = Normal::standard();
    let shift = noncentrality.sqrt();
    if freedom == 1 {
        let bound = normal.inverse_cdf(1.0 - significance / 2.0);
        return normal.cdf(-bound - shift) + normal.sf(bound - shift);
    }
    let bound = (-2.0 * significance.ln()).sqrt();
    let slices = 20_000;
    let width = 2.0 * bound / f64::from(slices);
    let inside = |k: i32| {
        let x = -bound + (f64::from(k) + 0.5) * width;
        normal.pdf(x - shift) * (2.0 * normal.cdf((bound * bound - x * x).sqrt()) - 1.0) * width
    };
    1.0 - (0..slices).map(inside).sum::<f64>()
}

/// Undeclared effects, by the columns that they have once they are declared, at a usual noise, at one in which only
/// their largest values show, and at one in which they vanish.
#[test]
fn detectability_and_biases_follow_from_differences_of_readings() {
    let session = plan(EIGHT, "");
    let columns = Columns::of(&session);
    let complete = states::complete(&session, true).unwrap();
    let problem = states::problem_by_test(&complete, noise_um(NOISE_UM)).unwrap();
    let table = bias_table(&problem, &usual_effects(&problem).unwrap()).unwrap();
    let noises = [NOISE_UM, 300.0, 2e4];
    let analyses = noises.map(|noise| {
        let options = PlanOptions { noise_mm: Some(noise * 1e-3), planned_only: true, ..PlanOptions::default() };
        analyse(&session, &options).unwrap().effects.unwrap()
    });
    let (mut verdicts, mut in_table) = (Vec::new(), 0);
    for (component, shape, id, coefficients) in [
        ("EZC", "\"harmonic\"\norder = 2", "EZC~C:h2", &["EZC~C:h2.cos", "EZC~C:h2.sin"][..]),
        ("EBC", "\"harmonic\"\norder = 3", "EBC~C:h3", &["EBC~C:h3.cos", "EBC~C:h3.sin"]),
        ("EXC", "\"harmonic\"\norder = 1", "EXC~C:h1", &["EXC~C:h1.cos", "EXC~C:h1.sin"]),
        ("EYA", "\"harmonic\"\norder = 5", "EYA~A:h5", &["EYA~A:h5.cos", "EYA~A:h5.sin"]),
        ("EB0X", "\"constant\"", "EB0X~none:constant", &["EB0X~none:constant"]),
        ("EC0Y", "\"constant\"", "EC0Y~none:constant", &["EC0Y~none:constant"]),
        ("EYC", "\"backlash\"", "EYC~C:backlash", &["EYC~C:backlash"]),
    ] {
        let declared = plan(EIGHT, &format!("[[effect]]\ncomponent = \"{component}\"\nshape = {shape}\n"));
        let of_effect: Vec<DVector<f64>> =
            coefficients.iter().map(|id| column(&declared, &own(id), columns.tests.len())).collect();
        let of_effect = DMatrix::from_columns(&of_effect);
        let kind = own(id);
        for (noise, found) in noises.iter().zip(&analyses) {
            assert_eq!((found.significance_level, found.power), (0.01, 0.95));
            let each = -f64::exp_m1(f64::ln_1p(-0.01) / found.effects_screened as f64);
            near(found.significance_level_corrected, each, 1e-9, "Šidák");
            let (covariance, _) = columns.covariance(*noise, |_| true);
            let effect = found.effects.iter().find(|effect| effect.id == id).unwrap_or_else(|| panic!("{id}"));
            assert_eq!(effect.unit, kind.unit);
            let information = of_effect.transpose() * &of_effect / (noise * noise);
            let bias = &covariance * columns.jacobian.transpose() * &of_effect / (noise * noise);
            let left = &information - of_effect.transpose() * &columns.jacobian * &bias / (noise * noise);
            let eigen = left.clone().symmetric_eigen();
            let weakest = eigen.eigenvalues.imin();
            let phase = eigen.eigenvectors.column(weakest);
            let whole = (phase.transpose() * &information * phase)[(0, 0)];
            let weakest = eigen.eigenvalues[weakest];
            let has_signal = information.symmetric_eigenvalues().max() * kind.size * kind.size >= 1.0;
            let share = if has_signal { weakest / whole } else { 0.0 };
            assert!((effect.residual_share - share).abs() < 2e-5, "{id} at {noise}: {share} {effect:?}");
            let needed = |power_at: f64| {
                let (mut low, mut high) = (0.0, 1000.0);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if power(coefficients.len(), power_at, middle) < 0.95 { low = middle } else { high = middle }
                }
                high
            };
            let levels = [0.01, each].map(|level| (needed(level) / weakest).sqrt());
            let is_rounding = weakest < 1e-6 * whole;
            for (found, wanted) in
                [effect.detectable_amplitude, effect.detectable_amplitude_screened].iter().zip(levels)
            {
                assert_eq!(
                    found.is_some(),
                    !is_rounding && wanted <= kind.size,
                    "{id} at {noise}: {wanted} {effect:?}"
                );
                found.iter().for_each(|found| near(*found, wanted, 1e-3, &format!("amplitude of {id} at {noise}")));
            }
            let confounded = share < 0.01 || levels[0] > kind.size;
            let verdict = match (has_signal, confounded) {
                (false, _) => Detectability::NoSignal,
                (true, false) => Detectability::Detectable,
                _ if eigen.eigenvalues.max() > 0.01 * information.symmetric_eigenvalues().max() => {
                    Detectability::ConfoundedAtOnePhase
                }
                _ => Detectability::Confounded,
            };
            assert_eq!(effect.verdict, verdict, "{id} at {noise}");
            verdicts.push(verdict.word());
            let mut of_errors: Vec<(f64, &Own)> = (0..columns.own.len())
                .filter(|j| columns.own[*j].is_error)
                .map(|j| {
                    let row = bias.row(j);
                    (if row.len() == 1 { row[0] } else { row.norm() }, &columns.own[j])
                })
                .filter(|(value, _)| value.abs() >= 1e-3)
                .collect();
            of_errors.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
            assert_eq!(effect.biases.len(), of_errors.len().min(4), "{id} at {noise}");
            for listed in &effect.biases {
                let (wanted, error) = of_errors.iter().find(|(_, error)| error.id == listed.id).unwrap();
                near(listed.per_unit, *wanted, 1e-3, &format!("bias of {} by {id} at {noise}", listed.id));
                assert_eq!(listed.unit, format!("{}/{}", error.unit, kind.unit));
                assert!(listed.per_unit.abs() > 0.999 * of_errors[effect.biases.len() - 1].0.abs());
            }
            // The table of biases has the sign of each coefficient, at the noise of the session.
            for (k, coefficient) in coefficients.iter().enumerate().filter(|_| *noise == NOISE_UM) {
                let Some(row) = table.rows.iter().find(|row| row.id == **coefficient) else { continue };
                in_table += 1;
                assert_eq!((row.effect.as_str(), row.unit.as_str()), (id, kind.unit));
                let rms = |column: DVector<f64>| column.norm() / (column.len() as f64).sqrt();
                near(row.signal_um, rms(of_effect.column(k).into_owned()), 1e-4, "signal");
                let rest = of_effect.column(k) - &columns.jacobian * bias.column(k);
                near(row.residual_um, rms(rest), 1e-3, "residual");
                let most = bias.column(k).abs().max();
                for (error, found) in table.errors.iter().zip(&row.bias) {
                    let j = columns.place(&error.id);
                    assert_eq!(error.unit, columns.own[j].unit);
                    let wanted = bias[(j, k)];
                    assert!(
                        (found - wanted).abs() < 1e-4 * most,
                        "{} by {coefficient}: {found} {wanted} {most}",
                        error.id
                    );
                }
                assert_eq!(row.largest(), row.bias.iter().fold(0.0, |most, bias| bias.abs().max(most)));
            }
        }
        println!("{id}: {:?}", &verdicts[verdicts.len() - 3..]);
    }
    assert!(in_table >= 4);
    for verdict in ["detectable", "confounded", "confounded at one phase", "no signal"] {
        assert!(verdicts.contains(&verdict), "{verdict}: {verdicts:?}");
    }
}
