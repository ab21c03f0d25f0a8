//! Simulated measured sessions from a recipe, with the true values for assertions.

use super::component::Component;
use super::effect::{Driver, Injected};
use super::files;
use super::kind::Kind;
use super::noise::{Noise, RESOLUTION_UM, normal, traversal};
use super::plan::Plan;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::path::Path;

/// The specification of a simulated session.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// The kind of session.
    pub kind: Kind,
    /// Degrees between readings; see [`Kind::step_deg`].
    pub step_deg: f64,
    /// Undeclared effects of the machine.
    pub effects: Vec<Injected>,
    /// The noise.
    pub noise: Noise,
    /// Proportion of missing rows.
    pub dropped_share: f64,
    /// Whether all tests share one mount of the spindle ball and one bar calibration, as the session file then states.
    pub shared_mounts: bool,
    /// Whether the session file states the noise of the sensor.
    pub states_noise: bool,
    /// Whether the files have a temperature column. They always have one if an effect is driven by temperature.
    pub temperature_column: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Recipe {
    /// About 1,500 readings with white noise of 0.3 µm and no effect. The spindle ball stays mounted between the tests
    /// of [`Kind::TiltedTable`]; in the other kinds every test has its own mount and bar calibration, as in the
    /// samples.
    pub fn new(kind: Kind, seed: u64) -> Recipe {
        Recipe {
            kind,
            step_deg: kind.step_deg(1500),
            effects: Vec::new(),
            noise: Noise::White { sigma_um: 0.3 },
            dropped_share: 0.0,
            shared_mounts: kind == Kind::TiltedTable,
            states_noise: true,
            temperature_column: false,
            seed,
        }
    }

    /// Adds an effect.
    pub fn with(mut self, effect: Injected) -> Recipe {
        self.effects.push(effect);
        self
    }

    /// Replaces the noise.
    pub fn noise(self, noise: Noise) -> Recipe {
        Recipe { noise, ..self }
    }

    /// Sets the approximate number of readings.
    pub fn readings(self, readings: usize) -> Recipe {
        Recipe { step_deg: self.kind.step_deg(readings), ..self }
    }

    /// The plan of the session; the same for every seed, noise and effect.
    pub fn plan(&self) -> Plan {
        Plan::new(self.kind, self.step_deg, self.shared_mounts)
    }

    /// Draws parameters and noise and simulates the readings.
    pub fn draw(&self) -> SimulatedSession {
        self.draw_on(&self.plan())
    }

    /// The same for a plan from [`Recipe::plan`].
    pub fn draw_on(&self, plan: &Plan) -> SimulatedSession {
        self.draw_of(plan, |_| None)
    }

    /// The same with given values of some parameters, by identifier, µm or arcsec; the others are drawn.
    pub fn draw_of(&self, plan: &Plan, given: impl Fn(&str) -> Option<f64>) -> SimulatedSession {
        let mut random = Pcg64Mcg::seed_from_u64(self.seed);
        let values: Vec<f64> = plan
            .unknowns
            .iter()
            .map(|unknown| {
                let sigma = match (unknown.prior_u_um, unknown.component) {
                    (Some(u_um), _) => u_um,
                    (None, component) if component.unit() == "arcsec" => PIGE_SIGMA_ARCSEC,
                    (None, _) => PIGE_SIGMA_UM,
                };
                let drawn = sigma * normal(&mut random);
                given(&unknown.id).unwrap_or(drawn)
            })
            .collect();
        let mut rows = Vec::with_capacity(plan.instants.len());
        let runs = plan.instants.chunk_by(|a, b| (a.test, a.run) == (b.test, b.run));
        for run in runs {
            let first = rows.len();
            for (i, (noise_um, outlier)) in traversal(self.noise, run.len(), &mut random).into_iter().enumerate() {
                let dropped = random.random::<f64>() < self.dropped_share;
                let true_mm = plan.reading_mm(&run[i], &values, &self.effects);
                let reading_um = (true_mm * 1e3 + noise_um) / RESOLUTION_UM;
                rows.push(Row {
                    instant: first + i,
                    length_mm: reading_um.round() * RESOLUTION_UM * 1e-3,
                    outlier,
                    dropped,
                });
            }
        }
        rows.retain(|row| !row.dropped);
        let truth = Truth {
            unknowns: plan
                .unknowns
                .iter()
                .zip(&values)
                .map(|(unknown, value)| TrueValue {
                    id: unknown.id.clone(),
                    component: unknown.component,
                    value: *value,
                    is_setup: unknown.prior_u_um.is_some(),
                })
                .collect(),
            effects: self.effects.clone(),
            noise: self.noise,
            outlier_rows: rows.iter().filter(|row| row.outlier).map(|row| row.instant).collect(),
        };
        let follows_temperature = self.effects.iter().any(|effect| effect.driver == Driver::Temperature);
        let spindle = self.effects.iter().find_map(|effect| match effect.driver {
            Driver::Spindle(spindle) => Some(spindle),
            _ => None,
        });
        let columns = files::DriverColumns { temperature: self.temperature_column || follows_temperature, spindle };
        let files = files::session_files(plan, &rows, columns, self.states_noise);
        SimulatedSession { files, rows, truth }
    }
}

