//! The page around a report: head, verdict, sections, provenance, style and script.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::document::{Document, prose, table};
use super::embed;
use super::plot::{DARK, LIGHT, STYLE};
use super::provenance::Provenance;

const SCRIPT: &str = include_str!("page.js");
const PAGE_STYLE: &str = include_str!("page.css");

/// The page may fetch nothing and send nothing, whatever stands in it.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; form-action 'none'; base-uri 'none'";

/// The whole file.
pub fn html(document: &Document, method: &Markup, provenance: &Provenance) -> String {
    let live = !document.data.is_null();
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content=(concat!("abbe ", env!("CARGO_PKG_VERSION")));
                link rel="icon" href="data:,";
                title { (document.title) }
                style { (PreEscaped(style())) }
            }
            body {
                header {
                    h1 { (document.title) }
                    p class="verdict" {
                        @if !document.word.is_empty() { strong class=(format!("word {}", super::plot::file_name(&document.word))) { (document.word) } " " }
                        (prose(&document.verdict))
                    }
                    @if !provenance.about.is_empty() {
                        dl class="about" {
                            @for (name, note) in &provenance.about { dt { (words(name)) } dd { (note) } }
                        }
                    }
                    nav {
                        @for (anchor, heading, _) in &document.sections { a href=(format!("#{anchor}")) { (heading) } " " }
                        a href="#method" { "Method and provenance" }
                    }
                }
                main {
                    @for (anchor, heading, contents) in &document.sections {
                        section id=(anchor) { h2 { (heading) } (contents) }
                    }
                    section id="method" {
                        h2 { "Method and provenance" }
                        (method)
                        (of(provenance))
                        @if !document.table.is_empty() {
                            p class="needs-script" hidden {
                                button id="download" type="button" { "Download all readings (CSV)" }
                                " with deviation and residuals, none left out."
                            }
                        }
                    }
                }
                div id="tip" role="status" hidden {}
                @if live {
                    script type="application/json" id="data" { (json(&document.data)) }
                    script type="text/plain" id="table" { (PreEscaped(embed::packed(&document.table))) }
                    script { (PreEscaped(SCRIPT)) }
                }
            }
        }
    }
    .into_string()
}

/// JSON that may stand in a script: `<` could end it.
fn json(value: &serde_json::Value) -> PreEscaped<String> {
    PreEscaped(value.to_string().replace('<', "\\u003c"))
}

fn style() -> String {
    let colours = |list: &[(&str, &str)]| -> String {
        list.iter()
            .map(|(name, colour)| format!("--{name}:{colour};"))
            .collect()
    };
    let (light, dark) = (colours(&LIGHT), colours(&DARK));
    format!(
        ":root{{color-scheme:light dark;{light}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n{PAGE_STYLE}{STYLE}"
    )
}

/// The name of a note in words: `serial_number` is the serial number.
fn words(name: &str) -> String {
    name.replace('_', " ")
}

fn of(provenance: &Provenance) -> Markup {
    let rows: Vec<Vec<String>> = provenance
        .inputs
        .iter()
        .map(|input| vec![input.path.clone(), input.bytes.to_string(), input.sha256.clone()])
        .collect();
    html! {
        dl {
            dt { "Command" } dd { code { (provenance.command) } }
            dt { "Version" } dd { (concat!("abbe ", env!("CARGO_PKG_VERSION"))) }
            dt { "Seed" } dd { (provenance.seed) }
        }
        div class="checksums" { (table(&["input", "bytes", "SHA-256"], &rows)) }
    }
}
