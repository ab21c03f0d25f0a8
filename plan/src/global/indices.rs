//! Sobol' indices from a Saltelli design.
//!
//! Two independent samples A and B of the inputs, and for each input `j` the sample A with the column `j` of B:
//!
//! ```text
//! S_j  = mean( f(B) (f(AB_j) − f(A)) ) / V          first order: variance by the input alone
//! ST_j = mean( (f(A) − f(AB_j))² ) / (2 V)          total: with all its interactions
//! ```
//!
//! `V` is the variance over A and B. Outputs are taken from their mean, which lowers the error of `S_j`. Estimators of
//! Saltelli et al., Comput. Phys. Commun. 181 (2010) 259, Table 2 (b) and (f), as in SALib.

use rand::RngExt;
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::Serialize;

use super::sequence;
use abbe_identify::numerics::parallel;
use abbe_model::Diagnostic;

/// Number of resamplings of the confidence intervals.
const RESAMPLES: usize = 200;
/// Half the width of a 95 % interval, in standard deviations.
const COVERAGE_95: f64 = 1.959_963_984_540_054;

/// The index of one input, with the half width of its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SobolIndex {
    /// First order.
    pub first: f64,
    /// Half width of its interval.
    pub first_half_width: f64,
    /// Total.
    pub total: f64,
    /// Half width of its interval.
    pub total_half_width: f64,
}

/// The outputs of a design: `[f(A), f(AB_1), …, f(AB_k), f(B)]` for each sample.
#[derive(Clone, Debug)]
pub struct Design {
    /// Number of inputs.
    pub inputs: usize,
    /// Sample by sample, evaluation by evaluation: the outputs.
    pub outputs: Vec<Vec<Vec<f64>>>,
}

impl Design {
    /// Evaluates a function of inputs between 0 and 1 on `samples` samples.
    ///
    /// # Errors
    /// If there are too many inputs, or an evaluation fails.
    pub fn evaluate(
        inputs: usize,
        samples: usize,
        seed: u64,
        of: &(dyn Fn(&[f64]) -> Result<Vec<f64>, Diagnostic> + Sync),
    ) -> Result<Design, Diagnostic> {
        let mut random = Pcg64::new(u128::from(seed), 0);
        let shift: Vec<u32> = (0..2 * inputs).map(|_| random.random()).collect();
        let points = sequence::points(2 * inputs, samples, &shift)?;
        let outputs = parallel::map(samples, &|sample| {
            let (a, b) = points[sample].split_at(inputs);
            let mixed = (0..inputs).map(|j| {
                let mut point = a.to_vec();
                point[j] = b[j];
                point
            });
            let all: Vec<Vec<f64>> = std::iter::once(a.to_vec()).chain(mixed).chain([b.to_vec()]).collect();
            all.iter().map(|point| of(point)).collect::<Result<Vec<_>, _>>()
        });
        Ok(Design { inputs, outputs: outputs.into_iter().collect::<Result<_, _>>()? })
    }

    /// The indices of one output by all inputs, from the first `samples` samples. Zero where the output does not vary.
    pub fn indices(&self, output: usize, samples: usize, seed: u64) -> Vec<SobolIndex> {
        let samples = samples.min(self.outputs.len());
        let row = |sample: &Vec<Vec<f64>>| sample.iter().map(|outputs| outputs[output]).collect::<Vec<f64>>();
        let mut rows: Vec<Vec<f64>> = self.outputs[..samples].iter().map(row).collect();
        let mean = rows.iter().flatten().sum::<f64>() / (samples * (self.inputs + 2)).max(1) as f64;
        rows.iter_mut().flatten().for_each(|value| *value -= mean);
        let all: Vec<usize> = (0..samples).collect();
        let found = estimates(&rows, &all, self.inputs);
        let mut random = Pcg64::new(u128::from(seed), 1);
        let drawn: Vec<Vec<[f64; 2]>> = (0..RESAMPLES)
            .map(|_| {
                let chosen: Vec<usize> = (0..samples).map(|_| random.random_range(0..samples)).collect();
                estimates(&rows, &chosen, self.inputs)
            })
            .collect();
        let half_width = |j: usize, k: usize| {
            let mean = drawn.iter().map(|one| one[j][k]).sum::<f64>() / RESAMPLES as f64;
            let square: f64 = drawn.iter().map(|one| (one[j][k] - mean).powi(2)).sum();
            COVERAGE_95 * (square / (RESAMPLES - 1) as f64).sqrt()
        };
        found
            .iter()
            .enumerate()
            .map(|(j, [first, total])| SobolIndex {
                first: *first,
                first_half_width: half_width(j, 0),
                total: *total,
                total_half_width: half_width(j, 1),
            })
            .collect()
    }

    /// Standard deviation of one output over the samples A and B.
    pub fn standard_deviation(&self, output: usize) -> f64 {
        let ends = |sample: &Vec<Vec<f64>>| [sample[0][output], sample[self.inputs + 1][output]];
        variance(self.outputs.iter().flat_map(ends)).sqrt()
    }
}

