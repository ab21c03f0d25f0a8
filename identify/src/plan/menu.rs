//! The menu of ball-bar tests from which a next one is proposed: what may be varied, and which of it the machine can do.
//!
//! An entry sweeps one rotary axis while the other ball stands on that axis (at the foot of the circle or beside it, as the bar's length
//! demands), or lets the linear axes keep the bar radial, tangential or axial. Both directions and the whole range are always taken: less
//! never sees more. What an axis' travel forbids, or a bar cannot reach, is not on the menu.

use abbe_model::axis::AxisKind;
use abbe_model::instrument::Station;
use abbe_model::instrument::ballbar::{BAR, BallBar};
use abbe_model::session::expression::Length;
use abbe_model::session::motion::{FollowOffset, Motion};
use abbe_model::session::{Prior, Session, Test, placing};
use rayon::prelude::*;

use super::states;
use crate::error::IdentifyError;

/// What may be varied. Lengths in mm, times in min.
#[derive(Clone, Debug)]
pub struct Menu {
    /// Bars of the kit, nominal lengths.
    pub bars_mm: Vec<f64>,
    /// Distances of the ball from the axis that it is mounted about.
    pub radii_mm: Vec<f64>,
    /// Heights of the ball along that axis, both ways except below the table.
    pub heights_mm: Vec<f64>,
    /// Where the other rotary axis stands.
    pub standing_deg: Vec<f64>,
    /// Whether linear axes may follow.
    pub follow: bool,
    /// Whether a test may leave the spindle ball mounted from the last test before it.
    pub keep_spindle_ball: bool,
    /// Travel of a bar's sensor either way.
    pub reach_mm: f64,
    /// Mounting a ball anew.
    pub setup_min: f64,
    /// Preparing a test: bar, position, feed-in.
    pub test_min: f64,
    /// Evaluate every n-th position only, its information counted n times.
    pub thin: usize,
}

impl Default for Menu {
    /// A kit of 50, 100, 150 and 300 mm; a set-up takes five minutes, preparing a test one.
    fn default() -> Self {
        Menu {
            bars_mm: vec![50.0, 100.0, 150.0, 300.0],
            radii_mm: vec![50.0, 75.0, 100.0, 150.0],
            heights_mm: vec![0.0, 50.0, 100.0, 200.0],
            standing_deg: vec![0.0, 90.0, -90.0, 180.0],
            follow: true,
            keep_spindle_ball: true,
            reach_mm: 1.0,
            setup_min: 5.0,
            test_min: 1.0,
            thin: 1,
        }
    }
}

/// A test that can be made.
#[derive(Clone, Debug)]
pub struct Entry {
    /// In words: `C150 with the workpiece ball at radius 50 mm`.
    pub name: String,
    /// The test with its planned states.
    pub test: Test,
    /// Whether a ball has to be mounted anew.
    pub new_setup: bool,
    /// What it takes, min.
    pub minutes: f64,
}

/// How an axis is swept in the tests that there are.
#[derive(Clone, Copy, Debug)]
struct Sweep {
    from: f64,
    to: f64,
    step: f64,
    speed: f64,
    runs: usize,
}

/// Least radius about a swept axis that a test is made at, mm: nearer, the bar hardly moves.
const LEAST_RADIUS_MM: f64 = 10.0;
/// A ball nearer than this to one that is mounted already is that one, mm.
const SAME_PLACE_MM: f64 = 0.5;

/// The entries that a session's machine can do. The session is complete (see [`states::complete`]).
///
/// # Errors
/// If the instrument is no ball bar, or no rotary axis can be swept.
pub fn entries(session: &Session, menu: &Menu) -> Result<Vec<Entry>, IdentifyError> {
    let Some(last) = session
        .tests
        .last()
        .filter(|test| matches!(test.station, Station::BallBar(_)))
    else {
        return Err(IdentifyError::Request(
            "a next test can be proposed for ball bars only; this session has another instrument".to_string(),
        ));
    };
    let drafts = drafts(session, menu, last);
    let entries: Vec<Entry> = drafts
        .into_par_iter()
        .filter_map(|draft| finished(session, menu, draft))
        .collect();
    if entries.is_empty() {
        return Err(IdentifyError::Request(
            "nothing on the menu can be made on this machine: no bar reaches, or the travel is too short"
                .to_string(),
        ));
    }
    Ok(entries)
}

