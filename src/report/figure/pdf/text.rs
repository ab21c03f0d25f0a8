//! Text as outlines of the bundled fonts.

use std::fmt::Write;

use ttf_parser::{Face, OutlineBuilder};

/// A font, and the size of its unit square.
pub struct Font(Face<'static>);

/// The bundled fonts: the first that has a character draws it.
pub type Fonts = [Font];

impl Font {
    /// The fonts of all figures.
    pub fn bundled() -> Result<Vec<Font>, String> {
        let files = [epaint_default_fonts::UBUNTU_LIGHT, epaint_default_fonts::HACK_REGULAR];
        let read = |file| Face::parse(file, 0).map(Font).map_err(|error| format!("the bundled font: {error}"));
        files.into_iter().map(read).collect()
    }
}

/// The operators that fill a text. It starts the share `anchor` of its width to the left of `x`.
pub fn outlines(fonts: &Fonts, text: &str, [x, y]: [f64; 2], size: f64, anchor: f64) -> String {
    let glyphs: Vec<_> = text
        .chars()
        .filter_map(|c| fonts.iter().find_map(|Font(face)| Some((face, face.glyph_index(c)?))))
        .map(|(face, glyph)| {
            let scale = size / f64::from(face.units_per_em());
            (face, glyph, scale, f64::from(face.glyph_hor_advance(glyph).unwrap_or(0)) * scale)
        })
        .collect();
    let width: f64 = glyphs.iter().map(|glyph| glyph.3).sum();
    let mut path = GlyphPath { operators: String::new(), origin: [x - anchor * width, y], scale: 1.0, last: [0.0; 2] };
    for (face, glyph, scale, advance) in glyphs {
        path.scale = scale;
        face.outline_glyph(glyph, &mut path);
        path.origin[0] += advance;
    }
    if path.operators.is_empty() { String::new() } else { path.operators + "f\n" }
}

/// Collects outlines at their place. Fonts count upwards, drawings downwards.
struct GlyphPath {
    operators: String,
    origin: [f64; 2],
    scale: f64,
    last: [f64; 2],
}

impl GlyphPath {
    fn place(&self, x: f32, y: f32) -> [f64; 2] {
        [self.origin[0] + f64::from(x) * self.scale, self.origin[1] - f64::from(y) * self.scale]
    }

    fn put(&mut self, points: &[[f64; 2]], operator: char) {
        for [x, y] in points {
            // Writing into a string does not fail.
            let _ = write!(self.operators, "{x:.3} {y:.3} ");
        }
        self.operators.push(operator);
        self.operators.push('\n');
        self.last = points.last().copied().unwrap_or(self.last);
    }
}

impl OutlineBuilder for GlyphPath {
    fn move_to(&mut self, x: f32, y: f32) {
        self.put(&[self.place(x, y)], 'm');
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.put(&[self.place(x, y)], 'l');
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (control, end) = (self.place(x1, y1), self.place(x, y));
        let towards = |from: [f64; 2]| std::array::from_fn(|k| from[k] + 2.0 / 3.0 * (control[k] - from[k]));
        self.put(&[towards(self.last), towards(end), end], 'c');
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.put(&[self.place(x1, y1), self.place(x2, y2), self.place(x, y)], 'c');
    }

    fn close(&mut self) {
        self.operators.push_str("h\n");
    }
}
