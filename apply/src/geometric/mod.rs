//! Geometric methods beside the full fit: errors of rotary axes from the centres of circles.
//!
//! The methods are those of Jiang (2014), Chapters 4 to 6: X. Jiang, *Characterising Geometric Errors in Rotary Axes of
//! 5-axis Machine Tools*, PhD thesis, University of Birmingham. Each test gives the position of an axis relative to the
//! fixed ball. To first order this position is a linear combination of position and orientation errors,
//!
//! ```text
//! centre = Σ S·error,    S = ∂centre/∂L · ∂L/∂error
//! ```
//!
//! The chain gives the derivative of the length, and the equations of the circle give that of the centre. `S` thus
//! contains what the reference derives by hand: the levers of the cone and of the two planes, the contributions of axis
//! A's errors to the centres of axis C, and the conversion from local to reference position errors. All signs follow
//! from the chain.

mod centre;
mod compare;

use abbe_identify::error;
use abbe_model::Diagnostic;
use abbe_model::component::ErrorName;
use faer::Mat;

pub use centre::{Centre, CircleGeometry};
pub use compare::{CentreResult, Comparison, ComparisonRow, compare};

use abbe_identify::numerics::solve::Svd;
use abbe_identify::numerics::tolerances::COLLINEAR;
use abbe_identify::problem::{Problem, RowBlock};
use abbe_model::session::Prior;
use abbe_model::words::counted;

/// The geometric methods. Each uses its own kind of tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Position errors from one plane per axis, with orientation errors assumed zero (Section 4.2).
    Circle,
    /// Position errors from the plane, orientation errors from the cone of the extension bar (Sections 4.2.1, 5.2).
    Cone,
    /// Position and orientation errors from two planes along each axis (Section 6.1.2).
    TwoPlane,
}

impl Method {
    /// The name in requests and results.
    pub fn word(self) -> &'static str {
        match self {
            Method::Circle => "circle",
            Method::Cone => "cone",
            Method::TwoPlane => "two-plane",
        }
    }
}

/// Least height of a cone and least distance of two planes, mm.
const MIN_LEVER_MM: f64 = 1.0;
/// What the readings of a test need for a centre.
const NEEDS: &str = "the method needs the readings of a circle";

/// A method prepared for a session: its tests, its errors, and the linear map from centres to errors.
#[derive(Clone, Debug)]
pub struct Estimator {
    /// The method.
    pub method: Method,
    /// The tests, by index among the problem's tests.
    pub tests: Vec<usize>,
    /// The geometry of each test.
    pub geometries: Vec<CircleGeometry>,
    /// The errors that the method identifies, by index among the problem's parameters.
    pub errors: Vec<usize>,
    /// `S`: two rows per test, one column per parameter of the problem, mm or rad.
    pub sensitivities: Mat<f64>,
    /// Errors from centres: errors × rows.
    pub inverse: Mat<f64>,
}

/// The estimates of a method.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The centre of each test.
    pub centres: Vec<Centre>,
    /// Each error, mm or rad.
    pub values: Vec<f64>,
    /// Covariance of the centres from noise and set-up priors, mm².
    pub centre_covariance: Mat<f64>,
    /// Covariance of the errors.
    pub covariance: Mat<f64>,
}

impl Estimator {
    /// Prepares a method for a session.
    ///
    /// # Errors
    /// If the session lacks tests for the method, or the errors are not identifiable from them.
    pub fn new(problem: &Problem, method: Method) -> Result<Estimator, Diagnostic> {
        let machine = &problem.session.machine;
        let refuse =
            |found: String, expected: &str| error::not_applicable(format!("method {}", method.word()), found, expected);
        let mut circles = Vec::new();
        let mut refused = Vec::new();
        for (test, model) in problem.models.iter().enumerate() {
            match CircleGeometry::of(machine, model) {
                Ok(geometry) => circles.push((test, geometry)),
                Err(why) => refused.push(format!("; test \"{}\": {why}", problem.tests[test].name)),
            }
        }
        let (tests, geometries): (Vec<usize>, Vec<CircleGeometry>) = chosen(method, circles).into_iter().unzip();
        if tests.is_empty() {
            let wanted = match method {
                Method::Circle => "a test in which one rotary axis turns and the balls lie in one plane across it",
                Method::Cone => "for each axis a test with the balls in one plane and one with the bar on a cone",
                Method::TwoPlane => "for each axis two tests in planes apart from each other along the axis",
            };
            return Err(refuse(format!("no test fits{}", refused.concat()), &format!("the session needs {wanted}")));
        }
        let errors = errors(problem, method, &geometries);
        let sensitivities = sensitivities(problem, &tests, &geometries)?;
        let of_errors = Mat::from_fn(sensitivities.nrows(), errors.len(), |i, k| {
            // An angle moves a centre by its lever. The physical sizes make radians times 100 mm comparable with mm.
            sensitivities[(i, errors[k])] * problem.parameters.list[errors[k]].size
        });
        let directions = Svd::of(of_errors.as_ref())?;
        let rank = directions.rank(COLLINEAR);
        if rank < errors.len() {
            let confounded: Vec<String> = (0..errors.len())
                .filter(|k| (rank..errors.len()).any(|j| directions.right()[(*k, j)].abs() > 1e-3))
                .map(|k| problem.parameters.list[errors[k]].id.to_string())
                .collect();
            let (tests, errors) = (counted(tests.len(), "test"), confounded.join(", "));
            let found = format!("the centres of {tests} do not separate the errors {errors}");
            return Err(refuse(found, "the method needs tests that separate them"));
        }
        let inverse = directions.pseudo_inverse();
        let inverse = Mat::from_fn(errors.len(), sensitivities.nrows(), |k, i| {
            inverse[(k, i)] * problem.parameters.list[errors[k]].size
        });
        Ok(Estimator { method, tests, geometries, errors, sensitivities, inverse })
    }

