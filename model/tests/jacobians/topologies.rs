//! Machines of every topology, with random axis lines and random errors.

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::frames::Rotation;
use rand::{Rng, RngExt};

/// Table 1.1 of the thesis, corrected: the print doubles the `A` of [wXYbZBAt] and of [wXYbZCAt], and the `B` of
/// [wXYbZCBt].
pub const TABLE_1_1: [&str; 10] = [
    "[wXYbZABt]",
    "[wXYbZBAt]",
    "[wXYbZCAt]",
    "[wXYbZCBt]",
    "[wABXYbZt]",
    "[wBAXYbZt]",
    "[wCAXYbZt]",
    "[wCBXYbZt]",
    "[wCXYbZAt]",
    "[wCXYbZBt]",
];

/// The machines of Fig. 1.1.
pub const FIGURE_1_1: [&str; 3] = ["[wXbYZCBt]", "[wCXbYZAt]", "[wCAYbXZt]"];

/// One machine of each topology: the ten of the table, the three of the figure, the one of the thesis, and a robot. The
/// axes are near their nominal lines.
pub fn all(random: &mut impl Rng) -> Vec<Machine> {
    let codes = TABLE_1_1.iter().chain(&FIGURE_1_1).chain(&["[wCAbYXZt]"]);
    let mut machines: Vec<Machine> = codes.map(|code| Machine::from_code(code).unwrap()).collect();
    machines.push(robot());
    for machine in &mut machines {
        if random.random::<bool>() {
            machine.rotation = Rotation::SmallAngle;
        }
        for axis in &mut machine.axes {
            if axis.kind == AxisKind::Rotary {
                axis.origin_mm = [(); 3].map(|()| uniform(random, 200.0));
            }
            // Half of the axes along R's own directions, either way; half oblique.
            if random.random::<bool>() {
                let skew: [f64; 3] = std::array::from_fn(|i| axis.direction[i] + uniform(random, 0.3));
                let length = skew.iter().map(|v| v * v).sum::<f64>().sqrt();
                axis.direction = skew.map(|v| v / length);
            } else if random.random::<bool>() {
                axis.direction = axis.direction.map(|v| -v);
            }
        }
    }
    machines
}

/// Six rotary axes with free names.
pub fn robot() -> Machine {
    let lines = [
        ([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
        ([0.0, -1.0, 0.0], [0.0, 0.0, 127.3]),
        ([0.0, -1.0, 0.0], [-612.0, 0.0, 127.3]),
        ([0.0, -1.0, 0.0], [-1184.3, 0.0, 127.3]),
        ([0.0, 0.0, -1.0], [-1184.3, -163.941, 127.3]),
        ([0.0, -1.0, 0.0], [-1184.3, -163.941, 11.6]),
    ];
    let axes = lines.iter().enumerate().map(|(index, (direction, origin_mm))| Axis {
        name: format!("J{}", index + 1),
        kind: AxisKind::Rotary,
        direction: *direction,
        origin_mm: *origin_mm,
        travel: None,
        joint: None,
    });
    Machine {
        name: "six axes".into(),
        axes: axes.collect(),
        workpiece_side: 0,
        rotation: Rotation::Exact,
        gravity: [0.0, 0.0, -1.0],
        flange: None,
        bodies: Vec::new(),
    }
}

/// A random number between −`most` and `most`.
pub fn uniform(random: &mut impl Rng, most: f64) -> f64 {
    most * (2.0 * random.random::<f64>() - 1.0)
}
