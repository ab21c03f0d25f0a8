//! Figures as PDF for LaTeX: the drawing without a title, as vector paths on a page of its size.
//!
//! The SVG drawing of a figure is a few elements (`g`, `path`, `rect`, `circle`, `text`) with CSS classes. Text is
//! drawn as outlines of the bundled font, so that no font has to be embedded and every computer draws the same page
//! (ISO 32000-1, 8.5).

mod page;
mod style;
mod text;

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::Figure;
use super::svg::Drawing;
use text::Font;

/// Points per SVG unit: CSS defines 96 units per inch.
const POINTS_PER_UNIT: f64 = 0.75;

/// A figure as PDF.
///
/// # Errors
/// If the drawing has something that this printer does not know, which is a fault of the program.
pub fn file(figure: &Figure) -> Result<Vec<u8>, String> {
    let Drawing { size: [width, height], inner, .. } = figure.kind().drawing();
    let fonts = Font::bundled()?;
    let drawn = page::content(&inner.into_string(), &fonts)?;
    // SVG counts downwards.
    let content = format!("{POINTS_PER_UNIT} 0 0 -{POINTS_PER_UNIT} 0 {} cm\n{drawn}", height * POINTS_PER_UNIT);
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    let compressed = encoder.write_all(content.as_bytes()).and_then(|()| encoder.finish());
    let compressed = compressed.map_err(|error| error.to_string())?;
    let [width, height] = [width, height].map(|units| units * POINTS_PER_UNIT);
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
