//! Candidate tests of instruments without a bar: motions of the axes, and the set-ups of the instrument that read them.
//!
//! - a linear axis over its travel, with each of the others where the session holds it and at both ends of its travel;
//! - a rotary axis over its range, with the others at the permitted positions;
//! - a rotary axis with linear axes that keep two points in contact, and alone about a point on it;
//! - a circle of two linear axes about the artefact of a probe.
//!
//! What the instrument is set up for such a motion follows from the instrument ([`Instrument::aligned`],
//! [`Instrument::approaches`], [`Instrument::circled`]).
//!
//! [`Instrument::aligned`]: abbe_model::instrument::Instrument::aligned
//! [`Instrument::approaches`]: abbe_model::instrument::Instrument::approaches
//! [`Instrument::circled`]: abbe_model::instrument::Instrument::circled

use std::collections::HashSet;
use std::f64::consts::{PI, TAU};

use abbe_identify::start;
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::instrument::{Following, InstrumentKind, Station, Target, Travel};
use abbe_model::session::motion::{Course, FollowOffset, Motion, Moved, Traversals};
use abbe_model::session::{Prior, Session, Test, placing};
use abbe_model::words::{listed, number};

use super::ball_positions::{BallPosition, axis_positions, ball_count, ball_positions, dot, standing_positions};
use super::candidate_layout::{Draft, MAX_DRAFTS, too_many};
use super::variations::TestVariations;

/// The name of a candidate, and of what is mounted for it.
const PROPOSED: &str = "proposed";
/// Steps of a motion that no test of the session has.
const STEPS: f64 = 30.0;
/// Farther travels are none: a file that states 10⁹ means that the axis has no ends, mm or rad.
const NO_TRAVEL: f64 = 1e6;
/// Speed of an axis that no test of the session moves: 1000 mm/min, 2 °/s.
const SPEED_MM_S: f64 = 1000.0 / 60.0;
const SPEED_RAD_S: f64 = 2.0 / 180.0 * PI;
/// Tests whose set-up candidates keep, the last of them.
const MAX_TEMPLATES: usize = 4;

/// A motion of one axis, as tests have it.
#[derive(Clone, Copy)]
struct Range {
    course: Course,
    /// Multiple of the speed of tests of the axis.
    feed: f64,
}

/// The candidates of an instrument that has no bar, before travel and reach are checked.
///
/// # Errors
/// If there are more than [`MAX_DRAFTS`].
pub(super) fn drafts(
    session: &Session,
    variations: &TestVariations,
    kind: InstrumentKind,
) -> Result<Vec<Draft>, Diagnostic> {
    let placed = start::stations(session, &session.tests);
    let mut templates: Vec<(&Test, &Station<f64>)> = Vec::new();
    for (test, station) in session.tests.iter().zip(&placed).rev().filter(|(test, _)| test.station.kind() == kind) {
        let is_same = |other: &Test| {
            other.station == test.station && (&other.setup, &other.spindle_setup) == (&test.setup, &test.spindle_setup)
        };
        if templates.len() < MAX_TEMPLATES && !templates.iter().any(|(other, _)| is_same(other)) {
            templates.push((test, station));
        }
    }
    let templates: Vec<Template<'_>> =
        templates.into_iter().map(|(test, station)| Template { session, variations, test, station }).collect();
    // What is in contact needs one of them: every place on the table is a candidate.
    let count = templates.iter().map(Template::count_of_one_axis).sum::<f64>()
        + templates.first().map_or(0.0, Template::count_in_contact);
    if count > MAX_DRAFTS as f64 {
        let found = format!("up to {} candidate tests of {}", number(count), kind.entry().phrase);
        return Err(too_many(found, variations, false));
    }
    let in_contact = templates.first().and_then(Template::contacts);
    let mut drafts: Vec<Draft> = templates.iter().flat_map(Template::moves_of_one_axis).collect();
    drafts.extend(in_contact.iter().flat_map(Contacts::drafts));
    // Numbers are compared by their digits, which tell any two apart.
    let mut known = HashSet::new();
    drafts.retain(|Draft { test, .. }| {
        known.insert(format!("{:?}", (&test.station, &test.at, &test.motion, &test.setup, &test.spindle_setup)))
    });
    Ok(drafts)
}

