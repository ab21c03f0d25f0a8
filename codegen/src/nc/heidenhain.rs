//! Programs in the plain text of Heidenhain's TNC.

use super::block::{Block, Positions, before, change, is_rotary};
use super::comment::{plain, simple, test_of};
use super::iso::number;
use super::{Control, NcOptions, Plane, Program};

/// Decimals of a position.
const DECIMALS: usize = 4;
/// Least tolerance of the path control, mm.
const LEAST_TOLERANCE_MM: f64 = 1e-4;
/// Largest change of a rotary axis in a block, degrees.
const LONGEST_TURN_DEG: f64 = 90.0;

/// TNC 640.
pub(super) struct Heidenhain;

/// The lines of a program with their numbers.
struct Lines {
    text: String,
    number: usize,
    /// Decimals of a position.
    decimals: usize,
    /// Whether the tool point is held over the table.
    tool_point: bool,
}

impl Lines {
    fn push(&mut self, line: &str) {
        self.text += &format!("{} {line}\n", self.number);
        self.number += 1;
    }

    fn new(decimals: usize) -> Self {
        Lines { text: String::new(), number: 0, decimals, tool_point: false }
    }

    /// Switches the function that holds the tool point over the table.
    fn hold_tool_point(&mut self, tool_point: bool) {
        if self.tool_point != tool_point {
            self.push(if tool_point { "FUNCTION TCPM F CONT AXIS POS PATHCTRL AXIS" } else { "FUNCTION RESET TCPM" });
        }
        self.tool_point = tool_point;
    }
}

/// A number with its sign.
fn signed(value: f64, decimals: usize) -> String {
    let text = number(value, decimals);
    if text.starts_with('-') { text } else { format!("+{text}") }
}

fn coordinates(to: &Positions, decimals: usize) -> String {
    to.iter().map(|(letter, q)| format!(" {letter}{}", signed(*q, decimals))).collect()
}

/// The blocks of a straight motion: the words of each, and its length, which counts a degree as a millimetre.
///
/// An axis whose display is within one turn may go the shorter way to a position. Rotary axes therefore move by a
/// change, of a quarter of a turn at most: the shorter way is then the programmed one.
fn straight(from: &Positions, to: &Positions, decimals: usize) -> Vec<(String, f64)> {
    let known = |letter: char, q: f64| before(from, letter).unwrap_or(q);
    let widest = to.iter().filter(|(letter, _)| is_rotary(*letter)).map(|(letter, q)| (q - known(*letter, *q)).abs());
    let parts = (widest.fold(0.0, f64::max) / LONGEST_TURN_DEG - 1e-9).ceil().max(1.0) as usize;
    let at = |part: usize| -> Vec<(char, f64)> {
        let share = part as f64 / parts as f64;
        let position =
            |letter: char, q: f64| if part == parts { q } else { (1.0 - share) * known(letter, q) + share * q };
        to.iter().map(|(letter, q)| (*letter, position(*letter, *q))).collect()
    };
    let part = |part: usize| {
        // The first part comes from positions of `from`, which may not be known.
        let (start, end) = (if part == 1 { from.to_vec() } else { at(part - 1) }, at(part));
        let word = |(letter, q): &(char, f64)| match is_rotary(*letter) && before(&start, *letter).is_some() {
            true => format!(" I{letter}{}", signed(change(&start, (*letter, *q), decimals), decimals)),
            false => format!(" {letter}{}", signed(*q, decimals)),
        };
        let squares = end.iter().map(|(letter, q)| (q - before(&start, *letter).unwrap_or(*q)).powi(2));
        (end.iter().map(word).collect(), squares.sum::<f64>().sqrt())
    };
    (1..=parts).map(part).collect()
}

fn block(block: &Block, lines: &mut Lines) {
    let decimals = lines.decimals;
    match block {
        Block::Comment(_) => {}
        Block::Segments { tool_point, .. } => lines.hold_tool_point(*tool_point),
        _ => lines.hold_tool_point(false),
    }
    match block {
        Block::Comment(remark) => lines.push(&format!("; {}", plain(remark))),
        Block::Stop(remark) => {
            lines.push(&format!("; {}", plain(remark)));
            lines.push("STOP");
        }
        Block::Dwell(seconds) => {
            lines.push("CYCL DEF 9.0 DWELL TIME");
            lines.push(&format!("CYCL DEF 9.1 DWELL {seconds}"));
        }
        Block::Line { from, to, feed } => {
            for (words, _) in straight(from, to, decimals) {
                lines.push(&format!("L{words} R0 F{}", number(*feed, 3)));
            }
        }
        Block::Arc { to, centre_at, counterclockwise, feed, .. } => {
            lines.push(&format!("CC{}", coordinates(&[(to[0].0, centre_at[0]), (to[1].0, centre_at[1])], decimals)));
            let turn = if *counterclockwise { "DR+" } else { "DR-" };
            lines.push(&format!("C{} {turn} R0 F{}", coordinates(to, decimals), number(*feed, 3)));
        }
        Block::Segments { from, ends, .. } => {
            let mut from = from;
            for (to, seconds) in ends {
                let parts = straight(from, to, decimals);
                let each = seconds / parts.len() as f64;
                for (words, length) in parts {
                    let feed =
                        if length > 0.0 { format!(" F{}", number(60.0 * length / each, 3)) } else { String::new() };
                    lines.push(&format!("L{words} R0{feed}"));
                }
                from = to;
            }
        }
    }
}

impl Control for Heidenhain {
    fn word(&self) -> &'static str {
        "heidenhain"
    }
    fn extension(&self) -> &'static str {
        "h"
    }
    fn source(&self) -> &'static str {
        "HEIDENHAIN TNC 640 User's Manual Klartext Programming (L, CC, C, STOP, cycles 9 and 32, CALL PGM, FUNCTION TCPM)"
    }
    fn decimals(&self) -> usize {
        DECIMALS
    }
    fn is_run(&self) -> bool {
        false
    }
    fn work_offset(&self) -> &'static str {
        "the active row of the preset table"
    }
    fn has_numbers(&self) -> bool {
        false
    }
    fn has_arc(&self, plane: Plane) -> bool {
        // Other planes need another tool axis.
        plane == Plane::Xy
    }
    fn has_tool_point(&self) -> bool {
        true
    }
    fn name(&self, test: &str) -> String {
        simple(test)
    }
    fn text(&self, _: usize, program: &Program, options: &NcOptions) -> String {
        let mut lines = Lines::new(options.decimals(self));
        lines.push(&format!("BEGIN PGM {} MM", program.name));
        program.title.iter().for_each(|line| lines.push(&format!("; {}", plain(line))));
        // Path control: a tolerance, and at the end that of the machine.
        lines.push("CYCL DEF 32.0 TOLERANCE");
        lines.push(&format!("CYCL DEF 32.1 T{}", number(options.chord_error_mm.max(LEAST_TOLERANCE_MM), DECIMALS)));
        program.blocks.iter().for_each(|own| block(own, &mut lines));
        lines.hold_tool_point(false);
        lines.push("CYCL DEF 32.0 TOLERANCE");
        lines.push("CYCL DEF 32.1");
        lines.push(&format!("END PGM {} MM", program.name));
        lines.text
    }
    fn main(&self, calls: &[(String, String)], _: &NcOptions) -> String {
        let mut lines = Lines::new(DECIMALS);
        lines.push("BEGIN PGM main MM");
        for (name, test) in calls {
            lines.push(&format!("; {}", test_of(test)));
            lines.push(&format!("CALL PGM {name}.h"));
        }
        lines.push("END PGM main MM");
        lines.text
    }
}
