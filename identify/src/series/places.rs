//! Where the residuals of independent poses are: on the sky, in the workspace, or in joint space.

use abbe_model::axis::AxisKind;

use super::{SessionSeries, lengths};
use crate::numerics::range;
use crate::problem::Problem;

/// The residual of an observed direction, in the unit of the series, where the mount points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Azimuth from +X through −Y (from north through east), 0° to 360°.
    pub azimuth_deg: f64,
    /// Elevation above the plane XY, degrees.
    pub elevation_deg: f64,
    /// Residual of the model before: across (azimuth · cos elevation), up.
    pub before: [f64; 2],
    /// Residual of the model after.
    pub after: [f64; 2],
}

impl Sighting {
    /// Where it is on a map with the zenith at the centre: zenith distance times the sine and the cosine of the azimuth,
    /// degrees to the east and to the north.
    pub fn on_map(&self) -> [f64; 2] {
        let (sin, cos) = self.azimuth_deg.to_radians().sin_cos();
        [sin, cos].map(|share| share * (90.0 - self.elevation_deg))
    }

    /// Residuals of this size on that map, in the unit of the residual: a residual up leads towards the zenith, one across
    /// towards increasing azimuth.
    pub fn shift_on_map(&self, [across, up]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.azimuth_deg.to_radians().sin_cos();
        [across * cos - up * sin, -across * sin - up * cos]
    }
}

/// The observed directions of all tests that are not excluded, in the order of the readings; `None` unless every test
/// observes directions.
pub fn sightings(problem: &Problem, series: &SessionSeries) -> Option<Vec<Sighting>> {
    let machine = &problem.session.machine;
    let (mut found, mut state) = (Vec::new(), Vec::new());
    for ((number, test), readings) in measured(problem).zip(&series.tests) {
        let columns = test.readings.as_deref()?;
        for (row, (before, after)) in pairs(&readings.before_um).zip(pairs(&readings.after_um)).enumerate() {
            columns.state(machine, row, &mut state);
            let [x, y, z] = problem.models[number].station().sight(machine, &state)?;
            if (0..2).all(|channel| problem.counts(number, 2 * row + channel)) {
                found.push(Sighting {
                    azimuth_deg: (-y).atan2(x).to_degrees().rem_euclid(360.0),
                    elevation_deg: z.clamp(-1.0, 1.0).asin().to_degrees(),
                    before,
                    after,
                });
            }
        }
    }
    (!found.is_empty()).then_some(found)
}

fn pairs(values: &[f64]) -> impl Iterator<Item = [f64; 2]> {
    values.as_chunks::<2>().0.iter().copied()
}

/// The tests with readings, with their numbers, as in [`SessionSeries::tests`].
fn measured(problem: &Problem) -> impl Iterator<Item = (usize, &abbe_model::session::Test)> {
    problem.tests.iter().enumerate().filter(|(_, test)| test.readings.is_some())
}

/// The residual over two coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Names of the coordinates: `X`, `Y` in R, or two axes.
    pub names: [String; 2],
    /// Their unit: `mm` or `deg`.
    pub unit: &'static str,
    /// Side of a cell, in this unit.
    pub cell: f64,
    /// The cells with readings.
    pub cells: Vec<Cell>,
}

/// The residual of the readings of one cell of a [`View`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Mean coordinates of its readings.
    pub at: [f64; 2],
    /// Number of readings.
    pub readings: usize,
    /// Root mean square of the lengths of their residuals before, in the unit of the series.
    pub before: f64,
    /// The same after.
    pub after: f64,
}

/// Cells along the longer side of a view.
const CELLS: f64 = 22.0;
/// Least number of cells of a view of the workspace. Poses in a few sockets are shown in joint space.
const MIN_CELLS: usize = 9;

