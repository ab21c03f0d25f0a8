//! Reports in a notebook: the key blocks as HTML, without a page around them.

use maud::html;

use super::html::sections;
use crate::report::block::{Level, Report};

/// The key blocks of a report.
pub fn html(report: &Report) -> String {
    let sections = sections(report, &[Level::Brief, Level::Key]);
    let contents = html! {
        h3 { (report.title) }
        @for (_, heading, contents) in &sections {
            @if !heading.is_empty() { h4 { (heading) } }
            (contents)
        }
    };
    contents.into_string()
}
