//! The undeclared effects of the library in a plan: whether they are detectable, and by how much they bias the errors.
//!
//! With `X` the whitened columns of the parameters, `Cov` their covariance and `C` the columns of an effect,
//!
//! ```text
//! S = CᵀC − CᵀX·Cov·XᵀC      information on the effect with the parameters eliminated
//! B = Cov·XᵀC                bias of the parameters by the undeclared effect, per unit of each coefficient
//! ```
//!
//! An effect with several coefficients (cosine and sine) is judged at its worst phase.

use std::collections::{BTreeMap, HashMap};

use abbe_identify::linear::{Linearisation, is_of_interest};
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::power::noncentrality;
use abbe_identify::numerics::ranking::{largest_first, smallest_first};
use abbe_identify::numerics::symmetric::Symmetric;
use abbe_identify::numerics::tolerances::ROUNDING_OF_SQUARES;
use abbe_identify::parameters::physical_size;
use abbe_identify::problem::Problem;
use abbe_identify::unit::ParameterUnit;
use abbe_model::Diagnostic;
use abbe_model::effect::shape::Harmonic;
use abbe_model::effect::{Effect, Shape};
use abbe_trace::candidates::columns::{Columns, EffectColumns, chunked};
use abbe_trace::candidates::library::{self, LibraryEffect};
use faer::{Mat, MatRef};

use super::results::{Bias, Detectability, EffectDetectability, EffectsAnalysis};

/// Share of the signal below which an effect counts as confounded.
const CONFOUNDED_BELOW: f64 = 0.01;
/// Harmonics up to this order are all screened. Of the higher orders those of [`HIGH_ORDERS`] are screened.
const LOW_ORDERS: f64 = 12.0;
/// Higher orders that represent those between them.
const HIGH_ORDERS: [f64; 8] = [16.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0, 120.0];
/// Number of longest periods of a component and driver that are all screened. Longer periods are harder to separate
/// from the parameters.
const LONG_PERIODS: usize = 24;
/// Of the shorter periods, one in this number is screened.
const EVERY_SHORT_PERIOD: usize = 8;
/// Maximum number of coefficients of a screened effect. A nonparametric curve contains the constants and slopes of the
/// parameters, so that its worst direction is always confounded.
const MAX_COEFFICIENTS: usize = 2;
/// Maximum number of biases listed for an effect.
const MAX_BIASES: usize = 4;
/// Biases below this value, in display units per display unit, are not listed.
const MIN_BIAS: f64 = 1e-3;

/// The detectability and biases of the library's effects in a plan.
///
/// # Errors
/// If the model or the library cannot be evaluated.
pub fn effects(problem: &Problem) -> Result<EffectsAnalysis, Diagnostic> {
    let nominal = vec![0.0; problem.parameters.list.len()];
    let linear = Linearisation::of(problem, &nominal)?;
    let columns = Columns::new(problem, &nominal);
    let model = columns.model_rows(&nominal)?;
    let families = library::families()?;
    let all = library::candidates(problem)?;
    let searched = all.len();
    let mut periods: HashMap<String, usize> = HashMap::new();
    let (candidates, column_sets): (Vec<LibraryEffect>, Vec<EffectColumns>) = all
        .into_iter()
        .filter(|candidate| is_screened(&candidate.effect, &mut periods))
        .filter_map(|candidate| columns.effect_columns(&candidate.effect).map(|column_set| (candidate, column_set)))
        .unzip();
    let significance_corrected = corrected(searched);
    let thresholds: Vec<[f64; 2]> = (0..=MAX_COEFFICIENTS)
        .map(|k| [SIGNIFICANCE, significance_corrected].map(|level| noncentrality(k.max(1), level, POWER)))
        .collect();
    let chunks = chunked(&column_sets.iter().collect::<Vec<_>>());
    let judged: Vec<Vec<EffectDetectability>> = parallel::map(chunks.len(), &|number| {
        let chunk = chunks[number].clone();
        let chosen: Vec<&EffectColumns> = column_sets[chunk.clone()].iter().collect();
        let width: usize = chosen.iter().map(|column_set| column_set.count).sum();
        let mut block = Mat::zeros(columns.rows(), width);
        columns.fill(&chosen, block.as_mut());
        let cross = model.as_ref().subcols(0, nominal.len()).transpose() * &block;
        let moved = &linear.covariance * &cross;
        let mut start = 0;
        chunk
            .map(|index| {
                let count = column_sets[index].count;
                let range = start..start + count;
                start = range.end;
                let name = &families[candidates[index].family].name;
                let products = EffectProjection {
                    own: block.subcols(range.start, count),
                    cross: cross.subcols(range.start, count),
                    moved: moved.subcols(range.start, count),
                };
                let greatest = column_sets[index].greatest();
                judge(problem, &candidates[index], name, &products, greatest, &thresholds[count])
            })
            .collect()
    })
    .into_iter()
    .collect::<Result<_, Diagnostic>>()?;
    Ok(EffectsAnalysis {
        significance_level: SIGNIFICANCE,
        power: POWER,
        effects_screened: searched,
        significance_level_corrected: significance_corrected,
        effects: grouped(judged.into_iter().flatten(), &candidates),
    })
}

