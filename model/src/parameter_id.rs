//! What a parameter is, and its identifier in results and files.
//!
//! ```text
//! EY0A   EXC                                  an error of an axis, by ISO 230-1
//! bar[A100]   workpiece_ball.x[P1]   gain     the set-up: object, coordinate, the tests that share it
//! EZC~C:h2.amplitude   EXX~X:steps[A+B]#2     an effect: component, driver, shape, tests, number; its part
//! ```

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::component::ErrorName;
use crate::document::effect::POSITIONS;
use crate::effect::{Component, Effect};

/// What a parameter is.
///
/// ```
/// use abbe_model::parameter_id::ParameterId;
///
/// let phase: ParameterId = "EZC~C:h2.phase".parse()?;
/// assert!(phase.is_phase() && phase.effect().is_some_and(|effect| effect.shape == "h2"));
/// let bar: ParameterId = "bar[A100]".parse()?;
/// assert_eq!((bar.thing(), bar.to_string().as_str()), (Some("bar"), "bar[A100]"));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(inline)]
pub enum ParameterId {
    /// A location error or a constant error motion of an axis.
    Error(ErrorName),
    /// A quantity of the set-up, as a deviation from its stated value.
    Setup {
        /// The object: [`InstrumentParameter::thing`](crate::instrument::InstrumentParameter::thing).
        thing: String,
        /// Its coordinate, or empty.
        coordinate: String,
        /// The tests that share it, [`Test::group`](crate::session::Test::group); empty for all.
        group: String,
    },
    /// A part of an effect.
    Effect(Arc<EffectId>, Part),
}

/// The identifier of an effect.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct EffectId {
    /// The component.
    pub component: Component,
    /// The word of the driver.
    pub driver: String,
    /// The [tag](crate::effect::shape::ShapeKind::tag) of the shape, the tests in which the effect acts, and from 2 its
    /// number among the effects that differ only in the numbers of their shapes: `h2`, `steps[A+B]#2`.
    pub shape: String,
}

/// A part of an effect that has a value.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// A coefficient by its [name](crate::effect::shape::ShapeKind::coefficient_names): `cos`, `3`, `sin12`; empty for
    /// the only one.
    Coefficient(String),
    /// The amplitude of a wave.
    Amplitude,
    /// The phase of a wave.
    Phase,
    /// The root mean square of a spectrum.
    Rms,
    /// An estimated [number](crate::effect::shape::ShapeKind::number_names) of the shape: `period`.
    Number(String),
    /// An estimated position of the shape, from 1; `None` for the only one.
    Position(Option<usize>),
}

impl ParameterId {
    /// The error of an axis that it is.
    pub fn error(&self) -> Option<&ErrorName> {
        if let ParameterId::Error(name) = self { Some(name) } else { None }
    }

    /// Whether it is an error of an axis.
    pub fn is_error(&self) -> bool {
        self.error().is_some()
    }

    /// The object of a quantity of the set-up: `bar`, `workpiece_ball`.
    pub fn thing(&self) -> Option<&str> {
        if let ParameterId::Setup { thing, .. } = self { Some(thing) } else { None }
    }

    /// Whether it is a quantity of the set-up.
    pub fn is_setup(&self) -> bool {
        self.thing().is_some()
    }

    /// The tests that share a quantity of the set-up, unless all do.
    pub fn group(&self) -> Option<&str> {
        match self {
            ParameterId::Setup { group, .. } if !group.is_empty() => Some(group),
            _ => None,
        }
    }

    /// The same quantity of the set-up, shared by other tests.
    #[must_use]
    pub fn with_group(mut self, other: &str) -> ParameterId {
        if let ParameterId::Setup { group, .. } = &mut self {
            *group = other.to_string();
        }
        self
    }

    /// The effect of which it is a part.
    pub fn effect(&self) -> Option<&Arc<EffectId>> {
        if let ParameterId::Effect(effect, _) = self { Some(effect) } else { None }
    }

