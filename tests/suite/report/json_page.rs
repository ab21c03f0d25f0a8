//! `docs/reference/json.md` lists what the schemas state. `ABBE_UPDATE_PAGES=1` writes the page anew.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Map, Value};

use crate::suite::{abbe, workspace};

/// The commands, and the subject of `abbe schema` for each.
const COMMANDS: [(&str, &str); 21] = [
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
];

const HEAD: &str = "# JSON results

*Reader: the engineer whose program reads the results, and the researcher who archives them. A test generates this page from
the schemas.*

`--json FILE` of a command writes one document:

```console
abbe fit sessions/hermle-c600u/measured/session.toml --quiet --json - | jq '.parameters[] | {id, value, u, unit}'
```

`abbe schema SUBJECT` prints its JSON Schema (draft 2020-12). A document has the fields of its schema and no others. This writes
the page anew:

```console
ABBE_UPDATE_PAGES=1 cargo test --profile checked -p abbe --test main json_page
```

A unit stands in the name of a field (`_um` µm, `_mm` mm, `_deg` °, `_min` min, `_sigma` standard deviations of the noise) or in
`unit` beside it. `u` is a standard uncertainty, `expanded_u` is 2 `u`. A field without a type is a number. `[]` marks an array, `?`
behind a type what may be `null` (a number that does not exist), `?` behind a name what may be absent. *As elsewhere* names [common
fields](#common-fields), and objects all of whose fields an object has.

`schema_version` is 3. It increases when a field changes its name or its meaning, or is removed.
";

pub(super) fn schema(subject: &str) -> Value {
    let printed = abbe(&["schema", subject]);
    assert!(printed.status.success(), "{subject}");
    serde_json::from_slice(&printed.stdout).unwrap()
}

/// The type of a field, with a link to an object of the page: `number[]` for an array, `number?` for what may be `null`.
pub(super) fn kind(schema: &Value) -> String {
    if let Some(reference) = schema["$ref"].as_str() {
        let name = reference.rsplit('/').next().unwrap();
        return format!("[{name}](#{})", name.to_lowercase());
    }
    if let Some(word) = schema["const"].as_str() {
        return format!("`\"{word}\"`");
    }
    let choices = ["anyOf", "oneOf", "allOf"].iter().find_map(|key| schema[key].as_array());
    let kinds: Vec<String> = if let Some(choices) = choices {
        choices.iter().map(kind).collect()
    } else if let Some(words) = schema["enum"].as_array().filter(|_| schema["type"].is_null()) {
        words.iter().map(|word| format!("`{word}`")).collect()
    } else {
        let names: Vec<&str> = match &schema["type"] {
            Value::String(name) => vec![name],
            Value::Array(names) => names.iter().filter_map(Value::as_str).collect(),
            _ => vec!["any"],
        };
        let kind_named = |name: &&str| match *name {
            "array" => match kind(&schema["items"]) {
                items if items.contains(" or ") => format!("({items})[]"),
                items => format!("{items}[]"),
            },
            "object" if schema["additionalProperties"].is_object() => {
                format!("object of {}", kind(&schema["additionalProperties"]))
            }
            name => name.to_string(),
        };
        names.iter().map(kind_named).collect()
    };
    if kinds == ["null"] {
        return "null".to_string();
    }
    let others: Vec<&str> = kinds.iter().map(String::as_str).filter(|kind| *kind != "null").collect();
    let mark = if others.len() < kinds.len() { "?" } else { "" };
    format!("{}{mark}", others.join(" or "))
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

/// Lines of one paragraph.
fn lines<'l>(page: &mut String, lines: impl IntoIterator<Item = &'l String>) {
    let lines: Vec<&str> = lines.into_iter().map(String::as_str).collect();
    writeln!(page, "{}\n", lines.join("\\\n")).unwrap();
}

/// Words with their meanings.
pub(super) fn words(page: &mut String, schema: &Value) {
    let line = |choice: &Value| {
        let text = one_line(choice["description"].as_str().unwrap_or_default());
        format!("`{}`: {text}", choice["const"].as_str().unwrap_or_default())
    };
    let choices: Vec<String> = schema["oneOf"].as_array().into_iter().flatten().map(line).collect();
    lines(page, &choices);
}

/// The fields of an object, each as the line that the page has of it. The unit in the name is not repeated in the meaning.
fn fields(object: &Value) -> BTreeMap<String, String> {
    let required: Vec<&str> = object["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let line = |(name, field): (&String, &Value)| {
        let meaning = one_line(field["description"].as_str().unwrap_or_default());
        let unit = match unit(name, "") {
            "″" => "arcsec",
            unit => unit,
        };
        let meaning = match unit {
            "" => meaning,
            unit => [".", ",", ":", ";", " ("]
                .iter()
                .fold(meaning, |text, end| text.replace(&format!(", {unit}{end}"), end)),
        };
        let absent = if required.contains(&name.as_str()) { "" } else { "?" };
        // Most fields are numbers, so a number is not stated.
        let kind = match kind(field) {
            number if number == "number" => String::new(),
            kind => format!(" {kind}"),
        };
        (name.clone(), format!("`{name}`{absent}{kind}: {meaning}"))
    };
    object["properties"].as_object().into_iter().flatten().map(line).collect()
}

/// An object of the page: what it has in common with others by name, then the fields that it alone has.
struct Listing<'a> {
    objects: &'a BTreeMap<String, BTreeMap<String, String>>,
    common: &'a BTreeMap<String, String>,
}

