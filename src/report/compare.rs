//! Differences between models of one machine.

use abbe::identify::compare::results::{Comparison, Difference, Pair};
use abbe::identify::results::Outlier;
use abbe::model::words::counted;

use super::number::{p_equals, probability, quantity, unit, value_and_u};
use super::table::{Cell, Table, cells, numbers};

/// Rows of the first screen that are not significant.
const FOLDED: usize = 8;
/// Outliers that are listed by line and residual.
const MAX_OUTLIERS: usize = 5;

/// What has changed, in a few lines.
pub fn headline(comparison: &Comparison, pair: &Pair) -> Vec<String> {
    let changed = match pair.significant {
        0 => format!("no significant difference in {}", counted(pair.compared, "parameter")),
        count => format!("{} of {}", counted(count, "significant difference"), counted(pair.compared, "parameter")),
    };
    let level = comparison.significance;
    let mut lines = vec![
        format!("{} → {}: {changed} (any false claim: probability ≤ {level})", pair.from, pair.to),
        format!(
            "all differences together: χ² = {:.1} with {}, {}",
            pair.chi_square,
            counted(pair.degrees_of_freedom, "degree of freedom"),
            p_equals(pair.p_value)
        ),
    ];
    for input in [&pair.from, &pair.to] {
        let own: Vec<&Outlier> = comparison
            .outliers
            .iter()
            .filter(|excluded| excluded.input == *input)
            .map(|found| &found.outlier)
            .collect();
        let place = |outlier: &&Outlier| format!("{}:{} ({:.1} µm)", outlier.file, outlier.line, outlier.residual_um);
        match own.as_slice() {
            [] => {}
            few if few.len() <= MAX_OUTLIERS => {
                let places: Vec<String> = few.iter().map(place).collect();
                lines.push(format!("excluded as outliers from {input}: {}", places.join(", ")));
            }
            many => lines.push(format!("excluded as outliers from {input}: {}", counted(many.len(), "reading"))),
        }
    }
    if !pair.shared_setup.is_empty() {
        lines.push(format!("one object in both: {}", pair.shared_setup.join(", ")));
    }
    let others: Vec<&str> =
        pair.not_shared.iter().filter(|other| !other.refuted).map(|other| other.id.as_str()).collect();
    if !others.is_empty() {
        lines.push(format!("not taken for one object, like the others of their kind: {}", others.join(", ")));
    }
    for refuted in pair.not_shared.iter().filter(|other| other.refuted) {
        let (value, u) = value_and_u(refuted.value, refuted.u);
        lines.push(format!(
            "not one object in both, although of one name: {} differs by {} ({})",
            refuted.id,
            quantity(&format!("{value} ± {u}"), &refuted.unit),
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
pub fn differences(comparison: &Comparison, pair: &Pair, all: bool) -> Table {
    // An input that is given twice has two pairs of the same names.
    let of_pair = comparison.differences.iter().filter(|d| d.from == pair.from && d.to == pair.to);
    let own: Vec<&Difference> = of_pair.take(pair.compared).collect();
    let shown = if all { own.len() } else { (pair.significant + FOLDED).min(own.len()) };
    let rows = own[..shown].iter().map(|d| {
        let verdict = if d.significant { "significant" } else { "" };
        let [value, u] = Cell::estimate(d.value, d.u);
        cells![d.id.clone(), value, u, unit(&d.unit), probability(d.p_value), verdict]
    });
    let mut table = Table::new(["difference", ">value", ">u", "", ">p", ""], rows);
    if shown < own.len() {
        table.notes.push(format!("{} more with --all", own.len() - shown));
    }
    table
}

/// The volumetric error of each input over the common range.
pub fn workspace(comparison: &Comparison) -> Table {
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

/// All differences as a table of figures.
pub fn figures(comparison: &Comparison) -> Table {
    let columns = ["from", "to", "id"].map(super::table::Column::from).into_iter();
    let columns = columns.chain(["value", "u"].map(numbers)).chain(["unit".into()]).chain([numbers("p_value")]);
    let columns = columns.chain(["significant".into()]);
    let rows = comparison.differences.iter().map(|d| {
        cells![
            d.from.clone(),
            d.to.clone(),
            d.id.clone(),
            Cell::exact(d.value),
            Cell::exact(d.u),
            d.unit.clone(),
            Cell::exact(d.p_value),
            d.significant.to_string()
        ]
    });
    Table::new(columns, rows)
}