    /// The part of an effect that it is.
    pub fn part(&self) -> Option<&Part> {
        if let ParameterId::Effect(_, part) = self { Some(part) } else { None }
    }

    /// Whether it is a coefficient of an effect.
    pub fn is_coefficient(&self) -> bool {
        matches!(self.part(), Some(Part::Coefficient(_)))
    }

    /// Whether it is an estimated number of a shape.
    pub fn is_number(&self) -> bool {
        matches!(self.part(), Some(Part::Number(_)))
    }

    /// Whether it is an estimated position of a shape.
    pub fn is_position(&self) -> bool {
        matches!(self.part(), Some(Part::Position(_)))
    }

    /// Whether it is the phase of a wave.
    pub fn is_phase(&self) -> bool {
        self.part() == Some(&Part::Phase)
    }

    /// Another part of the same effect; the parameter itself if it belongs to none.
    #[must_use]
    pub fn with_part(&self, part: Part) -> ParameterId {
        self.effect().map_or_else(|| self.clone(), |effect| ParameterId::Effect(Arc::clone(effect), part))
    }

    /// The first of the two coefficients of a wave, if it is one of them, the amplitude or the phase; itself otherwise.
    #[must_use]
    pub fn cosine(&self) -> ParameterId {
        match self.part() {
            Some(Part::Amplitude | Part::Phase) => self.with_part(Part::Coefficient("cos".to_string())),
            Some(Part::Coefficient(name)) if name == "sin" => self.with_part(Part::Coefficient("cos".to_string())),
            _ => self.clone(),
        }
    }
}

impl EffectId {
    /// The identifier of an effect, the `number`-th of this name in a session, from 1.
    pub fn of(effect: &Effect, number: usize) -> EffectId {
        let mut shape = effect.shape.tag();
        if !effect.tests.is_empty() {
            shape += &format!("[{}]", effect.tests.join("+"));
        }
        if number > 1 {
            shape += &format!("#{number}");
        }
        EffectId { component: effect.component.clone(), driver: effect.driver.to_string(), shape }
    }

    /// The effect of this identifier, or of this part of it.
    pub fn parse(text: &str) -> Option<Arc<EffectId>> {
        text.parse::<ParameterId>().ok()?.effect().cloned()
    }

    /// Whether another effect has the same component and driver.
    pub fn is_alike(&self, other: &EffectId) -> bool {
        (&self.component, &self.driver) == (&other.component, &other.driver)
    }
}

impl Part {
    /// Whether it is one of several numbered coefficients.
    pub fn is_numbered(&self) -> bool {
        matches!(self, Part::Coefficient(name) if name.ends_with(|last: char| last.is_ascii_digit()))
    }

    fn parse(name: &str) -> Option<Part> {
        let stem = name.trim_end_matches(|digit: char| digit.is_ascii_digit());
        let number = &name[stem.len()..];
        match stem {
            "" | "cos" | "sin" => Some(Part::Coefficient(name.to_string())),
            POSITIONS => Some(Part::Position(if number.is_empty() { None } else { Some(number.parse().ok()?) })),
            _ if !number.is_empty() || !stem.bytes().all(|letter| letter.is_ascii_lowercase()) => None,
            "amplitude" => Some(Part::Amplitude),
            "phase" => Some(Part::Phase),
            "rms" => Some(Part::Rms),
            _ => Some(Part::Number(name.to_string())),
        }
    }
}

impl fmt::Display for ParameterId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ParameterId::Error(name) => name.fmt(formatter),
            ParameterId::Setup { thing, coordinate, group } => {
                let dot = if coordinate.is_empty() { "" } else { "." };
                let [open, close] = if group.is_empty() { ["", ""] } else { ["[", "]"] };
                write!(formatter, "{thing}{dot}{coordinate}{open}{group}{close}")
            }
            ParameterId::Effect(effect, Part::Coefficient(name)) if name.is_empty() => effect.fmt(formatter),
            ParameterId::Effect(effect, part) => write!(formatter, "{effect}.{part}"),
        }
    }
}

