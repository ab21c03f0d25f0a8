//! Terms of a pointing model, and the residual on the sky.

use abbe::identify::fit::tpoint::PointingTerms;

use super::table::{Cell, Table, cells};

/// The terms with u, and with the sigma that TPOINT prints.
pub fn terms(found: &PointingTerms) -> Table {
    let rows = found.terms.iter().map(|term| {
        let [value, u] = match (term.value_arcsec, term.u_arcsec) {
            (Some(value), Some(u)) => Cell::estimate(value, u),
            _ => [Cell::or_dash(None), Cell::or_dash(None)],
        };
        let sigma = Cell::or_dash(term.sigma_arcsec.map(|sigma| Cell::fixed(sigma, 2)));
        cells![&term.term, value, u, sigma, term.parameters.join(", ")]
    });
    Table::new(["term", ">value, \u{2033}", ">u, \u{2033}", ">sigma of TPOINT, \u{2033}", "parameters"], rows)
        .titled("Terms of TPOINT with standard uncertainty u")
}

/// The residual on the sky, what sigma is, and what is no term.
pub fn statement(found: &PointingTerms) -> String {
    let mut text = format!(
        "Sky rms {:.2}\u{2033}{}, {} stars. TPOINT\u{2019}s sigma takes the \
         sky rms, of both coordinates together, for the standard deviation of each one, so it is about \u{221a}2 u.",
        found.sky_rms_arcsec,
        found
            .population_sd_arcsec
            .map_or(String::new(), |sd| format!(", population standard deviation {sd:.2}\u{2033}")),
        found.stars
    );
    if found.terms.iter().any(|term| term.value_arcsec.is_none()) {
        text.push_str(" A term without a value is not separable from others.");
    }
    if !found.without_term.is_empty() {
        text.push_str(&format!(" No term of TPOINT: {}.", found.without_term.join(", ")));
    }
    text
}
