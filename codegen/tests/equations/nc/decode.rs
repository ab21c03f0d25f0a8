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

/// How a control takes a position that a program states of a rotary axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Counting {
    /// As it stands: the axis counts its turns.
    Turns,
    /// As a place within one turn, reached the shorter way: M126 or `shortestDistance`, ROAx with RABx 0, DC.
    Shorter,
    /// As a place within one turn, reached along the line from 0 to 360 degrees: M127, AC.
    Line,
    /// As a place within one turn, reached in the direction of the sign: RAAx, the wrapped rotary axis of LinuxCNC.
    Sign,
}

impl Counting {
    pub const ALL: [Counting; 4] = [Counting::Turns, Counting::Shorter, Counting::Line, Counting::Sign];

    /// Where an axis ends, counted in turns from where it is.
    pub fn reached(self, from: f64, stated: f64) -> f64 {
        let turn = 360.0;
        match self {
            Counting::Turns => stated,
            Counting::Shorter => from + shorter(stated - from),
            Counting::Line => from + stated.rem_euclid(turn) - from.rem_euclid(turn),
            Counting::Sign if stated >= 0.0 => from + (stated - from).rem_euclid(turn),
            Counting::Sign => from - (from + stated).rem_euclid(turn),
        }
    }
}

/// A change within half a turn; half a turn goes the other way.
fn shorter(change: f64) -> f64 {
    let within = change.rem_euclid(360.0);
    let way = if within > 180.0 { within - 360.0 } else { within };
    if way == 180.0 { -change.signum() * 180.0 } else { way }
}

/// Sets the end of an axis. The first stated position of a rotary axis is where the operator finds it.
fn reach(to: &mut Positions, found: &mut String, counting: Counting, axis: char, value: f64, is_change: bool) {
    let first = "ABC".contains(axis) && !found.contains(axis);
    let own = to.get_mut(&axis).unwrap();
    *own = match is_change {
        true => *own + value,
        false if first || "XYZ".contains(axis) => value,
        false => counting.reached(*own, value),
    };
    if first {
        assert!(!is_change, "{axis} changes before it has a position");
        found.push(axis);
    }
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
    assert!((radius - end_radius).abs() < 2e-3, "radius {radius} at the start, {end_radius} at the end");
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

/// Letter and number of each word of a block, and whether the number is a change: `C90.`, `C=IC(90.)`.
fn words(block: &str) -> Vec<(char, f64, bool)> {
    let word = |word: &str| {
        let (letter, rest) = (word.chars().next()?, word.get(1..)?);
        let change = rest.strip_prefix("=IC(").and_then(|rest| rest.strip_suffix(')'));
        Some((letter, change.unwrap_or(rest).parse().ok()?, change.is_some()))
    };
    block.split_whitespace().filter_map(word).collect()
}

/// The program as a control of an increment of 0.001 takes it: each number of a motion rounded, or cut off behind its third
/// decimal. The digits are compared as text.
pub fn of_three_decimals(text: &str, cuts: bool) -> String {
    let number = |word: &str| -> String {
        let Some((whole, decimals)) = word.split_once('.') else { return word.to_string() };
        if decimals.len() <= 3 {
            return word.to_string();
        }
        if cuts {
            return format!("{whole}.{}", &decimals[..3]);
        }
        format!("{:.3}", word.parse::<f64>().unwrap())
    };
    let word = |word: &str| match word.chars().next() {
        Some(letter) if "XYZABCIJK".contains(letter) => format!("{letter}{}", number(&word[1..])),
        _ => word.to_string(),
    };
    let line = |line: &str| match line.starts_with('G') {
        true => line.split(' ').map(word).collect::<Vec<String>>().join(" "),
        false => line.to_string(),
    };
    text.lines().map(|own| line(own) + "\n").collect()
}

/// Motions of a program in G codes (ISO 6983-1): G1, G2, G3, G17 to G19, G90, G91, incremental arc centres.
pub fn of_g_codes(text: &str, counting: Counting) -> Vec<Move> {
    let mut here: Positions = "XYZABC".chars().map(|axis| (axis, 0.0)).collect();
    let (mut found, mut changes) = (String::new(), false);
    let (mut moves, mut measured, mut plane) = (Vec::new(), Run::default(), 0);
    for line in text.lines() {
        measured.read(line);
        if !line.starts_with('G') {
            continue;
        }
        let words = words(line);
        let codes: Vec<i64> = words.iter().filter(|word| word.0 == 'G').map(|word| word.1 as i64).collect();
        if let Some(code) = codes.iter().find(|code| (17..=19).contains(*code)) {
            plane = (code - 17) as usize;
        }
        if let Some(code) = codes.iter().find(|code| (90..=91).contains(*code)) {
            changes = *code == 91;
        }
        let Some(code) = codes.iter().find(|code| (1..=3).contains(*code)) else { continue };
        let mut to = here.clone();
        for (axis, value, change) in words.iter().filter(|word| "XYZABC".contains(word.0)) {
            reach(&mut to, &mut found, counting, *axis, *value, changes || *change);
        }
        let centre = PLANES[plane].map(|axis| {
            let word = ['I', 'J', 'K']["XYZ".find(axis).unwrap()];
            here[&axis] + words.iter().find(|own| own.0 == word).map_or(0.0, |own| own.1)
        });
        let points = if *code == 1 { straight(&here, &to) } else { arc(&here, &to, PLANES[plane], centre, *code == 3) };
        moves.push(Move { points, run: measured.now });
        here = to;
    }
    moves
}

/// Motions of a program in the TNC's plain text: L, CC, C. A control that goes the shorter way is taken to do so for a
/// change, too.
pub fn of_plain_text(text: &str, counting: Counting) -> Vec<Move> {
    let mut here: Positions = "XYZABC".chars().map(|axis| (axis, 0.0)).collect();
    let mut found = String::new();
    let (mut moves, mut measured, mut centre) = (Vec::new(), Run::default(), [0.0; 2]);
    for (number, line) in text.lines().enumerate() {
        let (own, block) = line.split_once(' ').unwrap();
        assert_eq!(own, number.to_string(), "{line}");
        measured.read(block);
        let (kind, rest) = block.split_once(' ').unwrap_or((block, ""));
        if !["L", "CC", "C"].contains(&kind) {
            continue;
        }
        let mut to = here.clone();
        for word in rest.split_whitespace() {
            let (own, is_change) = word.strip_prefix('I').map_or((word, false), |own| (own, true));
            let Some((axis, value, _)) = words(own).first().copied() else { continue };
            if "XYZABC".contains(axis) {
                let value = if is_change && counting == Counting::Shorter { shorter(value) } else { value };
                reach(&mut to, &mut found, counting, axis, value, is_change);
            }
        }
        let points = match kind {
            "CC" => {
                centre = [to[&'X'], to[&'Y']];
                continue;
            }
            "L" => straight(&here, &to),
            _ => arc(&here, &to, ['X', 'Y'], centre, rest.contains("DR+")),
        };
        moves.push(Move { points, run: measured.now });
        here = to;
    }
    moves
}
