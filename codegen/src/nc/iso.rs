//! Programs in G codes after ISO 6983-1, as LinuxCNC, Fanuc and SINUMERIK read them.

use super::block::{Block, Positions, change, is_rotary, turns};
use super::comment::{plain, simple, test_of};
use super::{Control, NcOptions, Plane, Program};

/// What differs between controls that read G codes.
pub(super) struct Iso {
    word: &'static str,
    extension: &'static str,
    source: &'static str,
    decimals: usize,
    is_run: bool,
    /// Whether programs have numbers.
    has_numbers: bool,
    turning: Turning,
    /// First and last block of the function that holds the tool point over the table.
    tool_point: Option<[&'static str; 2]>,
    name: fn(&str) -> String,
    comment: fn(&str) -> String,
    stop: fn(&str) -> String,
    dwell: fn(f64) -> String,
    /// Lines before and after the blocks of a program, by its name and the options.
    head: fn(&Heading<'_>) -> String,
    tail: fn(&str) -> String,
    main: fn(&[(String, String)], u32) -> String,
}

/// What the first lines of a program depend on.
struct Heading<'p> {
    /// The program number.
    number: u32,
    name: &'p str,
    /// Largest distance from the path at the corners of segments, mm.
    tolerance_mm: f64,
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
    has_numbers: false,
    turning: Turning::Block,
    tool_point: None,
    name: |test| simple(test).to_lowercase(),
    comment: |text| format!("({})", plain(text)),
    stop: |text| format!("(MSG, {})\nM0", plain(text)),
    dwell: |seconds| format!("G4 P{seconds}"),
    // M70 saves the path control, too.
    head: |own| {
        let tolerance = number(own.tolerance_mm, 6);
        format!("o<{}> sub\nM70\nG21 G90 G94 G17 G40 G80\nG64 P{tolerance}\n", own.name)
    },
    // The file runs alone, too: its last call is not reached from `main`.
    tail: |name| format!("M72\no<{name}> endsub\no<{name}> call\nM2\n"),
    main: |calls, _| {
        let call = |(name, test): &(String, String)| format!("({})\no<{name}> call\n", test_of(test));
        format!("{}M2\n", calls.iter().map(call).collect::<String>())
    },
};

/// Fanuc 30i, custom macro B.
pub(super) static FANUC: Iso = Iso {
    word: "fanuc",
    extension: "nc",
    source: "FANUC Series 30i/31i/32i-MODEL B Operator's Manual B-64484EN (G codes), custom macro (#4001 to #4015, G65)",
    // IS-B, the usual increment system.
    decimals: 3,
    is_run: false,
    has_numbers: true,
    turning: Turning::Block,
    tool_point: Some(["G43.4 H#4111", "G49"]),
    name: simple,
    comment: |text| format!("({})", plain(text).to_uppercase()),
    stop: |text| format!("M0 ({})", plain(text).to_uppercase()),
    dwell: |seconds| format!("G4 X{seconds:.3}"),
    // The modal groups of plane, distance, feed, unit, radius offset and path control are read first and set again at
    // the end.
    head: |own| {
        format!(
            "%\nO{:04} ({})\n#2=#4002\n#3=#4003\n#5=#4005\n#6=#4006\n#7=#4007\n#15=#4015\n\
             G21 G90 G94 G17 G40 G80\nG64\n",
            own.number,
            own.name.to_uppercase()
        )
    },
    tail: |_| "G#2 G#3 G#5 G#6 G#7 G#15\nM99\n%\n".into(),
    main: |calls, first| {
        let call = |(number, (_, test)): (u32, &(String, String))| {
            format!("G65 P{} ({})\n", number, test_of(test).to_uppercase())
        };
        let calls: String = (first + 1..).zip(calls).map(call).collect();
        format!("%\nO{first:04} (MAIN)\n{calls}M30\n%\n")
    },
};

/// SINUMERIK 840D sl.
pub(super) static SIEMENS: Iso = Iso {
    word: "siemens",
    extension: "mpf",
    source: "SINUMERIK 840D sl / 828D Programming Manual Fundamentals (G93, G2/G3, MSG), Job Planning (PROC SAVE, TRAORI)",
    decimals: 6,
    is_run: false,
    has_numbers: false,
    turning: Turning::Word,
    tool_point: Some(["TRAORI", "TRAFOOF"]),
    // A name begins with two letters and has 24 characters. A test called RET, MSG or CYCLE800 would be a command where
    // it is called.
    name: |test| format!("TEST_{:.16}", simple(test).to_uppercase()),
    comment: |text| format!("; {}", plain(text)),
    stop: |text| format!("MSG(\"{}\")\nM0\nMSG()", plain(text)),
    dwell: |seconds| format!("G4 F{seconds}"),
    // SAVE restores the G functions, G64 among them.
    head: |own| format!("PROC {} SAVE\nG710 G90 G94 G17 G40\nG64\n", own.name),
    tail: |_| "M17\n".into(),
    main: |calls, _| {
        let call = |(name, test): &(String, String)| format!("{name} ; {}\n", test_of(test));
        format!("{}M30\n", calls.iter().map(call).collect::<String>())
    },
};

/// A number without superfluous zeros.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.trim_end_matches('0') {
        "-0." | "0." | "" => "0.".into(),
        text => text.into(),
    }
}

