//! Uncertainty of figures by the set-up of the balls.
//!
//! A coordinate `q` of a ball with the standard uncertainty `u(q)` moves the reading at the angle θ by `c(θ) δq`. The
//! evaluation of a figure `y` passes this on to first order, with the removal of the centre:
//!
//! ```text
//! u²(y) = Σ (∂y/∂q)² u²(q)        ∂y/∂q: the evaluation over dual numbers δL(θ) + ε c(θ)
//! ```
//!
//! A figure is read at the angles at which the deviation is greatest and least.

use abbe_model::chain::Machine;
use abbe_model::instrument::ballbar::BAR;
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::{Prior, Test};
use num_dual::Dual64;

use super::path::Path;
use super::polar::{Centre, PolarPath, PolarPoint};

/// Derivative of a figure, mm/mm, below which a coordinate has no part in it.
const NO_PART: f64 = 1e-6;

/// The coordinates of the balls whose positions are not exactly known.
pub(super) struct SetUp(Vec<Coordinate>);

struct Coordinate {
    /// Standard uncertainty, mm; infinite without a prior.
    u_mm: f64,
    /// Derivative of each reading, mm/mm.
    derivatives: Vec<f64>,
}

/// Standard uncertainties of the figures of a path by the set-up, µm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FigureUncertainties {
    /// Of the range of the radial deviations.
    pub range_um: f64,
    /// Of the greatest radial deviation.
    pub max_um: f64,
    /// Of the least radial deviation.
    pub min_um: f64,
    /// Of the mean radial deviation.
    pub mean_um: f64,
}

impl SetUp {
    /// The set-up of a test with readings.
    pub fn of(machine: &Machine, test: &Test, model: &TestModel) -> SetUp {
        let first = machine.error_slots();
        let uncertain = test.priors.iter().take(BAR).enumerate().filter_map(|(k, prior)| match prior {
            Prior::Known => None,
            Prior::Gaussian(u_mm) => Some((first + k, *u_mm)),
            Prior::Free => Some((first + k, f64::INFINITY)),
        });
        let (slots, u_mm): (Vec<usize>, Vec<f64>) = uncertain.unzip();
        let found = model.sensitivities(&SlotValues::zero(model.slots()), &slots, 0..model.rows());
        let coordinates = u_mm.into_iter().zip(found.derivatives);
        SetUp(coordinates.map(|(u_mm, derivatives)| Coordinate { u_mm, derivatives }).collect())
    }
}

impl FigureUncertainties {
    /// Of a path with these radial deviations.
    pub(super) fn of(path: &Path, trace: &PolarPath, deviations_mm: &[f64], set_up: &SetUp) -> FigureUncertainties {
        let at = |better: fn(f64, f64) -> bool| {
            (0..deviations_mm.len())
                .reduce(|best, k| if better(deviations_mm[k], deviations_mm[best]) { k } else { best })
        };
        let (Some(most), Some(least)) = (at(|a, b| a > b), at(|a, b| a < b)) else {
            return FigureUncertainties::default();
        };
        let mut squares = [0.0; 4];
        for coordinate in &set_up.0 {
            let deviation = |p: &PolarPoint| Dual64::new(p.deviation_mm, coordinate.derivatives[p.row]);
            let centre = Centre::of(path, trace, deviation);
            let [max, min] = [most, least].map(|k| centre.deviation_mm(&trace.0[k], deviation(&trace.0[k])).eps);
            for (square, derivative) in squares.iter_mut().zip([max - min, max, min, centre.radius_mm.eps]) {
                if derivative.abs() > NO_PART {
                    *square += (derivative * coordinate.u_mm).powi(2);
                }
            }
        }
        let [range_um, max_um, min_um, mean_um] = squares.map(|square| square.sqrt() * 1e3);
        FigureUncertainties { range_um, max_um, min_um, mean_um }
    }
}
