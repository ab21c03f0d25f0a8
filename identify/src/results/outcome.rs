//! What the result of an analysis is worth, as JSON has it: whether the residual agrees with the noise, what determines
//! each estimate, and what was assumed.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::parameter::{Combination, DeterminedBy};

/// Whether the residual of a model agrees with the noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GoodnessVerdict {
    /// It does.
    Agrees,
    /// χ²/ν is significantly above 1 (p < 0.001): the model lacks an effect.
    Exceeds,
    /// χ²/ν does not exceed 1 significantly, but the residual has structure: the model lacks an effect.
    Structured,
    /// It cannot be judged: `not_judged` says why.
    #[default]
    NotJudged,
}

/// Why a residual cannot be judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NotJudged {
    /// No noise is stated or follows from repeats, so that the residual is taken for noise.
    NoNoise,
    /// χ²/ν is significantly below 0.5 (p < 0.001): the noise is overstated.
    BelowNoise,
    /// The readings probably have another unit: the residual is less than a tenth of the stated noise, or no such
    /// instrument reads such sizes.
    WrongUnit,
    /// The readings are as many as the parameters that they determine.
    NoDegreesOfFreedom,
}

impl GoodnessVerdict {
    /// The word in results.
    pub fn word(self) -> &'static str {
        match self {
            GoodnessVerdict::Agrees => "agrees",
            GoodnessVerdict::Exceeds => "exceeds",
            GoodnessVerdict::Structured => "structured",
            GoodnessVerdict::NotJudged => "not-judged",
        }
    }

    /// Whether the model lacks an effect. Its estimates are then biased, and no uncertainty covers that.
    pub fn lacks_an_effect(self) -> bool {
        matches!(self, GoodnessVerdict::Exceeds | GoodnessVerdict::Structured)
    }
}

impl fmt::Display for GoodnessVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// The residual of a model against the noise, and what may be said of its estimates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Goodness {
    /// Whether the residual agrees with the noise.
    pub verdict: GoodnessVerdict,
    /// Why it cannot be judged; absent if it is judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_judged: Option<NotJudged>,
    /// χ²/ν.
    pub chi_square_ratio: f64,
    /// Probability of a larger χ² if the model lacks nothing; absent if the residual is taken for noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// Whether estimates may be quoted with their uncertainties: not while the model lacks an effect or the unit of the
    /// readings is in doubt.
    pub quotable: bool,
    /// Whether the uncertainties cover everything that is known to be wrong with the model. They do not cover a lacking
    /// effect.
    pub u_covers_model: bool,
}

impl Goodness {
    /// The same with the verdict and what follows from it.
    pub fn with_verdict(self, verdict: GoodnessVerdict) -> Goodness {
        let complete = !verdict.lacks_an_effect() && self.not_judged != Some(NotJudged::WrongUnit);
        Goodness { verdict, quotable: complete, u_covers_model: complete, ..self }
    }

    /// Why nothing can be decided from the estimates of the model; `None` if something can.
    pub fn forbids_decisions(self) -> Option<&'static str> {
        match self.verdict {
            GoodnessVerdict::Agrees => None,
            GoodnessVerdict::Exceeds => {
                Some("the residual exceeds the noise: the model lacks an effect, which the uncertainty does not cover")
            }
            GoodnessVerdict::Structured => {
                Some("the residual has structure: the model lacks an effect, which the uncertainty does not cover")
            }
            GoodnessVerdict::NotJudged => Some(match self.not_judged {
                Some(NotJudged::BelowNoise) => {
                    "the residual is far below the noise: whether the model lacks an effect cannot be judged; state the \
                     noise that the instrument has"
                }
                Some(NotJudged::WrongUnit) => {
                    "the unit of the readings is in doubt (residual less than a tenth of the noise, or readings of a size that such \
                     an instrument does not read): it is probably not the stated one; check units and noise"
                }
                Some(NotJudged::NoDegreesOfFreedom) => {
                    "no degrees of freedom are left: whether the model lacks an effect cannot be judged; measure more \
                     readings"
                }
                Some(NotJudged::NoNoise) | None => {
                    "no noise is stated or follows from repeats: whether the model lacks an effect cannot be judged; state \
                     `noise_um` or repeat a run"
                }
            }),
        }
    }

    /// The same for a residual that has structure or has none.
    pub fn with_structure(self, structured: bool) -> Goodness {
        match self.verdict {
            verdict if !structured || verdict.lacks_an_effect() => self,
            _ => self.with_verdict(GoodnessVerdict::Structured),
        }
    }
}

/// An error that is confounded with set-up parameters and determined by their priors only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DeterminedByPrior {
    /// The error.
    pub error: String,
    /// A change in this proportion changes no reading. Display units; the error first.
    #[serde(serialize_with = "Combination::serialize_pairs", deserialize_with = "Combination::pairs")]
    #[schemars(with = "Combination")]
    pub combination: Vec<(String, f64)>,
    /// Explanation in words.
    pub why: String,
}

/// A parameter that has no estimate of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NotEstimated {
    /// Identifier.
    pub id: String,
    /// `base-combination` if the readings determine it together with others, `nothing` if they do not depend on it.
    pub determined_by: DeterminedBy,
}

/// What an assumption is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AssumptionKind {
    /// The size of the noise and its source.
    Noise,
    /// The stated values and uncertainties of the set-up.
    Priors,
    /// Readings that do not count.
    ExcludedReadings,
    /// One explanation of an effect, of several that the readings do not separate.
    Explanation,
}

