//! The priors as rows of the least-squares problem: Gaussian priors, and stated distances between sockets.

use abbe_model::instrument::Contact;
use abbe_model::session::Prior;
use faer::Mat;
use num_dual::DualNum;

use super::Problem;
use crate::numerics::triangle::Triangle;
use crate::parameters::Parameter;

impl Problem {
    /// Number of prior observations: the rows of [`Problem::prior_triangle`] without those of numbers of shapes, which
    /// are about the estimates themselves.
    pub fn prior_rows(&self) -> usize {
        let gaussian =
            |parameter: &&Parameter| matches!(parameter.prior, Prior::Gaussian(_)) && !parameter.id.is_number();
        let list = &self.parameters.list;
        let distances = self.session.socket_distances.iter();
        let stated = distances.filter(|distance| {
            let mut ends = distance.between.iter();
            ends.all(|name| self.socket(name).is_some())
        });
        list.iter().filter(gaussian).count() + stated.count()
    }

    /// The triangular factor of the priors: Gaussian priors and distances between sockets.
    pub fn prior_triangle(&self, beta: &[f64]) -> Triangle {
        self.prior_triangle_about(beta, |_| 0.0, |_| 0.0)
    }

    /// As [`Problem::prior_triangle`], with other prior means: `centre` for each parameter with a Gaussian prior, and
    /// an offset in mm `longer` for each distance between sockets.
    pub fn prior_triangle_about(
        &self,
        beta: &[f64],
        centre: impl Fn(usize) -> f64,
        longer: impl Fn(usize) -> f64,
    ) -> Triangle {
        let count = self.parameters.list.len();
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for (j, parameter) in self.parameters.list.iter().enumerate() {
            if let Prior::Gaussian(u) = parameter.prior {
                let mut row = vec![0.0; count + 1];
                row[j] = 1.0 / u;
                row[count] = (centre(j) - beta[j]) / u;
                rows.push(row);
            }
        }
        for (number, distance) in self.session.socket_distances.iter().enumerate() {
            let ends: Vec<Option<([usize; 3], [f64; 3])>> =
                distance.between.iter().map(|name| self.socket(name)).collect();
            let [Some((a, nominal_a)), Some((b, nominal_b))] = ends[..] else {
                continue;
            };
            let coordinate = |k: usize, parameter: usize, nominal: f64| {
                let mut seed = nalgebra::SVector::<f64, 6>::zeros();
                seed[k] = 1.0;
                num_dual::DualSVec64::<6>::new(nominal + beta[parameter], num_dual::Derivative::some(seed))
            };
            let square = (0..3)
                .map(|i| (coordinate(i, a[i], nominal_a[i]) - coordinate(i + 3, b[i], nominal_b[i])).powi(2))
                .fold(num_dual::DualSVec64::<6>::from(0.0), |sum, term| sum + term);
            let length = square.sqrt();
            let gradient = length.eps.unwrap_generic(nalgebra::Const::<6>, nalgebra::Const::<1>);
            let mut row = vec![0.0; count + 1];
            for i in 0..3 {
                row[a[i]] += gradient[i] / distance.u_mm;
                row[b[i]] += gradient[i + 3] / distance.u_mm;
            }
            row[count] = (distance.distance_mm + longer(number) - length.re) / distance.u_mm;
            rows.push(row);
        }
        Triangle::of(Mat::from_fn(rows.len(), count + 1, |i, j| rows[i][j]))
    }

    /// The parameters of a socket and its nominal position.
    fn socket(&self, name: &str) -> Option<([usize; 3], [f64; 3])> {
        let test = self.tests.iter().position(|test| test.socket.as_deref() == Some(name))?;
        let Contact::InR(place_mm) = self.models[test].station().contact() else {
            return None;
        };
        let mut indices = [0; 3];
        for (index, coordinate) in indices.iter_mut().zip(self.tests[test].station.kind().unknowns()) {
            let id = coordinate.id(name);
            *index = self.parameters.list.iter().position(|parameter| parameter.id == id)?;
        }
        Some((indices, place_mm))
    }
}