/// Whether an effect is screened. `periods` counts those of one component and driver, longest first.
fn is_screened(effect: &Effect, periods: &mut HashMap<String, usize>) -> bool {
    if effect.shape.coefficients() > MAX_COEFFICIENTS {
        return false;
    }
    match &effect.shape {
        Shape::Harmonic(Harmonic { order }) => *order <= LOW_ORDERS || HIGH_ORDERS.contains(order),
        Shape::Periodic { .. } => {
            let count = periods.entry(format!("{}~{}", effect.component, effect.driver)).or_default();
            *count += 1;
            *count <= LONG_PERIODS || count.is_multiple_of(EVERY_SHORT_PERIOD)
        }
        _ => true,
    }
}

struct EffectProjection<'m> {
    own: MatRef<'m, f64>,
    cross: MatRef<'m, f64>,
    moved: MatRef<'m, f64>,
}

/// Phases whose information differs by less than this share of the largest count as equally weak.
const EQUAL_WITHIN: f64 = 1e-6;

fn judge(
    problem: &Problem,
    candidate: &LibraryEffect,
    family: &str,
    products: &EffectProjection<'_>,
    greatest: f64,
    threshold: &[f64; 2],
) -> Result<EffectDetectability, Diagnostic> {
    let session = &problem.session;
    let effect = &candidate.effect;
    let unit = ParameterUnit::of_effect(session, effect, 0);
    // The coefficient that moves the component by its physical size somewhere in the tests, whatever the scale of the
    // coefficient.
    let size = match effect.component.unit(&session.instrument_parameters()) {
        Some(inside) if greatest > 0.0 => physical_size(inside) / greatest,
        Some(inside) => physical_size(inside),
        None => 0.1,
    };
    let own = products.own.transpose() * products.own;
    let left = &own - products.cross.transpose() * products.moved;
    let decomposed = Symmetric::of(left.as_ref())?;
    let [weakest, strongest] = decomposed.extremes().map(|value| value.max(0.0));
    // Of several equally weak phases, the one with the least surviving share counts, so that rounding does not decide.
    let equally_weak = decomposed.values.iter().filter(|value| **value <= weakest + EQUAL_WITHIN * strongest).count();
    let phases = decomposed.vectors.subcols(0, equally_weak);
    let [_, whole] = Symmetric::of((phases.transpose() * &own * phases).as_ref())?.extremes();
    let [_, largest_own] = Symmetric::of(own.as_ref())?.extremes();
    let has_signal = largest_own * size * size >= 1.0;
    // Without a signal, or at a phase without one, the share would be a quotient of rounding errors.
    let share =
        if has_signal && whole > ROUNDING_OF_SQUARES * largest_own { (weakest / whole).clamp(0.0, 1.0) } else { 0.0 };
    let surviving_share = if share > ROUNDING_OF_SQUARES { share } else { 0.0 };
    let amplitude = |threshold: f64| {
        let amplitude = (threshold / weakest).sqrt();
        (amplitude <= size).then_some(amplitude * unit.display_per_internal)
    };
    let detectable = amplitude(threshold[0]);
    let confounded = surviving_share < CONFOUNDED_BELOW || detectable.is_none();
    let verdict = if !has_signal {
        Detectability::NoSignal
    } else if !confounded {
        Detectability::Detectable
    } else if strongest > CONFOUNDED_BELOW * largest_own {
        Detectability::ConfoundedAtOnePhase
    } else {
        Detectability::Confounded
    };
    Ok(EffectDetectability {
        id: effect.id(),
        family: family.to_string(),
        unit: unit.name.clone(),
        detectable_amplitude: detectable,
        detectable_amplitude_screened: amplitude(threshold[1]),
        residual_share: surviving_share,
        verdict,
        biases: biases(problem, products.moved, &unit),
    })
}

