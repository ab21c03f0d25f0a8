//! The equations of the tests in first order, the derivatives of their readings, and the nomenclature.

use abbe::codegen::error::NO_POLYNOMIAL;
use abbe::codegen::print::{Numbering, Style, TestEquations, language};
use abbe::codegen::{Arrangement, Equation, Options, Order, SessionTest, Symbols, check};
use abbe::equation::EquationParameters;
use abbe::model::Diagnostic;
use abbe::model::session::{Session, Test};

use super::contents::Study;
use super::{Part, Subject};
use crate::report::block::{Formula, Report};

/// Width of a line in a page of two columns, mm.
const COLUMN_MM: f64 = 84.0;

/// Length of the LaTeX of all tests in first order, bytes, beyond which one test is printed frame by frame instead.
const LONGEST: usize = 40_000;

/// The part.
///
/// # Errors
/// If the equation of a test cannot be made or does not agree with the chain.
pub fn part(study: &Study, two_column: bool) -> Result<Part, Diagnostic> {
    let session = &study.problem.session;
    let style = Style {
        numbering: Numbering::Last,
        width_mm: two_column.then_some(COLUMN_MM),
        nomenclature: true,
        ..Style::default()
    };
    let mut report = Report::new("Equations");
    if let Some(displayed) = in_first_order(session, &style)? {
        report.key(
            "The readings of each test in first order of the errors, from the kinematic chain. Each equation agrees with the \
             derivatives of the chain at random states. The derivatives of all readings at zero errors and the symbols follow.",
        );
        report.key(displayed);
        return Ok(Part { subject: Subject::Equations, report });
    }
    let by_frames = Form { order: Order::Exact, arrangement: Arrangement::Frames };
    for test in &session.tests {
        let (equation, source) = by_frames.of(session, test)?;
        let checked = check(&equation, &source)?;
        let one = |word: &str, style: &Style| language(word)?.print(&checked, style);
        let latex = one("latex", &style)?;
        // The orientation of a robot's flange has no form by frames.
        if latex.len() > LONGEST {
            continue;
        }
        report.key(format!(
            "The readings of test {} from frame to frame of the kinematic chain, exact in the errors. The equation \
             agrees with the chain at random states.",
            test.name
        ));
        report.key(displayed(latex, one("typst", &style)?, one("text", &Style::default())?));
        return Ok(Part { subject: Subject::Equations, report });
    }
    report.key("The equations of the tests fill pages. They are printed, and written as code, by abbe equation.");
    Ok(Part { subject: Subject::Equations, report })
}

/// The equations of all tests in first order. `None` if they fill pages, or if a reading is the root of what the instrument's
/// unknowns change, as the distance from a station that is searched for is.
fn in_first_order(session: &Session, style: &Style) -> Result<Option<Formula>, Diagnostic> {
    let form = Form { order: Order::First, arrangement: Arrangement::Single };
    let made: Result<Vec<_>, _> = session.tests.iter().map(|test| form.of(session, test)).collect();
    let made = match made {
        Err(error) if error.code == NO_POLYNOMIAL => return Ok(None),
        made => made?,
    };
    let checked = made.iter().map(|(equation, source)| check(equation, source)).collect::<Result<Vec<_>, _>>()?;
    let tests: Vec<TestEquations<'_>> =
        checked.iter().map(|equation| TestEquations { equation, first: equation }).collect();
    let all = |word: &str, style: &Style| language(word)?.print_system(&tests, style);
    let latex = all("latex", style)?;
    if latex.len() > LONGEST {
        return Ok(None);
    }
    Ok(Some(displayed(latex, all("typst", style)?, all("text", &Style::default())?)))
}

fn displayed(latex: String, typst: String, text: String) -> Formula {
    Formula { latex: latex.into(), typst: typst.into(), text: text.into(), displayed: true }
}

/// How an equation is made.
struct Form {
    order: Order,
    arrangement: Arrangement,
}

impl Form {
    /// The equation of a test with the errors and effects of its session.
    fn of<'s>(&self, session: &'s Session, test: &'s Test) -> Result<(Equation, SessionTest<'s>), Diagnostic> {
        let source = SessionTest::new(session, test)?;
        let parameters = EquationParameters::declared(session, test);
        let options = Options {
            order: self.order,
            arrangement: self.arrangement,
            rotation: None,
            symbols: Symbols::Literature,
            gradient: false,
            unknowns: parameters.instrument,
            effects: parameters.effects,
        };
        let mut equation = Equation::of(&session.machine, &source, &parameters.errors, &options)?;
        // Comments of a session file are notes of its author, not words of a paper.
        equation.meanings.clear();
        Ok((equation, source))
    }
}
