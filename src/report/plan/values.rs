//! The figures of a plan with all their digits, one row each.

use abbe::plan::results::{EffectDetectability, ErrorAnalysis, PlanAnalysis};

use crate::report::table::{Cell, Table, cells, numbers, words};

/// The table of `--csv`.
pub fn values(analysis: &PlanAnalysis) -> Table {
    let mut rows = Rows(Vec::new());
    rows.add("plan", "noise", "", analysis.noise.value, analysis.noise.unit.name());
    rows.add("plan", "readings", "", analysis.readings as f64, "");
    rows.some("plan", "movement", "", analysis.moving_min, "min");
    for test in &analysis.tests {
        rows.add("test", &test.name, "readings", test.readings as f64, "");
        rows.some("test", &test.name, "movement", test.moving_min, "min");
    }
    analysis.errors.iter().for_each(|error| rows.error(error));
    let correlation = &analysis.correlation;
    for (row, id) in correlation.matrix.iter().zip(&correlation.ids) {
        let pairs = row.iter().zip(&correlation.ids).take_while(|(_, other)| *other != id);
        pairs.for_each(|(value, other)| rows.some("correlation", id, other, *value, ""));
    }
    for without in &analysis.leave_one_out {
        let inflated = without.variance_inflation.iter();
        inflated.for_each(|own| rows.some("variance without a test", &own.id, &without.test, own.factor, "1"));
    }
    let indices = &analysis.indices;
    for (name, value) in [
        ("condition number", indices.condition_number),
        ("O1", indices.o1),
        ("O2", indices.o2),
        ("O3", indices.o3),
        ("O4", indices.o4),
        ("O5", indices.o5),
        ("D-efficiency", indices.d_efficiency),
        ("A-efficiency", indices.a_efficiency),
        ("E-efficiency", indices.e_efficiency),
        ("G-efficiency", indices.g_efficiency),
    ] {
        rows.add("index", name, "", value, "");
    }
    analysis.clearances.iter().for_each(|own| rows.add("clearance", &own.test, "", own.clearance_mm, "mm"));
    analysis.effects.iter().flat_map(|effects| &effects.effects).for_each(|effect| rows.effect(effect));
    let columns = ["section", "id", "of"].map(words).into_iter().chain([numbers("value"), words("unit")]);
    Table::new(columns, rows.0)
}

struct Rows(Vec<Vec<Cell>>);

impl Rows {
    fn add(&mut self, section: &str, id: &str, of: &str, value: f64, unit: &str) {
        self.0.push(cells![section, id, of, Cell::exact(value), unit]);
    }

    fn some(&mut self, section: &str, id: &str, of: &str, value: Option<f64>, unit: &str) {
        value.into_iter().for_each(|value| self.add(section, id, of, value, unit));
    }

    fn error(&mut self, error: &ErrorAnalysis) {
        let (id, unit, sensitivity) = (&error.id, &error.unit, &error.sensitivity);
        self.some("uncertainty", id, "", error.u, unit);
        self.some("conditional uncertainty", id, "", error.conditional_u, unit);
        self.add("largest sensitivity", id, &sensitivity.largest_in_test, sensitivity.largest, &sensitivity.unit);
        self.add("rms sensitivity", id, "", sensitivity.rms, &sensitivity.unit);
        error.budget.iter().for_each(|part| self.add("budget", id, &part.source, part.u, unit));
    }

    fn effect(&mut self, effect: &EffectDetectability) {
        let (id, unit) = (&effect.id, &effect.unit);
        self.some("detectable amplitude", id, "", effect.detectable_amplitude, unit);
        self.some("detectable amplitude of all", id, "", effect.detectable_amplitude_screened, unit);
        self.add("share in the residual", id, "", effect.residual_share, "1");
        effect.biases.iter().for_each(|bias| self.add("bias", id, &bias.id, bias.per_unit, &bias.unit));
    }
}
