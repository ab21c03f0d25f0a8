//! Certified nonlinear regressions of the NIST StRD, solved by the Gauss–Newton iteration that fits machines.

use abbe::identify::numerics::least_squares::{LeastSquares, Scaling, minimise};
use abbe::identify::numerics::triangle::Triangle;
use abbe::model::Diagnostic;
use nalgebra::{Const, SVector};
use num_dual::{Derivative, DualNum, DualSVec64};
use test_needs::data;

/// A data set: lines of start values and certified values, then the readings.
struct Certified<const N: usize> {
    starts: [[f64; N]; 2],
    values: [f64; N],
    deviations: [f64; N],
    /// (y, x).
    readings: Vec<(f64, f64)>,
}

impl<const N: usize> Certified<N> {
    fn parse(text: &str) -> Certified<N> {
        let mut certified =
            Certified { starts: [[0.0; N]; 2], values: [0.0; N], deviations: [0.0; N], readings: Vec::new() };
        let numbers =
            |line: &str| -> Vec<f64> { line.split_whitespace().map_while(|word| word.parse().ok()).collect() };
        for k in 0..N {
            let label = format!("b{} =", k + 1);
            let line = text.lines().find_map(|line| line.trim().strip_prefix(&label)).unwrap();
            let [a, b, value, deviation] = numbers(line)[..] else {
                panic!("{line}");
            };
            (certified.starts[0][k], certified.starts[1][k]) = (a, b);
            (certified.values[k], certified.deviations[k]) = (value, deviation);
        }
        let data = text.lines().skip_while(|line| !line.trim().starts_with("Data:   y")).skip(1);
        for line in data {
            if let [y, x] = numbers(line)[..] {
                certified.readings.push((y, x));
            }
        }
        certified
    }
}

type Dual<const N: usize> = DualSVec64<N>;

struct Regression<'a, const N: usize, F> {
    readings: &'a [(f64, f64)],
    model: F,
}

impl<const N: usize, F: Fn(&[Dual<N>; N], f64) -> Dual<N>> LeastSquares for Regression<'_, N, F> {
    fn parameters(&self) -> usize {
        N
    }

    fn linearise(&self, b: &[f64]) -> Result<Triangle, Diagnostic> {
        let b: [Dual<N>; N] = std::array::from_fn(|k| {
            let mut seed = SVector::<f64, N>::zeros();
            seed[k] = 1.0;
            Dual::new(b[k], Derivative::some(seed))
        });
        let rows: Vec<Vec<f64>> = self
            .readings
            .iter()
            .map(|(y, x)| {
                let value = (self.model)(&b, *x);
                let gradient = value.eps.unwrap_generic(Const::<N>, Const::<1>);
                gradient.iter().copied().chain([y - value.re]).collect()
            })
            .collect();
        let mut triangle = Triangle::new(N);
        triangle.absorb(faer::Mat::from_fn(rows.len(), N + 1, |i, j| rows[i][j]).as_ref());
        Ok(triangle)
    }

    fn sum_of_squares(&self, b: &[f64]) -> f64 {
        let b: [Dual<N>; N] = std::array::from_fn(|k| Dual::from_re(b[k]));
        let residuals = self.readings.iter().map(|(y, x)| y - (self.model)(&b, *x).re);
        residuals.map(|r| r * r).sum()
    }

    fn degrees_of_freedom(&self) -> f64 {
        (self.readings.len() - N) as f64
    }
}

/// Number of agreeing digits: the log relative error of NIST.
fn digits(found: f64, certified: f64) -> f64 {
    -((found - certified) / certified).abs().max(1e-16).log10()
}

fn holds<const N: usize>(name: &str, model: impl Fn(&[Dual<N>; N], f64) -> Dual<N> + Copy) {
    let Some(path) = data(name, &format!("nist_strd/NIST_STRD/{name}.dat")) else {
        return;
    };
    let certified = Certified::<N>::parse(&std::fs::read_to_string(path).unwrap());
    let problem = Regression { readings: &certified.readings, model };
    for (number, start) in certified.starts.iter().enumerate() {
        let solution = minimise(&problem, start, &Scaling::Columns).unwrap();
        let freedom = (certified.readings.len() - N) as f64;
        let deviation = (solution.sum_of_squares / freedom).sqrt();
        let (r, _, _) = solution.triangle.parts();
        let inverse = inverse_of_upper::<N>(|i, j| r[(i, j)]);
        let (mut least, mut least_u) = (f64::INFINITY, f64::INFINITY);
        for k in 0..N {
            let u = deviation * inverse[k].iter().map(|v| v * v).sum::<f64>().sqrt();
            least = least.min(digits(solution.x[k], certified.values[k]));
            least_u = least_u.min(digits(u, certified.deviations[k]));
        }
        println!(
            "{name} from start {}: {least:.1} digits of the parameters, {least_u:.1} of their standard deviations, {} iterations",
            number + 1,
            solution.iterations
        );
        assert!(least >= 6.0, "{name}: {least} digits");
        assert!(least_u >= 4.0, "{name}: {least_u} digits of standard deviations");
    }
}

/// Rows of `R⁻¹`.
fn inverse_of_upper<const N: usize>(r: impl Fn(usize, usize) -> f64) -> [[f64; N]; N] {
    let mut inverse = [[0.0; N]; N];
    for j in 0..N {
        for i in (0..=j).rev() {
            let unit = if i == j { 1.0 } else { 0.0 };
            let sum: f64 = (i + 1..=j).map(|k| r(i, k) * inverse[k][j]).sum();
            inverse[i][j] = (unit - sum) / r(i, i);
        }
    }
    inverse
}

#[test]
fn misra1a() {
    holds::<2>("Misra1a", |b, x| b[0] * (-(-b[1] * x).exp() + 1.0));
}

#[test]
fn thurber() {
    holds::<7>("Thurber", |b, x| {
        let above = b[0] + b[1] * x + b[2] * (x * x) + b[3] * (x * x * x);
        let below = b[4] * x + b[5] * (x * x) + b[6] * (x * x * x) + 1.0;
        above / below
    });
}

#[test]
fn enso() {
    holds::<9>("ENSO", |b, x| {
        let turns = std::f64::consts::TAU * x;
        let year = turns / 12.0;
        let (first, second) = (b[3].recip() * turns, b[6].recip() * turns);
        b[0] + b[1] * year.cos()
            + b[2] * year.sin()
            + b[4] * first.cos()
            + b[5] * first.sin()
            + b[7] * second.cos()
            + b[8] * second.sin()
    });
}
