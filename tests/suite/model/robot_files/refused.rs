//! Files of robots that cannot be used: refused by name and line, with nothing written.

use super::{abbe, text, urdf};

/// The limit of axes is looked at before a chain is made, and elements that lie deep cost no more than others.
#[test]
fn the_size_of_a_file_does_not_matter_before_its_limit() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let refused = |option: &str, contents: &str, expected: &str| {
        let file = place.path().join("robot.csv");
        std::fs::write(&file, contents).unwrap();
        let began = std::time::Instant::now();
        let mut asked = vec!["new", text(&out), option, text(&file)];
        asked.extend(["--convention", "standard"].into_iter().filter(|_| option == "--from-dh"));
        let output = abbe(&asked);
        let found = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(output.status.code() == Some(1) && found.contains(expected), "{found}");
        assert!(began.elapsed().as_secs() < 20, "{option}: {:?}", began.elapsed());
    };
    let rows = "100,90,20,0\n".repeat(10_000);
    let table = format!("a_mm,alpha_deg,d_mm,theta_deg\n{rows}");
    refused("--from-dh", &table, "robot.csv:66: more than 64 joints, which is the limit of axes");
    let joint = |k: usize| {
        format!(
            "<link name=\"l{}\"/><joint name=\"j{k}\" type=\"revolute\"><parent link=\"l{k}\"/><child link=\"l{}\"/></joint>\n",
            k + 1,
            k + 1
        )
    };
    let chain: String = (0..10_000).map(joint).collect();
    refused(
        "--from-urdf",
        &format!("<robot name=\"r\"><link name=\"l0\"/>{chain}</robot>"),
        "a chain of 10000 joints; the limit is 64 axes",
    );
    let deep = format!("<robot name=\"r\">{}{}</robot>", "<a>".repeat(500_000), "</a>".repeat(500_000));
    refused("--from-urdf", &deep, "no movable joint");
}

#[test]
fn a_urdf_that_is_no_serial_chain_is_refused_with_the_reason() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let check = |name: &str, contents: &str, more: &[&str], expected: &str| {
        let file = place.path().join(name);
        std::fs::write(&file, contents).unwrap();
        let output = abbe(&[&["new", text(&out), "--from-urdf", text(&file)], more].concat());
        let found = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(!output.status.success() && found.contains(expected), "{name}: {found}");
        assert!(!out.exists(), "{name}: nothing is written");
    };
    let own = std::fs::read_to_string(urdf("ur5e")).unwrap();
    check("tip.urdf", &own, &["--tip", "tcp"], "there is no link `tcp`");
    check("x.xacro", "<robot xmlns:xacro=\"x\"><xacro:arg name=\"a\"/></robot>", &[], "this is a xacro file");
    check(
        "floating.urdf",
        &own.replacen("type=\"revolute\"", "type=\"floating\"", 1),
        &[],
        "joint `shoulder_pan_joint` is `floating`",
    );
    check("number.urdf", &own.replacen("0 0 0.1625", "0 zero 0.1625", 1), &[], "is not three numbers");
    check("cut.urdf", &own[..own.len() - 12], &[], "not valid XML");
    let (before, _) = own.rsplit_once("</robot>").unwrap();
    check("cut-between.urdf", before, &[], "the file ends within <robot>");
    let (before, _) = own.split_once("<limit").unwrap();
    check("cut-within.urdf", before, &[], "the file ends within <joint>");
    let at = |text: &str| own[..own.find(text).unwrap()].lines().count();
    check(
        "parents.urdf",
        &own.replacen("<child link=\"link_3\"", "<child link=\"link_1\"", 1),
        &[],
        "link `link_1` is behind joint `elbow_joint` and behind joint `shoulder_pan_joint`",
    );
    check(
        "parents.urdf",
        &own.replacen("<child link=\"link_3\"", "<child link=\"link_1\"", 1),
        &[],
        &format!("parents.urdf:{}", at("name=\"elbow_joint\"")),
    );
    check("parent.urdf", &own.replacen("<parent link=\"link_1\"", "<parent link=\"\"", 1), &[], "has no parent link");
    check(
        "misspelt.urdf",
        &own.replacen("<parent link=\"link_1\"", "<parent link=\"lnk_1\"", 1),
        &[],
        "did you mean `link_1`?",
    );
    let base = own.split("<link name=\"").nth(1).unwrap().split('"').next().unwrap();
    check("base.urdf", &own, &["--tip", base], "no joint moves link");
    check("far.urdf", &own.replacen("0 0 0.1625", "0 0 1e300", 1), &[], "is no length of a robot");
    let limits = own.find("lower=\"").unwrap();
    let ended = own[limits + 7..].find('"').unwrap() + limits + 7;
    let with = |limit: &str| format!("{}{limit}{}", &own[..limits + 7], &own[ended..]);
    check("limit.urdf", &with("-2pi"), &[], "`-2pi` is no limit of joint `shoulder_pan_joint`");
    check("limits.urdf", &with("9"), &[], "the lower limit of joint `shoulder_pan_joint` is above the upper one");
    check("other.xml", "<sdf><model/></sdf>", &[], "the first element is <sdf>, not <robot>");
}

