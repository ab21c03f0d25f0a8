//! Tests of the command and of the library, one file per subject.

mod another_build;
mod bad_input;
mod bodies;
mod certificate;
mod channels;
mod circular;
mod claims;
mod closed_loop;
mod codes;
mod collision;
mod compare_figures;
mod compensation;
mod conformity;
mod conformity_set_up;
mod conformity_shares;
mod design_bound;
mod doors;
mod early_returns;
mod effect_description;
mod equation_command;
mod equation_effects;
mod examples;
mod faults;
mod field_files;
mod first_screen;
mod fleet;
mod fleet_conformity;
mod fleet_history;
mod fleet_study;
mod generated;
mod geometric;
mod help;
mod history_figures;
mod import;
mod input_checksums;
mod interrupted;
mod json_document;
mod json_page;
mod kept;
mod keys_page;
mod kill;
mod left_out_test;
mod limits;
mod long_input;
mod measured;
mod messages;
mod model_commands;
mod mutated_inputs;
mod nc;
mod new;
mod next_session;
mod nist;
mod one_answer;
mod paper;
mod patterns;
mod plan_command;
mod plan_figures;
mod plan_help;
mod plan_instruments;
mod plan_methods;
mod plan_next;
mod plan_powers;
mod plan_rank;
mod plan_uncertainty;
mod plausibility;
mod pointing;
mod poses;
mod poses_in_contact;
mod propagation;
mod properties;
mod recovery;
mod repeatability;
mod repeated;
mod report;
mod report_browser;
mod robot_files;
mod robots;
mod rtest;
mod rtest_command;
mod rtest_findings;
mod safe_plans;
mod schema;
mod schema_limits;
mod self_calibration;
mod sheet;
mod simulate;
mod standard_output;
mod statements;
mod supply_chain;
mod targets;
#[path = "../../model/tests/jacobians/topologies.rs"]
mod topologies;
mod tour;
mod trace;
mod trace_reported;
mod tracker_blunders;
mod unknowns;
mod validate_command;
mod volumetric;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The workspace.
pub fn workspace() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A ready session of the workspace.
pub fn ready(name: &str) -> PathBuf {
    workspace().join("sessions").join(name)
}

/// Runs the command `abbe`.
pub fn abbe(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_abbe")).args(arguments).output().expect("the command starts")
}

/// A path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().expect("a path of plain letters")
}
