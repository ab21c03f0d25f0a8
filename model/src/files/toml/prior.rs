//! Reader and writer of the prior of an effect's coefficients: `scale_um`, `scale_arcsec`, `family`.

use super::document::{Table, Value};
use super::quoted::quoted;
use crate::effect::keys::KeyWriter;
use crate::effect::{CoefficientPrior, Component, Shape};
use crate::error::ModelError;
use crate::instrument::{InstrumentParameter, InternalUnit};
use crate::session::limits::MIN_UM;
use crate::words;

/// The keys of a stated standard deviation, with the internal unit of the component that has them.
const SCALES: [(&str, InternalUnit); 2] =
    [("scale_um", InternalUnit::Millimetre), ("scale_arcsec", InternalUnit::Radian)];

/// Radians in one arcsecond.
const ARCSEC: f64 = std::f64::consts::PI / (180.0 * 3600.0);

/// Internal units in one unit of a key.
fn internal(unit: InternalUnit) -> f64 {
    if unit == InternalUnit::Radian { ARCSEC } else { 1e-3 }
}

/// Reads the prior. Without keys it is that of the shape.
pub(super) fn read(
    table: &mut Table<'_>,
    component: &Component,
    shape: &Shape,
    parameters: &[InstrumentParameter],
) -> Result<CoefficientPrior, ModelError> {
    let mut prior = CoefficientPrior::default_of(shape);
    let mut stated: Option<Value<'_>> = None;
    for (key, unit) in SCALES {
        let Some(value) = table.take(key) else { continue };
        if component.unit(parameters) != Some(unit) {
            let other = SCALES.iter().find(|(_, other)| component.unit(parameters) == Some(*other));
            let help = match other {
                Some((other, _)) => format!("use `{other}`"),
                None => "remove it: this component has no unit of length or angle".to_string(),
            };
            let message = format!("`{key}` for the component \"{component}\"");
            return Err(value.source.error(value.key_span.clone(), message, Some(help)));
        }
        let scale = value.positive()?;
        if !(MIN_UM..=MAX_SCALE).contains(&scale) {
            let message = format!("`{key}` is {}; it must be between {MIN_UM} and {MAX_SCALE}", words::number(scale));
            return Err(value.error(message, None));
        }
        prior = CoefficientPrior::Scale(scale * internal(unit));
        stated = Some(value);
    }
    if let Some(value) = table.take("family") {
        if stated.is_some() {
            let help = "omit `family` to use the stated scale, or omit the scale to estimate it for the family";
            return Err(value.error("`family` beside a stated scale", Some(help.into())));
        }
        let name = value.text()?;
        if name.is_empty() {
            return Err(value.error("the name of a family is empty", Some("such as \"compliance\"".into())));
        }
        prior = CoefficientPrior::Family(name);
    }
    Ok(prior)
}

/// Largest stated scale, µm or arcsec: wider than any error of a machine that a model of small errors describes.
const MAX_SCALE: f64 = 1e6;

/// Writes the prior, unless it is that of the shape.
pub(super) fn write(prior: &CoefficientPrior, component: &Component, shape: &Shape, keys: &mut KeyWriter) {
    match prior {
        prior if *prior == CoefficientPrior::default_of(shape) => {}
        CoefficientPrior::Flat => {}
        CoefficientPrior::Family(name) => keys.line("family", quoted(name)),
        CoefficientPrior::Scale(scale) => {
            let (key, unit) = SCALES[usize::from(component.is_angle())];
            keys.line(key, scale / internal(unit));
        }
    }
}
