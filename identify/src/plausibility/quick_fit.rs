//! How well a session with one statement changed fits its readings: a few Gauss–Newton steps on some of them.

use abbe_model::session::{Prior, Session};

use crate::fit::{in_directions, whole};
use crate::heldout::rms_mm;
use crate::noise::Noise;
use crate::preference::pivot_preference;
use crate::problem::Problem;
use crate::rank::Rank;

/// Gauss–Newton steps: the first leaves the square of the errors over the size of the machine, the next nothing.
const STEPS: usize = 3;

/// What a session comes to.
#[derive(Clone, Debug)]
pub(super) struct Trial {
    /// χ² of readings and priors.
    pub chi_square: f64,
    /// Degrees of freedom.
    pub freedom: f64,
    /// Residual over scalar readings, mm.
    pub rms_mm: f64,
    /// What the parameters cost: twice the logarithm of the volume of the priors over that after the fit.
    pub cost: f64,
}

impl Trial {
    /// −2 ln of the evidence up to a constant, where the noise has `scale` times the variance that is assumed.
    pub fn score(&self, scale: f64) -> f64 {
        self.chi_square / scale + self.cost
    }
}

/// Fits a session; `None` where it cannot be fitted.
pub(super) fn trial(session: &Session, noise: &Noise) -> Option<Trial> {
    let problem = Problem::new(session, noise.clone(), 1).ok()?;
    let list = &problem.parameters.list;
    let size: Vec<f64> = list.iter().map(|parameter| parameter.size).collect();
    let preference = pivot_preference(list);
    let mut beta = vec![0.0; list.len()];
    let mut rank: Option<Rank> = None;
    for _ in 0..STEPS {
        let whole = whole(&problem, &beta, &problem.triangles(&beta).ok()?);
        let rank = match &mut rank {
            Some(rank) => rank,
            none => none.insert(Rank::decide(whole.parts().0.as_ref(), &size, &preference).ok()?),
        };
        let (r, c, _) = in_directions(&whole, &rank.identifiable_basis).parts();
        let mut step = vec![0.0; c.len()];
        for i in (0..c.len()).rev() {
            let beyond: f64 = (i + 1..c.len()).map(|j| r[(i, j)] * step[j]).sum();
            step[i] = (c[i] - beyond) / r[(i, i)];
        }
        for (j, value) in beta.iter_mut().enumerate() {
            *value += (0..step.len())
                .map(|k| rank.identifiable_basis[(j, k)] * step[k])
                .sum::<f64>();
        }
        if beta.iter().any(|value| !value.is_finite()) {
            return None;
        }
    }
    let chi_square = problem.sum_of_squares(&beta);
    let rank = rank?;
    let determined: f64 = rank.singular_values.iter().map(|s| (1.0 + s * s).ln()).sum();
    let priors: f64 = (list.iter())
        .map(|parameter| match parameter.prior {
            Prior::Gaussian(u) => 2.0 * (u / parameter.size).ln(),
            Prior::Free | Prior::Known => 0.0,
        })
        .sum();
    let readings = problem.readings() * problem.coordinates();
    let free = list
        .iter()
        .filter(|parameter| parameter.prior == Prior::Free)
        .count();
    chi_square.is_finite().then(|| Trial {
        chi_square,
        freedom: readings
            .saturating_sub(free.min(rank.identifiable_basis.ncols()))
            .max(1) as f64,
        rms_mm: rms_mm(&problem, &problem.residuals(&beta)),
        cost: determined + priors,
    })
}

/// The session with about so many of its readings that count, evenly taken; whole if it has no more.
pub(super) fn thinned(problem: &Problem<'_>, most: usize) -> Session {
    let mut session = problem.session.clone();
    let each = problem.readings().div_ceil(most).max(1);
    let mut number = 0;
    for test in &mut session.tests {
        let Some(readings) = &mut test.readings else {
            continue;
        };
        let kept = &problem.rejected[number];
        let rows: Vec<usize> = (0..readings.rows())
            .filter(|row| !kept[*row])
            .step_by(each)
            .collect();
        *readings = readings.of_rows(&rows);
        number += 1;
    }
    session
}
