//! The HTML page of a report: head, summary, sections, provenance, style sheet and script.

use std::io::Write as _;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::printers::csv;
use crate::printers::html::{head, list, prose, sections, table};
use crate::report::block::{Level, Report};
use crate::report::figure::svg::{STYLE, variables};
use crate::report::number::capitalised;
use crate::report::provenance::Provenance;
use crate::report::table::{Table, cells};

const SCRIPT: &str = include_str!("page.js");
const PAGE_STYLE: &str = include_str!("page.css");

/// Content security policy: the page loads nothing and sends nothing.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; form-action 'none'; base-uri 'none'";

/// Returns the complete page.
/// # Errors
/// If the readings cannot be written as CSV.
pub fn html(report: &Report, provenance: &Provenance) -> Result<String, String> {
    let is_interactive = !report.data.is_null();
    let csv = csv::text(&report.readings)?;
    let mut sections = sections(report, &[Level::Key, Level::Detail, Level::Page]);
    // What comes before the first section is the summary.
    let has_summary = sections.first().is_some_and(|(_, heading, _)| heading.is_empty());
    let summary = has_summary.then(|| sections.remove(0).2);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            (head(POLICY, &report.title, &style()))
            body {
                header {
                    h1 { (report.title) }
                    @if let Some(summary) = summary { (summary) }
                    (warnings(&report.warnings))
                    @if !provenance.about.is_empty() {
                        dl class="about" {
                            @for (name, note) in &provenance.about { dt { (label(name)) } dd { (note) } }
                        }
                    }
                    nav {
                        @for (anchor, heading, _) in &sections { a href=(format!("#{anchor}")) { (heading) } " " }
                        a href="#method" { "Method and provenance" }
                    }
                }
                main {
                    @for (anchor, heading, contents) in &sections {
                        section id=(anchor) { h2 { (heading) } (contents) }
                    }
                    section id="method" {
                        h2 { "Method and provenance" }
                        p { (prose(&report.method)) }
                        (provenance_tables(provenance))
                        @if !report.readings.rows.is_empty() {
                            p class="needs-script" hidden {
                                button id="download" type="button" { "Download all readings (CSV)" }
                                " All readings with deviation and residuals, outliers included."
                            }
                        }
                    }
                }
                div id="tip" role="status" hidden {}
                @if is_interactive {
                    script type="application/json" id="data" { (json(&report.data)) }
                    script type="text/plain" id="csv" { (PreEscaped(compressed(&csv))) }
                    script { (PreEscaped(SCRIPT)) }
                }
            }
        }
    };
    Ok(page.into_string())
}

/// Compresses text in zlib format (`deflate` in browsers) and encodes it in base64.
fn compressed(text: &[u8]) -> String {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    let whole = encoder.write_all(text).and_then(|()| encoder.finish());
    whole.map(|bytes| STANDARD.encode(bytes)).unwrap_or_default()
}

/// JSON inside a script element. `<` is escaped, because it could end the element.
fn json(value: &serde_json::Value) -> PreEscaped<String> {
    PreEscaped(value.to_string().replace('<', "\\u003c"))
}

fn warnings(warnings: &[String]) -> Markup {
    html! {
        @match warnings {
            [] => {}
            [one] => p class="warning" { strong { "Warning: " } (prose(&capitalised(one))) },
            many => div class="warning" { strong { (many.len()) " warnings" } (list(many.iter().map(|one| capitalised(one)))) },
        }
    }
}

/// Colours, then the style sheets of page and plots.
fn style() -> String {
    let [light, dark] = [false, true].map(variables);
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
            @if let Some(seed) = provenance.seed { dt { "Seed" } dd { (seed) } }
        }
        @if !inputs.rows.is_empty() { div class="checksums" { (table(&inputs)) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compressed_text_is_recovered() {
        use std::io::Read as _;
        let text = "test,µm\n\"a,b\",1.25\n".repeat(40);
        let bytes = STANDARD.decode(compressed(text.as_bytes())).unwrap();
        let mut found = String::new();
        flate2::read::ZlibDecoder::new(bytes.as_slice()).read_to_string(&mut found).unwrap();
        assert_eq!(found, text);
    }
}
