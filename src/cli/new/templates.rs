//! The templates of `abbe new`: ready machines and sessions within the program.

/// A session in the program.
pub struct Template {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// File name and contents.
    pub files: &'static [(&'static str, &'static str)],
}

/// Files of folders of `sessions/`, some under another name.
macro_rules! files {
    ($($folder:literal: $($file:literal $(as $name:literal)?),+);+ $(;)?) => {
        &[$($((name!($file $(, $name)?), include_str!(concat!("../../../sessions/", $folder, "/", $file)))),+),+]
    };
}

macro_rules! name {
    ($file:literal) => {
        $file
    };
    ($file:literal, $name:literal) => {
        $name
    };
}

/// The templates.
pub const TEMPLATES: &[Template] = &[
    Template {
        name: "angle",
        about: "rotary table with a polygon, and a level on a carriage; a plan, and simulated readings",
        files: files!("angle": "machine.toml", "plan.toml", "session.toml", "level.csv", "polygon.csv"),
    },
    Template {
        name: "diagonals",
        about: "three-axis machine and a laser along its axes and four body diagonals (ISO 230-6); a plan, and simulated readings",
        files: files!("diagonals": "machine.toml", "plan.toml", "session.toml", "X.csv", "Y.csv", "Z.csv", "PPP.csv", "NPP.csv", "PNP.csv", "PPN.csv"),
    },
    Template {
        name: "distance",
        about: "three-axis machine and a tracking interferometer at four unknown places; a plan, and simulated readings",
        files: files!("distance": "machine.toml", "plan.toml", "session.toml", "S1.csv", "S2.csv", "S3.csv", "S4.csv"),
    },
    Template {
        name: "hermle-c600u",
        about: "five-axis machine with a tilting rotary table; three ball-bar methods as plans",
        files: files!("hermle-c600u": "machine.toml", "chapter4.toml", "chapter5.toml", "chapter6.toml"),
    },
    Template {
        name: "hermle-c600u-measured",
        about: "the same machine with simulated readings and an effect to trace",
        files: files!(
            "hermle-c600u/measured": "machine.toml", "A100.csv", "A150.csv", "C100.csv", "C150.csv", "session.toml"
        ),
    },
    Template {
        name: "kuka-iiwa14",
        about: "seven-axis robot with its ball in sockets (public data set, to be downloaded)",
        files: files!("kuka-iiwa14": "machine.toml", "session.toml"),
    },
    Template {
        name: "laser",
        about: "three-axis machine and a laser interferometer along X: displacement, straightness, pitch; a plan, and simulated readings",
        files: files!("laser": "machine.toml", "plan.toml", "session.toml", "LX.csv"),
    },
    Template {
        name: "pose",
        about: "six-axis robot before a camera system that reads poses, and before a tracker with range and angles; a plan, and simulated readings",
        files: files!("pose": "machine.toml", "plan.toml", "session.toml", "tracker.toml", "body.csv", "target.csv"),
    },
    Template {
        name: "r-test",
        about: "R-test on machines with B, C and with A, B tables: plans of BK1 and BK2, and readings with pitch-compensation steps to trace",
        files: files!(
            "r-test": "machine.toml", "plan.toml", "machine-b.toml";
            "r-test/measured": "session.toml", "BK1.csv", "BK2.csv", "C-alone.csv"
        ),
    },
    Template {
        name: "self-calibration",
        about: "rotary table probed on an uncalibrated cylinder; a plan, and readings simulated from it",
        files: files!(
            "self-calibration": "machine.toml", "session.toml" as "plan.toml";
            "self-calibration/measured": "session.toml", "1a.csv", "1b.csv", "2.csv", "3.csv"
        ),
    },
    Template {
        name: "telescope",
        about: "alt-azimuth mounts: stars of the LSST auxiliary telescope and of the MMT (public data, to be downloaded)",
        files: files!("telescope": "machine.toml", "auxtel.toml", "mmt.toml"),
    },
    Template {
        name: "volumetric",
        about: "five-axis machine with 33 error functions, to map and to compensate",
        files: files!("volumetric": "machine.toml", "errors.toml"),
    },
    Template {
        name: "table-and-head",
        about: "five-axis machine with a rotary table and a tilting head; ball-bar plan of chapter 7, and simulated readings",
        files: files!(
            "table-and-head": "machine.toml", "session.toml" as "plan.toml";
            "table-and-head/measured": "session.toml", "A100.csv", "A150.csv", "C100.csv", "C150.csv"
        ),
    },
    Template {
        name: "tilting-head",
        about: "five-axis machine with a tilting head; ball-bar plan of chapter 7, and simulated readings",
        files: files!(
            "tilting-head": "machine.toml", "session.toml" as "plan.toml";
            "tilting-head/measured": "session.toml", "B100.csv", "B150.csv", "C100.csv", "C150.csv"
        ),
    },
    Template {
        name: "ur10",
        about: "six-axis robot measured by a laser tracker (public data set, to be downloaded)",
        files: files!("ur10": "machine.toml", "session.toml"),
    },
];
