//! The names of effects in results, and effects from such names.

use super::component::{AxisName, Component};
use super::effect::{Driver, Injected, Shape};

/// The name of an effect in a result: `{"component": "EZC", "driver": "C", "shape": "harmonic", "order": 3}`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct EffectLabel {
    /// `EZC`, `EX0C`, `workpiece_ball.x`, `bar`, `gain`, `trigger`.
    pub component: String,
    /// An axis, `time`, `temperature`, `gravity`, or `none` for a constant.
    pub driver: String,
    /// `constant`, `polynomial`, `harmonic`, `periodic`, `backlash`, `lag`, `reversal-spike`, `local`, `steps`,
    /// `drift`, `warmup`; a remount is `steps` in `time`; `outside` for an effect without a name.
    pub shape: String,
    /// Order of a harmonic, degree of a polynomial.
    pub order: Option<u32>,
}

/// The name of an injected effect.
pub fn named(effect: &Injected) -> EffectLabel {
    let driver = match effect.driver {
        Driver::Axis(axis) => format!("{axis:?}"),
        Driver::Time => "time".to_string(),
        Driver::Temperature => "temperature".to_string(),
        Driver::Spindle(_) => "spindle_temperature_c".to_string(),
        Driver::Gravity => "gravity".to_string(),
        Driver::Nothing => "none".to_string(),
    };
    let (shape, order) = match &effect.shape {
        Shape::Constant => ("constant", None),
        Shape::Polynomial { degree } => ("polynomial", Some(*degree)),
        Shape::Harmonic { order, .. } => ("harmonic", Some(*order)),
        Shape::Periodic { .. } => ("periodic", None),
        Shape::Backlash => ("backlash", None),
        Shape::Lag => ("lag", None),
        Shape::ReversalSpike { .. } => ("reversal-spike", None),
        Shape::Local { .. } => ("local", None),
        Shape::Steps { .. } | Shape::Remount { .. } => ("steps", None),
        Shape::Drift => ("drift", None),
        Shape::Warmup { .. } => ("warmup", None),
        Shape::FirstOrderLag { .. } => ("first-order-lag", None),
        Shape::Modulated { .. } | Shape::Chirp { .. } | Shape::Plateaus { .. } => ("outside", None),
    };
    EffectLabel { component: effect.component.to_string(), driver, shape: shape.to_string(), order }
}

/// The effect of a name, at unit amplitude and zero phase. Numbers that a name does not state (period, centre and
/// width, decay, positions of steps, time constant) come from `like` if that has the same shape. `None` if the plant
/// has no such effect.
pub fn from_name(name: &EffectLabel, like: &Injected) -> Option<Injected> {
    let component = Component::parse(&name.component)?;
    let driver = match name.driver.as_str() {
        "spindle_temperature_c" => like.driver,
        "time" => Driver::Time,
        "temperature" => Driver::Temperature,
        "gravity" => Driver::Gravity,
        "none" => Driver::Nothing,
        letter => Driver::Axis(AxisName::ALL.into_iter().find(|axis| format!("{axis:?}") == letter)?),
    };
    let shape = match name.shape.as_str() {
        "constant" => Shape::Constant,
        "polynomial" | "power" => Shape::Polynomial { degree: name.order? },
        "constant-per-mount" if matches!(like.shape, Shape::Remount { .. }) => like.shape.clone(),
        "harmonic" => Shape::Harmonic { order: name.order?, phase_deg: 0.0 },
        "backlash" => Shape::Backlash,
        "lag" => Shape::Lag,
        "drift" => Shape::Drift,
        "warmup" if !matches!(like.shape, Shape::Warmup { .. }) => Shape::Warmup { tau_s: 600.0 },
        other if other == named(like).shape => like.shape.clone(),
        _ => return None,
    };
    Some(Injected::new(component, driver, shape, 1.0))
}