impl fmt::Display for EffectId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}~{}:{}", self.component, self.driver, self.shape)
    }
}

impl fmt::Display for Part {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Part::Coefficient(name) | Part::Number(name) => formatter.write_str(name),
            Part::Amplitude => formatter.write_str("amplitude"),
            Part::Phase => formatter.write_str("phase"),
            Part::Rms => formatter.write_str("rms"),
            Part::Position(None) => formatter.write_str(POSITIONS),
            Part::Position(Some(number)) => write!(formatter, "{POSITIONS}{number}"),
        }
    }
}

impl FromStr for ParameterId {
    type Err = String;

    /// An error of an axis may have its name in the literature.
    fn from_str(text: &str) -> Result<ParameterId, String> {
        parameter(text).ok_or_else(|| format!("`{text}` is not the identifier of a parameter"))
    }
}

fn parameter(text: &str) -> Option<ParameterId> {
    let (quantity, group) = text.split_at(text.find('[').unwrap_or(text.len()));
    if quantity.contains('~') {
        return part_of_effect(text);
    }
    let group = match group.strip_prefix('[') {
        Some(group) => group.strip_suffix(']').filter(|group| !group.is_empty())?.to_string(),
        None => String::new(),
    };
    match Component::parse(quantity)? {
        Component::Instrument { thing, coordinate } => Some(ParameterId::Setup { thing, coordinate, group }),
        Component::Axis(name) if group.is_empty() => Some(ParameterId::Error(name)),
        _ => None,
    }
}

fn part_of_effect(text: &str) -> Option<ParameterId> {
    let (component, text) = text.split_once('~')?;
    let (driver, text) = text.split_once(':')?;
    // Names of tests have any character. Behind them and behind a number a dot begins the part.
    let dot = match text.rfind(']').or_else(|| text.find('#')) {
        Some(end) => text[end..].find('.').map(|dot| end + dot),
        None => text.rfind('.').filter(|dot| !is_decimal(&text[..*dot], &text[dot + 1..])),
    };
    let (shape, part) = match dot {
        Some(dot) => (&text[..dot], Part::parse(&text[dot + 1..])?),
        None => (text, Part::Coefficient(String::new())),
    };
    let effect = EffectId {
        component: Component::parse(component)?,
        driver: driver.to_string(),
        shape: Some(shape.to_string()).filter(|shape| !shape.is_empty())?,
    };
    Some(ParameterId::Effect(Arc::new(effect), part))
}

/// Whether digits behind the dot of a tag are decimals of its order, `h2.5`: of the shapes with an order only polynomials
/// number their coefficients, `p3.2`.
fn is_decimal(tag: &str, behind: &str) -> bool {
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let is_polynomial = tag.strip_prefix('p').is_some_and(are_digits);
    are_digits(behind) && !is_polynomial && tag.ends_with(|last: char| last.is_ascii_digit())
}

impl TryFrom<String> for ParameterId {
    type Error = String;

    fn try_from(text: String) -> Result<ParameterId, String> {
        text.parse()
    }
}

