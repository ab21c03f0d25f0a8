//! `docs/reference/json.md` lists what the schemas state. `ABBE_UPDATE_PAGES=1` writes the page anew.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Map, Value};

use crate::suite::{abbe, workspace};

/// The commands, and the subject of `abbe schema` for each.
const COMMANDS: [(&str, &str); 22] = [
    ("abbe fit", "fit"),
    ("abbe compare --repeated", "repeat"),
    ("abbe fit --method circle, cone or two-plane", "geometric"),
    ("abbe fit --method self-calibration", "self-calibration"),
    ("abbe trace", "trace"),
    ("abbe validate", "validate"),
    ("abbe fit and abbe trace --save", "model"),
    ("abbe compare", "compare"),
    ("abbe compensate", "compensate"),
    ("abbe export", "export"),
    ("abbe import", "import"),
    ("abbe plan", "plan"),
    ("abbe plan --improve, --separate or --range", "next-test"),
    ("abbe plan --global", "global"),
    ("abbe poses", "poses"),
    ("abbe plan --patterns", "patterns"),
    ("abbe simulate", "simulate"),
    ("abbe volumetric --map", "map"),
    ("abbe fleet run", "run"),
    ("The result of a session in the folder of abbe fleet run", "record"),
    ("abbe fleet history", "history"),
    ("abbe fleet study", "study"),
];

const HEAD: &str = "# JSON results

*Reader: the engineer whose program reads the results, and the researcher who archives them. This page is
generated from the schemas by a test.*

Every command that has `--json FILE` writes one JSON document. Example:

```console
abbe fit sessions/hermle-c600u/measured/session.toml --quiet --json - | jq '.parameters[] | {id, value, u, unit}'
```

`abbe schema SUBJECT` prints the JSON Schema (draft 2020-12) of each document. A document has the fields of its schema and no
others. To write the page anew:

```console
ABBE_UPDATE_PAGES=1 cargo test --profile checked -p abbe --test main json_page
```

A unit stands in the name of a field (`_um` µm, `_mm` mm, `_deg` °, `_min` min, `_sigma` standard deviations of the noise) or in a
field `unit` beside it (`um`, `arcsec`, `deg`, `um/K`, …). `u` is a standard uncertainty, `expanded_u` is 2 `u`. Numbers that do not
exist are `null`. A field marked *optional* is absent where it does not apply.

`schema_version` is 3. It increases when a field changes its name or its meaning, or is removed; new fields leave it unchanged.
";

pub(super) fn schema(subject: &str) -> Value {
    let printed = abbe(&["schema", subject]);
    assert!(printed.status.success(), "{subject}");
    serde_json::from_slice(&printed.stdout).unwrap()
}

/// The type of a field, with a link to an object of the page.
pub(super) fn kind(schema: &Value) -> String {
    if let Some(reference) = schema["$ref"].as_str() {
        let name = reference.rsplit('/').next().unwrap();
        return format!("[{name}](#{})", name.to_lowercase());
    }
    if let Some(word) = schema["const"].as_str() {
        return format!("`\"{word}\"`");
    }
    for key in ["anyOf", "oneOf", "allOf"] {
        if let Some(choices) = schema[key].as_array() {
            let kinds: Vec<String> = choices.iter().map(kind).collect();
            return kinds.join(" or ");
        }
    }
    if schema["type"].is_null()
        && let Some(words) = schema["enum"].as_array()
    {
        return words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(" or ");
    }
    let names: Vec<&str> = match &schema["type"] {
        Value::String(name) => vec![name],
        Value::Array(names) => names.iter().filter_map(Value::as_str).collect(),
        _ => vec!["any"],
    };
    let of = |name: &&str| match *name {
        "array" => format!("array of {}", kind(&schema["items"])),
        "object" if schema["additionalProperties"].is_object() => {
            format!("object of {}", kind(&schema["additionalProperties"]))
        }
        name => name.to_string(),
    };
    names.iter().map(of).collect::<Vec<_>>().join(" or ")
}

/// The unit of a field by its name, or by its description.
pub(super) fn unit(name: &str, description: &str) -> &'static str {
    let suffixes = [
        ("_mm_min", "mm/min"),
        ("_deg_min", "°/min"),
        ("_um_m", "µm/m"),
        ("_arcsec", "″"),
        ("_um", "µm"),
        ("_mm", "mm"),
        ("_deg", "°"),
        ("_min", "min"),
        ("_sigma", "standard deviations"),
        ("_percent", "%"),
    ];
    let by_name = suffixes.iter().find(|(suffix, _)| name.ends_with(suffix));
    match by_name {
        Some((_, unit)) => unit,
        None if description.contains("in `unit`") => "`unit`",
        None if description.contains("in `curve_unit`") => "`curve_unit`",
        None if description.contains("in `curve_at_unit`") => "`curve_at_unit`",
        None => "",
    }
}

