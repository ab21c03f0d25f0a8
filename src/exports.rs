//! The calibrated machine for other programs and for controls: one line of a registry for each format.

use abbe_apply::ApplyError;
use abbe_apply::compensation::{self, Compensation, TableFormat};
use abbe_apply::control::{CONTROLS, Control, Kinematics};
use abbe_apply::export::dh::{self, DhTable, DhUncertainty};
use abbe_apply::export::kinematics::{ENTRIES, EntryChoice, KinematicTable};
use abbe_apply::export::neutral::{self, AxisPlace};
use abbe_apply::export::travel::Travel;
use abbe_apply::export::{left_out, urdf, urdf_patch};
use abbe_identify::model_file::IdentifiedModel;
use abbe_identify::parameters::Role;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::files::Source;
use abbe_model::files::robot::dh::{self as table, Convention};
use schemars::JsonSchema;
use serde::Serialize;

use crate::printers::csv;
use crate::report::export as present;
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
    Description(fn(&IdentifiedModel, &ExportOptions) -> Result<Exported, ApplyError>),
    /// What a control takes.
    Control(&'static Control),
}

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
        }
    }
}

/// The formats: descriptions of the machine, then the controls.
pub fn formats() -> Vec<ExportFormat> {
    let described =
        |word, about: &str, write| ExportFormat { word, about: about.to_string(), form: Form::Description(write) };
    let descriptions = [
        described("table", "where each axis is: point and direction, for any control", of_table),
        described("urdf", "URDF of the calibrated chain", of_urdf),
        described("dh", "Denavit-Hartenberg parameters, calibrated and nominal", of_dh),
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
    descriptions.into_iter().chain(CONTROLS.iter().map(of_control)).collect()
}

/// The words of the controls that take a choice of entries and the travel over which their error counts.
pub fn words_with_entries() -> Vec<&'static str> {
    formats().iter().filter(|format| format.takes_entries()).map(|format| format.word).collect()
}

/// What is written.
#[derive(Default)]
pub struct Exported {
    /// The file.
    pub text: Vec<u8>,
    /// The same as a table, if it is one.
    pub table: Option<Table>,
    /// The same as JSON.
    pub result: ExportResult,
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
    /// Where each axis is.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub axes: Vec<AxisPlace>,
    /// Changes of a control's kinematic parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kinematics: Option<KinematicTable>,
    /// Effects and errors that a fixed geometry does not hold.
    pub left_out: Vec<String>,
}

/// The choice of entries of this word.
///
/// # Errors
/// If there is none.
pub fn entries(word: &str) -> Result<EntryChoice, ApplyError> {
    ENTRIES.iter().find(|(_, own, _)| *own == word).map(|(choice, ..)| *choice).ok_or_else(|| {
        let words = ENTRIES.map(|(_, word, _)| word).join(", ");
        ApplyError::Request(format!("there are no entries `{word}`; the choices are {words}"))
    })
}

/// The format of this word.
///
/// # Errors
/// If there is none.
pub fn format(word: &str) -> Result<ExportFormat, ApplyError> {
    formats().into_iter().find(|format| format.word == word).ok_or_else(|| {
        let words = formats().iter().map(|format| format.word).collect::<Vec<_>>().join(", ");
        ApplyError::Request(format!("there is no format `{word}`; the formats are {words}"))
    })
}

impl ExportFormat {
    fn takes_entries(&self) -> bool {
        matches!(self.form, Form::Control(Control { kinematics: Kinematics::Entries(_), .. }))
    }

    /// An option that is stated and that this format does not take.
    pub fn ignored(&self, options: &ExportOptions) -> Option<&'static str> {
        match options {
            ExportOptions { patch: Some(_), .. } if self.word != "urdf" => Some("patch"),
            ExportOptions { dh: Some(_), .. } if self.word != "dh" => Some("dh"),
            ExportOptions { convention: Convention::Standard, .. } if self.word != "dh" => Some("convention"),
            _ if self.takes_entries() => None,
            ExportOptions { entries: EntryChoice::Plain, .. } => Some("entries"),
            ExportOptions { travel: Travel { is_measured: false, .. }, .. } => Some("travel"),
            _ => None,
        }
    }

    /// The model in this format.
    ///
    /// # Errors
    /// If the format cannot hold the model.
    pub fn export(&self, model: &IdentifiedModel, options: &ExportOptions) -> Result<Exported, ApplyError> {
        match &self.form {
            Form::Description(write) => write(model, options),
            Form::Control(Control { kinematics: Kinematics::Locations, tables: Some(format), .. }) => {
                of_locations(model, format)
            }
            Form::Control(control) => of_control(model, control, options),
        }
    }
}

/// A table under its header.
fn tabled(header: String, table: Table, result: ExportResult) -> Result<Exported, ApplyError> {
    let rows = csv::text(&table).map_err(ApplyError::Request)?;
    Ok(Exported { text: [header.into_bytes(), rows].concat(), table: Some(table), result })
}

fn of_urdf(model: &IdentifiedModel, options: &ExportOptions) -> Result<Exported, ApplyError> {
    let result = ExportResult { left_out: left_out(model), ..ExportResult::default() };
    let text = match &options.patch {
        Some((source, tip)) => urdf_patch::patched(model, source, tip.as_deref())?,
        None => urdf::urdf(model, options.tool_mm)?,
    };
    Ok(Exported { text: text.into_bytes(), table: None, result })
}

fn of_table(model: &IdentifiedModel, _: &ExportOptions) -> Result<Exported, ApplyError> {
    let axes = neutral::places(model)?;
    let table = present::places(&axes);
    let result = ExportResult { axes, left_out: left_out(model), ..ExportResult::default() };
    tabled(present::places_header(), table, result)
}

fn of_dh(model: &IdentifiedModel, options: &ExportOptions) -> Result<Exported, ApplyError> {
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
        ..ExportResult::default()
    };
    tabled(present::dh_header(&table), table, result)
}

fn of_control(model: &IdentifiedModel, control: &Control, options: &ExportOptions) -> Result<Exported, ApplyError> {
    let found = control.kinematic_table(model, options.entries, &options.travel, options.tool_mm)?;
    let left_out = found.left_out.clone();
    let (header, table) = (present::kinematics_header(&found), present::kinematics(&found));
    tabled(header, table, ExportResult { kinematics: Some(found), left_out, ..ExportResult::default() })
}

/// The location errors in a format of compensation tables, and what it does not hold.
fn of_locations(model: &IdentifiedModel, format: &TableFormat) -> Result<Exported, ApplyError> {
    let errors = model.parameters.iter().enumerate().filter(|(_, parameter)| parameter.role == Role::Error);
    let named = errors
        .filter(|(index, _)| model.is_estimated(*index))
        .filter_map(|(_, parameter)| Some((ErrorName::parse(&parameter.id)?, parameter.value)));
    let locations = named.filter(|(name, _)| name.kind == ErrorKind::Location).collect();
    let compensation = Compensation { locations, left_out: left_out(model), ..Compensation::default() };
    let tables = compensation::tables(&model.machine, &compensation, format, compensation::MAX_POINTS);
    let file = tables.files.into_iter().next();
    let missing = || ApplyError::Request("the model has no location error that the format holds".to_string());
    let (_, text) = file.ok_or_else(missing)?;
    let result = ExportResult { left_out: tables.left_out, ..ExportResult::default() };
    Ok(Exported { text: text.into_bytes(), table: None, result })
}
