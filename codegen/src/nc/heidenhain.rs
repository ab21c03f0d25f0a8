//! Programs in the plain text of Heidenhain's TNC.

use super::iso::{number, plain, simple};
use super::program::Block;
use super::{Control, Plane, Program};

/// Decimals of a position.
const DECIMALS: usize = 4;

/// TNC 640.
pub(super) struct Heidenhain;

/// The lines of a program with their numbers.
struct Lines {
    text: String,
    number: usize,
}

impl Lines {
    fn push(&mut self, line: &str) {
        self.text += &format!("{} {line}\n", self.number);
        self.number += 1;
    }
}

fn coordinates(to: &[(char, f64)]) -> String {
    let sign = |value: f64| if number(value, DECIMALS).starts_with('-') { "" } else { "+" };
    to.iter().map(|(letter, q)| format!(" {letter}{}{}", sign(*q), number(*q, DECIMALS))).collect()
}

fn block(block: &Block, here: &mut Vec<(char, f64)>, lines: &mut Lines) {
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
        Block::Line { to, feed } => {
            lines.push(&format!("L{} R0 F{}", coordinates(to), number(*feed, 3)));
            moved(here, to);
        }
        Block::Arc { to, centre_at, counterclockwise, feed, .. } => {
            lines.push(&format!("CC{}", coordinates(&[(to[0].0, centre_at[0]), (to[1].0, centre_at[1])])));
            let turn = if *counterclockwise { "DR+" } else { "DR-" };
            lines.push(&format!("C{} {turn} R0 F{}", coordinates(to), number(*feed, 3)));
            moved(here, to);
        }
        Block::Segments { ends, tool_point } => {
            if *tool_point {
                lines.push("FUNCTION TCPM F CONT AXIS POS PATHCTRL AXIS");
            }
            for (to, seconds) in ends {
                // The feed counts a degree as a millimetre, over all axes of a block.
                let length = to
                    .iter()
                    .map(|(letter, q)| {
                        let before = here.iter().find(|(other, _)| other == letter).map_or(*q, |(_, q)| *q);
                        (q - before).powi(2)
                    })
                    .sum::<f64>()
                    .sqrt();
                let feed =
                    if length > 0.0 { format!(" F{}", number(60.0 * length / seconds, 3)) } else { String::new() };
                lines.push(&format!("L{} R0{feed}", coordinates(to)));
                moved(here, to);
            }
            if *tool_point {
                lines.push("FUNCTION RESET TCPM");
            }
        }
    }
}

/// Keeps the positions of the axes.
fn moved(here: &mut Vec<(char, f64)>, to: &[(char, f64)]) {
    for (letter, position) in to {
        match here.iter_mut().find(|(other, _)| other == letter) {
            Some((_, own)) => *own = *position,
            None => here.push((*letter, *position)),
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
        "HEIDENHAIN TNC 640 User's Manual Klartext Programming (L, CC, C, STOP, cycle 9, CALL PGM, FUNCTION TCPM)"
    }
    fn decimals(&self) -> usize {
        DECIMALS
    }
    fn is_run(&self) -> bool {
        false
    }
    fn has_arc(&self, plane: Plane) -> bool {
        // Other planes need another tool axis.
        plane == Plane::Xy
    }
    fn has_tool_point(&self) -> bool {
        true
    }
    fn name(&self, _: usize, test: &str) -> String {
        simple(test, '_')
    }
    fn text(&self, _: usize, program: &Program) -> String {
        let mut lines = Lines { text: String::new(), number: 0 };
        lines.push(&format!("BEGIN PGM {} MM", program.name));
        program.title.iter().for_each(|line| lines.push(&format!("; {}", plain(line))));
        let mut here = Vec::new();
        program.blocks.iter().for_each(|own| block(own, &mut here, &mut lines));
        lines.push(&format!("END PGM {} MM", program.name));
        lines.text
    }
    fn main(&self, calls: &[(String, String)]) -> String {
        let mut lines = Lines { text: String::new(), number: 0 };
        lines.push("BEGIN PGM main MM");
        for (name, test) in calls {
            lines.push(&format!("; {}", plain(test)));
            lines.push(&format!("CALL PGM {name}.h"));
        }
        lines.push("END PGM main MM");
        lines.text
    }
}
