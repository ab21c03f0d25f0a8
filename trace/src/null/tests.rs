//! Null draws against closed forms.

use abbe_identify::noise::trends::trend_terms;

use super::*;

/// Three coordinates rise at their own rates. Nothing of the rise remains away from the ends. The spike remains up
/// to the difference of its neighbours.
#[test]
fn smooth_structure_is_removed_from_each_coordinate() {
    const ROWS: usize = 60;
    let (spiked, coordinate) = (30, 1);
    let residual: Vec<f64> = (0..3 * ROWS)
        .map(|i| (i / 3) as f64 * [1.0, -2.0, 5.0][i % 3] + if i == 3 * spiked + coordinate { 1e3 } else { 0.0 })
        .collect();
    let rough = without_smooth(&residual, 3);
    assert_eq!(rough.len(), residual.len());
    for row in SMOOTHING..ROWS - SMOOTHING {
        for k in 0..3 {
            let left = rough[3 * row + k];
            let spike = if (row, k) == (spiked, coordinate) { 1e3 } else { 0.0 };
            // A spike among an odd number of neighbours moves their median by at most one order statistic.
            assert!((left - spike).abs() <= 2.0 + 1e-9, "{row} {k}: {left}");
            if k != coordinate {
                assert!(left.abs() < 1e-9);
            }
        }
    }
}

/// The window of a reading near an end reaches to that end. Of a rise by one per reading, the distance from the middle of
/// the window remains; of an even number of readings the upper one is the middle.
#[test]
fn the_running_median_reaches_to_both_ends() {
    const ROWS: usize = 60;
    let residual: Vec<f64> = (0..ROWS).map(|row| row as f64).collect();
    let rough = without_smooth(&residual, 1);
    for from_end in 0..SMOOTHING {
        let middle = (from_end + SMOOTHING).div_ceil(2);
        assert_eq!(rough[from_end], from_end as f64 - middle as f64, "{from_end}");
        assert_eq!(rough[ROWS - 1 - from_end], SMOOTHING as f64 - middle as f64, "{from_end}");
    }
    assert!(rough[SMOOTHING..ROWS - SMOOTHING].iter().all(|left| *left == 0.0));
    // Fewer readings than a window have one median.
    assert_eq!(without_smooth(&[1.0, 5.0, 2.0], 1), [-1.0, 3.0, 0.0]);
}

/// The readings of one pose keep their signs relative to each other; poses get theirs independently.
#[test]
fn one_sign_for_each_pose() {
    const DRAWS: usize = 400;
    let mut generator = Pcg64::seed_from_u64(5);
    let whitened = [1.0, -2.0, 3.0, 4.0];
    let draws: Vec<Vec<f64>> = (0..DRAWS).map(|_| sign_flipped(&[2, 0, 2, 1], &whitened, &mut generator)).collect();
    let signs: Vec<[f64; 4]> = draws.iter().map(|draw| std::array::from_fn(|k| draw[k] / whitened[k])).collect();
    assert!(signs.iter().all(|signs| signs[0] == signs[2] && signs.iter().all(|sign| sign.abs() == 1.0)));
    for (a, b) in [(0, 1), (0, 3), (1, 3)] {
        let equal = signs.iter().filter(|signs| signs[a] == signs[b]).count() as f64;
        // Within four standard deviations of a fair coin.
        assert!((equal - 200.0).abs() < 40.0, "{a} {b}: {equal}");
    }
}