    /// Estimates the errors from readings, test by test in the order of the problem, mm.
    ///
    /// # Errors
    /// If the readings of a test do not lie on a circle.
    pub fn estimate(&self, problem: &Problem, observed: &[&[f64]]) -> Result<Estimate, Diagnostic> {
        let mut centres = Vec::new();
        for (test, geometry) in self.tests.iter().zip(&self.geometries) {
            let name = &problem.tests[*test].name;
            let refused = |why| error::not_applicable(format!("test \"{name}\""), why, NEEDS);
            centres.push(geometry.centre(observed[*test], &problem.rejected[*test]).map_err(refused)?);
        }
        let offsets: Vec<f64> = centres.iter().flat_map(|centre| centre.offset_mm).collect();
        let rows = offsets.len();
        let values =
            (0..self.errors.len()).map(|k| (0..rows).map(|i| self.inverse[(k, i)] * offsets[i]).sum()).collect();
        let variance = problem.noise.sigma_mm.powi(2);
        let mut centre_covariance = Mat::from_fn(rows, rows, |i, j| {
            if i / 2 != j / 2 {
                return 0.0;
            }
            let (a, b) = (&centres[i / 2].by_reading[i % 2], &centres[j / 2].by_reading[j % 2]);
            variance * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()
        });
        for (p, parameter) in problem.parameters.list.iter().enumerate() {
            let (true, Prior::Gaussian(u)) = (parameter.id.is_setup(), parameter.prior) else { continue };
            for i in 0..rows {
                for j in 0..rows {
                    centre_covariance[(i, j)] += self.sensitivities[(i, p)] * u * u * self.sensitivities[(j, p)];
                }
            }
        }
        let covariance = &self.inverse * &centre_covariance * self.inverse.transpose();
        Ok(Estimate { centres, values, centre_covariance, covariance })
    }
}

/// The tests that a method uses.
fn chosen(method: Method, circles: Vec<(usize, CircleGeometry)>) -> Vec<(usize, CircleGeometry)> {
    let plane = |geometry: &CircleGeometry| geometry.height_mm.abs() < MIN_LEVER_MM;
    let of = |axis: usize| circles.iter().filter(move |(_, geometry)| geometry.axis == axis);
    let selected = |(_, geometry): &&(usize, CircleGeometry)| {
        let planes = || of(geometry.axis).map(|(_, other)| other).filter(|other| plane(other));
        match method {
            Method::Circle => {
                let nearest = planes().map(|other| other.plane_mm.abs()).fold(f64::INFINITY, f64::min);
                plane(geometry) && geometry.plane_mm.abs() <= nearest + MIN_LEVER_MM
            }
            Method::Cone => planes().next().is_some() && of(geometry.axis).any(|(_, other)| !plane(other)),
            Method::TwoPlane => {
                plane(geometry) && planes().any(|other| (other.plane_mm - geometry.plane_mm).abs() > MIN_LEVER_MM)
            }
        }
    };
    circles.iter().filter(selected).cloned().collect()
}

/// The declared errors of the turning axes that the method identifies.
fn errors(problem: &Problem, method: Method, geometries: &[CircleGeometry]) -> Vec<usize> {
    let machine = &problem.session.machine;
    let of_method = |name: &ErrorName| {
        let turns = geometries.iter().any(|geometry| machine.axes[geometry.axis].name == name.axis);
        turns && (method != Method::Circle || !name.freedom.is_angle())
    };
    let list = &problem.parameters.list;
    (0..list.len()).filter(|p| list[*p].id.error().is_some_and(of_method)).collect()
}

/// `S` at the nominal machine.
fn sensitivities(problem: &Problem, tests: &[usize], geometries: &[CircleGeometry]) -> Result<Mat<f64>, Diagnostic> {
    let parameters = problem.parameters.list.len();
    let nominal = problem.slot_values(&vec![0.0; parameters]);
    let mut sensitivities = Mat::zeros(2 * tests.len(), parameters);
    for (k, (test, geometry)) in tests.iter().zip(geometries).enumerate() {
        let lengths = problem.models[*test].readings(&nominal[*test]);
        let name = &problem.tests[*test].name;
        let refused = |why| error::not_applicable(format!("test \"{name}\", nominally"), why, NEEDS);
        let centre = geometry.centre(&lengths, &problem.rejected[*test]).map_err(refused)?;
        let block = RowBlock { test: *test, rows: 0..problem.models[*test].rows() };
        let rows = problem.rows(&nominal, &block)?;
        for (which, by_reading) in centre.by_reading.iter().enumerate() {
            for p in 0..parameters {
                sensitivities[(2 * k + which, p)] =
                    by_reading.iter().enumerate().map(|(row, by)| by * rows[(row, p)]).sum::<f64>();
            }
        }
    }
    Ok(sensitivities)
}
