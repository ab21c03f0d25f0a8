//! The products of candidates against least squares on their rows.

use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

use abbe_files::ReadOptions;
use abbe_identify::fit::prepare;
use abbe_identify::problem::Problem;
use abbe_model::effect::Effect;
use faer::Mat;
use faer::linalg::solvers::SolveLstsq;

use super::candidate::Candidate;
use super::columns::{Columns, EffectColumns};
use super::gain::TrainedModel;
use super::gram::{Given, Gram, PriorGram};
use super::library;
use super::step_table::best_step_table;
use super::tuned::TunedChannel;

/// The bundled session with some readings rejected and noise of a given autocorrelation.
fn problem(ar_coefficients: &[f64]) -> (Problem, Vec<f64>) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
    let (mut problem, fit) = prepare(&abbe_files::session(&file, &ReadOptions::default()).unwrap(), 1).unwrap();
    problem.noise.ar_coefficients = ar_coefficients.to_vec();
    for (test, row) in [(0, 3), (0, 40), (1, 41), (2, 0), (3, 77)] {
        problem.rejected[test][row] = true;
    }
    (problem, fit.beta)
}

/// Orthonormal columns of the fitted model, and its residual: whitened rows in fold order.
fn model(columns: &Columns<'_>, beta: &[f64]) -> (Mat<f64>, Vec<f64>) {
    let rows = columns.model_rows(beta).unwrap();
    let svd = rows.as_ref().subcols(0, beta.len()).thin_svd().unwrap();
    let rank = svd.S().column_vector().iter().filter(|value| **value > 1e-6 * svd.S().column_vector()[0]).count();
    let residual = (0..rows.nrows()).map(|i| rows[(i, beta.len())]).collect();
    (svd.U().subcols(0, rank).to_owned(), residual)
}

/// The library's candidates, one in `every`, and those with most columns.
fn candidates(problem: &Problem, columns: &Columns<'_>, every: usize) -> Vec<EffectColumns> {
    let all = library::candidates(problem).unwrap();
    let chosen = all.iter().enumerate().filter(|(k, member)| k % every == 0 || member.effect.shape.coefficients() > 2);
    chosen.filter_map(|(_, member)| columns.effect_columns(&member.effect)).collect()
}

/// The rows of effects: whitened, in fold order.
fn rows(columns: &Columns<'_>, sets: &[&EffectColumns]) -> Mat<f64> {
    let mut rows = Mat::zeros(columns.rows(), sets.iter().map(|set| set.count).sum());
    columns.fill(sets, rows.as_mut());
    rows
}

/// Sum of squares of a residual after least squares on columns at unit length, over the rows of some folds.
fn left(columns: &Columns<'_>, folds: &[usize], parts: &[&Mat<f64>], residual: &[f64]) -> f64 {
    let rows: Vec<usize> = folds.iter().flat_map(|fold| columns.fold_rows[*fold].clone()).collect();
    let width = parts.iter().map(|part| part.ncols()).sum();
    let mut x = Mat::zeros(rows.len(), width);
    let mut next = 0;
    for part in parts {
        for j in 0..part.ncols() {
            let length = part.col(j).norm_l2();
            rows.iter().enumerate().for_each(|(i, row)| x[(i, next + j)] = part[(*row, j)] / length);
        }
        next += part.ncols();
    }
    let y = Mat::from_fn(rows.len(), 1, |i, _| residual[rows[i]]);
    let solved = x.col_piv_qr().solve_lstsq(&y);
    (y - x * solved).squared_norm_l2()
}

