//! `abbe fit SESSION --repeat …`.

use std::path::{Path, PathBuf};

use abbe::identify::repeated::{self, Repeated, Scatter};
use abbe::model::words::counted;

use super::failure::Failure;
use super::output::{self, Outputs};
use super::{CommonArguments, SessionArguments, fit, read_session, table};

/// Fits every session by itself and compares them.
pub fn run(
    first: &SessionArguments,
    repeat: &[PathBuf],
    common: &CommonArguments,
    outputs: &Outputs,
) -> Result<(), Failure> {
    let all: Vec<&Path> = std::iter::once(&first.session)
        .chain(repeat)
        .map(PathBuf::as_path)
        .collect();
    let mut sessions = Vec::with_capacity(all.len());
    for (place, path) in all.iter().enumerate() {
        let twice = all[..place].iter().any(|earlier| output::is_same(earlier, path));
        if twice {
            return Err(Failure::Other(format!(
                "{} is named twice: a session is no repeat of itself",
                path.display()
            )));
        }
        let arguments = SessionArguments {
            session: path.to_path_buf(),
            ..first.clone()
        };
        let (session, _) = read_session(&arguments, outputs)?;
        let (problem, fit) = abbe::identify::fit::prepare(&session, common.seed)?;
        let report = abbe::identify::fit::report(&problem, &fit);
        let named: Vec<String> = report
            .warnings
            .iter()
            .map(|warning| format!("{}: {warning}", path.display()))
            .collect();
        fit::print_warnings(&named);
        sessions.push(repeated::Session::new(
            &path.display().to_string(),
            &problem,
            &fit,
        ));
    }
    let result = repeated::compare(&sessions)?;
    if outputs.tables(common.quiet) {
        print(&result);
    }
    if let Some(path) = &common.json {
        output::write_json(path, &result)?;
    }
    Ok(())
}

fn print(result: &Repeated) {
    say!(
        "{} of one plan, each fitted by itself\n",
        counted(result.sessions.len(), "session")
    );
    let rows: Vec<Vec<String>> = result
        .parameters
        .iter()
        .map(|parameter| {
            let (mean, u_type_a) = table::value_and_u(parameter.mean, parameter.u_type_a);
            let (_, s) = table::value_and_u(parameter.mean, parameter.s);
            let (_, u_type_b) = table::value_and_u(parameter.mean, parameter.u_type_b);
            let number = |value: Option<f64>, digits: usize| {
                value.map_or("–".to_string(), |value| format!("{value:.digits$}"))
            };
            vec![
                parameter.id.clone(),
                mean,
                u_type_a,
                s,
                u_type_b,
                parameter.unit.clone(),
                number(parameter.ratio, 2),
                number(parameter.p_value, 3),
                match parameter.scatter {
                    Scatter::AsStated => "",
                    Scatter::More => "scatters more than the fits say",
                    Scatter::Less => "scatters less than the fits say",
                }
                .to_string(),
            ]
        })
        .collect();
    table::print(
        &[
            "parameter",
            "mean",
            "s/√n (A)",
            "s (A)",
            "u (B)",
            "unit",
            "s/u",
            "p",
            "",
        ],
        &rows,
    );
    say!(
        "\nA: over the sessions, of their mean and of one; B: of one session by its fit; p: of such an s/u by chance"
    );
    if result.deviating.is_empty() {
        if result.sessions.len() > 2 {
            say!("No session is off the others by more than the fits explain");
        }
        return;
    }
    say!("\nOff the mean of the others:");
    let rows: Vec<Vec<String>> = result
        .deviating
        .iter()
        .map(|off| {
            let (by, u) = table::value_and_u(off.deviation, off.u);
            vec![
                off.session.clone(),
                off.id.clone(),
                by,
                u,
                off.unit.clone(),
                format!("{:.1}", (off.deviation / off.u).abs()),
            ]
        })
        .collect();
    table::print(
        &["session", "parameter", "by", "u (k=1)", "unit", "times u"],
        &rows,
    );
}