pub(super) fn one_line(text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    words.join(" ").replace('|', "\\|")
}

/// A table of the fields of an object, without those of the envelope.
fn table(page: &mut String, object: &Value, left_out: &[String]) {
    page.push_str("| field | type | unit | meaning |\n|---|---|---|---|\n");
    let required: Vec<&str> =
        object["required"].as_array().map_or(Vec::new(), |names| names.iter().filter_map(Value::as_str).collect());
    for (name, field) in object["properties"].as_object().unwrap_or(&Map::new()) {
        if left_out.contains(name) {
            continue;
        }
        let description = field["description"].as_str().unwrap_or_default();
        let optional = if required.contains(&name.as_str()) { "" } else { ", *optional*" };
        writeln!(
            page,
            "| `{name}` | {}{optional} | {} | {} |",
            kind(field),
            unit(name, description),
            one_line(description)
        )
        .unwrap();
    }
    page.push('\n');
}

/// An object or a list of words by its name.
pub(super) fn definition(page: &mut String, name: &str, schema: &Value) {
    writeln!(page, "### {name}\n").unwrap();
    if let Some(text) = schema["description"].as_str() {
        writeln!(page, "{}\n", one_line(text)).unwrap();
    }
    if schema["properties"].is_object() {
        table(page, schema, &[]);
        return;
    }
    page.push_str("| value | meaning |\n|---|---|\n");
    for choice in schema["oneOf"].as_array().into_iter().flatten() {
        let text = one_line(choice["description"].as_str().unwrap_or_default());
        writeln!(page, "| `{}` | {text} |", choice["const"].as_str().unwrap_or_default()).unwrap();
    }
    page.push('\n');
}

fn generated() -> String {
    let schemas: Vec<Value> = COMMANDS.iter().map(|(_, subject)| schema(subject)).collect();
    let mut definitions: BTreeMap<String, Value> = BTreeMap::new();
    for schema in &schemas {
        for (name, own) in schema["$defs"].as_object().into_iter().flatten() {
            let known = definitions.entry(name.clone()).or_insert_with(|| own.clone());
            assert_eq!(known, own, "two objects of the schemas are called {name}");
        }
    }
    // The fields before the result are those that all commands with a session have.
    let fields =
        |schema: &Value| -> Vec<String> { schema["properties"].as_object().unwrap().keys().cloned().collect() };
    let shared: Vec<String> = fields(&schemas[0])
        .into_iter()
        .filter(|name| schemas.iter().all(|schema| fields(schema).contains(name)))
        .filter(|name| name != "warnings")
        .collect();
    let mut page = HEAD.to_string();
    page.push_str("\n## Every document\n\n");
    let others: Vec<String> = fields(&schemas[0]).into_iter().filter(|name| !shared.contains(name)).collect();
    table(&mut page, &schemas[0], &others);
    page.push_str("## Commands\n\n");
    for ((command, subject), schema) in COMMANDS.iter().zip(&schemas) {
        writeln!(page, "### {command}\n").unwrap();
        let text = one_line(schema["description"].as_str().unwrap_or_default());
        writeln!(page, "{text} Schema: `abbe schema {subject}`.\n").unwrap();
        table(&mut page, schema, &shared);
    }
    page.push_str("## Objects\n\n");
    for (name, schema) in &definitions {
        definition(&mut page, name, schema);
    }
    format!("{}\n", page.trim_end())
}

/// Writes a page anew if that is asked for, and compares it with the one that is kept.
pub(super) fn kept_current(file: &str, page: &str) {
    let file = workspace().join(file);
    if std::env::var_os("ABBE_UPDATE_PAGES").is_some() {
        std::fs::write(&file, page).unwrap();
    }
    let written = std::fs::read_to_string(&file).unwrap_or_default();
    let differs = page.lines().zip(written.lines()).find(|(new, old)| new != old);
    assert_eq!(differs, None, "write the page anew with ABBE_UPDATE_PAGES=1");
    assert_eq!(page.lines().count(), written.lines().count());
}

#[test]
fn the_page_lists_what_the_schemas_state() {
    kept_current("docs/reference/json.md", &generated());
}

#[test]
fn every_field_has_a_meaning() {
    fn check(at: &str, schema: &Value) {
        for (name, field) in schema["properties"].as_object().into_iter().flatten() {
            assert!(field["description"].is_string(), "{at}.{name} has no description");
        }
        for (name, own) in schema["$defs"].as_object().into_iter().flatten() {
            check(name, own);
        }
    }
    for (_, subject) in COMMANDS {
        check(subject, &schema(subject));
    }
}
