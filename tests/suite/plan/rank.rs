//! Rank and identifiability of tests against an independent calculation.

use crate::suite::plan::help::{linearised, machine, session};

const D: f64 = 111.803;

fn head(errors: &str) -> String {
    let unknowns = if errors.is_empty() { String::new() } else { format!("[unknowns]\nerrors = [{errors}]\n") };
    let machine = machine("w C A b Y X Z t", None);
    format!("{machine}\n[instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n{unknowns}")
}

/// A sweep with an exactly known set-up: the bar length is the distance of the balls.
fn known(name: &str, axis: &str, ball: [f64; 3], spindle: [f64; 3]) -> String {
    let [from, to] = if axis == "A" { [-20, 70] } else { [0, 360] };
    let apart: f64 = (0..3).map(|i| (ball[i] - spindle[i]).powi(2)).sum::<f64>().sqrt();
    format!(
        "[[test]]\nname = \"{name}\"\nbar_mm = {apart}\nworkpiece_ball_mm = {ball:?}\nspindle_ball_mm = {spindle:?}\nsetup = \"P1\"\n\
         sweep = {{ axis = \"{axis}\", from_deg = {from}, to_deg = {to}, step_deg = 2, runs = 1, both_directions = true }}\n"
    )
}

/// Rank of the eight PIGEs with the spindle ball at the given positions in A and C sweeps.
fn rank(height: f64, spindles: &[(&str, [f64; 3])]) -> (usize, Vec<String>) {
    let mut text = head("");
    for (number, (axis, spindle)) in spindles.iter().enumerate() {
        text.push_str(&known(&format!("{axis}{number}"), axis, [0.0, 100.0, height], *spindle));
    }
    let (ids, linear) = linearised(&session(&text));
    let not_identifiable =
        ids.iter().enumerate().filter(|(j, _)| !linear.rank.is_identifiable(*j)).map(|(_, id)| id.clone());
    (linear.rank.identifiable_basis.ncols(), not_identifiable.collect())
}

#[test]
fn the_eight_errors_have_rank_six_seven_and_eight() {
    let side = [-D, 0.0, 0.0];
    let four = [("A", [0.0; 3]), ("A", side), ("C", [0.0; 3]), ("C", side)];
    let (flat, not_identifiable) = rank(0.0, &four);
    assert_eq!(flat, 6, "{not_identifiable:?}");
    assert!(
        not_identifiable.contains(&"EA0C".to_string()) && not_identifiable.contains(&"EB0C".to_string()),
        "{not_identifiable:?}"
    );
    let (high, not_identifiable) = rank(50.0, &four);
    assert_eq!((high, not_identifiable), (7, vec!["EA0C".to_string()]));
    let mut five = four.to_vec();
    five.push(("C", [0.0, 0.0, D]));
    assert_eq!(rank(50.0, &five), (8, Vec::new()));
}

/// PDGEs of C of orders 1 to 3 in one test at one radius and one height, with free set-ups and radial, tangential and
/// axial readings: rank, number of parameters, and the coefficients that are identifiable individually.
fn individually_identifiable(orders: std::ops::RangeInclusive<usize>) -> (usize, usize, Vec<String>) {
    let mut text = head("\"EX0C\", \"EY0C\", \"EA0C\", \"EB0C\"");
    for offset in ["radial", "tangential", "axial"] {
        text.push_str(&format!(
            "[[test]]\nname = \"{offset}\"\nbar_mm = 100\nworkpiece_ball_mm = [0, 100, 50]\nspindle_ball_mm = [0, 0, 0]\nsetup = \"P1\"\n\
             workpiece_ball_u_um = [inf, inf, inf]\nspindle_ball_u_um = [inf, inf, inf]\nspindle_setup = \"S\"\nbar_u_um = inf\nbar_setup = \"B\"\n\
             path = {{ kind = \"follow\", axis = \"C\", offset = \"{offset}\", from_deg = 0, to_deg = 360, step_deg = 2, runs = 1, both_directions = true }}\n"
        ));
    }
    for component in ["EXC", "EYC", "EZC", "EAC", "EBC", "ECC"] {
        for order in orders.clone() {
            text.push_str(&format!(
                "[[effect]]\ncomponent = \"{component}\"\ndriver = \"C\"\nshape = \"harmonic\"\norder = {order}\n"
            ));
        }
    }
    let (ids, linear) = linearised(&session(&text));
    let identifiable =
        ids.iter().enumerate().filter(|(j, _)| linear.rank.is_identifiable(*j)).map(|(_, id)| id.clone()).collect();
    (linear.rank.identifiable_basis.ncols(), ids.len(), identifiable)
}

#[test]
fn at_one_height_and_radius_only_third_order_of_ecc_is_identifiable() {
    let (rank, parameters, identifiable) = individually_identifiable(1..=3);
    println!("rank {rank} of {parameters}; individually identifiable: {identifiable:?}");
    assert_eq!(identifiable, ["ECC~C:h3.cos", "ECC~C:h3.sin"]);
}