/// The gains of candidates beside chosen effects, on all readings and without one fold, are the decreases of the sum of
/// squares by least squares. So are the gains of effects with tuned numbers.
#[test]
fn gains_are_those_of_least_squares() {
    for ar_coefficients in [&[][..], &[0.5, 0.2][..]] {
        let (problem, beta) = problem(ar_coefficients);
        let columns = Columns::new(&problem, &beta);
        let (model, residual) = model(&columns, &beta);
        let sets = candidates(&problem, &columns, 97);
        let rank = model.ncols();
        let prior = PriorGram { base: Mat::zeros(rank, rank), base_y: vec![0.0; rank] };
        let gram = Gram::new(&columns, sets.clone(), Arc::new(model.clone()), &residual, prior);
        let all: Vec<usize> = (0..columns.fold_rows.len()).collect();
        let without: Vec<usize> = all.iter().copied().filter(|fold| *fold != 5).collect();
        let few: Vec<usize> = (0..sets.len()).filter(|k| sets[*k].count <= 2).collect();
        let mut compared = 0;
        for (folds, chosen) in
            [(&all, vec![]), (&without, vec![]), (&all, vec![few[10], few[30]]), (&without, vec![few[20]])]
        {
            let trained = TrainedModel::new(&gram, &chosen, folds).unwrap();
            let gains = trained.gains(&|_| true).unwrap();
            let beside: Vec<Mat<f64>> = chosen.iter().map(|k| rows(&columns, &[&sets[*k]])).collect();
            let parts: Vec<&Mat<f64>> = std::iter::once(&model).chain(&beside).collect();
            let before = left(&columns, folds, &parts, &residual);
            let (square, _) = trained.residual_square();
            assert!((square / before - 1.0).abs() < 1e-8, "{square} {before}");
            let tuning = trained.tuning();
            for (k, set) in sets.iter().enumerate().filter(|(k, set)| set.count <= 40 && !chosen.contains(k)) {
                let own = rows(&columns, &[set]);
                // Least squares decides differently about nearly collinear columns.
                if gains[k].freedom < set.count + set.numbers || own.col_iter().any(|column| column.norm_l2() == 0.0) {
                    continue;
                }
                let with: Vec<&Mat<f64>> = parts.iter().copied().chain([&own]).collect();
                let gain = before - left(&columns, folds, &with, &residual);
                let found = gains[k].gain;
                assert!((found - gain).abs() <= 1e-6 * gain + 1e-7 * before, "{k}: {found} {gain} of {before}");
                let channel = TunedChannel::of(&columns, &tuning, set);
                let basis = Mat::from_fn(set.basis.nrows(), set.count, |i, k| f64::from(set.basis[(i, k)]));
                let again = channel.gain(&channel.effect_of(basis));
                assert!((found - again).abs() <= 1e-8 * before, "{k}: {found} {again}");
                compared += 1;
            }
        }
        assert!(compared > 100, "{compared}");
    }
}

/// With other residuals the gains are those of products that are formed for each, on all readings and without one fold.
#[test]
fn products_serve_other_residuals() {
    let (problem, beta) = problem(&[0.4]);
    let columns = Columns::new(&problem, &beta);
    let (model, residual) = model(&columns, &beta);
    let sets = candidates(&problem, &columns, 211);
    let rank = model.ncols();
    let of = |residual: &[f64]| {
        let prior = PriorGram { base: Mat::zeros(rank, rank), base_y: vec![0.0; rank] };
        Gram::new(&columns, sets.clone(), Arc::new(model.clone()), residual, prior)
    };
    let other: Vec<f64> = residual.iter().enumerate().map(|(i, r)| 0.3 * r + (0.7 * i as f64).sin()).collect();
    let reverse: Vec<f64> = other.iter().rev().copied().collect();
    let all: Vec<usize> = (0..columns.fold_rows.len()).collect();
    let others = [other, reverse];
    for (known, other) in of(&residual).with_residuals(&others, &|| true).unwrap().iter().zip(&others) {
        let formed = of(other).keeping_nothing();
        for folds in [all.clone(), all[1..].to_vec()] {
            let gains = |gram: &Gram<'_>| TrainedModel::new(gram, &[], &folds).unwrap().gains(&|_| true).unwrap();
            let (found, expected) = (gains(known), gains(&formed));
            let greatest = expected.iter().map(|gain| gain.gain).fold(0.0, f64::max);
            assert!(greatest > 1.0 && found.len() == sets.len());
            for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
                assert_eq!(found.freedom, expected.freedom, "{k}");
                assert!((found.gain - expected.gain).abs() < 1e-9 * greatest, "{k}: {} {}", found.gain, expected.gain);
            }
        }
    }
}

