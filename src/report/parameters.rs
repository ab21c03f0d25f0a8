//! Estimated parameters: errors and effects apart from set-up parameters, with their uncertainties; base parameters, a minimal
//! set of numbers that predicts the same readings; terms of a pointing model, and the residual on the sky.

use abbe::identify::fit::Fit;
use abbe::identify::fit::base::BaseResult;
use abbe::identify::fit::tpoint::PointingTerms;
use abbe::identify::plausibility::{Pull, Pulls};
use abbe::identify::problem::Problem;
use abbe::identify::results::{DeterminedBy, Estimate, Goodness, MeasuredValue};
use abbe::model::parameter_id::ParameterId;
use abbe::model::words::{counted, with_exponent};

use super::block::{Report, Text};
use super::figure::bars::{Row, values};
use super::figure::{Figure, Quantity};
use super::number::{places, unit, units, value_and_u};
use super::quality::reservation;
use super::table::{Cell, Table, cells, numbers};

/// Errors that a terminal shows without `--all`.
const MAX_ERRORS: usize = 20;
/// Maximum number of rows of a figure.
const MAX_ROWS: usize = 30;

/// The mark of an estimate that exceeds `U` by the set-up priors.
pub const PRIOR: &str = "†";

/// The parameters of a fit.
pub struct Estimates<'r> {
    /// Errors and coefficients of effects.
    pub errors: Vec<&'r Estimate>,
    /// Set-up parameters.
    pub setup: Vec<&'r Estimate>,
    /// Pulls of set-up parameters, by their identifiers.
    pulls: Vec<(String, Pull)>,
}

impl<'r> Estimates<'r> {
    /// Of the results of a fit.
    pub fn new(problem: &'r Problem, fit: &Fit, parameters: &'r [Estimate]) -> Estimates<'r> {
        let list = &problem.parameters.list;
        let (setup, errors) = parameters.iter().partition(|own| own.is(ParameterId::is_setup));
        let pulls = Pulls::of(problem, fit).each.into_iter();
        Estimates { errors, setup, pulls: pulls.map(|pull| (list[pull.parameter].id.to_string(), pull)).collect() }
    }

    /// The table of the errors; without `--all`, the most significant ones.
    pub fn table(&self, before: Option<&[Estimate]>) -> Table {
        let ratio = |k: &usize| {
            let p = self.errors[*k];
            if p.u > 0.0 { (p.value / p.u).abs() } else { f64::INFINITY }
        };
        let mut order: Vec<usize> = (0..self.errors.len()).collect();
        let mut shown = table(&self.errors, before);
        if order.len() > MAX_ERRORS {
            order.sort_by(|a, b| ratio(b).total_cmp(&ratio(a)));
            order.truncate(MAX_ERRORS);
            order.sort_unstable();
            shown.key_rows = Some(order);
        }
        shown
    }

    /// The table of the errors, and their figures.
    pub fn errors(&self, report: &mut Report, goodness: Goodness, before: Option<&[Estimate]>) {
        if self.errors.is_empty() {
            report.key("No error is identifiable.");
        }
        report.key(self.table(before));
        if let (Some(reservation), false) = (reservation(goodness), self.errors.is_empty()) {
            report.key(Text::Note(reservation.to_string()));
        }
        report.figures(figures(&self.errors, before, "parameters", "Values"));
    }

    /// The set-up parameters, in one line or with their table and figures.
    pub fn set_up(&self, report: &mut Report, before: Option<&[Estimate]>) {
        if self.setup.is_empty() {
            return;
        }
        report.brief(Text::Note(self.setup_in_short()));
        report.detail(Text::Fold(format!("{} (balls, bar, poses)", counted(self.setup.len(), "set-up parameter"))));
        report.detail(self.setup_table(before));
        report.figures(figures(&self.setup, before, "setup", "Set-up parameters"));
    }

    /// The set-up parameters as deviations from their stated values; `before`, the estimates of another model.
    pub fn setup_table(&self, before: Option<&[Estimate]>) -> Table {
        let rows = self.setup.iter().map(|p| {
            let [value, u] = Cell::estimate(p.value, p.u);
            let pull = self.pulls.iter().find(|(id, _)| *id == p.id);
            let pull = Cell::or_dash(pull.map(|(_, pull)| Cell::fixed(pull.pull, 1)));
            cells![&p.id, value, u, unit(&p.unit), pull, &p.meaning]
        });
        let columns = ["parameter", ">value", ">u", "unit", ">pull", "meaning"];
        let table = Table::new(columns, rows).titled("Set-up parameters, as deviations from their stated values");
        beside(table, &self.setup, before)
    }

    /// The number of set-up parameters and the one that the readings move furthest from its stated value, in standard
    /// deviations.
    pub fn setup_in_short(&self) -> String {
        let largest = |a: &&(String, Pull), b: &&(String, Pull)| a.1.pull.abs().total_cmp(&b.1.pull.abs());
        let largest = match self.pulls.iter().max_by(largest) {
            Some((id, pull)) => format!(", largest pull {:.1} ({id})", pull.pull.abs()),
            None => String::new(),
        };
        format!("{}{largest}", counted(self.setup.len(), "set-up parameter"))
    }
}

