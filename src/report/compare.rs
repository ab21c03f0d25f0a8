//! Differences between models of one machine.

use abbe::apply::compare::results::{Comparison, Difference, Pair};
use abbe::document::StatedComparison;
use abbe::identify::results::{MeasuredValue, Outlier, ParameterChange};
use abbe::model::words::counted;

use super::block::{Report, Text};
use super::commands::Commands;
use super::figure::bars::{self, Row};
use super::figure::{Figure, Quantity};
use super::number::{p_equals, probability, quantity, unit, units, value_and_u};
use super::statements;
use super::table::{Cell, Table, cells, numbers};

/// Rows of the first screen that are not significant.
const FOLDED: usize = 8;
/// Outliers that are listed by line and residual.
const MAX_OUTLIERS: usize = 5;
/// Rows of a figure.
const MAX_ROWS: usize = 30;

/// Method of a comparison.
const METHOD: &str = "Sessions are fitted with the errors and effects that any input has, models included, so that their \
     parameters are the same. A difference is significant if Holm's procedure rejects that it is zero.";

/// The report of a comparison of models of this machine; `with_workspace`, whether the volumetric error is asked for. `commands`
/// have the options with which sessions are read.
pub fn report(machine: &str, stated: &StatedComparison<'_>, with_workspace: bool, commands: &Commands) -> Report {
    let comparison = stated.result;
    let mut report = Report::new(format!("Comparison of models of {machine}"));
    report.method = METHOD.to_string();
    report.values = values(comparison);
    let pairs = comparison.pairs.iter().enumerate().map(|(number, pair)| sentence(comparison, number, pair).into());
    report.opening("", pairs.chain(statements::of_comparison(comparison, &stated.statements, commands)));
    for pair in &comparison.pairs {
        report.section(&format!("{} → {}", pair.from, pair.to));
        report.key(Text::List(remarks(comparison, pair)));
        report.key(differences(comparison, pair));
        report.figures(figures(comparison, pair));
    }
    report.section("Volumetric error");
    match comparison.workspace.is_empty() {
        false => report.key(workspace(comparison)),
        true if with_workspace => {
            report.key("Volumetric error: not evaluated, because the ranges of the axes have nothing in common.");
        }
        true => {}
    }
    report
}

/// How the volumetric error changed, and in how many parameters the machine did.
fn sentence(comparison: &Comparison, number: usize, pair: &Pair) -> String {
    let volume = match (comparison.workspace.first(), comparison.workspace.get(number + 1)) {
        (Some(before), Some(after)) => {
            let within = 2.0 * before.u_um.hypot(after.u_um);
            format!("{}; ", statements::volumetric(before.rms_um, after.rms_um, within))
        }
        _ => String::new(),
    };
    if !pair.judged {
        return format!("{} → {}: {volume}the differences are not judged.", pair.from, pair.to);
    }
    let changed = match pair.significant {
        0 => format!("no significant difference in {}", counted(pair.compared, "parameter")),
        count => format!("{} of {}", counted(count, "significant difference"), counted(pair.compared, "parameter")),
    };
    let level = comparison.significance;
    format!("{} → {}: {volume}{changed} (any false claim: probability ≤ {level}).", pair.from, pair.to)
}

