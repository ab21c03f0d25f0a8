//! Columns of readings in data files: each instrument states its own.

/// What a column of readings holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The reading of an instrument that measures one length.
    Length,
    /// A deviation from the reference length of the set-up.
    Deviation,
    /// Against the probing direction: the distance by which the surface lies beyond the target.
    Outward,
    /// One coordinate of a vector.
    Coordinate(usize),
    /// The name of the socket; it has no unit.
    Socket,
}

/// A column of readings.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Its name without the unit.
    pub stem: &'static str,
    /// The unit in which messages name it; empty for a column without one. A file may use any unit of length.
    pub unit: &'static str,
    /// What it holds.
    pub quantity: Quantity,
}

impl Column {
    pub(super) const fn new(stem: &'static str, unit: &'static str, quantity: Quantity) -> Column {
        Column { stem, unit, quantity }
    }

    /// Three coordinates.
    pub(super) const fn vector(stems: [&'static str; 3], unit: &'static str) -> [Column; 3] {
        let [x, y, z] = stems;
        let coordinate = Quantity::Coordinate;
        [Column::new(x, unit, coordinate(0)), Column::new(y, unit, coordinate(1)), Column::new(z, unit, coordinate(2))]
    }

    /// Its name, with a unit if it has one.
    pub fn name(&self, unit: &str) -> String {
        if self.unit.is_empty() { self.stem.to_string() } else { format!("{}_{unit}", self.stem) }
    }
}
