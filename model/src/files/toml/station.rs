//! Reader of the instrument of a test: nominal geometry and priors.

use super::Context;
use super::quantity::MICROMETRE;
use crate::error::ModelError;
use crate::files::toml::document::{Table, Value};
use crate::frames::{Point, Rotation};
use crate::instrument::ballbar::BallBar;
use crate::instrument::probe::Probe;
use crate::instrument::rtest::{Orientation, RTest, Setting};
use crate::instrument::socket::Socket;
use crate::instrument::tracker::Tracker;
use crate::instrument::{InstrumentKind, Station};
use crate::session::Prior;
use crate::session::expression::Length;
use crate::session::limits;

/// A test's instrument.
pub(super) struct SetUp {
    pub station: Station<f64>,
    pub geometry: Station<Length>,
    pub priors: Vec<Prior>,
    pub socket: Option<String>,
}

/// Keys of a test that only some instruments have.
const INSTRUMENT_KEYS: [(InstrumentKind, &[&str]); 5] = [
    (
        InstrumentKind::BallBar,
        &[
            "bar_mm",
            "bar_u_um",
            "workpiece_ball_mm",
            "workpiece_ball_u_um",
            "spindle_ball_mm",
            "spindle_ball_u_um",
            "bar_setup",
        ],
    ),
    (
        InstrumentKind::RTest,
        &[
            "setting",
            "workpiece_ball_mm",
            "workpiece_ball_u_um",
            "spindle_ball_mm",
            "spindle_ball_u_um",
            "sensor_angles_deg",
            "sensor_directions",
            "sensor_u_arcsec",
        ],
    ),
    (InstrumentKind::Tracker, &["target_mm", "target_u_um"]),
    (InstrumentKind::Socket, &["ball_mm", "ball_u_um", "socket"]),
    (
        InstrumentKind::Probe,
        &[
            "artefact_mm",
            "artefact_u_um",
            "artefact_u_arcsec",
            "artefact_axis",
            "radius_mm",
            "radius_u_um",
            "stylus_mm",
            "stylus_u_um",
            "direction",
        ],
    ),
];

/// Reads the instrument's keys of a test.
pub(super) fn set_up(context: &Context<'_>, table: &mut Table<'_>) -> Result<SetUp, ModelError> {
    let own = INSTRUMENT_KEYS.iter().find(|(kind, _)| *kind == context.instrument);
    let own = own.map_or(&[][..], |(_, keys)| keys);
    for (kind, keys) in INSTRUMENT_KEYS {
        for key in keys.iter().filter(|key| !own.contains(key)) {
            if let Some(value) = table.take(*key) {
                let message = format!(
                    "`{key}` belongs to a {}; this session's instrument is a {}",
                    kind.word(),
                    context.instrument.word()
                );
                return Err(value.source.error(value.key_span.clone(), message, None));
            }
        }
    }
    match context.instrument {
        InstrumentKind::BallBar => ball_bar(context, table),
        InstrumentKind::Tracker => tracker(context, table),
        InstrumentKind::Socket => socket(context, table),
        InstrumentKind::Probe => probe(context, table),
        InstrumentKind::RTest => r_test(context, table),
    }
}

fn ball_bar(context: &Context<'_>, table: &mut Table<'_>) -> Result<SetUp, ModelError> {
    let bar = table.require("bar_mm", "the calibrated length of the bar")?;
    let (bar_as_written, bar_mm) = context.length(&bar)?;
    if let Some(fault) = limits::not_positive("bar_mm", bar_mm) {
        return Err(bar.error(fault, None));
    }
    let Balls { workpiece: (workpiece, workpiece_mm), spindle: (spindle, spindle_mm), mut priors } =
        balls(context, table)?;
    priors.extend(self::priors(table.take("bar_u_um"), 1)?);
    priors.push(Prior::Known); // gain of the sensor
    Ok(SetUp {
        station: Station::BallBar(BallBar { workpiece_ball: workpiece_mm, spindle_ball: spindle_mm, bar: bar_mm }),
        geometry: Station::BallBar(BallBar { workpiece_ball: workpiece, spindle_ball: spindle, bar: bar_as_written }),
        priors,
        socket: None,
    })
}

/// The points on the table and in the spindle, as written and in mm, and their priors.
struct Balls {
    workpiece: ([Length; 3], [f64; 3]),
    spindle: ([Length; 3], [f64; 3]),
    priors: Vec<Prior>,
}

