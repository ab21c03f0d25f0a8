//! The text of a methods section: machine, tests, parameters, estimation and uncertainty, every number from the result.

use abbe::identify::noise::NoiseSource;
use abbe::model::words::counted;

use super::contents::Study;
use super::{Part, Subject};
use crate::report::block::Report;
use crate::report::number::of_readings;

/// The part.
pub fn part(study: &Study) -> Part {
    let mut report = Report::new("Methods");
    [machine(study), estimation(study), uncertainty(study)].into_iter().for_each(|text| report.key(text));
    if let Some(fitted) = &study.fitted {
        let model = &fitted.result.model;
        let enlarged = if model.fit.u_enlargement > 1.0 {
            format!(
                " The residual exceeds the noise significantly, so that all uncertainties are enlarged by {:.2}.",
                model.fit.u_enlargement
            )
        } else {
            String::new()
        };
        let source = match model.noise.source {
            NoiseSource::Stated => "is that of the instrument",
            NoiseSource::Repeats => "is estimated from repeated readings",
            NoiseSource::Targets => "is estimated from the distances between the targets at each pose",
            _ => "is estimated from the residual",
        };
        let coefficients: Vec<String> =
            model.noise_ar_coefficients.iter().map(|coefficient| format!("{coefficient:.2}")).collect();
        let along_runs = match coefficients.len() {
            0 => String::new(),
            order => format!(
                " Along a run the noise is an autoregression of order {order} ({}), from repeated readings.",
                coefficients.join(", ")
            ),
        };
        report.key(format!(
            "The fit of {} has a root mean square residual of {} and of {} for held-out readings ({} left out in turn). \
             The noise standard deviation of {} {source}.{along_runs} χ² is {:.0} for {} degrees of freedom (Birge ratio {:.2}).{enlarged}",
            counted(model.fit.readings, "reading"),
            of_readings(model.fit.rms_um, model.noise.unit),
            of_readings(model.fit.heldout_rms_um, model.noise.unit),
            model.heldout_by,
            of_readings(model.noise.value, model.noise.unit),
            model.chi_square,
            model.degrees_of_freedom,
            model.birge_ratio,
        ));
    }
    Part { subject: Subject::Methods, report }
}

fn machine(study: &Study) -> String {
    let (session, analysis) = (&study.problem.session, &study.analysis);
    let instrument = session.instrument.entry().phrase;
    let moving = analysis.moving_min.map_or(String::new(), |min| format!(" and {min:.1} min of movement"));
    format!(
        "The machine {} has the structural code {} (from workpiece to tool, b is the bed). It is measured with {instrument} \
         in {} with {}{moving}, from {}. Errors are named by ISO 230-1 [@iso230].",
        session.machine.name,
        session.machine.code(),
        counted(analysis.tests.len(), "test"),
        counted(analysis.readings, "reading"),
        counted(analysis.setup_count, "set-up"),
    )
}

fn estimation(study: &Study) -> String {
    let list = &study.problem.parameters.list;
    let setups = list.iter().filter(|parameter| parameter.id.is_setup()).count();
    let errors = list.len() - setups;
    let analysis = &study.analysis;
    let rank = if analysis.rank == list.len() {
        "all parameters are identifiable".to_string()
    } else {
        let indices = &analysis.indices;
        format!("{} of {} are identifiable", indices.identifiable_count, counted(indices.error_count, "error"))
    };
    format!(
        "A reading is computed by the kinematic chain with exact derivatives. The {} and {} are estimated together by \
         least squares with the Gauss-Newton method. Each linearisation is reduced by orthogonal transformations to a \
         triangular factor [@demmel2012], so that no information is lost by squaring. The numerical rank is {} of {}: {rank}. \
         A direction counts as identifiable if a change by 1 mm or 0.01 rad along it changes the readings by at least one \
         standard deviation in total. Combinations that are not identifiable keep their nominal values.",
        counted(errors, "error"),
        counted(setups, "set-up parameter"),
        analysis.rank,
        list.len(),
    )
}

fn uncertainty(study: &Study) -> String {
    format!(
        "The covariance of the estimates follows from the noise of a reading ({}) and from the priors of the set-up by the \
         law of propagation of uncertainty [@jcgm100;@jcgm102]. Stated uncertainties are standard uncertainties.",
        of_readings(study.analysis.noise.value, study.analysis.noise.unit)
    )
}
