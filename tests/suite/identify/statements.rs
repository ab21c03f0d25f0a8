//! What to correct: the opening of a result counts every kind of estimate. The sessions are of a planar arm whose readings are
//! two cosines, written here.

use std::fmt::Write;

use crate::suite::{abbe, text};

/// Lengths of the links, mm.
const LINKS_MM: [f64; 2] = [300.0, 200.0];

/// The session of a planar arm before a tracker in the frame of the base. `zero_deg` is the error of the second joint's zero,
/// `waves_um` the
/// amplitudes of motions of the first joint's axis, along X twice per turn and along Y three times.
fn session(folder: &std::path::Path, zero_deg: f64, waves_um: [f64; 2], declared: &str) -> std::path::PathBuf {
    let machine = format!(
        "name = \"Arm\"\nchain = \"w b J1 J2 t\"\n\n[axis.J1]\nkind = \"rotary\"\ndirection = [0, 0, 1]\n\n\
         [axis.J2]\nkind = \"rotary\"\ndirection = [0, 0, -1]\norigin_mm = [{}, 0, 0]\n",
        LINKS_MM[0]
    );
    std::fs::write(folder.join("machine.toml"), machine).unwrap();
    let mut table = "j1_deg,j2_deg,px_mm,py_mm,pz_mm\n".to_string();
    let mut noise = 12345_u64;
    let mut drawn = || {
        // The sum of twelve even numbers: a deviation of 1.
        let even = || {
            noise = noise.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (noise >> 11) as f64 / (1_u64 << 53) as f64
        };
        std::iter::repeat_with(even).take(12).sum::<f64>() - 6.0
    };
    for row in 0..90 {
        let (first, second) = (f64::from(row * 37 % 360) - 180.0, f64::from(row * 53 % 200) - 100.0);
        let a = first.to_radians();
        // The second joint turns about −Z.
        let b = a - (second + zero_deg).to_radians();
        let [along_x, along_y] = [waves_um[0] * (2.0 * a).cos(), waves_um[1] * (3.0 * a).cos()].map(|um| um * 1e-3);
        let x = LINKS_MM[0] * a.cos() + LINKS_MM[1] * b.cos() + along_x;
        let y = LINKS_MM[0] * a.sin() + LINKS_MM[1] * b.sin() + along_y;
        let [u, v, w] = [drawn(), drawn(), drawn()].map(|one| one * 0.01);
        let _ = writeln!(table, "{first},{second},{},{},{}", x + u, y + v, w);
    }
    std::fs::write(folder.join("poses.csv"), table).unwrap();
    let session = format!(
        "[machine]\nfile = \"machine.toml\"\n\n[instrument]\nkind = \"tracker\"\nnoise_um = 10\n\n\
         [unknowns]\nerrors = [\"EC0J2\"]\n\n{declared}\n[[test]]\nname = \"poses\"\ndata = \"poses.csv\"\n\
         target_mm = [{}, 0, 0]\n",
        LINKS_MM[0] + LINKS_MM[1]
    );
    let file = folder.join("session.toml");
    std::fs::write(&file, session).unwrap();
    file
}

/// The sentence of a fit on what to correct, and its JSON.
fn what_to_correct(session: &std::path::Path) -> (String, serde_json::Value) {
    let json = session.with_file_name("fit.json");
    let output = abbe(&["fit", text(session), "--json", text(&json)]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let screen = String::from_utf8(output.stdout).unwrap();
    let line = screen.lines().find(|line| line.contains("What to correct")).unwrap();
    (line.replace('−', "-"), serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap())
}

/// The zero angle of a joint that turns about −Z counts in its own direction, as an entry of the controller does.
#[test]
fn a_joint_zero_is_a_correction() {
    let folder = tempfile::tempdir().unwrap();
    let (line, fit) = what_to_correct(&session(folder.path(), 0.05, [0.0; 2], ""));
    let change = &fit["statements"]["correct"][0];
    let [value, u] = ["change", "u"].map(|key| change[key].as_f64().unwrap());
    assert_eq!((change["quantity"].as_str(), change["axis"].as_str()), (Some("zero"), Some("J2")), "{fit}");
    assert!((value - 180.0).abs() < 4.0 * u && u < 5.0, "{change}");
    assert!((change["identified"].as_f64().unwrap() * 3600.0 - value).abs() < 1e-9, "{change}");
    assert!(line.contains("zero of J2 18") || line.contains("zero of J2 17"), "{line}");
    // Within its uncertainty it is none.
    let (line, _) = what_to_correct(&session(folder.path(), 0.0, [0.0; 2], ""));
    assert!(line.contains("nothing; no axis deviates"), "{line}");
}

/// A declared effect that exceeds its uncertainty is named beside the axes, one that does not is not.
#[test]
fn an_effect_is_a_correction() {
    let folder = tempfile::tempdir().unwrap();
    let declared = "[[effect]]\ncomponent = \"EXJ1\"\ndriver = \"J1\"\nshape = \"harmonic\"\norder = 2\n";
    let (line, fit) = what_to_correct(&session(folder.path(), 0.0, [60.0, 0.0], declared));
    let named = &fit["statements"]["further"];
    assert_eq!(named.as_array().unwrap().len(), 1, "{named}");
    assert!(named[0]["id"].as_str().unwrap().starts_with("EXJ1~J1:h2"), "{named}");
    assert!(line.contains("EXJ1~J1:h2"), "{line}");
    let (line, fit) = what_to_correct(&session(folder.path(), 0.0, [0.0; 2], declared));
    assert!(fit["statements"].get("further").is_none() && !line.contains("EXJ1"), "{line}");
}

/// Every effect that exceeds its uncertainty is a correction of its own, with its amplitude and without its phase.
#[test]
fn each_effect_is_one_correction() {
    let folder = tempfile::tempdir().unwrap();
    let effect = |component: &str, order: usize| {
        format!("[[effect]]\ncomponent = \"{component}\"\ndriver = \"J1\"\nshape = \"harmonic\"\norder = {order}\n\n")
    };
    let declared = effect("EXJ1", 2) + &effect("EYJ1", 3) + &effect("EZJ1", 4);
    let (_, fit) = what_to_correct(&session(folder.path(), 0.0, [60.0, 40.0], &declared));
    let named = fit["statements"]["further"].as_array().unwrap();
    assert_eq!(named.len(), 2, "{named:?}");
    for (item, (id, amplitude_um)) in named.iter().zip([("EXJ1~J1:h2", 60.0), ("EYJ1~J1:h3", 40.0)]) {
        let [value, u] = ["value", "u"].map(|key| item[key].as_f64().unwrap());
        assert!(item["id"].as_str().unwrap().starts_with(id), "{named:?}");
        assert!((value - amplitude_um).abs() < 4.0 * u && u < 5.0, "{named:?}");
    }
}
