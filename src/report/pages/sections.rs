//! Sections of tables that several reports share: conflicts with the session, confounded parameters, outliers, ball-bar
//! figures.

use abbe::identify::circular::CircularTest;
use abbe::identify::plausibility::Plausibility;
use abbe::identify::results::{Outlier, Unobservable};
use abbe::identify::tolerance::Conformity;
use abbe::model::words::counted;
use maud::{Markup, html};

use super::document::Document;
use crate::printers::html::{capitalised, folded_beyond, list, table};
use crate::report::{circular, conformity, confounded, plausibility};

/// Longer lists are folded.
const MAX_LISTED: usize = 12;

/// Adds a section if the readings contradict the session.
pub fn conflicts(document: &mut Document, plausibility: &Plausibility) {
    let Some(found) = plausibility::conflicts(plausibility) else {
        return;
    };
    document.section(
        "Conflict between readings and session",
        html! {
            @if !found.sentences.is_empty() { (list(found.sentences)) }
            @if !found.setup.rows.is_empty() { (table(&found.setup)) }
            p { (found.explanation) }
            @if !found.causes.is_empty() { (list(found.causes)) }
        },
    );
}

/// Adds the decisions of conformity, if the session states limits.
pub fn conformity(document: &mut Document, found: Option<&Conformity>) {
    let Some(found) = found else {
        return;
    };
    let contents = html! { p { (capitalised(&conformity::sentence(found))) "." } (table(&conformity::table(found))) };
    document.section("Conformity", contents);
}

/// Confounded parameters: one sentence for each null-space direction.
pub fn confounded(directions: &[Unobservable]) -> Markup {
    let summary = counted(directions.len(), "null-space direction");
    let sentences = list(confounded::sentences(directions).iter().map(|sentence| capitalised(sentence)));
    html! {
        @if !directions.is_empty() {
            h3 { "Confounded parameters" }
            (folded_beyond(MAX_LISTED, directions.len(), &summary, sentences))
        }
    }
}

/// Readings that are excluded as outliers.
pub fn outliers(outliers: &[Outlier]) -> Markup {
    let summary = format!("{} excluded", counted(outliers.len(), "outlier"));
    let rows = table(&confounded::outliers(outliers.iter()));
    html! {
        @if !outliers.is_empty() {
            h3 { "Outliers" }
            (folded_beyond(MAX_LISTED, outliers.len(), &summary, rows))
        }
    }
}

/// Ball-bar figures and diagnosis of each test.
pub fn ball_bar(tests: &[CircularTest]) -> Markup {
    html! {
        p {
            "Terms of ISO 230-4:2022, symbols of the edition of 2005 in brackets. The figures describe the readings without any correction \
             by the fit. Centre and radius are those of the least-squares circle."
        }
        @for test in tests {
            h3 { (circular::heading(test)) }
            @for figures in &circular::tables(test) { (table(figures)) }
            @if !test.not_identifiable.is_empty() { (list(test.not_identifiable.iter().cloned())) }
        }
    }
}
