//! Display units: µm, arcsec, and the units of effects' coefficients.

use abbe_model::axis::AxisKind;
use abbe_model::driver::Driver;
use abbe_model::effect::shape::Per;
use abbe_model::effect::{Effect, Shape};
use abbe_model::instrument::InternalUnit;
use abbe_model::session::Session;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A unit of reported results.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// The name in results: `um`, `arcsec`, `um/h`.
    pub name: String,
    /// Number of display units per internal unit (mm, rad, …).
    pub display_per_internal: f64,
}

/// The unit of the figures of readings: noise, residuals, held-out errors. Keys of results end in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum ReadingUnit {
    /// µm: of lengths, or of lengths beside angles.
    #[default]
    #[serde(rename = "um")]
    Micrometre,
    /// ″: of a session whose channels are all angles.
    #[serde(rename = "arcsec")]
    Arcsecond,
}

impl ReadingUnit {
    /// Its name in keys of results.
    pub fn name(self) -> &'static str {
        match self {
            ReadingUnit::Micrometre => "um",
            ReadingUnit::Arcsecond => "arcsec",
        }
    }

    /// Of the readings of a session.
    pub fn of(session: &Session) -> ReadingUnit {
        if session.units().only_angles() { ReadingUnit::Arcsecond } else { ReadingUnit::Micrometre }
    }

    /// A figure of readings with its symbol.
    pub fn text(self, value: f64, places: usize) -> String {
        format!("{value:.places$} {}", self.symbol())
    }

    /// Its symbol.
    pub fn symbol(self) -> &'static str {
        if self.is_micrometre() { "µm" } else { "″" }
    }

    /// The key of a session that states the noise of readings in this unit.
    pub fn noise_key(self) -> &'static str {
        if self.is_micrometre() { "noise_um" } else { "noise_arcsec" }
    }

    /// Whether it is µm, which results do not state.
    pub fn is_micrometre(&self) -> bool {
        *self == ReadingUnit::Micrometre
    }
}

/// Millimetres in a metre.
const MM_PER_M: f64 = 1e3;

/// Arcseconds per radian.
pub const ARCSEC: f64 = 180.0 * 3600.0 / std::f64::consts::PI;

impl Unit {
    /// The unit of the numbers of the shape of an effect: that of its driver, or a time constant.
    pub fn of_number(session: &Session, effect: &Effect) -> Unit {
        if effect.shape.lag_s().is_some() {
            return Unit { name: "s".to_string(), display_per_internal: 1.0 };
        }
        let unit = effect.driver_unit(&session.machine);
        Unit { name: unit.result.to_string(), display_per_internal: unit.to_display(1.0) }
    }

    /// The unit of a component.
    pub fn of(internal_unit: InternalUnit) -> Unit {
        let (name, display_per_internal) = match internal_unit {
            InternalUnit::Millimetre => ("um", 1e3),
            InternalUnit::Radian => ("arcsec", ARCSEC),
            InternalUnit::Ratio => ("um/m", 1e6),
        };
        Unit { name: name.to_string(), display_per_internal }
    }

    /// The unit in which coefficient `k` of an effect in a session is reported.
    pub fn of_effect(session: &Session, effect: &Effect, k: usize) -> Unit {
        let Some(internal_unit) = effect.component.unit(&session.instrument_parameters()) else {
            return Unit { name: "ms".to_string(), display_per_internal: 1e3 };
        };
        let driver_axis = effect.driver.axis_kind(&session.machine);
        Unit::of_coefficient(internal_unit, &effect.driver, driver_axis, &effect.shape, k)
    }

    /// The unit of coefficient `k` of an effect. `driver_axis` is the kind of the axis that the effect follows, if it
    /// follows one.
    ///
    /// | shape | unit of a coefficient, for a component in µm |
    /// |---|---|
    /// | lag | ms over an axis of the component's own kind; µm/(mm/s) or µm/(rad/s) over one of the other |
    /// | drift | µm/h |
    /// | polynomial, power over temperature or gravity at their scale of 1 K, 1 m | µm/K, µm/K², …; µm/m, µm/m², … |
    /// | power 1 alone over a linear axis | µm/m |
    /// | every other | µm: the value where the basis function is 1, as at the scale of a polynomial |
    pub fn of_coefficient(
        component: InternalUnit,
        driver: &Driver,
        driver_axis: Option<AxisKind>,
        shape: &Shape,
        k: usize,
    ) -> Unit {
        let plain = Unit::of(component);
        let per = |what: &str| Unit {
            name: format!("{}/{what}", plain.name),
            display_per_internal: plain.display_per_internal,
        };
        let per_power = |what: &str, degree: usize| match degree {
            1 => per(what),
            _ => per(&format!("{what}^{degree}")),
        };
        match (shape.per(k), driver.kind().per()) {
            (Per::Rate, _) => match (component, driver_axis) {
                (InternalUnit::Millimetre, Some(AxisKind::Linear)) | (InternalUnit::Radian, Some(AxisKind::Rotary)) => {
                    Unit { name: "ms".to_string(), display_per_internal: 1e3 }
                }
                (_, Some(AxisKind::Linear)) => per("(mm/s)"),
                _ => per("(rad/s)"),
            },
            (Per::Hour, _) => per("h"),
            (Per::Slope(scale), _) if matches!(driver, Driver::Axis(_)) && driver_axis == Some(AxisKind::Linear) => {
                Unit { display_per_internal: MM_PER_M / scale * plain.display_per_internal, ..per("m") }
            }
            (Per::Power(degree), Some(unit)) => per_power(unit, degree),
            (Per::Slope(1.0), Some(unit)) => per(unit),
            (Per::Power(_) | Per::Slope(_) | Per::One, _) => plain,
        }
    }
}