impl Listing<'_> {
    /// The largest object whose fields are all among `left`, if it has three or more.
    fn contained(&self, name: &str, size: usize, left: &BTreeMap<String, String>) -> Option<&String> {
        let is_part = |other: &&String| {
            let fields = &self.objects[*other];
            let is_smaller = (fields.len(), other.as_str()) < (size, name);
            fields.len() >= 3 && is_smaller && fields.iter().all(|(key, line)| left.get(key) == Some(line))
        };
        self.objects.keys().filter(is_part).max_by_key(|other| self.objects[*other].len())
    }

    fn write(&self, page: &mut String, name: &str, fields: BTreeMap<String, String>, order: &Value) {
        let size = fields.len();
        let mut left = fields;
        let mut named: Vec<String> = Vec::new();
        while let Some(part) = self.contained(name, size, &left) {
            named.push(format!("[{part}](#{})", part.to_lowercase()));
            left.retain(|key, _| !self.objects[part].contains_key(key));
        }
        let is_common = |key: &&String| self.common.get(*key) == left.get(*key);
        let order: Vec<&String> = order.as_object().into_iter().flat_map(Map::keys).collect();
        let in_common = order.iter().copied().filter(|key| left.contains_key(*key)).filter(is_common);
        named.extend(in_common.map(|key| format!("`{key}`")));
        if !named.is_empty() {
            writeln!(page, "As elsewhere: {}.\n", named.join(", ")).unwrap();
        }
        let others = order.iter().filter(|key| !is_common(key));
        lines(page, others.filter_map(|key| left.get(*key)));
    }
}

fn generated() -> String {
    let schemas: Vec<Value> = COMMANDS.iter().map(|(_, subject)| schema(subject)).collect();
    let mut definitions: BTreeMap<String, Value> = BTreeMap::new();
    for schema in &schemas {
        for (name, definition) in schema["$defs"].as_object().into_iter().flatten() {
            let known = definitions.entry(name.clone()).or_insert_with(|| definition.clone());
            assert_eq!(known, definition, "two objects of the schemas are called {name}");
        }
    }
    let objects: BTreeMap<String, BTreeMap<String, String>> =
        definitions.iter().map(|(name, definition)| (name.clone(), fields(definition))).collect();
    // The head: the fields that the documents of all commands have; two files have none.
    let documents: Vec<BTreeMap<String, String>> = schemas.iter().map(fields).collect();
    let mut head = documents[0].clone();
    for ((_, subject), document) in COMMANDS.iter().zip(&documents) {
        if !["model", "record"].contains(subject) {
            head.retain(|name, line| name != "warnings" && document.get(name) == Some(line));
        }
    }
    let mut counts: BTreeMap<(&String, &String), usize> = BTreeMap::new();
    for (name, line) in documents.iter().chain(objects.values()).flatten() {
        *counts.entry((name, line)).or_default() += 1;
    }
    // Of several meanings of a name the one whose repetition would take most room.
    let mut repeated: Vec<((&String, &String), usize)> =
        counts.into_iter().filter(|((name, _), count)| *count >= 3 && !head.contains_key(*name)).collect();
    repeated.sort_by_key(|((_, line), count)| line.len() * count);
    let common: BTreeMap<String, String> =
        repeated.into_iter().map(|((name, line), _)| (name.clone(), line.clone())).collect();
    let mut page = HEAD.to_string();
    page.push_str("\n## Every document\n\n");
    let names = schemas[0]["properties"].as_object().unwrap().keys();
    lines(&mut page, names.filter_map(|name| head.get(name)));
    page.push_str("## Common fields\n\n");
    lines(&mut page, common.values());
    let listing = Listing { objects: &objects, common: &common };
    page.push_str("## Commands\n\n");
    for (((command, subject), schema), mut document) in COMMANDS.iter().zip(&schemas).zip(documents) {
        writeln!(page, "### {command}\n").unwrap();
        let text = one_line(schema["description"].as_str().unwrap_or_default());
        writeln!(page, "{text} Schema: `{subject}`.\n").unwrap();
        document.retain(|name, line| head.get(name) != Some(line));
        listing.write(&mut page, "", document, &schema["properties"]);
    }
    page.push_str("## Objects\n\n");
    let keys = schema("session");
    for (name, definition) in &definitions {
        writeln!(page, "### {name}\n").unwrap();
        if let Some(text) = definition["description"].as_str() {
            writeln!(page, "{}\n", one_line(text)).unwrap();
        }
        if keys["$defs"].get(name) == Some(definition) {
            writeln!(page, "Its fields are the keys of [{name}](keys.md#{name}).\n").unwrap();
        } else if definition["properties"].is_object() {
            listing.write(&mut page, name, objects[name].clone(), &definition["properties"]);
        } else {
            words(&mut page, definition);
        }
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