/// Candidates that come in parts, with null draws and arrays of projections that are kept or formed again, have the gains
/// and the best null scores of all candidates together.
#[test]
fn candidates_in_parts_have_the_scores_of_all_together() {
    const DRAWS: usize = 5;
    let (problem, beta) = problem(&[0.5]);
    let columns = Columns::new(&problem, &beta);
    let (model, residual) = model(&columns, &beta);
    let model = Arc::new(model);
    let sets = candidates(&problem, &columns, 197);
    let rank = model.ncols();
    let prior = || PriorGram { base: Mat::zeros(rank, rank), base_y: vec![0.0; rank] };
    let rows = residual.len();
    let draw = move |k: usize| -> Vec<f64> { (0..rows).map(|i| ((i * (k + 3) + k) as f64).sin()).collect() };
    let draws = Given(DRAWS, draw);
    let folds: Vec<usize> = (0..columns.fold_rows.len()).collect();
    let scores = |gram: &Gram<'_>| {
        let trained = TrainedModel::new(gram, &[], &folds).unwrap();
        let gains: Vec<f64> = trained.gains(&|_| true).unwrap().into_iter().map(|gain| gain.gain).collect();
        (gains, trained.null_best(&[], &vec![0.0; gram.candidates()], 1.0).unwrap())
    };
    let mut together = Gram::new(&columns, sets.clone(), Arc::clone(&model), &residual, prior());
    together.take_draws(&draws, None, &|| true).unwrap();
    let (gains, best) = scores(&together);
    assert!(gains.len() > 20 && best.iter().all(|score| *score > 0.0), "{} {best:?}", gains.len());
    let near =
        |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-9 * a.abs());
    for kept_entries in [usize::MAX, 0] {
        let mut without = Gram::new(&columns, Vec::new(), Arc::clone(&model), &residual, prior());
        if kept_entries == 0 {
            without = without.keeping_nothing();
        }
        without.take_draws(&draws, Some(kept_entries), &|| true).unwrap();
        let (mut in_parts, mut best_in_parts) = (Vec::new(), vec![f64::NEG_INFINITY; DRAWS]);
        for part in sets.chunks(7) {
            let mut gram = without.clone();
            gram.append(part.to_vec());
            let (gains, best) = scores(&gram);
            in_parts.extend(gains);
            best_in_parts.iter_mut().zip(best).for_each(|(a, b)| *a = a.max(b));
        }
        assert!(near(&gains, &in_parts) && near(&best, &best_in_parts), "{best:?} {best_in_parts:?}");
    }
}

/// A circle of some positions, read several times, with a harmonic and something like noise; and its fit.
fn circle(positions: usize, runs: usize) -> (Problem, Vec<f64>) {
    let folder = tempfile::tempdir().unwrap();
    let mut table = String::from("run,x_mm,y_mm,length_mm\n");
    for i in 0..runs * positions {
        let (sin, cos) = (std::f64::consts::TAU * (i % positions) as f64 / positions as f64).sin_cos();
        let length = 100.0 + 1e-3 * (3.0 * sin * cos + ((i * i) as f64).sin());
        writeln!(table, "{},{:.9},{:.9},{length:.9}", 1 + i / positions, -100.0 * cos, -100.0 * sin).unwrap();
    }
    std::fs::write(folder.path().join("circle.csv"), table).unwrap();
    let text = "[machine]\nchain = \"w b Y X t\"\n[machine.axis.X]\n[machine.axis.Y]\n[instrument]\nkind = \"ballbar\"\n\
        noise_um = 0.7\n[unknowns]\nerrors = [\"EC0Y\"]\n[[test]]\nname = \"XY\"\ndata = \"circle.csv\"\nbar_mm = 100.0\n\
        workpiece_ball_mm = [0, 0, 0]\nspindle_ball_mm = [0, 0, 0]\nworkpiece_ball_u_um = [2, 2, 0]\n";
    let file = folder.path().join("session.toml");
    std::fs::write(&file, text).unwrap();
    let (problem, fit) = prepare(&abbe_files::session(&file, &ReadOptions::default()).unwrap(), 1).unwrap();
    (problem, fit.beta)
}

/// Columns of several candidates with draws are the products of their rows: of a circle that is read again and again, and of
/// readings in autocorrelated noise.
#[test]
fn products_with_draws_are_those_of_the_rows() {
    const DRAWS: usize = 20;
    for (problem, beta) in [circle(150, 5), problem(&[0.5, 0.2])] {
        let columns = Columns::new(&problem, &beta);
        let (model, residual) = model(&columns, &beta);
        let sets = candidates(&problem, &columns, 23);
        let rank = model.ncols();
        let prior = PriorGram { base: Mat::zeros(rank, rank), base_y: vec![0.0; rank] };
        let count = residual.len();
        let draw = move |k: usize| -> Vec<f64> { (0..count).map(|i| ((i * (k + 3) + k) as f64).sin()).collect() };
        let draws = Given(DRAWS, draw);
        let mut gram = Gram::new(&columns, sets.clone(), Arc::new(model.clone()), &residual, prior);
        gram.take_draws(&draws, None, &|| true).unwrap();
        let found = gram.null_products(0).unwrap();
        let own = rows(&columns, &sets.iter().collect::<Vec<_>>());
        assert!(sets.len() > 20 && found.ncols() == own.ncols());
        let drawn = Mat::from_fn(count, DRAWS, |i, k| draw(k)[i]);
        let without_model = &drawn - &model * (model.transpose() * &drawn);
        let expected = without_model.transpose() * &own;
        for j in 0..own.ncols() {
            // Draws are held in single precision.
            let scale = own.col(j).norm_l2() * (count as f64).sqrt();
            for k in 0..DRAWS {
                let (found, expected) = (found[(k, j)], expected[(k, j)]);
                assert!((found - expected).abs() <= 1e-6 * scale, "{j} {k}: {found} {expected} of {scale}");
            }
        }
    }
}