/// An entry before its states are planned.
struct Draft {
    test: Test,
    name: String,
    new_setup: bool,
}

/// A place of the carried ball: where, and under which set-up.
struct Place {
    ball: [f64; 3],
    setup: String,
    new: bool,
}

fn drafts(session: &Session, menu: &Menu, last: &Test) -> Vec<Draft> {
    let machine = &session.machine;
    let rotary: Vec<usize> = (0..machine.axes.len())
        .filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary)
        .collect();
    let mut drafts = Vec::new();
    for &axis in &rotary {
        let sweep = sweep_of(session, axis);
        let on_table = axis < machine.workpiece_side;
        for place in places(session, menu, &rotary, on_table) {
            for at in standings(session, menu, &rotary, axis, sweep.from) {
                let base = Base {
                    session,
                    last,
                    axis,
                    sweep,
                    on_table,
                    place: &place,
                    at: &at,
                };
                drafts.extend(
                    menu.bars_mm
                        .iter()
                        .flat_map(|nominal| base.on_axis(menu, *nominal)),
                );
                let upright = at.iter().enumerate().all(|(k, q)| k == axis || *q == 0.0);
                if let Some(nominal) = following_bar(menu).filter(|_| menu.follow && upright) {
                    drafts.extend(base.following(menu, nominal));
                }
            }
        }
    }
    drafts
}

/// The bar for tests in which linear axes follow, where its length changes nothing but how far the balls are apart: the shortest that keeps
/// them 100 mm apart, else the longest.
fn following_bar(menu: &Menu) -> Option<f64> {
    let bars = || menu.bars_mm.iter().copied();
    bars()
        .filter(|bar| *bar >= 99.0)
        .min_by(f64::total_cmp)
        .or_else(|| bars().max_by(f64::total_cmp))
}

/// How an axis is swept: as the session does it, else as far as its travel goes, within half a turn either way.
fn sweep_of(session: &Session, axis: usize) -> Sweep {
    let planned = session.tests.iter().find_map(|test| match &test.motion {
        Some(Motion::Sweep {
            axis: swept,
            from,
            to,
            step,
            speed,
            runs,
            ..
        }) if *swept == axis => Some(Sweep {
            from: *from,
            to: *to,
            step: *step,
            speed: *speed,
            runs: *runs,
        }),
        _ => None,
    });
    planned
        .or_else(|| sweep_of_data(session, axis))
        .unwrap_or_else(|| {
            let turn = std::f64::consts::PI;
            let [low, high] = session.machine.axes[axis].travel.unwrap_or([-turn, turn]);
            Sweep {
                from: low.max(-turn),
                to: high.min(turn),
                step: 0.5_f64.to_radians(),
                speed: 5.0_f64.to_radians(),
                runs: 2,
            }
        })
}

/// How an axis was swept in the data.
fn sweep_of_data(session: &Session, axis: usize) -> Option<Sweep> {
    session
        .tests
        .iter()
        .filter_map(|test| test.readings.as_ref())
        .find_map(|readings| {
            let positions = readings.positions.get(axis)?;
            let first = readings.runs().first()?.clone();
            let run = &positions[first.clone()];
            let (from, to) = (run.first().copied()?, run.last().copied()?);
            if readings.run.is_empty() || (to - from).abs() < 0.1 || run.len() < 3 {
                return None;
            }
            let step = (to - from).abs() / (run.len() - 1) as f64;
            let elapsed = readings
                .time_s
                .get(first.end - 1)
                .zip(readings.time_s.get(first.start));
            let speed = elapsed.map_or(0.0, |(end, start)| (to - from).abs() / (end - start));
            let speed = if speed.is_finite() && speed > 0.0 {
                speed
            } else {
                5.0_f64.to_radians()
            };
            Some(Sweep {
                from,
                to,
                step,
                speed,
                runs: readings.runs().len().div_ceil(2),
            })
        })
}

