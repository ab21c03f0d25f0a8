//! Patterns for several errors: `E?0C` for the six location errors of C, `E?0J*` for those of all joints.
//!
//! `?` matches one character, `*` any number of characters, including none. A pattern is compared with the names of ISO
//! 230-1 (`EX0C`) and of the literature (`e_x0c`).

use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::component::{ErrorKind, ErrorName, Freedom};

/// Whether a text is a pattern: it contains `?` or `*`.
#[must_use]
pub fn is_pattern(text: &str) -> bool {
    text.contains(['?', '*'])
}

/// Whether a name matches a pattern.
///
/// ```
/// use abbe_model::pattern::matches;
///
/// assert!(matches("E?0J*", "EX0J12") && matches("E*C", "EX0C") && matches("*", ""));
/// assert!(!matches("E?0C", "EXC") && !matches("E?C", "EX0C"));
/// ```
#[must_use]
pub fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    let (mut p, mut n) = (0, 0);
    // The last `*`, and the first character of the name after its match.
    let mut star: Option<(usize, usize)> = None;
    while n < name.len() {
        match pattern.get(p) {
            Some('*') => {
                star = Some((p, n));
                p += 1;
            }
            Some(c) if *c == '?' || *c == name[n] => {
                p += 1;
                n += 1;
            }
            _ => match &mut star {
                // Extend the match of `*` by one character.
                Some((star, taken)) => {
                    *taken += 1;
                    (p, n) = (*star + 1, *taken);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

/// Every location error and error motion that the chain applies. The order is by axis of the chain, location errors
/// first, each in the order X, Y, Z, A, B, C. A linear axis has no position errors.
#[must_use]
pub fn errors(machine: &Machine) -> Vec<ErrorName> {
    let mut errors = Vec::new();
    for axis in &machine.axes {
        for kind in [ErrorKind::Location, ErrorKind::Motion] {
            for freedom in Freedom::ALL {
                if kind == ErrorKind::Motion || axis.kind == AxisKind::Rotary || freedom.is_angle() {
                    errors.push(ErrorName { kind, freedom, axis: axis.name.clone() });
                }
            }
        }
    }
    errors
}

/// The errors of the machine whose names match a pattern, in the order of [`errors`].
#[must_use]
pub fn matching(machine: &Machine, pattern: &str) -> Vec<ErrorName> {
    let mut errors = errors(machine);
    errors.retain(|name| matches(pattern, &name.to_string()) || matches(pattern, &name.literature()));
    errors
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Matches by the definition of `?` and `*`.
    fn by_definition(pattern: &[char], name: &[char]) -> bool {
        match (pattern.split_first(), name.split_first()) {
            (None, None) => true,
            (None, Some(_)) => false,
            (Some(('*', rest)), _) => (0..=name.len()).any(|taken| by_definition(rest, &name[taken..])),
            (Some((c, rest)), Some((first, after))) => (*c == '?' || c == first) && by_definition(rest, after),
            (Some(_), None) => false,
        }
    }

    fn texts(letters: &[char], longest: usize) -> Vec<Vec<char>> {
        let mut all = vec![Vec::new()];
        let mut last = all.clone();
        for _ in 0..longest {
            last = last
                .iter()
                .flat_map(|text: &Vec<char>| letters.iter().map(move |letter| [&text[..], &[*letter]].concat()))
                .collect();
            all.extend(last.clone());
        }
        all
    }

    #[test]
    fn all_short_patterns_match_as_defined() {
        for pattern in texts(&['a', 'b', '?', '*'], 5) {
            for name in texts(&['a', 'b'], 4) {
                let text = |letters: &[char]| letters.iter().collect::<String>();
                assert_eq!(
                    matches(&text(&pattern), &text(&name)),
                    by_definition(&pattern, &name),
                    "{pattern:?} {name:?}"
                );
            }
        }
    }

    #[test]
    fn many_stars_take_bounded_time() {
        assert!(!matches(&"*a".repeat(2000), &"a".repeat(1999)));
    }
}