/// A table, the arguments of the command, and what the message says.
#[test]
fn a_table_that_contradicts_itself_is_refused_by_name_and_line() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    for (table, expected) in [
        ("a_deg,alpha_deg,d_mm,theta_deg\n0,90,100,q1\n", "the unit of column `a_deg` is one of angle"),
        ("a_mm,alpha_grad,d_mm,theta_deg\n0,90,100,q1\n", "grad may be a degree or a gon"),
        ("a_mm,alpha_deg,d_mm,theta_deg,a_m\n0,90,100,q1,0\n", "columns `a_mm` and `a_m` are both `a`"),
        ("a_mm,alpha_deg,d_mm,theta_deg\n0,q1,100,0\n", "robot.csv:2: `q1` in column `alpha` moves"),
        ("a_mm,alpha_deg,d_mm,theta_deg\n0,90,100,q1\nq2,0,0,0\n", "robot.csv:3: `q2` in column `a` moves"),
        ("a_mm,alpha_deg,d_mm,theta_deg,type\n0,90,q1,0,revolute\n", "`q1` in column `d` moves"),
        ("a_mm,alpha_deg,d_mm,theta_deg\npi/2,90,100,q1\n", "robot.csv:2: `a` of joint `1` is no length"),
        ("a_mm,alpha_deg,d_mm,theta_deg\nnan,90,100,q1\n", "`nan` in column `a` is no value"),
        ("a_mm,alpha_deg,d_mm,theta_deg\n1e300,90,100,q1\n", "robot.csv:2: `a` of joint `1` is 1e300 mm"),
        ("a_mm,alpha_deg,d_mm,theta_deg,lower_mm,upper_mm\n0,90,100,q1,-10,10\n", "`lower` of joint `1` is no angle"),
        (
            "joint,a_mm,alpha_deg,d_mm,theta_deg,lower_deg,upper_deg\nbase,0,90,100,q1,170,-170\n",
            "robot.csv:2: the lower limit of joint `base` is above the upper one",
        ),
    ] {
        let file = place.path().join("robot.csv");
        std::fs::write(&file, table).unwrap();
        let output = abbe(&["new", text(&out), "--from-dh", text(&file), "--convention", "standard"]);
        let found = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(!output.status.success() && found.contains(expected), "{table}{found}");
        assert!(!out.exists(), "{table}: nothing is written");
    }
}

/// Sockets that a robot cannot reach in several poses have no plan.
#[test]
fn sockets_beyond_the_reach_of_poses_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let (file, out) = (place.path().join("robot.csv"), place.path().join("out"));
    std::fs::write(&file, "a_mm,alpha_deg,d_mm,theta_deg\n0,90,162.5,0\n-425,0,0,0\n").unwrap();
    let asked = ["new", text(&out), "--from-dh", text(&file), "--convention", "standard", "--measured-by", "sockets"];
    let output = abbe(&asked);
    let found = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        !output.status.success() && found.contains("nothing is written, because `abbe plan` would refuse"),
        "{found}"
    );
    assert!(!out.exists());
}