/// The text of a program while it is written.
struct Writer<'c> {
    control: &'c Iso,
    /// Decimals of a position.
    decimals: usize,
    text: String,
    /// Whether segments at inverse time are written, and whether for the tool point over the table.
    segments: Option<bool>,
}

impl Writer<'_> {
    fn push(&mut self, line: &str) {
        self.text.extend([line, "\n"]);
    }

    fn words(&self, to: &[(char, f64)]) -> String {
        to.iter().map(|(letter, position)| format!(" {letter}{}", number(*position, self.decimals))).collect()
    }

    /// The words of a motion in which rotary axes turn.
    fn turned(&self, from: &Positions, to: &Positions) -> String {
        let word = |(letter, position): &(char, f64)| {
            let change = number(change(from, (*letter, *position), self.decimals), self.decimals);
            match self.control.turning {
                Turning::Block => format!(" {letter}{change}"),
                Turning::Word if is_rotary(*letter) => format!(" {letter}=IC({change})"),
                Turning::Word => format!(" {letter}{}", number(*position, self.decimals)),
            }
        };
        to.iter().map(word).collect()
    }

    /// Between segments stand remarks at most: the control does not stop between overshoot and measured path.
    fn begin_segments(&mut self, tool_point: bool) {
        if self.segments == Some(tool_point) {
            return;
        }
        self.end_segments();
        if let Some([first, _]) = self.control.tool_point.filter(|_| tool_point) {
            self.push(first);
        }
        self.push(match self.control.turning {
            Turning::Block => "G91 G93",
            Turning::Word => "G93",
        });
        self.segments = Some(tool_point);
    }

    fn end_segments(&mut self) {
        let Some(tool_point) = self.segments.take() else { return };
        self.push(match self.control.turning {
            Turning::Block => "G90 G94",
            Turning::Word => "G94",
        });
        if let Some([_, last]) = self.control.tool_point.filter(|_| tool_point) {
            self.push(last);
        }
    }

    fn block(&mut self, block: &Block) {
        if !matches!(block, Block::Comment(_) | Block::Segments { .. }) {
            self.end_segments();
        }
        match block {
            Block::Comment(remark) => self.push(&(self.control.comment)(remark)),
            Block::Stop(remark) => self.push(&(self.control.stop)(remark)),
            Block::Dwell(seconds) => self.push(&(self.control.dwell)(*seconds)),
            Block::Line { from, to, feed } if turns(from, to) => {
                let words = format!("G1{} F{}", self.turned(from, to), number(*feed, 3));
                self.push(&match self.control.turning {
                    Turning::Block => format!("G91 {words}\nG90"),
                    Turning::Word => words,
                });
            }
            Block::Line { to, feed, .. } => self.push(&format!("G1{} F{}", self.words(to), number(*feed, 3))),
            Block::Arc { plane, from, to, centre_at, counterclockwise, feed } => {
                let (plane, letters) = match plane {
                    Plane::Xy => ("G17", ['I', 'J']),
                    Plane::Zx => ("G18", ['K', 'I']),
                    Plane::Yz => ("G19", ['J', 'K']),
                };
                // From the start to the centre, both as the control has them.
                let centre = [0, 1].map(|i| {
                    let (axis, start) = from[i];
                    (letters[i], change(&[(axis, start)], (axis, centre_at[i]), self.decimals))
                });
                let turn = if *counterclockwise { "G3" } else { "G2" };
                self.push(&format!("{plane} {turn}{}{} F{}", self.words(to), self.words(&centre), number(*feed, 3)));
            }
            Block::Segments { from, ends, tool_point } => {
                self.begin_segments(*tool_point);
                let mut from = from;
                for (to, seconds) in ends {
                    let time = number(60.0 / seconds, self.decimals);
                    self.push(&format!("G1{} F{time}", self.turned(from, to)));
                    from = to;
                }
            }
        }
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
    fn work_offset(&self) -> &'static str {
        "G54"
    }
    fn has_numbers(&self) -> bool {
        self.has_numbers
    }
    fn has_arc(&self, _: Plane) -> bool {
        true
    }
    fn has_tool_point(&self) -> bool {
        self.tool_point.is_some()
    }
    fn name(&self, test: &str) -> String {
        (self.name)(test)
    }
    fn text(&self, number: usize, program: &Program, options: &NcOptions) -> String {
        let heading = Heading {
            number: options.number() + number as u32,
            name: &program.name,
            tolerance_mm: options.chord_error_mm,
        };
        let decimals = options.decimals(self);
        let mut writer = Writer { control: self, decimals, text: (self.head)(&heading), segments: None };
        program.title.iter().for_each(|line| writer.push(&(self.comment)(line)));
        program.blocks.iter().for_each(|block| writer.block(block));
        writer.end_segments();
        writer.text + &(self.tail)(&program.name)
    }
    fn main(&self, calls: &[(String, String)], options: &NcOptions) -> String {
        (self.main)(calls, options.number())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A position is a number with a point, whose last digit is not zero; nothing is zero with a sign.
    #[test]
    fn positions_are_numbers_with_a_point() {
        let written = [(12.5, "12.5"), (12.0, "12."), (100.0, "100."), (0.1, "0.1"), (-7.25, "-7.25"), (-30.0, "-30.")];
        for (value, text) in
            written.into_iter().chain([(0.0, "0."), (-0.0004, "0."), (0.0004, "0."), (-0.0006, "-0.001")])
        {
            assert_eq!(number(value, 3), text);
        }
    }
}
