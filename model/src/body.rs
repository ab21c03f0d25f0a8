//! Bodies of a machine: shapes that move with an axis, for checks of clearance. They take no part in the chain.

/// A body of a machine. Its shape is in R with all axes at zero, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its name: `table`, `spindle`.
    pub name: String,
    /// The axis that carries it, by index in the machine; `None` for the bed.
    pub axis: Option<usize>,
    /// Its shape.
    pub shape: BodyShape,
}

/// The shape of a body.
#[derive(Clone, Debug, PartialEq)]
pub enum BodyShape {
    /// All points within a radius of a line, mm.
    Capsule {
        /// The ends of the line.
        ends_mm: [[f64; 3]; 2],
        /// The radius.
        radius_mm: f64,
    },
    /// A closed surface of triangles, mm. A box is one with twelve.
    Mesh(Vec<[[f64; 3]; 3]>),
}

impl BodyShape {
    /// The box between two opposite corners, with faces across X, Y and Z.
    pub fn cuboid(low: [f64; 3], high: [f64; 3]) -> BodyShape {
        let corner = |number: usize| -> [f64; 3] {
            std::array::from_fn(|i| if number >> i & 1 == 1 { high[i] } else { low[i] })
        };
        // Four corners of each face, in the order of a walk around it.
        const FACES: [[usize; 4]; 6] =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let of_face = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]].map(|three| three.map(corner));
        BodyShape::Mesh(FACES.into_iter().flat_map(of_face).collect())
    }
}

/// Sizes of a ball bar and of what holds its balls, for checks of clearance, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClearanceSizes {
    /// Radius of the bar.
    pub bar_radius_mm: f64,
    /// The stem below the workpiece ball, along −Z of the table frame: radius and length.
    pub workpiece_holder: Option<Holder>,
    /// The stem above the spindle ball, along Z of the tool frame: radius and length.
    pub spindle_holder: Option<Holder>,
    /// Least clearance of a proposed test.
    pub least_mm: f64,
}

/// A stem that holds a ball, from its centre, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Holder {
    /// Radius.
    pub radius_mm: f64,
    /// Length.
    pub length_mm: f64,
}

impl Default for ClearanceSizes {
    /// A bar of 10 mm radius, no holders, 5 mm of clearance.
    fn default() -> Self {
        ClearanceSizes { bar_radius_mm: 10.0, workpiece_holder: None, spindle_holder: None, least_mm: 5.0 }
    }
}
