//! The style of an element: the rules of the style sheet that apply to its name and classes, in order of specificity.

use std::collections::HashMap;

use crate::report::figure::svg;

/// A colour, 0 to 1: red, green, blue.
pub type Colour = [f64; 3];

/// How an element is drawn.
#[derive(Clone, Debug, Default)]
pub struct Style {
    properties: HashMap<String, String>,
}

/// A rule: name of the element or empty, classes, and its properties.
struct Rule {
    element: String,
    classes: Vec<String>,
    properties: Vec<(String, String)>,
}

/// The rules of the style sheet, the least specific first.
pub struct Sheet(Vec<Rule>);

impl Sheet {
    /// The style sheet of all drawings in colours for print. Each of its rules is in `.plot`.
    pub fn of_plots() -> Sheet {
        let text = svg::light_style();
        let mut rules: Vec<Rule> = text.split('}').filter_map(rule).collect();
        rules.sort_by_key(|rule| rule.classes.len());
        Sheet(rules)
    }

    /// The style of an element with these classes and these properties of its own.
    pub fn style(&self, element: &str, classes: &str, own: &str) -> Style {
        let classes: Vec<&str> = classes.split_whitespace().collect();
        let applies = |rule: &&Rule| {
            (rule.element.is_empty() || rule.element == element)
                && rule.classes.iter().all(|class| classes.contains(&class.as_str()))
        };
        let mut style = Style::default();
        for (name, value) in self.0.iter().filter(applies).flat_map(|rule| rule.properties.clone()) {
            style.properties.insert(name, value);
        }
        style.properties.extend(properties(own));
        style
    }
}

fn rule(text: &str) -> Option<Rule> {
    let (selector, body) = text.split_once('{')?;
    let of_plot = selector.trim().strip_prefix(".plot ")?;
    let mut names = of_plot.split('.');
    let element = names.next()?.to_string();
    Some(Rule { element, classes: names.map(str::to_string).collect(), properties: properties(body) })
}

fn properties(body: &str) -> Vec<(String, String)> {
    let pairs = body.split(';').filter_map(|property| property.split_once(':'));
    pairs.map(|(name, value)| (name.trim().to_string(), value.trim().to_string())).collect()
}

impl Style {
    /// Replaces a property, if it is given as an attribute.
    pub fn set(&mut self, name: &str, value: Option<&str>) {
        if let Some(value) = value {
            self.properties.entry(name.to_string()).or_insert_with(|| value.to_string());
        }
    }

    fn of(&self, name: &str) -> Option<&str> {
        self.properties.get(name).map(String::as_str)
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.of(name)?.trim_end_matches("px").parse().ok()
    }

    /// Colour of a fill; black by default, `None` for none.
    pub fn fill(&self) -> Option<Colour> {
        colour(self.of("fill").unwrap_or("#000000"))
    }

    /// Colour of a stroke; `None` for none. Opacity becomes the colour on white paper.
    pub fn stroke(&self) -> Option<Colour> {
        let opacity = self.number("stroke-opacity").unwrap_or(1.0);
        Some(colour(self.of("stroke")?)?.map(|part| 1.0 - opacity * (1.0 - part)))
    }

    /// Operators for width, joins, caps and dashes of a stroke.
    pub fn pen(&self) -> String {
        let width = self.number("stroke-width").unwrap_or(1.0);
        let cap = u8::from(self.of("stroke-linecap") == Some("round"));
        let join = u8::from(self.of("stroke-linejoin") == Some("round"));
        let dashes = self.of("stroke-dasharray").filter(|dashes| *dashes != "none").unwrap_or("");
        format!("{width} w {cap} J {join} j [{dashes}] 0 d ")
    }

    /// Size of text, SVG units.
    pub fn font_size(&self) -> f64 {
        let from_font = self.of("font").and_then(|font| font.split("px").next()?.parse().ok());
        self.number("font-size").or(from_font).unwrap_or(12.0)
    }

    /// The share of its width by which a text starts to the left of its place.
    pub fn anchor(&self) -> f64 {
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
