//! The spectrum of a residual by order over an angle.
//!
//! Each order `h` is fitted separately, `a + b·cos hφ + c·sin hφ`. `S` is its sum of squares beyond the constant, over
//! `n` readings. The amplitude is `√(2·S/n)`. Over whole turns this is the amplitude of the Fourier series.
//!
//! Over a part of a turn the orders are not orthogonal, and one order would appear in all others. The order that explains
//! most is then fitted first, and further ones beside it as long as they are significant; these orders have the amplitude
//! of their joint fit, the others that of a separate fit to what it leaves. No amplitude exceeds the residual.

use std::f64::consts::FRAC_PI_2;

use abbe_model::axis::AxisKind;
use faer::Mat;

use super::SessionSeries;
use crate::numerics::parallel;
use crate::numerics::regression::Regression;
use crate::numerics::solve::solve_square;
use crate::problem::Problem;

/// The highest order. Higher orders are seldom geometric errors.
pub const HIGHEST_ORDER: usize = 40;

/// Part of a turn without readings from which the orders are fitted together, degrees.
const LARGEST_GAP_DEG: f64 = 20.0;
/// Most orders that are fitted together.
const MOST_JOINT: usize = 8;

/// Spectrum of the residuals before and after.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// The test, or `all poses`.
    pub of: String,
    /// The axis, or `XY` for a circle of two.
    pub over: String,
    /// Amplitude of orders 1, 2, … of the residual before, µm; for readings of several channels the length of their amplitudes.
    pub before_um: Vec<f64>,
    /// The same after.
    pub after_um: Vec<f64>,
}

/// The amplitude of each order from 1 in values over an angle in degrees; `channels` values per reading.
pub fn amplitudes(angle_deg: &[f64], values: &[f64], channels: usize) -> Vec<f64> {
    match has_gap(angle_deg) {
        true => beside_each_other(angle_deg, values, channels),
        false => separate(angle_deg, values, channels),
    }
}

/// Whether angles leave a part of a turn out.
fn has_gap(angle_deg: &[f64]) -> bool {
    let mut turned: Vec<f64> = angle_deg.iter().map(|angle| angle.rem_euclid(360.0)).collect();
    turned.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (turned.first(), turned.last()) else { return false };
    let across = first + 360.0 - last;
    turned.windows(2).map(|pair| pair[1] - pair[0]).fold(across, f64::max) > LARGEST_GAP_DEG
}

/// The amplitudes of a joint fit of the significant orders, and of a separate fit of the others to what it leaves.
fn beside_each_other(angle_deg: &[f64], values: &[f64], channels: usize) -> Vec<f64> {
    let count = angle_deg.len();
    let mean_square = |values: &[f64]| {
        let mean = |c: usize| values.iter().skip(c).step_by(channels).sum::<f64>() / count.max(1) as f64;
        let means: Vec<f64> = (0..channels).map(mean).collect();
        values.iter().enumerate().map(|(i, value)| (value - means[i % channels]).powi(2)).sum::<f64>()
            / count.max(1) as f64
    };
    let most = (2.0 * mean_square(values)).sqrt();
    let mut residual = values.to_vec();
    let mut joint: Vec<(usize, f64)> = Vec::new();
    while joint.len() < MOST_JOINT {
        let others: Vec<usize> =
            (1..=HIGHEST_ORDER).filter(|order| joint.iter().all(|(own, _)| own != order)).collect();
        let with = |order: usize| joint.iter().map(|(own, _)| *own).chain([order]).collect::<Vec<usize>>();
        let tried = parallel::map(others.len(), &|k| {
            let (amplitudes, rest) = jointly(angle_deg, values, channels, &with(others[k]))?;
            Some((mean_square(&rest), others[k], amplitudes, rest))
        });
        let best = tried.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((after, next, amplitudes, rest)) = best else { break };
        // `−ln P` of a gain in noise, over all orders.
        let price = 2.0 * (1e3 * HIGHEST_ORDER as f64).ln() * channels as f64;
        if count as f64 * (mean_square(&residual) - after) <= price * after.max(f64::MIN_POSITIVE) {
            break;
        }
        joint = with(next).into_iter().zip(amplitudes).collect();
        residual = rest;
    }
    let mut amplitudes = separate(angle_deg, &residual, channels);
    for (order, amplitude) in joint {
        amplitudes[order - 1] = amplitude;
    }
    amplitudes.iter().map(|amplitude| amplitude.min(most)).collect()
}

