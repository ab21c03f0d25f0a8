//! Programs in G codes after ISO 6983-1, as LinuxCNC, Fanuc and SINUMERIK read them.

use super::block::{Block, Positions, change, is_rotary, turns};
use super::{Control, Plane, Program};

/// What differs between controls that read G codes.
pub(super) struct Iso {
    word: &'static str,
    extension: &'static str,
    source: &'static str,
    decimals: usize,
    is_run: bool,
    turning: Turning,
    /// First and last block of the function that holds the tool point over the table.
    tool_point: Option<[&'static str; 2]>,
    name: fn(usize, &str) -> String,
    comment: fn(&str) -> String,
    stop: fn(&str) -> String,
    dwell: fn(f64) -> String,
    /// Lines before and after the blocks of a program, by its number and name.
    head: fn(usize, &str) -> String,
    tail: fn(&str) -> String,
    main: fn(&[(String, String)]) -> String,
}

/// How a motion of a rotary axis is written, so that it goes the programmed way on an axis whose positions are counted
/// within one turn.
enum Turning {
    /// All words of the block are changes, between G91 and G90.
    Block,
    /// The words of rotary axes are changes, as IC.
    Word,
}

/// LinuxCNC 2.9: RS274/NGC.
pub(super) static LINUXCNC: Iso = Iso {
    word: "linuxcnc",
    extension: "ngc",
    source: "LinuxCNC 2.9, G-Code Reference; O Codes; M-Codes (M70, M72)",
    decimals: 6,
    is_run: true,
    turning: Turning::Block,
    tool_point: None,
    name: |_, test| simple(test, '_').to_lowercase(),
    comment: |text| format!("({})", plain(text)),
    stop: |text| format!("(MSG, {})\nM0", plain(text)),
    dwell: |seconds| format!("G4 P{seconds}"),
    head: |_, name| format!("o<{name}> sub\nM70\nG21 G90 G94 G17 G40 G80\n"),
    // The file runs alone, too: its last call is not reached from `main`.
    tail: |name| format!("M72\no<{name}> endsub\no<{name}> call\nM2\n"),
    main: |calls| {
        let call = |(name, test): &(String, String)| format!("({})\no<{name}> call\n", plain(test));
        format!("{}M2\n", calls.iter().map(call).collect::<String>())
    },
};

/// Fanuc 30i, custom macro B.
pub(super) static FANUC: Iso = Iso {
    word: "fanuc",
    extension: "nc",
    source: "FANUC Series 30i/31i/32i-MODEL B Operator's Manual B-64484EN (G codes), custom macro (#4001 to #4008, G65)",
    decimals: 4,
    is_run: false,
    turning: Turning::Block,
    tool_point: Some(["G43.4 H#4111", "G49"]),
    name: |_, test| simple(test, '_'),
    comment: |text| format!("({})", plain(text).to_uppercase()),
    stop: |text| format!("M0 ({})", plain(text).to_uppercase()),
    dwell: |seconds| format!("G4 X{seconds:.3}"),
    // The modal groups of plane, distance, feed, unit and radius offset are read first and set again at the end.
    head: |number, name| {
        format!(
            "%\nO{:04} ({})\n#2=#4002\n#3=#4003\n#5=#4005\n#6=#4006\n#7=#4007\nG21 G90 G94 G17 G40 G80\n",
            1000 + number,
            name.to_uppercase()
        )
    },
    tail: |_| "G#2 G#3 G#5 G#6 G#7\nM99\n%\n".into(),
    main: |calls| {
        let call = |(number, (_, test)): (usize, &(String, String))| {
            format!("G65 P{} ({})\n", 1001 + number, plain(test).to_uppercase())
        };
        format!("%\nO1000 (MAIN)\n{}M30\n%\n", calls.iter().enumerate().map(call).collect::<String>())
    },
};

/// SINUMERIK 840D sl.
pub(super) static SIEMENS: Iso = Iso {
    word: "siemens",
    extension: "mpf",
    source: "SINUMERIK 840D sl / 828D Programming Manual Fundamentals (G93, G2/G3, MSG), Job Planning (PROC SAVE, TRAORI)",
    decimals: 6,
    is_run: false,
    turning: Turning::Word,
    tool_point: Some(["TRAORI", "TRAFOOF"]),
    name: |number, test| {
        let name = simple(test, '_').to_uppercase();
        // A name begins with two letters.
        let two = name.chars().take(2).filter(char::is_ascii_alphabetic).count() == 2;
        if two { name } else { format!("T{}_{name}", (b'A' + (number % 26) as u8) as char) }
    },
    comment: |text| format!("; {}", plain(text)),
    stop: |text| format!("MSG(\"{}\")\nM0\nMSG()", plain(text)),
    dwell: |seconds| format!("G4 F{seconds}"),
    head: |_, name| format!("PROC {name} SAVE\nG71 G90 G94 G17 G40 G64\n"),
    tail: |_| "M17\n".into(),
    main: |calls| {
        let call = |(name, test): &(String, String)| format!("{name} ; {}\n", plain(test));
        format!("{}M30\n", calls.iter().map(call).collect::<String>())
    },
};

/// Letters, digits and one other character in place of all the rest.
pub(super) fn simple(name: &str, other: char) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { other }).collect()
}

