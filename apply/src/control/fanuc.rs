//! Fanuc.

use super::{Control, Kinematics};
use crate::export::kinematics::{Entry, KinematicModel, Line};

pub(super) const CONTROL: Control = Control {
    word: "fanuc",
    name: "Fanuc Series 30i",
    tables: None,
    kinematics: Kinematics::Entries(KinematicModel {
        about: "tool centre point control, table rotation type (No. 19680 = 12)",
        source: "Fanuc A-79348E, Series 30i-MODEL A, Tool center point control for 5-axis machining, Nos. 19680, 19700 to 19705",
        entries,
    }),
    has_programs: true,
};

/// Point A on the first axis in machine coordinates, and the vector from A to point B on the second axis. Along the first
/// axis point A stays where it was: the displacement of the second axis there goes into the vector.
fn entries(first: char) -> Vec<Entry> {
    let of_first = vec![(1.0, Line::FirstAcross)];
    let (along, across) = (vec![(1.0, Line::SecondAlong)], vec![(1.0, Line::SecondAcross)]);
    let [point, vector] = if first == 'A' {
        [[Vec::new(), of_first], [along, across]]
    } else {
        [[of_first, Vec::new()], [across, along]]
    };
    let ([point_x, point_y], [vector_x, vector_y]) = (point, vector);
    let point_z = vec![(1.0, Line::FirstHeight)];
    vec![
        Entry { field: "19700", meaning: "rotary table position, X", terms: point_x },
        Entry { field: "19701", meaning: "rotary table position, Y", terms: point_y },
        Entry { field: "19702", meaning: "rotary table position, Z", terms: point_z },
        Entry { field: "19703", meaning: "vector from first to second axis, X", terms: vector_x },
        Entry { field: "19704", meaning: "vector from first to second axis, Y", terms: vector_y },
        Entry { field: "19705", meaning: "vector from first to second axis, Z", terms: Vec::new() },
    ]
}