/// Where the carried ball may be: as it is mounted in the session, or anew about each rotary axis of its side.
fn places(session: &Session, menu: &Menu, rotary: &[usize], on_table: bool) -> Vec<Place> {
    let machine = &session.machine;
    let mut places: Vec<Place> = Vec::new();
    for test in &session.tests {
        let Station::BallBar(bar) = &test.station else {
            continue;
        };
        let (ball, setup) = if on_table {
            (bar.workpiece_ball, test.setup.clone())
        } else {
            (bar.spindle_ball, test.spindle_setup.clone())
        };
        if on_table && !places.iter().any(|place| place.setup == setup) {
            places.push(Place {
                ball,
                setup,
                new: false,
            });
        }
    }
    for &about in rotary
        .iter()
        .filter(|axis| (**axis < machine.workpiece_side) == on_table)
    {
        let axis = &machine.axes[about];
        let across = across(axis.direction);
        let carries_table = on_table && about == 0;
        for &radius in &menu.radii_mm {
            for &height in &menu.heights_mm {
                let both = if carries_table || height == 0.0 {
                    &[1.0][..]
                } else {
                    &[1.0, -1.0][..]
                };
                for sign in both {
                    let up = if axis.direction[2] < 0.0 { -1.0 } else { 1.0 };
                    let ball: [f64; 3] = std::array::from_fn(|i| {
                        axis.origin_mm[i] + up * sign * height * axis.direction[i] + radius * across[i]
                    });
                    let taken = places
                        .iter()
                        .any(|place| distance(place.ball, ball) < SAME_PLACE_MM);
                    if !taken {
                        places.push(Place {
                            ball,
                            setup: String::new(),
                            new: true,
                        });
                    }
                }
            }
        }
    }
    places
}

/// A unit vector square to an axis: R's Y where it can be, else Z.
fn across(direction: [f64; 3]) -> [f64; 3] {
    let start = if direction[1].abs() < 0.5 {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let along: f64 = (0..3).map(|i| start[i] * direction[i]).sum();
    let rest: [f64; 3] = std::array::from_fn(|i| start[i] - along * direction[i]);
    let length = norm(rest);
    rest.map(|x| x / length)
}

/// The other rotary axes' positions; the swept one stands where its sweep begins.
fn standings(session: &Session, menu: &Menu, rotary: &[usize], swept: usize, from: f64) -> Vec<Vec<f64>> {
    let machine = &session.machine;
    let mut zero = vec![0.0; machine.axes.len()];
    zero[swept] = from;
    let mut all = vec![zero];
    for &other in rotary.iter().filter(|axis| **axis != swept) {
        let mut more = Vec::new();
        for at in &all {
            for degrees in &menu.standing_deg {
                let position = degrees.to_radians();
                let [low, high] = machine.axes[other]
                    .travel
                    .unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                if position >= low - 1e-9 && position <= high + 1e-9 {
                    let mut at = at.clone();
                    at[other] = position;
                    more.push(at);
                }
            }
        }
        all = more;
    }
    all
}

struct Base<'b> {
    session: &'b Session,
    last: &'b Test,
    axis: usize,
    sweep: Sweep,
    on_table: bool,
    place: &'b Place,
    at: &'b [f64],
}

