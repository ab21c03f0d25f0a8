//! The study file.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use abbe_files::ReadOptions;
use abbe_files::read::effect_of_document;
use abbe_files::stamp::FileStamp;
use abbe_identify::simulate::{Simulation, simulate};
use abbe_model::Diagnostic;
use abbe_model::document::effect::Effect as EffectDocument;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::value::Count;
use abbe_model::effect::Effect;
use abbe_model::parameter_id::EffectId;
use abbe_model::session::Session;
use abbe_trace::TraceOptions;
use abbe_trace::screening::screened_effects;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::fleet::BUILD;

/// A study: which plans are simulated with which effects and noise, and how they are analysed.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// What is simulated and analysed.
    pub study: Head,
    /// The set-ups.
    pub plan: Vec<Plan>,
    /// The effects that the simulated machine has.
    pub effect: Vec<TrueEffect>,
    /// The noise.
    pub noise: Vec<Noise>,
}

/// What is simulated and analysed.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename = "study", deny_unknown_fields)]
pub struct Head {
    /// The analysis.
    pub analysis: Analysis,
    /// Draws of each combination of plan, effect and noise (`grid`), or of all together (`random`).
    pub draws: Count<1, MAX_DRAWS>,
    /// Whether all combinations are drawn, or each draw chooses one.
    #[serde(default)]
    pub combinations: Combinations,
    /// Seed of all random numbers.
    #[serde(default = "one")]
    pub seed: u64,
    /// Standard deviation of the drawn position errors, µm.
    #[serde(default)]
    pub location_um: Size,
    /// Standard deviation of the drawn orientation errors, arcsec.
    #[serde(default)]
    pub location_arcsec: Size,
}

fn one() -> u64 {
    1
}

/// The analysis of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "analysis", rename_all = "kebab-case")]
pub enum Analysis {
    /// The fit of the plan's parameters.
    Fit,
    /// The search for effects.
    Trace,
}

/// The combinations that are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename = "combinations", rename_all = "kebab-case")]
pub enum Combinations {
    /// All of them.
    #[default]
    Grid,
    /// One at random for each draw.
    Random,
}

/// A set-up.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename = "plan", deny_unknown_fields)]
pub struct Plan {
    /// Its name in the results.
    pub name: String,
    /// The session file, relative to the study file. Tests without data are simulated at their planned states.
    pub session: PathBuf,
}

/// An effect of the simulated machine. Only a name: no effect.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename = "true_effect", deny_unknown_fields)]
pub struct TrueEffect {
    /// Its name in the results.
    pub name: String,
    /// Size over the smallest significant one: the root of the χ² that the effect adds to the residual of the plan's
    /// parameters, over 2.807 (0.5 % two-sided).
    #[serde(default)]
    pub size: Size,
    /// `true`: each draw chooses an effect of the library that the plan can observe.
    #[serde(default)]
    pub library: bool,
    /// The effect otherwise, with the keys of `[[effect]]` of a session file.
    #[serde(default)]
    pub effect: Option<EffectDocument>,
}

/// The noise of simulated readings.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename = "noise", deny_unknown_fields)]
pub struct Noise {
    /// Its name in the results.
    pub name: String,
    /// Standard deviation of a reading, µm.
    pub um: Size,
    /// Correlation of neighbouring readings of a run.
    #[serde(default)]
    pub autocorrelation: Share,
    /// Share of outliers: 5 to 30 µm of either sign.
    #[serde(default)]
    pub outlier_share: Share,
}

/// A number from 0 to 10⁶.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
#[schemars(inline, extend("minimum" = 0, "maximum" = 1_000_000))]
pub struct Size(pub f64);

impl TryFrom<f64> for Size {
    type Error = String;

    fn try_from(number: f64) -> Result<Size, String> {
        let usable = (0.0..=1e6).contains(&number);
        if usable { Ok(Size(number)) } else { Err(format!("{number}; 0 to 1000000 is expected")) }
    }
}

/// A number from 0 to below 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
#[schemars(inline, extend("minimum" = 0, "exclusiveMaximum" = 1))]
pub struct Share(pub f64);

impl TryFrom<f64> for Share {
    type Error = String;

    fn try_from(number: f64) -> Result<Share, String> {
        let usable = (0.0..1.0).contains(&number);
        if usable { Ok(Share(number)) } else { Err(format!("{number}; 0 to below 1 is expected")) }
    }
}

/// Largest number of draws of a study, which are summarised together.
const MAX_DRAWS: usize = 1_000_000;
/// A study with its plans.
pub struct Study {
    /// The file.
    pub file: StudyFile,
    /// The plans with the readings of the nominal machine.
    pub plans: Vec<Session>,
    /// The declared effect of each entry of `effect` in each plan; `None` for no effect or one of the library.
    pub effects: Vec<Vec<Option<Effect>>>,
    /// SHA-256 of the study file, the plans and the version of the program, in hexadecimal. All random numbers follow
    /// from it.
    pub digest: String,
    /// SHA-256 of `digest` and the build of the program, in hexadecimal: draws of another build are made again.
    pub key: String,
    /// The study file as it was read.
    pub stamp: Option<FileStamp>,
}

