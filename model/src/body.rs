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
    /// The box between two opposite corners, with faces across X, Y and Z, mm.
    Box {
        /// The least corner.
        low_mm: [f64; 3],
        /// The greatest corner.
        high_mm: [f64; 3],
    },
    /// A surface of triangles, mm. The corners of a triangle of a closed surface turn counterclockwise, seen from
    /// outside.
    Mesh {
        /// The corners of each triangle.
        triangles_mm: Vec<[[f64; 3]; 3]>,
        /// Whether every edge belongs to two triangles of opposite turn. Only a closed surface has an inside.
        is_closed: bool,
    },
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