/// Text that a comment may hold.
pub(super) fn plain(text: &str) -> String {
    let text = text.replace('°', " deg").replace('µ', "u");
    text.chars().filter(|c| (' '..='~').contains(c) && !"()[]{};\"".contains(*c)).collect()
}

/// A number without superfluous zeros.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0');
    match text.trim_end_matches('.') {
        "-0" | "" => "0.".into(),
        whole if whole.len() < text.len() => text.into(),
        text => text.into(),
    }
}

impl Iso {
    fn words(&self, to: &[(char, f64)]) -> String {
        to.iter().map(|(letter, position)| format!(" {letter}{}", number(*position, self.decimals))).collect()
    }

    /// The words of a motion in which rotary axes turn.
    fn turned(&self, from: &Positions, to: &Positions) -> String {
        let word = |(letter, position): &(char, f64)| {
            let change = number(change(from, (*letter, *position), self.decimals), self.decimals);
            match self.turning {
                Turning::Block => format!(" {letter}{change}"),
                Turning::Word if is_rotary(*letter) => format!(" {letter}=IC({change})"),
                Turning::Word => format!(" {letter}{}", number(*position, self.decimals)),
            }
        };
        to.iter().map(word).collect()
    }

    fn block(&self, block: &Block, text: &mut String) {
        match block {
            Block::Comment(remark) => *text += &(self.comment)(remark),
            Block::Stop(remark) => *text += &(self.stop)(remark),
            Block::Dwell(seconds) => *text += &(self.dwell)(*seconds),
            Block::Line { from, to, feed } if turns(from, to) => {
                let words = format!("G1{} F{}", self.turned(from, to), number(*feed, 3));
                *text += &match self.turning {
                    Turning::Block => format!("G91 {words}\nG90"),
                    Turning::Word => words,
                };
            }
            Block::Line { to, feed, .. } => *text += &format!("G1{} F{}", self.words(to), number(*feed, 3)),
            Block::Arc { plane, to, centre, counterclockwise, feed, .. } => {
                let (plane, [first, second]) = match plane {
                    Plane::Xy => ("G17", ['I', 'J']),
                    Plane::Zx => ("G18", ['K', 'I']),
                    Plane::Yz => ("G19", ['J', 'K']),
                };
                let turn = if *counterclockwise { "G3" } else { "G2" };
                *text += &format!(
                    "{plane} {turn}{}{} F{}",
                    self.words(to),
                    self.words(&[(first, centre[0]), (second, centre[1])]),
                    number(*feed, 3)
                );
            }
            Block::Segments { from, ends, tool_point } => {
                let around = self.tool_point.filter(|_| *tool_point);
                if let Some([first, _]) = around {
                    *text += &format!("{first}\n");
                }
                let [first, last] = match self.turning {
                    Turning::Block => ["G91 G93\n", "G90 G94"],
                    Turning::Word => ["G93\n", "G94"],
                };
                *text += first;
                let mut from = from;
                for (to, seconds) in ends {
                    *text += &format!("G1{} F{}\n", self.turned(from, to), number(60.0 / seconds, 6));
                    from = to;
                }
                *text += last;
                if let Some([_, last]) = around {
                    *text += &format!("\n{last}");
                }
            }
        }
        text.push('\n');
    }
}

impl Control for Iso {
    fn word(&self) -> &'static str {
        self.word
    }
    fn extension(&self) -> &'static str {
        self.extension
    }
    fn source(&self) -> &'static str {
        self.source
    }
    fn decimals(&self) -> usize {
        self.decimals
    }
    fn is_run(&self) -> bool {
        self.is_run
    }
    fn has_arc(&self, _: Plane) -> bool {
        true
    }
    fn has_tool_point(&self) -> bool {
        self.tool_point.is_some()
    }
    fn name(&self, number: usize, test: &str) -> String {
        (self.name)(number, test)
    }
    fn text(&self, number: usize, program: &Program) -> String {
        let mut text = (self.head)(number, &program.name);
        for line in &program.title {
            text += &format!("{}\n", (self.comment)(line));
        }
        program.blocks.iter().for_each(|block| self.block(block, &mut text));
        text + &(self.tail)(&program.name)
    }
    fn main(&self, calls: &[(String, String)]) -> String {
        (self.main)(calls)
    }
}
