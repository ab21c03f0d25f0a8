//! The bibliography, as BibTeX, which LaTeX and Typst both read.

/// The sources of the methods, `refs.bib`.
pub fn bibliography() -> String {
    include_str!("refs.bib").to_string()
}