/// A circle of 12,000 positions, read twice: its states are shared among several tasks, whose sums add up.
#[test]
fn gains_of_a_long_session_are_those_of_least_squares() {
    let (problem, beta) = circle(12_000, 2);
    let columns = Columns::new(&problem, &beta);
    let (model, residual) = model(&columns, &beta);
    let all = library::candidates(&problem).unwrap();
    let sets: Vec<EffectColumns> =
        all.iter().step_by(all.len() / 30).filter_map(|member| columns.effect_columns(&member.effect)).collect();
    assert!(sets.iter().any(|set| set.channel.states.samples.len() > 4096), "all states in one task");
    let rank = model.ncols();
    let prior = PriorGram { base: Mat::zeros(rank, rank), base_y: vec![0.0; rank] };
    let gram = Gram::new(&columns, sets.clone(), Arc::new(model.clone()), &residual, prior);
    let folds: Vec<usize> = (0..columns.fold_rows.len()).collect();
    let trained = TrainedModel::new(&gram, &[], &folds).unwrap();
    let gains = trained.gains(&|_| true).unwrap();
    let before = left(&columns, &folds, &[&model], &residual);
    let mut compared = 0;
    for (set, gain) in sets.iter().zip(&gains).filter(|(set, gain)| gain.freedom >= set.count + set.numbers) {
        let found = before - left(&columns, &folds, &[&model, &rows(&columns, &[set])], &residual);
        assert!((gain.gain - found).abs() <= 1e-6 * found + 1e-7 * before, "{} {found} of {before}", gain.gain);
        compared += 1;
    }
    assert!(compared >= 5, "{compared} of {}", sets.len());
}

/// A step between two positions of the grid, which the dictionary approximates by two, is one step; two steps stay two.
#[test]
fn steps_off_the_grid_are_as_many_as_there_are() {
    let (problem, beta) = problem(&[]);
    let columns = Columns::new(&problem, &beta);
    let (model, _) = model(&columns, &beta);
    let all = library::candidates(&problem).unwrap();
    let is_own = |effect: &Effect| effect.component.to_string() == "EZC" && effect.driver.to_string() == "C";
    let member =
        all.iter().find(|m| m.dictionary && is_own(&m.effect) && !m.effect.shape.positions().is_empty()).unwrap();
    let set = columns.effect_columns(&member.effect).unwrap();
    let dictionary = Candidate::of(member.clone(), set.clone());
    let at = member.effect.shape.positions().to_vec();
    let folds: Vec<usize> = (0..columns.fold_rows.len()).collect();
    let mut approximated = 0;
    for (k, positions) in [(10, 1), (17, 1), (23, 1), (8, 2), (20, 2)] {
        let true_at: Vec<f64> = [0, 14][..positions].iter().map(|more| at[k + more] + 0.5 * dictionary.grid).collect();
        let effect = Effect { shape: member.effect.shape.with_positions(true_at.clone()), ..member.effect.clone() };
        let own = rows(&columns, &[&columns.effect_columns(&effect).unwrap()]);
        // Noise of variance 1, by the sum of twelve even numbers.
        let mut bits = 1_u64 + k as u64;
        let mut even = || {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (bits >> 11) as f64 / (1_u64 << 53) as f64
        };
        let y = Mat::from_fn(columns.rows(), 1, |i, _| {
            let steps: f64 = own.row(i).iter().zip([1.0, -1.0]).map(|(step, sign)| sign * step).sum();
            40.0 * steps / own.col(0).norm_l2() + (0..12).map(|_| even()).sum::<f64>() - 6.0
        });
        let residual = &y - &model * (model.transpose() * &y);
        let residual: Vec<f64> = residual.col(0).iter().copied().collect();
        let rank = model.ncols();
        let prior = PriorGram { base: Mat::zeros(rank, rank), base_y: vec![0.0; rank] };
        let gram = Gram::new(&columns, vec![set.clone()], Arc::new(model.clone()), &residual, prior);
        let trained = TrainedModel::new(&gram, &[], &folds).unwrap();
        let table = best_step_table(&trained, 0, &dictionary, 1.0).unwrap().unwrap();
        approximated += usize::from(table.effect.shape.positions().len() > positions);
        let tuning = trained.tuning();
        let table = table.with_best_positions(&TunedChannel::of(&columns, &tuning, &set), &dictionary, 1.0);
        let found = table.effect.shape.positions();
        assert_eq!(found.len(), positions, "{found:?}, true {true_at:?}");
        for (found, true_at) in found.iter().zip(&true_at) {
            assert!((found - true_at).abs() < dictionary.grid, "{found} {true_at} {}", dictionary.grid);
        }
    }
    assert!(approximated >= 3, "{approximated}");
}
