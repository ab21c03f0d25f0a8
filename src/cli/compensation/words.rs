//! Errors in the words of ISO 230-1.

use abbe::model::component::{ErrorKind, ErrorName, Freedom};

/// The meaning of an error in the words of ISO 230-1.
pub fn words(name: &ErrorName) -> String {
    let letter = name.freedom.letter();
    let direction = if name.freedom.is_angle() {
        let about = Freedom::ALL[name.freedom.index() % 3].letter();
        format!("{letter} (about {about})")
    } else {
        letter.to_string()
    };
    match (name.kind, name.freedom.is_angle()) {
        (ErrorKind::Location, false) => {
            format!("error of the position of {} in direction {direction}", name.axis)
        }
        (ErrorKind::Location, true) => format!("error of the orientation of {} in direction {direction}", name.axis),
        (ErrorKind::Motion, false) => format!("error motion of {} in direction {direction}", name.axis),
        (ErrorKind::Motion, true) => {
            format!("angular error motion of {} in direction {direction}", name.axis)
        }
    }
}
