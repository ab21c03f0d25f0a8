//! `abbe trace`.

use std::sync::Mutex;
use std::time::Duration;

use abbe::identify::plan::test_variations::TestVariations;
use abbe::identify::results::{EffectName, ModelResult, TraceResult};
use abbe::identify::trace::separating_tests::separate_aliases;
use abbe::identify::trace::{Progress, TraceOptions, library};
use abbe::model::files::toml::{rewrite, write};
use abbe::model::words::counted;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::failure::Failure;
use super::interrupt::Interrupts;
use super::message::{Kind, tell};
use super::report::ReportArguments;
use super::{
    CommonArguments, SessionArguments, compensation, csv, fit, output, plausibility, read_session, table,
    uniqueness,
};

/// `abbe trace SESSION`
#[derive(Args)]
pub struct TraceArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    faces: ReportArguments,
    /// Maximum number of effects (default: until the held-out error stops improving).
    #[arg(long, value_name = "N")]
    max_effects: Option<usize>,
    /// Look only for effects whose identifier contains this (`EZC`, `~time`, `:h2`); may be repeated.
    #[arg(long, value_name = "TEXT")]
    only: Vec<String>,
    /// Do not look for effects whose identifier contains this; may be repeated.
    #[arg(long, value_name = "TEXT")]
    exclude: Vec<String>,
    /// List the library for this session, with what its readings can see, and stop.
    #[arg(long, conflicts_with_all = ["json", "csv", "write", "report", "plots", "compensation", "max_effects"])]
    list: bool,
    /// Write the session that declares the found effects.
    #[arg(long, value_name = "FILE")]
    write: Option<std::path::PathBuf>,
    /// Write the result as CSV, one row a figure.
    #[arg(long, value_name = "FILE")]
    csv: Option<std::path::PathBuf>,
    #[command(flatten)]
    compensation: compensation::CompensationArguments,
}

/// Runs `abbe trace`.
pub fn run(arguments: &TraceArguments) -> Result<(), Failure> {
    arguments.faces.check()?;
    arguments.compensation.check()?;
    let others = [
        arguments.csv.as_ref(),
        arguments.write.as_ref(),
        arguments.faces.file(),
    ];
    let outputs = arguments.common.outputs(&others)?;
    let tables = outputs.tables(arguments.common.quiet);
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let options = TraceOptions {
        seed: arguments.common.seed,
        max_effects: arguments.max_effects,
        only: arguments.only.clone(),
        exclude: arguments.exclude.clone(),
        ..TraceOptions::default()
    };
    if arguments.list {
        return list(&session, &options);
    }
    let bar = progress_bar(arguments.common.quiet);
    let interrupts = Interrupts::handled(bar.clone());
    let shown = Mutex::new(());
    let report = |progress: Progress| {
        if matches!(progress, Progress::Working) {
            // Asked often, from many threads: nothing to show.
            interrupts.keep_results();
            return !interrupts.came();
        }
        let _one_at_a_time = shown.lock();
        match progress {
            Progress::Fitting => bar.set_message("fitting the declared model"),
            Progress::Screening(candidates) => {
                bar.set_message(format!("screening {}", counted(candidates, "candidate")))
            }
            Progress::SelectedEffect(number, id, rms_um) => {
                let effects = counted(number, "effect");
                bar.set_message(format!("{effects}, held out {rms_um:.2} µm: {id}"));
                if !arguments.common.quiet {
                    bar.suspend(|| eprintln!("  + {id:<28} held out {rms_um:.3} µm"));
                }
            }
            Progress::Judging => bar.set_message("refitting and judging"),
            Progress::Working => {}
        }
        !interrupts.came()
    };
    let mut trace = abbe::identify::trace::trace(&session, &options, &report)?;
    bar.set_message("weighing further tests");
    separate_aliases(&mut trace, &TestVariations::short(), &report)?;
    interrupts.end_at_once();
    bar.finish_and_clear();
    if tables {
        print(&trace.result);
    }
    fit::print_warnings(&trace.result.warnings);
    if let Some(path) = &arguments.common.json {
        output::write_json(path, &trace.result)?;
    }
    if let Some(path) = &arguments.write {
        let data = arguments.session.data.as_deref();
        let text = rewrite::relocated(&sources.text, &sources.file, output::folder_of(path), data)?;
        let mut next = write::with_effects(&text, &trace.effects, &session.machine);
        if trace.result.interrupted {
            let interruption = trace.result.interruption();
            next = format!("# The trace was {interruption}: effects may be missing.\n{next}");
        }
        output::write_whole(path, next.as_bytes())?;
        let [own, there] = [&sources.file, path].map(|file| output::folder_of(file).canonicalize().ok());
        if own != there {
            let note = format!(
                "{} names its machine and data where they are; commands read it with --allow-outside",
                path.display()
            );
            tell(Kind::Note, &note);
        }
    }
    if let Some(path) = &arguments.csv {
        csv::write_trace(path, &trace.result)?;
    }
    if arguments.faces.asked() {
        let document = crate::report::trace::document(&trace)?;
        let method = crate::report::trace::method(&trace.result);
        arguments
            .faces
            .write(&document, &method, (&session, &sources), arguments.common.seed)?;
    }
    if trace.result.interrupted {
        if arguments.compensation.wanted() {
            eprintln!("warning: no compensation tables are written: effects may be missing from the model");
        }
        return Err(Failure::Interrupted(trace.result.interruption()));
    }
    arguments.compensation.run(&trace.after, &trace.after_fit, tables)
}

fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

fn list(session: &abbe::model::session::Session, options: &TraceOptions) -> Result<(), Failure> {
    let families = library::families()?;
    let entries = abbe::identify::trace::screening::screened_effects(session, options)?;
    for (number, family) in families.iter().enumerate() {
        let of_family: Vec<_> = entries.iter().filter(|entry| entry.family == number).collect();
        let seen = of_family.iter().filter(|entry| entry.observable).count();
        let candidates = counted(of_family.len(), "candidate");
        say!("{}: {candidates}, {seen} seen", family.name);
        for entry in of_family {
            say!(
                "  {} {}",
                if entry.observable { "seen    " } else { "not seen" },
                entry.id
            );
        }
    }
    Ok(())
}

/// What uncertainties follow from, in words: the residual of a model is not called noise.
fn noise(result: &TraceResult) -> String {
    if result.noise_source != "residual" || result.effects.is_empty() {
        return fit::noise(result.noise_um, &result.noise_source);
    }
    format!(
        "residual of the declared model {}, with the effects {} (no noise stated, no repeats)",
        table::micrometres(result.before.noise_um),
        table::micrometres(result.after.noise_um)
    )
}

fn print(result: &TraceResult) {
    plausibility::print(&result.plausibility);
    say!("Verdict: {}", result.verdict);
    if let Some(headline) = uniqueness::headline(result) {
        say!("{headline}");
    }
    say!(
        "{}, {}; {} of {} can be seen",
        counted(result.readings, "reading"),
        noise(result),
        result.candidates_detectable,
        counted(result.candidates, "candidate")
    );
    say!("The declared model leaves: {}", result.residual_before);
    say!("");
    let row = |name: &str, model: &ModelResult| {
        let mut cells = vec![
            name.to_string(),
            format!("{:.3}", model.rms_um),
            format!("{:.3}", model.heldout_rms_um),
        ];
        if let (Some(rms), Some(held)) = (model.rms_3d_um, model.heldout_rms_3d_um) {
            cells.extend([format!("{rms:.1}"), format!("{held:.1}")]);
        }
        cells
    };
    let mut header = vec!["residual, µm", "rms", "held out"];
    if result.before.rms_3d_um.is_some() {
        header.extend(["3-vector", "held out"]);
    }
    table::print(
        &header,
        &[row("before", &result.before), row("after", &result.after)],
    );
    say!("held out: leaving out {}", result.heldout_by);
    for (number, effect) in result.effects.iter().enumerate() {
        say!("\n{}. {}  ({})", number + 1, name(&effect.name), effect.family);
        say!("   {}", effect.name.meaning);
        for number in &effect.shape_parameters {
            say!("   {}", table::shape_number(number));
        }
        for p in &effect.parameters {
            let (value, u) = table::value_and_u(p.value, p.u);
            say!("   {}  {value} ± {u} {}", p.id, p.unit);
        }
        say!(
            "   explains {} rms; p ≤ {:.3}",
            table::micrometres(effect.rms_gain_um),
            effect.p_value
        );
        say!(
            "   {}",
            uniqueness::standing(effect, result.candidates_detectable)
        );
        for alias in &effect.aliases {
            say!("     or {}  ({})", alias.meaning, name(alias));
        }
        for sentence in uniqueness::tests(effect, name) {
            say!("   {sentence}");
        }
    }
    for rejected in &result.rejected_candidates {
        say!(
            "\nNot claimed: {} (p ≤ {:.3}); the held-out rms falls by {:.4} µm, with a standard error of {:.4} µm",
            name(&rejected.name),
            rejected.p_value,
            rejected.heldout_decrease_um,
            rejected.u_heldout_decrease_um
        );
    }
    if result.remainder.structured {
        say!(
            "\nStructure remains (p ≤ {:.3}): {}",
            result.remainder.p_value,
            result.remainder.place.as_deref().unwrap_or("")
        );
    }
    if !result.after.parameters.is_empty() {
        say!("");
        fit::print_parameters(&result.after.parameters);
    }
    if !result.changed_parameters.is_empty() {
        say!("\nMoved by more than their uncertainty when the effects were added (the bias before):");
        for moved in &result.changed_parameters {
            let (by, u) = table::value_and_u(moved.change, moved.u);
            say!("  {}  by {by} {} (u {u})", moved.id, moved.unit);
        }
    }
}

/// An effect in words.
pub fn name(effect: &EffectName) -> String {
    let order = effect
        .order
        .map_or(String::new(), |order| format!(" order {order}"));
    let tests = if effect.tests.is_empty() {
        String::new()
    } else {
        format!(" in {}", effect.tests.join(", "))
    };
    format!(
        "{} over {}: {}{order}{tests}",
        effect.component, effect.driver, effect.shape
    )
}
