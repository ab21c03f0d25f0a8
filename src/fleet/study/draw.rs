//! One draw of a study: a simulated session, and what the analysis makes of it.

use abbe_identify::fit;
use abbe_identify::noise::{Noise as NoiseModel, NoiseSource};
use abbe_identify::parameters::{Parameter, largest_plausible_share};
use abbe_identify::problem::Problem;
use abbe_identify::quantity::Given;
use abbe_identify::results::{Estimate, TraceVerdict};
use abbe_identify::simulate::{Simulation, simulate};
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use abbe_model::session::Session;
use abbe_trace::screening::screened_effects;
use abbe_trace::{Progress, TraceOptions, trace};
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::file::{Analysis, Combinations, Noise, Study};
use super::truth::{DrawnEffect, alone, chi_square, noise_mm};

/// The smallest significant size, standard deviations: 0.5 % two-sided.
const SIGNIFICANT: f64 = 2.807;
/// Least share of the squared change of the readings that the plan's parameters do not absorb. Below it, the effect is
/// confounded with them.
const SURVIVES: f64 = 1e-4;
/// Effects of the library that are drawn until the plan observes one of a plausible size.
const LIBRARY_TRIES: usize = 50;
/// Half of a 95 % interval, standard deviations.
const INTERVAL: f64 = 1.96;
/// Smallest and largest outlier, µm.
const OUTLIER_UM: [f64; 2] = [5.0, 30.0];

/// A draw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Draw {
    /// Its number.
    pub number: usize,
    /// Name of the plan.
    pub plan: String,
    /// Name of the effect.
    pub effect: String,
    /// Name of the noise.
    pub noise: String,
    /// Identifier of the true effect; `null` without one.
    pub truth: Option<String>,
    /// Why there is no result; `null` if there is one.
    pub error: Option<String>,
    /// Whether the plan does not observe the effect: it is confounded with the plan's parameters. Nothing is simulated.
    pub not_observed: bool,
    /// Verdict of the trace.
    pub verdict: Option<TraceVerdict>,
    /// Whether the true effect was found: named, or among the aliases of a found effect, by its name or as an effect
    /// that changes the readings equally.
    pub found: bool,
    /// Whether the found effect has the name of the true one.
    pub named: bool,
    /// Effects that were claimed beside the true one.
    pub false_claims: usize,
    /// 95 % intervals of the location errors that contain the true value.
    pub covered: usize,
    /// 95 % intervals of the location errors.
    pub intervals: usize,
    /// Sum of the squares of (estimate − true value)/u of the location errors.
    pub pull_squares: f64,
    /// Mean standard uncertainty of the determined location errors, whatever their units; 0 of none.
    pub mean_u: f64,
    /// Location errors that the readings do not determine.
    pub undetermined: usize,
    /// Rms of the residual, µm.
    pub rms_um: f64,
}

impl Study {
    /// Number of draws.
    pub fn draws(&self) -> usize {
        let file = &self.file;
        match file.study.combinations {
            Combinations::Grid => file.study.draws.0 * file.plan.len() * file.effect.len() * file.noise.len(),
            Combinations::Random => file.study.draws.0,
        }
    }

    /// Makes a draw. `should_continue` returns whether to continue; a draw that was interrupted is `None`.
    pub fn draw(&self, number: usize, should_continue: &(dyn Fn() -> bool + Sync)) -> Option<Draw> {
        // The digest holds the seed of the study. Streams of one seed are correlated; hashes are not.
        let mut digest = Sha256::new();
        digest.update(&self.digest);
        digest.update((number as u64).to_le_bytes());
        let mut random = Pcg64::from_seed(digest.finalize().into());
        let [plan, effect, noise] = self.combination(number, &mut random);
        let mut draw = Draw {
            number,
            plan: self.file.plan[plan].name.clone(),
            effect: self.file.effect[effect].name.clone(),
            noise: self.file.noise[noise].name.clone(),
            ..Draw::default()
        };
        let made = self.simulate(&mut draw, [plan, effect, noise], &mut random, should_continue);
        if !should_continue() {
            return None;
        }
        match made {
            Ok(observed) => draw.not_observed = !observed,
            Err(error) => draw.error = Some(error.to_string()),
        }
        Some(draw)
    }

    fn combination(&self, number: usize, random: &mut impl Rng) -> [usize; 3] {
        let counts = [self.file.plan.len(), self.file.effect.len(), self.file.noise.len()];
        match self.file.study.combinations {
            Combinations::Random => counts.map(|count| random.random_range(0..count)),
            Combinations::Grid => {
                let cell = number / self.file.study.draws.0;
                [cell / (counts[1] * counts[2]), cell / counts[2] % counts[1], cell % counts[2]]
            }
        }
    }

