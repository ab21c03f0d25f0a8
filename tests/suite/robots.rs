//! Real measurements: a UR10 before a laser tracker, a KUKA iiwa 14 whose ball sits in sockets.

use abbe::identify::fit::{prepare, report};
use abbe::identify::results::FitResult;
use abbe::model::files::{self, ReadOptions};
use abbe::model::session::Session;

use super::data::data;
use super::ready;

/// The session with public data, or `None` without the data.
pub fn session_on_public_data(test: &str, name: &str, path: &str) -> Option<Session> {
    let found = data(test, path)?;
    let depth = path.split('/').count();
    let folder = found.ancestors().nth(depth)?.to_path_buf();
    let options = ReadOptions { data_directory: Some(folder), ..ReadOptions::default() };
    Some(files::session(&ready(name), &options).unwrap())
}

fn fitted(session: &Session) -> FitResult {
    let (problem, fit) = prepare(session, 1).unwrap();
    report(&problem, &fit).unwrap()
}

#[test]
fn ur10_with_pose_and_target_only() {
    let name = "ur10_with_pose_and_target_only";
    let Some(mut session) = session_on_public_data(name, "ur10/session.toml", "landgraf_ur10") else {
        return;
    };
    session.unknowns.clear();
    let result = fitted(&session);
    let held_out = result.heldout_rms_3d_um.unwrap() * 1e-3;
    println!("UR10, pose and target: {held_out:.4} mm held out");
    assert!((0.83..0.85).contains(&held_out), "{held_out}");
    assert_eq!((result.parameter_count, result.rank), (9, 9));
}

#[test]
fn ur10_with_every_location_error() {
    let name = "ur10_with_every_location_error";
    let Some(session) = session_on_public_data(name, "ur10/session.toml", "landgraf_ur10") else {
        return;
    };
    let result = fitted(&session);
    let held_out = result.heldout_rms_3d_um.unwrap() * 1e-3;
    println!(
        "UR10, all location errors: {held_out:.4} mm held out, rank {} of {}",
        result.rank, result.parameter_count
    );
    assert!(held_out <= 0.44, "{held_out}");
    assert_eq!((result.rank, result.parameter_count), (25, 45));
    assert_eq!(result.unobservable.len(), 20);
    // Parameters that are not identifiable are named and have no value.
    for unobservable in &result.unobservable {
        assert!(!unobservable.combination.is_empty() && !unobservable.why.is_empty());
        for parameter in &result.parameters {
            assert!(!unobservable.combination.contains_key(&parameter.id), "{}", parameter.id);
        }
    }
}

#[test]
fn kuka_is_fitted_and_two_badly_seated_poses_are_outliers() {
    let name = "kuka_is_fitted_and_two_badly_seated_poses_are_outliers";
    let Some(session) = session_on_public_data(name, "kuka-iiwa14/session.toml", "mukca") else {
        return;
    };
    let result = fitted(&session);
    let held_out = result.heldout_rms_3d_um.unwrap() * 1e-3;
    println!("KUKA: {held_out:.4} mm held out; outliers: {:?}", result.outliers);
    assert!(held_out <= 0.25, "{held_out}");
    assert_eq!(result.outliers.len(), 2, "{:?}", result.outliers);
}

#[test]
fn kuka_with_ball_and_sockets_only() {
    let name = "kuka_with_ball_and_sockets_only";
    let Some(mut session) = session_on_public_data(name, "kuka-iiwa14/session.toml", "mukca") else {
        return;
    };
    session.unknowns.clear();
    let result = fitted(&session);
    let in_sample = result.rms_3d_um.unwrap() * 1e-3;
    println!("KUKA, ball and sockets: {in_sample:.4} mm in sample");
    assert!((0.53..0.57).contains(&in_sample), "{in_sample}");
}
