//! Shapes in their own frame, and the clearance of two of them, by the crate `parry3d-f64`.
//!
//! A shape is all points within a radius of its core: a segment, a box with its inside, or a surface of triangles.

use abbe_model::body::BodyShape;
use parry3d_f64::bounding_volume::BoundingSphere;
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{SharedShape, TriMesh, TriMeshFlags};

/// A shape in its own frame.
#[derive(Clone)]
pub(super) struct Shape {
    core: SharedShape,
    /// The core's own frame in that of the shape.
    core_at: Pose,
    /// A point of the core, in its frame.
    point: Vector,
    radius: f64,
    /// Whether the core is a closed surface, which may contain other shapes.
    is_closed_surface: bool,
}

/// A shape at its place in R.
#[derive(Clone)]
pub(super) struct Placed {
    shape: Shape,
    core_at: Pose,
    about: BoundingSphere,
}

impl Shape {
    /// All points within a radius of a segment.
    pub fn capsule(a: [f64; 3], b: [f64; 3], radius: f64) -> Shape {
        let core = SharedShape::segment(a.into(), b.into());
        Shape { core, core_at: Pose::identity(), point: a.into(), radius, is_closed_surface: false }
    }

    /// The shape of a body; `None` for a surface without triangles.
    pub fn of(body: &BodyShape) -> Option<Shape> {
        Some(match body {
            BodyShape::Capsule { ends_mm: [a, b], radius_mm } => Shape::capsule(*a, *b, *radius_mm),
            BodyShape::Box { low_mm, high_mm } => {
                let (low, high) = (Vector::from(*low_mm), Vector::from(*high_mm));
                let half = 0.5 * (high - low);
                Shape {
                    core: SharedShape::cuboid(half.x, half.y, half.z),
                    core_at: Pose::from_translation(0.5 * (low + high)),
                    point: Vector::ZERO,
                    radius: 0.0,
                    is_closed_surface: false,
                }
            }
            BodyShape::Mesh { triangles_mm, is_closed } => {
                let corners: Vec<Vector> = triangles_mm.iter().flatten().map(|corner| Vector::from(*corner)).collect();
                let point = *corners.first()?;
                let indices = (0..triangles_mm.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
                // Normals of edges and corners tell inside from outside.
                let oriented = TriMeshFlags::MERGE_DUPLICATE_VERTICES | TriMeshFlags::ORIENTED;
                let flags = if *is_closed { oriented } else { TriMeshFlags::empty() };
                let core = SharedShape::new(TriMesh::with_flags(corners, indices, flags).ok()?);
                Shape { core, core_at: Pose::identity(), point, radius: 0.0, is_closed_surface: *is_closed }
            }
        })
    }

    /// The shape after a motion of its frame.
    pub fn moved(&self, motion: &Pose) -> Placed {
        let core_at = *motion * self.core_at;
        Placed { about: self.core.compute_bounding_sphere(&core_at), core_at, shape: self.clone() }
    }
}

impl Placed {
    /// The distance of two shapes; negative by the depth for two capsules, at most 0 for other shapes that meet. `most`
    /// where the shapes are farther apart than that.
    pub fn clearance(&self, other: &Placed, most: f64) -> f64 {
        let radii = self.shape.radius + other.shape.radius;
        let apart = (self.about.center - other.about.center).length() - self.about.radius - other.about.radius - radii;
        if apart >= most {
            return most;
        }
        // All pairs of segments, boxes and surfaces have a distance.
        let found = query::distance(&self.core_at, &*self.shape.core, &other.core_at, &*other.shape.core);
        let distance = found.map_or(0.0, |found| found.distance);
        // A surface has no points within, so that what is wholly inside it has a distance from it.
        let is_inside = distance > 0.0 && (self.contains(other) || other.contains(self));
        (if is_inside { 0.0 } else { distance }) - radii
    }

    fn contains(&self, other: &Placed) -> bool {
        let point = other.core_at.transform_point(other.shape.point);
        self.shape.is_closed_surface && self.shape.core.contains_point(&self.core_at, point)
    }
}

/// The distance of the segments `ab` and `cd`.
pub(crate) fn segment_distance(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let at = Pose::identity();
    Shape::capsule(a, b, 0.0).moved(&at).clearance(&Shape::capsule(c, d, 0.0).moved(&at), f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(shape: &BodyShape, x: f64) -> Placed {
        Shape::of(shape).unwrap().moved(&Pose::translation(x, 0.0, 0.0))
    }

    /// A tetrahedron with three edges of a length along X, Y, Z from a corner on the diagonal.
    fn tetrahedron(from: f64, length: f64, is_closed: bool) -> BodyShape {
        let corner = |k: usize| -> [f64; 3] { std::array::from_fn(|i| if i + 1 == k { from + length } else { from }) };
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let faces = if is_closed { &faces[..] } else { &faces[..3] };
        BodyShape::Mesh { triangles_mm: faces.iter().map(|face| face.map(corner)).collect(), is_closed }
    }

    #[test]
    fn what_is_wholly_inside_a_closed_surface_collides() {
        let capsule = BodyShape::Capsule { ends_mm: [[0.0; 3], [1.0, 0.0, 0.0]], radius_mm: 0.5 };
        let cuboid = BodyShape::Box { low_mm: [0.0; 3], high_mm: [1.0; 3] };
        let small = tetrahedron(0.0, 2.0, true);
        for inside in [&capsule, &cuboid, &small] {
            let closed = placed(&tetrahedron(-1.0, 100.0, true), 0.0);
            assert!(placed(inside, 5.0).clearance(&closed, f64::INFINITY) <= 0.0);
            assert!(closed.clearance(&placed(inside, 5.0), f64::INFINITY) <= 0.0);
            // The surface begins at x = −1.
            assert!(placed(inside, -20.0).clearance(&closed, f64::INFINITY) > 10.0);
            let open = placed(&tetrahedron(-1.0, 100.0, false), 0.0);
            assert!(placed(inside, 5.0).clearance(&open, f64::INFINITY) > 0.0);
        }
        let around = BodyShape::Box { low_mm: [-50.0; 3], high_mm: [50.0; 3] };
        assert!(placed(&around, 0.0).clearance(&placed(&small, 0.0), f64::INFINITY) <= 0.0);
    }

    #[test]
    fn distances_of_boxes_and_capsules_are_those_of_the_drawing() {
        let cuboid = BodyShape::Box { low_mm: [0.0; 3], high_mm: [1.0; 3] };
        let capsule = BodyShape::Capsule { ends_mm: [[0.0, 0.5, 4.0], [1.0, 0.5, 4.0]], radius_mm: 0.5 };
        let found = placed(&cuboid, 0.0).clearance(&placed(&capsule, 0.0), f64::INFINITY);
        assert!((found - 2.5).abs() < 1e-12, "{found}");
        let found = placed(&cuboid, 0.0).clearance(&placed(&cuboid, 3.0), f64::INFINITY);
        assert!((found - 2.0).abs() < 1e-12, "{found}");
        // Two capsules of radius 0.5 that cross at a distance of 0.25.
        let found = placed(&capsule, 0.0).clearance(&placed(&capsule, 1.25), f64::INFINITY);
        assert!((found + 0.75).abs() < 1e-12, "{found}");
        assert_eq!(placed(&cuboid, 0.0).clearance(&placed(&cuboid, 30.0), 5.0), 5.0);
    }
}
