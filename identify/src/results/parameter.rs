//! Parameters with their uncertainties, covariance and null space, as JSON has them.

use std::collections::BTreeMap;
use std::fmt;

use abbe_model::parameter_id::ParameterId;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Coverage factor of the expanded uncertainty `U = k u` (JCGM 100, 6.2).
pub(crate) const COVERAGE_FACTOR: f64 = 2.0;

/// What determines the estimate of a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeterminedBy {
    /// The readings.
    #[default]
    Readings,
    /// Readings and set-up priors: the readings determine a sum of the parameter and set-up parameters, and only the
    /// priors of these separate it.
    Prior,
    /// Nothing by itself: the readings determine a combination of it and others.
    BaseCombination,
    /// Nothing: no reading changes with it.
    Nothing,
}

impl DeterminedBy {
    /// The word in results.
    pub fn word(self) -> &'static str {
        match self {
            DeterminedBy::Readings => "readings",
            DeterminedBy::Prior => "prior",
            DeterminedBy::BaseCombination => "base-combination",
            DeterminedBy::Nothing => "nothing",
        }
    }
}

impl fmt::Display for DeterminedBy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// An alias of an effect that enlarges an uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EnlargedBy {
    /// The effect.
    pub effect: String,
    /// The alias that would change the parameter most in its place.
    pub alias: String,
    /// The change, in the unit of the parameter.
    pub change: f64,
}

/// A value with its standard uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Estimate {
    /// Identifier: `EY0A`, `bar[A100]`, `EZC~C:h2.amplitude`.
    pub id: String,
    /// Estimate, in `unit`.
    pub value: f64,
    /// Standard uncertainty, in `unit`. 0 where it is not quantified.
    pub u: f64,
    /// Expanded uncertainty `U = 2 u`, in `unit`.
    pub expanded_u: f64,
    /// Unit of `value`, `u` and `expanded_u`: `um`, `arcsec`, `deg`, …
    pub unit: String,
    /// Whether `|value|` exceeds `expanded_u` (for a phase: whether its amplitude does) and the readings alone
    /// determine the parameter.
    pub significant: bool,
    /// What determines the estimate: the readings, or the set-up priors only.
    pub determined_by: DeterminedBy,
    /// Whether the estimate may be quoted with its uncertainty.
    pub quotable: bool,
    /// The aliases of effects that enlarge `u`, one for each effect, if any does.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub enlarged_by: Vec<EnlargedBy>,
    /// Standard uncertainty without aliases, in `unit`, if an alias enlarges it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub u_without_aliases: Option<f64>,
    /// The 95 % interval of a number of a shape by its profile likelihood, in `unit`, where χ² is not parabolic. Half of it is
    /// at most 1.96 `u`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval_95: Option<[f64; 2]>,
    /// What the parameter is, in words: `C table: inclination of the axis about Y (squareness to X)`.
    pub meaning: String,
}

impl Estimate {
    /// A parameter with the expanded uncertainty and the significance that follow from `value` and `u`.
    pub fn new(id: impl Into<String>, value: f64, u: f64, unit: impl Into<String>) -> Estimate {
        let mut parameter = Estimate {
            id: id.into(),
            value,
            u,
            expanded_u: 0.0,
            unit: unit.into(),
            significant: false,
            determined_by: DeterminedBy::Readings,
            quotable: true,
            enlarged_by: Vec::new(),
            u_without_aliases: None,
            interval_95: None,
            meaning: String::new(),
        };
        parameter.set_u(u);
        parameter
    }

    /// The same with its meaning in words.
    pub fn with_meaning(self, meaning: impl Into<String>) -> Estimate {
        Estimate { meaning: meaning.into(), ..self }
    }

    /// Replaces the standard uncertainty, and what follows from it.
    pub fn set_u(&mut self, u: f64) {
        self.u = u;
        self.expanded_u = COVERAGE_FACTOR * u;
        self.significant = self.exceeds_u() && self.determined_by == DeterminedBy::Readings;
    }

