//! Words of messages: counts and lists, and excerpts of the input that a message quotes.

use std::borrow::Cow;
use std::ops::Range;

/// The first names of a list, and the number of the others: of `what`, or of none in particular.
///
/// ```
/// use abbe_model::words::first_of;
///
/// assert_eq!(first_of(&["A", "B", "C"], 3, ", ", "error"), "A, B, C");
/// assert_eq!(first_of(&["A", "B", "C"], 2, ", ", "further error"), "A, B and 1 further error");
/// assert_eq!(first_of(&["A", "B", "C"], 1, "; ", ""), "A; and 2 more");
/// ```
#[must_use]
pub fn first_of(names: &[impl AsRef<str>], most: usize, between: &str, what: &str) -> String {
    let shown: Vec<&str> = names.iter().take(most).map(AsRef::as_ref).collect();
    let and = if between == ", " { " and " } else { "; and " };
    shown.join(between)
        + &match (names.len().saturating_sub(most), what) {
            (0, _) => String::new(),
            (others, "") => format!("{and}{others} more"),
            (others, what) => format!("{and}{}", counted(others, what)),
        }
}

/// A noun with its article: `a laser`, `an angle`.
pub fn with_article(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {noun}")
}

/// A count with its noun, singular or plural.
///
/// ```
/// use abbe_model::words::counted;
///
/// assert_eq!(counted(1, "effect"), "1 effect");
/// assert_eq!(counted(0, "effect"), "0 effects");
/// assert_eq!(counted(2, "boundary"), "2 boundaries");
/// assert_eq!(counted(3, "set-up"), "3 set-ups");
/// assert_eq!(counted(1, "degree of freedom"), "1 degree of freedom");
/// assert_eq!(counted(7, "degree of freedom"), "7 degrees of freedom");
/// ```
#[must_use]
pub fn counted(count: impl TryInto<u64> + std::fmt::Display + Copy, thing: &str) -> String {
    if matches!(count.try_into(), Ok(1)) {
        return format!("{count} {thing}");
    }
    let (noun, rest) = match thing.find(" of ") {
        Some(place) => thing.split_at(place),
        None => (thing, ""),
    };
    let plural = match noun.strip_suffix('y') {
        Some(stem) if !stem.ends_with(['a', 'e', 'o']) => format!("{stem}ies"),
        _ => format!("{noun}s"),
    };
    format!("{count} {plural}{rest}")
}

/// `a, b and c`.
pub fn listed(words: &[impl AsRef<str>], joint: &str) -> String {
    let words: Vec<&str> = words.iter().map(AsRef::as_ref).collect();
    match words.split_last() {
        Some((last, [_, ..])) => format!("{} {joint} {last}", words[..words.len() - 1].join(", ")),
        _ => words.concat(),
    }
}

/// A number in a message: seven digits at most, and an exponent where a number without one would be long.
///
/// ```
/// use abbe_model::words::number;
///
/// assert_eq!(number(0.1 + 0.2), "0.3");
/// assert_eq!(number(149.9946), "149.9946");
/// assert_eq!(number(-1e300), "-1e300");
/// assert_eq!(number(2.5e-7), "2.5e-7");
/// ```
#[must_use]
pub fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    if rounded == 0.0 || !rounded.is_finite() || (1e-4..1e7).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// A small number with an exponent and so many decimal places; zero is `0`.
///
/// ```
/// use abbe_model::words::with_exponent;
///
/// assert_eq!(with_exponent(2.14e-13, 0), "2e-13");
/// assert_eq!(with_exponent(0.0, 1), "0");
/// ```
#[must_use]
pub fn with_exponent(value: f64, places: usize) -> String {
    if value == 0.0 { "0".to_string() } else { format!("{value:.places$e}") }
}

/// Largest number of characters of input that a message quotes.
pub const MAX_QUOTED: usize = 80;
/// Longest name of a file on common file systems, bytes.
const MAX_FILE_NAME: usize = 255;
/// Longest path on common systems, bytes.
const MAX_PATH: usize = 4096;
/// Largest size of a message, bytes.
const MAX_MESSAGE: usize = 8000;

/// A text of at most `width` characters around a place in it, with an ellipsis for what is left out, and the place in
/// it. The place is in bytes, at the limits of characters. A longer place keeps its beginning.
///
/// ```
/// use abbe_model::words::around;
///
/// let (shown, place) = around("bar_mm = 100", 9..12, 80);
/// assert_eq!((shown.as_str(), &shown[place]), ("bar_mm = 100", "100"));
/// let (shown, place) = around("0000000000 here 1111111111", 11..15, 10);
/// assert_eq!((shown.as_str(), &shown[place]), ("…0 here 1…", "here"));
/// ```
#[must_use]
pub fn around(text: &str, place: Range<usize>, width: usize) -> (String, Range<usize>) {
    let starts: Vec<usize> = text.char_indices().map(|(start, _)| start).chain([text.len()]).collect();
    let count = starts.len() - 1;
    let start = starts.partition_point(|at| *at < place.start).min(count);
    let end = starts.partition_point(|at| *at < place.end).clamp(start, count);
    if count <= width {
        return (text.to_string(), starts[start]..starts[end]);
    }
    // One sign on each side is for the ellipses.
    let room = width.saturating_sub(2).max(1);
    let from = start.saturating_sub(room.saturating_sub(end - start) / 2).min(count - room.min(count));
    // At an end of the text there is no ellipsis, and a sign more.
    let (from, to) = match from {
        0 | 1 => (0, room + 1),
        _ if from + room == count => (from - 1, count),
        _ => (from, from + room),
    };
    let mut shown = String::from(if from > 0 { "…" } else { "" });
    let moved = |at: usize, lead: usize| lead + starts[at.clamp(from, to)] - starts[from];
    let place = moved(start, shown.len())..moved(end, shown.len());
    shown.push_str(&text[starts[from]..starts[to]]);
    shown.push_str(if to < count { "…" } else { "" });
    (shown, place)
}

