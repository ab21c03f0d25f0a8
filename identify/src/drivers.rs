//! Values of the drivers of effects in a test, and the basis functions of shapes over them.

use abbe_model::chain::Machine;
use abbe_model::effect::{Component, Driver, DriverSample, Effect, Shape};
use abbe_model::instrument::InternalUnit;
use abbe_model::sensitivity::TestModel;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};

use crate::unit::Unit;

/// Reference time and temperature of the session.
#[derive(Clone, Copy, Debug, Default)]
pub struct Origin {
    /// Time of the session's first reading, s.
    pub time_s: f64,
    /// Mean of the temperature columns, °C.
    pub temperature_c: f64,
}

impl Origin {
    /// The reference values of a session.
    pub fn of(session: &Session) -> Origin {
        let readings = || session.tests.iter().filter_map(|test| test.readings.as_ref());
        let first = readings()
            .flat_map(|r| r.time_s.first().copied())
            .fold(f64::INFINITY, f64::min);
        let (sum, count) = readings()
            .flat_map(|r| r.temperature_c.iter())
            .fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
        Origin {
            time_s: if first.is_finite() { first } else { 0.0 },
            temperature_c: if count > 0 { sum / count as f64 } else { 0.0 },
        }
    }
}

/// The values of a driver in a test, row by row; `None` if the data lack its column. `component_axis` is the axis of the gravity driver.
/// That driver is the moment of a unit weight about this axis; the weight acts at the instrument's point that the axis carries.
pub fn samples(
    machine: &Machine,
    model: &TestModel<'_>,
    readings: &Readings,
    origin: &Origin,
    driver: &Driver,
    component_axis: Option<usize>,
) -> Option<Vec<DriverSample<f64>>> {
    let plain = |value: f64, rate: f64| DriverSample {
        value,
        rate,
        direction: 1.0,
        ..DriverSample::default()
    };
    match driver {
        Driver::None => Some(vec![plain(0.0, 0.0); model.rows()]),
        Driver::Axis(name) => {
            let axis = machine.axis_index(name)?;
            Some(readings.axis_samples(axis, machine.axes[axis].kind))
        }
        Driver::Time => (!readings.time_s.is_empty()).then(|| {
            readings
                .time_s
                .iter()
                .map(|t| plain(t - origin.time_s, 1.0))
                .collect()
        }),
        Driver::Temperature => (!readings.temperature_c.is_empty()).then(|| {
            readings
                .temperature_c
                .iter()
                .map(|t| plain(t - origin.temperature_c, 0.0))
                .collect()
        }),
        Driver::Gravity => {
            let axis = component_axis?;
            let station = model.station();
            let point = if axis < machine.workpiece_side {
                station.table_point_mm()?
            } else {
                station.tool_point_mm()
            };
            let moment = |row| machine.gravity_moment_mm(axis, &model.state(row), point) / 1000.0;
            Some((0..model.rows()).map(|row| plain(moment(row), 0.0)).collect())
        }
    }
}

/// The basis functions of a shape over a driver: one column per coefficient.
pub fn basis_columns(shape: &Shape, samples: &[DriverSample<f64>]) -> Vec<Vec<f64>> {
    let count = shape.coefficients();
    let mut columns = vec![vec![0.0; samples.len()]; count];
    let mut row = Vec::with_capacity(count);
    for (i, sample) in samples.iter().enumerate() {
        row.clear();
        shape.basis(sample, &mut row);
        for (column, value) in columns.iter_mut().zip(&row) {
            column[i] = *value;
        }
    }
    columns
}

/// The slots that a component moves in a test: slot, and what multiplies the basis row by row (`None`: 1).
pub fn component_slots(
    session: &Session,
    test: &Test,
    readings: &Readings,
    component: &Component,
) -> Vec<(usize, Option<Vec<f64>>)> {
    let machine = &session.machine;
    match component {
        Component::Axis(name) => machine
            .error_slot(name)
            .map(|slot| (slot, None))
            .into_iter()
            .collect(),
        Component::Instrument { thing, coordinate } => test
            .station
            .kind()
            .unknowns()
            .iter()
            .position(|unknown| unknown.thing == thing && unknown.coordinate == coordinate)
            .map(|place| (machine.error_slots() + place, None))
            .into_iter()
            .collect(),
        Component::TriggerDelay => {
            let mut slots = Vec::new();
            for (index, axis) in machine.axes.iter().enumerate() {
                let rates: Vec<f64> = readings
                    .axis_samples(index, axis.kind)
                    .iter()
                    .map(|sample| sample.rate)
                    .collect();
                if rates.iter().all(|rate| *rate == 0.0) {
                    continue;
                }
                for (slot, along) in machine.slots_along(index) {
                    slots.push((slot, Some(rates.iter().map(|rate| rate * along).collect())));
                }
            }
            slots
        }
    }
}

/// The internal unit of a component.
pub fn component_unit(session: &Session, component: &Component) -> Option<InternalUnit> {
    match component {
        Component::Axis(name) => Some(if name.freedom.is_angle() {
            InternalUnit::Radian
        } else {
            InternalUnit::Millimetre
        }),
        Component::Instrument { thing, coordinate } => session
            .instrument
            .unknowns()
            .iter()
            .find(|unknown| unknown.thing == thing && unknown.coordinate == coordinate)
            .map(|unknown| unknown.unit),
        Component::TriggerDelay => None,
    }
}

/// The unit in which coefficient `k` of an effect is reported.
pub fn coefficient_unit(session: &Session, effect: &Effect, k: usize) -> Unit {
    let Some(internal_unit) = component_unit(session, &effect.component) else {
        return Unit {
            name: "ms".to_string(),
            display_per_internal: 1e3,
        };
    };
    let machine = &session.machine;
    let driver_axis = match &effect.driver {
        Driver::Axis(name) => machine.axis_index(name).map(|axis| machine.axes[axis].kind),
        _ => None,
    };
    Unit::of_coefficient(internal_unit, &effect.driver, driver_axis, &effect.shape, k)
}

/// The axis of a component.
pub fn component_axis(session: &Session, component: &Component) -> Option<usize> {
    match component {
        Component::Axis(name) => session.machine.axis_index(&name.axis),
        _ => None,
    }
}