/// The joint fit of some orders: their amplitudes, and what it leaves; `None` if the arc does not separate them.
fn jointly(angle_deg: &[f64], values: &[f64], channels: usize, orders: &[usize]) -> Option<(Vec<f64>, Vec<f64>)> {
    let columns = || {
        let wave = |order: usize, phase: f64| {
            angle_deg.iter().map(move |angle| (order as f64 * angle.to_radians() - phase).cos()).collect::<Vec<f64>>()
        };
        let waves = orders.iter().flat_map(move |order| [wave(*order, 0.0), wave(*order, FRAC_PI_2)]);
        std::iter::once(vec![1.0; angle_deg.len()]).chain(waves).collect::<Vec<_>>()
    };
    let mut squares = vec![0.0; orders.len()];
    let mut rest = vec![0.0; values.len()];
    for channel in 0..channels {
        let own: Vec<f64> = values.iter().skip(channel).step_by(channels).copied().collect();
        let solved = Regression::solve(columns(), &own)?;
        for (k, square) in squares.iter_mut().enumerate() {
            *square += solved.beta[1 + 2 * k].powi(2) + solved.beta[2 + 2 * k].powi(2);
        }
        rest.iter_mut().skip(channel).step_by(channels).zip(&solved.residual).for_each(|(to, from)| *to = *from);
    }
    Some((squares.into_iter().map(f64::sqrt).collect(), rest))
}

/// The amplitude of each order by itself.
fn separate(angle_deg: &[f64], values: &[f64], channels: usize) -> Vec<f64> {
    parallel::map(HIGHEST_ORDER, &|place| {
        let order = place + 1;
        let basis: Vec<[f64; 3]> = angle_deg
            .iter()
            .map(|angle| {
                let (sin, cos) = (order as f64 * angle.to_radians()).sin_cos();
                [1.0, cos, sin]
            })
            .collect();
        explained(&basis, values, channels)
    })
}

fn explained(basis: &[[f64; 3]], values: &[f64], channels: usize) -> f64 {
    let count = basis.len().max(1) as f64;
    let gram = Mat::from_fn(3, 3, |i, j| {
        // Over a short arc the three functions are nearly collinear. A ridge term bounds the solution.
        let ridge = if i == j { 1e-9 * count } else { 0.0 };
        basis.iter().map(|row| row[i] * row[j]).sum::<f64>() + ridge
    });
    let sides = Mat::from_fn(3, channels, |i, c| {
        basis.iter().zip(values.chunks(channels)).map(|(row, reading)| row[i] * reading[c]).sum::<f64>()
    });
    let solution = solve_square(gram.as_ref(), sides.as_ref());
    let sum: f64 = (0..channels)
        .map(|c| {
            let all: f64 = (0..3).map(|i| sides[(i, c)] * solution[(i, c)]).sum();
            all - sides[(0, c)].powi(2) / count
        })
        .sum();
    (2.0 * sum.max(0.0) / count).sqrt()
}