/// Parameters with u, U, significance and meaning; `before`, the estimates of another model.
pub fn table(parameters: &[&Estimate], before: Option<&[Estimate]>) -> Table {
    let rows = parameters.iter().map(|p| {
        let [value, u] = Cell::estimate(p.value, p.u);
        // Rounded to the same place.
        let expanded = Cell::fixed(p.expanded_u, places(p.u));
        let mark = match p.determined_by {
            DeterminedBy::Readings if p.significant && p.quotable => "*",
            DeterminedBy::Prior if p.exceeds_u() => PRIOR,
            _ => "",
        };
        cells![&p.id, value, u, expanded, unit(&p.unit), mark, &p.meaning]
    });
    let columns = ["parameter", ">value", ">u", ">U", "unit", "", "meaning"];
    let mut table = Table::new(columns, rows)
        .titled("Estimates with standard uncertainty u and expanded uncertainty U = 2u (*: significant, |value| > U)");
    if parameters.iter().any(|p| !p.enlarged_by.is_empty()) {
        let without = parameters.iter().map(|p| p.u_without_aliases.map_or("".into(), |u| Cell::fixed(u, places(u))));
        table.push(">u without aliases", without);
        let by = |p: &&Estimate| {
            let aliases: Vec<&str> = p.enlarged_by.iter().map(|by| by.alias.as_str()).collect();
            Cell::from(aliases.join(", "))
        };
        table.push("u enlarged by alias", parameters.iter().map(by));
    }
    if parameters.iter().any(|p| p.determined_by == DeterminedBy::Prior && p.exceeds_u()) {
        table
            .notes
            .push(format!("{PRIOR}: |value| > U, if the set-up is as stated; the readings alone do not show it"));
    }
    for parameter in parameters {
        let Some([low, high]) = parameter.interval_95 else { continue };
        let (id, unit) = (&parameter.id, unit(&parameter.unit));
        let [low, high] = [low, high].map(|end| Cell::fixed(end, places(parameter.u)));
        table.notes.push(format!("{id}: 95 % interval from {low} to {high} {unit}, since χ² is not parabolic in it"));
    }
    beside(table, parameters, before)
}

/// The table with a column of the same parameters in another model, in front of their meaning.
fn beside(mut table: Table, parameters: &[&Estimate], before: Option<&[Estimate]>) -> Table {
    let Some(before) = before else {
        return table;
    };
    let meaning = table.columns.iter().position(|column| column.heading == "meaning");
    let place = meaning.unwrap_or(table.columns.len());
    table.columns.insert(place, numbers("before ± u"));
    for (row, parameter) in table.rows.iter_mut().zip(parameters) {
        let earlier = before.iter().find(|value| value.id == parameter.id).map(|p| value_and_u(p.value, p.u));
        row.insert(place, earlier.map_or(String::new(), |(value, u)| format!("{value} ± {u}")).into());
    }
    table
}

