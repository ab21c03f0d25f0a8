//! Tests of Section VI of seed 003 (volumetric errors of machines with two rotary axes on the table) against the chain,
//! and of every arrangement, with the nominal rotations that the paper omits.

use abbe_codegen::symbol::length;
use abbe_codegen::{Arena, Equation, Operand, Options, Ring, Source, Subject, Symbol, ToolPoint, Variable};
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use abbe_model::scalar::Nominal;

use crate::seed000::{error, turn};

/// The tool point with A and C at zero.
struct Untilted;

impl Source for Untilted {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        ToolPoint.subject(length)
    }
    fn held<N: Nominal>(&self, axis: &str, _: &impl Fn(&str) -> N, _: &impl Fn(&str) -> N) -> Option<N> {
        matches!(axis, "A" | "C").then(|| N::constant(0.0))
    }
}

/// All error motions of the five axes.
fn motions(machine: &Machine) -> Vec<ErrorName> {
    let of_axis = |axis: &abbe_model::axis::Axis| {
        Freedom::ALL.map(|freedom| ErrorName { kind: ErrorKind::Motion, freedom, axis: axis.name.clone() })
    };
    machine.axes.iter().flat_map(of_axis).collect()
}

fn squareness() -> Vec<ErrorName> {
    let names = ["EC0X", "EB0Z", "EA0Z"];
    names.iter().filter_map(|name| ErrorName::parse(name)).collect()
}

fn position<'a>(arena: &'a Arena, axis: &str) -> Symbol<'a> {
    arena.variable(Variable::Position { axis: axis.to_string(), kind: AxisKind::Linear })
}

#[test]
fn the_three_expressions_of_section_vi() {
    // R_X[R_A[R_C·p + T_C] + T_A] + T_X = R_Y[R_Z·t + T_Z] + T_Y: X carries the table and moves against R's X.
    let mut machine = Machine::from_code("w C A X b Y Z t").expect("a code");
    machine.axes[2].direction = [-1.0, 0.0, 0.0];
    let mut errors = motions(&machine);
    errors.extend(squareness());
    let equation = Equation::of(&machine, &Untilted, &errors, &Options::default()).expect("an equation");
    let arena = &equation.arena;
    let e = |name: &str| error(arena, name);
    let (x, y, z) = (position(arena, "X"), position(arena, "Y"), position(arena, "Z"));
    let (xt, yt, zt) = (length(arena, "X_t"), length(arena, "Y_t"), length(arena, "Z_t"));
    // The paper's δx(X), ∂X_C … are defined against R in T_X, T_C and T_A; β₁ is −EB0Z, β₂ is EA0Z, α is EC0X.
    let (dx_x, dy_x, dz_x) = (-e("EXX"), e("EYX"), e("EZX"));
    let (dx_y, dy_y, dz_y) = (e("EXY"), e("EYY"), e("EZY"));
    let (dx_z, dy_z, dz_z) = (e("EXZ"), e("EYZ"), e("EZZ"));
    let (dxc, dyc, dzc) = (-e("EXC"), -e("EYC"), -e("EZC"));
    let (dxa, dya, dza) = (-e("EXA"), -e("EYA"), -e("EZA"));
    let (ex_x, ey_x, ez_x) = (e("EAX"), e("EBX"), e("ECX"));
    let (ex_y, ey_y, ez_y) = (e("EAY"), e("EBY"), e("ECY"));
    let (ex_z, ey_z, ez_z) = (e("EAZ"), e("EBZ"), e("ECZ"));
    let (phi_c, lambda_c, gamma_c) = (e("EAC"), e("EBC"), e("ECC"));
    let (phi_a, lambda_a, gamma_a) = (e("EAA"), e("EBA"), e("ECA"));
    let (alpha, beta_1, beta_2) = (e("EC0X"), -e("EB0Z"), e("EA0Z"));
    let delta_x = dx_x
        + dx_y
        + dx_z
        + dxc
        + dxa
        + y * (ez_x + gamma_c + gamma_a)
        + z * (-beta_1 - ey_x + ey_y - lambda_a - lambda_c)
        + yt * (ez_x - ez_y - ez_z + gamma_a + gamma_c)
        + zt * (-ey_x + ey_y + ey_z - lambda_a - lambda_c);
    let delta_y = -dy_x
        + dy_y
        + dy_z
        + dyc
        + dya
        + x * (alpha - ez_x - gamma_a - gamma_c)
        + z * (-beta_2 + ex_x - ex_y + phi_a + phi_c)
        + xt * (-ez_x + ez_y + ez_z - gamma_a - gamma_c)
        + zt * (ex_x - ex_y - ex_z + phi_a + phi_c);
    let delta_z = -dz_x
        + dz_y
        + dz_z
        + dzc
        + dza
        + x * (ey_x + lambda_a + lambda_c)
        + y * (-ex_x - phi_a - phi_c)
        + xt * (ey_x - ey_y - ey_z + lambda_a + lambda_c)
        + yt * (-ex_x + ex_y + ex_z - phi_a - phi_c);
    let mut ring = Ring::truncated(arena, 1).expect("first order");
    for (printed, chain) in [delta_x, delta_y, delta_z].into_iter().zip(&equation.exact) {
        assert!(ring.equal(printed.operand(), *chain).expect("a polynomial"));
    }
}

