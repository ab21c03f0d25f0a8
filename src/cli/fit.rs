//! `abbe fit`.

use abbe::identify::results::{FitResult, ParameterResult, Unobservable};
use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::report::ReportArguments;
use super::{CommonArguments, SessionArguments, geometric, output, read_session, self_calibration, table};

/// Examples of `abbe fit`.
pub const HELP: &str = "Examples:
  abbe fit sessions/hermle-c600u/measured/session.toml --json fit.json
  abbe fit sessions/hermle-c600u/measured/session.toml --report fit.html --plots plots
  abbe fit run1/session.toml --method cone
  abbe fit sessions/self-calibration/measured/session.toml --method self-calibration --monte-carlo 1000000";

/// How errors are identified.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// All unknowns of the session at once, by least squares on the chain.
    Full,
    /// Position errors from the centre of one circle for each axis (thesis, Section 4.2), beside the full fit.
    Circle,
    /// Orientation errors from the cone of the bar with its extension (Sections 4.2.1, 5.2), beside the full fit.
    Cone,
    /// Orientation errors from circles in two planes along each axis (Section 6.1.2), beside the full fit.
    TwoPlane,
    /// Rotary axis, linear axes and artefact apart, from a probed cylinder (Zimmermann & Ibaraki 2020).
    SelfCalibration,
}

/// `abbe fit SESSION`
#[derive(Args)]
pub struct FitArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    faces: ReportArguments,
    /// How errors are identified.
    #[arg(long, value_enum, default_value = "full")]
    method: Method,
    #[command(flatten)]
    draws: self_calibration::DrawArguments,
}

/// Runs `abbe fit`.
pub fn run(arguments: &FitArguments) -> Result<(), Failure> {
    arguments.faces.check()?;
    let session = read_session(&arguments.session)?;
    if arguments.method != Method::Full && arguments.faces.asked() {
        return Err(Failure::Other(
            "`--report` and `--plots` show the full fit; leave `--method` out".to_string(),
        ));
    }
    if arguments.method == Method::SelfCalibration {
        return self_calibration::run(&session, &arguments.draws, &arguments.common);
    }
    arguments.draws.refuse()?;
    let geometric = match arguments.method {
        Method::Full | Method::SelfCalibration => None,
        Method::Circle => Some(abbe::identify::geometric::Method::Circle),
        Method::Cone => Some(abbe::identify::geometric::Method::Cone),
        Method::TwoPlane => Some(abbe::identify::geometric::Method::TwoPlane),
    };
    if let Some(method) = geometric {
        return geometric::run(&session, method, &arguments.common);
    }
    let (problem, fit) = abbe::identify::fit::prepare(&session, arguments.common.seed)?;
    let result = abbe::identify::fit::report(&problem, &fit);
    print(&result);
    if let Some(path) = &arguments.common.json {
        output::write_json(path, &result)?;
    }
    if arguments.faces.asked() {
        let document = crate::report::fit::document(&problem, &fit, &result)?;
        let method = crate::report::fit::method(&result);
        arguments
            .faces
            .write(&document, &method, &session, arguments.common.seed)?;
    }
    Ok(())
}

fn print(result: &FitResult) {
    say!(
        "{} readings, noise {} ({})",
        result.readings,
        table::micrometres(result.noise_um),
        result.noise_source
    );
    say!(
        "residual {}, held out {} (leaving out {})",
        table::micrometres(result.rms_um),
        table::micrometres(result.heldout_rms_um),
        result.heldout_by
    );
    if let (Some(rms), Some(held)) = (result.rms_3d_um, result.heldout_rms_3d_um) {
        say!(
            "length of the 3-vector: residual {}, held out {}",
            table::micrometres(rms),
            table::micrometres(held)
        );
    }
    say!(
        "{} of {} unknowns or combinations of them are seen",
        result.rank,
        result.unknowns
    );
    say!("");
    print_parameters(&result.parameters);
    print_unobservable(&result.unobservable);
    if !result.rejected.is_empty() {
        say!("\nLeft out as wild:");
        for reading in &result.rejected {
            say!(
                "  {} {}:{}  residual {}",
                reading.test,
                reading.file,
                reading.line,
                table::micrometres(reading.residual_um)
            );
        }
    }
    print_warnings(&result.warnings);
}

/// The table of identified parameters.
pub fn print_parameters(parameters: &[ParameterResult]) {
    let rows: Vec<Vec<String>> = parameters
        .iter()
        .map(|p| {
            let (value, u) = table::value_and_u(p.value, p.u);
            vec![p.id.clone(), value, u, p.unit.clone()]
        })
        .collect();
    table::print(&["parameter", "value", "u (k=1)", "unit"], &rows);
}

/// What cannot be seen, in words.
pub fn print_unobservable(unobservable: &[Unobservable]) {
    if unobservable.is_empty() {
        return;
    }
    say!("\nNot seen by these readings:");
    for item in unobservable {
        let terms: Vec<String> = item
            .combination
            .iter()
            .map(|(id, value)| format!("{id} {value:.4}"))
            .collect();
        say!("  {}", item.why);
        if terms.len() > 1 {
            say!("    {}", terms.join(" : "));
        }
    }
}

/// Named warnings, on standard error.
pub fn print_warnings(warnings: &[String]) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}