/// A test of the session whose set-up candidates have, as far as they can.
struct Template<'s> {
    session: &'s Session,
    variations: &'s TestVariations,
    test: &'s Test,
    /// Where its instrument stands.
    station: &'s Station<f64>,
}

impl Template<'_> {
    fn machine(&self) -> &Machine {
        &self.session.machine
    }

    /// The motions of an axis: shares of its range about its middle, one way or both, at each feed.
    fn ranges(&self, axis: usize) -> impl Iterator<Item = Range> {
        let TestVariations { ranges, both_directions, feeds, .. } = self.variations;
        let one_or_both = |own: Course| {
            let traversals = move |both: &bool| Traversals::new(own.traversals.runs(), *both);
            both_directions.iter().map(move |both| Course { traversals: traversals(both), ..own })
        };
        let at_feed = |own: Course, feed: f64| Range { course: Course { speed: own.speed * feed, ..own }, feed };
        let own = course(self.session, axis).into_iter();
        own.flat_map(move |own| ranges.iter().map(move |share| own.part(*share)))
            .flat_map(one_or_both)
            .flat_map(move |own| feeds.iter().map(move |feed| at_feed(own, *feed)))
    }

    /// How often one axis moves while the others stand, with the instrument set up in one way.
    fn count_of_one_axis(&self) -> f64 {
        let axes = 0..self.machine().axes.len();
        axes.map(|axis| self.postures(axis).len() as f64 * self.count_of_ranges(axis)).sum()
    }

    /// The number of [`Template::ranges`].
    fn count_of_ranges(&self, axis: usize) -> f64 {
        let TestVariations { ranges, both_directions, feeds, .. } = self.variations;
        let own = course(self.session, axis).map_or(0.0, |_| 1.0);
        own * [ranges.len(), both_directions.len(), feeds.len()].map(|count| count as f64).iter().product::<f64>()
    }

    /// The largest possible number of candidates with two points in contact.
    fn count_in_contact(&self) -> f64 {
        let approaches = self.station.approaches().len() as f64;
        if approaches == 0.0 {
            return 0.0;
        }
        let rotary = self.rotary();
        let turns = rotary.iter().map(|axis| {
            axis_positions(self.session, self.variations, &rotary, *axis).len() as f64 * self.count_of_ranges(*axis)
        });
        let ways = if self.variations.follow { 2.0 } else { 1.0 };
        let points = ball_count(self.session, &self.with_the_axis(), &rotary, true);
        points * (1.0 + approaches * turns.sum::<f64>() * ways)
    }

    fn rotary(&self) -> Vec<usize> {
        let machine = self.machine();
        (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary).collect()
    }

    /// The variations with points on the axis too.
    fn with_the_axis(&self) -> TestVariations {
        let radii_mm = std::iter::once(0.0).chain(self.variations.radii_mm.iter().copied()).collect();
        TestVariations { radii_mm, ..self.variations.clone() }
    }

    /// One axis moves, the others stand.
    fn moves_of_one_axis(&self) -> Vec<Draft> {
        let machine = self.machine();
        let mut drafts = Vec::new();
        for axis in 0..machine.axes.len() {
            for (at, range) in self.postures(axis).iter().flat_map(|at| self.ranges(axis).map(move |range| (at, range)))
            {
                let (_, direction) = placing::axis_line(machine, at, axis);
                for aligned in self.station.aligned(&Travel { machine, axis, direction }) {
                    let mut at = at.clone();
                    at[axis] = range.course.from;
                    let mut words = moved_words(machine, axis, range) + &self.stand_words(&at, axis);
                    if !aligned.words.is_empty() {
                        words += &format!(", {}", aligned.words);
                    }
                    let motion = self.motion(Moved::Axis(axis), range);
                    let mounts = match aligned.is_new {
                        true => [PROPOSED.to_string(), PROPOSED.to_string()],
                        false => [self.test.setup.clone(), self.test.spindle_setup.clone()],
                    };
                    drafts.push(self.draft(aligned.station, at, motion, words, mounts, aligned.is_new));
                }
            }
        }
        drafts
    }

    /// Where the axes stand while one moves: as in the tests of the session, and each at the ends of its travel or at the
    /// permitted positions while the rest are at zero.
    fn postures(&self, moved: usize) -> Vec<Vec<f64>> {
        let machine = self.machine();
        let zero = |axis: usize| match travel(machine, axis) {
            Some([low, high]) if low > 0.0 || high < 0.0 => 0.5 * (low + high),
            _ => 0.0,
        };
        let home: Vec<f64> = (0..machine.axes.len()).map(zero).collect();
        let mut postures = vec![home.clone()];
        let mut add = |mut at: Vec<f64>| {
            at[moved] = home[moved];
            if !postures.contains(&at) {
                postures.push(at);
            }
        };
        let planned = self.session.tests.iter().filter(|test| test.readings.is_none() || test.motion.is_some());
        planned.for_each(|test| add(test.at.clone()));
        for other in (0..machine.axes.len()).filter(|other| *other != moved) {
            let stands: Vec<f64> = match (machine.axes[other].kind, travel(machine, other)) {
                (AxisKind::Linear, ends) => ends.map_or(Vec::new(), |ends| ends.to_vec()),
                (AxisKind::Rotary, _) => standing_positions(self.session, self.variations, other).collect(),
            };
            for stand in stands {
                let mut at = home.clone();
                at[other] = stand;
                add(at);
            }
        }
        postures
    }

    /// Two points stay in contact: linear axes follow a rotary one, a rotary axis turns about the point on it, the tool goes
    /// round an artefact. `None` for an instrument without contact.
    fn contacts(&self) -> Option<Contacts<'_>> {
        let approaches = self.station.approaches();
        if approaches.is_empty() {
            return None;
        }
        let rotary = self.rotary();
        let points = ball_positions(self.session, self.station.kind(), &self.with_the_axis(), &rotary, true);
        let of_axis = |axis: &usize| {
            let positions = axis_positions(self.session, self.variations, &rotary, *axis).into_iter();
            positions.flat_map(|at| self.ranges(*axis).map(move |range| (*axis, at.clone(), range))).collect::<Vec<_>>()
        };
        let turns = rotary.iter().flat_map(of_axis).collect();
        Some(Contacts { template: self, points, approaches, turns })
    }

    /// Circles of two linear axes about an artefact.
    fn circles(&self, point: &BallPosition) -> Vec<Draft> {
        let machine = self.machine();
        let Some((radius, axis)) = self.station.circled() else { return Vec::new() };
        let linear: Vec<usize> =
            (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Linear).collect();
        let is_across = |k: &usize| dot(machine.axes[*k].direction, axis).abs() < 1e-6;
        let across: Vec<usize> = linear.into_iter().filter(is_across).collect();
        let [first, second] = across[..] else { return Vec::new() };
        let Some(at) = self.touching(point, [0.0; 3], &vec![0.0; machine.axes.len()]) else { return Vec::new() };
        let turn =
            Course { from: 0.0, to: TAU, step: TAU / STEPS, speed: SPEED_MM_S, traversals: Traversals::new(1, true) };
        let moved = Moved::Circle { axes: [first, second], radius, centre: [0.0; 3] };
        let motion = self.motion(moved, Range { course: turn, feed: 1.0 });
        let names = [first, second].map(|k| machine.axes[k].name.as_str()).concat();
        let words = format!("a circle in {names} about the artefact{}", self.place_words(point));
        vec![self.at_point(point, at, motion, words)]
    }

    /// The positions at which the tool's point is beside a point of the table. `approach` is in the table frame.
    fn touching(&self, point: &BallPosition, approach: [f64; 3], at: &[f64]) -> Option<Vec<f64>> {
        let machine = self.machine();
        let state = machine.axis_positions(at);
        let beside = Target { mm: std::array::from_fn(|i| point.ball.mm[i] + approach[i]), ..point.ball };
        let (from, to) = (point.ball.nominal_mm(machine, &state), beside.nominal_mm(machine, &state));
        let bar = BallBar { workpiece_ball: point.ball, spindle_ball: self.station.tool_point(), bar: 0.0 };
        placing::positions_for_bar(machine, &bar, at, std::array::from_fn(|i| to[i] - from[i]))
    }

    /// A candidate with the instrument's point of the table at a place.
    fn at_point(&self, point: &BallPosition, at: Vec<f64>, motion: Motion, words: String) -> Draft {
        let mut station = self.station.clone();
        if let [Some(own), _] = station.points_mut() {
            *own = point.ball;
        }
        let setup = if point.new { PROPOSED.to_string() } else { point.setup.clone() };
        self.draft(station, at, motion, words, [setup, PROPOSED.to_string()], point.new)
    }

    fn draft(
        &self,
        station: Station<f64>,
        at: Vec<f64>,
        motion: Motion,
        words: String,
        [setup, spindle_setup]: [String; 2],
        new_setup: bool,
    ) -> Draft {
        let mut priors: Vec<Prior> = self.test.priors.clone();
        station.absent_channels_known(&mut priors);
        let contributors = self.test.contributors;
        let proposed = Test::new(PROPOSED, station, at.len());
        let test = Test { priors, setup, spindle_setup, motion: Some(motion), at, contributors, ..proposed };
        Draft { test, name: words, new_setup }
    }

    /// A motion with every n-th position.
    fn motion(&self, moved: Moved, Range { course, .. }: Range) -> Motion {
        let step = course.step * self.variations.thin.max(1) as f64;
        Motion { moved, course: Course { step, ..course } }
    }

    /// Where the axes stand that do not move: `, with Y at 200 mm`.
    fn stand_words(&self, at: &[f64], moved: usize) -> String {
        let machine = self.machine();
        let stands = (0..at.len()).filter(|k| *k != moved && at[*k].abs() > 1e-9);
        let words: Vec<String> = stands.map(|k| position(machine, k, at[k])).collect();
        if words.is_empty() { String::new() } else { format!(", with {}", listed(&words, "and")) }
    }

    /// Where the instrument's point of the table is.
    fn place_words(&self, point: &BallPosition) -> String {
        if !point.new {
            return format!(" as in {}", point.setup);
        }
        let [x, y, z] = point.ball.mm.map(|mm| number((mm * 10.0).round() / 10.0));
        format!(" at ({x}, {y}, {z}) mm of the table")
    }

    fn contact_words(&self, at: &[f64], axis: usize, range: Range, point: &BallPosition, approach: [f64; 3]) -> String {
        let machine = self.machine();
        let rotary = (0..at.len()).filter(|k| machine.axes[*k].kind == AxisKind::Rotary && *k != axis);
        let turned: Vec<String> = rotary.filter(|k| at[*k] != 0.0).map(|k| position(machine, k, at[k])).collect();
        let turned = if turned.is_empty() { String::new() } else { format!(", with {}", listed(&turned, "and")) };
        let name = self.station.points()[0].map_or("point", |point| point.name);
        let side = match (0..3).find(|i| approach[*i].abs() > 0.7 * self.station.circled().map_or(1.0, |(r, _)| r)) {
            Some(i) if self.station.circled().is_some() => {
                format!(" from {}{}", if approach[i] < 0.0 { "−" } else { "+" }, ["X", "Y", "Z"][i])
            }
            _ => String::new(),
        };
        format!("{}{turned}, {name}{}{side}", moved_words(machine, axis, range), self.place_words(point))
    }
}

