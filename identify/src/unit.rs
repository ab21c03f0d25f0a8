//! The units of parameters in results.

use abbe_model::axis::AxisKind;
use abbe_model::driver::Driver;
use abbe_model::effect::shape::Per;
use abbe_model::effect::{Effect, Shape};
use abbe_model::session::Session;
use abbe_model::unit::{InternalUnit, Unit};

/// The unit of a parameter in results: a unit, or a quotient of units.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterUnit {
    /// The name in results: `um`, `arcsec`, `um/h`.
    pub name: String,
    /// Number of display units per internal unit (mm, rad, …).
    pub display_per_internal: f64,
}

impl From<Unit> for ParameterUnit {
    fn from(unit: Unit) -> ParameterUnit {
        ParameterUnit { name: unit.name().to_string(), display_per_internal: unit.per_internal() }
    }
}

impl ParameterUnit {
    /// The symbol; the name of a quotient.
    pub fn symbol(&self) -> &str {
        Unit::parse(&self.name).map_or(&*self.name, |unit| unit.symbol())
    }

    /// The unit of the numbers of the shape of an effect: that of its driver, or a time constant.
    pub fn of_number(session: &Session, effect: &Effect) -> ParameterUnit {
        if effect.shape.lag_s().is_some() {
            return Unit::Second.into();
        }
        let unit = effect.driver_unit(&session.machine);
        ParameterUnit { name: unit.result().to_string(), display_per_internal: unit.to_display(1.0) }
    }

    /// The unit in which coefficient `k` of an effect in a session is reported.
    pub fn of_effect(session: &Session, effect: &Effect, k: usize) -> ParameterUnit {
        let Some(internal_unit) = effect.component.unit(&session.instrument_parameters()) else {
            return Unit::Millisecond.into();
        };
        let driver_axis = effect.driver.axis_kind(&session.machine);
        ParameterUnit::of_coefficient(internal_unit, &effect.driver, driver_axis, &effect.shape, k)
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
    ) -> ParameterUnit {
        let plain = ParameterUnit::from(component.displayed());
        let per = |what: &str| ParameterUnit {
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
                    Unit::Millisecond.into()
                }
                (_, Some(AxisKind::Linear)) => per("(mm/s)"),
                _ => per("(rad/s)"),
            },
            (Per::Hour, _) => per("h"),
            (Per::Slope(scale), _) if matches!(driver, Driver::Axis(_)) && driver_axis == Some(AxisKind::Linear) => {
                let per_metre = Unit::Metre.internal() / scale * plain.display_per_internal;
                ParameterUnit { display_per_internal: per_metre, ..per("m") }
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
            ParameterUnit::of_coefficient(component, driver, kind, shape, k).name
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
        let unit = ParameterUnit::of_coefficient(Millimetre, &axis("X"), linear, &scale_error, 0);
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
