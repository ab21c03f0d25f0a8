//! How an equation is set or called: the options of `abbe equation` that do not change its content.

use abbe::codegen::print::{AngleUnit, Audience, LANGUAGES, Layout, Numbering, OutputLanguage, Style};
use abbe::model::Diagnostic;
use clap::Args;

use crate::cli::values::{self, Words};

const NUMBERINGS: Words<Numbering> = &[("none", Numbering::None), ("last", Numbering::Last), ("all", Numbering::All)];
const LAYOUTS: Words<Layout> = &[("named", Layout::Named), ("flat", Layout::Flat)];
const ANGLES: Words<AngleUnit> = &[("rad", AngleUnit::Radian), ("deg", AngleUnit::Degree)];

/// How an equation is set.
#[derive(Args)]
pub struct StyleArguments {
    /// LaTeX, Typst: equations with a number and a label, such as `eq:ldbb-C150` [default: none].
    ///
    /// Example: --number last
    #[arg(long, value_parser = values::words(NUMBERINGS))]
    number: Option<Numbering>,
    /// LaTeX, Typst: width of a line, as 84mm; longer equations are broken [default: a column of an article].
    ///
    /// Example: --width 84mm
    #[arg(long, value_name = "LENGTH", value_parser = width_mm)]
    width: Option<f64>,
    /// Set for two columns: in LaTeX and Typst lines are broken as with --width 84mm.
    #[arg(long, conflicts_with = "width")]
    two_column: bool,
    /// LaTeX, Typst: add a table of all symbols.
    #[arg(long)]
    nomenclature: bool,
    /// Code: named arguments, errors with the default 0; or three arrays, with sines and cosines, for kernels [default:
    /// named].
    ///
    /// Example: --layout flat
    #[arg(long, value_parser = values::words(LAYOUTS))]
    layout: Option<Layout>,
    /// Code with named arguments: unit of the positions of rotary axes [default: rad].
    ///
    /// Example: --angles deg
    #[arg(long, value_parser = values::words(ANGLES))]
    angles: Option<AngleUnit>,
}

/// Width of a line for two columns, mm.
const TWO_COLUMN_MM: f64 = 84.0;

/// Reads a width such as `84mm`, in mm.
fn width_mm(text: &str) -> Result<f64, String> {
    let units = [("mm", 1.0), ("cm", 10.0), ("in", 25.4), ("pt", 25.4 / 72.27)];
    let unit = units.iter().find_map(|(unit, mm)| Some((text.strip_suffix(unit)?, mm)));
    let (number, mm) = unit.ok_or("a length with its unit mm, cm, in or pt is expected, for example 84mm")?;
    let width = number.trim().parse::<f64>().map_err(|_| format!("`{number}` is not a number"))? * mm;
    if (40.0..=1000.0).contains(&width) { Ok(width) } else { Err("a line is 40 mm to 1000 mm wide".to_string()) }
}

impl StyleArguments {
    /// Refuses options that the language ignores.
    pub fn style(&self, language: &OutputLanguage) -> Result<Style, Diagnostic> {
        let typeset = [
            ("--number", self.number.is_some()),
            ("--width", self.width.is_some()),
            ("--two-column", self.two_column),
            ("--nomenclature", self.nomenclature),
        ];
        let groups: [(&[Audience], &[(&str, bool)]); 3] = [
            (&[Audience::Authors], &typeset),
            (&[Audience::Compilers], &[("--layout", self.layout.is_some())]),
            (&[Audience::Compilers, Audience::Algebra], &[("--angles", self.angles.is_some())]),
        ];
        for (audience, options) in groups {
            if let (true, Some((option, _))) =
                (!audience.contains(&language.audience), options.iter().find(|(_, set)| *set))
            {
                let known: Vec<&str> =
                    LANGUAGES.iter().filter(|l| audience.contains(&l.audience)).map(|l| l.word).collect();
                let message = format!(
                    "`{option}` does not apply to `--as {}`; it applies to {}",
                    language.word,
                    known.join(", ")
                );
                return Err(Diagnostic::other(message));
            }
        }
        if matches!((self.layout, self.angles), (Some(Layout::Flat), Some(_))) {
            let message = "`--angles` does not apply to `--layout flat`, whose arguments are sines and cosines";
            return Err(Diagnostic::other(message.to_string()));
        }
        Ok(Style {
            numbering: self.number.unwrap_or(Numbering::None),
            width_mm: self.two_column.then_some(TWO_COLUMN_MM).or(self.width),
            nomenclature: self.nomenclature,
            layout: self.layout.unwrap_or(Layout::Named),
            angles: self.angles.unwrap_or(AngleUnit::Radian),
            name_of_test: false,
        })
    }
}
