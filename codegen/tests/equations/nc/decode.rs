//! Readers of NC programs that share no code with the writer.

use std::collections::BTreeMap;

/// A motion as a control sees it: positions of the axes by letter, mm and degrees, along one block.
#[derive(Clone, Debug)]
pub struct Move {
    /// Positions along the block, its end included.
    pub points: Vec<Positions>,
    /// The number of the run that is measured meanwhile.
    pub run: Option<usize>,
}

/// The runs that comments of a program delimit.
#[derive(Default)]
struct Run {
    count: usize,
    now: Option<usize>,
}

impl Run {
    fn read(&mut self, comment: &str) {
        let comment = comment.to_lowercase();
        if comment.contains("measured path begins") {
            self.now = Some(self.count);
            self.count += 1;
        } else if comment.contains("measured path ends") {
            self.now = None;
        }
    }
}

/// Positions of axes by letter, mm and degrees.
pub type Positions = BTreeMap<char, f64>;

/// The points of a straight block.
fn straight(from: &Positions, to: &Positions) -> Vec<Positions> {
    let at =
        |t: f64| -> Positions { to.iter().map(|(axis, end)| (*axis, from[axis] + t * (end - from[axis]))).collect() };
    (1..=20).map(|k| at(f64::from(k) / 20.0)).collect()
}

/// The points of an arc in a plane of two axes, about a centre, from `from` to `to`.
fn arc(from: &Positions, to: &Positions, axes: [char; 2], centre: [f64; 2], counterclockwise: bool) -> Vec<Positions> {
    let angle = |at: &Positions| (at[&axes[1]] - centre[1]).atan2(at[&axes[0]] - centre[0]);
    let radius = (from[&axes[0]] - centre[0]).hypot(from[&axes[1]] - centre[1]);
    let end_radius = (to[&axes[0]] - centre[0]).hypot(to[&axes[1]] - centre[1]);
    assert!((radius - end_radius).abs() < 5e-4, "radius {radius} at the start, {end_radius} at the end");
    let (start, mut turn) = (angle(from), angle(to) - angle(from));
    let full = std::f64::consts::TAU;
    if counterclockwise && turn <= 1e-9 {
        turn += full;
    }
    if !counterclockwise && turn >= -1e-9 {
        turn -= full;
    }
    (1..=2000)
        .map(|k| {
            let phi = start + turn * f64::from(k) / 2000.0;
            let mut at = to.clone();
            at.insert(axes[0], centre[0] + radius * phi.cos());
            at.insert(axes[1], centre[1] + radius * phi.sin());
            at
        })
        .collect()
}

const PLANES: [[char; 2]; 3] = [['X', 'Y'], ['Z', 'X'], ['Y', 'Z']];

/// The numbers of a call such as `ARC_FEED(1.0, 2.0)`.
fn numbers(call: &str) -> Vec<f64> {
    let inside = call.split_once('(').unwrap().1.trim_end_matches(')');
    inside.split(',').map(|number| number.trim().parse().unwrap()).collect()
}

/// Canonical motions that `rs274` prints. Positions before the first motion are zero.
pub fn canonical(text: &str) -> Vec<Move> {
    let mut here: Positions = "XYZABC".chars().map(|axis| (axis, 0.0)).collect();
    let (mut moves, mut measured, mut plane) = (Vec::new(), Run::default(), 0);
    for line in text.lines() {
        let Some((_, call)) = line.split_once("N..... ") else { continue };
        let mut to = here.clone();
        let mut set = |axes: &str, values: &[f64]| {
            axes.chars().zip(values).for_each(|(axis, value)| {
                to.insert(axis, *value);
            });
        };
        let points = if call.starts_with("STRAIGHT_") {
            set("XYZABC", &numbers(call));
            straight(&here, &to)
        } else if call.starts_with("ARC_FEED") {
            let n = numbers(call);
            let [first, second] = PLANES[plane];
            let third = "XYZ".chars().find(|axis| ![first, second].contains(axis)).unwrap();
            set(&format!("{first}{second}"), &n[..2]);
            set(&third.to_string(), &n[5..6]);
            set("ABC", &n[6..9]);
            arc(&here, &to, [first, second], [n[2], n[3]], n[4] > 0.0)
        } else {
            match call {
                "SELECT_PLANE(CANON_PLANE_XY)" => plane = 0,
                "SELECT_PLANE(CANON_PLANE_XZ)" => plane = 1,
                "SELECT_PLANE(CANON_PLANE_YZ)" => plane = 2,
                _ => measured.read(call),
            }
            continue;
        };
        moves.push(Move { points, run: measured.now });
        here = to;
    }
    moves
}

/// Letter and number of each word of a G-code block.
fn words(block: &str) -> Vec<(char, f64)> {
    block.split_whitespace().filter_map(|word| Some((word.chars().next()?, word.get(1..)?.parse().ok()?))).collect()
}

/// Motions of a program in G codes (ISO 6983-1): G1, G2, G3, G17 to G19, incremental arc centres.
pub fn of_g_codes(text: &str) -> Vec<Move> {
    let mut here: Positions = "XYZABC".chars().map(|axis| (axis, 0.0)).collect();
    let (mut moves, mut measured, mut plane) = (Vec::new(), Run::default(), 0);
    for line in text.lines() {
        measured.read(line);
        if !line.starts_with('G') {
            continue;
        }
        let words = words(line);
        let codes: Vec<i64> = words.iter().filter(|(letter, _)| *letter == 'G').map(|(_, n)| *n as i64).collect();
        if let Some(code) = codes.iter().find(|code| (17..=19).contains(*code)) {
            plane = (code - 17) as usize;
        }
        let Some(code) = codes.iter().find(|code| (1..=3).contains(*code)) else { continue };
        let mut to = here.clone();
        words.iter().filter(|(letter, _)| "XYZABC".contains(*letter)).for_each(|(axis, value)| {
            to.insert(*axis, *value);
        });
        let centre = PLANES[plane].map(|axis| {
            let word = ['I', 'J', 'K']["XYZ".find(axis).unwrap()];
            here[&axis] + words.iter().find(|(letter, _)| *letter == word).map_or(0.0, |(_, value)| *value)
        });
        let points = if *code == 1 { straight(&here, &to) } else { arc(&here, &to, PLANES[plane], centre, *code == 3) };
        moves.push(Move { points, run: measured.now });
        here = to;
    }
    moves
}

/// Motions of a program in the TNC's plain text: L, CC, C.
pub fn of_plain_text(text: &str) -> Vec<Move> {
    let mut here: Positions = "XYZABC".chars().map(|axis| (axis, 0.0)).collect();
    let (mut moves, mut measured, mut centre) = (Vec::new(), Run::default(), [0.0; 2]);
    for (number, line) in text.lines().enumerate() {
        let (own, block) = line.split_once(' ').unwrap();
        assert_eq!(own, number.to_string(), "{line}");
        measured.read(block);
        let (kind, rest) = block.split_once(' ').unwrap_or((block, ""));
        let mut to = here.clone();
        words(rest).iter().filter(|(letter, _)| "XYZABC".contains(*letter)).for_each(|(axis, value)| {
            to.insert(*axis, *value);
        });
        let points = match kind {
            "CC" => {
                centre = [to[&'X'], to[&'Y']];
                continue;
            }
            "L" => straight(&here, &to),
            "C" => arc(&here, &to, ['X', 'Y'], centre, rest.contains("DR+")),
            _ => continue,
        };
        moves.push(Move { points, run: measured.now });
        here = to;
    }
    moves
}