impl From<ParameterId> for String {
    fn from(id: ParameterId) -> String {
        id.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::Driver;
    use crate::effect::Shape;
    use crate::effect::shape::*;

    /// One of each shape, with orders and positions that make the identifier long.
    fn shapes() -> Vec<Shape> {
        vec![
            Shape::Constant,
            Shape::Polynomial(Polynomial { degree: 12, scale: 1.0 }),
            Shape::Polynomial(Polynomial { degree: 1, scale: 1.0 }),
            Shape::Power(Power { degree: 3, scale: 1.0 }),
            Shape::Harmonic(Harmonic { order: 2.0 }),
            Shape::Harmonic(Harmonic { order: 2.5 }),
            Shape::Cosine(Cosine { order: 0.25 }),
            Shape::Cotangent,
            Shape::Precession(Precession { order: 2.5, backward: true }),
            Shape::Periodic(Periodic { period: 0.1 }),
            Shape::Spectrum(Spectrum { orders: 12, period: 6.0 }),
            Shape::Triangle(Triangle { period: 0.1 }),
            Shape::Curve(Curve { from: 0.0, to: 1.0, intervals: 12, closed: false }),
            Shape::Backlash,
            Shape::Lag,
            Shape::ReversalSpike(ReversalSpike { width: 0.1 }),
            Shape::Drift,
            Shape::Warmup(Warmup { tau_s: 60.0 }),
            Shape::FirstOrderLag(FirstOrderLag { tau_s: 60.0, scale: 1.0 }),
            Shape::Steps(Steps { at: vec![0.1, 0.2] }),
            Shape::Local(Local { centre: 0.1, width: 0.2, recurs: None }),
        ]
    }

    /// The parts of an effect are found behind any name of a test and any number, and a decimal of an order is none.
    #[test]
    fn parts_of_effects_of_every_shape_are_read_as_what_they_are() {
        let all = shapes();
        for entry in SHAPES {
            assert!(all.iter().any(|shape| shape.entry().word == entry.word), "{}", entry.word);
        }
        let tests: [&[&str]; 3] = [&[], &["A.cos", "B#2"], &["x[1].phase"]];
        let components = ["EZC", "spindle_ball.y", "trigger"];
        for (shape, tests, component, number) in all.iter().flat_map(|shape| {
            let numbers = tests.iter().flat_map(|tests| [1, 2, 13].map(|number| (*tests, number)));
            numbers.flat_map(move |(tests, number)| components.map(|component| (shape, tests, component, number)))
        }) {
            let tests = tests.iter().map(|test| (*test).to_string()).collect();
            let component = Component::parse(component).unwrap();
            let effect = Effect { tests, ..Effect::new(component, Driver::parse("temperature"), shape.clone()) };
            let id = Arc::new(EffectId::of(&effect, number));
            let mut parts: Vec<Part> = shape.coefficient_names().into_iter().map(Part::Coefficient).collect();
            parts.extend(shape.number_names().iter().map(|name| Part::Number((*name).to_string())));
            parts.extend([Part::Amplitude, Part::Phase, Part::Rms, Part::Position(None), Part::Position(Some(40))]);
            for part in parts {
                let known = ParameterId::Effect(Arc::clone(&id), part);
                assert_eq!(known.to_string().parse::<ParameterId>().as_ref(), Ok(&known), "{known}");
            }
        }
    }

    #[test]
    fn quantities_of_the_set_up_keep_any_group() {
        for (text, is) in [
            ("bar[A.1~x:h2]", ["bar", "", "A.1~x:h2"]),
            ("workpiece_ball.x[P[1]]", ["workpiece_ball", "x", "P[1]"]),
            ("gain", ["gain", "", ""]),
            // A target of a composed measurement has the name that its session gives.
            ("sphere.x[S]", ["sphere", "x", "S"]),
        ] {
            let [thing, coordinate, group] = is.map(str::to_string);
            let id = ParameterId::Setup { thing, coordinate, group };
            assert_eq!((text.parse::<ParameterId>().as_ref(), id.to_string().as_str()), (Ok(&id), text));
        }
        assert_eq!("e_x0c".parse::<ParameterId>().map(|id| id.to_string()), Ok("EX0C".to_string()));
        for text in ["", "bar[A", "bar[]", "EX0C[A]", "set-up", "EZC~C", "EZC~C:", "EZC~C:h2.Phase", "nothing.w[A]"] {
            assert!(text.parse::<ParameterId>().is_err(), "{text}");
        }
    }
}
