//! Units and limits of tables, and machines whose joints hardly move. Expected numbers are written by hand.

use std::f64::consts::PI;

use super::{abbe, created, success, text, urdf};

#[test]
fn parameters_are_read_in_the_units_of_their_columns() {
    let place = tempfile::tempdir().unwrap();
    // The same arm in eight ways: 254 mm up, a quarter turn about X; 508 mm along X, offset by 30 degrees.
    for (number, table) in [
        "a_mm,alpha_deg,d_mm,theta_deg\n0,90,254,q1\n508,0,0,q2 + 30\n",
        "a_um,alpha_gon,d_um,theta_gon\n0,100,254000,q1\n508000,0,0,q2 + 33.333333333333333\n",
        "a_mil,alpha_mrad,d_mil,theta_mrad\n0,1570.7963267948966,10000,q1\n20000,0,0,q2 + 523.5987755982989\n",
        "a_in,alpha_arcmin,d_in,theta_arcsec\n0,5400,10,q1\n20,0,0,q2 + 108000\n",
        "a_cm,alpha_rad,d_m,theta_deg\n0,1.5707963267948966,0.254,q1\n50.8,0,0,q2 + 30\n",
        // Offsets in a column of their own, and terms in two units.
        "a_mm,alpha_deg,d_mm,theta_deg,offset_rad\n0,90,254,q1,0\n508,0,0,q2 + 12,0.3141592653589793\n",
        "a_mm,alpha_deg,d_mm,theta_deg\n0,pi/2,254,q1\n508,0,0,q2 + pi/2 - 60\n",
        "a,alpha,d,theta\n0,90°,254,q1\n508,0,0,q2 + 30°\n",
    ]
    .iter()
    .enumerate()
    {
        let file = place.path().join("robot.csv");
        std::fs::write(&file, table).unwrap();
        let name = format!("m{number}");
        let asked = ["--from-dh", text(&file), "--convention", "standard"];
        let (machine, folder) = created(place.path(), &name, &asked);
        assert!((machine.axes[1].origin_mm[2] - 254.0).abs() < 1e-6, "{table}{:?}", machine.axes[1]);
        assert!((machine.axes[1].direction[1] + 1.0).abs() < 1e-9, "{table}{:?}", machine.axes[1]);
        let flange = super::target_mm(&folder);
        let expected = [508.0 * (PI / 6.0).cos(), 0.0, 254.0 + 508.0 * (PI / 6.0).sin()];
        assert!((0..3).all(|k| (flange[k] - expected[k]).abs() < 1e-5), "{table}{flange:?}");
    }
}

/// Files of other programs are in their encodings: UTF-16 with a mark, Latin-1 as the XML declaration says or by its bytes.
#[test]
fn files_of_robots_are_read_in_their_encodings() {
    let place = tempfile::tempdir().unwrap();
    let utf_16 = |text: &str| -> Vec<u8> {
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
    };
    let latin_1 = |text: &str| -> Vec<u8> { text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect() };
    let own = std::fs::read_to_string(urdf("ur5e")).unwrap();
    let own = own.split_once("?>").map_or(own.as_str(), |(_, rest)| rest).trim_start();
    let own = own.replacen("<robot", "<!-- Gelenk für Gelenk -->\n<robot", 1);
    let of = |encoding: &str| format!("<?xml version=\"1.0\" encoding=\"{encoding}\"?>\n{own}");
    let table = "joint,a_mm,alpha_deg,d_mm,theta_deg\nGrundgelenk für J1,0,90,254,q1\nzwei,508,0,0,q2\n";
    let mut machines = Vec::new();
    for (number, (option, contents)) in [
        ("--from-urdf", of("UTF-8").into_bytes()),
        ("--from-urdf", utf_16(&of("UTF-16"))),
        ("--from-urdf", latin_1(&of("ISO-8859-1"))),
        ("--from-urdf", latin_1(&own)),
        ("--from-dh", table.as_bytes().to_vec()),
        ("--from-dh", utf_16(table)),
        ("--from-dh", latin_1(table)),
    ]
    .into_iter()
    .enumerate()
    {
        let file = place.path().join("robot");
        std::fs::write(&file, contents).unwrap();
        let mut asked = vec![option, text(&file)];
        asked.extend(["--convention", "standard"].into_iter().filter(|_| option == "--from-dh"));
        let (_, folder) = created(place.path(), &format!("e{number}"), &asked);
        machines.push(std::fs::read_to_string(folder.join("machine.toml")).unwrap());
    }
    assert!(machines[..4].iter().all(|machine| *machine == machines[0]));
    assert!(machines[4..].iter().all(|machine| *machine == machines[4]));
    assert!(machines[4].contains("Grundgelenk für J1"), "{}", machines[4]);
}

