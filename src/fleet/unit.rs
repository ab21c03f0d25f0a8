//! The unit of work: fit, trace and validation of one session.
//!
//! Its key is the SHA-256 of the contents of all inputs, of the options and of the build of the program. A record is
//! therefore the same whoever computes it, and is computed once. Seeds follow from the same without the build, so that
//! results of two builds differ by what the program computes alone.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use abbe_files::stamp::FileStamp;
use abbe_files::{ReadOptions, Source, SourceMap};
use abbe_identify::model_file::{self, InputFile};
use abbe_model::Diagnostic;
use abbe_model::document::{of_domain, print};
use abbe_model::session::Session;
use abbe_trace::SessionFit;
use abbe_trace::validate::validate;
use abbe_trace::{Progress, TraceOptions, trace};
use sha2::{Digest, Sha256};

use super::options::Options;
use super::record::{BaseRecord, EffectRecord, ErrorRecord, MachineRecord, Record, SCHEMA_VERSION, ValidationRecord};
use super::store::{IfClaimed, Pointer, Search, Store};
use super::{BUILD, ShouldContinue, interrupted};

/// Bits of a seed: every reader of JSON keeps an integer of this size.
const SEED_BITS: u32 = 52;

/// Where the unit of work finds its inputs.
#[derive(Clone, Debug, Default)]
pub struct Places {
    /// Folder of the models: `MACHINE.json` is the model of the machine with this identifier.
    pub models: Option<PathBuf>,
    /// Allow sessions to read files outside their own folders.
    pub allow_outside: bool,
}

/// What became of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// Its record was computed.
    Computed,
    /// Its record was there.
    Kept,
}

/// A session as it was read, or why it was not.
struct Inputs {
    read: Result<(Session, SourceMap), String>,
    record: Record,
    model: Option<Model>,
}

/// The model of a machine: its text, and its checksum; `None` if it cannot be read.
struct Model {
    source: Result<Source, Diagnostic>,
    sha256: Option<String>,
}

/// Analyses a session if the store has no record of it, and notes it in the store. `None` if another process analyses
/// it and `if_claimed` says to skip it.
///
/// # Errors
/// If the store cannot be read or written, or `should_continue` returned `false`. A session that cannot be analysed is a record
/// with its error.
pub fn run(
    file: &Path,
    options: &Options,
    places: &Places,
    store: &Store,
    if_claimed: IfClaimed,
    should_continue: ShouldContinue<'_>,
) -> Result<Option<(Done, Pointer)>, Diagnostic> {
    let inputs = inputs(file, options, places);
    let key = inputs.record.key.clone();
    let (done, record) = match store.found_or_claimed(&key, if_claimed, should_continue)? {
        Search::Skipped => return Ok(None),
        Search::Found(record) => (Done::Kept, *record),
        Search::Claimed(_claim) => {
            let record = record(inputs, should_continue)?;
            store.write(&record)?;
            (Done::Computed, record)
        }
    };
    let pointer = Pointer::new(file, &record);
    store.note(&pointer)?;
    Ok(Some((done, pointer)))
}

/// The record of a session, without a store.
///
/// # Errors
/// `INTERRUPTED` if `should_continue` returned `false`.
pub fn analyse(
    file: &Path,
    options: &Options,
    places: &Places,
    should_continue: ShouldContinue<'_>,
) -> Result<Record, Diagnostic> {
    record(inputs(file, options, places), should_continue)
}