/// Variance with the number of values as divisor.
fn variance(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    values.map(|value| (value - mean).powi(2)).sum::<f64>() / count
}

/// First order and total of each input over some samples.
fn estimates(rows: &[Vec<f64>], chosen: &[usize], inputs: usize) -> Vec<[f64; 2]> {
    let variance = variance(chosen.iter().flat_map(|sample| [rows[*sample][0], rows[*sample][inputs + 1]]));
    let count = chosen.len().max(1) as f64;
    (1..=inputs)
        .map(|j| {
            if variance == 0.0 {
                return [0.0; 2];
            }
            let sums = chosen.iter().map(|sample| &rows[*sample]).fold([0.0; 2], |[first, total], row| {
                let change = row[j] - row[0];
                [first + row[inputs + 1] * change, total + change * change]
            });
            [sums[0] / count / variance, sums[1] / (2.0 * count) / variance]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A linear function of uniform inputs: `S_j = ST_j = c_j² / Σ c²`, whatever the sample for the total index.
    #[test]
    fn indices_of_a_linear_function_are_the_shares_of_variance() {
        let c = [1.0, -2.0, 0.0, 4.0];
        let of = |x: &[f64]| Ok(vec![x.iter().zip(c).map(|(x, c)| c * x).sum(), 7.0]);
        let design = Design::evaluate(4, 4096, 1, &of).unwrap();
        let square: f64 = c.iter().map(|c| c * c).sum();
        for (found, c) in design.indices(0, 4096, 1).iter().zip(c) {
            let share = c * c / square;
            assert!((found.first - share).abs() < 2e-3, "{found:?} {share}");
            assert!((found.total - share).abs() < 2e-3, "{found:?} {share}");
            assert!((found.first - share).abs() < 3.0 * found.first_half_width + 1e-9);
        }
        assert!((design.standard_deviation(0) - (square / 12.0).sqrt()).abs() < 1e-3);
        assert!(design.indices(1, 4096, 1).iter().all(|index| index.total == 0.0 && index.first == 0.0));
    }

    /// The function of Ishigami & Homma (1990): `sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1` on (−π, π)³, whose indices are
    /// known in closed form.
    #[test]
    fn indices_of_the_ishigami_function() {
        let (a, b) = (7.0, 0.1);
        let of = |u: &[f64]| {
            let x: Vec<f64> = u.iter().map(|u| (2.0 * u - 1.0) * PI).collect();
            Ok(vec![x[0].sin() + a * x[1].sin().powi(2) + b * x[2].powi(4) * x[0].sin()])
        };
        let v1 = 0.5 * (1.0 + b * PI.powi(4) / 5.0).powi(2);
        let v2 = a * a / 8.0;
        let v13 = b * b * PI.powi(8) * (1.0 / 18.0 - 1.0 / 50.0);
        let v = v1 + v2 + v13;
        let design = Design::evaluate(3, 8192, 3, &of).unwrap();
        let expected = [(v1 / v, (v1 + v13) / v), (v2 / v, v2 / v), (0.0, v13 / v)];
        for (found, (first, total)) in design.indices(0, 8192, 1).iter().zip(expected) {
            assert!((found.first - first).abs() < found.first_half_width, "{found:?} {first}");
            assert!((found.total - total).abs() < found.total_half_width, "{found:?} {total}");
            assert!(found.first_half_width < 0.05 && found.total_half_width < 0.05);
        }
    }

    /// SALib's `analyze` on the outputs of the same samples gives the same indices.
    #[test]
    fn indices_are_those_of_salib() {
        let Some(python) = test_needs::python("indices_are_those_of_salib", "numpy, SALib") else { return };
        let of = |x: &[f64]| Ok(vec![(4.0 * x[0]).sin() + x[1] * x[2] + 0.3 * x[2].powi(2) - x[3]]);
        let design = Design::evaluate(4, 64, 5, &of).unwrap();
        let outputs: Vec<f64> = design.outputs.iter().flatten().map(|one| one[0]).collect();
        let script = format!(
            "import numpy as np\nfrom SALib.analyze import sobol\n\
             problem = dict(num_vars=4, names=list('abcd'), bounds=[[0, 1]] * 4)\n\
             found = sobol.analyze(problem, np.array({outputs:?}), calc_second_order=False, num_resamples=10)\n\
             print(*found['S1'], *found['ST'])\n"
        );
        let run = std::process::Command::new(python).args(["-c", &script]).output().unwrap();
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let text = String::from_utf8(run.stdout).unwrap();
        let theirs: Vec<f64> = text.split_whitespace().map(|number| number.parse().unwrap()).collect();
        let ours = design.indices(0, 64, 1);
        for (j, found) in ours.iter().enumerate() {
            assert!((found.first - theirs[j]).abs() < 1e-10, "{found:?} {}", theirs[j]);
            assert!((found.total - theirs[4 + j]).abs() < 1e-10, "{found:?} {}", theirs[4 + j]);
        }
    }
}
