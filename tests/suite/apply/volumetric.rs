//! The volumetric error and its compensation against plain matrices and over every topology.

use abbe::apply::volumetric::{self, ErrorFunction, Form, MachineWithErrors, functions};
use abbe::model::axis::AxisKind;
use abbe::model::chain::{ERRORS_PER_AXIS, Machine};
use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use crate::suite::plan::topologies::{self, uniform};
use crate::suite::{abbe, ready, text};

fn machine() -> Machine {
    abbe::files::machine(&ready("volumetric/machine.toml")).unwrap()
}

fn errors(machine: &Machine) -> Vec<ErrorFunction> {
    functions::read(&ready("volumetric/errors.toml"), machine).unwrap()
}

/// Values of the twelve errors of each axis.
fn slots(machine: &Machine, functions: &[ErrorFunction], positions: &[f64]) -> Vec<f64> {
    let mut slots = vec![0.0; machine.error_slots()];
    for function in functions {
        slots[function.slot] += function.form.at(positions[function.over]);
    }
    slots
}

/// The tool point in the table frame of `w C A b Y X Z t` by homogeneous transformations.
fn by_matrices(machine: &Machine, slots: &[f64], positions: &[f64], tool: [f64; 3]) -> Point3<f64> {
    let small = |six: &[f64]| -> Isometry3<f64> {
        let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), six[3])
            * Rotation3::from_axis_angle(&Vector3::y_axis(), six[4])
            * Rotation3::from_axis_angle(&Vector3::z_axis(), six[5]);
        Isometry3::from_parts(Translation3::new(six[0], six[1], six[2]), UnitQuaternion::from_rotation_matrix(&turn))
    };
    let body = |name: &str| -> Isometry3<f64> {
        let axis = machine.axis_index(name).unwrap();
        let twelve = &slots[axis * ERRORS_PER_AXIS..(axis + 1) * ERRORS_PER_AXIS];
        let direction = Vector3::from(machine.axes[axis].direction);
        if machine.axes[axis].kind == AxisKind::Rotary {
            let turn = UnitQuaternion::new(direction * positions[axis]);
            return small(&twelve[..6]) * small(&twelve[6..]) * turn;
        }
        let tilted = direction + Vector3::new(twelve[3], twelve[4], twelve[5]).cross(&direction);
        Translation3::from(tilted * positions[axis]) * small(&twelve[6..])
    };
    let tool = body("Y") * body("X") * body("Z") * Point3::from(tool);
    (body("A") * body("C")).inverse() * tool
}

#[test]
fn the_33_errors_of_the_bundled_machine_agree_with_matrices() {
    let machine = machine();
    let functions = errors(&machine);
    let mut kinds: Vec<usize> = functions.iter().map(|function| function.slot).collect();
    kinds.sort_unstable();
    kinds.dedup();
    assert_eq!(kinds.len(), 33);
    let tool = [10.0, -20.0, -120.0];
    let erring = MachineWithErrors { machine: &machine, functions: &functions, tool_mm: tool };
    let mut random = Pcg64::seed_from_u64(3);
    for _ in 0..200 {
        let positions: Vec<f64> = machine
            .axes
            .iter()
            .map(|axis| uniform(&mut random, if axis.kind == AxisKind::Linear { 250.0 } else { 2.0 }))
            .collect();
        let nominal = by_matrices(&machine, &vec![0.0; machine.error_slots()], &positions, tool);
        let actual = by_matrices(&machine, &slots(&machine, &functions, &positions), &positions, tool);
        let place = erring.error_at(&positions);
        let expected = actual - nominal;
        assert!((Vector3::from(place.error_mm) - expected).norm() < 1e-10, "{place:?} {expected}");
        assert!(expected.norm() > 1e-3);
        // The corrected commands move the independent machine to the nominal point.
        let commands = erring.compensate(&positions).unwrap().positions;
        let corrected = by_matrices(&machine, &slots(&machine, &functions, &commands), &commands, tool);
        assert!((corrected - nominal).norm() < 1e-3 * expected.norm(), "{}", (corrected - nominal).norm());
    }
}

