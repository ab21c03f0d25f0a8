//! The held-out errors of a model, by what is held out.
//!
//! | readings | held out | tests | decides |
//! |---|---|---|---|
//! | along runs | one run | noise | yes |
//! | along runs | one test | prediction of another radius, bar or axis | between aliases |
//! | independent poses | random poses | interpolation | no |
//! | independent poses | blocks of joint space | extrapolation | yes |

use abbe_model::Diagnostic;

use super::left_out::{LeftOutTests, left_out_tests_of_fit};
use super::{FoldKind, held_out, stated_rms_mm};
use crate::fit::Fit;
use crate::problem::Problem;
use crate::results::{CrossValidation, TestNotLeftOut};

/// The held-out errors of a fit. `deciding_mm` is the held-out error by the folds of the problem. Readings that
/// `judged` excludes do not count.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn cross_validation(
    problem: &Problem,
    fit: &Fit,
    deciding_mm: f64,
    judged: &Problem,
) -> Result<CrossValidation, Diagnostic> {
    let in_um = |mm: f64| mm * 1e3;
    let kind = problem.folds.kind;
    let extrapolation = (kind == FoldKind::PoseBlocks).then_some(deciding_mm);
    let interpolation = match interpolated(problem, fit)? {
        Some(residuals) => Some(stated_rms_mm(judged, &residuals)),
        None => (kind == FoldKind::RandomPoses).then_some(deciding_mm),
    };
    let run = matches!(kind, FoldKind::Runs | FoldKind::RunGroups).then_some(deciding_mm);
    let left_out = left_out_tests_of_fit(problem, fit)?;
    let test = left_out.rms_mm(judged);
    let three = problem.are_vectors().then_some(3.0_f64.sqrt());
    let in_3d = |mm: Option<f64>| Some(in_um(mm?) * three?);
    Ok(CrossValidation {
        interpolation_rms_um: interpolation.map(in_um),
        interpolation_rms_3d_um: in_3d(interpolation),
        extrapolation_rms_um: extrapolation.map(in_um),
        extrapolation_rms_3d_um: in_3d(extrapolation),
        left_out_run_rms_um: run.map(in_um),
        left_out_run_rms_3d_um: in_3d(run),
        left_out_test_rms_um: test.map(in_um),
        left_out_test_rms_3d_um: in_3d(test),
        left_out_tests: names(problem, &left_out),
        tests_not_left_out: (left_out.not_left_out.into_iter())
            .map(|kept| TestNotLeftOut { test: problem.tests[kept.test].name.clone(), parameters: kept.parameters })
            .collect(),
    })
}

/// The residuals of held-out random poses, if the deciding folds are blocks of joint space.
fn interpolated(problem: &Problem, fit: &Fit) -> Result<Option<Vec<Vec<f64>>>, Diagnostic> {
    let Some(folds) = &problem.folds.interpolation else { return Ok(None) };
    let problem = problem.with_folds((**folds).clone());
    let triangles = problem.triangles(&fit.beta)?;
    let whole = problem.prior_triangle(&fit.beta).merged(&triangles);
    Ok(Some(held_out(&problem, &fit.beta, &triangles, &whole, &fit.rank.identifiable_basis)?.1.residuals))
}

/// The names of the tests that were left out.
fn names(problem: &Problem, left_out: &LeftOutTests) -> Vec<String> {
    let judged = problem.tests.iter().zip(&left_out.residuals).filter(|(_, residual)| residual.is_some());
    judged.map(|(test, _)| test.name.clone()).collect()
}