/// The spectra of a session: each test over its angular abscissa, poses over every rotary axis.
pub fn spectra(problem: &Problem, views: &SessionSeries) -> Vec<Spectrum> {
    let machine = &problem.session.machine;
    let of = |of: &str, over: &str, angle: &[f64], channels: usize, [before, after]: [&[f64]; 2]| Spectrum {
        of: of.to_string(),
        over: over.to_string(),
        before_um: amplitudes(angle, before, channels),
        after_um: amplitudes(angle, after, channels),
    };
    let alike = views.tests.windows(2).all(|pair| pair[0].channels == pair[1].channels);
    if !alike || !problem.folds.kind.is_poses() && !problem.are_vectors() {
        let angular = views.tests.iter().filter(|test| test.way.is_angle);
        return angular
            .map(|test| {
                // A row that lacks a channel is no point of a spectrum.
                let readings =
                    problem.tests.iter().find(|own| own.name == test.name).and_then(|own| own.readings.as_ref());
                let is_whole = |row: &usize| {
                    readings.is_none_or(|readings| (0..test.channels).all(|channel| readings.was_read(*row, channel)))
                };
                let rows: Vec<usize> = (0..test.way.values.len()).filter(is_whole).collect();
                let whole = |values: &[f64]| -> Vec<f64> {
                    rows.iter()
                        .flat_map(|row| &values[row * test.channels..(row + 1) * test.channels])
                        .copied()
                        .collect()
                };
                let angles: Vec<f64> = rows.iter().map(|row| test.way.values[*row]).collect();
                let values = [whole(&test.before_um), whole(&test.after_um)];
                of(&test.name, &test.way.name, &angles, test.channels, [&values[0], &values[1]])
            })
            .collect();
    }
    let Some(channels) = views.tests.first().map(|test| test.channels) else { return Vec::new() };
    let joined = |of: &dyn Fn(usize) -> Vec<f64>| (0..views.tests.len()).flat_map(of).collect::<Vec<f64>>();
    let before = joined(&|test| views.tests[test].before_um.clone());
    let after = joined(&|test| views.tests[test].after_um.clone());
    let rotary = (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary);
    rotary
        .map(|axis| {
            let angle = joined(&|test| {
                let readings = problem.tests[test].readings.as_ref();
                readings.map_or(Vec::new(), |r| r.positions[axis].iter().map(|q| q.to_degrees()).collect())
            });
            of("all poses", &machine.axes[axis].name, &angle, channels, [&before, &after])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_over_whole_turns_has_one_nonzero_order() {
        let angle: Vec<f64> = (0..720).map(f64::from).collect();
        let values: Vec<f64> = angle.iter().map(|a| 3.0 + 1.5 * (2.0 * a.to_radians() + 1.0).cos()).collect();
        for (k, found) in amplitudes(&angle, &values, 1).into_iter().enumerate() {
            let wanted = if k + 1 == 2 { 1.5 } else { 0.0 };
            assert!((found - wanted).abs() < 1e-6, "order {}: {found}", k + 1);
        }
    }

    /// Over half a turn a large first order does not appear in the second: both have their own amplitudes.
    #[test]
    fn orders_over_a_part_of_a_turn_are_fitted_together() {
        for arc in [180, 220] {
            let angle: Vec<f64> = (0..=arc).map(f64::from).collect();
            let noise = |a: f64| 0.2 * (a * 12.9898).sin() * (a * 78.233).cos();
            let of =
                |a: &f64| 30.0 * (a.to_radians() + 0.4).cos() + 1.8 * (2.0 * a.to_radians() - 1.0).cos() + noise(*a);
            let values: Vec<f64> = angle.iter().map(of).collect();
            let found = amplitudes(&angle, &values, 1);
            assert!((24.0..31.0).contains(&found[0]), "{found:?}");
            assert!((found[1] - 1.8).abs() < 0.4, "{found:?}");
            assert!(found[2..].iter().all(|amplitude| *amplitude < 0.2), "{found:?}");
            assert!(separate(&angle, &values, 1)[1] > 5.0, "the orders are not orthogonal over this arc");
        }
    }

    #[test]
    fn amplitudes_over_a_short_arc_do_not_exceed_the_residual() {
        let angle: Vec<f64> = (0..50).map(|k| 0.5 * f64::from(k)).collect();
        let values: Vec<f64> = angle.iter().map(|a| (0.7 * a).sin()).collect();
        let most = 2.0_f64.sqrt() * (values.iter().map(|v| v * v).sum::<f64>() / 50.0).sqrt();
        assert!(amplitudes(&angle, &values, 1).iter().all(|found| *found <= most + 1e-9));
    }
}
