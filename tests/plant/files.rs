//! The files of a session, in the formats that Abbe reads. They declare no effect.

use super::component::AxisName;
use super::kind::{BAR_U_UM, Kind, SPINDLE_BALL_U_UM};
use super::naming::named;
use super::noise::{Noise, RESOLUTION_UM};
use super::plan::{Plan, bar_setup};
use super::recipe::{Row, Truth};
use super::spindle::Spindle;
use serde_json::{Value, json};
use std::fmt::Write;

/// The noise that the session file states, independently of the true noise.
const STATED_NOISE_UM: f64 = 0.3;

/// The columns of the data files that are no axes.
#[derive(Clone, Copy, Debug, Default)]
pub struct DriverColumns {
    /// Whether there is a column of the ambient temperature.
    pub temperature: bool,
    /// The temperature of the spindle.
    pub spindle: Option<Spindle>,
}

/// `session.toml`, `machine.toml` and one data file per test.
pub fn session_files(plan: &Plan, rows: &[Row], columns: DriverColumns, states_noise: bool) -> Vec<(String, String)> {
    let mut files = vec![
        ("session.toml".to_string(), session_toml(plan, states_noise)),
        ("machine.toml".to_string(), machine_toml(plan.kind)),
    ];
    for (index, test) in plan.tests.iter().enumerate() {
        let rows = rows.iter().filter(|row| plan.instants[row.instant].test == index);
        files.push((format!("{}.csv", test.name), data_csv(plan, rows, columns)));
    }
    files
}

fn data_csv<'a>(plan: &Plan, rows: impl Iterator<Item = &'a Row>, columns: DriverColumns) -> String {
    let temperature = if columns.temperature { ",temperature_c" } else { "" };
    let spindle = columns.spindle.map_or(String::new(), |_| format!(",{}", Spindle::COLUMN));
    let mut text = format!("time_s,run,x_mm,y_mm,z_mm,a_deg,c_deg{temperature}{spindle},length_mm\n");
    for row in rows {
        let instant = &plan.instants[row.instant];
        let _ = write!(text, "{:.3},{}", instant.time_s, instant.run);
        for axis in AxisName::ALL {
            let position = instant.commanded.position[axis.index()];
            let shown = if axis.is_rotary() { position.to_degrees() } else { position };
            let _ = write!(text, ",{shown:.6}");
        }
        if columns.temperature {
            let _ = write!(text, ",{:.2}", instant.temperature_c);
        }
        if let Some(spindle) = columns.spindle {
            let _ = write!(text, ",{:.2}", spindle.temperature_c(instant.time_s));
        }
        let _ = writeln!(text, ",{:.4}", row.length_mm);
    }
    text
}

fn session_toml(plan: &Plan, states_noise: bool) -> String {
    let noise = if states_noise { format!("noise_um = {STATED_NOISE_UM}\n") } else { String::new() };
    let mut text = format!(
        "[machine]\nfile = \"machine.toml\"\n\n[instrument]\nkind = \"ballbar\"\n{noise}\
         resolution_um = {RESOLUTION_UM}\n"
    );
    if let Some(errors) = plan.kind.declared_unknowns() {
        let names: Vec<String> = errors.iter().map(|error| format!("\"{error}\"")).collect();
        let _ = write!(text, "\n[unknowns]\nerrors = [{}]\n", names.join(", "));
    }
    let ball_u_um = plan.kind.workpiece_ball_u_um();
    for test in &plan.tests {
        let stated = &test.stated;
        let _ = write!(
            text,
            "\n[[test]]\nname = \"{name}\"\ndata = \"{name}.csv\"\nbar_mm = {bar:?}\nworkpiece_ball_mm = {workpiece:?}\n\
             {frame}spindle_ball_mm = {spindle:?}\nsetup = \"{setup}\"\n",
            name = test.name,
            bar = stated.bar_mm,
            workpiece = stated.workpiece_ball_mm,
            frame = if stated.workpiece_ball_on == AxisName::A { "workpiece_ball_frame = \"axis A\"\n" } else { "" },
            spindle = stated.spindle_ball_mm,
            setup = test.setup,
        );
        if plan.shared_mounts {
            let _ = write!(text, "spindle_setup = \"S1\"\nbar_setup = \"{}\"\n", bar_setup(test));
        }
        let _ = write!(
            text,
            "bar_u_um = {BAR_U_UM:?}\nworkpiece_ball_u_um = {:?}\nspindle_ball_u_um = {:?}\n",
            [ball_u_um; 3], [SPINDLE_BALL_U_UM; 3],
        );
    }
    text
}

fn machine_toml(kind: Kind) -> String {
    let x_travel_mm = if kind == Kind::Chapter6 { 600 } else { 300 };
    format!(
        "name = \"Hermle C600U\"\nchain = \"w C A b Y X Z t\"\n\n\
         [axis.C]\ndirection = [0, 0, 1]\norigin_mm = [0, 0, 0]\ntravel_deg = [-1e9, 1e9]\n\n\
         [axis.A]\ndirection = [1, 0, 0]\norigin_mm = [0, 0, 0]\ntravel_deg = [-115, 115]\n\n\
         [axis.X]\ndirection = [1, 0, 0]\ntravel_mm = [-{x_travel_mm}, {x_travel_mm}]\n\n\
         [axis.Y]\ndirection = [0, 1, 0]\ntravel_mm = [-250, 250]\n\n\
         [axis.Z]\ndirection = [0, 0, 1]\ntravel_mm = [-250, 250]\n"
    )
}

/// The true values: PIGEs as `[value, unit]`, set-up offsets in µm by the names of results, effects with amplitude and
/// unit, noise.
pub fn truth_json(truth: &Truth) -> Value {
    let noise = match truth.noise {
        Noise::White { .. } => json!({ "kind": "white" }),
        Noise::Serial { coefficient, .. } => json!({ "kind": "serial", "coefficient": coefficient }),
        Noise::Outliers { share, .. } => json!({ "kind": "outliers", "share": share }),
    };
    let piges: serde_json::Map<String, Value> =
        truth.piges().map(|(id, value, unit)| (id.to_string(), json!([value, unit]))).collect();
    let setup: serde_json::Map<String, Value> = truth
        .unknowns
        .iter()
        .filter(|known| known.is_setup)
        .map(|known| (known.id.clone(), json!(known.value)))
        .collect();
    let effects: Vec<Value> = truth
        .effects
        .iter()
        .map(|effect| {
            let named = named(effect);
            json!({
                "component": named.component,
                "driver": named.driver,
                "shape": named.shape,
                "order": named.order,
                "amplitude": effect.amplitude,
                "unit": effect.unit(),
                "details": format!("{:?}", effect.shape),
            })
        })
        .collect();
    json!({
        "pige": piges,
        "setup_um": setup,
        "effects": effects,
        "noise_um": truth.noise.sigma_um(),
        "noise": noise,
        "outlier_rows": truth.outlier_rows,
    })
}