/// The first characters of a text, at most `width` with the ellipsis for the rest.
///
/// ```
/// use abbe_model::words::cut;
///
/// assert_eq!(cut("EX0C", 4), "EX0C");
/// assert_eq!(cut("EX0C, EY0C", 5), "EX0C…");
/// ```
#[must_use]
pub fn cut(text: &str, width: usize) -> Cow<'_, str> {
    // Most texts are short: their bytes are no more than that.
    if text.len() <= width || text.chars().nth(width).is_none() {
        return Cow::Borrowed(text);
    }
    Cow::Owned(around(text, 0..0, width).0)
}

/// A message whose quotations of input, names in `` ` `` or `"` and long words, are cut to [`MAX_QUOTED`] characters.
/// Paths that can exist and lines of commands stay whole.
///
/// ```
/// use abbe_model::words::shortened;
///
/// assert_eq!(shortened("the unknown key `bar`"), "the unknown key `bar`");
/// let long = format!("the unknown key `{}`; known: bar_mm", "k".repeat(70_000));
/// assert_eq!(shortened(&long), format!("the unknown key `{}…`; known: bar_mm", "k".repeat(79)));
/// ```
#[must_use]
pub fn shortened(message: &str) -> Cow<'_, str> {
    if message.len() <= MAX_QUOTED {
        return Cow::Borrowed(message);
    }
    let shown = quotations(message, &['`', '"']);
    if shown.len() > MAX_MESSAGE {
        return Cow::Owned(cut(&shown, MAX_MESSAGE / 4).into_owned());
    }
    if shown == message { Cow::Borrowed(message) } else { Cow::Owned(shown) }
}

/// Cuts what stands between two of the first of these signs, and looks for the other signs outside.
fn quotations(text: &str, signs: &[char]) -> String {
    let Some((sign, others)) = signs.split_first() else {
        return words(text);
    };
    let parts: Vec<&str> = text.split(*sign).collect();
    let last = parts.len() - 1;
    let mut shown = String::with_capacity(text.len().min(MAX_MESSAGE));
    for (number, part) in parts.into_iter().enumerate() {
        if number > 0 {
            shown.push(*sign);
        }
        // The last sign may have no partner.
        if number % 2 == 1 && number < last {
            let is_whole = (part.starts_with("abbe ") || part.contains(std::path::is_separator)) && is_place(part);
            shown.push_str(&if is_whole { Cow::Borrowed(part) } else { cut(part, MAX_QUOTED) });
        } else {
            shown.push_str(&quotations(part, others));
        }
    }
    shown
}

/// Cuts words that are longer than any name of a file.
fn words(text: &str) -> String {
    let word = |word| if is_place(word) { Cow::Borrowed(word) } else { cut(word, MAX_QUOTED) };
    text.split_inclusive(char::is_whitespace)
        .map(|part| match part.strip_suffix(char::is_whitespace) {
            Some(stem) => word(stem) + &part[stem.len()..],
            None => word(part),
        })
        .collect()
}

/// Whether a text can be the path of a file.
fn is_place(text: &str) -> bool {
    text.len() <= MAX_PATH && text.split(std::path::is_separator).all(|name| name.len() <= MAX_FILE_NAME)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_is_shown_wherever_it_is() {
        let text: String = ('a'..='z').chain('α'..='ω').cycle().take(500).collect();
        let starts: Vec<usize> = text.char_indices().map(|(start, _)| start).collect();
        for width in [3, 10, 80] {
            for k in 0..500 {
                let end = starts.get(k + 1).copied().unwrap_or(text.len());
                let (shown, place) = around(&text, starts[k]..end, width);
                assert_eq!(shown[place], text[starts[k]..end]);
                assert_eq!(shown.chars().count(), width, "{shown}");
                assert_ne!(shown.starts_with('…'), text.starts_with(shown.trim_end_matches('…')), "{k}: {shown}");
            }
        }
        // A place that is longer than the excerpt keeps its beginning.
        let (shown, place) = around(&text, starts[100]..starts[300], 12);
        assert_eq!(shown[place], text[starts[100]..starts[110]]);
    }

    #[test]
    fn a_message_keeps_what_is_no_quotation() {
        let name = "n".repeat(100_000);
        let cut_name = format!("{}…", "n".repeat(79));
        for (given, shown) in [
            ("short".to_string(), "short".to_string()),
            (
                format!("test \"{name}\": `{name}` is no number"),
                format!("test \"{cut_name}\": `{cut_name}` is no number"),
            ),
            (format!("{name}: cannot be read"), format!("{}…: cannot be read", "n".repeat(79)).replace("…:", "…")),
            (format!("a ` alone, {}", "word ".repeat(30)), format!("a ` alone, {}", "word ".repeat(30))),
            (format!("see `{}`", "folder/".repeat(30)), format!("see `{}`", "folder/".repeat(30))),
            (format!("see {}file", "folder/".repeat(30)), format!("see {}file", "folder/".repeat(30))),
            (format!("`{}` fails", "a b ".repeat(50)), format!("`{}…` fails", &"a b ".repeat(50)[..79])),
        ] {
            assert_eq!(shortened(&given), shown);
        }
        for hostile in ["` a ", "`", "\"", "a/", "\" x `y ", "word "] {
            assert!(shortened(&hostile.repeat(100_000)).len() <= MAX_MESSAGE, "{hostile}");
        }
    }
}
