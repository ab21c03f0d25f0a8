//! The printers of results: terminal, CSV, HTML, LaTeX and Typst.

pub mod csv;
pub mod html;
pub mod page;
pub mod paper;
pub mod sheet;
pub mod terminal;