impl Base<'_> {
    /// The bar of the kit as the session has calibrated it, if it has.
    fn length(&self, nominal: f64) -> f64 {
        let bars = self.session.tests.iter().filter_map(|test| match &test.station {
            Station::BallBar(bar) => Some(bar.bar),
            _ => None,
        });
        bars.into_iter()
            .find(|bar| (bar - nominal).abs() <= 1.0)
            .unwrap_or(nominal)
    }

    fn station(&self, nominal: f64) -> BallBar<f64> {
        let mut bar = match &self.last.station {
            Station::BallBar(bar) => bar.clone(),
            _ => BallBar {
                workpiece_ball: [0.0; 3],
                spindle_ball: [0.0; 3],
                bar: 0.0,
            },
        };
        bar.bar = self.length(nominal);
        if self.on_table {
            bar.workpiece_ball = self.place.ball;
        } else {
            bar.spindle_ball = self.place.ball;
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
        let ball = if self.on_table {
            "workpiece ball"
        } else {
            "spindle ball"
        };
        let mut name = format!(
            "{}{nominal:.0} with the {ball} at radius {radius:.0} mm",
            axis.name
        );
        if height.abs() >= 0.5 {
            name.push_str(&format!(", height {height:.0} mm").replace('-', "−"));
        }
        for (k, other) in machine.axes.iter().enumerate() {
            if k != self.axis && other.kind == AxisKind::Rotary && at[k] != 0.0 {
                name.push_str(&format!(", {} at {:.0}°", other.name, at[k].to_degrees()).replace('-', "−"));
            }
        }
        name.push_str(words);
        if self.place.new {
            name.push_str(&format!(", {ball} mounted anew"));
        } else {
            name.push_str(&format!(", ball as in set-up {}", self.place.setup));
        }
        let geometry = Station::BallBar(BallBar {
            workpiece_ball: station.workpiece_ball.map(Length::Number),
            spindle_ball: station.spindle_ball.map(Length::Number),
            bar: Length::Number(station.bar),
        });
        let unique = "proposed".to_string();
        let setup = match (self.on_table, self.place.new) {
            (true, false) => self.place.setup.clone(),
            (true, true) => unique.clone(),
            (false, _) => self.last.setup.clone(),
        };
        let priors = self.priors(nominal);
        let test = Test {
            name: unique.clone(),
            station: Station::BallBar(station),
            geometry,
            priors,
            setup,
            spindle_setup: unique.clone(),
            bar_setup: unique,
            socket: None,
            motion: Some(motion),
            at_written: vec![None; at.len()],
            at,
            readings: None,
        };
        Draft {
            test,
            name,
            new_setup: self.place.new,
        }
    }

    /// What is known of the set-up: as in the session's tests; of the bar, as of the same bar there.
    fn priors(&self, nominal: f64) -> Vec<Prior> {
        let mut priors = self.last.priors.clone();
        let same_bar = self.session.tests.iter().find(|test| match &test.station {
            Station::BallBar(bar) => (bar.bar - nominal).abs() <= 1.0,
            _ => false,
        });
        if let Some(test) = same_bar {
            priors[BAR] = test.priors[BAR];
        }
        priors
    }

    /// The other ball on the swept axis: at the foot of the circle where the bar is as long as the radius, else beside it.
    fn on_axis(&self, menu: &Menu, nominal: f64) -> Vec<Draft> {
        let machine = &self.session.machine;
        let station = self.station(nominal);
        let (origin, along) = placing::axis_line(machine, self.at, self.axis);
        let (workpiece, spindle) = placing::balls(machine, &station, self.at);
        let carried = if self.on_table { workpiece } else { spindle };
        let from: [f64; 3] = std::array::from_fn(|i| carried[i] - origin[i]);
        let height = dot(from, along);
        let radial: [f64; 3] = std::array::from_fn(|i| from[i] - height * along[i]);
        let radius = norm(radial);
        if radius < LEAST_RADIUS_MM || station.bar < radius - menu.reach_mm {
            return Vec::new();
        }
        let beside = if (station.bar - radius).abs() <= menu.reach_mm {
            vec![0.0]
        } else {
            let beside = (station.bar.powi(2) - radius.powi(2)).sqrt();
            vec![beside, -beside]
        };
        let outward = self.outward();
        beside
            .into_iter()
            .filter_map(|beside| {
                // From the carried ball to the other one.
                let across: [f64; 3] = std::array::from_fn(|i| beside * along[i] - radial[i]);
                let wanted = if self.on_table { across } else { across.map(|x| -x) };
                if outward.is_some_and(|outward| dot(wanted, outward) < -LEAST_RADIUS_MM) {
                    return None;
                }
                let at = placing::standing(machine, &station, self.at, wanted)?;
                let motion = Motion::Sweep {
                    axis: self.axis,
                    from: self.sweep.from,
                    to: self.sweep.to,
                    step: self.sweep.step * menu.thin.max(1) as f64,
                    speed: self.sweep.speed,
                    runs: self.sweep.runs,
                    both_directions: true,
                };
                let words = if beside == 0.0 {
                    String::new()
                } else {
                    let side = if beside > 0.0 { "+" } else { "−" };
                    format!(
                        ", other ball {side}{:.0} mm along {}",
                        beside.abs(),
                        machine.axes[self.axis].name
                    )
                };
                Some(self.draft(nominal, station.clone(), at, motion, &words))
            })
            .collect()
    }

    /// Where the table's axis stands on end and carries the ball itself, the way out of the table: no other ball lies below it.
    fn outward(&self) -> Option<[f64; 3]> {
        let machine = &self.session.machine;
        let table = machine
            .axes
            .first()
            .filter(|axis| self.on_table && axis.kind == AxisKind::Rotary)?;
        let up = table.direction[2];
        (self.axis == 0 && up.abs() > 0.9).then(|| {
            let (_, along) = placing::axis_line(machine, self.at, 0);
            along.map(|x| x * up.signum())
        })
    }

    /// The linear axes keep the bar radial, tangential or axial.
    fn following(&self, menu: &Menu, nominal: f64) -> Vec<Draft> {
        let offsets = [
            (FollowOffset::Radial, "radial"),
            (FollowOffset::Tangential, "tangential"),
            (FollowOffset::Axial, "axial"),
        ];
        offsets
            .into_iter()
            .map(|(offset, word)| {
                let motion = Motion::Follow {
                    axis: self.axis,
                    from: self.sweep.from,
                    to: self.sweep.to,
                    step: self.sweep.step * menu.thin.max(1) as f64,
                    speed: self.sweep.speed,
                    runs: self.sweep.runs,
                    both_directions: true,
                    offset,
                };
                let words = format!(", linear axes following with the bar {word}");
                self.draft(nominal, self.station(nominal), self.at.to_vec(), motion, &words)
            })
            .collect()
    }
}

