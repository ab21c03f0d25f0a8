//! Which effects a search considers, and how many it adds: options of `abbe trace` and `abbe fleet run`.

use clap::Args;

/// The candidates of a search.
#[derive(Args)]
pub struct SearchArguments {
    /// Maximum number of effects of a session (default: until the held-out error stops improving).
    ///
    /// Example: --max-effects 2
    #[arg(long, value_name = "N")]
    pub max_effects: Option<usize>,
    /// Search only effects whose identifier contains this text; may be repeated.
    ///
    /// Example: --only EZC --only ~time --only :h2
    #[arg(long, value_name = "TEXT", allow_hyphen_values = true)]
    pub only: Vec<String>,
    /// Do not search effects whose identifier contains this text; may be repeated.
    ///
    /// Example: --exclude :spline --exclude ~time
    #[arg(long, value_name = "TEXT", allow_hyphen_values = true)]
    pub exclude: Vec<String>,
}

impl SearchArguments {
    /// The options, for a command line that repeats the search.
    pub fn repeated(&self) -> Vec<(&'static str, String)> {
        let most = self.max_effects.iter().map(|most| ("--max-effects", most.to_string()));
        let only = self.only.iter().map(|text| ("--only", text.clone()));
        most.chain(only).chain(self.exclude.iter().map(|text| ("--exclude", text.clone()))).collect()
    }
}
