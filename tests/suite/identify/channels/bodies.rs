//! Points on any body: a ball on the tilting axis while the table turns above it, against a plant that carries it by that
//! axis alone.

use super::layouts::refusal;
use super::scatter::assert_standard;
use super::*;
use crate::plant::chain::ChainErrors;

/// The tests of Chapter 4 of Jiang (2014): the ball stands on A, then on the table.
const CHAPTER_4: &str = r#"
[machine]
name = "Table"
chain = "w C A b Y X Z t"
axis.C.direction = [0, 0, 1]
axis.A.direction = [1, 0, 0]
axis.X.direction = [1, 0, 0]
axis.Y.direction = [0, 1, 0]
axis.Z.direction = [0, 0, 1]

[instrument]
kind = "ballbar"
noise_um = 0.1
"#;

/// Name, ball, whether it stands on A, X and Z.
const TESTS: [(&str, [f64; 3], bool, [f64; 2]); 4] = [
    ("A100", [0.0, 100.0, 0.0], true, [0.0, 0.0]),
    ("A150", [0.0, 100.0, 0.0], true, [-111.8, 0.0]),
    ("C100", [100.0, 0.0, 0.0], false, [0.0, 0.0]),
    ("C150", [100.0, 0.0, 0.0], false, [0.0, 111.8]),
];

/// What is identified, with sizes in µm and arcsec.
const ERRORS: [(&str, f64); 8] = [
    ("EY0A", 30.0),
    ("EZ0A", 30.0),
    ("EB0A", 20.0),
    ("EC0A", 20.0),
    ("EX0C", 30.0),
    ("EY0C", 30.0),
    ("EA0C", 20.0),
    ("EB0C", 20.0),
];

/// The session of the tests, and their data in the folder. The balls are off by about 2 µm, and C stands at 40° while A turns.
fn measured(folder: &Folder, truth: &[(&'static str, f64)], random: &mut Pcg64) -> String {
    let chain = Chain::from_code("wCAbYXZt");
    // From the bed outwards A is the first.
    let tilting = Chain { workpiece_side: chain.workpiece_side[..1].to_vec(), ..chain.clone() };
    let of = |letter: char| {
        let value = |k: usize| {
            let name = format!("E{}0{letter}", ["X", "Y", "Z", "A", "B", "C"][k]);
            let found = truth.iter().find(|(id, _)| *id == name).map_or(0.0, |(_, value)| *value);
            found * if k < 3 { 1e-3 } else { ARCSECOND }
        };
        (letter, std::array::from_fn(value))
    };
    let balls: [[f64; 3]; 2] = std::array::from_fn(|_| std::array::from_fn(|_| 2e-3 * normal(random)));
    let mut text = CHAPTER_4.to_string();
    for (name, ball, on_a, [x, z]) in TESTS {
        let axis = if on_a { 'A' } else { 'C' };
        let workpiece_ball = balls[usize::from(on_a)];
        let out = ChainErrors { location: vec![of('A'), of('C')], workpiece_ball, ..ChainErrors::default() };
        let range = if on_a { (-20, 70) } else { (0, 350) };
        let mut data = format!("{}_deg,length_mm\n", axis.to_ascii_lowercase());
        for degrees in (range.0..=range.1).step_by(if on_a { 2 } else { 5 }) {
            let position = |letter: char| match letter {
                'X' => x,
                'Z' => z,
                'C' if on_a => 40.0_f64.to_radians(),
                letter if letter == axis => f64::from(degrees).to_radians(),
                _ => 0.0,
            };
            let carrying = if on_a { &tilting } else { &chain };
            let length = carrying.reading_mm(&position, ball, [0.0; 3], &out) + 1e-4 * normal(random);
            data += &format!("{degrees},{length:.9}\n");
        }
        folder.write(&format!("{name}.csv"), &data);
        let bar = (x * x + z * z + 1e4).sqrt();
        text += &format!(
            "[[test]]\nname = \"{name}\"\ndata = \"{name}.csv\"\nbar_mm = {bar}\nworkpiece_ball_mm = {ball:?}\n\
             workpiece_ball_u_um = 2\nspindle_ball_mm = [0, 0, 0]\nsetup = \"on {axis}\"\n"
        );
        let (frame, c) = if on_a { ("workpiece_ball_frame = \"axis A\"\n", "c_deg = 40, ") } else { ("", "") };
        text += &format!("{frame}at = {{ {c}x_mm = {x}, z_mm = {z} }}\n");
    }
    text
}

/// The errors of both axes scatter about the truth as they state. With the ball on the table the session is refused.
#[test]
fn a_ball_on_the_tilting_axis_is_not_carried_by_the_table() {
    let mut random = Pcg64::seed_from_u64(461);
    let folder = Folder::new();
    let mut of_errors = vec![Vec::new(); ERRORS.len()];
    for _ in 0..sessions() {
        let truth: Vec<_> = ERRORS.iter().map(|(id, size)| (*id, uniform(&mut random, *size))).collect();
        let text = measured(&folder, &truth, &mut random);
        of_errors.iter_mut().zip(pulls(&folder.session(&text), &truth)).for_each(|(all, pull)| all.push(pull));
        // On the table the ball would have turned with C, to where the bar does not reach.
        let said = refusal(&folder, &text.replace("workpiece_ball_frame = \"axis A\"\n", ""));
        assert!(said.contains("\"A150\": a bar of") && said.contains("cannot reach between its balls"), "{said}");
    }
    for (pulls, (id, _)) in of_errors.iter().zip(ERRORS) {
        assert_standard(id, pulls);
    }
}

/// A body that the machine does not have is refused where it is stated.
#[test]
fn a_frame_is_that_of_a_body_of_the_machine() {
    let mut random = Pcg64::seed_from_u64(462);
    let folder = Folder::new();
    let text = measured(&folder, &[], &mut random);
    let said = refusal(&folder, &text.replacen("axis A", "axis Q", 1));
    let line = 1 + text.lines().position(|line| line.starts_with("workpiece_ball_frame")).unwrap();
    for part in [&format!("session.toml:{line}"), "workpiece_ball_frame", "axis Q", "\"table\"", "\"axis A\""] {
        assert!(said.contains(part), "{said}");
    }
    let said = refusal(&folder, &text.replacen("workpiece_ball_frame", "workpiece_ball_fram", 1));
    assert!(said.contains("`workpiece_ball_frame`"), "{said}");
}