/// All differences together, and what is not compared.
fn remarks(comparison: &Comparison, pair: &Pair) -> Vec<String> {
    let mut lines = vec![format!(
        "all differences together: χ² = {:.1} with {}, {}",
        pair.chi_square,
        counted(pair.degrees_of_freedom, "degree of freedom"),
        p_equals(pair.p_value)
    )];
    for input in [&pair.from, &pair.to] {
        let own = comparison.outliers.iter().filter(|excluded| excluded.input == *input);
        let own: Vec<&Outlier> = own.map(|found| &found.outlier).collect();
        let place = |outlier: &&Outlier| format!("{}:{} ({:.1} µm)", outlier.file, outlier.line, outlier.residual_um);
        let what = match own.as_slice() {
            [] => continue,
            few if few.len() <= MAX_OUTLIERS => few.iter().map(place).collect::<Vec<_>>().join(", "),
            many => counted(many.len(), "reading"),
        };
        lines.push(format!("excluded as outliers from {input}: {what}"));
    }
    if !pair.shared_setup.is_empty() {
        lines.push(format!("one object in both: {}", pair.shared_setup.join(", ")));
    }
    let others: Vec<&str> =
        pair.not_shared.iter().filter(|other| !other.refuted).map(|other| other.change.id.as_str()).collect();
    if !others.is_empty() {
        lines.push(format!("not taken for one object, like the others of their kind: {}", others.join(", ")));
    }
    for refuted in pair.not_shared.iter().filter(|other| other.refuted) {
        let change = &refuted.change;
        let (value, u) = value_and_u(change.value, change.u);
        lines.push(format!(
            "not one object in both, although of one name: {} differs by {} ({})",
            change.id,
            quantity(&format!("{value} ± {u}"), &change.unit),
            p_equals(refuted.p_value)
        ));
    }
    if !pair.not_comparable.is_empty() {
        let ids: Vec<&str> = pair.not_comparable.iter().map(|held| held.id.as_str()).collect();
        lines.push(format!("held at nominal in both, since one session does not separate them: {}", ids.join(", ")));
    }
    for only in &pair.only_in {
        lines.push(format!("only in {}: {}", only.model, only.id));
    }
    lines
}

/// The differences of a pair, the most significant first.
fn own<'c>(comparison: &'c Comparison, pair: &'c Pair) -> impl Iterator<Item = &'c Difference> {
    // An input that is given twice has two pairs of the same names.
    let of_pair = comparison.differences.iter().filter(|d| d.from == pair.from && d.to == pair.to);
    of_pair.take(pair.compared)
}

fn differences(comparison: &Comparison, pair: &Pair) -> Table {
    let rows = own(comparison, pair).map(|d| {
        let verdict = match pair.judged {
            true if d.significant => "significant",
            true => "",
            false => "not judged",
        };
        let ParameterChange { id, value, u, unit: name } = &d.change;
        let [value, u] = Cell::estimate(*value, *u);
        cells![id.clone(), value, u, unit(name), probability(d.p_value), verdict]
    });
    Table::new(["difference", ">value", ">u", "", ">p", ""], rows).folded(pair.significant + FOLDED)
}

/// The differences with error bars, one figure for each unit.
fn figures(comparison: &Comparison, pair: &Pair) -> Vec<Figure> {
    let names = units(own(comparison, pair).map(|d| d.change.unit.as_str())).into_iter();
    let figure = |name: &str| {
        let of_unit = own(comparison, pair).map(|d| &d.change).filter(|change| change.unit == name).take(MAX_ROWS);
        let row = |change: &ParameterChange| {
            (change.id.clone(), [None, Some(MeasuredValue { value: change.value, u: change.u })])
        };
        let rows: Vec<Row> = of_unit.map(row).collect();
        Figure::new(
            format!("differences-{name}"),
            format!("Differences in {}", unit(name)),
            "Whiskers: ± 2 u.",
            bars::values(&Quantity::new("difference", name), ["", "difference"], &rows),
        )
    };
    names.map(figure).collect()
}

/// The volumetric error of each input over the common range.
fn workspace(comparison: &Comparison) -> Table {
    let rows = comparison.inputs.iter().zip(&comparison.workspace).map(|(name, volume)| {
        cells![
            name.clone(),
            Cell::fixed(volume.rms_um, 2),
            Cell::fixed(volume.largest_um, 2),
            Cell::fixed(volume.u_um, 2)
        ]
    });
    let points = comparison.workspace.first().map_or(0, |volume| volume.points);
    Table::new(["µm", ">rms", ">largest", ">u (rms)"], rows)
        .titled(format!("Volumetric error over the common range ({})", counted(points, "point")))
}

/// All differences as a table of values.
fn values(comparison: &Comparison) -> Table {
    let columns = ["from", "to", "id"].map(super::table::Column::from).into_iter();
    let columns = columns.chain(["value", "u"].map(numbers)).chain(["unit".into()]).chain([numbers("p_value")]);
    let columns = columns.chain(["significant".into()]);
    let rows = comparison.differences.iter().map(|d| {
        cells![
            d.from.clone(),
            d.to.clone(),
            d.change.id.clone(),
            Cell::exact(d.change.value),
            Cell::exact(d.change.u),
            d.change.unit.clone(),
            Cell::exact(d.p_value),
            d.significant.to_string()
        ]
    });
    Table::new(columns, rows)
}
