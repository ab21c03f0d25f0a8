//! The verdict of a plan: which error is worst determined, and what limits it.

use abbe::identify::plan::results::{Contribution, ErrorAnalysis, PlanAnalysis};

use crate::report::number::{quantity, three_digits};

/// Contributions that the verdict names.
const MAX_NAMED: usize = 2;
/// Share of the variance from which a contribution is named.
const MIN_NAMED_SHARE: f64 = 0.1;
/// Errors that the verdict names.
const MAX_ERRORS: usize = 4;

/// Sentences that name the errors that are not identifiable, the error with the largest standard uncertainty, and what
/// limits it. 1 µm counts as 1″, as in `--improve`.
pub fn verdict(analysis: &PlanAnalysis) -> Vec<String> {
    let mut sentences = Vec::new();
    let unidentifiable: Vec<&str> =
        (analysis.errors.iter()).filter(|error| error.u.is_none()).map(|error| error.id.as_str()).collect();
    if !unidentifiable.is_empty() {
        let named = unidentifiable.iter().take(MAX_ERRORS).copied().collect::<Vec<_>>().join(", ");
        let more = match unidentifiable.len().saturating_sub(MAX_ERRORS) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let is_are = if unidentifiable.len() == 1 { "is" } else { "are" };
        sentences.push(format!("{named}{more} {is_are} not identifiable by these tests."));
    }
    let worst = (analysis.errors.iter())
        .filter_map(|error| Some((error, error.u?)))
        .max_by(|(a, u), (b, other)| u.total_cmp(other).then_with(|| b.id.cmp(&a.id)));
    match worst {
        Some((error, u)) => {
            sentences.push(uncertainty(error, u));
            sentences.push(limit(error).join(" "));
        }
        None if analysis.errors.is_empty() => sentences.push("the plan asks for no error.".to_string()),
        None => {}
    }
    sentences
}

/// The error and its uncertainty.
fn uncertainty(error: &ErrorAnalysis, u: f64) -> String {
    format!(
        "{} is worst determined: u = {} (U = {}).",
        error.id,
        quantity(&three_digits(u), &error.unit),
        quantity(&three_digits(2.0 * u), &error.unit)
    )
}

/// What limits the error: the noise or the largest set-up contributions to its variance; and whether more readings
/// help.
fn limit(error: &ErrorAnalysis) -> [String; 2] {
    let noise = error.budget.iter().filter(|part| part.is_noise());
    let noise: f64 = noise.map(|part| part.share).sum();
    if noise >= 0.5 {
        let share = percent(noise);
        return [
            format!("The noise limits it: it contributes {share} of the variance."),
            "More readings or less noise reduce it.".to_string(),
        ];
    }
    let setup = error.budget.iter().filter(|part| !part.is_noise()).enumerate();
    let named = setup.take_while(|(k, part)| *k == 0 || (*k < MAX_NAMED && part.share >= MIN_NAMED_SHARE));
    let named: Vec<String> =
        named.map(|(_, part): (usize, &Contribution)| format!("{} {}", part.source, percent(part.share))).collect();
    let readings = if noise < MIN_NAMED_SHARE {
        "More readings do not reduce it."
    } else {
        "More readings reduce only the part of the noise."
    };
    [
        format!("The set-up limits it: {}, noise {} of the variance.", named.join(", "), percent(noise)),
        readings.to_string(),
    ]
}

fn percent(share: f64) -> String {
    let percent = share * 100.0;
    if percent > 0.0 && percent < 1.0 { "< 1 %".to_string() } else { format!("{percent:.0} %") }
}
