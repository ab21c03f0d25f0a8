//! The elements of a drawing as operators of a page.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::style::{Sheet, Style};
use super::text::{Fonts, outlines};

/// Ratio of control length and radius of a quarter circle as a cubic curve.
const QUARTER: f64 = 0.552_284_75;

/// A text whose words are being read: its style, its place, its words.
type OpenText = (Style, [f64; 2], String);

/// The operators of the elements of a drawing.
///
/// # Errors
/// If the text is no XML, or has an element or a path command that drawings do not have.
pub fn content(drawing: &str, fonts: &Fonts) -> Result<String, String> {
    let sheet = Sheet::of_plots();
    let whole = format!("<svg>{drawing}</svg>");
    let mut reader = Reader::from_str(&whole);
    let mut operators = String::new();
    let mut open: Option<OpenText> = None;
    // Whether an open element has a coordinate system of its own; titles are not drawn.
    let (mut transformed, mut in_title) = (Vec::new(), false);
    loop {
        match reader.read_event().map_err(|error| error.to_string())? {
            Event::Start(start) => {
                let element = Element::of(&start)?;
                in_title |= element.name == "title";
                let own = element.transform()?;
                transformed.push(!own.is_empty());
                operators.push_str(&own);
                match element.name.as_str() {
                    "text" => open = Some((element.style(&sheet), element.point("x", "y"), String::new())),
                    _ => operators.push_str(&element.drawn(&sheet)?),
                }
            }
            Event::Empty(start) => operators.push_str(&Element::of(&start)?.drawn(&sheet)?),
            Event::Text(words) => {
                add(&mut open, in_title, &words);
            }
            Event::GeneralRef(reference) => {
                let name: &str = &reference;
                let known = [("amp", "&"), ("lt", "<"), ("gt", ">"), ("quot", "\""), ("apos", "'")];
                add(&mut open, in_title, known.iter().find(|(word, _)| *word == name).map_or("", |(_, sign)| sign));
            }
            Event::End(end) => {
                match end.name().as_ref() {
                    "title" => in_title = false,
                    "text" => {
                        if let Some((style, at, words)) = open.take() {
                            operators.push_str(&paint(style.fill().unwrap_or_default(), "rg"));
                            operators.push_str(&outlines(fonts, &words, at, style.font_size(), style.anchor()));
                        }
                    }
                    _ => {}
                }
                if transformed.pop() == Some(true) {
                    operators.push_str("Q\n");
                }
            }
            Event::Eof => return Ok(operators),
            _ => {}
        }
    }
}

fn add(open: &mut Option<OpenText>, in_title: bool, words: &str) {
    if let (Some((_, _, text)), false) = (open, in_title) {
        text.push_str(words);
    }
}

/// An element with its attributes.
struct Element {
    name: String,
    attributes: Vec<(String, String)>,
}

impl Element {
    fn of(start: &BytesStart<'_>) -> Result<Element, String> {
        let attributes = start.attributes().map(|attribute| {
            let attribute = attribute.map_err(|error| error.to_string())?;
            Ok((attribute.key.as_ref().to_string(), attribute.value.to_string()))
        });
        Ok(Element { name: start.name().as_ref().to_string(), attributes: attributes.collect::<Result<_, String>>()? })
    }

    fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(own, _)| own == name).map(|(_, value)| value.as_str())
    }

    fn number(&self, name: &str) -> f64 {
        self.get(name).and_then(|value| value.parse().ok()).unwrap_or(0.0)
    }

    fn point(&self, x: &str, y: &str) -> [f64; 2] {
        [self.number(x), self.number(y)]
    }

    fn style(&self, sheet: &Sheet) -> Style {
        let own = self.get("style").unwrap_or_default();
        let mut style = sheet.style(&self.name, self.get("class").unwrap_or_default(), own);
        style.set("stroke-dasharray", self.get("stroke-dasharray"));
        style
    }

    /// Operators of the coordinate system of the element; empty if it has none of its own.
    fn transform(&self) -> Result<String, String> {
        let Some(transform) = self.get("transform") else { return Ok(String::new()) };
        let mut operators = "q\n".to_string();
        for part in transform.split(')').map(str::trim).filter(|part| !part.is_empty()) {
            let (name, arguments) = part.split_once('(').ok_or_else(|| unknown(part))?;
            let numbers = numbers(arguments)?;
            match (name, numbers.as_slice()) {
                ("translate", [x, y]) => operators.push_str(&format!("1 0 0 1 {x} {y} cm\n")),
                ("rotate", [degrees]) => {
                    let (sin, cos) = degrees.to_radians().sin_cos();
                    operators.push_str(&format!("{cos:.6} {sin:.6} {:.6} {cos:.6} 0 0 cm\n", -sin));
                }
                _ => return Err(unknown(part)),
            }
        }
        Ok(operators)
    }

    /// The operators that draw the element itself.
    fn drawn(&self, sheet: &Sheet) -> Result<String, String> {
        let outline = match self.name.as_str() {
            "path" => path(self.get("d").unwrap_or_default())?,
            "rect" => {
                let size = self.point("width", "height");
                let radius = self.number("rx").min(size[0] / 2.0).min(size[1] / 2.0);
                rounded(self.point("x", "y"), size, radius)
            }
            "circle" => {
                let ([x, y], r) = (self.point("cx", "cy"), self.number("r"));
                rounded([x - r, y - r], [2.0 * r, 2.0 * r], r)
            }
            "svg" | "g" | "title" | "tspan" => return Ok(String::new()),
            other => return Err(unknown(other)),
        };
        let style = self.style(sheet);
        let fill = style.fill().map(|colour| paint(colour, "rg"));
        let stroke = style.stroke().map(|colour| paint(colour, "RG") + &style.pen());
        let operator = match (&fill, &stroke) {
            (Some(_), Some(_)) => "B",
            (Some(_), None) => "f",
            (None, Some(_)) => "S",
            (None, None) => return Ok(String::new()),
        };
        Ok(format!("{}{}{outline}{operator}\n", fill.unwrap_or_default(), stroke.unwrap_or_default()))
    }
}