fn biases(problem: &Problem, moved: MatRef<'_, f64>, unit: &ParameterUnit) -> Vec<Bias> {
    let mut biases: Vec<Bias> = problem
        .parameters
        .list
        .iter()
        .enumerate()
        .filter(|(_, parameter)| is_of_interest(parameter))
        .map(|(j, parameter)| {
            let worst = match moved.ncols() {
                1 => moved[(j, 0)],
                count => (0..count).map(|k| moved[(j, k)].powi(2)).sum::<f64>().sqrt(),
            };
            Bias {
                id: parameter.id.to_string(),
                per_unit: worst * parameter.unit.display_per_internal / unit.display_per_internal,
                unit: per(&parameter.unit.name, &unit.name),
            }
        })
        .filter(|bias| bias.per_unit.abs() >= MIN_BIAS)
        .collect();
    biases.sort_by(|a, b| largest_first((a.per_unit, &a.id), (b.per_unit, &b.id)));
    biases.truncate(MAX_BIASES);
    biases
}

/// One result for each effect, or for all members of a grid (periods, centres, time constants, high orders): the member
/// that is hardest to detect.
fn grouped(
    judged: impl Iterator<Item = EffectDetectability>,
    candidates: &[LibraryEffect],
) -> Vec<EffectDetectability> {
    let mut order: Vec<String> = Vec::new();
    let mut groups: HashMap<String, EffectDetectability> = HashMap::new();
    for (entry, candidate) in judged.zip(candidates) {
        let effect = &candidate.effect;
        let key = match &effect.shape {
            Shape::Harmonic(Harmonic { order }) if *order > LOW_ORDERS => {
                format!("{}~{}:h>{LOW_ORDERS}", effect.component, effect.driver)
            }
            _ => effect.id(),
        };
        match groups.get_mut(&key) {
            Some(present) => {
                // Of members with equal amplitudes, or without detectable amplitude, the one with the least surviving
                // share counts, and of these the one without a signal, so that neither rounding nor order decides.
                let needed = |entry: &EffectDetectability| entry.detectable_amplitude_screened.unwrap_or(f64::INFINITY);
                let harder = smallest_first(needed(present), needed(&entry))
                    .then_with(|| smallest_first(entry.residual_share, present.residual_share))
                    .then_with(|| {
                        (present.verdict == Detectability::NoSignal).cmp(&(entry.verdict == Detectability::NoSignal))
                    });
                if harder.is_lt() {
                    *present = EffectDetectability { id: key, ..entry };
                }
            }
            None => {
                order.push(key.clone());
                groups.insert(key.clone(), EffectDetectability { id: key, ..entry });
            }
        }
    }
    order.into_iter().filter_map(|key| groups.remove(&key)).collect()
}

/// The confounded effects that bias each error most, by error. A small residual does not exclude these.
pub fn confounded_by_error(analysis: &EffectsAnalysis) -> BTreeMap<String, Vec<(String, f64, String)>> {
    let mut by_error: BTreeMap<String, Vec<(String, f64, String)>> = BTreeMap::new();
    for effect in analysis.effects.iter().filter(|effect| effect.verdict.is_confounded()) {
        for bias in &effect.biases {
            let entry = (effect.id.clone(), bias.per_unit, bias.unit.clone());
            by_error.entry(bias.id.clone()).or_default().push(entry);
        }
    }
    by_error.values_mut().for_each(|list| list.sort_by(|a, b| largest_first((a.1, &a.0), (b.1, &b.0))));
    by_error
}

/// `um/arcsec`, `um/(um/h)`.
fn per(above: &str, below: &str) -> String {
    if below.contains('/') { format!("{above}/({below})") } else { format!("{above}/{below}") }
}

/// Probability of a false alarm.
pub(crate) const SIGNIFICANCE: f64 = 0.01;
/// Probability of detecting an effect that is present.
pub(crate) const POWER: f64 = 0.95;

/// The significance of one of `tests` tests if `SIGNIFICANCE` is that of all together (Šidák, J. Am. Stat. Assoc. 62
/// (1967) 626). Similar candidates count as one test each, so that the true significance is smaller.
pub fn corrected(tests: usize) -> f64 {
    -f64::exp_m1(f64::ln_1p(-SIGNIFICANCE) / tests.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_test_has_the_significance_itself() {
        assert!((corrected(1) - SIGNIFICANCE).abs() < 1e-15);
        assert!((1.0 - (1.0 - corrected(1000)).powi(1000) - SIGNIFICANCE).abs() < 1e-12);
    }
}
