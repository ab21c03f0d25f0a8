//! The residual of independent poses over the workspace, or over joint space.

use abbe::identify::series::places::{View, views as of_places};

use super::plots::SessionPlots;
use crate::report::figure::bubbles::bubbles;
use crate::report::figure::{Figure, Quantity};

/// Two views before and after; none for readings along runs and for directions of the sky.
pub fn views(session: &SessionPlots<'_>) -> Vec<Figure> {
    let are_directions = session.problem.models.iter().all(|model| model.channels().iter().all(|one| one.is_angle()));
    if are_directions {
        return Vec::new();
    }
    of_places(session.problem, session.series).iter().map(|view| figure(session, view)).collect()
}

fn figure(session: &SessionPlots<'_>, view: &View) -> Figure {
    let [first, second] = &view.names;
    let size = Quantity::new("residual", session.series.unit.name());
    let place = if view.unit == "mm" { "the nominal place of the target in R" } else { "both joints" };
    Figure::new(
        format!("residual-over-{first}-{second}"),
        format!("Residual over {first} and {second}"),
        format!("Diameter: rms length of the residual in a cell, over {place}."),
        bubbles(view, &size, session.has_change()),
    )
}
