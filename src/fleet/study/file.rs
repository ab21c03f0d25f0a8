//! The study file.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use abbe_identify::simulate::{Simulation, simulate};
use abbe_identify::trace::TraceOptions;
use abbe_identify::trace::screening::screened_effects;
use abbe_model::document::node::Node;
use abbe_model::effect::Effect;
use abbe_model::files::read::{document_of, effects_of_nodes};
use abbe_model::files::stamp::FileStamp;
use abbe_model::files::{self, ReadOptions};
use abbe_model::session::Session;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::fleet::{BUILD, FleetError};

/// A study as its file has it.
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
#[serde(deny_unknown_fields)]
pub struct Head {
    /// The analysis.
    pub analysis: Analysis,
    /// Draws of each combination of plan, effect and noise (`grid`), or of all together (`random`).
    pub draws: usize,
    /// Whether all combinations are drawn, or each draw chooses one.
    #[serde(default)]
    pub combinations: Combinations,
    /// Seed of all random numbers.
    #[serde(default = "one")]
    pub seed: u64,
    /// Standard deviation of the drawn position errors, µm.
    #[serde(default)]
    pub location_um: f64,
    /// Standard deviation of the drawn orientation errors, arcsec.
    #[serde(default)]
    pub location_arcsec: f64,
}

fn one() -> u64 {
    1
}

/// The analysis of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Analysis {
    /// The fit of the plan's parameters.
    Fit,
    /// The search for effects.
    Trace,
}

/// The combinations that are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Combinations {
    /// All of them.
    #[default]
    Grid,
    /// One at random for each draw.
    Random,
}

/// A set-up.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Its name in the results.
    pub name: String,
    /// The session file, relative to the study file. Tests without data are simulated at their planned states.
    pub session: PathBuf,
}

/// An effect of the simulated machine. Only a name: no effect.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrueEffect {
    /// Its name in the results.
    pub name: String,
    /// Size over the smallest significant one: the root of the χ² that the effect adds to the residual of the plan's
    /// parameters, over 2.807 (0.5 % two-sided).
    #[serde(default)]
    pub size: f64,
    /// `true`: each draw chooses an effect of the library that the plan can observe.
    #[serde(default)]
    pub library: bool,
    /// The effect otherwise, with the keys of `[[effect]]` of a session file.
    #[serde(default)]
    #[schemars(with = "Option<serde_json::Value>")]
    pub effect: Option<Node>,
}

/// The noise of simulated readings.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Its name in the results.
    pub name: String,
    /// Standard deviation of a reading, µm.
    pub um: f64,
    /// Correlation of neighbouring readings of a run.
    #[serde(default)]
    pub autocorrelation: f64,
    /// Share of outliers: 5 to 30 µm of either sign.
    #[serde(default)]
    pub outlier_share: f64,
}

/// Largest number of draws of a study, which are summarised together.
const MAX_DRAWS: usize = 1_000_000;
/// Largest number of plans, of effects and of kinds of noise.
const MAX_ENTRIES: usize = 1000;

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
pub fn read(path: &Path) -> Result<Study, FleetError> {
    let source = files::text(path, "the study file")?;
    let text = &source.text;
    let fault = |what: String| FleetError::Request(format!("{}: {what}", path.display()));
    let file: StudyFile = document_of(&source)?;
    check(&file).map_err(fault)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut digest = Sha256::new();
    digest.update(concat!("abbe study 3 ", env!("CARGO_PKG_VERSION"), "\n"));
    digest.update(text);
    let (mut plans, mut effects) = (Vec::new(), Vec::new());
    for plan in &file.plan {
        let place = folder.join(&plan.session);
        let options = ReadOptions { allow_outside: true, ..ReadOptions::default() };
        let (session, sources) = files::session_with_sources(&place, &options)?;
        for read in sources.files.iter().filter_map(FileStamp::read) {
            digest.update(read.sha256);
        }
        let own: Vec<Option<Effect>> =
            file.effect.iter().map(|effect| declared(path, effect, &session)).collect::<Result<_, _>>()?;
        let of_plan = |error| fault(format!("plan `{}`: {error}", plan.name));
        let nominal = Simulation { noise_mm: Some(0.0), ..Simulation::default() };
        let drawn = simulate(&session, &nominal).map_err(of_plan)?;
        let session = session.with_readings(drawn.readings);
        if file.study.analysis == Analysis::Trace && own.iter().any(Option::is_some) {
            let library = screened_effects(&session, &TraceOptions::default()).map_err(of_plan)?;
            let ids: HashSet<String> = library.iter().map(|screened| screened.effect.id()).collect();
            check_searched(&own, &file, &ids).map_err(fault)?;
        }
        effects.push(own);
        plans.push(session);
    }
    let hexadecimal = |digest: Sha256| digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let digest = hexadecimal(digest);
    let key = hexadecimal(Sha256::new().chain_update(&digest).chain_update(BUILD));
    Ok(Study { file, plans, effects, digest, key, stamp: source.stamp })
}

