//! Plots as SVG, in the report and each by itself, and as PNG where the feature `png` is built in.
//!
//! The drawings are written through the same templates as the page. No plotting crate that builds with this workspace has all that is needed at once:
//! a polar type with a magnified deviation about a nominal circle, classes that one style sheet colours on screen, in the dark and on paper, and
//! the data attributes by which the page moves what it has drawn.

pub mod bars;
pub mod chain;
pub mod heat;
pub mod lines;
#[cfg(feature = "png")]
pub mod png;
pub mod polar;
pub mod scale;

use maud::{Markup, PreEscaped, html};

/// Colours and lines of all plots.
pub const STYLE: &str = include_str!("plot.css");

/// A drawing with its words.
#[derive(Clone)]
pub struct Plot {
    /// The file's name, without an ending.
    pub name: String,
    /// What it shows, in a few words.
    pub title: String,
    /// How to read it.
    pub caption: String,
    /// Width and height.
    pub size: [f64; 2],
    /// What is drawn.
    pub inner: Markup,
    /// What the page needs to move it: attributes as JSON; empty for a still drawing.
    pub live: String,
}

impl Plot {
    /// A still drawing.
    pub fn still(
        name: impl Into<String>,
        title: impl Into<String>,
        caption: impl Into<String>,
        size: [f64; 2],
        inner: Markup,
    ) -> Plot {
        Plot {
            name: file_name(&name.into()),
            title: title.into(),
            caption: caption.into(),
            size,
            inner,
            live: String::new(),
        }
    }

    /// As a figure of the page, which brings the style.
    pub fn figure(&self) -> Markup {
        let [width, height] = self.size;
        html! {
            figure style=(format!("--wide:{width}px")) {
                figcaption { b { (self.title) } " " (self.caption) }
                div class="scroll" {
                    svg xmlns="http://www.w3.org/2000/svg" class="plot" viewBox=(format!("0 0 {width} {height}"))
                        role="img" aria-label=(self.title) data-live=[(!self.live.is_empty()).then_some(&self.live)] {
                        (self.inner)
                    }
                }
            }
        }
    }

    /// By itself, on white, with its title above it.
    pub fn svg(&self) -> String {
        let [width, height] = self.size;
        let lines = wrapped(&self.title, ((width - 16.0) / 7.4) as usize);
        let above = 12.0 + 18.0 * lines.len() as f64;
        let all = height + above;
        html! {
            svg xmlns="http://www.w3.org/2000/svg" class="plot" width=(width) height=(all)
                viewBox=(format!("0 {} {width} {all}", -above)) {
                style { (PreEscaped(light_style())) }
                rect class="paper" x="0" y=(-above) width=(width) height=(all) {}
                @for (number, line) in lines.iter().enumerate() {
                    text class="title" x="8" y=(18.0 * (number as f64 + 1.0) - above) { (line) }
                }
                (self.inner)
            }
        }
        .into_string()
    }
}

/// The style with the light colours in place of the variables: programs that draw SVG need not know those.
fn light_style() -> String {
    let mut style = STYLE.to_string();
    for (name, colour) in LIGHT {
        style = style.replace(&format!("var(--{name})"), colour);
    }
    style
}

/// Colours on paper and on a light screen: Okabe and Ito's, which all eyes tell apart.
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

/// The same in the dark.
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

/// A name that every file system takes.
pub fn file_name(text: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || "-_.+".contains(c) {
            c
        } else {
            '-'
        }
    };
    text.chars()
        .map(plain)
        .take(80)
        .collect::<String>()
        .trim_matches('.')
        .to_string()
}

/// Words in lines of at most so many letters; what is longer than a line stays whole.
pub fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
    }
    lines
}

/// A name that is too long for its place, cut.
pub fn cut(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_string();
    }
    let kept: String = text.chars().take(most.saturating_sub(1)).collect();
    format!("{kept}…")
}

/// Entries of a legend, laid out in a row from the left, line after line: width of letters is guessed on the safe side.
pub fn legend(entries: &[(&str, String)], x: f64, y: f64, width: f64) -> (Markup, f64) {
    let mut placed = Vec::new();
    let (mut along, mut down) = (x, y);
    for (class, words) in entries {
        let needed = 26.0 + 7.2 * words.chars().count() as f64;
        if along > x && along + needed > x + width {
            along = x;
            down += 17.0;
        }
        placed.push((along, down, *class, words));
        // A filled key is as wide as the strokes, but looks nearer.
        along += needed + if class.starts_with("key-") { 12.0 } else { 4.0 };
    }
    let markup = html! {
        @for (along, down, class, words) in &placed {
            @if class.starts_with("key-") {
                (key(class, *along + 9.0, *down - 4.0))
            } @else if class.contains("dots") {
                path class=(class) d=(scale::dots([(along + 2.0, down - 4.0), (along + 9.0, down - 4.0), (along + 16.0, down - 4.0)])) {}
            } @else {
                path class=(class) d=(format!("M{along} {}h18", down - 4.0)) {}
            }
            text x=(along + 23.0) y=(down) { (words) }
        }
    };
    (markup, down)
}

/// The signs of start and end.
fn key(class: &str, x: f64, y: f64) -> Markup {
    html! {
        @match class {
            "key-start" => { circle class="start" cx=(x) cy=(y) r="4" {} }
            "key-end" => { rect class="end" x=(x - 3.5) y=(y - 3.5) width="7" height="7" {} }
            other => { rect class=(other) x=(x - 8.0) y=(y - 5.0) width="16" height="10" {} }
        }
    }
}