/// The answer to a pulse is the series of `A/A*`, by the division of the polynomials.
#[test]
fn a_draw_has_the_spectrum_of_its_coefficients_over_that_of_the_whitening() {
    let mut generator = Pcg64::seed_from_u64(6);
    let pulse = || [1.0, 0.0, 0.0, 0.0, 0.0];
    let answer = |spectrum: Spectrum, generator: &mut Pcg64| {
        let mut values = pulse();
        spectrum.give(&mut values, generator);
        values
    };
    let significant = |found: &[f64], sum_u: f64| Spectrum::Significant { coefficients: found.to_vec(), sum_u };
    let series = |a: [f64; 3], own: [f64; 3]| {
        let mut series = [0.0; 5];
        for t in 0..5 {
            let of_before: f64 = (1..=t.min(2)).map(|lag| own[lag] * series[t - lag]).sum();
            series[t] = a.get(t).copied().unwrap_or(0.0) - of_before;
        }
        series
    };
    let near = |found: [f64; 5], expected: [f64; 5]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{found:?} {expected:?}");
    };
    let one = Spectrum::NotSignificant(vec![(0.3, 0.8)]);
    near(answer(one, &mut generator), [0.8, 0.24, 0.072, 0.0216, 0.00648]);
    // The same coefficients leave the draw as it is.
    near(answer(significant(&[0.5, 0.2], 0.0), &mut generator), pulse());
    near(answer(Spectrum::White, &mut generator), pulse());
    // However uncertain, the sum of the coefficients stays that of a stationary process, at either bound.
    let mut seen = [false; 2];
    for _ in 0..50 {
        let far = answer(significant(&[0.5, 0.2], 1e6), &mut generator);
        let bounds = [MAX_AR_SUM, -MAX_AR_SUM];
        let at = bounds.iter().position(|sum| (far[1] - (sum - 0.2 - 0.5)).abs() < 1e-9);
        let at = at.unwrap_or_else(|| panic!("{far:?}"));
        near(far, series([1.0, -0.5, -0.2], [1.0, 0.2 - bounds[at], -0.2]));
        seen[at] = true;
    }
    assert_eq!(seen, [true; 2]);
}

/// Without a trend every reading of a block has its own sign; with one the block has one sign.
#[test]
fn signs_of_a_block() {
    const LENGTH: usize = 200;
    let mut generator = Pcg64::seed_from_u64(7);
    let stretch = |trend| Stretch { values: vec![2.0; LENGTH], trend, channels: 1 };
    let mut drawn = |stretch: &Stretch| {
        let mut values = Vec::new();
        stretch.draw(0..LENGTH, &mut values, &mut generator);
        assert!(values.len() == LENGTH && values.iter().all(|value| value.abs() == 2.0), "{values:?}");
        values.iter().filter(|value| **value > 0.0).count()
    };
    let positive = drawn(&stretch(Vec::new()));
    assert!((70..=130).contains(&positive), "{positive}");
    for _ in 0..8 {
        assert_eq!(drawn(&stretch(vec![[0.0; TERMS]; LENGTH])) % LENGTH, 0);
    }
}

/// Runs of 63 readings that have lost their trend, as pure error has. The sum over a block of 20 draws has the variance
/// of 20 independent readings, and so has the difference of neighbours. Without the trend it has less than half.
#[test]
fn blocks_of_draws_are_white_although_deviations_lack_their_trend() {
    const RUN: usize = 63;
    const BLOCK: usize = 20;
    let mut generator = Pcg64::seed_from_u64(3);
    let pool: Vec<Stretch> = (0..400)
        .map(|_| {
            let noise: Vec<f64> = (0..RUN).map(|_| generator.sample(StandardNormal)).collect();
            let times: Vec<f64> = (0..RUN).map(|t| t as f64).collect();
            // Scaled, so that the terms have to be normalised.
            let trend = trend_terms(&times).into_iter().map(|terms| terms.map(|q| 3.0 * q)).collect();
            Stretch::without_trend(noise, trend, 1)
        })
        .collect();
    let mut draws = NoiseDraws { pool, singles: OnceLock::new(), spectrum: Spectrum::White, freedom: None };
    let variance_of_sums = |draws: &NoiseDraws, generator: &mut Pcg64| {
        let values = draws.blocks(400_000, BLOCK, generator);
        let rough = values.windows(2).map(|two| (two[1] - two[0]).powi(2)).sum::<f64>() / (2.0 * 399_999.0);
        // Blocks at the end of a run are shorter: sums over a tenth of a block see few boundaries.
        let sums = values.chunks_exact(10).map(|part| part.iter().sum::<f64>().powi(2)).sum::<f64>();
        (sums / 400_000.0, rough)
    };
    let (slow, rough) = variance_of_sums(&draws, &mut generator);
    assert!((slow - 1.0).abs() < 0.08 && (rough - 1.0).abs() < 0.08, "{slow} {rough}");
    // Blocks of one reading lack the trend too: without it they have the variance 1 − TERMS/RUN.
    let singles = draws.blocks(400_000, SINGLE, &mut generator);
    let variance = singles.iter().map(|value| value * value).sum::<f64>() / 400_000.0;
    assert!((variance - 1.0).abs() < 0.02, "{variance}");
    draws.pool.iter_mut().for_each(|stretch| stretch.trend.iter_mut().for_each(|terms| *terms = [0.0; TERMS]));
    let (slow, _) = variance_of_sums(&draws, &mut generator);
    assert!(slow < 0.7, "{slow}");
}

