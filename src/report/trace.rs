//! The result of a trace: the residual before and after, rejected candidates, parameters that changed.

use abbe::identify::results::{ModelResult, PriorResult, TraceResult};
use abbe::model::words::counted;

use super::cross_validation;
use super::effect::name;
use super::fit::{Figures, noise as noise_in_words, rank};
use super::number::{micrometres, p_value, quantity, value_and_u};
use super::table::{Cell, Table, cells};

/// The noise and its source in words. A residual is not called noise.
pub fn noise(result: &TraceResult) -> String {
    if result.noise_source.judges() || result.effects.is_empty() {
        return noise_in_words(result.noise_um, result.noise_source);
    }
    format!(
        "residual of the declared model {}, with the effects {} (no noise stated, no repeats)",
        micrometres(result.before.noise_um),
        micrometres(result.after.noise_um)
    )
}

/// The residual of the declared model, and with the effects.
pub fn before_and_after(result: &TraceResult) -> Table {
    // The residual itself is no measure of the noise.
    let judges = result.noise_source.judges();
    let row = |name: &str, model: &ModelResult| {
        let mut cells = cells![name, Cell::fixed(model.rms_um, 3), Cell::fixed(model.heldout_rms_um, 3)];
        if let (Some(rms), Some(held)) = (model.rms_3d_um, model.heldout_rms_3d_um) {
            cells.extend([rms, held].map(|um| Cell::fixed(um, 1)));
        }
        if judges {
            cells.push(Cell::fixed(model.chi_square / model.degrees_of_freedom.max(1) as f64, 2));
        }
        cells.push(rank(model.identifiable.len(), model.parameter_count, model.rank).into());
        cells
    };
    let mut columns = vec!["residual, µm", ">rms", ">held out"];
    if result.before.rms_3d_um.is_some() {
        columns.extend([">3-vector", ">held out"]);
    }
    if judges {
        columns.push(">χ²/ν");
    }
    columns.push("");
    let mut table = Table::new(columns, [row("before", &result.before), row("after", &result.after)]);
    table.notes.push(format!("held out: leaving out {}", result.heldout_by));
    let (before, after) = (&result.before.cross_validation, &result.after.cross_validation);
    table.notes.extend(cross_validation::sentences(after, Some(before)));
    table
}

/// Probability below which an order of a spectrum stands out of the others.
const OUTSTANDING: f64 = 0.05;

/// Candidates that do not lower the held-out error significantly, one sentence each.
pub fn rejected(result: &TraceResult) -> Vec<String> {
    let rejected = result.rejected_candidates.iter().map(|candidate| {
        let (decrease, u) = value_and_u(candidate.heldout_decrease_um, candidate.u_heldout_decrease_um);
        format!(
            "{} ({}): the held-out rms decreases by {decrease} µm, with a standard error of {u} µm",
            name(&candidate.name),
            p_value(candidate.p_value)
        )
    });
    rejected.collect()
}

/// The structure that remains, and its significance; `None` without one.
pub fn remainder(result: &TraceResult) -> Option<String> {
    let place = result.remainder.place.as_deref().unwrap_or("");
    result.remainder.structured.then(|| format!("({}): {place}", p_value(result.remainder.p_value)))
}

/// Parameters that changed by more than their uncertainty when the effects were added, each with its identifier.
pub fn changes(result: &TraceResult) -> Vec<(&str, String)> {
    let changes = result.changed_parameters.iter().map(|changed| {
        let (change, u) = value_and_u(changed.change, changed.u);
        let sentence = format!("{}  {} (u {u})", changed.id, quantity(&change, &changed.unit));
        (changed.id.as_str(), sentence)
    });
    changes.collect()
}

/// The prior of an effect's coefficients in words: `prior of 9.3″ for each of 80 coefficients, estimated for …`.
pub fn prior(prior: &PriorResult) -> String {
    let source = match &prior.family {
        Some(family) => format!("estimated for the family {family}"),
        None => "stated".to_string(),
    };
    let line = prior.largest_order.as_ref().map_or_else(String::new, |line| {
        let amplitude = quantity(&format!("{:.3}", line.amplitude), &prior.unit);
        let verdict = if line.p_value < OUTSTANDING { "stands out" } else { "does not stand out" };
        let order = line.order;
        format!("; order {order} has the largest amplitude, {amplitude}, and {verdict} ({})", p_value(line.p_value))
    });
    format!(
        "prior standard deviation {} ({source}); the readings determine {:.1} of {}{line}",
        quantity(&format!("{:.3}", prior.scale), &prior.unit),
        prior.effective_parameters,
        counted(prior.coefficients, "coefficient")
    )
}

/// Every figure with all its digits, one row per figure.
pub fn figures(result: &TraceResult) -> Table {
    let mut figures = Figures::default();
    if result.interrupted {
        figures.statement("search", "interrupted", &format!("{}: the result is incomplete", result.interruption()));
    }
    for (name, model) in [("before", &result.before), ("after", &result.after)] {
        figures.figure(name, "rms", "", model.rms_um, "um");
        figures.held_out(name, model.heldout_rms_um, &model.cross_validation);
        figures.parameters(name, &model.parameters);
    }
    for (index, effect) in result.effects.iter().enumerate() {
        let section = format!("effect {}", index + 1);
        for number in &effect.shape_parameters {
            for value in &number.values {
                figures.figure(&section, &number.name, "", *value, &number.unit);
            }
        }
        figures.parameters(&section, &effect.parameters);
        if let Some(prior) = &effect.prior {
            figures.figure(&section, "prior standard deviation", "", prior.scale, &prior.unit);
            figures.figure(&section, "effective number of parameters", "", prior.effective_parameters, "");
        }
    }
    figures.table()
}
