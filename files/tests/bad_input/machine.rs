//! Tests of machines: the chain and its axes.

use super::{DATA, MACHINE, SESSION, assert_contains, error_text, session, with_machine};

#[test]
fn a_chain_without_its_bed() {
    assert_contains(&with_machine("w C A b Y X Z t", "w C A Y X Z t"), &["machine.toml:2", "0 beds `b`"]);
}

#[test]
fn an_axis_without_table_and_a_table_without_axis() {
    assert_contains(
        &with_machine("[axis.Z]\n", ""),
        &["machine.toml:2", "axis `Z` of the chain", "has no table", "add [axis.Z]"],
    );
    assert_contains(
        &with_machine("[axis.Z]\n", "[axis.Z]\n[axis.B]\n"),
        &["machine.toml:13", "axis `B` is not in the chain"],
    );
    assert_contains(&with_machine("w C A b Y X Z t", "w C A b Y X Z Q1 t"), &["axis `Q1` of the chain"]);
}

#[test]
fn an_axis_of_unknown_kind() {
    let machine = MACHINE.replace("X Z t", "X Q1 t").replace("[axis.Z]", "[axis.Q1]");
    assert_contains(
        &error_text(session(&machine, SESSION, Some(DATA))),
        &["machine.toml:12", "axis `Q1`", "has no `kind`"],
    );
}