#[test]
fn every_topology_is_compensated() {
    let mut random = Pcg64::seed_from_u64(4);
    let mut compensated = 0;
    for machine in topologies::all(&mut random) {
        // Every error of the chain, as a straight line over its axis.
        let mut functions = Vec::new();
        for slot in 0..machine.error_slots() {
            let (axis, within) = (slot / ERRORS_PER_AXIS, slot % ERRORS_PER_AXIS);
            if machine.axes[axis].kind == AxisKind::Linear && within < 3 {
                continue;
            }
            let most = if within % 6 < 3 { 0.01 } else { 5e-5 };
            let form = Form::Polynomial {
                scale: if machine.axes[axis].kind == AxisKind::Linear { 250.0 } else { 2.0 },
                coefficients: vec![uniform(&mut random, most), uniform(&mut random, most)],
            };
            functions.push(ErrorFunction { slot, over: axis, form });
        }
        let erring = MachineWithErrors { machine: &machine, functions: &functions, tool_mm: [0.0, 0.0, -100.0] };
        let grid: Vec<Vec<f64>> = machine
            .axes
            .iter()
            .map(|axis| match axis.kind {
                AxisKind::Linear => vec![-200.0, 0.0, 200.0],
                AxisKind::Rotary => vec![-1.0, 0.3, 1.5],
            })
            .collect();
        let linear = machine.axes.iter().filter(|axis| axis.kind == AxisKind::Linear).count();
        if linear < 3 {
            let refused = volumetric::map(&erring, &grid, true).unwrap_err().to_string();
            assert!(refused.contains("do not span the space"), "{refused}");
            continue;
        }
        compensated += 1;
        let (places, summary) = volumetric::map(&erring, &grid, true).unwrap();
        assert_eq!(places.len(), grid.iter().map(Vec::len).product::<usize>());
        for place in &places {
            let size = |vector: [f64; 3]| Vector3::from(vector).norm();
            let left = size(place.compensated.as_ref().unwrap().error_mm);
            assert!(left < 1e-3 * size(place.error_mm), "{}: {left}", machine.name);
        }
        assert!(summary.error.rms_um > 1.0 && summary.residual.unwrap().largest_um < 1e-6);
    }
    assert!(compensated >= 12, "{compensated}");
}

#[test]
fn functions_have_the_values_of_their_closed_forms() {
    let table = Form::Table { at: vec![-1.0, 0.0, 2.0], values: vec![3.0, 1.0, 2.0] };
    for (q, expected) in [(-5.0, 3.0), (-1.0, 3.0), (-0.5, 2.0), (0.0, 1.0), (1.0, 1.5), (2.0, 2.0), (9.0, 2.0)] {
        assert_eq!(table.at(q), expected, "{q}");
    }
    let polynomial = Form::Polynomial { scale: 10.0, coefficients: vec![1.0, -2.0, 4.0] };
    assert_eq!(polynomial.at(5.0), 1.0 - 1.0 + 1.0);
    let harmonic = Form::Harmonic { period: 8.0, amplitude: 2.0, phase: 0.5 };
    assert!((harmonic.at(3.0) - 2.0 * (0.75 * std::f64::consts::PI + 0.5).cos()).abs() < 1e-15);
}

