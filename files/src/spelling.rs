//! Suggestions for misspelt names.

use strsim::osa_distance;

/// The most similar known name if one is similar, and all of them.
pub(crate) fn known_names(found: &str, known: &[&str]) -> String {
    let all =
        if known.is_empty() { "no key is allowed here".to_string() } else { format!("known: {}", known.join(", ")) };
    match most_similar(found, known) {
        Some(near) => format!("did you mean `{near}`? ({all})"),
        None => all,
    }
}

/// The start of a help text: a suggestion of the most similar known name, or nothing.
pub fn suggestion(found: &str, known: &[impl AsRef<str>]) -> String {
    most_similar(found, known).map_or(String::new(), |near| format!("did you mean `{near}`? "))
}

/// The most similar known name, if any is similar.
pub(crate) fn most_similar<'k>(found: &str, known: &'k [impl AsRef<str>]) -> Option<&'k str> {
    // No name is longer; the limit bounds the cost for very long keys.
    let lower: String = found.chars().take(64).collect::<String>().to_lowercase();
    known
        .iter()
        .map(|name| {
            let name = name.as_ref();
            let other = name.to_lowercase();
            // `c_degree` for `c_deg`: a common prefix counts as one edit.
            let begins = lower.len().min(other.len()) >= 3 && (lower.starts_with(&other) || other.starts_with(&lower));
            (if begins { 1 } else { osa_distance(&lower, &other) }, name)
        })
        .filter(|(distance, name)| *distance <= 1 + name.len().min(lower.len()) / 4)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEYS: [&str; 6] = ["bar_mm", "bar_u_um", "c_deg", "x", "noise_um", "sweep"];

    #[test]
    fn misspelt_names_are_distinguished_from_other_names() {
        // An extra, missing, wrong or transposed letter, or another case, is one edit each.
        for (found, near) in [
            ("barr_mm", "bar_mm"),
            ("bar_m", "bar_mm"),
            ("bat_mm", "bar_mm"),
            ("bra_mm", "bar_mm"),
            ("BAR_MM", "bar_mm"),
            ("bar_u_m", "bar_u_um"),
            ("c_degree", "c_deg"),
            ("noise", "noise_um"),
            ("y", "x"),
        ] {
            assert_eq!(most_similar(found, &KEYS), Some(near), "{found}");
        }
        // Short names allow one edit, longer ones one more per four letters.
        assert_eq!(most_similar("zz", &KEYS), None);
        assert_eq!(most_similar("nosieum", &KEYS), Some("noise_um"));
        assert_eq!(most_similar("noise_abc", &KEYS), Some("noise_um"));
        assert_eq!(most_similar("no1234um", &KEYS), None);
        assert_eq!(most_similar(&"s".repeat(100_000), &KEYS), None);
        assert_eq!(most_similar("sweep", &[""; 0]), None);
    }

    #[test]
    fn the_help_names_what_is_known() {
        assert_eq!(known_names("swep", &["sweep", "path"]), "did you mean `sweep`? (known: sweep, path)");
        assert_eq!(known_names("at", &["sweep", "path"]), "known: sweep, path");
        assert_eq!(known_names("at", &[]), "no key is allowed here");
        assert_eq!(suggestion("swep", &["sweep"]), "did you mean `sweep`? ");
        assert_eq!(suggestion("at", &["sweep"]), "");
    }
}
