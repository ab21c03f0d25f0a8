//! The identified location errors as a description of the machine for other programs and for controls.
//!
//! - [`frames`]: the chain at its zero position with location errors;
//! - [`neutral`]: the place of each axis, for any control;
//! - [`urdf`]: the calibrated chain as URDF; [`urdf_patch`]: the calibrated origins in the URDF file of a robot; [`dh`]: Denavit–Hartenberg parameters, modified form of Craig with Hayati's
//!   angle for parallel axes;
//! - [`kinematics`]: kinematic parameters of controls, as far as their models are publicly documented; [`entries`]: those
//!   that leave the least error over a [`travel`].
//!
//! A description of fixed geometry holds location errors only. Effects and constant error motions are listed as left
//! out.

pub mod dh;
mod dh_frames;
pub mod entries;
pub mod frames;
pub mod kinematics;
pub mod neutral;
pub mod travel;
pub mod urdf;
pub mod urdf_patch;

use abbe_model::component::ErrorKind;

use abbe_identify::model_file::IdentifiedModel;

/// What a description of fixed geometry cannot hold: the effects of a model, and errors that are no location errors.
pub fn left_out(model: &IdentifiedModel) -> Vec<String> {
    let mut left_out: Vec<String> = model.effects.iter().map(abbe_model::effect::Effect::id).collect();
    let errors = model.parameters.iter().filter(|parameter| !parameter.held).filter_map(|own| own.id.error());
    left_out.extend(errors.filter(|name| name.kind == ErrorKind::Motion).map(ToString::to_string));
    left_out
}

#[cfg(test)]
mod kinematics_tests;
#[cfg(test)]
mod tests;
