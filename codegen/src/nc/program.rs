//! The program of a test as data: approach, centring, feed-in, traversals, feed-out, retreat.

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::{BodyErrors, Frame, Machine};
use abbe_model::frames::Point;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::session::placing::{balls, positions_for_bar};
use abbe_model::session::{Mounted, Moves};
use abbe_model::session::{Session, Test};

use super::block::Block;
use super::comment::{name, test_of};
use super::path::{Leg, Path};
use super::{Control, NcOptions};
use crate::error;

/// The program of one test.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Name of its file without the ending.
    pub name: String,
    /// What it is for, a line each.
    pub title: Vec<String>,
    /// Its blocks.
    pub blocks: Vec<Block>,
    /// What the operator must know before it runs; the remarks of the program say the same.
    pub warnings: Vec<String>,
    /// Its moves beside the measured path, as far as both their ends are known.
    pub moves: Vec<Moves>,
    /// Positions of all axes where the instrument is mounted, with overshoot and feed-in, mm and degrees.
    pub mounted_at: Vec<f64>,
    /// Positions of all axes where the motion begins, with overshoot, mm and degrees.
    pub start: Vec<f64>,
    /// Positions of all axes at which the balls of a bar coincide, mm and degrees; `None` if they cannot.
    pub centring: Option<Vec<f64>>,
    /// The feed of the measured path and its unit.
    pub feed: (f64, &'static str),
    /// Duration of all traversals with overshoot and pauses, min.
    pub minutes: f64,
}

impl Program {
    /// The program of a test. If it is `centred`, the workpiece ball has its place from a test before.
    ///
    /// # Errors
    /// As [`files`](super::files).
    pub fn of(
        session: &Session,
        test: &Test,
        control: &dyn Control,
        options: &NcOptions,
        centred: bool,
    ) -> Result<Program, Diagnostic> {
        let machine = &*session.machine;
        let writer = Writer { machine, test, letters: letters(machine)?, options };
        let path = Path::of(machine, test, control, options)?;
        let mut draft = Draft { warnings: path.warnings.clone(), ..Draft::default() };
        let mounted_at = writer.approach(&path, centred, &mut draft);
        let start = path.start().to_vec();
        writer.traversals(&path, &mut draft.blocks);
        let overshoots = path.overshoots.iter();
        draft.moves.extend(overshoots.map(|states| writer.moves("overshoot", Mounted::Bar, states.clone())));
        writer.retreat(&path, &start, &mut draft);
        let Draft { blocks, warnings, moves } = draft;
        let mut title = vec![
            format!("Machine {}, {}, {}", name(&machine.name), test_of(&test.name), test.station.kind().word()),
            "Positions are those of the axes in the session. The active work offset".into(),
            "and tool length must give them. This program changes neither.".into(),
        ];
        title.extend(path.warnings.iter().chain(&path.remarks).cloned());
        if !control.is_run() {
            title.push(format!("This form has not been run on a control. Syntax: {}", control.source()));
        }
        let display = |at: &[f64]| -> Vec<f64> {
            machine.axes.iter().zip(at).map(|(axis, q)| axis.kind.to_display(*q)).collect()
        };
        Ok(Program {
            name: test.name.clone(),
            title,
            blocks,
            warnings,
            moves,
            mounted_at: display(&mounted_at),
            centring: writer.centring(&start).map(|(_, centre)| display(&centre)),
            start: display(&start),
            feed: path.feed,
            minutes: path.minutes(machine, options.dwell_s),
        })
    }
}

/// The letters of the axes.
pub(super) fn letters(machine: &Machine) -> Result<Vec<char>, Diagnostic> {
    let letter = |name: &String| {
        let mut letters = name.chars();
        letters.next().filter(|letter| letters.next().is_none() && "ABCXYZUVW".contains(*letter))
    };
    machine
        .axes
        .iter()
        .map(|axis| {
            letter(&axis.name).ok_or_else(|| {
                error::nc(
                    format!("axis `{}` has no letter of NC programs", axis.name),
                    "axes are called A, B, C, X, Y, Z, U, V or W in a program",
                )
            })
        })
        .collect()
}

/// What becomes a program.
#[derive(Default)]
struct Draft {
    blocks: Vec<Block>,
    warnings: Vec<String>,
    moves: Vec<Moves>,
}

impl Draft {
    /// A remark of the program, which is also told to whoever writes it.
    fn warn(&mut self, text: String) {
        self.warnings.push(text.clone());
        self.blocks.push(Block::Comment(text));
    }
}

struct Writer<'s> {
    machine: &'s Machine,
    test: &'s Test,
    letters: Vec<char>,
    options: &'s NcOptions,
}

