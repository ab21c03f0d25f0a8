//! The calibrated machine for other programs and for controls: one line of a registry for each format.

use abbe_apply::compensation::curves::of_model;
use abbe_apply::compensation::{self, Compensation, MAX_POINTS, TableFormat};
use abbe_apply::control::{CONTROLS, Control, Kinematics};
use abbe_apply::error::unrepresentable;
use abbe_apply::export::dh::{self, DhTable, DhUncertainty};
use abbe_apply::export::entries::{Remaining, best_locations};
use abbe_apply::export::kinematics::{ENTRIES, EntryChoice, KinematicTable};
use abbe_apply::export::neutral::{self, AxisPlace};
use abbe_apply::export::travel::Travel;
use abbe_apply::export::{left_out, urdf, urdf_patch};
use abbe_files::Source;
use abbe_files::robot::dh::{self as table, Convention};
use abbe_identify::error;
use abbe_identify::fit::frames::SetUpFrame;
use abbe_identify::model_file::IdentifiedModel;
use abbe_model::Diagnostic;
use abbe_model::component::ErrorKind;
use schemars::JsonSchema;
use serde::Serialize;

use crate::printers::csv;
use crate::report::export::{self as present, uncertainties};
use crate::report::frames;
use crate::report::table::Table;

/// A format.
pub struct ExportFormat {
    /// The word by which it is requested.
    pub word: &'static str,
    /// What it is.
    pub about: String,
    form: Form,
}

enum Form {
    /// A description of the machine.
    Description(fn(&IdentifiedModel, &ExportOptions) -> Result<Exported, Diagnostic>),
    /// What a control takes.
    Control(&'static Control),
    /// The compensation tables of a control.
    Tables(&'static TableFormat),
}

/// The file of the uncertainties beside compensation tables.
const UNCERTAINTIES: &str = "uncertainty.csv";

/// Places along the axis of a compensation table, if their number is not stated.
pub const PLACES: usize = 37;

/// What a format takes beside the model.
pub struct ExportOptions {
    /// The tool point in the tool frame.
    pub tool_mm: [f64; 3],
    /// Which entries of a control are written.
    pub entries: EntryChoice,
    /// The travel over which the error of the entries counts.
    pub travel: Travel,
    /// The URDF file whose origins are changed, and the link at which its chain ends.
    pub patch: Option<(Source, Option<String>)>,
    /// The convention of Denavit-Hartenberg parameters.
    pub convention: Convention,
    /// The maker's table, near whose frames the calibrated ones lie.
    pub dh: Option<Source>,
    /// Number of places along the axis of a compensation table; [`PLACES`] if it is not stated.
    pub places: Option<usize>,
    /// Axes with the position at which a control has its zero, mm or degrees: there the entries of compensation tables are 0.
    pub references: Vec<(String, f64)>,
}

impl ExportOptions {
    /// The tool point of the model, and the entries that leave the least error over the measured range.
    pub fn of(model: &IdentifiedModel) -> ExportOptions {
        ExportOptions {
            tool_mm: model.tool_mm,
            entries: EntryChoice::Best,
            travel: Travel::measured(model),
            patch: None,
            convention: Convention::Modified,
            dh: None,
            places: None,
            references: Vec::new(),
        }
    }
}

/// The formats: descriptions of the machine, then the controls, then their compensation tables.
pub fn formats() -> Vec<ExportFormat> {
    let described =
        |word, about: &str, write| ExportFormat { word, about: about.to_string(), form: Form::Description(write) };
    let descriptions = [
        described("table", "where each axis is: point and direction, for any control", of_table),
        described("urdf", "URDF of the calibrated chain", of_urdf),
        described("dh", "Denavit-Hartenberg parameters, calibrated and nominal", of_dh),
        described("ros", "ROS 2 static transforms: where the instrument stands, how its target is mounted", of_frames),
    ];
    let of_control = |control: &'static Control| {
        let about = match &control.kinematics {
            Kinematics::Entries(kinematics) => kinematics.about,
            Kinematics::Locations => "location errors",
            Kinematics::NotDocumented(_) => "not publicly documented",
        };
        let about = format!("{}, {about}", control.name);
        ExportFormat { word: control.word, about, form: Form::Control(control) }
    };
    let tables = CONTROLS.iter().filter_map(|control| {
        let format = control.tables.as_ref()?;
        let about = format!("{}, compensation tables: {}", control.name, format.about);
        Some(ExportFormat { word: format.word, about, form: Form::Tables(format) })
    });
    descriptions.into_iter().chain(CONTROLS.iter().map(of_control)).chain(tables).collect()
}

/// What is written.
pub struct Exported {
    /// The file, or the files of a folder.
    pub contents: Contents,
    /// The same as a table, if it is one.
    pub table: Option<Table>,
    /// The same as JSON.
    pub result: ExportResult,
}

/// One file or a folder of files.
pub enum Contents {
    /// A file.
    File(Vec<u8>),
    /// The files of a folder, each with its name.
    Folder(Vec<(String, Vec<u8>)>),
}

/// The result of `abbe export` in JSON.
#[derive(Default, Serialize, JsonSchema)]
pub struct ExportResult {
    /// Denavit-Hartenberg parameters with the identified location errors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibrated: Option<DhTable>,
    /// Those of the machine without errors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal: Option<DhTable>,
    /// Standard uncertainties of the Denavit-Hartenberg parameters.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dh_u: Vec<DhUncertainty>,
    /// The order of their covariance, such as `J2.a_mm`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dh_parameters: Vec<String>,
    /// Their covariance, mm and degrees.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dh_covariance: Vec<Vec<f64>>,
    /// Where the instruments stand and how their targets are mounted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<SetUpFrame>,
    /// Where each axis is.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub axes: Vec<AxisPlace>,
    /// Changes of a control's kinematic parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kinematics: Option<KinematicTable>,
    /// Of a description without the model's effects: the volumetric error without changes, with the location errors of
    /// the model, and with those that are written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remaining: Option<Remaining>,
    /// How the control reads compensation tables.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub import: Vec<String>,
    /// Effects and errors that the format does not hold.
    pub left_out: Vec<String>,
}

/// The choice of entries of this word.
///
/// # Errors
/// If there is none.
pub fn entries(word: &str) -> Result<EntryChoice, Diagnostic> {
    let known = ENTRIES.map(|(_, word, _)| word);
    ENTRIES
        .iter()
        .find(|(_, own, _)| *own == word)
        .map(|(choice, ..)| *choice)
        .ok_or_else(|| error::unknown("the export", "choice of entries", word, "the choices are", known))
}

/// The format of this word.
///
/// # Errors
/// If there is none.
pub fn format(word: &str) -> Result<ExportFormat, Diagnostic> {
    formats().into_iter().find(|format| format.word == word).ok_or_else(|| {
        let known = formats().into_iter().map(|format| format.word);
        error::unknown("the export", "format", word, "the formats are", known)
    })
}

impl ExportFormat {
    fn takes_entries(&self) -> bool {
        matches!(self.form, Form::Control(Control { kinematics: Kinematics::Entries(_), .. }))
    }

