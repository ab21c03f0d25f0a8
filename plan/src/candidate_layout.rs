//! Generates the candidate tests: ball position, swept axis, positions of the other axes, bar, and side.

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::instrument::ballbar::{BAR, BallBar};
use abbe_model::session::motion::{Course, FollowOffset, Motion, Moved, Traversals};
use abbe_model::session::{Prior, Session, Test, placing};
use abbe_model::words::{counted, listed};

use super::ball_positions::{BallPosition, axis_positions, ball_count, ball_positions, dot, norm, standing_positions};
use super::sweep::sweep_of;
use super::variations::TestVariations;

/// Least radius about the swept axis, mm. At smaller radii the bar hardly moves.
const MIN_RADIUS_MM: f64 = 10.0;
/// Shortest bar with which linear axes follow, mm: the shortest nominal length less its calibration deviation. With a
/// shorter bar the cups touch.
const MIN_FOLLOWING_MM: f64 = 49.0;

/// A candidate test without its states.
#[derive(Clone)]
pub(super) struct Draft {
    /// The test without its states.
    pub test: Test,
    /// Description of the test.
    pub name: String,
    /// Whether a ball has to be mounted for it.
    pub new_setup: bool,
}

/// Largest number of combinations of the permitted choices. A candidate with its positions takes some 20 kB.
pub(super) const MAX_DRAFTS: usize = 100_000;

/// The error of more combinations than [`MAX_DRAFTS`], with the lists whose lengths multiply.
pub(super) fn too_many(found: String, variations: &TestVariations, with_bars: bool) -> Diagnostic {
    let lists = [
        counted(variations.bars_mm.len(), "bar"),
        counted(variations.radii_mm.len(), "distance of the ball from its axis"),
        counted(variations.heights_mm.len(), "height"),
        counted(variations.feeds.len(), "feed"),
        counted(variations.ranges.len(), "share of the range"),
    ];
    let remedy = format!("state fewer of the {}", listed(&lists[usize::from(!with_bars)..], "and"));
    crate::error::too_many(found, MAX_DRAFTS, remedy)
}

/// The largest possible number of combinations of the permitted choices, counted before any is made.
pub(super) fn draft_count(session: &Session, variations: &TestVariations) -> f64 {
    let machine = &session.machine;
    let rotary: Vec<usize> =
        (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary).collect();
    let count = |list: usize| list as f64;
    let [balls_on_table, balls_in_spindle] =
        [true, false].map(|on_table| ball_count(session, variations, &rotary, on_table));
    let sweeps = count(variations.ranges.len()) * count(variations.both_directions.len());
    // The other ball lies on either side of the circle; linear axes follow in three ways.
    let bars = 2.0 * count(variations.bars_mm.len()) + if variations.follow { 3.0 } else { 0.0 };
    let of_axis = |axis: &usize| {
        let balls = if *axis < machine.workpiece_side { balls_on_table } else { balls_in_spindle };
        let others = rotary.iter().filter(|other| *other != axis);
        let standing: f64 =
            others.map(|other| count(standing_positions(session, variations, *other).count())).product();
        balls * standing * sweeps * count(variations.feeds.len()) * bars
    };
    rotary.iter().map(of_axis).sum()
}

/// All combinations of the permitted choices, before travel and reach are checked.
pub(super) fn drafts(session: &Session, variations: &TestVariations, last: &Test) -> Vec<Draft> {
    let machine = &session.machine;
    let rotary: Vec<usize> =
        (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary).collect();
    let mut drafts = Vec::new();
    for &axis in &rotary {
        let whole = sweep_of(session, axis);
        let traversals = |both: &bool| Traversals::new(whole.traversals.runs(), *both);
        let shares = variations.ranges.iter();
        let sweeps: Vec<(f64, Course)> = shares
            .flat_map(|share| {
                let ways = variations.both_directions.iter().map(traversals);
                ways.map(move |traversals| (*share, Course { traversals, ..whole.part(*share) }))
            })
            .collect();
        let on_table = axis < machine.workpiece_side;
        let turns = |ball: &BallPosition| machine.carriers(ball.ball.frame).any(|carrier| carrier == axis);
        let balls = ball_positions(session, last.station.kind(), variations, &rotary, on_table);
        for ball in balls.into_iter().filter(turns) {
            for at in axis_positions(session, variations, &rotary, axis) {
                let feeds = variations.feeds.iter();
                for (&(share, sweep), &feed) in
                    sweeps.iter().flat_map(|sweep| feeds.clone().map(move |feed| (sweep, feed)))
                {
                    let ball = &ball;
                    let mut at = at.clone();
                    at[axis] = sweep.from;
                    let choice = Choice { session, last, axis, sweep, share, feed, on_table, ball, at: &at };
                    drafts.extend(variations.bars_mm.iter().flat_map(|nominal| choice.on_axis(variations, *nominal)));
                    let upright = at.iter().enumerate().all(|(k, q)| k == axis || *q == 0.0);
                    if let Some(nominal) = following_bar(variations).filter(|_| variations.follow && upright) {
                        drafts.extend(choice.following(variations, nominal));
                    }
                }
            }
        }
    }
    drafts
}