/// Standard deviation of the position errors, µm.
pub const PIGE_SIGMA_UM: f64 = 20.0;
/// Standard deviation of the orientation errors, arcsec.
pub const PIGE_SIGMA_ARCSEC: f64 = 8.0;

/// One simulated reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Its index in [`Plan::instants`].
    pub instant: usize,
    /// The reading, mm, rounded to the resolution of the sensor.
    pub length_mm: f64,
    /// Whether it is a simulated outlier.
    pub outlier: bool,
    dropped: bool,
}

impl Row {
    /// A reading from another source.
    pub fn taken(instant: usize, length_mm: f64) -> Row {
        Row { instant, length_mm, outlier: false, dropped: false }
    }
}

/// The true value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueValue {
    /// `EY0A`, `workpiece_ball[P1].x`.
    pub id: String,
    /// The component.
    pub component: Component,
    /// The value, in µm or arcsec.
    pub value: f64,
    /// Whether it is a set-up offset rather than an error of the machine.
    pub is_setup: bool,
}

/// The true values of a simulated session.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// PIGEs and set-up offsets in the order of [`Plan::unknowns`].
    pub unknowns: Vec<TrueValue>,
    /// The injected effects.
    pub effects: Vec<Injected>,
    /// The noise of the sensor.
    pub noise: Noise,
    /// Indices in [`Plan::instants`] of the simulated outliers.
    pub outlier_rows: Vec<usize>,
}

impl Truth {
    /// The true value of a parameter in µm or arcsec.
    pub fn value(&self, id: &str) -> Option<f64> {
        self.unknowns.iter().find(|known| known.id == id).map(|known| known.value)
    }

    /// The errors of the machine: name, value, unit (`um` or `arcsec`).
    pub fn piges(&self) -> impl Iterator<Item = (&str, f64, &'static str)> {
        self.unknowns
            .iter()
            .filter(|known| !known.is_setup)
            .map(|known| (known.id.as_str(), known.value, known.component.unit()))
    }
}

/// A simulated measured session with its true values.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedSession {
    /// Names and texts of `session.toml`, `machine.toml` and the data files.
    pub files: Vec<(String, String)>,
    /// The readings, in the order of the data files.
    pub rows: Vec<Row>,
    /// The true values, for assertions only.
    pub truth: Truth,
}

impl SimulatedSession {
    /// Writes the folder of the session, without the true values.
    ///
    /// # Errors
    /// If the folder or a file cannot be written.
    pub fn write(&self, folder: &Path) -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        self.files.iter().try_for_each(|(name, text)| std::fs::write(folder.join(name), text))
    }

    /// Writes the true values to `NAME.json` in another folder.
    ///
    /// # Errors
    /// If the folder or the file cannot be written.
    pub fn write_truth(&self, folder: &Path, name: &str) -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let text = format!("{:#}\n", files::truth_json(&self.truth));
        std::fs::write(folder.join(format!("{name}.json")), text)
    }
}
