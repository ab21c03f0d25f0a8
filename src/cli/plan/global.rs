//! `abbe plan --global`: Sobol' indices of the estimates.

use abbe::identify::problem::Problem;
use abbe::identify::quantity::Given;
use abbe::model::Diagnostic;
use abbe::plan::global::{GlobalAnalysis, GlobalOptions, global};
use clap::Args;

/// Global sensitivity.
#[derive(Args)]
pub struct GlobalArguments {
    /// Sobol' indices of each identified error by set-up errors, noise and undeclared effects, with the full fit,
    /// beside the linear prediction.
    #[arg(long, conflicts_with_all = ["improve", "separate", "range", "patterns", "device_mm"])]
    pub global: bool,
    /// Size of an input of --global: half the range of an undeclared effect, or the standard deviation of a set-up
    /// parameter instead of its prior; may be repeated.
    ///
    /// Example: --global --vary EZC~C:h2=2um --vary bar=5um
    #[arg(long = "vary", value_name = "NAME=SIZE", requires = "global", allow_hyphen_values = true)]
    vary: Vec<String>,
    /// Number of samples of --global, a power of two.
    ///
    /// Example: --global --samples 1024
    #[arg(long, value_name = "N", default_value_t = 256, requires = "global")]
    samples: usize,
}

/// Largest number of samples.
const MAX_SAMPLES: usize = 1 << 16;

impl GlobalArguments {
    /// Analyses a plan.
    pub fn run(&self, problem: &Problem, seed: u64) -> Result<GlobalAnalysis, Diagnostic> {
        if !self.samples.is_power_of_two() || !(8..=MAX_SAMPLES).contains(&self.samples) {
            return Err(Diagnostic::other(format!(
                "`--samples {}`: a power of two from 8 to {MAX_SAMPLES} is expected",
                self.samples
            )));
        }
        let vary = self.vary.iter().map(|text| Given::parse(text)).collect::<Result<Vec<_>, _>>()?;
        if let Some((text, _)) = self.vary.iter().zip(&vary).find(|(_, given)| given.value <= 0.0) {
            return Err(Diagnostic::other(format!(
                "`--vary {text}`: half the range or a standard deviation is expected, a number above 0"
            )));
        }
        global(problem, &GlobalOptions { samples: self.samples, seed, vary })
    }
}