/// What the readings say about an assumption.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AssumptionVerdict {
    /// They agree with it.
    Agrees,
    /// They contradict it.
    Contradicted,
    /// They cannot test it.
    NotTested,
}

impl fmt::Display for AssumptionVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            AssumptionVerdict::Agrees => "agrees",
            AssumptionVerdict::Contradicted => "contradicted",
            AssumptionVerdict::NotTested => "not-tested",
        })
    }
}

/// Something that a result assumes, and the test of it by the readings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Assumption {
    /// What it is about.
    pub kind: AssumptionKind,
    /// The assumption in words.
    pub statement: String,
    /// What the readings say about it.
    pub verdict: AssumptionVerdict,
    /// The test in words.
    pub test: String,
}

/// The range of the data along an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DataRange {
    /// The axis.
    pub axis: String,
    /// Least and greatest position, in `unit`.
    pub range: [f64; 2],
    /// `mm` or `deg`.
    pub unit: String,
}

/// What the result of an analysis is worth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outcome {
    /// The residual against the noise, and whether estimates may be quoted.
    pub goodness: Goodness,
    /// Errors that are confounded with set-up parameters and determined by the set-up priors only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub determined_by_prior: Vec<DeterminedByPrior>,
    /// Parameters without an estimate of their own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_estimated: Vec<NotEstimated>,
    /// What the result assumes, each with its test.
    pub assumptions: Vec<Assumption>,
    /// The range of the readings along each axis that moves.
    pub ranges: Vec<DataRange>,
}

impl Outcome {
    /// Why repeats contradict the stated noise; `None` if they do not.
    pub fn contradicted_noise(&self) -> Option<&str> {
        let of_noise = self.assumptions.iter().find(|assumption| assumption.kind == AssumptionKind::Noise);
        of_noise.filter(|noise| noise.verdict == AssumptionVerdict::Contradicted).map(|noise| noise.test.as_str())
    }
}

/// The verdict of a trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TraceVerdict {
    /// Nothing beyond the noise.
    Clean,
    /// Effects were found, and nothing beyond the noise remains.
    Explained,
    /// Effects were found, and structure or a residual beyond the noise remains.
    PartlyExplained,
    /// Structure or a residual beyond the noise, for which no entry of the library accounts.
    Unexplained,
    /// No structure remains, but no noise is known: whether the residual is noise cannot be judged.
    NotJudged,
    /// The trace was interrupted.
    #[default]
    Incomplete,
}

impl TraceVerdict {
    /// The word in results.
    pub fn word(self) -> &'static str {
        match self {
            TraceVerdict::Clean => "clean",
            TraceVerdict::Explained => "explained",
            TraceVerdict::PartlyExplained => "partly-explained",
            TraceVerdict::Unexplained => "unexplained",
            TraceVerdict::NotJudged => "not-judged",
            TraceVerdict::Incomplete => "incomplete",
        }
    }

    /// The verdict while the model is judged so. `clean` and `explained` need a residual that agrees with a known noise.
    pub fn gated(self, goodness: GoodnessVerdict) -> TraceVerdict {
        match (self, goodness) {
            (TraceVerdict::Clean, by) if by.lacks_an_effect() => TraceVerdict::Unexplained,
            (TraceVerdict::Explained, by) if by.lacks_an_effect() => TraceVerdict::PartlyExplained,
            (TraceVerdict::Clean | TraceVerdict::Explained, GoodnessVerdict::NotJudged) => TraceVerdict::NotJudged,
            (verdict, _) => verdict,
        }
    }
}

impl fmt::Display for TraceVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_its_word(value: &(impl Serialize + fmt::Display)) {
        assert_eq!(serde_json::to_value(value).unwrap(), value.to_string());
    }

    #[test]
    fn words_are_those_of_json() {
        use TraceVerdict::{Clean, Explained, Incomplete, PartlyExplained, Unexplained};
        [Clean, Explained, PartlyExplained, Unexplained, TraceVerdict::NotJudged, Incomplete]
            .iter()
            .for_each(is_its_word);
        use DeterminedBy::{BaseCombination, Nothing, Prior, Readings};
        [Readings, Prior, BaseCombination, Nothing].iter().for_each(is_its_word);
        use GoodnessVerdict::{Agrees, Exceeds, NotJudged, Structured};
        [Agrees, Exceeds, Structured, NotJudged].iter().for_each(is_its_word);
        use AssumptionVerdict::{Contradicted, NotTested};
        [AssumptionVerdict::Agrees, Contradicted, NotTested].iter().for_each(is_its_word);
    }

    #[test]
    fn no_model_that_lacks_an_effect_is_clean_or_explained() {
        for verdict in [TraceVerdict::Clean, TraceVerdict::Explained] {
            for goodness in [GoodnessVerdict::Exceeds, GoodnessVerdict::Structured, GoodnessVerdict::NotJudged] {
                let gated = verdict.gated(goodness);
                assert!(!matches!(gated, TraceVerdict::Clean | TraceVerdict::Explained), "{verdict} {goodness}");
            }
            assert_eq!(verdict.gated(GoodnessVerdict::Agrees), verdict);
        }
        assert_eq!(TraceVerdict::Unexplained.gated(GoodnessVerdict::NotJudged), TraceVerdict::Unexplained);
    }
}
