//! The full fit by Monte Carlo: the law of propagation for a linear model, a closed form for a nonlinear one.

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::{prepare, report};
use abbe::identify::monte_carlo::MonteCarlo;
use abbe::identify::propagation::add_monte_carlo;
use abbe::identify::propagation::{DrawnParameter, FitMonteCarlo, Verdict};
use abbe::identify::quantity::Given;
use abbe::identify::simulate::{Simulation, simulate};
use abbe::model::session::Session;

use crate::suite::{abbe, ready, text};

/// A session from the text of its file, with the machine of chapter 5.
fn session(contents: &str) -> Session {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(ready("hermle-c600u/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let path = folder.path().join("session.toml");
    std::fs::write(&path, contents).unwrap();
    let mut session = files::session(&path, &ReadOptions::default()).unwrap();
    session.resolution_mm = None;
    session
}

fn measured(plan: &Session, simulation: &Simulation) -> (Session, Vec<Given>) {
    let simulated = simulate(plan, simulation).unwrap();
    (plan.clone().with_readings(simulated.readings), simulated.truth)
}

fn drawn(session: &Session, runs: u64, seed: u64) -> FitMonteCarlo {
    let (problem, fit) = prepare(session, 1).unwrap();
    let mut result = report(&problem, &fit).unwrap();
    let draws = MonteCarlo { runs, seed, coverage: 0.95 };
    add_monte_carlo(&problem, &fit, &draws, &mut result).unwrap();
    let drawn = result.monte_carlo.unwrap();
    for (parameter, own) in result.model.parameters.iter().zip(&drawn.parameters) {
        assert_eq!(parameter.id, own.id);
        let quoted = if own.verdict == Verdict::Agree { own.gum_u } else { own.u };
        assert_eq!(parameter.u, quoted);
    }
    drawn
}

/// The plan of chapter 5 with a reading every 15°.
fn linear() -> Session {
    let whole = std::fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap();
    let coarse = whole.replace("step_deg = 0.25", "step_deg = 15").replace("step_deg = 0.5", "step_deg = 15");
    let plan = session(&coarse);
    let given = crate::suite::identify::recovery::THESIS.iter().map(|text| Given::parse(text).unwrap());
    let simulation = Simulation { given: given.collect(), draw_setups: true, seed: 5, ..Simulation::default() };
    measured(&plan, &simulation).0
}

#[test]
fn monte_carlo_and_propagation_agree_for_a_linear_model() {
    let session = linear();
    let found = drawn(&session, 20_000, 3);
    assert_eq!(found.unconverged_runs, 0);
    assert!(found.parameters.len() > 8);
    for parameter in &found.parameters {
        // The standard deviation of 20,000 draws has a relative standard uncertainty of 0.005.
        let ratio = parameter.u / parameter.gum_u;
        assert!((ratio - 1.0).abs() < 0.025, "{}: {ratio}", parameter.id);
        let off = (parameter.mean - parameter.value) / parameter.gum_u;
        assert!(off.abs() < 0.035, "{}: {off}", parameter.id);
        assert_ne!(parameter.verdict, Verdict::Differ, "{parameter:?}");
    }
    let agree = found.parameters.iter().filter(|p| p.verdict == Verdict::Agree).count();
    assert!(agree * 10 >= found.parameters.len() * 8, "{agree}");
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let session = linear();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| drawn(&session, 1000, 9));
        serde_json::to_string(&found).unwrap()
    };
    let one = with(1);
    assert_eq!(one, with(3));
    assert_eq!(one, with(4));
    assert_ne!(one, serde_json::to_string(&drawn(&session, 1000, 10)).unwrap());
}

/// Radius of the circle of the ball, and standard uncertainty of the spindle ball along the axis, mm.
const R: f64 = 50.0;
const U_MM: f64 = 0.8;

/// A short bar whose spindle ball has u = 0.8 mm along the axis of C: the estimated error of the bar length depends on
/// the square of that offset.
fn bent() -> Session {
    session(&format!(
        "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n[unknowns]\nerrors = [\"EX0C\", \"EY0C\"]\n\
         [[test]]\nname = \"C\"\nbar_mm = {R}\nworkpiece_ball_mm = [{R}, 0, 0]\nspindle_ball_mm = [0, 0, 0]\nspindle_ball_u_um = [0, 0, {}]\n\
         bar_u_um = inf\nsweep = {{ axis = \"C\", from_deg = 0, to_deg = 330, step_deg = 30, runs = 1, both_directions = false }}\n",
        U_MM * 1e3
    ))
}

