//! The points of a set-up: where the parameters of each begin, and where it is.

use abbe_model::instrument::Station;

/// The first parameter of the station and of the reflector of a distance.
pub(crate) const STATION: usize = 0;
pub(crate) const REFLECTOR: usize = 3;

/// The index of the first parameter of the point on the table, or where the station stands, and of that on the tool.
pub(crate) fn points(station: &Station<f64>) -> [Option<usize>; 2] {
    match station {
        // A station on the bed is no point of the table, but it is a point.
        Station::Distance(_) => [Some(STATION), Some(REFLECTOR)],
        _ => station.points().map(|point| point.map(|point| point.first)),
    }
}

/// The coordinates of a point of a set-up, mm.
pub(crate) fn point_mm(station: &Station<f64>, side: usize) -> Option<[f64; 3]> {
    station.clone().points_mut()[side].as_deref().copied()
}
