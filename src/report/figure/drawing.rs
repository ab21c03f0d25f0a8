//! Drawings as elements: lines, dots, rectangles, circles and texts, each with classes of the style sheet `plot.css`. Each
//! printer of figures prints them: [`super::svg`], [`super::pdf`].

/// Width of a drawing with straight axes, in SVG units. Two such drawings stand beside one another at 1,280 px, and one
/// fills a narrow screen with legible text.
pub const WIDTH: f64 = 500.0;

/// A place in a drawing, SVG units: to the right, down.
pub type Place = (f64, f64);

/// What a chart draws.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// Width and height, SVG units.
    pub size: [f64; 2],
    /// The elements, the lowest first.
    pub elements: Vec<Element>,
    /// Data for the script of the page, as JSON. `None` for a static drawing.
    pub interaction: Option<String>,
}

/// An element of a drawing.
#[derive(Clone, Debug)]
pub struct Element {
    /// What it is.
    pub shape: Shape,
    /// Its classes of the style sheet.
    pub class: String,
    /// Words under the pointer; empty if it has none.
    pub title: String,
    /// Index of the traversal and name of the data column of what the script of the page redraws.
    pub source: Option<(usize, &'static str)>,
}

/// The shape of an element.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Lines through points. A line of one point is a dot.
    Lines(Vec<Vec<Place>>),
    /// A rectangle: its upper left corner, width and height, radius of its corners.
    Rectangle(Place, [f64; 2], f64),
    /// A circle: centre, radius.
    Circle(Place, f64),
    /// Words at the place of their baseline.
    Text {
        /// The place: of the start, or as the class says of the middle or the end.
        at: Place,
        /// The words.
        words: String,
        /// Whether they run upwards.
        upwards: bool,
        /// Height of the letters, if it is not that of the class.
        size: Option<f64>,
    },
    /// Elements that share the words under the pointer, displaced together.
    Group(Place, Vec<Element>),
}

impl Element {
    fn new(class: impl Into<String>, shape: Shape) -> Element {
        Element { shape, class: class.into(), title: String::new(), source: None }
    }

    /// Several lines.
    pub fn lines(class: impl Into<String>, lines: impl IntoIterator<Item = Vec<Place>>) -> Element {
        Element::new(class, Shape::Lines(lines.into_iter().collect()))
    }

    /// A line through points.
    pub fn line(class: impl Into<String>, points: impl IntoIterator<Item = Place>) -> Element {
        Element::lines(class, [points.into_iter().collect()])
    }

    /// Dots.
    pub fn dots(class: impl Into<String>, points: impl IntoIterator<Item = Place>) -> Element {
        Element::lines(class, points.into_iter().map(|point| vec![point]))
    }

    /// A rectangle with this upper left corner.
    pub fn rectangle(class: impl Into<String>, corner: Place, size: [f64; 2]) -> Element {
        Element::new(class, Shape::Rectangle(corner, size, 0.0))
    }

    /// A circle.
    pub fn circle(class: impl Into<String>, centre: Place, radius: f64) -> Element {
        Element::new(class, Shape::Circle(centre, radius))
    }

    /// Words.
    pub fn text(class: impl Into<String>, at: Place, words: impl Into<String>) -> Element {
        Element::new(class, Shape::Text { at, words: words.into(), upwards: false, size: None })
    }

    /// Words that run upwards.
    pub fn upwards(class: impl Into<String>, at: Place, words: impl Into<String>) -> Element {
        Element::new(class, Shape::Text { at, words: words.into(), upwards: true, size: None })
    }

    /// Elements that share their title, displaced.
    pub fn group(by: Place, elements: Vec<Element>) -> Element {
        Element::new("", Shape::Group(by, elements))
    }

    /// With words under the pointer.
    pub fn titled(self, title: impl Into<String>) -> Element {
        Element { title: title.into(), ..self }
    }

    /// With what the script of the page redraws it from.
    pub fn of(self, source: Option<(usize, &'static str)>) -> Element {
        Element { source, ..self }
    }

    /// With letters of this height.
    pub fn sized(mut self, height: f64) -> Element {
        if let Shape::Text { size, .. } = &mut self.shape {
            *size = Some(height);
        }
        self
    }

    /// With round corners.
    pub fn rounded(mut self, by: f64) -> Element {
        if let Shape::Rectangle(.., radius) = &mut self.shape {
            *radius = by;
        }
        self
    }
}

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

/// Greatest width of a letter of a drawing, SVG units: widths of text are estimated generously.
const LETTER: f64 = 7.8;
/// Height of a letter above its line.
const ASCENT: f64 = 11.0;

/// A label beside a point, placed so that all of it is within a drawing of this size.
pub fn label(class: &str, (x, y): Place, text: &str, [width, height]: [f64; 2]) -> Element {
    let last = width - LETTER * text.chars().count() as f64;
    Element::text(class, (x.min(last).max(0.0), y.min(height).max(ASCENT)), text)
}

/// A legend from the left, in as many lines as needed, with the ordinate of its last line. Text widths are estimated
/// generously.
pub fn legend<S: AsRef<str>>(entries: &[(S, String)], x: f64, y: f64, width: f64) -> (Vec<Element>, f64) {
    let mut elements = Vec::new();
    let (mut left, mut baseline) = (x, y);
    for (class, label) in entries {
        let class = class.as_ref();
        let needed = 26.0 + LETTER * label.chars().count() as f64;
        if left > x && left + needed > x + width {
            left = x;
            baseline += 17.0;
        }
        let middle = baseline - 4.0;
        elements.push(match class {
            "key-start" => Element::circle("start", (left + 9.0, middle), 4.0),
            "key-end" => Element::rectangle("end", (left + 5.5, middle - 3.5), [7.0; 2]),
            fill if fill.starts_with("key-") => Element::rectangle(fill, (left + 1.0, middle - 5.0), [16.0, 10.0]),
            dots if dots.contains("dots") => Element::dots(dots, [2.0, 9.0, 16.0].map(|x| (left + x, middle))),
            line => Element::line(line, [(left, middle), (left + 18.0, middle)]),
        });
        elements.push(Element::text("", (left + 23.0, baseline), label));
        // A filled key needs more space after it than a line.
        left += needed + if class.starts_with("key-") { 12.0 } else { 4.0 };
    }
    (elements, baseline)
}
