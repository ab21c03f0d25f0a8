//! Figures as PNG (feature `png`). resvg draws the SVG file of a figure with the bundled fonts.

use std::sync::Arc;

use resvg::{tiny_skia, usvg};

use super::{Figure, svg};

/// Font family of PNG files.
const FAMILY: &str = "Ubuntu";

/// Fonts of PNG files.
pub struct Fonts(Arc<usvg::fontdb::Database>);

impl Fonts {
    /// The bundled fonts. PNG files are the same on every computer.
    pub fn bundled() -> Fonts {
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
        fonts.load_font_data(epaint_default_fonts::HACK_REGULAR.to_vec());
        let family = fonts.faces().next().and_then(|face| face.families.first().map(|(name, _)| name.clone()));
        fonts.set_sans_serif_family(family.unwrap_or_else(|| FAMILY.to_string()));
        Fonts(Arc::new(fonts))
    }
}

/// Draws a figure as PNG with two pixels per SVG unit. `None` if the SVG cannot be drawn.
pub fn png(figure: &Figure, fonts: &Fonts) -> Option<Vec<u8>> {
    const PIXELS_PER_UNIT: f32 = 2.0;
    let options =
        usvg::Options { fontdb: fonts.0.clone(), font_family: FAMILY.to_string(), ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(&svg::file(figure), &options).ok()?;
    let size = tree.size().to_int_size().scale_by(PIXELS_PER_UNIT)?;
    let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height())?;
    let scale = tiny_skia::Transform::from_scale(PIXELS_PER_UNIT, PIXELS_PER_UNIT);
    resvg::render(&tree, scale, &mut pixels.as_mut());
    pixels.encode_png().ok()
}
