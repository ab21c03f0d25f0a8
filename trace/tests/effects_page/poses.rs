//! Generates poses for tests whose states come from a file: random joint positions of a robot. For a socket, the ball
//! stays where the first pose places it.

use std::path::Path;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, BodyErrors, Frame, Machine};
use abbe_model::frames::Point;
use nalgebra::{DVector, Matrix3xX, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;

const POSES: usize = 150;
/// Largest joint position in either direction.
const REACH_DEG: f64 = 150.0;

/// Writes the `data` files of the session's tests.
pub fn write(folder: &Path, session: &Path) {
    let toml: toml::Table = std::fs::read_to_string(session).unwrap().parse().unwrap();
    let machine = abbe_files::machine(Path::new(toml["machine"]["file"].as_str().unwrap())).unwrap();
    for (stream, test) in toml["test"].as_array().unwrap().iter().enumerate() {
        let Some(file) = test.get("data") else { continue };
        let point = ["target_mm", "ball_mm"].iter().find_map(|key| test.get(*key)).unwrap();
        let point: Vec<f64> = point
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_float().unwrap_or_else(|| x.as_integer().unwrap() as f64))
            .collect();
        let point = Vector3::new(point[0], point[1], point[2]);
        let mut random = Pcg64::new(7, stream as u128);
        let mut draw = || -> DVector<f64> {
            let reach = REACH_DEG.to_radians();
            DVector::from_fn(machine.axes.len(), |_, _| random.random_range(-reach..reach))
        };
        let socketed = test.get("socket").is_some();
        let place = tool_point(&machine, &draw(), point);
        let names: Vec<String> = machine.axes.iter().map(|axis| format!("{}_rad", axis.name)).collect();
        let mut text = format!("{}{}\n", names.join(","), if socketed { "" } else { ",px_mm,py_mm,pz_mm" });
        let mut poses = 0;
        while poses < POSES {
            let mut joints = draw();
            if socketed && !reach(&machine, &mut joints, point, place) {
                continue;
            }
            poses += 1;
            let mut cells: Vec<String> = joints.iter().map(f64::to_string).collect();
            if !socketed {
                cells.extend(tool_point(&machine, &joints, point).iter().map(f64::to_string));
            }
            text += &format!("{}\n", cells.join(","));
        }
        std::fs::write(folder.join(file.as_str().unwrap()), text).unwrap();
    }
}

fn tool_point(machine: &Machine, joints: &DVector<f64>, point: Vector3<f64>) -> Vector3<f64> {
    let state: Vec<_> = joints.iter().map(|q| AxisPosition::new(AxisKind::Rotary, *q)).collect();
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    Vector3::from(machine.in_r(Frame::Tool, &state, &none, Point(point.into())).0)
}

/// Moves the joints by the smallest change that brings the point to its place, by Newton's method. Returns `false` if
/// it does not converge.
fn reach(machine: &Machine, joints: &mut DVector<f64>, point: Vector3<f64>, place: Vector3<f64>) -> bool {
    for _ in 0..50 {
        let here = tool_point(machine, joints, point);
        if (place - here).norm() < 1e-9 {
            return joints.iter().all(|q| q.abs() < REACH_DEG.to_radians());
        }
        let columns: Vec<Vector3<f64>> = (0..joints.len())
            .map(|k| {
                let mut turned = joints.clone();
                turned[k] += 1e-6;
                (tool_point(machine, &turned, point) - here) / 1e-6
            })
            .collect();
        let jacobian = Matrix3xX::from_columns(&columns);
        let Ok(inverse) = jacobian.pseudo_inverse(1e-6) else {
            return false;
        };
        *joints += inverse * (place - here);
    }
    false
}
