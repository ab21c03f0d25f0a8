//! The HTML page of a report: head, summary, sections, provenance, style sheet and script.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::printers::csv;
use crate::printers::html::{capitalised, head, list, prose, table};
use crate::report::figure::file_name;
use crate::report::figure::svg::{DARK, LIGHT, STYLE};
use crate::report::pages::document::Document;
use crate::report::pages::embed;
use crate::report::provenance::Provenance;
use crate::report::table::{Table, cells};

const SCRIPT: &str = include_str!("page.js");
const PAGE_STYLE: &str = include_str!("page.css");

/// Content security policy: the page loads nothing and sends nothing.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; form-action 'none'; base-uri 'none'";

/// Returns the complete page.
/// # Errors
/// If the readings cannot be written as CSV.
pub fn html(document: &Document, provenance: &Provenance) -> Result<String, String> {
    let is_interactive = !document.data.is_null();
    let csv = csv::text(&document.readings)?;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            (head(POLICY, &document.title, &style()))
            body {
                header {
                    h1 { (document.title) }
                    (summary(document))
                    @if !provenance.about.is_empty() {
                        dl class="about" {
                            @for (name, note) in &provenance.about { dt { (label(name)) } dd { (note) } }
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
                        p { (prose(&document.method)) }
                        (provenance_tables(provenance))
                        @if !document.readings.rows.is_empty() {
                            p class="needs-script" hidden {
                                button id="download" type="button" { "Download all readings (CSV)" }
                                " All readings with deviation and residuals, outliers included."
                            }
                        }
                    }
                }
                div id="tip" role="status" hidden {}
                @if is_interactive {
                    script type="application/json" id="data" { (json(&document.data)) }
                    script type="text/plain" id="csv" { (PreEscaped(embed::compressed(&csv))) }
                    script { (PreEscaped(SCRIPT)) }
                }
            }
        }
    };
    Ok(page.into_string())
}

/// JSON inside a script element. `<` is escaped, because it could end the element.
fn json(value: &serde_json::Value) -> PreEscaped<String> {
    PreEscaped(value.to_string().replace('<', "\\u003c"))
}

/// Verdict, key figures and warnings.
fn summary(document: &Document) -> Markup {
    html! {
        p class="verdict" {
            @if !document.word.is_empty() {
                strong class=(format!("word {}", file_name(&document.word))) { (document.word) } " "
            }
            (prose(&document.verdict))
        }
        @if !document.key_figures.is_empty() {
            dl class="key-figures" {
                @for figure in &document.key_figures {
                    div { dt { (figure.label) } dd { (figure.value) } dd class="note" { (figure.note) } }
                }
            }
        }
        @match document.warnings.as_slice() {
            [] => {}
            [one] => p class="warning" { strong { "Warning: " } (prose(&capitalised(one))) },
            many => div class="warning" { strong { (many.len()) " warnings" } (list(many.iter().map(|one| capitalised(one)))) },
        }
    }
}

/// Colours, then the style sheets of page and plots.
fn style() -> String {
    let colours =
        |list: &[(&str, &str)]| -> String { list.iter().map(|(name, colour)| format!("--{name}:{colour};")).collect() };
    let (light, dark) = (colours(&LIGHT), colours(&DARK));
    format!(
        ":root{{color-scheme:light dark;{light}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n{PAGE_STYLE}{STYLE}"
    )
}

/// Label of a note: `serial_number` becomes `serial number`.
fn label(name: &str) -> String {
    name.replace('_', " ")
}

/// Command line, version, seed and input files.
fn provenance_tables(provenance: &Provenance) -> Markup {
    let inputs = provenance.inputs.iter();
    let rows = inputs.map(|input| cells![&input.path, input.bytes.to_string(), &input.sha256]);
    let inputs = Table::new(["input", ">bytes", "SHA-256"], rows);
    html! {
        dl {
            dt { "Command" } dd { code { (provenance.command) } }
            dt { "Program" } dd { (concat!("abbe ", env!("CARGO_PKG_VERSION"))) }
            dt { "Seed" } dd { (provenance.seed) }
        }
        div class="checksums" { (table(&inputs)) }
    }
}