    /// Whether its output is a folder of compensation tables.
    pub fn is_of_tables(&self) -> bool {
        matches!(self.form, Form::Tables(_))
    }

    /// An option that is stated and that this format does not take, with the words of the formats that take it.
    pub fn ignored(&self, options: &ExportOptions) -> Option<(&'static str, Vec<&'static str>)> {
        type Taken = fn(&ExportFormat) -> bool;
        let entries: Taken = ExportFormat::takes_entries;
        let stated: [(bool, &str, Taken); 7] = [
            (options.patch.is_some(), "patch", |format| format.word == "urdf"),
            (options.dh.is_some(), "dh", |format| format.word == "dh"),
            (options.convention == Convention::Standard, "convention", |format| format.word == "dh"),
            (options.places.is_some(), "places", ExportFormat::is_of_tables),
            (!options.references.is_empty(), "reference", ExportFormat::is_of_tables),
            (options.entries == EntryChoice::Plain, "entries", entries),
            (!options.travel.is_measured, "travel", entries),
        ];
        let (_, option, takes) = stated.into_iter().find(|(is_stated, _, takes)| *is_stated && !takes(self))?;
        let owners = formats().into_iter().filter(takes).map(|format| format.word);
        Some((option, owners.collect()))
    }

    /// The model in this format.
    ///
    /// # Errors
    /// If the format cannot hold the model.
    pub fn export(&self, model: &IdentifiedModel, options: &ExportOptions) -> Result<Exported, Diagnostic> {
        match &self.form {
            Form::Description(write) => write(model, options),
            Form::Control(Control { kinematics: Kinematics::Locations, tables: Some(format), .. }) => {
                of_locations(model, format)
            }
            Form::Control(control) => of_control(model, control, options),
            Form::Tables(format) => of_tables(model, format, options),
        }
    }
}

fn written(table: &Table) -> Result<Vec<u8>, Diagnostic> {
    csv::text(table).map_err(|why| error::not_written("the table", why))
}

/// A table under its header.
fn tabled(header: String, table: Table, result: ExportResult) -> Result<Exported, Diagnostic> {
    Ok(Exported {
        contents: Contents::File([header.into_bytes(), written(&table)?].concat()),
        table: Some(table),
        result,
    })
}

fn of_urdf(model: &IdentifiedModel, options: &ExportOptions) -> Result<Exported, Diagnostic> {
    let tool_mm = if options.patch.is_some() { model.tool_mm } else { options.tool_mm };
    let (_, remaining) = best_locations(model, tool_mm)?;
    let result = ExportResult { left_out: left_out(model), remaining, ..ExportResult::default() };
    let text = match &options.patch {
        Some((source, tip)) => urdf_patch::patched(model, source, tip.as_deref())?,
        None => urdf::urdf(model, options.tool_mm)?,
    };
    Ok(Exported { contents: Contents::File(text.into_bytes()), table: None, result })
}

fn of_table(model: &IdentifiedModel, _: &ExportOptions) -> Result<Exported, Diagnostic> {
    let axes = neutral::places(model)?;
    let table = present::places(&axes);
    let result = ExportResult { axes, left_out: left_out(model), ..ExportResult::default() };
    tabled(present::places_header(), table, result)
}

fn of_dh(model: &IdentifiedModel, options: &ExportOptions) -> Result<Exported, Diagnostic> {
    let own = options.dh.as_ref().map(|source| table::read(source, options.convention)).transpose()?;
    let found = dh::tables(model, options.tool_mm, options.convention, own.as_ref())?;
    let table = present::dh(&found);
    let result = ExportResult {
        dh_parameters: found.ids(),
        calibrated: Some(found.calibrated),
        nominal: Some(found.nominal),
        dh_u: found.u,
        dh_covariance: found.covariance,
        left_out: left_out(model),
        remaining: best_locations(model, options.tool_mm)?.1,
        ..ExportResult::default()
    };
    let stated = result.remaining.map_or(String::new(), |remaining| format!("# {}\n", remaining.words()));
    tabled(stated + &present::dh_header(&table), table, result)
}

fn of_frames(model: &IdentifiedModel, _: &ExportOptions) -> Result<Exported, Diagnostic> {
    if model.frames.is_empty() {
        let holds = "it holds frames of trackers, poses, sockets and distances, and the model has none; save it again if it \
                     is of an earlier version";
        return Err(unrepresentable("the format", "the model", holds));
    }
    let result = ExportResult { frames: model.frames.clone(), ..ExportResult::default() };
    let contents = Contents::File(frames::transforms(&model.frames).into_bytes());
    Ok(Exported { contents, table: Some(frames::table(&model.frames)), result })
}

fn of_control(model: &IdentifiedModel, control: &Control, options: &ExportOptions) -> Result<Exported, Diagnostic> {
    let found = control.kinematic_table(model, options.entries, &options.travel, options.tool_mm)?;
    let left_out = found.left_out.clone();
    let (header, table) = (present::kinematics_header(&found), present::kinematics(&found));
    tabled(header, table, ExportResult { kinematics: Some(found), left_out, ..ExportResult::default() })
}

/// The location errors in a format of compensation tables, and what it does not hold.
fn of_locations(model: &IdentifiedModel, format: &TableFormat) -> Result<Exported, Diagnostic> {
    let errors = model.parameters.iter().enumerate().filter(|(_, parameter)| parameter.id.is_error());
    let named = errors
        .filter(|(index, _)| model.is_estimated(*index))
        .filter_map(|(_, parameter)| Some((parameter.id.error()?.clone(), parameter.value)));
    let locations = named.filter(|(name, _)| name.kind == ErrorKind::Location).collect();
    let compensation = Compensation { locations, left_out: left_out(model), ..Compensation::default() };
    let tables = compensation::tables(&model.machine, &compensation, format, MAX_POINTS);
    let file = tables.files.into_iter().next();
    let holds = "it holds location errors, and the model has none of these";
    let (_, text) = file.ok_or_else(|| unrepresentable("the format", "the model", holds))?;
    let result = ExportResult { left_out: tables.left_out, ..ExportResult::default() };
    Ok(Exported { contents: Contents::File(text.into_bytes()), table: None, result })
}

/// The error motions as compensation tables with a number of places along each axis, and their standard uncertainty.
fn of_tables(model: &IdentifiedModel, format: &TableFormat, options: &ExportOptions) -> Result<Exported, Diagnostic> {
    let places = options.places.unwrap_or(PLACES);
    if !(2..=MAX_POINTS).contains(&places) {
        let found = format!("a number from 2 to {MAX_POINTS} is expected");
        let expected = "the maximum is that of LinuxCNC and Heidenhain";
        return Err(error::not_applicable(format!("a table of {places} places"), found, expected));
    }
    let found = compensation::tables(&model.machine, &of_model(model, &options.references)?, format, places);
    if found.files.is_empty() {
        let all = found.left_out.iter().map(|line| format!("\n  {line}")).collect::<String>();
        let holds = "declare error motions as [[effect]], as `abbe trace --write` does, and fit again";
        let found = "no error can be compensated in this format";
        return Err(error::not_applicable("the model", found, format!("{holds}{all}")));
    }
    let mut files: Vec<(String, Vec<u8>)> =
        found.files.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
    let table = uncertainties(&found.uncertainties);
    files.push((UNCERTAINTIES.to_string(), written(&table)?));
    let import = format.import.iter().map(ToString::to_string).collect();
    let result = ExportResult { left_out: found.left_out, import, ..ExportResult::default() };
    Ok(Exported { contents: Contents::Folder(files), table: None, result })
}
