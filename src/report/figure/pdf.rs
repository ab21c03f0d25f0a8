//! Figures as PDF for LaTeX: the drawing without a title, as vector paths on a page of its size.
//!
//! Text is drawn as outlines of the bundled fonts, so that no font has to be embedded and every computer draws the same
//! page (ISO 32000-1, 8.5). Colours and widths are those of the style sheet of all drawings.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use ttf_parser::{Face, OutlineBuilder};

use super::Figure;
use super::drawing::{Drawing, Element, Place, Shape};
use super::svg;

/// Points per SVG unit: CSS defines 96 units per inch.
const POINTS_PER_UNIT: f64 = 0.75;
/// Ratio of control length and radius of a quarter circle as a cubic curve.
const QUARTER: f64 = 0.552_284_75;

/// A figure as PDF.
///
/// # Errors
/// If a bundled font cannot be read, which is a fault of the program.
pub fn file(figure: &Figure) -> Result<Vec<u8>, String> {
    let Drawing { size, elements, .. } = &figure.chart.drawing;
    let [width, height] = size.map(|units| units * POINTS_PER_UNIT);
    // SVG counts downwards.
    let mut page = Page {
        sheet: rules(),
        fonts: fonts()?,
        operators: format!("{POINTS_PER_UNIT} 0 0 -{POINTS_PER_UNIT} 0 {height} cm\n"),
    };
    elements.iter().for_each(|element| page.draw(element));
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    let compressed = encoder.write_all(page.operators.as_bytes()).and_then(|()| encoder.finish());
    let compressed = compressed.map_err(|error| error.to_string())?;
    let page = format!("<</Type/Page/Parent 2 0 R/MediaBox[0 0 {width} {height}]/Resources<<>>/Contents 4 0 R>>");
    let stream = format!("<</Length {}/Filter/FlateDecode>>\nstream\n", compressed.len());
    let stream = [stream.as_bytes(), &compressed, b"\nendstream"].concat();
    Ok(document(&[
        b"<</Type/Catalog/Pages 2 0 R>>".to_vec(),
        b"<</Type/Pages/Kids[3 0 R]/Count 1>>".to_vec(),
        page.into_bytes(),
        stream,
    ]))
}

/// A document of these objects, the first of which is the catalogue, with its table of offsets.
fn document(objects: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = b"%PDF-1.4\n".to_vec();
    let mut offsets = Vec::new();
    for (number, object) in objects.iter().enumerate() {
        offsets.push(bytes.len());
        bytes.extend(format!("{} 0 obj\n", number + 1).into_bytes());
        bytes.extend(object);
        bytes.extend(b"\nendobj\n");
    }
    let start = bytes.len();
    let rows: String = offsets.iter().map(|offset| format!("{offset:010} 00000 n \n")).collect();
    let count = objects.len() + 1;
    let table = format!(
        "xref\n0 {count}\n0000000000 65535 f \n{rows}trailer\n<</Size {count}/Root 1 0 R>>\nstartxref\n{start}\n%%EOF\n"
    );
    bytes.extend(table.into_bytes());
    bytes
}

/// The operators of a page.
struct Page {
    sheet: Vec<Rule>,
    fonts: Vec<Face<'static>>,
    operators: String,
}

impl Page {
    /// Adds an element.
    fn draw(&mut self, element: &Element) {
        let (name, outline) = match &element.shape {
            Shape::Group((x, y), elements) => {
                self.add(format_args!("q\n1 0 0 1 {x} {y} cm\n"));
                elements.iter().for_each(|one| self.draw(one));
                return self.operators.push_str("Q\n");
            }
            Shape::Text { at: (x, y), words, upwards, size } => {
                let style = self.style("text", &element.class);
                let size = size.unwrap_or_else(|| style.font_size());
                self.add(format_args!("q\n1 0 0 1 {x:.3} {y:.3} cm\n"));
                self.operators.push_str(if *upwards { "0 -1 1 0 0 0 cm\n" } else { "" });
                let outlines = outlines(&self.fonts, words, size, style.anchor());
                self.add(format_args!("{}{outlines}Q\n", paint(style.fill().unwrap_or_default(), "rg")));
                return;
            }
            Shape::Lines(lines) => ("path", lines.iter().map(|line| path(line)).collect()),
            Shape::Rectangle(corner, size, radius) => ("rect", rectangle(*corner, *size, *radius)),
            Shape::Circle((x, y), r) => ("circle", rectangle((x - r, y - r), [2.0 * r; 2], *r)),
        };
        let style = self.style(name, &element.class);
        let fill = style.fill().map(|colour| paint(colour, "rg"));
        let stroke = style.stroke().map(|colour| paint(colour, "RG") + &style.pen());
        let operator = match (&fill, &stroke) {
            (Some(_), Some(_)) => "B",
            (Some(_), None) => "f",
            (None, Some(_)) => "S",
            (None, None) => return,
        };
        self.add(format_args!("{}{}{outline}{operator}\n", fill.unwrap_or_default(), stroke.unwrap_or_default()));
    }

