//! How an equation is set or called: everything that does not change its content.

/// Which equations have a number and a label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Numbering {
    /// None.
    #[default]
    None,
    /// That of the reading.
    Last,
    /// Every one.
    All,
}

/// The arguments of printed code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Named arguments: lengths, axis positions, and errors with the default 0.
    #[default]
    Named,
    /// Three arrays: lengths, sines and cosines, errors. For kernels over columns of readings.
    Flat,
}

/// The unit of axis positions in named arguments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AngleUnit {
    /// rad
    #[default]
    Radian,
    /// °
    Degree,
}

/// How an equation is set or called. A language ignores what does not concern it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Style {
    /// Which equations have a number, in LaTeX and Typst.
    pub numbering: Numbering,
    /// Width of a line in LaTeX (at 10 pt) and Typst (at 11 pt), mm; by default that of an article in one column.
    pub width_mm: Option<f64>,
    /// Whether a table of symbols follows, in LaTeX and Typst.
    pub nomenclature: bool,
    /// The arguments of code.
    pub layout: Layout,
    /// The unit of axis positions in named arguments.
    pub angles: AngleUnit,
    /// Whether the names of functions end in that of the test, so that code of several tests lies side by side.
    pub name_of_test: bool,
}
