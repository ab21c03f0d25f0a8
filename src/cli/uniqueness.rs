//! Whether the effects that a trace found are the only explanation, and which tests would single them out, in words for terminal and report.

use abbe::identify::results::{EffectName, EffectResult, SeparatingTestResult, TraceResult};

/// Explanations that the headline names.
const MAX_NAMED: usize = 3;
/// Effects that the headline goes through one by one.
const MAX_LISTED: usize = 4;

/// What stands below the verdict; `None` without an effect.
pub fn headline(result: &TraceResult) -> Option<String> {
    let screened = result.candidates_detectable;
    match result.effects.as_slice() {
        [] => None,
        [one] => Some(format!("{}: {}", standing(one, screened), in_short(one))),
        all if all.iter().all(|effect| effect.unique) => Some(format!(
            "{} effects, each unique among {screened} candidates screened",
            all.len()
        )),
        few if few.len() <= MAX_LISTED => {
            let each = few.iter().enumerate();
            let each: Vec<String> = each
                .map(|(k, effect)| format!("effect {} is {}", k + 1, standing(effect, screened)))
                .collect();
            Some(each.join("; "))
        }
        many => {
            let alike: Vec<usize> = many
                .iter()
                .map(|effect| effect.explanation_count)
                .filter(|count| *count > 1)
                .collect();
            let unique = many.len() - alike.len();
            let most = alike.iter().copied().max().unwrap_or(1);
            Some(format!(
                "{} effects: {unique} unique among {screened} candidates screened, {} with up to {most} indistinguishable explanations",
                many.len(),
                alike.len()
            ))
        }
    }
}

/// `1 of 9 indistinguishable explanations`, or `unique among 4098 candidates screened`.
pub fn standing(effect: &EffectResult, screened: usize) -> String {
    if effect.unique {
        format!("unique among {screened} candidates screened")
    } else {
        format!("1 of {} indistinguishable explanations", effect.explanation_count)
    }
}

/// The first explanations, and how many more there are. A part of the machine that is the same as before is not named again.
fn in_short(effect: &EffectResult) -> String {
    let others = effect.aliases.iter().map(|alias| alias.meaning.as_str());
    let mut part = "";
    let mut named: Vec<String> = Vec::new();
    for meaning in std::iter::once(effect.name.meaning.as_str())
        .chain(others)
        .take(MAX_NAMED)
    {
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

/// For each proposed test a sentence that says which of the aliases it separates.
pub fn tests(effect: &EffectResult, name: impl Fn(&EffectName) -> String) -> Vec<String> {
    let sentence = |(k, test): (usize, &SeparatingTestResult)| {
        let first = if k == 0 { "" } else { "after that, " };
        let all = if test.separated_count == test.alternative_count {
            "all "
        } else {
            ""
        };
        let of_them = match (k, test.alternative_count) {
            (0, 1) => "the other".to_string(),
            (0, of) if test.separated_count == of => format!("{of} others"),
            (0, of) => format!("{} of {of} others", test.separated_count),
            (_, 1) => "the one that is left".to_string(),
            (_, of) if test.separated_count == of => format!("{of} that are left"),
            (_, of) => format!("{} of {of} that are left", test.separated_count),
        };
        let all = if test.alternative_count == 1 { "" } else { all };
        let separated = || test.alternatives.iter().filter(|one| one.separated);
        let after = separated()
            .map(|one| one.after_sigma)
            .fold(f64::INFINITY, f64::min);
        let before = separated().map(|one| one.before_sigma).fold(0.0, f64::max);
        format!(
            "{first}{} separates it from {all}{of_them}, in {:.0} min: by {after:.1} standard deviations or more, {before:.1} or less without it",
            test.test, test.duration_min
        )
    };
    let mut sentences: Vec<String> = effect.separating_tests.iter().enumerate().map(sentence).collect();
    if let Some(last) = effect.separating_tests.last() {
        let left: Vec<String> = (last.alternatives.iter())
            .filter(|one| !one.separated)
            .map(|one| name(&one.name))
            .collect();
        if !left.is_empty() {
            sentences.push(format!("no proposed test separates it from {}", left.join("; ")));
        }
    } else if !effect.unique {
        sentences.push("no test is proposed that separates it from the others".to_string());
    }
    sentences
}