    fn add(&mut self, operators: std::fmt::Arguments<'_>) {
        // Writing into a string does not fail.
        let _ = self.operators.write_fmt(operators);
    }

    /// The style of an element with these classes.
    fn style(&self, element: &str, classes: &str) -> Style {
        let classes: Vec<&str> = classes.split_whitespace().collect();
        let applies = |rule: &&Rule| {
            (rule.element.is_empty() || rule.element == element)
                && rule.classes.iter().all(|class| classes.contains(&class.as_str()))
        };
        Style(self.sheet.iter().filter(applies).flat_map(|rule| rule.properties.clone()).collect())
    }
}

fn paint([red, green, blue]: Colour, operator: &str) -> String {
    format!("{red:.3} {green:.3} {blue:.3} {operator}\n")
}

/// A line through points; of one point, a dot.
fn path(points: &[Place]) -> String {
    let operator = |number: usize| if number == 0 { 'm' } else { 'l' };
    let dot = points.first().filter(|_| points.len() == 1);
    let points = points.iter().chain(dot).enumerate();
    points.map(|(number, (x, y))| format!("{x:.3} {y:.3} {}\n", operator(number))).collect()
}

/// A rectangle with rounded corners.
fn rectangle((x, y): Place, [width, height]: [f64; 2], r: f64) -> String {
    if r <= 0.0 {
        return format!("{x:.3} {y:.3} {width:.3} {height:.3} re\n");
    }
    let (right, bottom, k) = (x + width, y + height, r * (1.0 - QUARTER));
    // Each corner between the end of one side and the start of the next, with two controls.
    let corners = [
        [(right - r, y), (right - k, y), (right, y + k), (right, y + r)],
        [(right, bottom - r), (right, bottom - k), (right - k, bottom), (right - r, bottom)],
        [(x + r, bottom), (x + k, bottom), (x, bottom - k), (x, bottom - r)],
        [(x, y + r), (x, y + k), (x + k, y), (x + r, y)],
    ];
    let mut outline = format!("{:.3} {y:.3} m\n", x + r);
    for [end, one, other, start] in corners {
        outline += &format!("{:.3} {:.3} l\n", end.0, end.1);
        outline.extend([one, other, start].map(|(x, y)| format!("{x:.3} {y:.3} ")));
        outline += "c\n";
    }
    outline + "h\n"
}

/// A colour, 0 to 1: red, green, blue.
type Colour = [f64; 3];

/// A rule of the style sheet: name of the element or empty, classes, and its properties.
struct Rule {
    element: String,
    classes: Vec<String>,
    properties: Vec<(String, String)>,
}

/// The rules of the style sheet of all drawings in colours for print, the least specific first. Each is in `.plot`.
fn rules() -> Vec<Rule> {
    let rule = |text: &str| -> Option<Rule> {
        let (selector, body) = text.split_once('{')?;
        let mut names = selector.trim().strip_prefix(".plot ")?.split('.').map(str::to_string);
        let element = names.next()?;
        let pairs = body.split(';').filter_map(|property| property.split_once(':'));
        let properties = pairs.map(|(name, value)| (name.trim().to_string(), value.trim().to_string())).collect();
        Some(Rule { element, classes: names.collect(), properties })
    };
    let mut rules: Vec<Rule> = svg::light_style().split('}').filter_map(rule).collect();
    rules.sort_by_key(|rule| rule.classes.len());
    rules
}

/// How an element is drawn: the properties of the rules that apply, of which the last one holds.
struct Style(HashMap<String, String>);

impl Style {
    fn of(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.of(name)?.trim_end_matches("px").parse().ok()
    }

    /// Colour of a fill; black by default, `None` for none.
    fn fill(&self) -> Option<Colour> {
        colour(self.of("fill").unwrap_or("#000000"))
    }