fn bar(found: &FitMonteCarlo) -> &DrawnParameter {
    found.parameters.iter().find(|p| p.id.starts_with("bar")).unwrap()
}

/// `√(R² + z²) − R` at `z = k·u`, µm: the error of the bar length.
fn longer_um(k: f64) -> f64 {
    (R.hypot(k * U_MM) - R) * 1e3
}

#[test]
fn monte_carlo_and_propagation_differ_for_a_quadratic_set_up() {
    let (session, _) = measured(&bent(), &Simulation::default());
    let found = drawn(&session, 20_000, 4);
    let bar = bar(&found);
    assert_eq!(bar.verdict, Verdict::Differ, "{bar:?}");
    // Standard deviation of the mean of twelve readings.
    assert!((bar.gum_u - 0.3 / 12.0_f64.sqrt()).abs() < 1e-3, "{}", bar.gum_u);
    // z is Gaussian: |z| is below 2.2414 u with 97.5 %, below 0.0313 u with 2.5 %.
    assert!((bar.symmetric_interval.high - bar.value - longer_um(2.2414)).abs() < 0.8, "{bar:?}");
    assert!((bar.symmetric_interval.low - bar.value - longer_um(0.0313)).abs() < 0.2, "{bar:?}");
    // The shortest interval starts at the edge: |z| is below 1.96 u with 95 %.
    assert!((bar.shortest_interval.high - bar.value - longer_um(1.96)).abs() < 1.0, "{bar:?}");
    let mean = U_MM.powi(2) / (2.0 * R) * 1e3;
    assert!((bar.mean - bar.value - mean).abs() < 0.2, "{bar:?}");
    // The parameters with a linear response still agree.
    let others = found.parameters.iter().filter(|p| p.id.starts_with('E'));
    for parameter in others {
        assert_eq!(parameter.verdict, Verdict::Agree, "{parameter:?}");
    }
}

#[test]
fn the_command_states_which_uncertainty_to_quote() {
    let folder = tempfile::tempdir().unwrap();
    let plan = folder.path().join("plan.toml");
    std::fs::copy(ready("hermle-c600u/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let contents = "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n[unknowns]\nerrors = [\"EX0C\", \"EY0C\"]\n\
         [[test]]\nname = \"C\"\nbar_mm = 50\nworkpiece_ball_mm = [50, 0, 0]\nspindle_ball_mm = [0, 0, 0]\nspindle_ball_u_um = [0, 0, 800]\n\
         bar_u_um = inf\nsweep = { axis = \"C\", from_deg = 0, to_deg = 330, step_deg = 30, runs = 1, both_directions = false }\n";
    std::fs::write(&plan, contents).unwrap();
    let run = folder.path().join("run");
    assert!(abbe(&["simulate", text(&plan), "--out", text(&run)]).status.success());
    let session = run.join("session.toml");
    let session = if session.exists() { session } else { run.join("plan.toml") };
    let json = folder.path().join("fit.json");
    let output = abbe(&["fit", text(&session), "--monte-carlo", "10000", "--all", "--json", text(&json)]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let screen = String::from_utf8(output.stdout).unwrap();
    let line = |id: &str| screen.lines().find(|line| line.trim_start().starts_with(id)).unwrap();
    assert!(line("bar[C]").ends_with("Monte Carlo"), "{screen}");
    assert!(line("EX0C").ends_with("GUM"), "{screen}");
    let found: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    assert_eq!(found["monte_carlo"]["runs"], 10_000);
    let refused = |status: i32, arguments: &[&str], part: &str| {
        let mut all = vec!["fit", text(&session)];
        all.extend(arguments);
        let output = abbe(&all);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(status), "{stderr}");
        assert!(stderr.contains(part), "{stderr}");
    };
    refused(1, &["--monte-carlo", "100"], "at least 10000 runs are needed");
    refused(1, &["--monte-carlo", "10000", "--coverage", "1"], "a probability between");
    refused(2, &["--monte-carlo", "10000", "--method", "circle"], "`--monte-carlo` works with the full fit");
}