fn balls(context: &Context<'_>, table: &mut Table<'_>) -> Result<Balls, ModelError> {
    let workpiece = table.require("workpiece_ball_mm", "the workpiece ball in the table frame, such as [0, 100, 0]")?;
    let spindle = table.require("spindle_ball_mm", "the spindle ball in the tool frame, such as [0, 0, 0]")?;
    let (workpiece, spindle) = (context.point(workpiece)?, context.point(spindle)?);
    let mut priors = priors(table.take("workpiece_ball_u_um"), 3)?;
    priors.extend(self::priors(table.take("spindle_ball_u_um"), 3)?);
    Ok(Balls { workpiece, spindle, priors })
}

fn r_test(context: &Context<'_>, table: &mut Table<'_>) -> Result<SetUp, ModelError> {
    const SETTINGS: &str = "\"E\" (sensors on the table) or \"Es\" (sensors in the spindle)";
    let setting = table.require("setting", SETTINGS)?;
    let setting = match setting.text()?.as_str() {
        "E" => Setting::Table,
        "Es" => Setting::Spindle,
        _ => return Err(setting.unexpected(SETTINGS)),
    };
    let Balls { workpiece: (workpiece, workpiece_mm), spindle: (spindle, spindle_mm), mut priors } =
        balls(context, table)?;
    let sensors = sensors(table)?;
    priors.extend(angle_priors(table.take("sensor_u_arcsec"))?);
    Ok(SetUp {
        station: Station::RTest(RTest { setting, workpiece_ball: workpiece_mm, spindle_ball: spindle_mm, sensors }),
        geometry: Station::RTest(RTest {
            setting,
            workpiece_ball: workpiece,
            spindle_ball: spindle,
            sensors: sensors.map(|rows| rows.map(|row| row.map(Length::Number))),
        }),
        priors,
        socket: None,
    })
}

