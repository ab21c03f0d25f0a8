//! Figures as SVG: inside the report, and as separate files.
//!
//! The drawings use the same templates as the page. Plotting crates lack three things that the reports need: a polar
//! plot with a magnified deviation about a nominal circle, CSS classes that one style sheet colours for light screens,
//! dark screens and print, and data attributes for the script of the page.

use maud::{Markup, PreEscaped, html};

use super::Figure;
use super::drawing::{Drawing, Element, Place, Shape, WIDTH, wrapped};

/// Style sheet of all drawings.
pub const STYLE: &str = include_str!("plot.css");

/// The `figure` element with its width. The page contains the style sheet.
pub fn element(figure: &Figure) -> (f64, Markup) {
    let Drawing { size: [width, height], elements, interaction } = &figure.chart.drawing;
    let markup = html! {
        figure class=[(*width >= WIDTH).then_some("wide")] style=(format!("--width:{width}")) {
            figcaption { b { (figure.title) } " " (figure.caption) }
            svg xmlns="http://www.w3.org/2000/svg" class="plot" viewBox=(format!("0 0 {width} {height}"))
                role="img" aria-label=(figure.alternative()) data-interaction=[interaction] {
                @for one in elements { (printed(one)) }
            }
        }
    };
    (*width, markup)
}

/// A separate SVG file on a white background, with the title above the drawing.
pub fn file(figure: &Figure) -> String {
    let width = figure.chart.drawing.size[0];
    document(figure, &wrapped(&figure.title, ((width - 16.0) / 7.4) as usize))
}

/// A separate SVG file without a title, for documents with captions.
pub fn untitled(figure: &Figure) -> String {
    document(figure, &[])
}

fn document(figure: &Figure, title: &[String]) -> String {
    let Drawing { size: [width, height], elements, .. } = &figure.chart.drawing;
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
            @for one in elements { (printed(one)) }
        }
    }
    .into_string()
}

/// An element with its title and what the script of the page reads.
fn printed(element: &Element) -> Markup {
    let class = Some(&element.class).filter(|class| !class.is_empty());
    let (run, column) = element.source.unzip();
    let title = html! { @if !element.title.is_empty() { title { (element.title) } } };
    let number = coordinate;
    match &element.shape {
        Shape::Lines(lines) => html! {
            path class=[class] data-run=[run] data-column=[column] d=(path(lines)) { (title) }
        },
        Shape::Rectangle((x, y), [width, height], radius) => html! {
            rect class=[class] data-run=[run] x=(number(*x)) y=(number(*y)) width=(number(*width))
                height=(number(*height)) rx=[(*radius > 0.0).then_some(radius)] { (title) }
        },
        Shape::Circle((x, y), radius) => html! {
            circle class=[class] data-run=[run] cx=(number(*x)) cy=(number(*y)) r=(number(*radius)) { (title) }
        },
        Shape::Text { at: (x, y), words, upwards, size } => {
            let style = size.map(|size| format!("font-size:{}px", number(size)));
            let turned = upwards.then(|| format!("translate({} {}) rotate(-90)", number(*x), number(*y)));
            let [x, y] = [x, y].map(|place| (!upwards).then(|| number(*place)));
            html! { text class=[class] style=[style] x=[x] y=[y] transform=[turned] { (title) (words) } }
        }
        Shape::Group((x, y), elements) => {
            let moved = (*x != 0.0 || *y != 0.0).then(|| format!("translate({x} {y})"));
            html! { g transform=[moved] { (title) @for one in elements { (printed(one)) } } }
        }
    }
}

/// A coordinate to a tenth of a pixel, without negative zero.
fn coordinate(value: f64) -> String {
    let rounded = (value * 10.0).round() / 10.0;
    if rounded == 0.0 { "0".to_string() } else { format!("{rounded}") }
}

/// The path of lines; of a dot, a stroke of zero length with a round cap.
fn path(lines: &[Vec<Place>]) -> String {
    let mut path = String::new();
    for line in lines {
        for (number, (x, y)) in line.iter().enumerate() {
            path.push(if number == 0 { 'M' } else { 'L' });
            path.push_str(&coordinate(*x));
            path.push(' ');
            path.push_str(&coordinate(*y));
        }
        if line.len() == 1 {
            path.push_str("h0");
        }
    }
    path
}

/// Replaces CSS variables by the light colours, because many SVG programs do not support variables.
pub(super) fn light_style() -> String {
    let mut style = STYLE.to_string();
    for (name, light, _) in COLOURS {
        style = style.replace(&format!("var(--{name})"), light);
    }
    style
}

/// Colours by name, for print and light screens, and for dark screens: the palette of Okabe and Ito, suited to colour-blind
/// readers.
const COLOURS: [(&str, &str, &str); 12] = [
    ("paper", "#ffffff", "#16181b"),
    ("ink", "#1b1b1b", "#ececec"),
    ("soft", "#595959", "#b0b0b0"),
    ("grid", "#d5d5d5", "#3d4147"),
    ("forward", "#0072b2", "#56b4e9"),
    ("backward", "#d55e00", "#ff9142"),
    ("before", "#d55e00", "#ff9142"),
    ("after", "#0072b2", "#56b4e9"),
    ("mark", "#007a5a", "#2fc79a"),
    ("other", "#b4b4b4", "#6a6f76"),
    ("third", "#aa4499", "#e59ad2"),
    ("fourth", "#8a6d00", "#f0e442"),
];

/// The colours as variables of a style sheet, of a dark screen or else of a light one and of print.
pub fn variables(is_dark: bool) -> String {
    COLOURS.iter().map(|(name, light, dark)| format!("--{name}:{};", if is_dark { dark } else { light })).collect()
}