/// `Y at 200 mm`.
fn position(machine: &Machine, axis: usize, q: f64) -> String {
    let axis = &machine.axes[axis];
    format!("{} at {}", axis.name, axis.kind.unit().behind(shown(axis.kind.to_display(q))))
}

/// The candidates with two points in contact.
struct Contacts<'t> {
    template: &'t Template<'t>,
    /// Where the instrument's point of the table may lie.
    points: Vec<BallPosition>,
    /// The directions from which the tool comes.
    approaches: Vec<[f64; 3]>,
    /// The rotary axis that turns, the positions of the axes, and its motion.
    turns: Vec<(usize, Vec<f64>, Range)>,
}

impl Contacts<'_> {
    fn drafts(&self) -> Vec<Draft> {
        let template = self.template;
        let mut drafts = Vec::new();
        for (axis, at, range) in &self.turns {
            for point in &self.points {
                for approach in &self.approaches {
                    // With the axis at zero, as a file that states no position of the moved axis is read.
                    let Some(at) = template.touching(point, *approach, at) else { continue };
                    let words = template.contact_words(&at, *axis, *range, point, *approach);
                    let offset = match template.station.following() {
                        Following::AtBar => continue,
                        Following::Touching(..) => FollowOffset::Touching,
                        Following::Apart => FollowOffset::None,
                    };
                    let follow = (Moved::Follow { axis: *axis, offset }, ", the linear axes follow");
                    let follow = template.variations.follow.then_some(follow);
                    for (moved, way) in follow.into_iter().chain([(Moved::Axis(*axis), ", the linear axes stand")]) {
                        let motion = template.motion(moved, *range);
                        drafts.push(template.at_point(point, at.clone(), motion, format!("{words}{way}")));
                    }
                }
            }
        }
        drafts.extend(self.points.iter().flat_map(|point| template.circles(point)));
        drafts
    }
}