impl Writer<'_> {
    /// The axes of a kind that differ, with their positions in mm and degrees.
    fn moved(&self, from: &[f64], to: &[f64], kind: AxisKind) -> Vec<(char, f64)> {
        let axes = self.machine.axes.iter().zip(&self.letters).zip(from.iter().zip(to));
        axes.filter(|((axis, _), (a, b))| axis.kind == kind && a != b)
            .map(|((axis, letter), (_, b))| (*letter, axis.kind.to_display(*b)))
            .collect()
    }

    /// All axes of a kind.
    fn all(&self, to: &[f64], kind: AxisKind) -> Vec<(char, f64)> {
        let axes = self.machine.axes.iter().zip(&self.letters).zip(to);
        axes.filter(|((axis, _), _)| axis.kind == kind)
            .map(|((axis, letter), q)| (*letter, axis.kind.to_display(*q)))
            .collect()
    }

    /// What is taken off.
    fn instrument(&self) -> &'static str {
        self.test.station.handling().taken_off.unwrap_or("the instrument")
    }

    fn line(&self, to: Vec<(char, f64)>, blocks: &mut Vec<Block>) {
        if !to.is_empty() {
            blocks.push(Block::Line { from: Vec::new(), to, feed: self.options.approach_feed });
        }
    }

    fn moves(&self, stage: &'static str, mounted: Mounted, states: Vec<Vec<f64>>) -> Moves {
        Moves { test: self.test.name.clone(), stage, states, mounted }
    }

    /// The balls of the instrument: where a bar, or a sensor and a ball, stand. Without a target on the table, the tool moves
    /// against its origin.
    fn bar(&self) -> BallBar<f64> {
        let tool_alone = || BallBar { spindle_ball: self.test.station.tool_point(), ..BallBar::ORIGINS };
        self.test.station.between_points().unwrap_or_else(tool_alone)
    }

    /// The positions with the tool retracted along itself; `None` if the linear axes or their travel do not allow it.
    fn retracted(&self, at: &[f64]) -> Option<Vec<f64>> {
        let bar = self.bar();
        let states = self.machine.axis_positions(at);
        let none = vec![BodyErrors::<f64>::NONE; at.len()];
        let point = |z: f64| self.machine.in_r::<f64>(Frame::Tool, &states, &none, Point([0.0, 0.0, z])).0;
        let (near, far) = (point(0.0), point(self.options.clearance_mm));
        let (workpiece, spindle) = balls(self.machine, &bar, at);
        let requested = std::array::from_fn(|i| spindle[i] - workpiece[i] + far[i] - near[i]);
        self.within(positions_for_bar(self.machine, &bar, at, requested)?)
    }

    /// The positions at which the balls of a bar coincide, with the rotary axes at the start, and those above them.
    fn centring(&self, start: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let bar = self.test.station.bar().map(|_| self.bar())?;
        let centre = self.within(positions_for_bar(self.machine, &bar, start, [0.0; 3])?)?;
        Some((self.retracted(&centre)?, centre))
    }

    /// The positions at which the bar is longer by the feed-in.
    fn fed_in(&self, at: &[f64]) -> Option<Vec<f64>> {
        let bar = self.bar();
        let (workpiece, spindle) = balls(self.machine, &bar, at);
        let apart: [f64; 3] = std::array::from_fn(|i| spindle[i] - workpiece[i]);
        let length = apart.iter().map(|x| x * x).sum::<f64>().sqrt();
        let longer = (length > 1.0).then(|| apart.map(|x| x * (1.0 + self.options.feed_in_mm / length)))?;
        self.within(positions_for_bar(self.machine, &bar, at, longer)?)
    }

    fn within(&self, at: Vec<f64>) -> Option<Vec<f64>> {
        let inside = self
            .machine
            .axes
            .iter()
            .zip(&at)
            .all(|(axis, q)| axis.travel.is_none_or(|[low, high]| *q >= low - 1e-9 && *q <= high + 1e-9));
        inside.then_some(at)
    }

    /// To the start of the path, by way of the centre of the workpiece ball if it has no place yet. Returns where the
    /// instrument is mounted.
    fn approach(&self, path: &Path, centred: bool, draft: &mut Draft) -> Vec<f64> {
        let start = path.start();
        let ball_bar = self.test.station.bar().is_some();
        if self.test.station.probe().is_some() {
            draft.warn(
                "The stylus stays at the surface: this is for a scanning probe. A touch probe needs the cycle of the \
                 control at each position"
                    .into(),
            );
        }
        if let Some(rest_s) = path.rest_s {
            draft.warn(format!(
                "The axes rest for {rest_s} s at each of {} targets: record one reading at each (ISO 230-2)",
                path.targets()
            ));
        }
        draft.blocks.push(Block::Stop(format!(
            "Take {} off. Move the tool clear of table and fixtures. The axes turn to the start",
            self.instrument()
        )));
        let turned = self.all(start, AxisKind::Rotary);
        // A control that counts within one turn may take another place for such a position.
        let is_beyond = turned.iter().any(|(_, q)| !(0.0..360.0).contains(q));
        let stand = |(letter, q): &(char, f64)| format!("{letter} {}", (q * 1e4).round() / 1e4 + 0.0);
        let stand: Vec<String> = turned.iter().map(stand).collect();
        self.line(turned, &mut draft.blocks);
        if is_beyond {
            let check = format!("Check that the axes stand at {} deg, or whole turns from there", stand.join(", "));
            draft.blocks.push(Block::Stop(check));
        }
        let mut here: Option<Vec<f64>> = None;
        let centre = self.centring(start).filter(|_| !centred);
        if let Some((above, centre)) = centre {
            let blocks = &mut draft.blocks;
            blocks.push(Block::Comment(format!("Centring of the workpiece ball, setup {}", name(&self.test.setup))));
            self.line(self.all(&above, AxisKind::Linear), blocks);
            let on = self.bar().workpiece_ball.mounted(self.machine);
            blocks.push(Block::Stop(format!(
                "Mount the spindle cup, and the workpiece ball{on} with its base loose below it"
            )));
            self.line(self.moved(&above, &centre, AxisKind::Linear), blocks);
            blocks.push(Block::Stop("Let the cup take the workpiece ball. Lock its base".into()));
            self.line(self.moved(&centre, &above, AxisKind::Linear), blocks);
            draft.moves.push(self.moves("centring", Mounted::BallInCup, vec![above.clone(), centre]));
            here = Some(above);
        } else if ball_bar && !centred {
            draft.warn(format!(
                "The centre of the workpiece ball, setup {}, cannot be reached: place it by measurement",
                name(&self.test.setup)
            ));
        }
        let first = self.fed_in(start).filter(|_| ball_bar).unwrap_or_else(|| start.to_vec());
        // What the axes come from before the first known position is the operator's.
        let mut approach: Vec<Vec<f64>> = Vec::new();
        if let Some(above) = self.retracted(&first) {
            // Across at the clearance, then down along the tool.
            let across = match &here {
                None => self.all(&above, AxisKind::Linear),
                Some(here) => self.moved(here, &above, AxisKind::Linear),
            };
            self.line(across, &mut draft.blocks);
            self.line(self.moved(&above, &first, AxisKind::Linear), &mut draft.blocks);
            approach.extend(here.into_iter().chain([above]));
        } else {
            draft.warn("The start cannot be approached along the tool within the travel".into());
            self.line(self.all(&first, AxisKind::Linear), &mut draft.blocks);
            approach.extend(here);
        }
        approach.push(first.clone());
        draft.moves.push(self.moves("approach", Mounted::Nothing, approach));
        let mount = match self.test.station.bar() {
            Some(bar) => format!("Mount the bar of {} mm", bar.bar),
            None => {
                let begins = self.test.station.handling().begins;
                begins.unwrap_or("Bring the instrument into its measuring range").to_string()
            }
        };
        draft.blocks.push(Block::Stop(format!("{mount}. Start recording")));
        if first != start {
            draft.blocks.push(Block::Comment("Feed-in".into()));
            self.line(self.moved(&first, start, AxisKind::Linear), &mut draft.blocks);
            draft.moves.push(self.moves("feed-in", Mounted::Bar, vec![first.clone(), start.to_vec()]));
        }
        first
    }

    fn traversals(&self, path: &Path, blocks: &mut Vec<Block>) {
        for (run, back) in path.traversals.are_backward().enumerate() {
            if run > 0 {
                if !path.traversals.both_directions() {
                    blocks.push(Block::Comment("Back to the start; not a run".into()));
                    let back = path.legs.iter().rev();
                    back.for_each(|leg| blocks.extend(leg.through(&self.letters, self.machine, true)));
                }
                blocks.push(Block::Dwell(self.options.dwell_s));
            }
            let direction = if back { "backward" } else { "forward" };
            blocks.push(Block::Comment(format!("Run {}, {direction}", run + 1)));
            let legs: Box<dyn Iterator<Item = &Leg>> =
                if back { Box::new(path.legs.iter().rev()) } else { Box::new(path.legs.iter()) };
            for leg in legs {
                if leg.measured {
                    blocks.push(Block::Comment("Measured path begins".into()));
                }
                blocks.extend(leg.blocks(&self.letters, self.machine, back));
                if leg.measured {
                    blocks.push(Block::Comment("Measured path ends".into()));
                }
            }
        }
    }

    /// From where the traversals end: feed-out, and away along the tool.
    fn retreat(&self, path: &Path, start: &[f64], draft: &mut Draft) {
        let end = if path.traversals.both_directions() { start } else { path.end() };
        let ball_bar = self.test.station.bar().is_some();
        let last = self.fed_in(end).filter(|_| ball_bar).unwrap_or_else(|| end.to_vec());
        if last != end {
            draft.blocks.push(Block::Comment("Feed-out".into()));
            self.line(self.moved(end, &last, AxisKind::Linear), &mut draft.blocks);
            draft.moves.push(self.moves("feed-out", Mounted::Bar, vec![end.to_vec(), last.clone()]));
        }
        draft.blocks.push(Block::Stop(format!("Stop recording. Take {} off, and hold it", self.instrument())));
        match self.retracted(&last) {
            Some(above) => {
                self.line(self.moved(&last, &above, AxisKind::Linear), &mut draft.blocks);
                draft.moves.push(self.moves("retreat", Mounted::Nothing, vec![last, above]));
            }
            None => draft.warn("Retreat along the tool by hand: the travel ends before the clearance".into()),
        }
    }
}
