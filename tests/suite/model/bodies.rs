//! Bodies in STL files: what cannot be read is an error with its reason, what was read is an input of every result. Moves
//! of programs that meet a body are named.

use std::path::{Path, PathBuf};

use abbe::files::store::Store;
use abbe::files::{self, ReadOptions};
use abbe::plan::collision::clearances;
use abbe::plan::states;
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::suite::{abbe, text};

/// A plan with one sweep of C and one body in `body.stl`, in a folder.
fn plan(folder: &Path, stl: &[u8]) -> PathBuf {
    std::fs::write(folder.join("body.stl"), stl).unwrap();
    with_bodies(folder, "[[body]]\nname = \"block\"\naxis = \"Z\"\nstl = \"body.stl\"\n")
}

fn with_bodies(folder: &Path, bodies: &str) -> PathBuf {
    let machine = "name = \"M\"\nchain = \"w C b X Y Z t\"\naxis = { C = {}, X = {}, Y = {}, Z = {} }\n";
    std::fs::write(folder.join("machine.toml"), format!("{machine}{bodies}")).unwrap();
    let file = folder.join("plan.toml");
    let session = "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"ballbar\"\nnoise_um = 0.5\n[[test]]\n\
                   name = \"C100\"\nbar_mm = 125\nworkpiece_ball_mm = [0, 100, 0]\nspindle_ball_mm = [0, 0, 0]\n\
                   at = { z_mm = 75 }\nsweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 5, runs = 2 }\n";
    std::fs::write(&file, session).unwrap();
    file
}

/// The faces of the tetrahedron with corners at the origin of the body and 10 mm along X, Y and Z from it, seen
/// counterclockwise from outside, 100 mm above the spindle ball.
fn facets() -> Vec<[[f32; 3]; 3]> {
    let corner = |k: usize| -> [f32; 3] {
        std::array::from_fn(|i| if i + 1 == k { 10.0 } else { 0.0 } + if i == 2 { 100.0 } else { 0.0 })
    };
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].iter().map(|face| face.map(corner)).collect()
}