    /// Whether it is a parameter of this kind.
    pub fn is(&self, kind: fn(&ParameterId) -> bool) -> bool {
        self.id.parse::<ParameterId>().is_ok_and(|id| kind(&id))
    }

    /// Whether `|value|` exceeds `expanded_u`, be it by the readings or by the set-up priors.
    pub fn exceeds_u(&self) -> bool {
        self.u > 0.0 && self.value.abs() > self.expanded_u
    }

    /// States what determines the estimate, and what follows from it.
    pub fn set_determined_by(&mut self, determined_by: DeterminedBy) {
        self.determined_by = determined_by;
        self.quotable &= determined_by == DeterminedBy::Readings;
        self.set_u(self.u);
    }
}

/// A value with its standard uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MeasuredValue {
    /// Estimate.
    pub value: f64,
    /// Standard uncertainty.
    pub u: f64,
}

/// The change of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ParameterChange {
    /// Identifier.
    pub id: String,
    /// Its change, in `unit`: the other input less the first, now less the model, after less before.
    pub value: f64,
    /// Its standard uncertainty, in `unit`; of `changed_parameters` that of `after`.
    pub u: f64,
    /// Unit of `value` and `u`.
    pub unit: String,
}

/// Gives each phase the significance of the amplitude in front of it.
pub(crate) fn phases_follow_amplitudes(parameters: &mut [Estimate]) {
    for k in 1..parameters.len() {
        if parameters[k].is(ParameterId::is_phase) {
            parameters[k].significant = parameters[k - 1].significant;
        }
    }
}

/// Why a combination of parameters has no value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Finding {
    /// It changes no reading, whatever the noise: the parameters are confounded.
    #[default]
    Structural,
    /// It changes readings by less than their noise: its uncertainty exceeds what any such machine has.
    Weak,
}

/// A combination of parameters that is not identifiable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unobservable {
    /// Coefficient of each parameter, in its display unit. A change in this proportion changes no reading by more than
    /// the noise.
    pub combination: BTreeMap<String, f64>,
    /// Whether it changes no reading, or readings by less than their noise.
    pub finding: Finding,
    /// Explanation in words.
    pub why: String,
}

/// Coefficient of each parameter, in the parameter's display unit.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct Combination(BTreeMap<String, f64>);

impl Combination {
    /// The pairs of an object, in their order.
    ///
    /// # Errors
    /// Those of the deserialiser.
    pub fn pairs<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<(String, f64)>, D::Error> {
        let of_object = serde_json::Map::deserialize(deserializer)?.into_iter();
        Ok(of_object.filter_map(|(id, coefficient)| Some((id, coefficient.as_f64()?))).collect())
    }

    /// Serialises pairs of identifier and coefficient as an object, in their order.
    ///
    /// # Errors
    /// Those of the serialiser.
    pub fn serialize_pairs<S: Serializer>(pairs: &[(String, f64)], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(pairs.iter().map(|(id, coefficient)| (id, coefficient)))
    }
}

/// The null space of the readings in reduced row echelon form.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NullSpace {
    /// The parameters that take part in a null-space direction.
    pub ids: Vec<String>,
    /// Display unit of each of them.
    pub units: Vec<String>,
    /// One row per null-space direction, one column per parameter of `ids`, in the units of `units`. The coefficient of
    /// the leading parameter is 1.
    pub vectors: Vec<Vec<f64>>,
}

/// Covariance matrix of the parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Covariance {
    /// The parameters, in the order of rows and columns: that of `parameters`.
    pub ids: Vec<String>,
    /// Unit of each parameter. Entry (i, j) has the unit `units[i] · units[j]`.
    pub units: Vec<String>,
    /// The matrix, row by row. Its diagonal holds the squares of the `u` in `parameters`.
    pub matrix: Vec<Vec<f64>>,
}

/// An interval of values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Both ends after a function.
    pub fn map(self, function: impl Fn(f64) -> f64) -> Interval {
        Interval { low: function(self.low), high: function(self.high) }
    }
}

impl From<[f64; 2]> for Interval {
    fn from([low, high]: [f64; 2]) -> Interval {
        Interval { low, high }
    }
}
