//! The name that may be meant by a misspelt one.

/// The nearest of the known names where one is near, and all of them.
pub(crate) fn known_names(found: &str, known: &[&str]) -> String {
    let all = if known.is_empty() {
        "no key is known here".to_string()
    } else {
        format!("known: {}", known.join(", "))
    };
    match nearest(found, known) {
        Some(near) => format!("did you mean `{near}`? ({all})"),
        None => all,
    }
}

/// The known name that is nearest to a misspelt one, if any is near.
pub(crate) fn nearest<'k>(found: &str, known: &[&'k str]) -> Option<&'k str> {
    let lower = found.to_lowercase();
    known
        .iter()
        .map(|name| {
            let other = name.to_lowercase();
            // `c_degree` for `c_deg`: what begins alike and goes on counts as one slip.
            let begins =
                lower.len().min(other.len()) >= 3 && (lower.starts_with(&other) || other.starts_with(&lower));
            (if begins { 1 } else { distance(&lower, &other) }, *name)
        })
        .filter(|(distance, name)| *distance <= 1 + name.len().min(lower.len()) / 4)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

/// Levenshtein's distance, over the first 64 characters.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(64).collect(), b.chars().take(64).collect());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}