/// Reads a study and its plans.
///
/// # Errors
/// With file and line or key of what cannot be used.
pub fn read(path: &Path) -> Result<Study, Diagnostic> {
    let source = abbe_files::text(path, "the study file")?;
    let parsed = source.parse()?;
    let here = |fault: Fault| parsed.error_of(fault);
    let file: StudyFile = parsed.document()?;
    check(&file).map_err(here)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut digest = Sha256::new();
    digest.update(concat!("abbe study 3 ", env!("CARGO_PKG_VERSION"), "\n"));
    digest.update(&source.text);
    let (mut plans, mut effects) = (Vec::new(), Vec::new());
    for (item, plan) in file.plan.iter().enumerate() {
        let place = folder.join(&plan.session);
        let options = ReadOptions { allow_outside: true, ..ReadOptions::default() };
        let (session, sources) = abbe_files::session_with_sources(&place, &options)?;
        for read in sources.files.iter().filter_map(FileStamp::read) {
            digest.update(read.sha256);
        }
        if session.units().angles {
            let what = format!("plan `{}` reads angles, and a study draws noise of lengths", plan.name);
            let fault = Fault::new(what, "study its tests of lengths alone").at("session").at_item(item).at("plan");
            return Err(here(fault));
        }
        let own: Vec<Option<Effect>> = per_effect(&file, |effect| declared(effect, &session)).map_err(here)?;
        let of_plan = |error: Diagnostic| {
            here(Fault::new(format!("plan `{}`: {error}", plan.name), None).at_item(item).at("plan"))
        };
        let nominal = Simulation { noise_mm: Some(0.0), ..Simulation::default() };
        let drawn = simulate(&session, &nominal).map_err(of_plan)?;
        let session = session.with_readings(drawn.readings);
        if file.study.analysis == Analysis::Trace && own.iter().any(Option::is_some) {
            let library = screened_effects(&session, &TraceOptions::default()).map_err(of_plan)?;
            let ids: HashSet<String> = library.iter().map(|screened| screened.effect.id()).collect();
            let mut known = own.iter();
            per_effect(&file, |_| {
                known.next().and_then(Option::as_ref).map_or(Ok(()), |effect| searched(effect, &ids))
            })
            .map_err(here)?;
        }
        effects.push(own);
        plans.push(session);
    }
    let hexadecimal = |digest: Sha256| digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let digest = hexadecimal(digest);
    let key = hexadecimal(Sha256::new().chain_update(&digest).chain_update(BUILD));
    let stamp = source.stamp.clone();
    Ok(Study { file, plans, effects, digest, key, stamp })
}

/// What follows from each entry of `effect`. A fault has its place.
fn per_effect<T>(file: &StudyFile, mut of: impl FnMut(&TrueEffect) -> Result<T, Fault>) -> Result<Vec<T>, Fault> {
    let entries = file.effect.iter().enumerate();
    entries.map(|(item, effect)| of(effect).within_item(item)).collect::<Result<_, _>>().within("effect")
}

/// The declared effect of an entry in a plan.
fn declared(entry: &TrueEffect, session: &Session) -> Result<Option<Effect>, Fault> {
    let tests: Vec<String> = session.tests.iter().map(|test| test.name.clone()).collect();
    let effect = entry.effect.as_ref();
    let effect =
        effect.map(|effect| effect_of_document(effect, &session.machine, &session.instrument_parameters(), &tests));
    effect.transpose().within("effect")
}

/// Checks that a search has the effect under its name: no other can be found, whatever the readings.
fn searched(effect: &Effect, ids: &HashSet<String>) -> Result<(), Fault> {
    let id = effect.id();
    if ids.contains(&id) {
        return Ok(());
    }
    let own = EffectId::of(effect, 1);
    let mut alike: Vec<&str> = ids.iter().map(String::as_str).collect();
    alike.retain(|other| EffectId::parse(other).is_some_and(|other| other.is_alike(&own)));
    alike.sort_unstable();
    alike.truncate(8);
    let help = match alike.is_empty() {
        true => "it has none of this component and driver".to_string(),
        false => format!("it has {}", alike.join(", ")),
    };
    Err(Fault::new(format!("the library of the trace has no effect `{id}`"), help).at("effect"))
}

fn check(file: &StudyFile) -> Result<(), Fault> {
    let head = &file.study;
    let named = [
        ("plan", file.plan.iter().map(|plan| plan.name.as_str()).collect::<Vec<_>>()),
        ("effect", file.effect.iter().map(|effect| effect.name.as_str()).collect()),
        ("noise", file.noise.iter().map(|noise| noise.name.as_str()).collect()),
    ];
    for (kind, names) in &named {
        if let Some(twice) = (1..names.len()).find(|k| names[..*k].contains(&names[*k])) {
            let message = format!("two [[{kind}]] are called `{}`", names[twice]);
            return Err(Fault::new(message, "give each its own name").at("name").at_item(twice).at(kind));
        }
        if names.is_empty() {
            return Err(Fault::of_key("is an empty list; at least one is expected", None).at(kind));
        }
    }
    let lists = named.map(|(_, names)| names.len());
    let all = lists.iter().try_fold(head.draws.0, |product, list| product.checked_mul(*list));
    if all.is_none_or(|all| all > MAX_DRAWS) {
        let [plans, effects, noises] = lists;
        let message = format!(
            "{plans} plans × {effects} effects × {noises} kinds of noise × {} draws: at most {MAX_DRAWS} draws are expected",
            head.draws.0
        );
        return Err(Fault::new(message, "state fewer of them").at("draws").at("study"));
    }
    let checked = |effect: &TrueEffect| {
        if effect.library && effect.effect.is_some() {
            return Err(Fault::new("either `library = true` or a table `effect` is expected", None).at("library"));
        }
        if (effect.library || effect.effect.is_some()) != (effect.size.0 > 0.0) {
            let message = format!("effect `{}`: an effect has a size above 0, and no effect has none", effect.name);
            return Err(Fault::new(message, None));
        }
        Ok(())
    };
    per_effect(file, checked).map(|_| ())
}