fn binary(header: &str, stated: u32, facets: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    bytes.resize(80, b' ');
    bytes.extend(stated.to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        bytes.extend(facet.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii(name: &str, facets: &[[[f32; 3]; 3]]) -> String {
    let mut text = format!("solid{name}\n");
    for facet in facets {
        text += "facet normal 0 0 1\nouter loop\n";
        facet.iter().for_each(|[x, y, z]| text += &format!("vertex {x} {y} {z}\n"));
        text += "endloop\nendfacet\n";
    }
    text + &format!("endsolid{name}\n")
}

fn least_mm(file: &Path) -> f64 {
    let complete = states::complete(&files::session(file, &ReadOptions::default()).unwrap(), true).unwrap();
    clearances(&complete)[0].clearance_mm
}

/// The bar of 10 mm radius ends in the spindle ball, 100 mm below the tetrahedron. Binary and ASCII files, with any
/// header, inside out or not, are the same surface.
#[test]
fn every_form_of_a_surface_is_read() {
    let (facets, flipped): (Vec<_>, Vec<_>) = facets().into_iter().map(|[a, b, c]| ([a, b, c], [a, c, b])).unzip();
    for contents in [
        binary("a table", 4, &facets),
        binary("solid table", 4, &facets),
        binary("", 4, &flipped),
        ascii(" table", &facets).into_bytes(),
        ascii("", &facets).into_bytes(),
        ascii(" table", &facets).replace('\n', "\r\n").into_bytes(),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let file = plan(folder.path(), &contents);
        let found = least_mm(&file);
        assert!((found - 90.0).abs() < 1e-9, "{found}");
        let run = abbe(&["plan", text(&file), "--no-effects", "--quiet"]);
        assert!(!String::from_utf8_lossy(&run.stderr).contains("closed"));
    }
}

#[test]
fn surfaces_that_cannot_be_used_are_errors() {
    let facets = facets();
    let mut infinite = facets.clone();
    infinite[2][1][0] = f32::NAN;
    let mut far = facets.clone();
    far[0][0][0] = 1e13;
    let whole = binary("", 4, &facets);
    let two = ascii(" a", &facets) + &ascii(" b", &facets);
    let text_of = ascii(" a", &facets);
    for (contents, expected) in [
        (Vec::new(), "is no STL file: it has 0 bytes"),
        (b"no surface".to_vec(), "is no STL file: it has 10 bytes"),
        (b"solid a\nendsolid a\n".to_vec(), "has no triangles"),
        (binary("", 0, &[]), "has no triangles"),
        (whole[..whole.len() - 7].to_vec(), "states 4 triangles, but ends in triangle 4"),
        (binary("", 3, &facets), "states 3 triangles, but has 200 bytes for them in place of 150"),
        (binary("", u32::MAX, &facets), "states 4294967295 triangles, but ends in triangle 5"),
        (binary("", 4, &infinite), "triangle 3 has the coordinate NaN"),
        (binary("", 4, &far), "triangle 1 has a coordinate that is 1e13, which is too large; the limit is 1 km"),
        (two.into_bytes(), "has 8 triangles in several solids, of which the first has 4"),
        (text_of.as_bytes()[..text_of.len() - 28].to_vec(), "triangle 4: EOF while expecting"),
        (text_of.replace("vertex 10 0 100", "vertex 10 zero 100").into_bytes(), "triangle 1: invalid float literal"),
        (text_of.replace("vertex 10 0 100", "vertex 10 nan 100").into_bytes(), "triangle 1: expected finite"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let file = plan(folder.path(), &contents);
        let run = abbe(&["plan", text(&file)]);
        let message = String::from_utf8_lossy(&run.stderr).replace('\n', " ");
        assert_eq!(run.status.code(), Some(1), "{expected}: {message}");
        assert!(message.contains(expected), "{expected}: {message}");
        assert!(message.contains("body.stl") && message.contains("machine.toml:"), "{message}");
    }
}

#[test]
fn a_file_that_is_large_missing_or_outside_is_an_error() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("session");
    std::fs::create_dir(&folder).unwrap();
    let file = plan(&folder, &[]);
    std::fs::File::create(folder.join("body.stl")).unwrap().set_len(300 << 20).unwrap();
    std::fs::write(place.path().join("outside.stl"), binary("", 4, &facets())).unwrap();
    let fails = |expected: &str| {
        let run = abbe(&["plan", text(&file)]);
        let message = String::from_utf8_lossy(&run.stderr).replace('\n', " ");
        assert_eq!(run.status.code(), Some(1), "{message}");
        assert!(message.contains(expected), "{expected}: {message}");
    };
    fails("has more than 67108864 bytes, which is the limit");
    for (name, expected) in [
        ("none.stl", "the STL file `none.stl` does not exist"),
        ("../outside.stl", "is outside the session's folder"),
        ("body.stl\"\nbox_mm = [[0, 0, 0], [1, 1, 1]] # \"", "has no shape, or two"),
    ] {
        with_bodies(&folder, &format!("[[body]]\nname = \"t\"\nstl = \"{name}\"\n"));
        fails(expected);
    }
}

/// An open surface has distances, and no inside.
#[test]
fn an_open_surface_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let file = plan(folder.path(), &binary("", 3, &facets()[1..]));
    let run = abbe(&["plan", text(&file), "--no-effects", "--quiet"]);
    let message = String::from_utf8_lossy(&run.stderr).replace('\n', " ");
    assert_eq!(run.status.code(), Some(0), "{message}");
    assert!(message.contains("body `block`: the surface of body.stl is not closed: 3 of its edges"), "{message}");
}

/// A surface is an input: results state its checksum, `run` computes again after a change, a copy of the session has it,
/// and a session in memory reads it.
#[test]
fn a_surface_is_an_input_of_the_session() {
    let folder = tempfile::tempdir().unwrap();
    let contents = binary("", 4, &facets());
    let file = plan(folder.path(), &contents);
    let [json, copy, records] = ["plan.json", "copy", "records"].map(|name| folder.path().join(name));
    let run = |arguments: &[&str]| {
        let output = abbe(arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    run(&["plan", text(&file), "--no-effects", "--quiet", "--json", text(&json)]);
    let found: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let sha256: String = Sha256::digest(&contents).iter().map(|byte| format!("{byte:02x}")).collect();
    assert!(found.to_string().contains(&sha256), "{found}");
    run(&["simulate", text(&file), "--out", text(&copy), "--quiet"]);
    assert_eq!(std::fs::read(copy.join("body.stl")).unwrap(), contents);
    let session = copy.join("session.toml");
    let keys = || -> Vec<String> {
        run(&["fleet", "run", text(&session), "--out", text(&records), "--no-trace", "--quiet"]);
        let mut names: Vec<String> = walk(&records).iter().map(|path| path.display().to_string()).collect();
        names.sort();
        names
    };
    let before = keys();
    assert_eq!(keys(), before);
    std::fs::write(copy.join("body.stl"), ascii(" other", &facets())).unwrap();
    assert_ne!(keys(), before);
    let texts = ["plan.toml", "machine.toml", "body.stl"];
    let store = Store::in_memory(texts.map(|name| (name, std::fs::read(folder.path().join(name)).unwrap())));
    let options = ReadOptions { store, ..ReadOptions::default() };
    let (session, sources) = files::session_with_sources(Path::new("plan.toml"), &options).unwrap();
    assert_eq!(session.machine.bodies.len(), 1);
    assert_eq!(sources.files.len(), 3);
}

/// All files of a folder.
fn walk(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}

/// A post of the bed, beside the measured path, stands where the spindle goes from the centring of the ball to the start.
/// With the overshoot of half a turn the ball is centred at Y = −100 mm.
/// A lid lies where the tool retreats to.
#[test]
fn moves_of_programs_that_meet_a_body_are_named() {
    let spindle = "[[body]]\nname = \"spindle\"\naxis = \"Z\"\n\
                   capsule = { from_mm = [0, 0, 90], to_mm = [0, 0, 300], radius_mm = 15 }\n";
    let post = "[[body]]\nname = \"post\"\nbox_mm = [[-10, -55, 200], [10, -45, 400]]\n";
    let lid = "[[body]]\nname = \"lid\"\nbox_mm = [[-10, -10, 420], [10, 10, 430]]\n";
    for (bodies, stages) in [
        (format!("{spindle}{post}"), &["approach"][..]),
        (format!("{spindle}{lid}"), &["approach", "retreat"]),
        (spindle.to_string(), &[]),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let file = with_bodies(folder.path(), &bodies);
        let [programs, sheets] = ["programs", "sheets.html"].map(|name| folder.path().join(name));
        for arguments in [
            &["nc", text(&file), "--control", "linuxcnc", "--out", text(&programs)][..],
            &["sheet", text(&file), "--out", text(&sheets)],
        ] {
            let run = abbe(arguments);
            let message = String::from_utf8_lossy(&run.stderr).replace('\n', " ");
            assert_eq!(run.status.code(), Some(0), "{message}");
            assert!(!message.contains("test \"C100\": spindle"), "{message}");
            for stage in ["approach", "centring", "feed-in", "overshoot", "feed-out", "retreat"] {
                let named = message.contains(&format!("warning: test \"C100\": {stage}: spindle and "));
                assert_eq!(named, stages.contains(&stage), "{stage}: {message}");
            }
        }
        let page = std::fs::read_to_string(&sheets).unwrap();
        assert_eq!(page.contains("approach: spindle and "), !stages.is_empty());
    }
}

/// Beyond the measured arc the bar goes on by the overshoot, and meets what stands beside the arc.
#[test]
fn an_overshoot_into_a_body_is_named() {
    let folder = tempfile::tempdir().unwrap();
    // The ball turns from −X over +Y to −Y; two degrees further it meets the pin.
    let pin = "[[body]]\nname = \"pin\"\ncapsule = { from_mm = [20, -93, 15], to_mm = [20, -93, 16], radius_mm = 5 }\n";
    let file = with_bodies(folder.path(), pin);
    let session = std::fs::read_to_string(&file).unwrap();
    let session = session.replace("from_deg = 0, to_deg = 360", "from_deg = 0, to_deg = 170");
    std::fs::write(&file, format!("{session}[clearance]\nleast_mm = 0\nbar_radius_mm = 6\n")).unwrap();
    let run = |overshoot: &str| {
        let programs = folder.path().join(overshoot);
        let arguments =
            ["nc", text(&file), "--control", "fanuc", "--out", text(&programs), "--overshoot-deg", overshoot];
        let run = abbe(&arguments);
        assert_eq!(run.status.code(), Some(0));
        String::from_utf8_lossy(&run.stderr).replace('\n', " ")
    };
    let [short, long] = ["1", "30"].map(run);
    assert!(!short.contains("pin"), "{short}");
    assert!(long.contains("warning: test \"C100\": overshoot: bar and pin collide"), "{long}");
}