fn unknown(what: &str) -> String {
    format!("a drawing has `{what}`, which the PDF printer does not know")
}

fn paint([red, green, blue]: [f64; 3], operator: &str) -> String {
    format!("{red:.3} {green:.3} {blue:.3} {operator}\n")
}

/// A rectangle with rounded corners.
fn rounded([x, y]: [f64; 2], [width, height]: [f64; 2], r: f64) -> String {
    if r <= 0.0 {
        return format!("{x} {y} {width} {height} re\n");
    }
    let (right, bottom, k) = (x + width, y + height, r * (1.0 - QUARTER));
    format!(
        "{} {y} m {} {y} l {} {y} {right} {} {right} {} c {right} {} l {right} {} {} {bottom} {} {bottom} c\n\
         {} {bottom} l {} {bottom} {x} {} {x} {} c {x} {} l {x} {} {} {y} {} {y} c h\n",
        x + r,
        right - r,
        right - k,
        y + k,
        y + r,
        bottom - r,
        bottom - k,
        right - k,
        right - r,
        x + r,
        x + k,
        bottom - k,
        bottom - r,
        y + r,
        y + k,
        x + k,
        x + r,
    )
}

/// Numbers between commas, spaces and signs: `-.5 6-3`.
fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let mut spaced = String::new();
    for c in text.chars() {
        if c == '-' {
            spaced.push(' ');
        }
        spaced.push(if c == ',' { ' ' } else { c });
    }
    spaced.split_whitespace().map(|number| number.parse().map_err(|_| unknown(number))).collect()
}

/// The operators of an SVG path with straight lines and circular arcs.
fn path(d: &str) -> Result<String, String> {
    let mut operators = String::new();
    let (mut at, mut start) = ([0.0_f64; 2], [0.0_f64; 2]);
    let mut rest = d;
    while let Some(command) = rest.chars().next() {
        let end = rest[1..].find(|c: char| c.is_ascii_alphabetic()).map_or(rest.len(), |end| end + 1);
        let values = numbers(&rest[1..end])?;
        rest = &rest[end..];
        let last = at;
        let base = if command.is_ascii_lowercase() { at } else { [0.0; 2] };
        match (command.to_ascii_lowercase(), values.as_slice()) {
            ('z', []) => {
                operators.push_str("h\n");
                at = start;
            }
            ('h', [x]) => lines(&mut operators, &mut at, &[base[0] + x, last[1]], false),
            ('v', [y]) => lines(&mut operators, &mut at, &[last[0], base[1] + y], false),
            ('m', [x, y, further @ ..]) if further.len().is_multiple_of(2) => {
                at = [base[0] + x, base[1] + y];
                start = at;
                operators.push_str(&format!("{:.3} {:.3} m\n", at[0], at[1]));
                lines(&mut operators, &mut at, further, command == 'm');
            }
            ('l', points) if points.len().is_multiple_of(2) => lines(&mut operators, &mut at, points, command == 'l'),
            ('a', [r, _, _, large, sweep, x, y]) => {
                let to = [base[0] + x, base[1] + y];
                arc(&mut operators, at, to, *r, *large != 0.0, *sweep != 0.0);
                at = to;
            }
            _ => return Err(unknown(&format!("path command {command}"))),
        }
    }
    Ok(operators)
}

fn lines(operators: &mut String, at: &mut [f64; 2], points: &[f64], relative: bool) {
    for point in points.chunks_exact(2) {
        let base = if relative { *at } else { [0.0; 2] };
        *at = [base[0] + point[0], base[1] + point[1]];
        operators.push_str(&format!("{:.3} {:.3} l\n", at[0], at[1]));
    }
}

/// A circular arc as chords of at most 5° (SVG 1.1, appendix F.6).
fn arc(operators: &mut String, from: [f64; 2], to: [f64; 2], r: f64, large: bool, sweep: bool) {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let half = dx.hypot(dy) / 2.0;
    if half == 0.0 {
        return;
    }
    let r = r.abs().max(half);
    let beside = (r * r - half * half).max(0.0).sqrt() * if large == sweep { -1.0 } else { 1.0 } / (2.0 * half);
    let centre = [from[0] + dx / 2.0 - dy * beside, from[1] + dy / 2.0 + dx * beside];
    let angle = |point: [f64; 2]| (point[1] - centre[1]).atan2(point[0] - centre[0]);
    let turn = std::f64::consts::TAU;
    let mut through = angle(to) - angle(from);
    if sweep && through < 0.0 {
        through += turn;
    } else if !sweep && through > 0.0 {
        through -= turn;
    }
    let count = (through.abs().to_degrees() / 5.0).ceil().max(1.0) as usize;
    for k in 1..=count {
        let (sin, cos) = (angle(from) + through * k as f64 / count as f64).sin_cos();
        operators.push_str(&format!("{:.3} {:.3} l\n", centre[0] + r * cos, centre[1] + r * sin));
    }
}