/// Two views of the residuals of independent poses over the nominal place of the tool point in R, from above and from the
/// side. If the poses have the tool point in few places: two views over the four rotary axes with the largest travel.
/// None for readings along runs.
pub fn views(problem: &Problem, series: &SessionSeries) -> Vec<View> {
    if !problem.folds.kind.is_poses() {
        return Vec::new();
    }
    let machine = &problem.session.machine;
    let mut points: Vec<[f64; 3]> = Vec::new();
    let mut joints: Vec<Vec<f64>> = vec![Vec::new(); machine.axes.len()];
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for ((number, test), readings) in measured(problem).zip(&series.tests) {
        let Some(columns) = &test.readings else { continue };
        let channels = readings.channels;
        let [of_before, of_after] = [&readings.before_um, &readings.after_um].map(|values| lengths(values, channels));
        let nominal = columns.nominal_points(machine, &test.station.tool_point());
        for row in (0..columns.rows()).filter(|row| problem.counts(number, row * channels)) {
            points.push(nominal[row].into());
            joints.iter_mut().zip(&columns.positions).for_each(|(all, axis)| all.push(axis[row].to_degrees()));
            before.push(of_before[row]);
            after.push(of_after[row]);
        }
    }
    let view = |names: [&str; 2], unit: &'static str, at: &dyn Fn(usize) -> [f64; 2]| {
        let (cell, cells) = cells(&(0..points.len()).map(at).collect::<Vec<_>>(), [&before, &after]);
        View { names: names.map(str::to_string), unit, cell, cells }
    };
    let from_above = view(["X", "Y"], "mm", &|k| [points[k][0], points[k][1]]);
    if from_above.cells.len() >= MIN_CELLS {
        return vec![from_above, view(["X", "Z"], "mm", &|k| [points[k][0], points[k][2]])];
    }
    let rotary = |axis: &usize| machine.axes[*axis].kind == AxisKind::Rotary && range(&joints[*axis]) > 0.0;
    let mut widest: Vec<usize> = (0..machine.axes.len()).filter(rotary).collect();
    widest.sort_by(|a, b| range(&joints[*b]).total_cmp(&range(&joints[*a])));
    widest.truncate(4);
    widest.sort_unstable();
    let pairs = widest.as_chunks::<2>().0.iter();
    pairs
        .map(|pair| {
            let names = pair.map(|axis| machine.axes[axis].name.as_str());
            view(names, "deg", &|k| pair.map(|axis| joints[axis][k]))
        })
        .filter(|view| view.cells.len() >= MIN_CELLS)
        .collect()
}

/// The side of a cell, and the cells in the order of their rows and columns.
fn cells(points: &[[f64; 2]], [before, after]: [&[f64]; 2]) -> (f64, Vec<Cell>) {
    let column = |k: usize| points.iter().map(move |point| point[k]).collect::<Vec<f64>>();
    let columns = [column(0), column(1)];
    let low = columns.each_ref().map(|values| values.iter().copied().fold(f64::INFINITY, f64::min));
    let side = columns.iter().map(|values| range(values)).fold(0.0, f64::max) / CELLS;
    let place = |k: usize| [0, 1].map(|i| ((points[k][i] - low[i]) / side.max(f64::MIN_POSITIVE)) as usize);
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|k| place(*k));
    let cells = order.chunk_by(|a, b| place(*a) == place(*b)).map(|inside| {
        let mean = |of: &dyn Fn(usize) -> f64| inside.iter().map(|k| of(*k)).sum::<f64>() / inside.len() as f64;
        let rms = |values: &[f64]| mean(&|k| values[k] * values[k]).sqrt();
        Cell {
            at: [0, 1].map(|i| mean(&|k| points[k][i])),
            readings: inside.len(),
            before: rms(before),
            after: rms(after),
        }
    });
    (side, cells.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residuals_up_lead_to_the_zenith_and_residuals_across_to_greater_azimuth() {
        for azimuth_deg in [0.0, 40.0, 110.0, 200.0, 320.0] {
            let star = Sighting { azimuth_deg, elevation_deg: 30.0, before: [0.0; 2], after: [0.0; 2] };
            let near = |other: Sighting, shift: [f64; 2]| {
                let ([east, north], [more_east, more_north]) = (star.on_map(), other.on_map());
                let found = star.shift_on_map(shift);
                assert!((more_east - east - found[0]).abs() < 1e-3, "{azimuth_deg} {shift:?} {found:?}");
                assert!((more_north - north - found[1]).abs() < 1e-3, "{azimuth_deg} {shift:?} {found:?}");
            };
            near(Sighting { elevation_deg: 30.01, ..star }, [0.0, 0.01]);
            // An arc across at zenith distance z is z·dA long on the map.
            near(Sighting { azimuth_deg: azimuth_deg + 0.01, ..star }, [0.01_f64.to_radians() * 60.0, 0.0]);
        }
    }

    #[test]
    fn a_cell_has_the_mean_place_and_the_rms_of_its_readings() {
        let points = [[0.0, 0.0], [0.2, 0.4], [22.0, 11.0]];
        let (side, found) = cells(&points, [&[3.0, 4.0, 1.0], &[0.0, 2.0, 0.5]]);
        assert_eq!(side, 1.0);
        let first = Cell { at: [0.1, 0.2], readings: 2, before: 12.5_f64.sqrt(), after: 2.0_f64.sqrt() };
        assert_eq!(found, [first, Cell { at: [22.0, 11.0], readings: 1, before: 1.0, after: 0.5 }]);
    }
}