    /// Whether the plan observes the effect.
    fn simulate(
        &self,
        draw: &mut Draw,
        [plan, effect, noise]: [usize; 3],
        random: &mut Pcg64,
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Result<bool, Diagnostic> {
        let session = &self.plans[plan];
        let (stated, noise) = (&self.file.effect[effect], &self.file.noise[noise]);
        let mut given: Vec<Given> = Vec::new();
        for parameter in parameters(session)?.iter().filter(|parameter| parameter.id.is_error()) {
            let sigma = match parameter.unit.name.as_str() {
                "arcsec" => self.file.study.location_arcsec.0,
                _ => self.file.study.location_um.0,
            };
            let normal: f64 = StandardNormal.sample(random);
            given.push(value(&parameter.id.to_string(), sigma * normal, &parameter.unit.name));
        }
        let locations = given.clone();
        let mut true_effect = None;
        let mut machine = session.clone();
        let mut tries = if stated.library { LIBRARY_TRIES } else { 1 };
        while tries > 0 {
            tries -= 1;
            let truth = if stated.library { of_library(session, random)? } else { self.effects[plan][effect].clone() };
            let Some(truth) = truth else {
                if stated.library {
                    return Ok(false);
                }
                break;
            };
            draw.truth = Some(truth.id());
            let unit = truth.component.unit(&session.instrument_parameters());
            // A stated effect has its stated size, however large.
            let most = if stated.library { largest_plausible_share(unit, session.instrument) } else { f64::INFINITY };
            machine.effects = [session.effects.as_slice(), std::slice::from_ref(&truth)].concat();
            match coefficients(session, &machine, (stated.size.0, most), noise, random)? {
                Some(own) => {
                    given.extend(own.iter().cloned());
                    true_effect = Some(DrawnEffect::of(session, &machine, truth.id(), own, noise_mm(noise))?);
                    break;
                }
                None if tries == 0 => return Ok(false),
                // Another effect of the library, which the plan observes.
                None => {}
            }
        }
        let seed = random.random();
        let exact = Simulation { given, noise_mm: Some(0.0), draw_setups: true, seed, ..Simulation::default() };
        machine.resolution_mm = None;
        let mut simulated = simulate(&machine, &exact)?;
        for readings in &mut simulated.readings {
            add_noise(readings, noise, session.resolution_mm, random);
        }
        let measured = session.clone().with_readings(simulated.readings);
        let truth = Truth { locations, effect: true_effect };
        self.analyse(draw, &measured, &truth, random.random::<u32>().into(), should_continue)?;
        Ok(true)
    }

    fn analyse(
        &self,
        draw: &mut Draw,
        session: &Session,
        truth: &Truth,
        seed: u64,
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Diagnostic> {
        match self.file.study.analysis {
            Analysis::Fit => {
                let (problem, found) = fit::prepare(session, seed)?;
                let result = fit::report(&problem, &found)?;
                draw.rms_um = result.model.fit.rms_um;
                draw.compare(&result.model.parameters, &truth.locations);
            }
            Analysis::Trace => {
                let options = TraceOptions { seed, ..TraceOptions::default() };
                let found = trace(session, &options, &|_: Progress| should_continue())?;
                draw.verdict = Some(found.result.verdict);
                draw.rms_um = found.result.after.fit.rms_um;
                draw.compare(&found.result.after.parameters, &truth.locations);
                let is_named = |effect: &Effect| truth.effect.as_ref().is_some_and(|own| own.id == effect.id());
                draw.named = found.effects.iter().any(is_named);
                let is_equal = |effect: &Effect| truth.effect.as_ref().is_some_and(|own| own.is_equal(effect));
                let hits = found.effects.iter().zip(&found.alias_effects).filter(|(effect, aliases)| {
                    let mut names = std::iter::once(*effect).chain(*aliases);
                    names.clone().any(is_named) || names.any(is_equal)
                });
                let hit = hits.count();
                draw.found = hit > 0;
                draw.false_claims = found.effects.len() - hit.min(1);
            }
        }
        Ok(())
    }
}

/// What a draw simulates.
struct Truth {
    /// The location errors.
    locations: Vec<Given>,
    effect: Option<DrawnEffect>,
}

impl Draw {
    /// Compares estimates with the true values.
    fn compare(&mut self, parameters: &[Estimate], truth: &[Given]) {
        for truth in truth {
            let Some(found) = parameters.iter().find(|found| found.id == truth.id && found.u > 0.0) else {
                self.undetermined += 1;
                continue;
            };
            let pull = (found.value - truth.value) / found.u;
            self.intervals += 1;
            self.covered += usize::from(pull.abs() <= INTERVAL);
            self.pull_squares += pull * pull;
            self.mean_u += found.u;
        }
        self.mean_u /= self.intervals.max(1) as f64;
    }
}

fn value(id: &str, value: f64, unit: &str) -> Given {
    Given { id: id.to_string(), value, unit: unit.to_string() }
}

/// The parameters of a session.
fn parameters(session: &Session) -> Result<Vec<Parameter>, Diagnostic> {
    // No parameter depends on the noise.
    Ok(Problem::new(session, NoiseModel::white(1e-3, NoiseSource::Stated), 1)?.parameters.list)
}

/// An effect of the library that the plan observes, if there is one.
fn of_library(session: &Session, random: &mut impl Rng) -> Result<Option<Effect>, Diagnostic> {
    let mut effects = screened_effects(session, &TraceOptions::default())?;
    effects.retain(|effect| effect.observable);
    if effects.is_empty() {
        return Ok(None);
    }
    // Families are equally probable, whatever their number of effects.
    let mut families: Vec<usize> = effects.iter().map(|effect| effect.family).collect();
    families.sort_unstable();
    families.dedup();
    let family = families[random.random_range(0..families.len())];
    effects.retain(|effect| effect.family == family);
    Ok(Some(effects.swap_remove(random.random_range(0..effects.len())).effect))
}

/// Coefficients of the last effect of a machine, in a random direction and of the stated size: the χ² that it adds to
/// the residual of the plan's parameters. `None` if the plan does not observe the effect, or one of them were larger than `most` of its physical size.
fn coefficients(
    plan: &Session,
    machine: &Session,
    (size, most): (f64, f64),
    noise: &Noise,
    random: &mut impl Rng,
) -> Result<Option<Vec<Given>>, Diagnostic> {
    let own = machine.effects.len() - 1;
    let mut largest = 0.0_f64;
    let mut coefficients: Vec<(String, f64, String)> = Vec::new();
    for parameter in parameters(machine)? {
        if parameter.coefficient_of() == Some(own) {
            let internal = 1e-3 * random.sample::<f64, _>(StandardNormal);
            largest = largest.max(internal.abs() / parameter.size);
            let number = internal * parameter.unit.display_per_internal;
            coefficients.push((parameter.id.to_string(), number, parameter.unit.name));
        }
    }
    let scaled = |factor: f64| -> Vec<Given> {
        coefficients.iter().map(|(id, number, unit)| value(id, factor * number, unit)).collect()
    };
    let measured = alone(plan, machine, scaled(1.0))?;
    let observed = |session: &Session| -> Vec<f64> {
        let readings = session.tests.iter().filter_map(|test| test.readings.as_ref());
        readings.flat_map(|readings| readings.observed.iter().copied()).collect()
    };
    let change: f64 =
        observed(&measured).iter().zip(observed(plan)).map(|(with, without)| (with - without).powi(2)).sum();
    let noise_mm = noise_mm(noise);
    let chi_square = chi_square(&measured, noise_mm)?;
    // Slow structure stands out less from autocorrelated noise: by the spectral density at frequency zero.
    let inflation = (1.0 + noise.autocorrelation.0) / (1.0 - noise.autocorrelation.0);
    let strength = (chi_square / inflation).sqrt();
    if strength.is_nan() || chi_square <= SURVIVES * change / (noise_mm * noise_mm) || strength <= 0.0 {
        return Ok(None);
    }
    let factor = size * SIGNIFICANT / strength;
    if factor * largest > most {
        return Ok(None);
    }
    Ok(Some(scaled(factor)))
}

/// Adds noise to the readings of a test, run by run, and rounds them.
fn add_noise(
    readings: &mut abbe_model::session::readings::Readings,
    noise: &Noise,
    resolution_mm: Option<f64>,
    random: &mut impl Rng,
) {
    let channels = readings.channels.max(1);
    let innovation = (1.0 - noise.autocorrelation.0 * noise.autocorrelation.0).sqrt();
    let mut last = vec![0.0; channels];
    for row in 0..readings.observed.len() / channels {
        let begins = row == 0 || readings.run.get(row) != readings.run.get(row - 1);
        let outlier = random.random::<f64>() < noise.outlier_share.0;
        for (channel, last) in last.iter_mut().enumerate() {
            let normal: f64 = StandardNormal.sample(random);
            *last = if begins { normal } else { noise.autocorrelation.0 * *last + innovation * normal };
            let mut um = noise.um.0 * *last;
            if outlier {
                let sign = if random.random::<bool>() { 1.0 } else { -1.0 };
                um += sign * random.random_range(OUTLIER_UM[0]..OUTLIER_UM[1]);
            }
            let value = &mut readings.observed[row * channels + channel];
            *value += um * 1e-3;
            if let Some(step) = resolution_mm {
                *value = (*value / step).round() * step;
            }
        }
    }
}