/// Figures with error bars of ± 2 u, one for each unit.
fn figures(estimates: &[&Estimate], before: Option<&[Estimate]>, name: &str, title: &str) -> Vec<Figure> {
    let bar = |parameter: &Estimate| MeasuredValue { value: parameter.value, u: parameter.u };
    let same = |id: &str| before?.iter().find(|value| value.id == id).map(bar);
    let mut figures: Vec<Figure> = Vec::new();
    for unit_name in units(estimates.iter().map(|value| value.unit.as_str())) {
        let own = estimates.iter().filter(|parameter| parameter.unit == unit_name);
        let row = |parameter: &&Estimate| (parameter.id.clone(), [same(&parameter.id), Some(bar(parameter))]);
        let rows: Vec<Row> = own.map(row).collect();
        let parts = rows.len().div_ceil(MAX_ROWS);
        for (number, rows) in rows.chunks(MAX_ROWS).enumerate() {
            let part = if parts > 1 { format!(" ({} of {parts})", number + 1) } else { String::new() };
            figures.push(Figure::new(
                format!("{name}-{}-{}", unit_name.replace('/', "-per-"), number + 1),
                format!("{title} in {}{part}", unit(unit_name)),
                "Whiskers: ± 2 u.",
                values(&Quantity::new("value", unit_name), ["before", "after"], rows),
            ));
        }
    }
    figures
}

/// The base parameters with u.
pub fn base(result: &BaseResult) -> Table {
    let rows = result.parameters.iter().map(|parameter| {
        let [value, u] = Cell::estimate(parameter.value, parameter.u);
        cells![&parameter.id, value, u, unit(&parameter.unit), &parameter.meaning]
    });
    Table::new(["parameter", ">value", ">u", "unit", "meaning"], rows)
        .titled("Base parameters with standard uncertainty u")
}

/// What is held at nominal, and what does not depend on it.
pub fn base_statement(base: &BaseResult) -> String {
    let held = match base.held_at_nominal.as_slice() {
        [] => "No parameter is held at nominal: all are separable.".to_string(),
        names => format!(
            "Held at nominal ({}): {}. Predictions do not depend on this choice (largest change {} µm).",
            counted(names.len(), "parameter"),
            names.join(", "),
            with_exponent(base.prediction_change_um, 0)
        ),
    };
    match base.combinations_at_nominal {
        0 => held,
        count => format!(
            "{held} {} of the base parameters {} at nominal too: the readings determine {} by less than their noise.",
            counted(count, "combination"),
            if count == 1 { "stays" } else { "stay" },
            if count == 1 { "it" } else { "them" }
        ),
    }
}

/// The terms with u, and with the sigma that TPOINT prints.
pub fn pointing(found: &PointingTerms) -> Table {
    let rows = found.terms.iter().map(|term| {
        let [value, u] = match (term.value_arcsec, term.u_arcsec) {
            (Some(value), Some(u)) => Cell::estimate(value, u),
            _ => [Cell::or_dash(None), Cell::or_dash(None)],
        };
        let sigma = Cell::or_dash(term.sigma_arcsec.map(|sigma| Cell::fixed(sigma, 2)));
        cells![&term.term, value, u, sigma, term.parameters.join(", ")]
    });
    Table::new(["term", ">value, \u{2033}", ">u, \u{2033}", ">sigma of TPOINT, \u{2033}", "parameters"], rows)
        .titled("Terms of TPOINT with standard uncertainty u")
}

/// The residual on the sky, what sigma is, and what is no term.
pub fn pointing_statement(found: &PointingTerms) -> String {
    let mut text = format!(
        "Sky rms {:.2}\u{2033}{}, {} stars. TPOINT\u{2019}s sigma takes the \
         sky rms, of both coordinates together, for the standard deviation of each one, so it is about \u{221a}2 u.",
        found.sky_rms_arcsec,
        found
            .population_sd_arcsec
            .map_or(String::new(), |sd| format!(", population standard deviation {sd:.2}\u{2033}")),
        found.stars
    );
    if found.terms.iter().any(|term| term.value_arcsec.is_none()) {
        text.push_str(" A term without a value is not separable from others.");
    }
    if !found.without_term.is_empty() {
        text.push_str(&format!(" No term of TPOINT: {}.", found.without_term.join(", ")));
    }
    text
}
