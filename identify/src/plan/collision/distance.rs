//! Distances of segments and triangles, mm.

type Point = [f64; 3];

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: Point, b: Point) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The distance of two points.
pub(super) fn between(a: Point, b: Point) -> f64 {
    let d = minus(a, b);
    dot(d, d).sqrt()
}

fn along(a: Point, d: Point, by: f64) -> Point {
    std::array::from_fn(|i| a[i] + by * d[i])
}

/// The distance of the segments `ab` and `cd`, and the nearest points.
///
/// Source: Christer Ericson, Real-Time Collision Detection, 2005, Section 5.1.9.
pub(crate) fn segment_distance(a: Point, b: Point, c: Point, d: Point) -> (f64, Point, Point) {
    const POINT: f64 = 1e-18;
    let (u, v, w) = (minus(b, a), minus(d, c), minus(a, c));
    let (uu, vv, vw) = (dot(u, u), dot(v, v), dot(v, w));
    let (s, t) = if uu <= POINT && vv <= POINT {
        (0.0, 0.0)
    } else if uu <= POINT {
        (0.0, (vw / vv).clamp(0.0, 1.0))
    } else {
        let uw = dot(u, w);
        if vv <= POINT {
            ((-uw / uu).clamp(0.0, 1.0), 0.0)
        } else {
            let uv = dot(u, v);
            let parallel = uu * vv - uv * uv;
            let s = if parallel > 1e-12 * uu * vv { ((uv * vw - uw * vv) / parallel).clamp(0.0, 1.0) } else { 0.0 };
            let t = (uv * s + vw) / vv;
            if t < 0.0 {
                ((-uw / uu).clamp(0.0, 1.0), 0.0)
            } else if t > 1.0 {
                (((uv - uw) / uu).clamp(0.0, 1.0), 1.0)
            } else {
                (s, t)
            }
        }
    };
    let (p, q) = (along(a, u, s), along(c, v, t));
    (between(p, q), p, q)
}

/// The distance of a segment from a triangle; 0 if they meet.
pub(super) fn segment_to_triangle(a: Point, b: Point, triangle: &[Point; 3]) -> f64 {
    if meets(a, b, triangle) {
        return 0.0;
    }
    let [p, q, r] = *triangle;
    let edges = [(p, q), (q, r), (r, p)].into_iter().map(|(c, d)| segment_distance(a, b, c, d).0);
    let ends = [a, b].into_iter().filter_map(|end| above(end, triangle));
    edges.chain(ends).fold(f64::INFINITY, f64::min)
}

/// The distance of a point from the plane of a triangle, if its foot is inside the triangle.
fn above(point: Point, [p, q, r]: &[Point; 3]) -> Option<f64> {
    let normal = cross(minus(*q, *p), minus(*r, *p));
    let length = dot(normal, normal).sqrt();
    if length <= 0.0 {
        return None;
    }
    let inside = [(p, q), (q, r), (r, p)]
        .into_iter()
        .all(|(from, to)| dot(cross(minus(*to, *from), minus(point, *from)), normal) >= 0.0);
    inside.then(|| (dot(minus(point, *p), normal) / length).abs())
}

/// Whether a segment passes through a triangle.
fn meets(a: Point, b: Point, [p, q, r]: &[Point; 3]) -> bool {
    crossing(a, minus(b, a), &[*p, *q, *r]).is_some_and(|at| (0.0..=1.0).contains(&at))
}

/// Where the line from a point along a direction passes through a triangle, as a multiple of the direction.
///
/// Source: Möller & Trumbore, Fast, minimum storage ray/triangle intersection, 1997.
pub(super) fn crossing(from: Point, direction: Point, [p, q, r]: &[Point; 3]) -> Option<f64> {
    let (e1, e2) = (minus(*q, *p), minus(*r, *p));
    let h = cross(direction, e2);
    let det = dot(e1, h);
    let scale = (dot(e1, e1) * dot(e2, e2) * dot(direction, direction)).sqrt();
    if det.abs() <= 1e-14 * scale {
        return None;
    }
    let s = minus(from, *p);
    let u = dot(s, h) / det;
    let k = cross(s, e1);
    let v = dot(direction, k) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| dot(e2, k) / det)
}