/// The measuring directions of three sensors: from ω, φ, θ, or stated; `None` if readings are in X, Y, Z.
fn sensors(table: &mut Table<'_>) -> Result<Option<[[f64; 3]; 3]>, ModelError> {
    let (angles, directions) = (table.take("sensor_angles_deg"), table.take("sensor_directions"));
    match (angles, directions) {
        (Some(_), Some(directions)) => Err(directions.source.error(
            directions.key_span.clone(),
            "both `sensor_angles_deg` and `sensor_directions`",
            Some("keep one of them: either states the measuring directions of the sensors".into()),
        )),
        (None, None) => Ok(None),
        (Some(angles), None) => {
            let items = angles.three("the three angles ω, φ, θ")?;
            let mut radians = [0.0; 3];
            for (angle, item) in radians.iter_mut().zip(&items) {
                *angle = item.number()?.to_radians();
            }
            let orientation = Orientation::new(radians, Rotation::Exact);
            let unit = |i: usize| Point(std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
            Ok(Some(std::array::from_fn(|i| orientation.to_machine(unit(i)).0)))
        }
        (None, Some(directions)) => {
            let (source, span) = (directions.source, directions.span.clone());
            let mut rows = [[0.0; 3]; 3];
            for (row, item) in rows.iter_mut().zip(directions.three("a list of three directions")?) {
                *row = unit_vector(item)?;
            }
            let [a, b, c] = rows;
            let normal = crate::frames::cross(a, Point(b)).0;
            let volume: f64 = (0..3).map(|i| normal[i] * c[i]).sum();
            if volume.abs() < MIN_VOLUME {
                let message = format!(
                    "the three `sensor_directions` lie almost in a plane (their triple product is {volume:.3}; 1 at right angles)"
                );
                let help = "three coordinates need three independent measuring directions; check the directions";
                return Err(source.error(span, message, Some(help.into())));
            }
            Ok(Some(rows))
        }
    }
}

/// Least triple product of three measuring directions. Below it, one coordinate has twenty times the noise.
const MIN_VOLUME: f64 = 0.05;

fn tracker(context: &Context<'_>, table: &mut Table<'_>) -> Result<SetUp, ModelError> {
    let target = table.require("target_mm", "the target in the tool frame")?;
    let (target, target_mm) = context.point(target)?;
    let mut priors = vec![Prior::Free; 6];
    priors.extend(self::priors(table.take("target_u_um"), 3)?);
    let identity = |zero: f64, one: f64| [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    Ok(SetUp {
        station: Station::Tracker(Tracker { target: target_mm, rotation: identity(0.0, 1.0), origin: [0.0; 3] }),
        geometry: Station::Tracker(Tracker {
            target,
            rotation: identity(0.0, 1.0).map(|row| row.map(Length::Number)),
            origin: [const { Length::Number(0.0) }; 3],
        }),
        priors,
        socket: None,
    })
}

fn socket(context: &Context<'_>, table: &mut Table<'_>) -> Result<SetUp, ModelError> {
    let ball = table.require("ball_mm", "the ball in the tool frame")?;
    let (ball, ball_mm) = context.point(ball)?;
    let mut priors = vec![Prior::Free; 3];
    priors.extend(self::priors(table.take("ball_u_um"), 3)?);
    let socket = match table.take("socket") {
        Some(value) => Some(value.text()?),
        None => None,
    };
    Ok(SetUp {
        station: Station::Socket(Socket { ball: ball_mm, socket: [0.0; 3] }),
        geometry: Station::Socket(Socket { ball, socket: [const { Length::Number(0.0) }; 3] }),
        priors,
        socket,
    })
}

fn probe(context: &Context<'_>, table: &mut Table<'_>) -> Result<SetUp, ModelError> {
    let artefact = table.require("artefact_mm", "a point of the cylinder's axis in the table frame")?;
    let (artefact, artefact_mm) = context.point(artefact)?;
    let radius = table.require("radius_mm", "the radius of the cylinder plus that of the stylus")?;
    let (radius_as_written, radius_mm) = context.length(&radius)?;
    if let Some(fault) = limits::not_positive("radius_mm", radius_mm) {
        return Err(radius.error(fault, None));
    }
    let stylus = table.require("stylus_mm", "the stylus' centre in the tool frame")?;
    let (stylus, stylus_mm) = context.point(stylus)?;
    let axis = match table.take("artefact_axis") {
        Some(value) => unit_vector(value)?,
        None => [0.0, 0.0, 1.0],
    };
    let direction = match table.take("direction") {
        Some(value) => Some(unit_vector(value)?),
        None => None,
    };
    let mut priors = priors(table.take("artefact_u_um"), 3)?;
    priors.extend(angle_priors(table.take("artefact_u_arcsec"))?);
    priors.extend(self::priors(table.take("radius_u_um"), 1)?);
    priors.push(Prior::Known); // form deviation
    priors.extend(self::priors(table.take("stylus_u_um"), 3)?);
    let written = |vector: [f64; 3]| vector.map(Length::Number);
    Ok(SetUp {
        station: Station::Probe(Probe { artefact: artefact_mm, axis, radius: radius_mm, stylus: stylus_mm, direction }),
        geometry: Station::Probe(Probe {
            artefact,
            axis: written(axis),
            radius: radius_as_written,
            stylus,
            direction: direction.map(written),
        }),
        priors,
        socket: None,
    })
}

/// A direction of three numbers, normalised to unit length.
fn unit_vector(value: Value<'_>) -> Result<[f64; 3], ModelError> {
    let (source, span, key) = (value.source, value.span.clone(), value.key.clone());
    let items = value.three("a direction as three numbers")?;
    let mut vector = [0.0; 3];
    for (component, item) in vector.iter_mut().zip(&items) {
        *component = item.number()?;
    }
    let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length < 1e-9 {
        return Err(source.error(span, format!("`{key}` is zero"), None));
    }
    Ok(vector.map(|x| x / length))
}

/// `…_u_arcsec`, as [`priors`] for three angles.
fn angle_priors(value: Option<Value<'_>>) -> Result<Vec<Prior>, ModelError> {
    const ARCSECOND: f64 = std::f64::consts::PI / (180.0 * 3600.0);
    let in_mm = priors(value, 3)?;
    Ok(in_mm
        .into_iter()
        .map(|prior| match prior {
            Prior::Gaussian(u) => Prior::Gaussian(u / MICROMETRE * ARCSECOND),
            other => other,
        })
        .collect())
}

/// `…_u_um`: a number for all coordinates or a list with one for each. Absent or 0 is known, `inf` is no prior.
fn priors(value: Option<Value<'_>>, count: usize) -> Result<Vec<Prior>, ModelError> {
    let Some(value) = value else {
        return Ok(vec![Prior::Known; count]);
    };
    if !value.is_list() {
        return Ok(vec![prior(&value)?; count]);
    }
    if count == 1 {
        return Err(value.unexpected("a number"));
    }
    let items = value.three("a number or a list of three")?;
    items.iter().map(prior).collect()
}

fn prior(value: &Value<'_>) -> Result<Prior, ModelError> {
    let u = value.number_or_inf("a number or `inf`")?;
    if u < 0.0 {
        let message = format!("`{}` is {u}; an uncertainty cannot be negative", value.key);
        let help = "0 means exactly known, `inf` means unknown";
        return Err(value.error(message, Some(help.into())));
    }
    if let Some(fault) = limits::too_small_um(u) {
        let help = "0 means exactly known";
        return Err(value.error(format!("`{}` is {fault}", value.key), Some(help.into())));
    }
    Ok(if u == 0.0 {
        Prior::Known
    } else if u.is_infinite() {
        Prior::Free
    } else {
        Prior::Gaussian(u * MICROMETRE)
    })
}