fn moved_words(machine: &Machine, axis: usize, range: Range) -> String {
    let axis = &machine.axes[axis];
    let Range { course, feed } = range;
    let [from, to] = [course.from, course.to].map(|q| shown(axis.kind.to_display(q)));
    let ways = if course.traversals.both_directions() { "" } else { " in one direction" };
    let feed = if feed == 1.0 { String::new() } else { format!(" at {feed} times the feed") };
    format!("{} from {from} to {}{ways}{feed}", axis.name, axis.kind.unit().behind(to))
}

fn shown(value: f64) -> String {
    number((value * 10.0).round() / 10.0).replace('-', "−")
}

/// The travel of an axis, if it has ends.
fn travel(machine: &Machine, axis: usize) -> Option<[f64; 2]> {
    machine.axes[axis].travel.filter(|ends| ends.iter().all(|end| end.abs() < NO_TRAVEL))
}

/// The course of an axis: that of a test of the session, else over that of its readings or its travel, a rotary axis within
/// half a turn of zero. `None` of a linear axis of which neither is known.
fn course(session: &Session, axis: usize) -> Option<Course> {
    let kind = session.machine.axes[axis].kind;
    let motions = session.tests.iter().filter_map(|test| test.motion.as_ref());
    let courses: Vec<(usize, Course)> = motions.filter_map(|motion| Some((motion.axis()?, motion.course))).collect();
    if let Some((_, own)) = courses.iter().find(|(moved, _)| *moved == axis) {
        return Some(*own);
    }
    let ends = || {
        let columns = session.tests.iter().filter_map(|test| test.readings.as_ref()?.positions.get(axis));
        let read = columns.flatten().copied().filter(|q| q.is_finite());
        let [low, high] = read.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| [low.min(q), high.max(q)]);
        (high - low > 1e-6).then_some([low, high])
    };
    let [low, high] = match (kind, travel(&session.machine, axis)) {
        (AxisKind::Linear, travel) => travel.or_else(ends)?,
        (AxisKind::Rotary, travel) => {
            let [low, high] = travel.unwrap_or([-PI, PI]);
            [low.max(-PI), high.min(PI)]
        }
    };
    if high - low <= 1e-9 {
        return None;
    }
    let alike = courses.iter().rev().find(|(moved, _)| session.machine.axes[*moved].kind == kind);
    let usual = if kind == AxisKind::Rotary { SPEED_RAD_S } else { SPEED_MM_S };
    Some(Course {
        from: low,
        to: high,
        step: kind.to_internal(nice(kind.to_display(high - low) / STEPS)),
        speed: alike.map_or(usual, |(_, course)| course.speed),
        traversals: courses.last().map_or(Traversals::default(), |(_, course)| course.traversals),
    })
}

/// The largest of 1, 2, 5, 10, … that is no larger.
fn nice(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|digit| digit * power).find(|nice| *nice <= step * (1.0 + 1e-9)).unwrap_or(power)
}

#[cfg(test)]
mod tests;
