//! Uniqueness of the effects of a trace, and the tests that separate them from their aliases, in words for terminal and
//! report.

use abbe::model::words::{counted, listed, with_exponent};
use abbe::trace::result::{AliasResult, EffectName, EffectResult, SeparatingTestResult, TraceResult};

use super::number::of_readings;

/// Explanations named in the headline.
const MAX_NAMED: usize = 3;
/// Effects described one by one in the headline.
const MAX_LISTED: usize = 4;

/// What is said of an effect of a family.
const NOT_COMPARED: &str = "competing explanations are not compared";

/// What was compared: `27 families with 4098 candidates screened`.
pub fn screened(result: &TraceResult) -> String {
    let candidates = format!("{} candidates screened", result.candidates_detectable);
    match result.families.len() {
        0 => candidates,
        several => format!("{} with {candidates}", counted(several, "family")),
    }
}

/// The uniqueness of all effects in one line; `None` without an effect.
pub fn headline(result: &TraceResult) -> Option<String> {
    let screened = &screened(result);
    match result.effects.as_slice() {
        [] => None,
        all if all.iter().any(|effect| effect.prior.is_some()) => {
            let of_families = all.iter().filter(|effect| effect.prior.is_some()).count();
            Some(format!("{of_families} of the effects are members of families under a prior: {NOT_COMPARED}"))
        }
        [one] => Some(format!("{}: {}", standing(one, screened), in_short(one))),
        all if all.iter().all(|effect| effect.unique) => {
            Some(format!("{} effects, each unique among {screened}", all.len()))
        }
        few if few.len() <= MAX_LISTED => {
            let each = few.iter().enumerate();
            let each: Vec<String> =
                each.map(|(k, effect)| format!("effect {} is {}", k + 1, standing(effect, screened))).collect();
            Some(each.join("; "))
        }
        many => {
            let alike: Vec<usize> =
                many.iter().map(|effect| effect.explanation_count).filter(|count| *count > 1).collect();
            let unique = many.len() - alike.len();
            let most = alike.iter().copied().max().unwrap_or(1);
            Some(format!(
                "{} effects: {unique} unique among {screened}, {} with up to {most} indistinguishable explanations",
                many.len(),
                alike.len()
            ))
        }
    }
}

/// `1 of 9 indistinguishable explanations`, or `unique among 27 families with 4098 candidates screened`.
pub fn standing(effect: &EffectResult, screened: &str) -> String {
    if effect.prior.is_some() {
        format!("member of a family: {NOT_COMPARED}")
    } else if effect.unique {
        format!("unique among {screened}")
    } else {
        format!("1 of {} indistinguishable explanations", effect.explanation_count)
    }
}

/// Ratio of the left-out-test errors from which an alias is said to predict worse.
const WORSE: f64 = 1.01;

/// How an alias predicts left-out tests, if clearly worse than the effect: `left-out test 0.351 µm, with the effect
/// 0.305 µm`. `alias` is its index.
pub fn worse_prediction(effect: &EffectResult, alias: usize) -> Option<String> {
    let of_effect = effect.left_out_test_rms_um?;
    let of_alias = effect.aliases_left_out_test_rms_um.get(alias).copied().flatten()?;
    let [alias, own] = [of_alias, of_effect].map(|rms| of_readings(rms, effect.unit));
    let words = || format!("left-out test {alias}, with the effect {own}");
    (of_alias > WORSE * of_effect).then(words)
}

/// The variants of an explanation, in words: ` (also: tilt about Y, repeating every 356.7°)`.
pub fn also(variants: &[EffectName]) -> String {
    let what = |variant: &EffectName| {
        variant.meaning.split_once(": ").map_or(variant.meaning.as_str(), |(_, what)| what).to_string()
    };
    match variants {
        [] => String::new(),
        _ => format!(" (also: {})", listed(&variants.iter().map(what).collect::<Vec<_>>(), "or")),
    }
}

/// How equal an alias is: `Δχ² 1.3, likelihood ratio 0.52, probability ratio 0.19`. The probability also counts what the
/// effect costs to describe and how plausible it is mechanically.
pub fn likelihood(alias: &AliasResult) -> String {
    let shown = |ratio: f64| match (0.01..1000.0).contains(&ratio) {
        true => format!("{ratio:.2}"),
        false => with_exponent(ratio, 0),
    };
    // A difference of rounding is none.
    let delta = if alias.delta_chi2.abs() < 0.05 { 0.0 } else { alias.delta_chi2 };
    let probability = match alias.prior_cost == 0.0 {
        true => String::new(),
        false => format!(", probability ratio {}", shown(alias.probability_ratio)),
    };
    format!("Δχ² {delta:.1}, likelihood ratio {}{probability}", shown(alias.likelihood_ratio)).replace('-', "−")
}

/// The first explanations and the number of the others. A part of the machine is named once where it repeats.
fn in_short(effect: &EffectResult) -> String {
    let others = effect.aliases.iter().map(|alias| alias.name.meaning.as_str());
    let mut part = "";
    let mut named: Vec<String> = Vec::new();
    for meaning in std::iter::once(effect.name.meaning.as_str()).chain(others).take(MAX_NAMED) {
        match meaning.split_once(": ") {
            Some((same, what)) if same == part => named.push(what.to_string()),
            split => {
                part = split.map_or("", |(part, _)| part);
                named.push(meaning.to_string());
            }
        }
    }
    match effect.explanation_count.saturating_sub(MAX_NAMED) {
        0 => {}
        1 => named.push("1 other".to_string()),
        more => named.push(format!("{more} others")),
    }
    named.join(", or ")
}

/// One sentence per proposed test, with the aliases that it separates; then the aliases that no proposed test
/// separates.
pub fn tests(effect: &EffectResult, name: impl Fn(&EffectName) -> String) -> Vec<String> {
    let mut sentences: Vec<String> =
        (effect.separating_tests.iter().enumerate()).map(|(k, test)| sentence(test, k > 0)).collect();
    if let Some(last) = effect.separating_tests.last() {
        let remaining: Vec<String> = (last.alternatives.iter())
            .filter(|alternative| !alternative.separated)
            .map(|alternative| name(&alternative.name))
            .collect();
        if !remaining.is_empty() {
            sentences.push(format!("no proposed test separates it from {}", remaining.join("; ")));
        }
    } else if !effect.unique {
        sentences.push("no test is proposed that separates it from its aliases".to_string());
    }
    sentences
}

/// A proposed test and the aliases that it separates; a `further` one, those that the tests before it leave.
fn sentence(test: &SeparatingTestResult, further: bool) -> String {
    let (then, remaining) = if further { ("then ", "remaining ") } else { ("", "") };
    let aliases = match (test.separated_count, test.alternative_count) {
        (_, 1) => format!("the {remaining}alias"),
        (separates, of) if separates == of => format!("all {of} {remaining}aliases"),
        (separates, of) => format!("{separates} of {of} {remaining}aliases"),
    };
    let separated = || test.alternatives.iter().filter(|alternative| alternative.separated);
    let after = separated().map(|alternative| alternative.after_sigma).fold(f64::INFINITY, f64::min);
    let before = separated().map(|alternative| alternative.before_sigma).fold(0.0, f64::max);
    format!(
        "{then}{} separates it from {aliases} in {:.0} min: by at least {after:.1} standard deviations, without the test by at most {before:.1}",
        test.test, test.duration_min
    )
}
