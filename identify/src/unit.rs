//! Units outside the program: µm, arcsec, and what effects' coefficients come in.

use abbe_model::effect::{Driver, Shape};
use abbe_model::instrument::InsideUnit;

/// A unit that results are reported in.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// As it stands in results: `um`, `arcsec`, `um/h`.
    pub name: String,
    /// How many of it make one inside unit (mm, rad, …).
    pub per_inside: f64,
}

/// Arcseconds in a radian.
pub const ARCSEC: f64 = 180.0 * 3600.0 / std::f64::consts::PI;

impl Unit {
    /// The unit of a component.
    pub fn of(inside: InsideUnit) -> Unit {
        let (name, per_inside) = match inside {
            InsideUnit::Millimetre => ("um", 1e3),
            InsideUnit::Radian => ("arcsec", ARCSEC),
            InsideUnit::Ratio => ("um/m", 1e6),
        };
        Unit {
            name: name.to_string(),
            per_inside,
        }
    }

    /// The unit of an effect's coefficient. `same_kind`: component and driver are both lengths or both angles.
    pub fn of_coefficient(component: InsideUnit, driver: &Driver, shape: &Shape, same_kind: bool) -> Unit {
        let plain = Unit::of(component);
        let per = |what: &str| Unit {
            name: format!("{}/{what}", plain.name),
            per_inside: plain.per_inside,
        };
        match (shape, driver) {
            (Shape::Lag, _) if same_kind => Unit {
                name: "ms".to_string(),
                per_inside: 1e3,
            },
            (Shape::Lag, Driver::Axis(_)) if component == InsideUnit::Radian => per("(mm/s)"),
            (Shape::Lag, _) => per("(rad/s)"),
            (Shape::Drift, _) => per("h"),
            (Shape::Polynomial { .. } | Shape::Power { .. }, Driver::Gravity) => per("m"),
            (Shape::Polynomial { .. } | Shape::Power { .. }, Driver::Temperature) => per("K"),
            _ => plain,
        }
    }
}
