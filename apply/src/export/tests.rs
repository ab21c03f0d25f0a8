//! Exported descriptions, read by kinematics that know the format and not its writer.

use abbe_files::robot::dh::Convention;
use abbe_identify::model_file::document::{Role, SCHEMA, SCHEMA_VERSION};
use abbe_identify::model_file::{IdentifiedModel, ModelParameter, Provenance};
use abbe_identify::noise::{Noise, NoiseSource};
use abbe_identify::results::ModelFit;
use abbe_model::chain::{AxisPosition, Frame, Machine};
use abbe_model::frames::{FixedPose, Point};
use abbe_model::unit::Unit;
use faer::Mat;
use nalgebra::{Matrix4, Rotation3, Vector3};
use rand::{Rng, RngExt, SeedableRng};

use super::dh::{DhTable, DhTables};
use super::frames::location_errors;
use super::{dh, urdf};

pub(super) fn model(machine: Machine, errors: &[(String, f64)]) -> IdentifiedModel {
    let parameters: Vec<ModelParameter> = errors
        .iter()
        .map(|(id, value)| ModelParameter {
            id: id.parse().unwrap(),
            role: Role::Location,
            effect: None,
            index: None,
            displayed: *value * 1e3,
            displayed_u: Some(1.0),
            unit: "um".into(),
            display_per_internal: 1e3,
            value: *value,
            held: false,
            identifiable: true,
            prior_u: None,
            size: 1.0,
        })
        .collect();
    let count = parameters.len();
    IdentifiedModel {
        schema: SCHEMA.into(),
        schema_version: SCHEMA_VERSION,
        sha256: String::new(),
        machine,
        instrument: "tracker".parse().unwrap(),
        effects: Vec::new(),
        parameters,
        covariance: Mat::from_fn(count, count, |i, j| if i == j { 1e-6 } else { 0.0 }),
        null_directions: Vec::new(),
        locations: Vec::new(),
        noise: Noise::white(1e-4, NoiseSource::Stated),
        unit: Unit::Micrometre,
        fit: ModelFit { readings: 1, rms_um: 0.0, heldout_rms_um: 0.0, u_enlargement: 1.0 },
        ranges: Vec::new(),
        motion_ranges: Vec::new(),
        tool_mm: [0.0; 3],
        table_mm: [0.0; 3],
        frames: Vec::new(),
        reference: abbe_model::driver::Reference::default(),
        provenance: Provenance::default(),
    }
}

pub(super) fn robot() -> Machine {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    abbe_files::machine(&folder.join("../sessions/ur10/machine.toml")).unwrap()
}

pub(super) fn random_errors(machine: &Machine, random: &mut impl Rng) -> Vec<(String, f64)> {
    let mut errors = Vec::new();
    for axis in &machine.axes {
        for (place, freedom) in ["X", "Y", "Z", "A", "B", "C"].into_iter().enumerate() {
            let share = 2.0 * random.random::<f64>() - 1.0;
            errors.push((format!("E{freedom}0{}", axis.name), share * if place < 3 { 1.0 } else { 3e-3 }));
        }
    }
    errors
}

/// The tool point of the chain itself, mm.
fn of_chain(model: &IdentifiedModel, q: &[f64], tool_mm: [f64; 3]) -> Vector3<f64> {
    let machine = &model.machine;
    let slots = location_errors(model);
    let errors = machine.body_errors(|slot| slots[slot] != 0.0, |slot| slots[slot]);
    let state: Vec<AxisPosition<f64>> =
        machine.axes.iter().zip(q).map(|(axis, q)| AxisPosition::new(axis.kind, *q)).collect();
    Vector3::from(machine.in_r(Frame::Tool, &state, &errors, Point(tool_mm)).0)
}

fn translation(x: f64, y: f64, z: f64) -> Matrix4<f64> {
    Matrix4::new_translation(&Vector3::new(x, y, z))
}

fn turn(axis: Vector3<f64>, angle_deg: f64) -> Matrix4<f64> {
    Rotation3::new(axis * angle_deg.to_radians()).to_homogeneous()
}

fn fixed(pose: &FixedPose) -> Matrix4<f64> {
    let [roll, pitch, yaw] = pose.rpy_deg;
    let [x, y, z] = pose.xyz_mm;
    translation(x, y, z) * turn(Vector3::z(), yaw) * turn(Vector3::y(), pitch) * turn(Vector3::x(), roll)
}

