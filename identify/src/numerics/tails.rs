//! Tails and quantiles of the χ², the normal and the t distribution.
//!
//! At real effect sizes the tail of χ² underflows, so that a search compares its logarithm.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};
use statrs::function::gamma::{gamma_ur, ln_gamma};

/// `P(χ² > x)` with the given degrees of freedom; 1 for none.
pub fn chi_square_tail(x: f64, freedom: f64) -> f64 {
    ChiSquared::new(freedom).map_or(1.0, |law| law.sf(x))
}

/// `P(χ² < x)` and `P(χ² > x)`; `None` for no degrees of freedom.
pub fn chi_square_tails(x: f64, freedom: f64) -> Option<[f64; 2]> {
    ChiSquared::new(freedom).ok().map(|law| [law.cdf(x), law.sf(x)])
}

/// `P(χ² > x)` with the given degrees of freedom; with those of the noise too, that of the ratio
/// `F = (χ²/ν)/1`.
pub fn residual_tail(x: f64, freedom: f64, freedom_of_noise: Option<usize>) -> f64 {
    match freedom_of_noise.map(|of_noise| FisherSnedecor::new(freedom, of_noise.max(1) as f64)) {
        Some(Ok(law)) => law.sf(x / freedom),
        _ => chi_square_tail(x, freedom),
    }
}

/// The 95 % quantile of χ² with one degree of freedom.
pub const QUANTILE_95: f64 = 3.841_458_820_694_124;

/// The value that χ² exceeds with a probability; 0 for no degrees of freedom.
pub fn chi_square_quantile(probability: f64, freedom: f64) -> f64 {
    ChiSquared::new(freedom).map_or(0.0, |law| law.inverse_cdf(1.0 - probability))
}

/// The probability that a standard normal variable exceeds a value.
pub fn normal_tail(x: f64) -> f64 {
    Normal::standard().sf(x)
}

/// The probability that a variable of Student's t distribution exceeds a value; normal for infinite degrees of freedom.
pub fn student_tail(x: f64, freedom: f64) -> f64 {
    if freedom.is_finite() { StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |law| law.sf(x)) } else { normal_tail(x) }
}

/// The value that a standard normal variable exceeds with a probability.
pub fn normal_quantile(probability: f64) -> f64 {
    -Normal::standard().inverse_cdf(probability)
}

/// The value that a variable of Student's t distribution exceeds with a probability of at most a half.
pub fn student_quantile(probability: f64, freedom: f64) -> f64 {
    let probability = probability.clamp(f64::MIN_POSITIVE, 0.5);
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |law| -law.inverse_cdf(probability))
}

/// `ln P(χ²ₖ > x)`.
pub fn ln_chi_square_tail(x: f64, k: usize) -> f64 {
    if k == 0 || x <= 0.0 {
        return 0.0;
    }
    let (a, z) = (k as f64 / 2.0, x / 2.0);
    if k == 2 {
        return -z;
    }
    if z < a + 1.0 {
        return gamma_ur(a, z).max(f64::MIN_POSITIVE).ln();
    }
    // Γ(a, z) by its continued fraction (Lentz; Abramowitz & Stegun 6.5.31). The logarithm is taken before any
    // underflow.
    let tiny = 1e-300;
    let mut b = z + 1.0 - a;
    let mut c = 1.0 / tiny;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..500 {
        let an = -(i as f64) * (i as f64 - a);
        b += 2.0;
        d = an * d + b;
        d = 1.0 / if d.abs() < tiny { tiny } else { d };
        c = b + an / c;
        if c.abs() < tiny {
            c = tiny;
        }
        let delta = c * d;
        h *= delta;
        if (delta - 1.0).abs() < 1e-14 {
            break;
        }
    }
    -z + a * z.ln() - ln_gamma(a) + h.ln()
}

/// An upper bound of `−ln P(χ²ₖ > x)` that is fast to compute. For two degrees of freedom the tail is `e^(−x/2)`, for
/// more it is larger, and for one it is at least `√(2/π) √x/(1 + x) e^(−x/2)`.
pub fn most_evidence(x: f64, k: usize) -> f64 {
    if k == 1 && x > 0.0 {
        0.5 * x + ((1.0 + x) / x.sqrt()).ln() + 0.5 * std::f64::consts::FRAC_PI_2.ln()
    } else {
        0.5 * x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fast_bound_is_an_upper_bound() {
        for k in 1..6 {
            for x in [1e-6, 0.01, 0.5, 1.0, 3.0, 20.0, 200.0, 4000.0] {
                let evidence = -ln_chi_square_tail(x, k);
                assert!(most_evidence(x, k) >= evidence - 1e-12, "{x} {k} {evidence}");
            }
        }
    }
}