/// A blank cell is 0 with a warning that names its line; the blank of a variable is none, unless other joints have numbers.
#[test]
fn a_blank_cell_is_told() {
    let place = tempfile::tempdir().unwrap();
    let said = |name: &str, table: &str| {
        let file = place.path().join("robot.csv");
        std::fs::write(&file, table).unwrap();
        let output = abbe(&[
            "new",
            text(&place.path().join(name)),
            "--from-dh",
            text(&file),
            "--convention",
            "standard",
            "--quiet",
        ]);
        success(&output);
        String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let blank = said("a", "a_mm,alpha_deg,d_mm,theta_deg\n0,90,254,\n508,,,\n");
    assert!(blank.contains("robot.csv:3: `alpha`, `d` of joint `2` is empty: 0") && !blank.contains(":2:"), "{blank}");
    let variable = said("b", "a_mm,alpha_deg,d_mm,theta_deg\n0,90,254,30\n508,0,0,\n");
    assert!(variable.contains("robot.csv:3: `theta` of joint `2` is empty: 0"), "{variable}");
    let whole = said("c", "a_mm,alpha_deg,d_mm,theta_deg\n0,90,254,q1\n508,0,0,q2\n");
    assert!(!whole.contains("is empty"), "{whole}");
}

#[test]
fn limits_are_kept_or_named() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("robot.csv");
    let table = "joint,type,a_mm,alpha_deg,d_mm,theta_deg,lower,upper\n\
                 one,R,0,90,254,0,-2.5,2.5\n\
                 two,R,508,0,0,0,-1,\n\
                 three,P,0,0,q3,0,10,10\n\
                 four,P,0,0,q4,0,0,180\n";
    std::fs::write(&file, table).unwrap();
    let folder = place.path().join("out");
    let output = abbe(&["new", text(&folder), "--from-dh", text(&file), "--convention", "standard"]);
    let said = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    success(&output);
    for expected in [
        "the unit of the limits of rotary joints is not stated: rad",
        "joint `two` states one limit only: its travel is open",
        "joint `three` states equal limits: its travel is open",
    ] {
        assert!(said.contains(expected), "{expected}: {said}");
    }
    let machine = abbe::files::machine(&folder.join("machine.toml")).unwrap();
    let travels: Vec<Option<[f64; 2]>> = machine.axes.iter().map(|axis| axis.travel).collect();
    assert_eq!(travels[1..], [None, None, Some([0.0, 180.0])]);
    assert!((travels[0].unwrap()[1] - 2.5).abs() < 1e-12);
    assert_eq!(machine.axes[1].joint.as_deref(), Some("two"));

    // A joint of a URDF that cannot move between its limits.
    let own = std::fs::read_to_string(urdf("ur5e")).unwrap();
    let start = own.find("<limit").unwrap();
    let end = start + own[start..].find('>').unwrap() + 1;
    let file = place.path().join("still.urdf");
    let still = format!("{}<limit lower=\"0\" upper=\"0\" effort=\"1\" velocity=\"1\"/>{}", &own[..start], &own[end..]);
    std::fs::write(&file, still).unwrap();
    let output = abbe(&["new", text(&place.path().join("still")), "--from-urdf", text(&file)]);
    let said = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    success(&output);
    assert!(said.contains("joint `shoulder_pan_joint` states limits between which it cannot move"), "{said}");
}

