//! SINUMERIK.

use super::{Control, Kinematics};

pub(super) const CONTROL: Control = Control {
    word: "siemens",
    name: "SINUMERIK 840D",
    tables: None,
    kinematics: Kinematics::NotDocumented(
        "the vectors of SINUMERIK 840D (MD24500 TRAFO5_PART_OFFSET, MD24550 TRAFO5_BASE_TOOL, MD24560 TRAFO5_JOINT_OFFSET) are \
         listed in public manuals without the equation that fixes their signs for each machine type",
    ),
    has_programs: true,
};