/// Plans an entry's states; `None` where the travel forbids them or the bar does not reach.
fn finished(session: &Session, menu: &Menu, draft: Draft) -> Option<Entry> {
    let Draft {
        mut test,
        name,
        new_setup,
    } = draft;
    let Station::BallBar(bar) = &test.station else {
        return None;
    };
    let length = bar.bar;
    let mut readings = states::planned(session, &test).ok()?;
    if readings
        .observed
        .iter()
        .any(|reading| (reading - length).abs() > menu.reach_mm)
    {
        return None;
    }
    let start = session
        .tests
        .iter()
        .filter_map(|test| test.readings.as_ref()?.time_s.last().copied());
    let start = start.fold(0.0, f64::max);
    let moving_s = readings.time_s.last().copied().unwrap_or(0.0);
    readings
        .time_s
        .iter_mut()
        .for_each(|time| *time += start + menu.test_min * 60.0);
    if session.tests.iter().any(|test| {
        test.readings
            .as_ref()
            .is_some_and(|r| !r.temperature_c.is_empty())
    }) {
        let mean = crate::drivers::Origin::of(session).temperature_c;
        readings.temperature_c = vec![mean; readings.rows()];
    }
    test.readings = Some(readings);
    let minutes = menu.test_min + moving_s / 60.0 + if new_setup { menu.setup_min } else { 0.0 };
    Some(Entry {
        name,
        test,
        new_setup,
        minutes,
    })
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    norm(std::array::from_fn(|i| a[i] - b[i]))
}