/// Every plan that is written can be analysed.
#[test]
fn a_joint_that_hardly_moves_has_a_plan() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("robot.csv");
    for (number, upper) in ["0.3", "1.5", "1500"].into_iter().enumerate() {
        let table = format!(
            "type,a_mm,alpha_deg,d_mm,theta_deg,lower_mm,upper_mm\nR,300,0,190,0,,\nR,250,180,0,0,,\nP,0,0,q3,0,0,{upper}\n"
        );
        std::fs::write(&file, table).unwrap();
        let asked = ["--from-dh", text(&file), "--convention", "standard", "--target-mm", "10,20,30"];
        let (_, folder) = created(place.path(), &format!("p{number}"), &asked);
        success(&abbe(&["plan", text(&folder.join("plan.toml")), "--no-effects", "--quiet"]));
    }
}

/// What URDF files of makers contain and other programs load: an axis of length zero of a joint that does not move, the
/// word xacro, limits that no joint reaches, limits that rounding passes, fingers behind the flange, and a call of xacro.
#[test]
fn what_other_programs_load_is_loaded() {
    let place = tempfile::tempdir().unwrap();
    let load = |number: usize, joints: &str| {
        let mut links: Vec<&str> =
            joints.split("link=\"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
        links.sort_unstable();
        links.dedup();
        let links: String = links.iter().map(|link| format!("<link name=\"{link}\"/>")).collect();
        let file = place.path().join(format!("{number}.urdf"));
        std::fs::write(&file, format!("<robot name=\"r\">{links}{joints}</robot>")).unwrap();
        let folder = place.path().join(format!("r{number}"));
        let output = abbe(&["new", text(&folder), "--from-urdf", text(&file)]);
        success(&output);
        success(&abbe(&["plan", text(&folder.join("plan.toml")), "--no-effects", "--quiet"]));
        let said = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        (said, abbe::files::machine(&folder.join("machine.toml")).unwrap())
    };
    let joint = |kind: &str, from: &str, to: &str, more: &str| {
        format!(
            "<joint name=\"{to}\" type=\"{kind}\"><parent link=\"{from}\"/><child link=\"{to}\"/>\
             <origin xyz=\"0.3 0 0.1\"/>{more}</joint>"
        )
    };
    let turns = |from: &str, to: &str, axis: &str, lower: &str, upper: &str| {
        let limit =
            format!("<axis xyz=\"{axis}\"/><limit lower=\"{lower}\" upper=\"{upper}\" effort=\"1\" velocity=\"1\"/>");
        joint("revolute", from, to, &limit)
    };
    let arm = turns("base", "l1", "0 0 1", "-1", "1") + &turns("l1", "l2", "0 1 0", "-2.6", "-0.60000133");

    let still = joint("fixed", "l2", "l3", "<axis xyz=\"0 0 0\"/>");
    let (said, machine) = load(0, &(arm.clone() + &still + "<!-- written by <xacro:macro> -->"));
    assert_eq!((said.as_str(), machine.axes.len()), ("", 2));
    let (said, machine) = load(1, &turns("base", "l1", "0 0 1", "-1e16", "1e16"));
    assert!(said.contains("joint `l1` states limits that no joint reaches: its travel is open"), "{said}");
    assert_eq!(machine.axes[0].travel, None);

    // Two fingers of one joint each behind an arm of two.
    let fingers = turns("l2", "f1", "1 0 0", "0", "1") + &turns("l2", "f2", "1 0 0", "0", "1");
    let (said, machine) = load(2, &(arm.clone() + &fingers));
    assert!(said.contains("the arm ends at link `l2`, where it forks"), "{said}");
    assert_eq!(machine.axes.len(), 2);

    let call = "\n<xacro:gripper parent=\"l2\"/>";
    let (said, _) = load(3, &(arm + call));
    assert!(said.contains("<xacro:gripper> on line 2 is a program of xacro and was not run"), "{said}");
}