#[cfg(test)]
mod tests {
    use abbe_model::effect::shape::{Harmonic, Polynomial, Power, Warmup};

    use super::*;

    #[test]
    fn every_shape_over_every_driver_has_the_unit_of_its_basis() {
        use InternalUnit::{Millimetre, Radian, Ratio};
        let axis = |name: &str| Driver::Axis(name.to_string());
        let name = |component, driver: &Driver, kind, shape: &Shape, k| {
            Unit::of_coefficient(component, driver, kind, shape, k).name
        };
        let cubic = |scale: f64| Shape::Polynomial(Polynomial { degree: 3, scale });
        let square = |scale: f64| Shape::Power(Power { degree: 2, scale });
        for (k, unit) in ["um/K", "um/K^2", "um/K^3"].into_iter().enumerate() {
            assert_eq!(name(Millimetre, &Driver::parse("temperature"), None, &cubic(1.0), k), unit);
        }
        assert_eq!(name(Radian, &Driver::Gravity, None, &square(1.0), 0), "arcsec/m^2");
        assert_eq!(name(Radian, &Driver::Gravity, None, &cubic(1.0), 0), "arcsec/m");
        // At another scale the coefficient is the value of the component there.
        assert_eq!(name(Millimetre, &Driver::parse("temperature"), None, &square(5.0), 0), "um");
        let linear = Some(AxisKind::Linear);
        let rotary = Some(AxisKind::Rotary);
        assert_eq!(name(Millimetre, &axis("X"), linear, &cubic(100.0), 2), "um");
        // A polynomial over an axis with a scale of 1 mm has a value there, not a slope, as its coefficient.
        assert_eq!(name(Millimetre, &axis("X"), linear, &cubic(1.0), 1), "um");
        // A slope over a linear axis is per length, whatever its scale.
        let scale_error = Shape::Polynomial(Polynomial { degree: 1, scale: 100.0 });
        assert_eq!(name(Millimetre, &axis("X"), linear, &scale_error, 0), "um/m");
        let unit = Unit::of_coefficient(Millimetre, &axis("X"), linear, &scale_error, 0);
        assert_eq!(unit.display_per_internal, 1e4);
        assert_eq!(name(Radian, &axis("X"), linear, &scale_error, 0), "arcsec/m");
        assert_eq!(name(Radian, &axis("X"), linear, &square(100.0), 0), "arcsec");
        assert_eq!(name(Millimetre, &axis("C"), rotary, &scale_error, 0), "um");
        assert_eq!(name(Millimetre, &Driver::Time, None, &cubic(3600.0), 1), "um");
        assert_eq!(name(Millimetre, &Driver::Time, None, &Shape::Drift, 0), "um/h");
        assert_eq!(name(Ratio, &Driver::Time, None, &Shape::Drift, 0), "um/m/h");
        assert_eq!(name(Millimetre, &axis("X"), linear, &Shape::Lag, 0), "ms");
        assert_eq!(name(Radian, &axis("C"), rotary, &Shape::Lag, 0), "ms");
        assert_eq!(name(Radian, &axis("X"), linear, &Shape::Lag, 0), "arcsec/(mm/s)");
        assert_eq!(name(Millimetre, &axis("C"), rotary, &Shape::Lag, 0), "um/(rad/s)");
        assert_eq!(name(Ratio, &axis("X"), linear, &Shape::Lag, 0), "um/m/(mm/s)");
        for shape in [Shape::Backlash, Shape::Harmonic(Harmonic { order: 2.0 }), Shape::Warmup(Warmup { tau_s: 60.0 })]
        {
            assert_eq!(name(Radian, &axis("C"), rotary, &shape, 0), "arcsec");
        }
    }
}