/// `B · Π Tx(a)·Rx(α)·Ry(β)·Rz(θ + q)·Tz(d) · F`.
fn of_table(table: &DhTable, q: &[f64]) -> Vector3<f64> {
    let mut frame = fixed(&table.base);
    for (row, q) in table.joints.iter().zip(q) {
        frame *= translation(row.a_mm, 0.0, 0.0)
            * turn(Vector3::x(), row.alpha_deg)
            * turn(Vector3::y(), row.beta_deg)
            * turn(Vector3::z(), row.theta_deg + q.to_degrees())
            * translation(0.0, 0.0, row.d_mm);
    }
    (frame * fixed(&table.tool)).fixed_view::<3, 1>(0, 3).into_owned()
}

#[test]
fn denavit_hartenberg_parameters_give_the_tool_positions_of_the_model() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(11);
    let machine = robot();
    let errors = random_errors(&machine, &mut random);
    let model = model(machine, &errors);
    let nominal = self::model(robot(), &[]);
    let tool_mm = [-1184.4, -349.3, 12.2];
    let DhTables { calibrated, nominal: as_designed, .. } =
        dh::tables(&model, tool_mm, Convention::Modified, None).unwrap();
    for _ in 0..200 {
        let q: Vec<f64> = (0..6).map(|_| 6.0 * random.random::<f64>() - 3.0).collect();
        let off = (of_table(&calibrated, &q) - of_chain(&model, &q, tool_mm)).norm();
        assert!(off < 1e-6, "{off:e} mm");
        let off = (of_table(&as_designed, &q) - of_chain(&nominal, &q, tool_mm)).norm();
        assert!(off < 1e-6, "nominal: {off:e} mm");
    }
    // The published lengths of the UR10: d1 = 127.3, a2 = −612, a3 = −572.3, d4 = 163.941, d5 = 115.7 mm.
    let a: Vec<f64> = as_designed.joints.iter().map(|row| row.a_mm.abs()).collect();
    assert!((a[2] - 612.0).abs() < 1e-9 && (a[3] - 572.3).abs() < 1e-9, "{a:?}");
    // Axes 2, 3 and 4 are parallel: Hayati's angle holds what the errors tilt them by.
    assert!(calibrated.joints[2].beta_deg != 0.0 && calibrated.joints[1].beta_deg == 0.0);
    assert!(as_designed.joints.iter().all(|row| row.beta_deg == 0.0));
    // Nominal angles of ±180° do not change their sign by the errors.
    for seed in 0..20 {
        let errors = random_errors(&robot(), &mut rand_pcg::Pcg64::seed_from_u64(seed));
        let found = dh::tables(&self::model(robot(), &errors), tool_mm, Convention::Modified, None).unwrap();
        for (row, nominal) in found.calibrated.joints.iter().zip(&found.nominal.joints) {
            let turned = [row.alpha_deg - nominal.alpha_deg, row.theta_deg - nominal.theta_deg];
            assert!(turned.iter().all(|turned| turned.abs() < 5.0), "{row:?} {nominal:?}");
        }
    }
}

/// The numbers of an attribute such as `xyz="0 0 1"`.
fn numbers(text: &str, attribute: &str) -> Vec<f64> {
    let (_, rest) = text.split_once(&format!("{attribute}=\"")).unwrap();
    let (list, _) = rest.split_once('"').unwrap();
    list.split(' ').map(|number| number.parse().unwrap()).collect()
}

#[test]
fn a_urdf_gives_the_tool_positions_of_the_model() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(13);
    let machine = robot();
    let errors = random_errors(&machine, &mut random);
    let model = model(machine, &errors);
    let tool_mm = [-1184.4, -349.3, 12.2];
    let text = urdf::urdf(&model, tool_mm).unwrap();
    let joints: Vec<&str> = text.split("<joint ").skip(1).collect();
    assert_eq!(joints.len(), 7);
    for _ in 0..100 {
        let q: Vec<f64> = (0..6).map(|_| 6.0 * random.random::<f64>() - 3.0).collect();
        let mut frame = Matrix4::<f64>::identity();
        for (number, joint) in joints.iter().enumerate() {
            let (xyz, rpy) = (numbers(joint, "xyz"), numbers(joint, "rpy"));
            let angle = |i: usize| rpy[i].to_degrees();
            frame *= translation(xyz[0], xyz[1], xyz[2])
                * turn(Vector3::z(), angle(2))
                * turn(Vector3::y(), angle(1))
                * turn(Vector3::x(), angle(0));
            if let Some(q) = q.get(number) {
                let (_, axis) = joint.split_once("<axis").unwrap();
                let axis = numbers(axis, "xyz");
                frame *= turn(Vector3::new(axis[0], axis[1], axis[2]), q.to_degrees());
            }
        }
        let metres: Vector3<f64> = frame.fixed_view::<3, 1>(0, 3).into_owned();
        let off = (metres * 1e3 - of_chain(&model, &q, tool_mm)).norm();
        assert!(off < 1e-6, "{off:e} mm");
    }
}
