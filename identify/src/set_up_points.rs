//! The points of a set-up: where the parameters of each begin, and where it is.

use abbe_model::chain::Frame;
use abbe_model::instrument::Station;

/// The index of the first parameter of the point on the table, or where the station stands, and of that on the tool.
pub(crate) fn points(station: &Station<f64>) -> [Option<usize>; 2] {
    let entry = station.kind().entry();
    [Frame::Table, Frame::Tool].map(|side| {
        let (name, _) = entry.points.iter().find(|(_, default)| *default == side)?;
        entry.parameters.iter().position(|parameter| parameter.thing == *name)
    })
}

/// The coordinates of a point of a set-up, mm.
pub(crate) fn point_mm(station: &Station<f64>, side: usize) -> Option<[f64; 3]> {
    station.clone().points_mut()[side].as_deref().map(|point| point.mm)
}
