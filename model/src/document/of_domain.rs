//! From the domain to documents, which read back to the same bits.

use super::effect::{self, SCALES};
use super::machine::{Axis, Flange, Machine};
use super::measurement::Test;
use super::movement::{Circle, Follow, Line, Path, Sweep};
use super::node::Named;
use super::value::{Positive, Three};
use crate::axis::AxisKind;
use crate::driver::DriverUnit;
use crate::effect::keys::KeyWriter;
use crate::effect::{CoefficientPrior, Effect};
use crate::frames::Rotation;
use crate::instrument::set_up::rounded;
use crate::instrument::{InstrumentKind, SharedBy};
use crate::session::Test as DomainTest;
use crate::session::motion::{Course, FollowOffset, Motion, Moved};
use crate::unit::Unit;
use crate::{axis, chain};

/// A machine without its bodies. Numbers read back to the same bits, except a direction, which the reader scales to
/// length 1.
pub fn machine(machine: &chain::Machine) -> Machine {
    Machine {
        name: Some(machine.name.clone()),
        chain: machine.code(),
        rotation: (machine.rotation == Rotation::SmallAngle).then_some(Rotation::SmallAngle),
        gravity: Some(Three(machine.gravity)),
        flange: machine
            .flange
            .as_ref()
            .map(|flange| Flange { xyz_mm: Three(flange.xyz_mm), rpy_deg: Some(Three(flange.rpy_deg)) }),
        axis: Named(machine.axes.iter().map(|axis| (axis.name.clone(), self::axis(axis))).collect()),
        body: Vec::new(),
    }
}

fn axis(axis: &axis::Axis) -> Axis {
    let travel = |kind: AxisKind| axis.travel.filter(|_| axis.kind == kind).map(|ends| ends.to_vec());
    // Degrees that read back to the same radians, where there are such.
    let degrees = |end: f64| match DriverUnit::ANGLE.exact(end) {
        (Unit::Degree, number) => number,
        _ => end.to_degrees(),
    };
    Axis {
        kind: Some(axis.kind),
        direction: Some(Three(axis.direction)),
        origin_mm: Some(Three(axis.origin_mm)),
        travel_mm: travel(AxisKind::Linear),
        travel_deg: travel(AxisKind::Rotary).map(|ends| ends.into_iter().map(degrees).collect()),
        joint: axis.joint.clone(),
    }
}

/// An effect with its aliases.
pub fn effect(effect: &Effect, machine: &chain::Machine) -> effect::Effect {
    let mut keys = KeyWriter::new(effect.driver_unit(machine));
    effect.shape.write(&mut keys);
    let mut document = effect::Effect {
        component: effect.component.to_string(),
        driver: Some(effect.driver.to_string()),
        shape: effect.shape.entry().word.to_string(),
        keys: keys.finish(),
        tests: (!effect.tests.is_empty()).then(|| effect.tests.clone()),
        estimate: (!effect.estimated.is_empty() || effect.positions_estimated).then(|| {
            let names = effect.shape.number_names();
            let numbers = effect.estimated.iter().filter_map(|which| names.get(*which)).copied();
            numbers.chain(effect.positions_estimated.then_some(effect::POSITIONS)).map(ToString::to_string).collect()
        }),
        assumed: effect.assumed.then_some(true),
        alias: effect.aliases.iter().map(|alias| self::effect(alias, machine)).collect(),
        ..effect::Effect::default()
    };
    match &effect.prior {
        prior if *prior == CoefficientPrior::default_of(&effect.shape) => {}
        CoefficientPrior::Flat => {}
        CoefficientPrior::Family(name) => document.family = Some(name.clone()),
        CoefficientPrior::Scale(scale) => {
            let is_angle = effect.component.is_angle();
            let (_, unit) = SCALES[usize::from(is_angle)];
            let to = if is_angle { &mut document.scale_arcsec } else { &mut document.scale_um };
            *to = Some(Positive(scale / unit.displayed().internal()));
        }
    }
    document
}

