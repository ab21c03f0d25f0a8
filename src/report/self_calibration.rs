//! A self-calibration: its functions, the position of the axis, coverage intervals.

use abbe::identify::results::{Interval, ModelResult};
use abbe::identify::self_calibration::{FunctionResult, MonteCarloResult, SelfCalibration};
use abbe::model::session::Session;
use abbe::model::words::counted;

use super::block::{Report, Text};
use super::fit::Figures;
use super::number::{fixed, micrometres, places, value_and_u};
use super::quality::noise;
use super::table::{Cell, Table, cells, numbers, words};
use super::{confounded, parameters};

/// The report of a self-calibration.
pub fn report(session: &Session, result: &SelfCalibration) -> Report {
    let mut report = Report::new(format!("Self-calibration of {}", session.machine.name));
    report.warnings.clone_from(&result.warnings);
    report.method = "Rotary axis, linear axes and artefact are estimated separately, under the conditions stated \
                     (Zimmermann and Ibaraki 2020)."
        .to_string();
    report.values = values(result);
    report.opening(
        "",
        [
            format!(
                "{}, {}, residual {}.",
                counted(result.readings, "reading"),
                noise(result.noise),
                micrometres(result.rms_um)
            ),
            format!(
                "{} of four functions, numerical rank {} without boundary conditions.",
                counted(result.value_count, "value"),
                result.rank_without_conditions
            ),
            format!(
                "{} under {}, numerical rank {}.",
                counted(result.parameter_count, "parameter"),
                counted(result.conditions.len(), "condition"),
                result.rank
            ),
        ],
    );
    report.section("Conditions");
    result.conditions.iter().for_each(|condition| report.key(Text::Note(condition.clone())));
    report.section("Functions");
    report.key(functions(&result.functions).titled("Functions, µm, value ± standard uncertainty"));
    report.key(parameters::table(&result.radius.iter().collect::<Vec<_>>(), None).titled(""));
    let axis = &result.axis;
    report.section("Rotary axis");
    let of_axis = parameters::table(&result.parameters.iter().collect::<Vec<_>>(), None);
    report.key(of_axis.titled(format!("Position of axis {axis}, by the least-squares circle of its displacements")));
    let by_turn = parameters::table(&result.parameters_by_turn.iter().collect::<Vec<_>>(), None);
    report.key(by_turn.titled("The same, from the angles of rotation"));
    if !result.parameters.is_empty() {
        report.key(functions(&result.error_motions).titled(format!("Error motions of axis {axis}, µm")));
    }
    let unobservable = result.unobservable.clone();
    confounded::section(&mut report, &ModelResult { unobservable, ..ModelResult::default() });
    if let Some(drawn) = &result.monte_carlo {
        report.section("Monte Carlo");
        report.key(intervals(drawn).titled(format!(
            "Monte Carlo, {}, seed {}; coverage intervals of {} %, µm",
            counted(drawn.draws.runs, "run"),
            drawn.draws.seed,
            drawn.draws.coverage * 100.0
        )));
    }
    report
}

/// Every figure with all its digits, one row each; the meaning of a point of a function is its angle in degrees.
fn values(result: &SelfCalibration) -> Table {
    let mut figures = Figures::default();
    figures.figure("noise", result.noise.source.word(), "", result.noise.value, "um");
    figures.figure("residual", "rms", "", result.rms_um, "um");
    for (section, functions) in [("function", &result.functions), ("error motion", &result.error_motions)] {
        for function in functions {
            for point in &function.points {
                let found = point.value_um.zip(point.u_um);
                figures.estimate(section, &function.id, &point.at_deg.to_string(), found, "um");
            }
        }
    }
    figures.parameters("radius", result.radius.as_slice());
    figures.parameters("axis, by the circle", &result.parameters);
    figures.parameters("axis, by the rotation", &result.parameters_by_turn);
    for quantity in result.monte_carlo.iter().flat_map(|drawn| &drawn.quantities) {
        figures.estimate("Monte Carlo", &quantity.id, "", Some((quantity.mean_um, quantity.u_um)), "um");
        for (name, interval) in [
            ("shortest interval", quantity.shortest_interval_um),
            ("symmetric interval", quantity.symmetric_interval_um),
        ] {
            figures.figure(name, &quantity.id, "low", interval.low, "um");
            figures.figure(name, &quantity.id, "high", interval.high, "um");
        }
    }
    figures.table()
}

/// Functions side by side, one row per angle.
fn functions(functions: &[FunctionResult]) -> Table {
    let mut angles: Vec<f64> = Vec::new();
    for point in functions.iter().flat_map(|function| &function.points) {
        if !angles.contains(&point.at_deg) {
            angles.push(point.at_deg);
        }
    }
    angles.sort_by(f64::total_cmp);
    let cell = |function: &FunctionResult, angle: f64| {
        let point = function.points.iter().find(|point| point.at_deg == angle);
        let Some((value, u)) = point.and_then(|point| Some((point.value_um?, point.u_um?))) else {
            return Cell::from("–");
        };
        if u < 1e-9 {
            return Cell::fixed(value, 2);
        }
        let (value, u) = value_and_u(value, u);
        format!("{value} ± {u}").into()
    };
    let rows = angles.iter().map(|angle| {
        let cells = functions.iter().map(|function| cell(function, *angle));
        std::iter::once(format!("{angle}°").into()).chain(cells).collect()
    });
    let columns = [words("angle")].into_iter().chain(functions.iter().map(|function| numbers(&function.id)));
    Table::new(columns, rows)
}

/// Coverage intervals of the quantities, µm.
fn intervals(drawn: &MonteCarloResult) -> Table {
    let rows = drawn.quantities.iter().map(|quantity| {
        let [mean, u] = Cell::estimate(quantity.mean_um, quantity.u_um);
        let interval = |Interval { low, high }: Interval| {
            let [low, high] = [low, high].map(|end| fixed(end, places(quantity.u_um)));
            format!("{low} to {high}")
        };
        let shortest = interval(quantity.shortest_interval_um);
        cells![&quantity.id, mean, u, shortest, interval(quantity.symmetric_interval_um)]
    });
    let columns = ["quantity", ">mean", ">u", ">shortest", ">symmetric"];
    Table::new(columns, rows)
}
