//! How long a path takes.

use std::f64::consts::{PI, TAU};

use abbe_model::chain::Machine;

use super::{Leg, Path, Shape};

impl Path {
    /// Duration of all traversals with pauses of `dwell_s` between them, min.
    pub fn minutes(&self, machine: &Machine, dwell_s: f64) -> f64 {
        let once: f64 = self.legs.iter().map(|leg| leg.minutes(machine)).sum();
        let traversals = self.traversals.are_backward().len();
        // In one direction alone the axes go back between two runs.
        let ways = if self.traversals.both_directions() { traversals } else { 2 * traversals - 1 };
        let rests_s = self.rest_s.unwrap_or(0.0) * (self.targets() * traversals) as f64;
        once * ways as f64 + dwell_s / 60.0 * (traversals - 1) as f64 + rests_s / 60.0
    }
}

impl Leg {
    /// Its duration, min.
    fn minutes(&self, machine: &Machine) -> f64 {
        let pairs = self.vertices.windows(2);
        match &self.shape {
            Shape::Line(feed) => {
                let longest = |pair: &[Vec<f64>]| {
                    let moved = machine.axes.iter().zip(pair[0].iter().zip(&pair[1]));
                    moved.map(|(axis, (a, b))| axis.kind.to_display(b - a).abs()).fold(0.0, f64::max)
                };
                pairs.map(longest).sum::<f64>() / feed
            }
            Shape::Arc { axes, centre, feed, .. } => {
                let angle = |state: &[f64]| (state[axes[1]] - centre[1]).atan2(state[axes[0]] - centre[0]);
                let radius = |state: &[f64]| (state[axes[0]] - centre[0]).hypot(state[axes[1]] - centre[1]);
                // No arc is longer than half a turn.
                let turn = |a: f64, b: f64| ((b - a + PI).rem_euclid(TAU) - PI).abs();
                pairs.map(|pair| radius(&pair[0]) * turn(angle(&pair[0]), angle(&pair[1]))).sum::<f64>() / feed
            }
            Shape::Segments { seconds, .. } => seconds / 60.0 * pairs.len() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use abbe_model::session::motion::Traversals;

    use super::*;

    /// One way through a leg of each kind. The machine has the axes X, Y and C in this order.
    fn minutes(shape: Shape, vertices: &[[f64; 3]]) -> f64 {
        let vertices = vertices.iter().map(|state| state.to_vec()).collect();
        let leg = Leg { vertices, measured: true, rest_s: None, shape };
        let machine = Machine::from_code("w C b X Y t").unwrap();
        let place = |name: &str| machine.axis_index(name).unwrap();
        let order = [place("X"), place("Y"), place("C")];
        let ordered = |state: &Vec<f64>| {
            let mut own = vec![0.0; 3];
            order.iter().zip(state).for_each(|(place, value)| own[*place] = *value);
            own
        };
        let leg = Leg { vertices: leg.vertices.iter().map(ordered).collect(), ..leg };
        let path = Path {
            legs: vec![leg],
            overshoots: Vec::new(),
            traversals: Traversals::new(1, false),
            rest_s: None,
            feed: (0.0, ""),
            remarks: Vec::new(),
            warnings: Vec::new(),
        };
        path.minutes(&machine, 60.0)
    }

    /// 500 mm at 1000 mm/min take half a minute, 180° at 90°/min two minutes, ten segments of 3 s half a minute.
    #[test]
    fn a_path_takes_its_length_over_its_feed() {
        assert!((minutes(Shape::Line(1000.0), &[[0.0, 0.0, 0.0], [-500.0, 0.0, 0.0]]) - 0.5).abs() < 1e-12);
        assert!((minutes(Shape::Line(1000.0), &[[200.0, 50.0, 0.0], [-300.0, 0.0, 0.0]]) - 0.5).abs() < 1e-12);
        assert!((minutes(Shape::Line(90.0), &[[0.0, 0.0, 0.0], [0.0, 0.0, PI]]) - 2.0).abs() < 1e-12);
        let steps: Vec<[f64; 3]> = (0..=10).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        assert!((minutes(Shape::Segments { seconds: 3.0, tool_points: None }, &steps) - 0.5).abs() < 1e-12);
    }
}