/// Orders of X, Y, Z with the bed at any place among them, after the two rotary axes of the table. The paper mentions
/// ten without a list; this is the complete list.
fn arrangements() -> Vec<String> {
    let orders = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"];
    let mut codes = Vec::new();
    for order in orders {
        for bed in 0..=3 {
            codes.push(format!("[wCA{}b{}t]", &order[..bed], &order[bed..]));
        }
    }
    codes
}

type Vector<'a> = [Symbol<'a>; 3];

fn plus<'a>(a: Vector<'a>, b: Vector<'a>) -> Vector<'a> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn minus<'a>(a: Vector<'a>, b: Vector<'a>) -> Vector<'a> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn times<'a>(a: Vector<'a>, b: Vector<'a>) -> Vector<'a> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The inverse rotation about A (X) or C (Z).
fn back<'a>(arena: &'a Arena, axis: &str, v: Vector<'a>) -> Vector<'a> {
    let (s, c) = turn(arena, axis);
    match axis {
        "A" => [v[0], c * v[1] + s * v[2], c * v[2] - s * v[1]],
        _ => [c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]],
    }
}

/// The first order by rigid-body kinematics. Every error motion displaces the point that its axis carries by δ + ε × r,
/// from the bed outwards on the tool side and with the opposite sign on the table side. The sum is rotated into the
/// table frame.
fn by_rigid_bodies<'a>(arena: &'a Arena, machine: &Machine) -> Vector<'a> {
    let zero = arena.symbol(Operand::constant(0.0));
    let six = |axis: &str| {
        let e = |freedom: &str| error(arena, &format!("E{freedom}{axis}"));
        ([e("X"), e("Y"), e("Z")], [e("A"), e("B"), e("C")])
    };
    let along = |axis: &abbe_model::axis::Axis| {
        let q = position(arena, &axis.name);
        axis.direction.map(|d| if d == 0.0 { zero } else { q })
    };
    let mut point = ["X_t", "Y_t", "Z_t"].map(|name| length(arena, name));
    let mut displacement = [zero; 3];
    for axis in machine.axes[machine.workpiece_side..].iter().rev() {
        let (shift, tilt) = six(&axis.name);
        displacement = plus(displacement, plus(shift, times(tilt, point)));
        point = plus(point, along(axis));
    }
    for axis in machine.axes[..machine.workpiece_side].iter().rev() {
        let (shift, tilt) = six(&axis.name);
        match axis.kind {
            AxisKind::Linear => {
                point = minus(point, along(axis));
                displacement = minus(displacement, plus(shift, times(tilt, point)));
            }
            AxisKind::Rotary => {
                displacement = minus(displacement, plus(shift, times(tilt, point)));
                point = back(arena, &axis.name, point);
                displacement = back(arena, &axis.name, displacement);
            }
        }
    }
    displacement
}

#[test]
fn every_arrangement_with_its_nominal_rotations() {
    let codes = arrangements();
    assert_eq!(codes.len(), 24);
    for code in codes {
        let machine = Machine::from_code(&code).expect("a code");
        let equation = Equation::volumetric(&machine, &motions(&machine), &Options::default());
        let equation = equation.expect("an equation");
        let expected = by_rigid_bodies(&equation.arena, &machine);
        let mut ring = Ring::truncated(&equation.arena, 1).expect("first order");
        for (expected, chain) in expected.into_iter().zip(&equation.exact) {
            assert!(ring.equal(expected.operand(), *chain).expect("a polynomial"), "{code}");
        }
    }
}