/// The declared effect of an entry in a plan.
fn declared(path: &Path, effect: &TrueEffect, session: &Session) -> Result<Option<Effect>, FleetError> {
    let Some(keys) = &effect.effect else { return Ok(None) };
    let tests: Vec<String> = session.tests.iter().map(|test| test.name.clone()).collect();
    let read = effects_of_nodes(vec![keys.clone()], &session.machine, session.instrument, &tests);
    let wrong = |what: String| FleetError::Request(format!("{}: effect `{}`: {what}", path.display(), effect.name));
    let mut effects = read.map_err(|error| wrong(error.to_string()))?;
    Ok(effects.pop())
}

/// An effect that no search has under its name cannot be found, whatever the readings.
fn check_searched(own: &[Option<Effect>], file: &StudyFile, ids: &HashSet<String>) -> Result<(), String> {
    for (effect, stated) in own.iter().zip(&file.effect) {
        let Some(id) = effect.as_ref().map(Effect::id).filter(|id| !ids.contains(id)) else { continue };
        let mut alike: Vec<&str> = ids.iter().map(String::as_str).collect();
        alike.retain(|other| other.split(':').next() == id.split(':').next());
        alike.sort_unstable();
        alike.truncate(8);
        let help = match alike.is_empty() {
            true => "it has none of this component and driver".to_string(),
            false => format!("it has {}", alike.join(", ")),
        };
        return Err(format!("effect `{}`: the library of the trace has no effect `{id}`; {help}", stated.name));
    }
    Ok(())
}

fn check(file: &StudyFile) -> Result<(), String> {
    let head = &file.study;
    let named = [
        ("plan", file.plan.iter().map(|plan| plan.name.as_str()).collect::<Vec<_>>()),
        ("effect", file.effect.iter().map(|effect| effect.name.as_str()).collect()),
        ("noise", file.noise.iter().map(|noise| noise.name.as_str()).collect()),
    ];
    for (kind, names) in named {
        if let Some(twice) = (1..names.len()).find(|k| names[..*k].contains(&names[*k])) {
            return Err(format!("two [[{kind}]] are called `{}`: give each its own name", names[twice]));
        }
    }
    if !(1..=MAX_DRAWS).contains(&head.draws) {
        return Err(format!("draws = {}: 1 to {MAX_DRAWS} are expected", head.draws));
    }
    let lists = [file.plan.len(), file.effect.len(), file.noise.len()];
    let all = lists.iter().try_fold(head.draws, |product, list| product.checked_mul(*list));
    if all.is_none_or(|all| all > MAX_DRAWS) || lists.iter().any(|list| *list > MAX_ENTRIES) {
        let [plans, effects, noises] = lists;
        return Err(format!(
            "{plans} plans × {effects} effects × {noises} kinds of noise × {} draws: at most {MAX_DRAWS} draws of at \
             most {MAX_ENTRIES} plans, effects and kinds of noise are expected; state fewer of them",
            head.draws
        ));
    }
    for (name, list) in [("plan", file.plan.len()), ("effect", file.effect.len()), ("noise", file.noise.len())] {
        if list == 0 {
            return Err(format!("no [[{name}]]: at least one is expected"));
        }
    }
    for (name, value) in [("location_um", head.location_um), ("location_arcsec", head.location_arcsec)] {
        if !(0.0..=1e6).contains(&value) {
            return Err(format!("{name} = {value}: 0 to 1e6 is expected"));
        }
    }
    for noise in &file.noise {
        let usable = (0.0..=1e6).contains(&noise.um)
            && (0.0..1.0).contains(&noise.autocorrelation)
            && (0.0..1.0).contains(&noise.outlier_share);
        if !usable {
            return Err(format!(
                "noise `{}`: um from 0 to 1e6, autocorrelation and outlier_share from 0 to below 1 are expected",
                noise.name
            ));
        }
    }
    for effect in &file.effect {
        if effect.library && effect.effect.is_some() {
            return Err(format!("effect `{}`: either library = true or a table `effect` is expected", effect.name));
        }
        let has_effect = effect.library || effect.effect.is_some();
        if has_effect != (effect.size > 0.0) || !(0.0..=1e6).contains(&effect.size) {
            return Err(format!("effect `{}`: an effect has a size above 0, and no effect has none", effect.name));
        }
    }
    Ok(())
}