/// The bar for tests in which linear axes follow. Its length only sets the distance of the balls. It is the shortest
/// bar of at least 99 mm, otherwise the longest bar that keeps the cups apart.
fn following_bar(variations: &TestVariations) -> Option<f64> {
    let bars = || variations.bars_mm.iter().copied().filter(|bar| *bar >= MIN_FOLLOWING_MM);
    bars().filter(|bar| *bar >= 99.0).min_by(f64::total_cmp).or_else(|| bars().max_by(f64::total_cmp))
}

struct Choice<'b> {
    session: &'b Session,
    last: &'b Test,
    axis: usize,
    sweep: Course,
    /// The share of the range of the axis that it covers.
    share: f64,
    /// Multiple of the sweep's speed.
    feed: f64,
    on_table: bool,
    ball: &'b BallPosition,
    at: &'b [f64],
}

impl Choice<'_> {
    /// The calibrated length of the bar in the session, or its nominal length.
    fn length(&self, nominal: f64) -> f64 {
        let mut bars = self.session.tests.iter().filter_map(|test| Some(test.station.bar()?.bar));
        bars.find(|bar| (bar - nominal).abs() <= 1.0).unwrap_or(nominal)
    }

    fn station(&self, nominal: f64) -> BallBar<f64> {
        let mut bar = self.last.station.bar().cloned().unwrap_or(BallBar::ORIGINS);
        bar.bar = self.length(nominal);
        if self.on_table {
            bar.workpiece_ball = self.ball.ball;
        } else {
            bar.spindle_ball = self.ball.ball;
        }
        bar
    }

    fn draft(&self, nominal: f64, station: BallBar<f64>, at: Vec<f64>, motion: Motion, words: &str) -> Draft {
        let machine = &self.session.machine;
        let axis = &machine.axes[self.axis];
        let (origin, along) = placing::axis_line(machine, &at, self.axis);
        let (workpiece, spindle) = placing::balls(machine, &station, &at);
        let carried = if self.on_table { workpiece } else { spindle };
        let from: [f64; 3] = std::array::from_fn(|i| carried[i] - origin[i]);
        let height = dot(from, along);
        let radius = (dot(from, from) - height * height).max(0.0).sqrt();
        let ball = if self.on_table { "workpiece ball" } else { "spindle ball" };
        let mut name = format!("{}{nominal:.0} with the {ball} at radius {radius:.0} mm", axis.name);
        if height.abs() >= 0.5 {
            name.push_str(&format!(", height {height:.0} mm").replace('-', "−"));
        }
        for (k, other) in machine.axes.iter().enumerate() {
            if k != self.axis && other.kind == AxisKind::Rotary && at[k] != 0.0 {
                name.push_str(&format!(", {} at {:.0}°", other.name, at[k].to_degrees()).replace('-', "−"));
            }
        }
        name.push_str(words);
        let both_directions = self.sweep.traversals.both_directions();
        if self.share < 1.0 || !both_directions {
            let [from, to] = [self.sweep.from, self.sweep.to].map(f64::to_degrees);
            let ways = if both_directions { "in both directions" } else { "in one direction" };
            name.push_str(&format!(", swept {from:.0} … {to:.0}° {ways}").replace('-', "−"));
        }
        if self.feed != 1.0 {
            name.push_str(&format!(", at {} times the feed", self.feed));
        }
        if !self.ball.new {
            name.push_str(&format!(" ({ball} as in {})", self.ball.setup));
        }
        let unique = "proposed";
        let setup = match (self.on_table, self.ball.new) {
            (true, false) => self.ball.setup.clone(),
            (true, true) => unique.to_string(),
            (false, _) => self.last.setup.clone(),
        };
        let priors = self.priors(nominal);
        let proposed = Test::new(unique, station.into(), at.len());
        let test = Test { priors, setup, motion: Some(motion), at, ..proposed };
        Draft { test, name, new_setup: self.ball.new }
    }

    /// The sweep at its feed, with every n-th position.
    fn course(&self, variations: &TestVariations) -> Course {
        Course {
            step: self.sweep.step * variations.thin.max(1) as f64,
            speed: self.sweep.speed * self.feed,
            ..self.sweep
        }
    }

    /// The set-up priors: those of the session's last test, and for the bar those of the same bar.
    fn priors(&self, nominal: f64) -> Vec<Prior> {
        let mut priors = self.last.priors.clone();
        let is_same = |test: &&Test| test.station.bar().is_some_and(|bar| (bar.bar - nominal).abs() <= 1.0);
        let same_bar = self.session.tests.iter().find(is_same);
        if let Some(test) = same_bar {
            priors[BAR] = test.priors[BAR];
        }
        priors
    }

    /// Places the other ball on the swept axis: in the plane of the circle if the bar is as long as the radius,
    /// otherwise beside that plane.
    fn on_axis(&self, variations: &TestVariations, nominal: f64) -> Vec<Draft> {
        let machine = &self.session.machine;
        let station = self.station(nominal);
        let (origin, along) = placing::axis_line(machine, self.at, self.axis);
        let (workpiece, spindle) = placing::balls(machine, &station, self.at);
        let carried = if self.on_table { workpiece } else { spindle };
        let from: [f64; 3] = std::array::from_fn(|i| carried[i] - origin[i]);
        let height = dot(from, along);
        let radial: [f64; 3] = std::array::from_fn(|i| from[i] - height * along[i]);
        let radius = norm(radial);
        if radius < MIN_RADIUS_MM || station.bar < radius - variations.reach_mm {
            return Vec::new();
        }
        let beside = if (station.bar - radius).abs() <= variations.reach_mm {
            vec![0.0]
        } else {
            let beside = (station.bar.powi(2) - radius.powi(2)).sqrt();
            vec![beside, -beside]
        };
        let outward = self.outward();
        beside
            .into_iter()
            .filter_map(|beside| {
                // The vector from the carried ball to the other one.
                let across: [f64; 3] = std::array::from_fn(|i| beside * along[i] - radial[i]);
                let wanted = if self.on_table { across } else { across.map(|x| -x) };
                if outward.is_some_and(|outward| dot(wanted, outward) < -MIN_RADIUS_MM) {
                    return None;
                }
                let at = placing::positions_for_bar(machine, &station, self.at, wanted)?;
                let motion = Motion { moved: Moved::Axis(self.axis), course: self.course(variations) };
                let words = if beside == 0.0 {
                    String::new()
                } else {
                    let side = if beside > 0.0 { "+" } else { "−" };
                    format!(", other ball {side}{:.0} mm along {}", beside.abs(), machine.axes[self.axis].name)
                };
                Some(self.draft(nominal, station.clone(), at, motion, &words))
            })
            .collect()
    }

    /// The outward direction of a vertical table axis that carries the ball itself. No other ball can be below the
    /// table.
    fn outward(&self) -> Option<[f64; 3]> {
        let machine = &self.session.machine;
        let table = machine.axes.first().filter(|axis| self.on_table && axis.kind == AxisKind::Rotary)?;
        let up = table.direction[2];
        (self.axis == 0 && up.abs() > 0.9).then(|| {
            let (_, along) = placing::axis_line(machine, self.at, 0);
            along.map(|x| x * up.signum())
        })
    }

    /// Tests in which the linear axes keep the bar radial, tangential or axial.
    fn following(&self, variations: &TestVariations, nominal: f64) -> Vec<Draft> {
        let offsets = [
            (FollowOffset::Radial, "radial"),
            (FollowOffset::Tangential, "tangential"),
            (FollowOffset::Axial, "axial"),
        ];
        offsets
            .into_iter()
            .map(|(offset, word)| {
                let motion =
                    Motion { moved: Moved::Follow { axis: self.axis, offset }, course: self.course(variations) };
                let words = format!(", linear axes following with the bar {word}");
                self.draft(nominal, self.station(nominal), self.at.to_vec(), motion, &words)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;

    use super::*;

    /// A bar of the session keeps its calibrated length and its uncertainty in every candidate; another bar has its
    /// nominal length and the uncertainty of the last one. The balls have the uncertainties of the last test.
    #[test]
    fn candidates_have_the_bars_of_the_session() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/chapter5.toml");
        let mut session =
            abbe_files::session(&file, &ReadOptions { read_data: false, ..ReadOptions::default() }).unwrap();
        let bars = [(99.9881, 1e-4), (149.9946, 2e-4), (100.4, 7e-4)];
        for (test, (bar, u)) in session.tests.iter_mut().zip(bars.into_iter().chain([(310.0, 9e-4)])) {
            let Some(station) = test.station.bar_mut() else { panic!("a ball bar") };
            station.bar = bar;
            test.priors[BAR] = Prior::Gaussian(u);
        }
        let last = session.tests[3].clone();
        let mut seen = std::collections::BTreeSet::new();
        for nominal in [50.0, 100.0, 150.0] {
            let variations = TestVariations { bars_mm: vec![nominal], ..TestVariations::short() };
            for draft in drafts(&session, &variations, &last) {
                let Some(station) = draft.test.station.bar() else { panic!("a ball bar") };
                let wanted = match nominal {
                    100.0 => (99.9881, 1e-4),
                    150.0 => (149.9946, 2e-4),
                    _ => (nominal, 9e-4),
                };
                assert_eq!(
                    (station.bar, draft.test.priors[BAR]),
                    (wanted.0, Prior::Gaussian(wanted.1)),
                    "{}",
                    draft.name
                );
                assert_eq!(draft.test.priors[..BAR], last.priors[..BAR], "{}", draft.name);
                seen.insert(nominal as i64);
            }
        }
        assert_eq!(seen.into_iter().collect::<Vec<_>>(), [50, 100, 150]);
    }
}
