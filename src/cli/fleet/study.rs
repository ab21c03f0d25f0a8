//! `abbe fleet study`: simulate and analyse many sessions.

use std::path::PathBuf;

use abbe::fleet::store::Store;
use abbe::fleet::study;
use abbe::fleet::study::file;
use abbe::fleet::study::summary::summary;
use abbe::model::Diagnostic;
use clap::Args;

use super::all;
use crate::cli::results::{OutputArguments, Read};
use crate::report::study as present;

/// Examples of `abbe fleet study`.
pub const HELP: &str = include_str!("../help/study.txt");

/// `abbe fleet study STUDY --out DIR`
#[derive(Args)]
pub struct StudyArguments {
    /// The study file.
    #[arg(value_name = "STUDY")]
    study: PathBuf,
    /// Where the result is written: a folder, new or that of an earlier run.
    ///
    /// Example: --out study
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    output: OutputArguments,
}

/// Runs `abbe fleet study`.
pub fn run(arguments: &StudyArguments, threads: u32) -> Result<(), Diagnostic> {
    let outputs = arguments.output.prepared(&[])?;
    outputs.refuse_overwrite([arguments.study.as_path()])?;
    let study = file::read(&arguments.study)?;
    let store = Store::open(&arguments.out)?;
    store.remove_stale();
    let numbers: Vec<usize> = (0..study.draws()).collect();
    let words = ("draws", numbers.len().to_string());
    let (draws, ended) =
        all(&numbers, words, (threads, arguments.output.quiet), |number, if_claimed, should_continue| {
            let draw = study::run(&study, *number, &store, if_claimed, should_continue)?;
            Ok(draw.map(|(_, draw)| draw))
        });
    ended?;
    let result = summary(&draws);
    let failed = draws.iter().find(|draw| draw.error.is_some());
    let read = Read { seed: Some(study.file.study.seed), ..Read::files(&study.stamp) };
    arguments.output.put(&outputs, &present::report(&result, failed), &result, &read)
}
