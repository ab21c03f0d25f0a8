//! Properties of points transformed through random chains.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Frame;
use abbe_model::component::ErrorKind;
use abbe_model::frames::{Point, Rotation};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::machines::{Drawn, cases, is_angle, machines, point};

/// `P_w` and `P_s` of two points.
fn both(drawn: &Drawn, factor: f64, table: [f64; 3], tool: [f64; 3]) -> [[f64; 3]; 2] {
    let (state, bodies) = (drawn.state(), drawn.bodies(factor));
    [
        drawn.machine.in_r(Frame::Table, &state, &bodies, Point(table)).0,
        drawn.machine.in_r(Frame::Tool, &state, &bodies, Point(tool)).0,
    ]
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Bounds of second-order gaps, mm. The first is for errors of `factor` times the random ones; the second is for the
/// remainder after four times the gap of half the errors is subtracted. With Θ the sum of all error angles and L the
/// longest distance from the bed to a point, they are Θ²·L and Θ³·L.
fn second_and_third_order(drawn: &Drawn, factor: f64) -> (f64, f64) {
    let angles = drawn.errors.iter().enumerate();
    let sum: f64 = angles.filter(|(slot, _)| is_angle(*slot)).map(|(_, angle)| factor * angle.abs()).sum();
    let lines = drawn.machine.axes.iter().zip(&drawn.positions);
    let way: f64 = lines.map(|(axis, q)| 2.0 * apart(axis.origin_mm, [0.0; 3]) + q.abs()).sum();
    let reach = 1000.0 + way;
    (sum.powi(2) * reach + ROUNDING_MM, sum.powi(3) * reach + ROUNDING_MM)
}

const ROUNDING_MM: f64 = 1e-10;

/// The chain computed with nalgebra's rigid motions: bodies are multiplied instead of transforming points.
fn rigid(drawn: &Drawn, axes: &[usize]) -> Isometry3<f64> {
    let turn = |six: &[f64]| {
        let about = |i: usize, angle: f64| Rotation3::from_axis_angle(&Vector3::ith_axis(i), angle);
        about(0, six[3]) * about(1, six[4]) * about(2, six[5])
    };
    let body = |six: &[f64]| {
        let turn = turn(six);
        Isometry3::from_parts(Translation3::new(six[0], six[1], six[2]), turn.into())
    };
    axes.iter().fold(Isometry3::identity(), |motion, &index| {
        let axis = &drawn.machine.axes[index];
        let (location, moved) = drawn.errors[12 * index..12 * index + 12].split_at(6);
        let origin = Vector3::from(axis.origin_mm);
        let direction = Vector3::from(axis.direction);
        let q = drawn.positions[index];
        let (there, back) = (Translation3::from(origin), Translation3::from(-origin));
        motion
            * match axis.kind {
                AxisKind::Rotary => {
                    let turned = UnitQuaternion::from_axis_angle(&Unit::new_normalize(direction), q);
                    there * body(location) * body(moved) * turned * back
                }
                AxisKind::Linear => {
                    let tilt = Vector3::new(location[3], location[4], location[5]).cross(&direction);
                    Translation3::from(origin + (direction + tilt) * q) * body(moved) * back
                }
            }
    })
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn the_chain_is_the_product_of_its_bodies(drawn in machines(), table in point(), tool in point()) {
        let drawn = drawn.with(Rotation::Exact);
        let found = both(&drawn, 1.0, table, tool);
        let side = drawn.machine.workpiece_side;
        let outwards: Vec<usize> = (0..side).rev().collect();
        let inwards: Vec<usize> = (side..drawn.machine.axes.len()).collect();
        for ((axes, point), found) in [(outwards, table), (inwards, tool)].into_iter().zip(found) {
            let expected = rigid(&drawn, &axes) * Point3::from(point);
            prop_assert!(apart(found, expected.coords.into()) < 1e-9, "{found:?} {expected}");
        }
    }

    #[test]
    fn an_axis_offset_equals_error_motions_along_the_axis(drawn in machines(), table in point(), tool in point(), late in 1e-7..1e-6_f64) {
        // Error motions in the proportions of `slots_along` equal an offset of the position, to first order.
        let drawn = drawn.with(Rotation::Exact);
        let nothing = vec![0.0; drawn.errors.len()];
        for axis in 0..drawn.machine.axes.len() {
            let mut moved = Drawn { errors: nothing.clone(), ..drawn.clone() };
            for (slot, share) in drawn.machine.slots_along(axis) {
                prop_assert_eq!(drawn.machine.error_name(slot).kind, ErrorKind::Motion);
                moved.errors[slot] = late * share;
            }
            let mut elsewhere = Drawn { errors: nothing.clone(), ..drawn.clone() };
            elsewhere.positions[axis] += late;
            let (moved, elsewhere) = (both(&moved, 1.0, table, tool), both(&elsewhere, 1.0, table, tool));
            for (a, b) in moved.into_iter().zip(elsewhere) {
                prop_assert!(apart(a, b) < 1e-8, "{axis}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn frames_invert(drawn in machines(), table in point(), tool in point()) {
        let drawn = drawn.with(Rotation::Exact);
        let (state, bodies) = (drawn.state(), drawn.bodies(1.0));
        let [on_table, on_tool] = both(&drawn, 1.0, table, tool);
        let machine = &drawn.machine;
        prop_assert!(apart(machine.in_frame(Frame::Table, &state, &bodies, Point(on_table)).0, table) < 1e-9);
        prop_assert!(apart(machine.in_frame(Frame::Tool, &state, &bodies, Point(on_tool)).0, tool) < 1e-9);
        for index in 0..machine.axes.len() {
            let pushed = machine.push(index, &state, &bodies, Point(table));
            prop_assert!(apart(machine.pull(index, &state, &bodies, pushed).0, table) < 1e-9);
        }
    }

    /// `I − [θ]×` is the inverse of `I + [θ]×` to second order: half the errors give a quarter of the gap.
    #[test]
    fn frames_of_small_angles_invert_to_second_order(drawn in machines(), table in point()) {
        let drawn = drawn.with(Rotation::SmallAngle);
        let gap = |factor: f64| -> [f64; 3] {
            let (state, bodies) = (drawn.state(), drawn.bodies(factor));
            let there = drawn.machine.in_r(Frame::Table, &state, &bodies, Point(table));
            let back = drawn.machine.in_frame(Frame::Table, &state, &bodies, there).0;
            std::array::from_fn(|i| back[i] - table[i])
        };
        let (whole, half) = (gap(0.1), gap(0.05));
        let (second, third) = second_and_third_order(&drawn, 0.1);
        prop_assert!(apart(whole, [0.0; 3]) < second, "{whole:?}");
        prop_assert!(apart(whole, half.map(|part| 4.0 * part)) < third, "{whole:?} {half:?}");
    }

    #[test]
    fn exact_and_small_angles_agree_to_second_order(drawn in machines(), table in point(), tool in point()) {
        let (exact, small) = (drawn.with(Rotation::Exact), drawn.with(Rotation::SmallAngle));
        let gap = |factor: f64, side: usize| -> [f64; 3] {
            let exact = both(&exact, factor, table, tool)[side];
            let small = both(&small, factor, table, tool)[side];
            std::array::from_fn(|i| exact[i] - small[i])
        };
        for side in [0, 1] {
            let (whole, half) = (gap(0.1, side), gap(0.05, side));
            let (second, third) = second_and_third_order(&exact, 0.1);
            prop_assert!(apart(whole, [0.0; 3]) < second, "{whole:?}");
            prop_assert!(apart(whole, half.map(|part| 4.0 * part)) < third, "{whole:?} {half:?}");
        }
        prop_assert_eq!(both(&exact, 0.0, table, tool), both(&small, 0.0, table, tool));
    }

    #[test]
    fn errors_preserve_distances_within_a_body(drawn in machines(), one in point(), other in point()) {
        let drawn = drawn.with(Rotation::Exact);
        let (at_one, at_other) = (both(&drawn, 1.0, one, one), both(&drawn, 1.0, other, other));
        for side in [0, 1] {
            prop_assert!((apart(at_one[side], at_other[side]) - apart(one, other)).abs() < 1e-9);
        }
    }

    /// A power of two is exact in every step, so that the results are equal to the bit.
    #[test]
    fn lengths_scale(drawn in machines(), table in point(), tool in point(), power in -20_i32..20) {
        let factor = 2.0_f64.powi(power);
        let of = |lengths: [f64; 3]| lengths.map(|length| factor * length);
        let scaled = both(&drawn.scaled(factor), 1.0, of(table), of(tool));
        prop_assert_eq!(scaled, both(&drawn, 1.0, table, tool).map(of));
        // The inch factor is not a power of two.
        let inches = |lengths: [f64; 3]| lengths.map(|length| length / 25.4);
        let scaled = both(&drawn.scaled(1.0 / 25.4), 1.0, inches(table), inches(tool));
        for (scaled, plain) in scaled.into_iter().zip(both(&drawn, 1.0, table, tool)) {
            prop_assert!(apart(scaled, inches(plain)) < 1e-11);
        }
    }

    #[test]
    fn the_errors_of_a_mirrored_machine_are_mirrored(
        drawn in machines(),
        table in point(),
        tool in point(),
        coordinate in 0_usize..3,
    ) {
        let mirror = |point: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|i| if i == coordinate { -point[i] } else { point[i] })
        };
        let mirrored = drawn.mirrored(coordinate);
        let found = both(&mirrored, 1.0, mirror(table), mirror(tool));
        for (found, plain) in found.into_iter().zip(both(&drawn, 1.0, table, tool)) {
            prop_assert!(apart(found, mirror(plain)) < 1e-10, "{found:?} {plain:?}");
        }
        // The moment about a rotary axis is unchanged in the mirror image, because the moment and the axis both change
        // sign.
        let tool_in_the_mirror = mirror(tool);
        for index in 0..drawn.machine.axes.len() {
            let frame = if index < drawn.machine.workpiece_side { Frame::Table } else { Frame::Tool };
            let moment = drawn.machine.gravity_moment_mm(index, &drawn.state(), frame, tool);
            let shown = mirrored.machine.gravity_moment_mm(index, &drawn.state(), frame, tool_in_the_mirror);
            let sign = if drawn.machine.axes[index].kind == AxisKind::Rotary { 1.0 } else { -1.0 };
            prop_assert!((shown - sign * moment).abs() < 1e-9, "{shown} {moment}");
        }
    }

    /// The axis on the bed on either side: `d · ((p − o) × g)` with the point of its own side.
    #[test]
    fn the_axes_on_the_bed_carry_the_points_of_their_sides(drawn in machines(), at in point()) {
        let machine = &drawn.machine;
        let [table, tool] = both(&drawn, 0.0, at, at);
        let (of_table, of_tool) = (machine.workpiece_side.checked_sub(1), machine.workpiece_side);
        for (index, carried) in of_table.map(|index| (index, table)).into_iter().chain([(of_tool, tool)]) {
            let Some(axis) = machine.axes.get(index) else { continue };
            let lever = Vector3::from(carried) - Vector3::from(axis.origin_mm);
            let moment = Vector3::from(axis.direction).dot(&lever.cross(&Vector3::from(machine.gravity)));
            let frame = if index < machine.workpiece_side { Frame::Table } else { Frame::Tool };
            let found = machine.gravity_moment_mm(index, &drawn.state(), frame, at);
            prop_assert!((found - moment).abs() < 1e-8, "{index}: {found} {moment}");
        }
    }

    #[test]
    fn an_axis_without_motion_and_errors_has_no_effect(drawn in machines(), table in point()) {
        let (state, bodies) = (drawn.state(), drawn.bodies(0.0));
        let mut at_zero = drawn.clone();
        at_zero.positions.fill(0.0);
        let still = drawn.machine.in_r(Frame::Table, &at_zero.state(), &bodies, Point(table));
        prop_assert!(apart(still.0, table) < 1e-12);
        let turned = Matrix3::from_fn(|i, j| {
            let unit: [f64; 3] = std::array::from_fn(|k| if k == j { 1.0 } else { 0.0 });
            let at = |point| drawn.machine.in_r(Frame::Table, &state, &bodies, Point(point)).0[i];
            at(unit) - at([0.0; 3])
        });
        prop_assert!((turned * turned.transpose() - Matrix3::identity()).norm() < 1e-11);
        prop_assert!((turned.determinant() - 1.0).abs() < 1e-11);
    }
}
