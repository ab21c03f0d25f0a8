//! `[constants]`: named lengths in mm, each with its meaning if the file tells it.
//!
//! `R = 100.0  # radius` and `R = { mm = 100.0, means = "radius" }` are the same: without `means`, the comment behind
//! the value is its meaning, up to the first semicolon.

use super::document::{Table, Value};
use crate::error::ModelError;
use crate::session::expression::Constant;

/// Reads the table, in the order of the file.
pub(super) fn constants(root: &mut Table<'_>) -> Result<Vec<Constant>, ModelError> {
    let Some(value) = root.take("constants") else {
        return Ok(Vec::new());
    };
    value.table("[constants]".into())?.remaining_values()?.into_iter().map(constant).collect()
}

fn constant(entry: Value<'_>) -> Result<Constant, ModelError> {
    let name = entry.key.clone();
    let mut letters = name.chars();
    let valid = letters.next().is_some_and(|c| c.is_alphabetic() || c == '_')
        && letters.all(|c| c.is_alphanumeric() || c == '_')
        && name != "sqrt";
    if !valid {
        let help = "a name is a letter followed by letters, digits and `_`; `sqrt` is reserved";
        let message = format!("a constant cannot have the name `{name}`");
        return Err(entry.source.error(entry.key_span.clone(), message, Some(help.into())));
    }
    let comment = comment(&entry);
    if !entry.is_table() {
        return Ok(Constant { name, mm: entry.number()?, means: comment });
    }
    let mut table = entry.table(format!("the constant `{name}`"))?;
    let mm = table.require("mm", "its value, for example `mm = 100.0`")?.number()?;
    let means = match table.take("means") {
        Some(value) => Some(value.text()?.trim().to_string()).filter(|text| !text.is_empty()),
        None => comment,
    };
    table.finish()?;
    Ok(Constant { name, mm, means })
}

/// The comment behind a value on its line, up to the first semicolon.
fn comment(entry: &Value<'_>) -> Option<String> {
    let rest = entry.source.text.get(entry.span.end..)?.lines().next()?;
    let comment = rest.trim_start().strip_prefix('#')?;
    let text = comment.split(';').next()?.trim();
    let usable = !text.is_empty() && !text.chars().any(char::is_control);
    usable.then(|| text.to_string())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::document::Source;
    use super::constants;

    #[test]
    fn meanings_are_stated_or_comments() {
        let text = "[constants]\nR = 100.0  # radius; see below\nH = { mm = 75, means = \"height\" } # not this\n\
                    Z = { mm = 1 } # offset\nD = 2 #\nE = 3\n";
        let source = Source::new(Path::new("session.toml"), text);
        let found = constants(&mut source.parse().unwrap()).unwrap();
        let found: Vec<(&str, f64, Option<&str>)> =
            found.iter().map(|constant| (constant.name.as_str(), constant.mm, constant.means.as_deref())).collect();
        let expected = [
            ("R", 100.0, Some("radius")),
            ("H", 75.0, Some("height")),
            ("Z", 1.0, Some("offset")),
            ("D", 2.0, None),
            ("E", 3.0, None),
        ];
        assert_eq!(found, expected);
    }
}
