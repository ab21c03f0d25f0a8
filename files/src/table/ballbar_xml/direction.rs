//! Direction of rotation of the runs of a ball-bar file.

use super::contents::Run;

const CLOCKWISE: [&str; 3] = ["CW", "CLOCKWISE", "CLOCK_WISE"];
const ANTICLOCKWISE: [&str; 6] =
    ["CCW", "ACW", "ANTICLOCKWISE", "COUNTERCLOCKWISE", "ANTI_CLOCKWISE", "COUNTER_CLOCKWISE"];
const KNOWN: &str = "known words are CW, CCW, CLOCKWISE, ANTICLOCKWISE, COUNTERCLOCKWISE; for others use \
                     `[format] anticlockwise = \"…\"`, the word for the direction from the first axis of the plane towards the second";

/// Whether each run goes from the first axis of the plane towards the second. If that is unknown, the error is a line,
/// a message and what to do.
///
/// Known words keep their meaning whatever is stated, except that a stated clockwise word reverses them. Of other
/// words, the stated one means forward and one other backward. Case is ignored; `1`, `true` and `yes` are one value,
/// and so are `0`, `false` and `no`.
pub(super) fn of_runs(runs: &[Run], stated: Option<&str>) -> Result<Vec<bool>, (usize, String, String)> {
    // Seen from below, the direction from the first axis to the second is clockwise, and a file may call it so.
    let turned = stated.and_then(known_meaning) == Some(false);
    let stated = stated.map(normalised);
    let mut other: Option<String> = None;
    runs.iter()
        .map(|run| {
            let fault = |message: String| Err((run.line, message, KNOWN.to_string()));
            let Some(direction) = &run.direction else {
                return fault("READINGS without a RUN_DIRECTION".into());
            };
            if let Some(anticlockwise) = known_meaning(direction) {
                return Ok(anticlockwise != turned);
            }
            let word = normalised(direction);
            match &stated {
                Some(stated) if *stated == word => Ok(true),
                Some(_) if other.get_or_insert_with(|| word.clone()) == &word => Ok(false),
                Some(_) => fault(format!(
                    "RUN_DIRECTION is `{direction}`: neither the word stated by `anticlockwise`, nor `{}`, the other word in this file",
                    other.as_deref().unwrap_or("")
                )),
                None => fault(format!("RUN_DIRECTION is `{direction}`, which is not known")),
            }
        })
        .collect()
}

/// The meaning of a known word: whether it is anticlockwise.
fn known_meaning(word: &str) -> Option<bool> {
    let word = word.trim().to_uppercase().replace([' ', '-'], "_");
    if ANTICLOCKWISE.contains(&word.as_str()) {
        Some(true)
    } else if CLOCKWISE.contains(&word.as_str()) {
        Some(false)
    } else {
        None
    }
}

/// The word in normalised form.
fn normalised(word: &str) -> String {
    let word = word.trim().to_uppercase();
    match word.as_str() {
        "TRUE" | "YES" => "1".into(),
        "FALSE" | "NO" => "0".into(),
        _ => word,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(directions: &[&str], stated: Option<&str>) -> Result<Vec<bool>, String> {
        let runs: Vec<Run> = directions
            .iter()
            .map(|direction| Run { line: 1, direction: Some(direction.to_string()), text: String::new() })
            .collect();
        of_runs(&runs, stated).map_err(|(_, message, _)| message)
    }

    #[test]
    fn known_words_keep_their_meaning_whatever_is_stated() {
        for stated in [None, Some("0"), Some("true"), Some("CCW"), Some("ccw"), Some("anti-clockwise")] {
            for words in [["CCW", "CW"], ["ccw", "cw"], ["Counter-Clockwise", "clockwise"]] {
                assert_eq!(of(&words, stated), Ok(vec![true, false]), "{words:?} {stated:?}");
            }
        }
        assert_eq!(of(&["CW", "CCW"], Some("cw")), Ok(vec![true, false]));
    }

    #[test]
    fn the_stated_word_means_forward_and_one_other_backward() {
        assert_eq!(of(&["0", "1", "0"], Some("0")), Ok(vec![true, false, true]));
        assert_eq!(of(&["FALSE", "True"], Some("0")), Ok(vec![true, false]));
        assert_eq!(of(&["0", "1"], Some("true")), Ok(vec![false, true]));
        assert_eq!(of(&["Links", "rechts"], Some("links")), Ok(vec![true, false]));
        assert!(of(&["0"], None).unwrap_err().contains("`0`, which is not known"));
        let third = of(&["0", "1", "2"], Some("0")).unwrap_err();
        assert!(third.contains("`2`") && third.contains("`1`"), "{third}");
    }
}
