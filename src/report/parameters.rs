//! Estimated parameters: errors and effects apart from set-up parameters, with their uncertainties.

use abbe::identify::fit::Fit;
use abbe::identify::parameters::{Parameter, Role};
use abbe::identify::plausibility::{Pull, Pulls};
use abbe::identify::problem::Problem;
use abbe::identify::results::{DeterminedBy, ParameterResult};
use abbe::model::words::counted;

use super::number::{places, unit, value_and_u};
use super::table::{Cell, Table, cells};

/// The mark of an estimate that exceeds `U` by the set-up priors.
pub const PRIOR: &str = "†";

/// The parameters of a fit.
pub struct Estimates<'r> {
    /// Errors and coefficients of effects.
    pub errors: Vec<&'r ParameterResult>,
    /// Set-up parameters.
    pub setup: Vec<&'r ParameterResult>,
    /// Pulls of set-up parameters, by their identifiers.
    pulls: Vec<(&'r str, Pull)>,
}

impl<'r> Estimates<'r> {
    /// Of the results of a fit.
    pub fn new(problem: &'r Problem, fit: &Fit, parameters: &'r [ParameterResult]) -> Estimates<'r> {
        let list = &problem.parameters.list;
        let is_setup =
            |result: &&ParameterResult| list.iter().any(|p: &Parameter| p.role == Role::Setup && p.id == result.id);
        let (setup, errors) = parameters.iter().partition(is_setup);
        let pulls = Pulls::of(problem, fit).each.into_iter();
        Estimates { errors, setup, pulls: pulls.map(|pull| (list[pull.parameter].id.as_str(), pull)).collect() }
    }

    /// Whether this is a set-up parameter.
    pub fn is_setup(&self, id: &str) -> bool {
        self.setup.iter().any(|p| p.id == id)
    }

    /// The `count` most significant errors in the order of the session.
    pub fn most_significant(&self, count: usize) -> Vec<&'r ParameterResult> {
        let ratio = |p: &ParameterResult| {
            if p.u > 0.0 { (p.value / p.u).abs() } else { f64::INFINITY }
        };
        let mut order: Vec<usize> = (0..self.errors.len()).collect();
        if order.len() > count {
            order.sort_by(|a, b| ratio(self.errors[*b]).total_cmp(&ratio(self.errors[*a])));
            order.truncate(count);
            order.sort_unstable();
        }
        order.into_iter().map(|k| self.errors[k]).collect()
    }

    /// The set-up parameters as deviations from their stated values; `before`, the estimates of another model.
    pub fn setup_table(&self, before: Option<&[ParameterResult]>) -> Table {
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
        let largest = |a: &&(&str, Pull), b: &&(&str, Pull)| a.1.pull.abs().total_cmp(&b.1.pull.abs());
        let largest = match self.pulls.iter().max_by(largest) {
            Some((id, pull)) => format!(", largest pull {:.1} ({id})", pull.pull.abs()),
            None => String::new(),
        };
        format!("{}{largest}", counted(self.setup.len(), "set-up parameter"))
    }
}

/// Parameters with u, U, significance and meaning; `before`, the estimates of another model.
pub fn table(parameters: &[&ParameterResult], before: Option<&[ParameterResult]>) -> Table {
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
        let by = |p: &&ParameterResult| {
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
    beside(table, parameters, before)
}

/// The table with a column of the same parameters in another model.
fn beside(mut table: Table, parameters: &[&ParameterResult], before: Option<&[ParameterResult]>) -> Table {
    let Some(before) = before else {
        return table;
    };
    let cells = parameters.iter().map(|parameter| {
        let earlier = before.iter().find(|value| value.id == parameter.id).map(|p| value_and_u(p.value, p.u));
        Cell::from(earlier.map_or(String::new(), |(value, u)| format!("{value} ± {u}")))
    });
    table.push(">before ± u", cells);
    table
}
