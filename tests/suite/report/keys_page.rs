//! `docs/reference/keys.md` lists the keys of the files that users write. `ABBE_UPDATE_PAGES=1` writes the page anew.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::Value;

use crate::suite::report::json_page::{kept_current, kind, one_line, schema, unit, words};

/// The files, and the subject of `abbe schema` for each.
const FILES: [(&str, &str); 3] = [
    ("Sessions and machines", "session"),
    ("Error functions of abbe volumetric", "functions"),
    ("Certificates of abbe fit --dcc", "certificate"),
];

const HEAD: &str = "# Keys of files

*Reader: the metrologist and the engineer who write sessions, machines and error functions. This page is generated from the
schemas by a test.*

This page lists every table of a file that is written by hand, and its keys. Example: a test has the keys of [test](#test), and a
machine file those of [machine](#machine). `abbe schema SUBJECT` prints the same as JSON Schema, with which an editor completes
keys ([schemas](files.md#schemas)).

A unit stands in the name of a key: `_um` µm, `_mm` mm, `_deg` °, `_arcsec` ″. A key marked *optional* may be absent; `number[]` is
an array.

To write the page anew:

```console
ABBE_UPDATE_PAGES=1 cargo test --profile checked -p abbe --test main the_page_lists
```
";

/// What the keys of a shape end their meaning with: there is one for each unit.
const OF_DRIVER: &str = "In the unit of the driver.";

/// A line of a table, and those of the keys in a table of its own.
fn line(page: &mut String, name: &str, field: &Value, is_required: bool) {
    let meaning = field["description"].as_str().unwrap_or_default();
    let optional = if is_required { "" } else { ", *optional*" };
    writeln!(page, "| `{name}` | {}{optional} | {} | {} |", kind(field), unit(name, meaning), one_line(meaning))
        .unwrap();
    lines(page, &format!("{name}."), field);
}

fn lines(page: &mut String, prefix: &str, object: &Value) {
    let required: Vec<&str> = object["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let mut named: Vec<String> = Vec::new();
    for (name, field) in object["properties"].as_object().into_iter().flatten() {
        // One line for all units.
        let name = match field["description"].as_str() {
            Some(meaning) if meaning.ends_with(OF_DRIVER) => {
                let stem = named.iter().find_map(|known| known.strip_suffix('…')).filter(|stem| name.starts_with(stem));
                stem.map_or_else(|| format!("{}_…", name.split('_').next().unwrap()), |stem| format!("{stem}…"))
            }
            _ => name.clone(),
        };
        if !named.contains(&name) {
            line(page, &format!("{prefix}{name}"), field, required.contains(&name.as_str()));
            named.push(name);
        }
    }
}

fn table(page: &mut String, object: &Value) {
    page.push_str("| key | type | unit | meaning |\n|---|---|---|---|\n");
    lines(page, "", object);
    page.push('\n');
}

/// A table or a value by its name.
fn definition(page: &mut String, name: &str, schema: &Value) {
    writeln!(page, "### {name}\n").unwrap();
    if let Some(text) = schema["description"].as_str() {
        writeln!(page, "{}\n", one_line(text)).unwrap();
    }
    if schema["oneOf"][0]["const"].is_string() {
        return words(page, schema);
    }
    if schema["properties"].is_object() {
        table(page, schema);
    }
    let forms = ["anyOf", "oneOf"].into_iter().filter_map(|list| schema[list].as_array()).flatten();
    for form in forms.filter(|form| form["properties"]["kind"]["const"].is_string()) {
        let word = form["properties"]["kind"]["const"].as_str().unwrap();
        writeln!(page, "With `kind = \"{word}\"`:\n").unwrap();
        table(page, form);
    }
}

fn generated() -> String {
    let mut page = format!("{HEAD}\n");
    let mut listed: BTreeMap<String, Value> = BTreeMap::new();
    for (title, subject) in FILES {
        let schema = schema(subject);
        let text = one_line(schema["description"].as_str().unwrap_or_default());
        writeln!(page, "## {title}\n\n{text} Schema: `abbe schema {subject}`.\n").unwrap();
        table(&mut page, &schema);
        for (name, own) in schema["$defs"].as_object().unwrap() {
            match listed.get(name) {
                Some(known) => assert_eq!(known, own, "two tables of the schemas are called {name}"),
                None => {
                    definition(&mut page, name, own);
                    listed.insert(name.clone(), own.clone());
                }
            }
        }
    }
    format!("{}\n", page.trim_end())
}

#[test]
fn the_page_lists_the_keys_of_files() {
    kept_current("docs/reference/keys.md", &generated());
}
