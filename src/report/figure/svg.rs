//! Figures as SVG: inside the report, and as separate files.
//!
//! The drawings use the same templates as the page. Plotting crates lack three things that the reports need: a polar
//! plot with a magnified deviation about a nominal circle, CSS classes that one style sheet colours for light screens,
//! dark screens and print, and data attributes for the script of the page.

use maud::{Markup, PreEscaped, html};

use super::{Figure, scale};

/// Width of a drawing with straight axes, in SVG units. Two such drawings stand beside one another at 1,280 px, and one
/// fills a narrow screen with legible text.
pub const WIDTH: f64 = 500.0;

/// Style sheet of all drawings.
pub const STYLE: &str = include_str!("plot.css");

/// The drawing of a chart.
pub struct Drawing {
    /// Width and height, SVG units.
    pub size: [f64; 2],
    /// Contents of the `svg` element.
    pub inner: Markup,
    /// Data for the script of the page, as JSON. `None` for a static drawing.
    pub interaction: Option<String>,
}

impl Drawing {
    /// A static drawing.
    pub fn new(size: [f64; 2], inner: Markup) -> Drawing {
        Drawing { size, inner, interaction: None }
    }
}

/// The `figure` element with its width. The page contains the style sheet.
pub fn element(figure: &Figure) -> (f64, Markup) {
    let Drawing { size: [width, height], inner, interaction } = figure.kind().drawing();
    let markup = html! {
        figure class=[(width >= WIDTH).then_some("wide")] style=(format!("--width:{width}")) {
            figcaption { b { (figure.title) } " " (figure.caption) }
            svg xmlns="http://www.w3.org/2000/svg" class="plot" viewBox=(format!("0 0 {width} {height}"))
                role="img" aria-label=(figure.alternative()) data-interaction=[interaction] {
                (inner)
            }
        }
    };
    (width, markup)
}

/// A separate SVG file on a white background, with the title above the drawing.
pub fn file(figure: &Figure) -> String {
    let width = figure.kind().drawing().size[0];
    document(figure, &wrapped(&figure.title, ((width - 16.0) / 7.4) as usize))
}

/// A separate SVG file without a title, for documents with captions.
pub fn untitled(figure: &Figure) -> String {
    document(figure, &[])
}

fn document(figure: &Figure, title: &[String]) -> String {
    let Drawing { size: [width, height], inner, .. } = figure.kind().drawing();
    let above = if title.is_empty() { 0.0 } else { 12.0 + 18.0 * title.len() as f64 };
    let all = height + above;
    html! {
        svg xmlns="http://www.w3.org/2000/svg" class="plot" width=(width) height=(all)
            viewBox=(format!("0 {} {width} {all}", 0.0 - above)) {
            style { (PreEscaped(light_style())) }
            rect class="paper" x="0" y=(0.0 - above) width=(width) height=(all) {}
            @for (number, line) in title.iter().enumerate() {
                text class="title" x="8" y=(18.0 * (number as f64 + 1.0) - above) { (line) }
            }
            (inner)
        }
    }
    .into_string()
}

/// Replaces CSS variables by the light colours, because many SVG programs do not support variables.
pub(super) fn light_style() -> String {
    let mut style = STYLE.to_string();
    for (name, colour) in LIGHT {
        style = style.replace(&format!("var(--{name})"), colour);
    }
    style
}

/// Colours for print and light screens: the palette of Okabe and Ito, suited to colour-blind readers.
pub const LIGHT: [(&str, &str); 12] = [
    ("paper", "#ffffff"),
    ("ink", "#1b1b1b"),
    ("soft", "#595959"),
    ("grid", "#d5d5d5"),
    ("forward", "#0072b2"),
    ("backward", "#d55e00"),
    ("before", "#d55e00"),
    ("after", "#0072b2"),
    ("mark", "#007a5a"),
    ("other", "#b4b4b4"),
    ("third", "#aa4499"),
    ("fourth", "#8a6d00"),
];

/// Colours for dark screens.
pub const DARK: [(&str, &str); 12] = [
    ("paper", "#16181b"),
    ("ink", "#ececec"),
    ("soft", "#b0b0b0"),
    ("grid", "#3d4147"),
    ("forward", "#56b4e9"),
    ("backward", "#ff9142"),
    ("before", "#ff9142"),
    ("after", "#56b4e9"),
    ("mark", "#2fc79a"),
    ("other", "#6a6f76"),
    ("third", "#e59ad2"),
    ("fourth", "#f0e442"),
];

/// Wraps text into lines of at most `max` characters. A longer word stays whole.
pub fn wrapped(text: &str, max: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= max => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
    }
    lines
}

/// Shortens text to at most `max` characters, with an ellipsis.
pub fn shortened(text: &str, max: usize) -> String {
    if text.chars().count() <= max {
        return text.to_string();
    }
    let kept: String = text.chars().take(max.saturating_sub(1)).collect();
    format!("{kept}…")
}

/// Greatest width of a letter of a drawing, SVG units: widths of text are estimated generously.
const LETTER: f64 = 7.8;
/// Height of a letter above its line.
const ASCENT: f64 = 11.0;

/// Where a label beside a point starts, so that all of it is within a drawing of this size.
pub fn label_place((x, y): (f64, f64), text: &str, [width, height]: [f64; 2]) -> (f64, f64) {
    let last = width - LETTER * text.chars().count() as f64;
    (x.min(last).max(0.0), y.min(height).max(ASCENT))
}

/// Draws a legend from the left, in as many lines as needed. Returns it with the ordinate of its last line. Text widths
/// are estimated generously.
pub fn legend<S: AsRef<str>>(entries: &[(S, String)], x: f64, y: f64, width: f64) -> (Markup, f64) {
    let mut placed = Vec::new();
    let (mut left, mut baseline) = (x, y);
    for (class, label) in entries {
        let class = class.as_ref();
        let needed = 26.0 + LETTER * label.chars().count() as f64;
        if left > x && left + needed > x + width {
            left = x;
            baseline += 17.0;
        }
        placed.push((left, baseline, class, label));
        // A filled key needs more space after it than a line.
        left += needed + if class.starts_with("key-") { 12.0 } else { 4.0 };
    }
    let markup = html! {
        @for (left, baseline, class, label) in &placed {
            @if class.starts_with("key-") {
                (key(class, *left + 9.0, *baseline - 4.0))
            } @else if class.contains("dots") {
                path class=(class) d=(scale::dots([2.0, 9.0, 16.0].map(|x| (left + x, baseline - 4.0)))) {}
            } @else {
                path class=(class) d=(format!("M{left} {}h18", baseline - 4.0)) {}
            }
            text x=(left + 23.0) y=(baseline) { (label) }
        }
    };
    (markup, baseline)
}

/// A filled key of a legend: the symbols of start and end, or the fill of a bar.
fn key(class: &str, x: f64, y: f64) -> Markup {
    html! {
        @match class {
            "key-start" => { circle class="start" cx=(x) cy=(y) r="4" {} }
            "key-end" => { rect class="end" x=(x - 3.5) y=(y - 3.5) width="7" height="7" {} }
            other => { rect class=(other) x=(x - 8.0) y=(y - 5.0) width="16" height="10" {} }
        }
    }
}
