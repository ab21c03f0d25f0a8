//! Controls, one file each: what each one takes of compensation tables, kinematic parameters and NC programs.

mod beckhoff;
mod fanuc;
mod heidenhain;
mod linuxcnc;
mod siemens;

use abbe_identify::model_file::IdentifiedModel;
use abbe_model::Diagnostic;

use crate::compensation::TableFormat;
use crate::error::unrepresentable;
use crate::export::kinematics::{EntryChoice, KinematicModel, KinematicTable, table};
use crate::export::travel::Travel;

/// A control.
pub struct Control {
    /// The word by which it is requested. A dialect of NC programs in `abbe-codegen` has the same word.
    pub word: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its compensation tables, if their format is publicly documented.
    pub tables: Option<TableFormat>,
    /// Its kinematic parameters.
    pub kinematics: Kinematics,
    /// Whether there is a dialect of NC programs for it.
    pub has_programs: bool,
}

/// How a control takes location errors.
pub enum Kinematics {
    /// As entries of a publicly documented kinematic model.
    Entries(KinematicModel),
    /// As location errors in its compensation tables.
    Locations,
    /// Its kinematic model is not exported, with the reason.
    NotDocumented(&'static str),
}

/// The controls, in the order in which they are listed.
pub const CONTROLS: &[Control] =
    &[linuxcnc::CONTROL, fanuc::CONTROL, siemens::CONTROL, heidenhain::CONTROL, beckhoff::CONTROL];

/// The control of a word.
pub fn control(word: &str) -> Option<&'static Control> {
    CONTROLS.iter().find(|control| control.word == word)
}

impl Control {
    /// Its kinematic parameters for a travel and a tool point in the tool frame, mm.
    ///
    /// # Errors
    /// If the control has no entries; see [`table`].
    pub fn kinematic_table(
        &self,
        model: &IdentifiedModel,
        choice: EntryChoice,
        travel: &Travel,
        tool_mm: [f64; 3],
    ) -> Result<KinematicTable, Diagnostic> {
        let refused = |holds: &str| {
            let format = format!("a table for `{}`", self.word);
            Err(unrepresentable(format, "kinematic parameters", holds))
        };
        match &self.kinematics {
            Kinematics::Entries(kinematics) => table(model, self.name, kinematics, choice, travel, tool_mm),
            Kinematics::Locations => refused("it takes location errors in its compensation tables"),
            Kinematics::NotDocumented(why) => refused(&format!("{why}; no sign is guessed")),
        }
    }
}
