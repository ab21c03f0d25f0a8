//! Residuals of each test, affected tests first, and the residual of the whole session.

use abbe::identify::series::spectrum::Spectrum;
use abbe::model::words::counted;

use super::plots::{MAX_TESTS, SessionPlots};
use super::{curves, sky, workspace};
use crate::report::block::{Report, Text};
use crate::report::figure::Figure;
use crate::report::number::{integer, micrometres};
use crate::report::table::{Table, cells, numbers, words};

/// Residuals of every test before and after, by the names of the two models. Tests that do not change are folded.
pub fn figures(report: &mut Report, session: &SessionPlots<'_>, spectra: &[Spectrum], models: [&str; 2]) {
    let amplitudes = spectra.iter().flat_map(|spectrum| spectrum.before_um.iter().chain(&spectrum.after_um));
    let maximum = amplitudes.copied().fold(0.0, f64::max);
    let is_polar = session.is_polar() && session.tests().any(|(_, test)| test.way.is_angle);
    let of_test = |number: usize| -> Vec<Figure> {
        let polar = session.polar_residuals(number, models).unwrap_or_default();
        polar.into_iter().chain(straight(session, number, spectra, maximum)).collect()
    };
    let places = [("On the sky", sky::panels(session)), ("Over the workspace", workspace::views(session))];
    let mut places = places.into_iter().filter(|(_, drawn)| !drawn.is_empty()).peekable();
    let has_places = places.peek().is_some();
    for (heading, drawn) in places {
        report.page(Text::Heading(heading.to_string()));
        report.figures(drawn);
    }
    if has_places {
        report.page(Text::Heading("Each test".to_string()));
    }
    let (affected, folded) = unaffected(session);
    for number in affected {
        if is_polar {
            report.page(Text::Heading(session.series.tests[number].name.clone()));
        }
        report.figures(of_test(number));
    }
    report.page(omitted_tests(session));
    if let Some((heading, numbers)) = folded {
        report.page(Text::Fold(heading));
        report.figures(numbers.into_iter().flat_map(of_test));
    }
    report.page(Text::Heading("All tests".to_string()));
    report.detail(test_table(session, models));
    report.figures([curves::over_time(session)]);
    report.figures((!is_polar).then(|| curves::histogram(session, models)));
}

/// The numbers of the tests whose residual the model changes; of the others, if there are any, their numbers under a
/// heading that names them.
pub fn unaffected(session: &SessionPlots<'_>) -> (Vec<usize>, Option<(String, Vec<usize>)>) {
    let numbers = session.tests().map(|(number, _)| number);
    let (affected, others): (Vec<usize>, Vec<usize>) = numbers.partition(|number| session.is_affected(*number));
    let names: Vec<&str> = others.iter().map(|number| session.series.tests[*number].name.as_str()).collect();
    let heading = format!("{} without a change of the residual: {}", counted(names.len(), "test"), names.join(", "));
    (affected, (!others.is_empty()).then_some((heading, others)))
}

/// Figures of one test with straight axes: residuals, and their spectra on one scale.
fn straight(session: &SessionPlots<'_>, number: usize, spectra: &[Spectrum], maximum_um: f64) -> Vec<Figure> {
    let name = &session.series.tests[number].name;
    let effects = &session.problem.parameters.effects;
    let own = spectra.iter().filter(|spectrum| &spectrum.of == name);
    let own = own.map(|spectrum| curves::spectrum_plot(spectrum, maximum_um, effects));
    session.residuals(number).into_iter().chain(own).collect()
}

/// Readings and RMS residuals of every test.
pub fn test_table(session: &SessionPlots<'_>, models: [&str; 2]) -> Table {
    let has_change = session.has_change();
    let rows = session.series.tests.iter().enumerate().map(|(number, test)| {
        let [before, after] = session.rms_um(number).map(micrometres);
        let mut row = cells![&test.name, integer(test.after_um.len() / test.channels), after];
        if has_change {
            row.insert(2, before.into());
        }
        row
    });
    let [before, after] = models.map(|model| numbers(format!("rms, {model}")));
    let mut columns = vec![words("test"), numbers("readings"), after];
    if has_change {
        columns.insert(2, before);
    }
    Table::new(columns, rows)
}

/// A note about tests without plots of their own.
pub fn omitted_tests(session: &SessionPlots<'_>) -> Text {
    let tests = session.series.tests.len();
    let note = format!("Plots are shown for the first {MAX_TESTS} of {tests} tests. The data contain all tests.");
    Text::List(if tests > MAX_TESTS { vec![note] } else { Vec::new() })
}
