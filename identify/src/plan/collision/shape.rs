//! Shapes in their own frame, and the clearance of two of them.

use super::distance::{between, crossing, segment_distance, segment_to_triangle};

/// A rigid motion: the images of the directions and of the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub directions: [[f64; 3]; 3],
    pub origin: [f64; 3],
}

impl Motion {
    pub fn of(&self, point: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.origin[i] + (0..3).map(|k| self.directions[k][i] * point[k]).sum::<f64>())
    }
}

/// A triangle with a sphere about it.
#[derive(Clone, Debug)]
struct Triangle {
    corners: [[f64; 3]; 3],
    centre: [f64; 3],
    radius: f64,
}

impl Triangle {
    fn new(corners: [[f64; 3]; 3]) -> Triangle {
        let centre: [f64; 3] = std::array::from_fn(|i| corners.iter().map(|corner| corner[i]).sum::<f64>() / 3.0);
        let radius = corners.iter().map(|corner| between(*corner, centre)).fold(0.0, f64::max);
        Triangle { corners, centre, radius }
    }
}

/// A shape at its place in R.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A line with a radius.
    Capsule { ends: [[f64; 3]; 2], radius: f64 },
    /// A closed surface.
    Mesh(Mesh),
}

/// A closed surface of triangles, with a sphere about it.
#[derive(Clone, Debug)]
pub(super) struct Mesh {
    triangles: Vec<Triangle>,
    centre: [f64; 3],
    radius: f64,
}

impl Mesh {
    pub fn new(triangles: &[[[f64; 3]; 3]]) -> Mesh {
        let corners = || triangles.iter().flatten();
        let middle = |i: usize| {
            let span = corners()
                .map(|corner| corner[i])
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
            0.5 * (span[0] + span[1])
        };
        let centre = if triangles.is_empty() { [0.0; 3] } else { [0, 1, 2].map(middle) };
        let radius = corners().map(|corner| between(*corner, centre)).fold(0.0, f64::max);
        let triangles = triangles.iter().map(|corners| Triangle::new(*corners)).collect();
        Mesh { triangles, centre, radius }
    }

    fn moved(&self, motion: &Motion) -> Mesh {
        let moved = |triangle: &Triangle| Triangle {
            corners: triangle.corners.map(|corner| motion.of(corner)),
            centre: motion.of(triangle.centre),
            radius: triangle.radius,
        };
        Mesh {
            triangles: self.triangles.iter().map(moved).collect(),
            centre: motion.of(self.centre),
            radius: self.radius,
        }
    }

    /// Whether a point is inside: a ray from it crosses the surface an odd number of times. The direction is oblique to
    /// the faces of boxes and to each other's edges.
    fn contains(&self, point: [f64; 3]) -> bool {
        const DIRECTION: [f64; 3] = [0.577_213, 0.618_031, 0.533_751];
        let ahead = |triangle: &&Triangle| crossing(point, DIRECTION, &triangle.corners).is_some_and(|at| at > 0.0);
        self.triangles.iter().filter(ahead).count() % 2 == 1
    }

    /// The distance of a segment from the surface, at most `best`.
    fn segment_distance(&self, a: [f64; 3], b: [f64; 3], best: f64) -> f64 {
        let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * (a[i] + b[i]));
        let half = 0.5 * between(a, b);
        self.triangles.iter().fold(best, |best, triangle| {
            if between(middle, triangle.centre) - half - triangle.radius >= best {
                return best;
            }
            best.min(segment_to_triangle(a, b, &triangle.corners))
        })
    }
}

impl Shape {
    pub fn moved(&self, motion: &Motion) -> Shape {
        match self {
            Shape::Capsule { ends, radius } => Shape::Capsule { ends: ends.map(|end| motion.of(end)), radius: *radius },
            Shape::Mesh(mesh) => Shape::Mesh(mesh.moved(motion)),
        }
    }

    /// The centre and the radius of a sphere about it.
    fn sphere(&self) -> ([f64; 3], f64) {
        match self {
            Shape::Capsule { ends: [a, b], radius } => {
                (std::array::from_fn(|i| 0.5 * (a[i] + b[i])), 0.5 * between(*a, *b) + radius)
            }
            Shape::Mesh(mesh) => (mesh.centre, mesh.radius),
        }
    }

    /// The distance of two shapes; negative by the depth for two capsules, 0 for other shapes that meet. Not less than
    /// `most` where the shapes are farther apart than that.
    pub fn clearance(&self, other: &Shape, most: f64) -> f64 {
        let ((centre, radius), (other_centre, other_radius)) = (self.sphere(), other.sphere());
        if between(centre, other_centre) - radius - other_radius >= most {
            return most;
        }
        match (self, other) {
            (Shape::Capsule { ends: [a, b], radius }, Shape::Capsule { ends: [c, d], radius: other }) => {
                segment_distance(*a, *b, *c, *d).0 - radius - other
            }
            (Shape::Capsule { ends: [a, b], radius }, Shape::Mesh(mesh))
            | (Shape::Mesh(mesh), Shape::Capsule { ends: [a, b], radius }) => {
                if mesh.contains(*a) {
                    return -radius;
                }
                // What is not nearer is `most` to the last bit.
                let reach = most + radius;
                let found = mesh.segment_distance(*a, *b, reach);
                if found < reach { found - radius } else { most }
            }
            (Shape::Mesh(one), Shape::Mesh(other)) => {
                let inside = |mesh: &Mesh, within: &Mesh| {
                    mesh.triangles.first().is_some_and(|triangle| within.contains(triangle.corners[0]))
                };
                if inside(one, other) || inside(other, one) {
                    return 0.0;
                }
                let edges = |mesh: &Mesh, to: &Mesh, best: f64| {
                    mesh.triangles.iter().fold(best, |best, Triangle { corners: [p, q, r], .. }| {
                        [(p, q), (q, r), (r, p)]
                            .into_iter()
                            .fold(best, |best, (a, b)| to.segment_distance(*a, *b, best))
                    })
                };
                edges(other, one, edges(one, other, most))
            }
        }
    }
}