/// A planned test of a session with this instrument, with the positions of the axes that it does not move. `None` for a test
/// without a motion of its own.
pub fn test(test: &DomainTest, machine: &chain::Machine, instrument: InstrumentKind) -> Option<Test> {
    let moved = test.motion.as_ref()?;
    let (sweep, path) = motion(moved, machine);
    let mut set_up = test.station.written(&test.priors)?;
    test.station.frames().into_iter().for_each(|(key, frame)| set_up.set(&key, frame.word(machine).as_str()));
    let kind = test.station.kind();
    let stated = |set_up: &String, default: &str| (set_up != default).then(|| set_up.clone());
    if let Some(name) = stated(&test.bar_setup, &test.name).filter(|_| kind.shares(SharedBy::BarSetup)) {
        set_up.set("bar_setup", name.as_str());
    }
    if let Some(socket) = &test.socket {
        set_up.set("socket", socket.as_str());
    }
    let follows = |axis: usize| match moved.moved {
        // A tool without a bar stays where it is over the table at the start.
        Moved::Follow { offset, .. } => offset != FollowOffset::None && machine.axes[axis].kind == AxisKind::Linear,
        _ => false,
    };
    let held = (0..machine.axes.len())
        .filter(|axis| !moved.axes().contains(axis) && !follows(*axis))
        .map(|axis| (axis, rounded(machine.axes[axis].kind.to_display(test.at[axis]))))
        .filter(|(_, position)| *position != 0.0)
        .map(|(axis, position)| (machine.axes[axis].column(""), position.into()));
    Some(Test {
        name: test.name.clone(),
        set_up,
        kind: (kind != instrument).then_some(kind),
        setup: stated(&test.setup, &test.name),
        spindle_setup: stated(&test.spindle_setup, kind.spindle_setup(&test.name)),
        at: Named(held.collect()),
        contributors: test.contributors,
        sweep,
        path,
        ..Test::default()
    })
}

/// The document of a motion: `sweep` or `path`.
fn motion(Motion { moved, course }: &Motion, machine: &chain::Machine) -> (Option<Sweep>, Option<Path>) {
    let Course { from, to, step, speed, traversals } = *course;
    let name = |axis: usize| machine.axes[axis].name.clone();
    let degrees = |angle: f64| rounded(angle.to_degrees());
    let feed_mm_min = Some(Positive(rounded(60.0 * speed)));
    let (from_deg, to_deg, step_deg) = (Some(degrees(from)), Some(degrees(to)), degrees(step));
    let path = match moved {
        Moved::Axis(axis) => {
            let kind = machine.axes[*axis].kind;
            let in_unit = |of: AxisKind, value: f64| (kind == of).then(|| rounded(kind.to_display(value)));
            let sweep = Sweep {
                axis: name(*axis),
                from_mm: in_unit(AxisKind::Linear, from),
                from_deg: in_unit(AxisKind::Rotary, from),
                to_mm: in_unit(AxisKind::Linear, to),
                to_deg: in_unit(AxisKind::Rotary, to),
                step_mm: in_unit(AxisKind::Linear, step),
                step_deg: in_unit(AxisKind::Rotary, step),
                feed_mm_min: in_unit(AxisKind::Linear, speed * 60.0).map(Positive),
                feed_deg_min: in_unit(AxisKind::Rotary, speed * 60.0).map(Positive),
                traversals,
            };
            return (Some(sweep), None);
        }
        Moved::Circle { axes, radius, centre } => Path::Circle(Circle {
            plane: axes.map(name).concat(),
            radius_mm: rounded(*radius).into(),
            centre_mm: Some(Three(centre.map(|mm| rounded(mm).into()))),
            from_deg,
            to_deg,
            step_deg,
            feed_mm_min,
            traversals,
        }),
        Moved::Line { axes, ends, in_turn } => {
            let positions = |end: usize| {
                let of_axis =
                    |(axis, ends): (&usize, &[f64; 2])| (machine.axes[*axis].column(""), rounded(ends[end]).into());
                Named(axes.iter().zip(ends).map(of_axis).collect())
            };
            Path::Line(Line {
                from: positions(0),
                to: positions(1),
                step_mm: rounded(step),
                in_turn: in_turn.then_some(true),
                feed_mm_min,
                traversals,
            })
        }
        Moved::Follow { axis, offset } => Path::Follow(Follow {
            axis: name(*axis),
            // An instrument without a bar has no direction of it.
            offset: Some(*offset).filter(|offset| !matches!(offset, FollowOffset::None | FollowOffset::Touching)),
            from_deg,
            to_deg,
            step_deg,
            feed_mm_min: None,
            feed_deg_min: Some(Positive(degrees(60.0 * speed))),
            programmed_feed_mm_min: None,
            traversals,
        }),
    };
    (None, Some(path))
}
