//! Scalar figures of merit: observability indices O1 to O5, condition number, D-, A-, E- and G-efficiency.
//!
//! They refer to the information `RᵀR` on the errors with the set-up quantities eliminated within their priors. The
//! unit is standard deviations per physical size (1 mm, 0.01 rad). `σ1 ≥ … ≥ σm` are the singular values of `R`.
//!
//! An efficiency compares with uncorrelated errors. With `C = D⁻¹ᐟ²RᵀRD⁻¹ᐟ²` and `D` the diagonal of `RᵀR` (so that the
//! scale of an error does not matter), `D = det(C)^(1/m)`, `A = m/tr(C⁻¹)`, `E = λ_min(C)`. All are 1 for uncorrelated
//! errors (Atkinson, Donev & Tobias, Optimum Experimental Designs, 2007, ch. 10). `G` is the mean leverage of a reading
//! over the greatest.

use faer::{Mat, MatRef};

use super::results::Indices;
use abbe_identify::linear::Linearisation;
use abbe_identify::numerics::solve::Svd;
use abbe_model::Diagnostic;

/// The indices of a plan.
///
/// # Errors
/// If the decomposition fails.
pub fn indices(
    linear: &Linearisation,
    of_interest: &[usize],
    readings: usize,
    g_efficiency: f64,
) -> Result<Indices, Diagnostic> {
    let errors = of_interest.len();
    let identifiable: Vec<usize> = of_interest.iter().copied().filter(|j| linear.rank.is_identifiable(*j)).collect();
    let m = identifiable.len();
    if m == 0 {
        return Ok(Indices { error_count: errors, condition_number: f64::INFINITY, ..Indices::default() });
    }
    let r = linear.marginal(&identifiable)?;
    let size: Vec<f64> = identifiable.iter().map(|j| linear.size[*j]).collect();
    Ok(Indices { error_count: errors, g_efficiency, ..of_triangle(r.as_ref(), &size, readings)? })
}

/// The indices from the triangular factor of the identifiable errors, in internal units. `size` is the physical size of
/// each error.
fn of_triangle(r: MatRef<'_, f64>, size: &[f64], readings: usize) -> Result<Indices, Diagnostic> {
    let m = size.len();
    let scaled = Mat::from_fn(m, m, |i, j| r[(i, j)] * size[j]);
    let sigma = Svd::of(scaled.as_ref())?.singular_values;
    let (first, last) = (sigma[0], sigma[m - 1]);
    let mean_log = sigma.iter().map(|s| s.ln()).sum::<f64>() / m as f64;
    let norm: Vec<f64> = (0..m).map(|j| (0..m).map(|i| r[(i, j)].powi(2)).sum::<f64>().sqrt()).collect();
    let unit = Mat::from_fn(m, m, |i, j| r[(i, j)] / norm[j]);
    let lambda: Vec<f64> = Svd::of(unit.as_ref())?.singular_values.iter().map(|s| s * s).collect();
    let count = m as f64;
    Ok(Indices {
        identifiable_count: m,
        condition_number: first / last,
        o1: mean_log.exp() / (readings.max(1) as f64).sqrt(),
        o2: last / first,
        o3: last,
        o4: last * last / first,
        o5: 1.0 / sigma.iter().map(|s| 1.0 / s).sum::<f64>(),
        d_efficiency: (lambda.iter().map(|l| l.ln()).sum::<f64>() / count).exp(),
        a_efficiency: count / lambda.iter().map(|l| 1.0 / l).sum::<f64>(),
        e_efficiency: lambda.last().copied().unwrap_or(0.0),
        ..Indices::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
    }

    /// Singular values 8 and 2 over 16 readings.
    #[test]
    fn observability_indices_of_two_uncorrelated_errors() {
        let r = Mat::from_fn(2, 2, |i, j| if i == j { [4.0, 0.2][i] } else { 0.0 });
        let found = of_triangle(r.as_ref(), &[2.0, 10.0], 16).unwrap();
        near(found.o1, 1.0);
        near(found.o2, 0.25);
        near(found.o3, 2.0);
        near(found.o4, 0.5);
        near(found.o5, 1.6);
        near(found.condition_number, 4.0);
        for efficiency in [found.d_efficiency, found.a_efficiency, found.e_efficiency] {
            near(efficiency, 1.0);
        }
    }

    /// Two columns at an angle with cosine c. The eigenvalues of C are 1 ± c, whatever the lengths of the columns.
    #[test]
    fn efficiencies_of_two_errors_at_an_angle() {
        let c = 0.6_f64;
        let r = Mat::from_fn(2, 2, |i, j| [[3.0, 7.0 * c], [0.0, 7.0 * (1.0 - c * c).sqrt()]][i][j]);
        let found = of_triangle(r.as_ref(), &[1.0, 1.0], 1).unwrap();
        near(found.d_efficiency, (1.0 - c * c).sqrt());
        near(found.a_efficiency, 1.0 - c * c);
        near(found.e_efficiency, 1.0 - c);
    }
}
