//! A fit of a session with one changed statement to a part of its readings.
//!
//! The fit is iterated to its minimum. A freed parameter may be poorly determined; full Gauss–Newton steps then move it
//! by as much as its prior allows, and the square of such a step exceeds the noise.

use std::sync::Arc;

use abbe_model::session::{Prior, Session};

use crate::fit::minimum;
use crate::heldout::rms_mm;
use crate::noise::Noise;
use crate::problem::Problem;

/// The result of a quick fit.
#[derive(Clone, Debug)]
pub(super) struct Trial {
    /// χ² of readings and priors.
    pub chi_square: f64,
    /// χ² of the readings over their degrees of freedom, at least 1: the variance of the noise over the variance that
    /// is assumed.
    pub excess: f64,
    /// χ² of the readings over their degrees of freedom.
    pub ratio: f64,
    /// Number of scalar readings.
    pub readings: usize,
    /// Residual over scalar readings, mm.
    pub rms_mm: f64,
    /// Complexity penalty: twice the logarithm of the ratio of prior volume to posterior volume.
    pub cost: f64,
}

impl Trial {
    /// −2 ln of the evidence up to a constant.
    pub fn score(&self) -> f64 {
        self.chi_square + self.cost
    }
}

/// Fits a session; `None` where it cannot be fitted.
pub(super) fn trial(session: &Session, noise: &Noise) -> Option<Trial> {
    let problem = Problem::new(session, noise.clone(), 1).ok()?;
    let list = &problem.parameters.list;
    let found = minimum(&problem, None).ok()?;
    let prior = problem.prior_triangle(&found.beta);
    let of_priors = prior.sum_of_squares();
    let chi_square = problem.sum_of_squares(&found.beta);
    let rank = problem.parameters.rank(&prior.merged(&found.triangles)).ok()?;
    let determined: f64 = rank.singular_values.iter().map(|s| (1.0 + s * s).ln()).sum();
    let priors: f64 = (list.iter())
        .map(|parameter| match parameter.prior {
            Prior::Gaussian(u) => 2.0 * (u / parameter.size).ln(),
            Prior::Free | Prior::Known => 0.0,
        })
        .sum();
    let readings = problem.scalars();
    let free = list.iter().filter(|parameter| parameter.prior == Prior::Free).count();
    let freedom = readings.saturating_sub(free.min(found.rank.identifiable_basis.ncols())).max(1) as f64;
    let ratio = (chi_square - of_priors) / freedom;
    chi_square.is_finite().then(|| Trial {
        chi_square,
        excess: ratio.max(1.0),
        ratio,
        readings,
        rms_mm: rms_mm(&problem, &problem.residuals(&found.beta)),
        cost: determined + priors,
    })
}

/// The session with at most about `most` of its readings, evenly taken, without outliers.
pub(super) fn thinned(problem: &Problem, most: usize) -> Session {
    let mut session = Session::clone(&problem.session);
    let each = problem.readings().div_ceil(most).max(1);
    let mut number = 0;
    for test in &mut session.tests {
        let Some(readings) = &mut test.readings else {
            continue;
        };
        let kept = &problem.rejected[number];
        let rows: Vec<usize> = (0..readings.rows()).filter(|row| !kept[*row]).step_by(each).collect();
        *readings = Arc::new(readings.of_rows(&rows));
        number += 1;
    }
    session
}
