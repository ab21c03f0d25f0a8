//! Results as CSV: one row a figure, for spreadsheets.

use std::path::Path;

use abbe::identify::circular::CircularTest;
use abbe::identify::results::{FitResult, ParameterResult, TraceResult};

use super::failure::Failure;
use super::output;

/// How the signs are meant, in front of the table.
const CONVENTION: &str = "# Errors by their names of ISO 230-1: EX0C is a location error, EXC an error motion. Value = actual less nominal: the body that the axis\n\
# carries is displaced along +X, +Y, +Z of R and turned about them by the right-hand rule, E = Trans(EX, EY, EZ) Rx(EA) Ry(EB) Rz(EC), whatever\n\
# the axis' own direction. A correction has the opposite sign. u is one standard uncertainty.\n";
const HEADER: [&str; 6] = ["section", "id", "meaning", "value", "u", "unit"];

#[derive(Default)]
struct Rows(Vec<Vec<String>>);

impl Rows {
    fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.0.push(cells.into());
    }

    fn parameters(&mut self, section: &str, parameters: &[ParameterResult]) {
        for parameter in parameters {
            self.row([
                section.to_string(),
                parameter.id.clone(),
                parameter.meaning.clone(),
                parameter.value.to_string(),
                parameter.u.to_string(),
                parameter.unit.clone(),
            ]);
        }
    }

    fn figure(&mut self, section: &str, id: &str, meaning: &str, value: f64, unit: &str) {
        let value = value.to_string();
        self.row([section, id, meaning, &value, "", unit].map(str::to_string));
    }

    fn circular(&mut self, test: &CircularTest) {
        let section = format!("circle {}", test.test);
        for direction in &test.directions {
            let of = |figure: &str| format!("{figure}({}{})", test.axes, direction.direction);
            for (id, meaning, value) in [
                (of("G"), "circular deviation", direction.circular_deviation_um),
                (of("Fmax"), "radial deviation, greatest", direction.radial_deviation_max_um),
                (of("Fmin"), "radial deviation, least", direction.radial_deviation_min_um),
            ] {
                self.figure(&section, &id, meaning, value, "um");
            }
        }
        for (id, meaning, value) in [
            ("G(b)", "bidirectional circular deviation", test.bidirectional_circular_deviation_um),
            ("D", "mean bidirectional radial deviation", test.mean_bidirectional_radial_deviation_um),
            ("H", "circular hysteresis", test.hysteresis_um),
        ] {
            if let Some(value) = value {
                self.figure(&section, id, meaning, value, "um");
            }
        }
        for fault in &test.diagnosis {
            for value in &fault.values {
                self.row([
                    section.clone(),
                    format!("{} {}", fault.fault, value.id),
                    format!("{} of {}, {:.1} % of the path", fault.fault, fault.axes, fault.share_percent),
                    value.value.to_string(),
                    if value.u > 0.0 { value.u.to_string() } else { String::new() },
                    value.unit.clone(),
                ]);
            }
        }
    }

    fn write(self, path: &Path) -> Result<(), Failure> {
        let table = output::csv(&HEADER.map(String::from), self.0)?;
        output::write_whole(path, &[CONVENTION.as_bytes(), &table].concat())
    }
}

/// Writes what `abbe fit` found.
pub fn write_fit(path: &Path, result: &FitResult) -> Result<(), Failure> {
    let mut rows = Rows::default();
    rows.figure("residual", "rms", "", result.rms_um, "um");
    rows.figure("residual", "held out", "", result.heldout_rms_um, "um");
    rows.parameters("parameters", &result.parameters);
    for test in &result.circular {
        rows.circular(test);
    }
    rows.write(path)
}

/// Writes what `abbe trace` found.
pub fn write_trace(path: &Path, result: &TraceResult) -> Result<(), Failure> {
    let mut rows = Rows::default();
    if result.interrupted {
        let meaning = format!("{}: the result is incomplete", result.interruption());
        rows.row(["search", "interrupted", &meaning, "", "", ""].map(str::to_string));
    }
    for (name, model) in [("before", &result.before), ("after", &result.after)] {
        rows.figure(name, "rms", "", model.rms_um, "um");
        rows.figure(name, "held out", "", model.heldout_rms_um, "um");
        rows.parameters(name, &model.parameters);
    }
    for (index, effect) in result.effects.iter().enumerate() {
        let section = format!("effect {}", index + 1);
        for number in &effect.shape_parameters {
            for value in &number.values {
                rows.figure(&section, &number.name, "", *value, &number.unit);
            }
        }
        rows.parameters(&section, &effect.parameters);
    }
    rows.write(path)
}