    /// Colour of a stroke; `None` for none. Opacity becomes the colour on white paper.
    fn stroke(&self) -> Option<Colour> {
        let opacity = self.number("stroke-opacity").unwrap_or(1.0);
        Some(colour(self.of("stroke")?)?.map(|part| 1.0 - opacity * (1.0 - part)))
    }

    /// Operators for width, joins, caps and dashes of a stroke.
    fn pen(&self) -> String {
        let width = self.number("stroke-width").unwrap_or(1.0);
        let cap = u8::from(self.of("stroke-linecap") == Some("round"));
        let join = u8::from(self.of("stroke-linejoin") == Some("round"));
        let dashes = self.of("stroke-dasharray").filter(|dashes| *dashes != "none").unwrap_or("");
        format!("{width} w {cap} J {join} j [{dashes}] 0 d ")
    }

    /// Size of text, SVG units.
    fn font_size(&self) -> f64 {
        let from_font = self.of("font").and_then(|font| font.split("px").next()?.parse().ok());
        self.number("font-size").or(from_font).unwrap_or(12.0)
    }

    /// The share of its width by which a text starts to the left of its place.
    fn anchor(&self) -> f64 {
        match self.of("text-anchor") {
            Some("middle") => 0.5,
            Some("end") => 1.0,
            _ => 0.0,
        }
    }
}

/// `#rrggbb`.
fn colour(text: &str) -> Option<Colour> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let part = |k: usize| u8::from_str_radix(&digits[2 * k..2 * k + 2], 16).ok().map(|part| f64::from(part) / 255.0);
    Some([part(0)?, part(1)?, part(2)?])
}

/// The bundled fonts: the first that has a character draws it.
fn fonts() -> Result<Vec<Face<'static>>, String> {
    let files = [epaint_default_fonts::UBUNTU_LIGHT, epaint_default_fonts::HACK_REGULAR];
    files.into_iter().map(|file| Face::parse(file, 0).map_err(|error| format!("the bundled font: {error}"))).collect()
}

/// The operators that fill a text at zero. It starts the share `anchor` of its width to the left.
fn outlines(fonts: &[Face<'static>], text: &str, size: f64, anchor: f64) -> String {
    let glyphs = text.chars().filter_map(|c| fonts.iter().find_map(|face| Some((face, face.glyph_index(c)?))));
    let glyphs: Vec<_> = glyphs
        .map(|(face, glyph)| {
            let scale = size / f64::from(face.units_per_em());
            (face, glyph, scale, f64::from(face.glyph_hor_advance(glyph).unwrap_or(0)) * scale)
        })
        .collect();
    let width: f64 = glyphs.iter().map(|glyph| glyph.3).sum();
    let mut path = GlyphPath { operators: String::new(), left: -anchor * width, scale: 1.0, last: (0.0, 0.0) };
    for (face, glyph, scale, advance) in glyphs {
        path.scale = scale;
        face.outline_glyph(glyph, &mut path);
        path.left += advance;
    }
    if path.operators.is_empty() { String::new() } else { path.operators + "f\n" }
}

/// Collects outlines at their place. Fonts count upwards, drawings downwards.
struct GlyphPath {
    operators: String,
    left: f64,
    scale: f64,
    last: Place,
}

impl GlyphPath {
    fn place(&self, x: f32, y: f32) -> Place {
        (self.left + f64::from(x) * self.scale, -f64::from(y) * self.scale)
    }

    fn put<const N: usize>(&mut self, points: [Place; N], operator: char) {
        self.operators.extend(points.map(|(x, y)| format!("{x:.3} {y:.3} ")));
        self.operators.extend([operator, '\n']);
        self.last = points[N - 1];
    }
}

impl OutlineBuilder for GlyphPath {
    fn move_to(&mut self, x: f32, y: f32) {
        self.put([self.place(x, y)], 'm');
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.put([self.place(x, y)], 'l');
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (control, end) = (self.place(x1, y1), self.place(x, y));
        let between = |from: f64, to: f64| from + 2.0 / 3.0 * (to - from);
        let towards = |from: Place| (between(from.0, control.0), between(from.1, control.1));
        self.put([towards(self.last), towards(end), end], 'c');
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.put([self.place(x1, y1), self.place(x2, y2), self.place(x, y)], 'c');
    }

    fn close(&mut self) {
        self.operators.push_str("h\n");
    }
}