/// The variance of a draw scatters as that of an estimate with so many degrees of freedom, and its autocorrelation by
/// its uncertainty.
#[test]
fn draws_differ_by_the_uncertainty_of_the_noise_model() {
    const ROWS: usize = 4000;
    const DRAWS: usize = 400;
    let mut generator = Pcg64::seed_from_u64(4);
    let draws = |freedom: Option<f64>, spectrum: Spectrum, generator: &mut Pcg64| -> Vec<(f64, f64)> {
        let source = NoiseDraws { pool: Vec::new(), singles: OnceLock::new(), spectrum, freedom };
        (0..DRAWS)
            .map(|_| {
                let values = source.draw(ROWS, 1, generator);
                let square = values.iter().map(|v| v * v).sum::<f64>();
                let neighbours = values.windows(2).map(|two| two[0] * two[1]).sum::<f64>();
                (square / ROWS as f64, neighbours / square)
            })
            .collect()
    };
    let moments = |of: Vec<f64>| {
        let mean = of.iter().sum::<f64>() / DRAWS as f64;
        (mean, (of.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / DRAWS as f64).sqrt())
    };
    // ν/χ² has the mean ν/(ν − 2) and the variance 2 ν²/((ν − 2)² (ν − 4)).
    let (mean, scatter) = moments(draws(Some(50.0), Spectrum::White, &mut generator).iter().map(|d| d.0).collect());
    assert!((mean - 50.0 / 48.0).abs() < 0.05, "{mean}");
    assert!((scatter / (2.0 * 2500.0 / (48.0 * 48.0 * 46.0_f64)).sqrt() - 1.0).abs() < 0.25, "{scatter}");
    let process = |first: f64, innovation_mm: f64| Process { coefficients: vec![first], sigma_mm: 1.0, innovation_mm };
    // 0.2 and 0.4: a mean of 0.3 and a scatter of 0.1, and noise of which a quarter more is not predicted.
    let possible = [0.2, 0.4_f64].map(|first| process(first, 1.25 * (1.0 - first * first).sqrt()));
    let spectrum = Spectrum::not_significant(&possible, 1.0, false);
    let correlated = draws(None, spectrum, &mut generator);
    let (mean, scatter) = moments(correlated.iter().map(|d| d.1).collect());
    assert!((mean - 0.3).abs() < 0.03 && (scatter / 0.1 - 1.0).abs() < 0.25, "{mean} {scatter}");
    let (mean, _) = moments(correlated.iter().map(|d| d.0).collect());
    assert!((mean - 1.25 * 1.25).abs() < 0.03, "{mean}");
    // Blocks have the mean autocorrelation, and the variance of a reading is that of the noise.
    let spectrum = Spectrum::not_significant(&possible, 1.0, true);
    let in_blocks = draws(None, spectrum, &mut generator);
    let (mean, scatter) = moments(in_blocks.iter().map(|d| d.1).collect());
    assert!(mean.abs() < 0.03 && (scatter / 0.1 - 1.0).abs() < 0.25, "{mean} {scatter}");
    let (mean, _) = moments(in_blocks.iter().map(|d| d.0).collect());
    assert!((mean - 1.0).abs() < 0.02, "{mean}");
}
