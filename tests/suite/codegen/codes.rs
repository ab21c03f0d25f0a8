//! Structural codes: accepted forms, and the messages for invalid codes.

use abbe::model::chain::Machine;
use abbe::model::code::StructuralCode;

use crate::suite::plan::topologies::{FIGURE_1_1, TABLE_1_1};

#[test]
fn the_codes_of_the_thesis_read_in_both_forms() {
    for code in TABLE_1_1.iter().chain(&FIGURE_1_1) {
        let compact = StructuralCode::parse(code).unwrap();
        assert_eq!(compact.axes().count(), 5, "{code}");
        let spaced = compact.spaced();
        assert_eq!(StructuralCode::parse(&spaced).unwrap(), compact, "{code}");
        assert_eq!(spaced.replace(' ', ""), code.trim_matches(['[', ']']));
        let machine = Machine::from_code(code).unwrap();
        assert_eq!(machine.code(), spaced);
        assert_eq!(machine.workpiece_side, compact.workpiece_side.len());
    }
}

#[test]
fn sides_are_from_the_workpiece_and_from_the_bed() {
    let code = StructuralCode::parse("[wCAbYXZt]").unwrap();
    assert_eq!(code.workpiece_side, ["C", "A"]);
    assert_eq!(code.tool_side, ["Y", "X", "Z"]);
    let robot = StructuralCode::parse("w b J1 J2 J3 J4 J5 J6 t").unwrap();
    assert!(robot.workpiece_side.is_empty());
    assert_eq!(robot.tool_side.len(), 6);
    // Only a bed between workpiece and tool: a machine without axes.
    assert_eq!(StructuralCode::parse("wbt").unwrap().axes().count(), 0);
}

#[test]
fn invalid_codes_are_refused_with_the_reason() {
    for (code, message) in [
        ("", "does not start with the workpiece"),
        ("C A b Y X Z t", "does not start with the workpiece"),
        ("w C A b Y X Z", "does not end with the tool"),
        ("w", "does not end with the tool"),
        ("w C A Y X Z t", "it contains 0 beds"),
        ("w C b A b Y t", "it contains 2 beds"),
        ("w C C b Y t", "`C` occurs twice"),
        ("[wBAXYbZABBt]", "occurs twice"),
        ("w C w b Y t", "`w` is not an axis name"),
        ("w 1 b Y t", "`1` is not an axis name"),
        ("w C-1 b Y t", "`C-1` is not an axis name"),
    ] {
        let stderr = StructuralCode::parse(code).unwrap_err().to_string();
        assert!(stderr.contains(message), "{code}: {stderr}");
        assert!(stderr.contains("as in `w C A b Y X Z t`"), "{stderr}");
    }
    let stderr = Machine::from_code("w b J1 t").unwrap_err().to_string();
    assert!(stderr.contains("axis `J1` is not an ISO 841 letter"), "{stderr}");
}
