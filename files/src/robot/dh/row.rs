//! A row of a table of Denavit–Hartenberg parameters as it stands in the file.

use abbe_model::axis::AxisKind;
use abbe_model::instrument::Fault;
use abbe_model::unit::Dimension;

use super::cell::Value;

/// The columns with numbers.
const PARAMETERS: [&str; 8] = ["a", "alpha", "beta", "d", "theta", "offset", "lower", "upper"];

/// A row as it stands in the file.
pub(super) struct RowRead {
    pub line: usize,
    pub name: String,
    pub kind: Option<AxisKind>,
    /// The parameters by their names, and whether the cell is filled.
    values: Vec<(&'static str, Value, bool)>,
}

impl RowRead {
    /// `place` is that of a parameter's cell, `number` that of the joint, `comma` whether a comma is a decimal sign.
    pub fn of(
        place: impl Fn(&str) -> Option<usize>,
        cells: &[String],
        comma: bool,
        number: usize,
        line: usize,
    ) -> Result<RowRead, Fault> {
        let cell = |own: &str| place(own).map_or("", |place| cells[place].as_str());
        let mut values = Vec::new();
        for own in PARAMETERS {
            let text = cell(own);
            let plain = if comma { text.replace(',', ".") } else { text.to_string() };
            let value = Value::parse(&plain).ok_or_else(|| {
                let help = "write a finite number, or an expression such as pi/2 or q2 - 90";
                (format!("`{text}` in column `{own}` is no value"), help.to_string())
            })?;
            values.push((own, value, !text.is_empty()));
        }
        let name =
            Some(cell("joint")).filter(|name| !name.is_empty()).map_or_else(|| number.to_string(), str::to_string);
        let mut row = RowRead { line, name, kind: None, values };
        let word = cell("type");
        row.kind = match word.to_lowercase().as_str() {
            "" if row.value("d").moves => Some(AxisKind::Linear),
            "" | "r" | "revolute" | "rotary" | "rotation" | "0" => Some(AxisKind::Rotary),
            "p" | "prismatic" | "linear" | "translation" | "1" => Some(AxisKind::Linear),
            "f" | "fixed" | "-" => None,
            _ => return Err((format!("`{word}` is no type of a joint"), "write rotary, prismatic or fixed".into())),
        };
        let moved = match row.kind {
            Some(AxisKind::Rotary) => "theta",
            Some(AxisKind::Linear) => "d",
            None => "",
        };
        if let Some((own, ..)) = row.values.iter().find(|(own, value, _)| value.moves && *own != moved) {
            let what = match moved {
                "" => "the row is fixed".to_string(),
                moved => format!("a joint of this type moves `{moved}`"),
            };
            return Err((
                format!("`{}` in column `{own}` moves, and {what}", cell(own)),
                "keep the joint variable in the column that the joint moves, and state the type of the row".into(),
            ));
        }
        Ok(row)
    }

    pub fn type_in_words(&self) -> String {
        self.kind.map_or("fixed".to_string(), |kind| kind.to_string())
    }

    pub fn value(&self, own: &str) -> Value {
        self.values.iter().find(|(name, ..)| *name == own).map(|(_, value, _)| *value).unwrap_or_default()
    }

    pub fn is_filled(&self, own: &str) -> bool {
        self.values.iter().any(|(name, _, is_filled)| *name == own && *is_filled)
    }

    /// The parameters whose cells are empty although the table has their columns, and no joint moves them.
    pub fn blank(&self, place: impl Fn(&str) -> Option<usize>) -> Vec<&'static str> {
        let moved =
            |own: &str| matches!((self.kind, own), (Some(AxisKind::Rotary), "theta") | (Some(AxisKind::Linear), "d"));
        let has_limits = |own: &str| matches!(own, "lower" | "upper");
        let blank = |(own, _, is_filled): &&(&'static str, Value, bool)| {
            place(own).is_some() && !is_filled && !moved(own) && !has_limits(own)
        };
        self.values.iter().filter(blank).map(|(own, ..)| *own).collect()
    }

    /// What a column of the row measures; `None` for the limits of a fixed row.
    pub fn dimension(&self, own: &str) -> Option<Dimension> {
        match (own, self.kind) {
            ("a" | "d", _) => Some(Dimension::Length),
            ("alpha" | "beta" | "theta", _) | ("offset", None) => Some(Dimension::Angle),
            (_, Some(AxisKind::Linear)) => Some(Dimension::Length),
            (_, Some(AxisKind::Rotary)) => Some(Dimension::Angle),
            (_, None) => None,
        }
    }
}