#[test]
fn the_command_writes_map_and_summary_and_names_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let (map, json) = (folder.path().join("map.csv"), folder.path().join("map.json"));
    let (machine, errors) = (ready("volumetric/machine.toml"), ready("volumetric/errors.toml"));
    let base = ["volumetric", text(&machine), "--map", text(&map), "--functions"];
    let run = |functions: &str, more: &[&str]| {
        let output = abbe(&[&base[..], &[functions], more].concat());
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let more = ["--correction", "--places", "3", "--axis", "C:4", "--axis", "A=-30", "--json", text(&json)];
    let (status, printed) = run(text(&errors), &more);
    assert_eq!(status, Some(0), "{printed}");
    let table = std::fs::read_to_string(&map).unwrap();
    assert_eq!(table.lines().count(), 1 + 27 * 4);
    assert!(table.starts_with("c_deg,a_deg,y_mm,x_mm,z_mm,px_mm,py_mm,pz_mm,ex_um,ey_um,ez_um,e_um,c_command_deg"));
    assert!(std::fs::read_to_string(&json).unwrap().contains("\"rms_um\""));

    let file = folder.path().join("errors.toml");
    for (written, expected) in [
        ("[constant]\nEX0W = \"1 um\"\n", "no axis `W`"),
        ("[constant]\nEX0X = \"1 um\"\n", "a linear axis has squareness errors"),
        ("[constant]\nEX0C = \"1 arcsec\"\n", "arcsec"),
        ("[[function]]\nerror = \"EXX\"\n", "errors.toml:1: `EXX`: give exactly one of"),
        (
            "[[function]]\nerror = \"EXX\"\ntable = { at_deg = [0, 1], um = [0, 1] }\n",
            "errors.toml:3: `at_mm` is expected for this axis",
        ),
        ("[[function]]\nerror = \"EXX\"\ntable = { at_mm = [1, 0], um = [0, 1] }\n", "ascend"),
        ("[[function]]\nerror = \"EAX\"\npolynomial = { um = [0, 1] }\n", "in `arcsec`"),
        ("[[function]]\nerror = \"EXX\"\nharmonic = { order = 2, amplitude_um = 1 }\n", "`period_"),
        ("[[function]]\nerror = \"EXX\"\nspline = 1\n", "errors.toml:3: [[function]] has the unknown key `spline`"),
    ] {
        std::fs::write(&file, written).unwrap();
        let (status, printed) = run(text(&file), &[]);
        assert_eq!(status, Some(1));
        assert!(printed.contains(expected) && printed.contains("errors.toml"), "{written}: {printed}");
    }
    // A harmonic whose argument would be constant, or no number.
    for harmonic in ["order = 1e-309", "period_deg = 1e-320"] {
        std::fs::write(
            &file,
            format!("[[function]]\nerror = \"EZC\"\nharmonic = {{ {harmonic}, amplitude_um = 1 }}\n"),
        )
        .unwrap();
        let (status, printed) = run(text(&file), &[]);
        assert!(status == Some(1) && printed.contains("a period from"), "{printed}");
    }
    // The table of a fine measurement is as long as it is.
    let at = (0..2001).map(|k| (k - 1000).to_string()).collect::<Vec<_>>().join(", ");
    let table = format!("[[function]]\nerror = \"EXX\"\ntable = {{ at_mm = [{at}], um = [{at}] }}\n");
    std::fs::write(&file, table).unwrap();
    assert_eq!(run(text(&file), &[]).0, Some(0));
    let (status, printed) = run(text(&errors), &["--axis", "Q=3"]);
    assert!(status == Some(1) && printed.contains("no axis `Q`"), "{printed}");
}

fn with_errors<'m>(machine: &'m Machine, functions: &'m [ErrorFunction]) -> MachineWithErrors<'m> {
    MachineWithErrors { machine, functions, tool_mm: [3.0, -2.0, 150.0] }
}