fn hexadecimal(digest: impl AsRef<[u8]>) -> String {
    digest.as_ref().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads a session and what its key follows from.
fn inputs(file: &Path, options: &Options, places: &Places) -> Inputs {
    let read_options = ReadOptions { allow_outside: places.allow_outside, ..ReadOptions::default() };
    let mut record = Record {
        schema_version: SCHEMA_VERSION,
        tool_version: BUILD.to_string(),
        options: options.clone(),
        ..Record::default()
    };
    let mut model = None;
    let text = abbe_files::text(file, "the session file");
    let sha256 = text.as_ref().ok().and_then(|source| source.stamp.as_ref()?.sha256());
    let read =
        text.and_then(|source| abbe_files::session_of(&source, &read_options)).map_err(|error| error.to_string());
    if let Ok((session, sources)) = &read {
        describe(&mut record, session);
        record.inputs = input_records(sources);
        model = model_of(&record.machine_id, places);
    } else {
        // A session that cannot be read is known by its own text and by what is wrong with it, so that a change of
        // another file is noticed.
        record.inputs = vec![InputFile { file: name_of(file), sha256 }];
    }
    let stated = serde_json::json!({
        "schema_version": SCHEMA_VERSION,
        "tool_version": env!("CARGO_PKG_VERSION"),
        "options": options,
        "inputs": record.inputs,
        // A model that cannot be read has no checksum: its validation fails.
        "model": model.as_ref().map(|model| model.sha256.as_deref().unwrap_or_default()),
        "error": read.as_ref().err(),
    });
    let digest = Sha256::digest(stated.to_string());
    record.seed = digest.iter().take(8).fold(0, |seed, byte| seed << 8 | u64::from(*byte)) >> (64 - SEED_BITS);
    record.key = hexadecimal(Sha256::new().chain_update(digest).chain_update(BUILD).finalize());
    Inputs { read, record, model }
}

fn name_of(file: &Path) -> String {
    file.file_name().map_or_else(|| file.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// The files of a session with their checksums, by names that do not depend on where the folder lies.
fn input_records(sources: &SourceMap) -> Vec<InputFile> {
    let folder = sources.file.parent().unwrap_or(Path::new(""));
    let record = |stamp: &FileStamp| {
        let name = stamp.file.strip_prefix(folder).map(|name| name.display().to_string());
        InputFile { file: name.unwrap_or_else(|_| name_of(&stamp.file)), sha256: stamp.sha256() }
    };
    sources.files.iter().map(record).collect()
}

/// Notes machine, date and identifiers of a session.
fn describe(record: &mut Record, session: &Session) {
    record.about = session.about.iter().cloned().collect();
    let note = |name: &str| record.about.get(name).filter(|text| !text.trim().is_empty()).cloned();
    let machine = &session.machine;
    record.machine_id = note("serial_number").unwrap_or_else(|| machine.name.clone());
    record.date = note("date");
    record.session_id = note("session_id");
    // Other names and travels of the same axes are the same machine.
    let geometry = print::text_of(&of_domain::machine(machine)).unwrap_or_default();
    let is_geometry = |line: &&str| !line.starts_with("name") && !line.starts_with("travel_");
    let geometry: Vec<&str> = geometry.lines().filter(is_geometry).collect();
    record.machine = Some(MachineRecord {
        name: machine.name.clone(),
        code: machine.code(),
        sha256: hexadecimal(Sha256::digest(geometry.join("\n"))),
    });
    record.instrument = Some(session.instrument.word().to_string());
}

/// Longest name of a file on most file systems, bytes.
const LONGEST_NAME: usize = 255;

/// The model of a machine; `None` if there is none. Signs that no file name should have are `_`.
fn model_of(machine_id: &str, places: &Places) -> Option<Model> {
    let plain = |sign: char| if sign.is_alphanumeric() || "-_. ".contains(sign) { sign } else { '_' };
    let name = format!("{}.json", machine_id.chars().map(plain).collect::<String>());
    let file = places.models.as_ref()?.join(&name);
    if name.len() > LONGEST_NAME || matches!(file.try_exists(), Ok(false)) {
        return None;
    }
    let source = abbe_files::text(&file, "the model file");
    let sha256 = source.as_ref().ok().and_then(|source| source.stamp.as_ref()?.sha256());
    Some(Model { source, sha256 })
}

/// Analyses what was read.
fn record(inputs: Inputs, should_continue: ShouldContinue<'_>) -> Result<Record, Diagnostic> {
    let Inputs { read, mut record, model } = inputs;
    let analysed = match read {
        Err(message) => Err(ErrorRecord { stage: "read".to_string(), message }),
        Ok((session, _)) => {
            let stage = if record.options.no_trace { "fit" } else { "trace" };
            let identified = guarded(stage, || identify(&mut record, &session, should_continue));
            if !should_continue() {
                return Err(interrupted());
            }
            // The estimates do not depend on the model: they stay if its validation fails.
            identified.and_then(|()| match model {
                Some(model) => guarded("validate", || judge(&mut record, model, &session)),
                None => Ok(()),
            })
        }
    };
    record.error = analysed.err();
    Ok(record)
}

/// A stage of the analysis. A fault of the program in one session must not end the others.
fn guarded(stage: &str, work: impl FnOnce() -> Result<(), Diagnostic>) -> Result<(), ErrorRecord> {
    let message = match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => return Ok(()),
        Ok(Err(error)) => error.to_string(),
        Err(_) => FAULT.to_string(),
    };
    Err(ErrorRecord { stage: stage.to_string(), message })
}

const FAULT: &str = "a fault of abbe: the computation broke off; please report it with the session";

/// Fit and trace.
fn identify(record: &mut Record, session: &Session, should_continue: ShouldContinue<'_>) -> Result<(), Diagnostic> {
    if record.options.no_trace {
        let found = SessionFit::of(session, record.seed)?;
        record.base = BaseRecord::of(&found.problem, &found.fit)?;
        record.rms_before_um = Some(found.result.model.fit.rms_um);
        record.conflicts = Some(found.result.plausibility.conflicts.len());
        record.conformity = found.result.conformity;
        record.warnings = found.result.warnings;
        record.model = Some(found.result.model);
        return Ok(());
    }
    let options = TraceOptions {
        seed: record.seed,
        max_effects: record.options.max_effects,
        only: record.options.only.clone(),
        exclude: record.options.exclude.clone(),
        ..TraceOptions::default()
    };
    let found = trace(session, &options, &|_: Progress| should_continue())?;
    record.effects = found
        .effects
        .iter()
        .zip(&found.alias_effects)
        .zip(&found.result.effects)
        .map(|((effect, aliases), result)| EffectRecord {
            id: effect.id(),
            name: result.name.clone(),
            family: result.family.clone(),
            p_value: result.p_value,
            rms_gain_um: result.rms_gain_um,
            unique: result.unique,
            aliases: aliases.iter().map(abbe_model::effect::Effect::id).collect(),
        })
        .collect();
    record.base = BaseRecord::of(&found.after, &found.after_fit)?;
    record.verdict = Some(found.result.verdict);
    record.rms_before_um = Some(found.result.before.fit.rms_um);
    record.conflicts = Some(found.result.plausibility.conflicts.len());
    record.conformity = found.result.conformity;
    record.warnings = found.result.warnings;
    record.model = Some(found.result.after);
    Ok(())
}

/// Validation of the machine's model.
fn judge(record: &mut Record, model: Model, session: &Session) -> Result<(), Diagnostic> {
    let result = validate(&model_file::of_source(&model.source?)?, session)?.result;
    record.validation = Some(ValidationRecord {
        model_sha256: model.sha256.unwrap_or_default(),
        verdict: result.verdict,
        rms_um: result.model.residual.rms.rms_um,
        moved: result.moved.into_iter().map(|moved| moved.change.id).collect(),
    });
    record.warnings.extend(result.warnings);
    Ok(())
}
