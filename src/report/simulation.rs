//! The true values of a simulated session.

use abbe::identify::simulate::Simulated;

use super::number::unit;
use super::table::{Cell, Table, cells};

/// The parameters that are not zero.
pub fn truth(simulated: &Simulated) -> Table {
    let rows = simulated.truth.iter().map(|(id, value, name)| cells![id, Cell::fixed(*value, 4), unit(name)]);
    Table::new(["parameter", ">value", "unit"], rows)
}