/// Every figure of the summary from the points of the map, and the share of each axis from a machine that has the errors
/// of that axis alone.
#[test]
fn the_summary_of_a_map_follows_from_its_points() {
    let machine = machine();
    let functions = errors(&machine);
    let grid: Vec<Vec<f64>> = machine
        .axes
        .iter()
        .map(|axis| match axis.name.as_str() {
            "C" => vec![-0.4, 0.9],
            "A" => vec![0.3],
            "X" => vec![-120.0, 40.0, 200.0],
            "Y" => vec![-75.0, 60.0],
            _ => vec![-100.0, 30.0],
        })
        .collect();
    let (points, summary) = volumetric::map(&with_errors(&machine, &functions), &grid, true).unwrap();
    let mut places: Vec<Vec<f64>> = vec![Vec::new()];
    for axis in &grid {
        places = places.iter().flat_map(|row| axis.iter().map(|at| [row.as_slice(), &[*at]].concat())).collect();
    }
    assert_eq!(summary.points, 24);
    assert_eq!(points.iter().map(|point| point.positions.clone()).collect::<Vec<_>>(), places);
    let size = |lengths: Vec<f64>| {
        let squares: f64 = lengths.iter().map(|length| length * length).sum();
        let most = lengths.iter().fold(0.0_f64, |most, length| most.max(length.abs()));
        [most * 1e3, (squares / lengths.len() as f64).sqrt() * 1e3]
    };
    let near = |found: volumetric::Size, wanted: [f64; 2]| {
        for (found, wanted) in [found.largest_um, found.rms_um].into_iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-9 * wanted.max(1e-3), "{found} instead of {wanted}");
        }
    };
    let norm = |vector: [f64; 3]| Vector3::from(vector).norm();
    let errors_of = |functions: &[ErrorFunction]| -> Vec<[f64; 3]> {
        let small = |at: &Vec<f64>| {
            let nominal = by_matrices(&machine, &vec![0.0; machine.error_slots()], at, [3.0, -2.0, 150.0]);
            (by_matrices(&machine, &slots(&machine, functions, at), at, [3.0, -2.0, 150.0]) - nominal).into()
        };
        places.iter().map(small).collect()
    };
    let by_matrix = errors_of(&functions);
    for (point, error) in points.iter().zip(&by_matrix) {
        let apart = Vector3::from(point.error_mm) - Vector3::from(*error);
        assert!(apart.norm() < 1e-6, "{:?}: {:?} instead of {error:?}", point.positions, point.error_mm);
        let compensated = point.compensated.as_ref().unwrap();
        assert_eq!(compensated.positions[..2], point.positions[..2]);
    }
    near(summary.error, size(points.iter().map(|point| norm(point.error_mm)).collect()));
    for (k, found) in [summary.coordinates.x, summary.coordinates.y, summary.coordinates.z].into_iter().enumerate() {
        near(found, size(points.iter().map(|point| point.error_mm[k]).collect()));
    }
    let residual = points.iter().filter_map(|point| Some(norm(point.compensated.as_ref()?.error_mm)));
    near(summary.residual.unwrap(), size(residual.collect()));
    let largest = points.iter().max_by(|a, b| norm(a.error_mm).total_cmp(&norm(b.error_mm))).unwrap();
    for ((at, axis), position) in summary.largest_at.iter().zip(&machine.axes).zip(&largest.positions) {
        let is_rotary = axis.kind == AxisKind::Rotary;
        assert_eq!((at.axis.as_str(), at.unit.as_str()), (axis.name.as_str(), if is_rotary { "deg" } else { "mm" }));
        assert!((at.position - if is_rotary { position.to_degrees() } else { *position }).abs() < 1e-9);
    }
    for (axis, share) in summary.by_axis.iter().enumerate() {
        assert_eq!(share.axis, machine.axes[axis].name);
        let own: Vec<ErrorFunction> =
            functions.iter().filter(|function| function.slot / ERRORS_PER_AXIS == axis).cloned().collect();
        let (_, alone) = volumetric::map(&with_errors(&machine, &own), &grid, false).unwrap();
        near(share.size, [alone.error.largest_um, alone.error.rms_um]);
        assert!(alone.residual.is_none());
        let wanted = size(errors_of(&own).into_iter().map(norm).collect());
        assert!((share.size.rms_um - wanted[1]).abs() < 1e-3, "{}: {:?} {wanted:?}", share.axis, share.size);
    }
}
