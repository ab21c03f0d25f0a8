//! Faults of the environment: full disks, outputs that cannot be written, pipes, links. The command succeeds, or a
//! message states the reason and existing files are unchanged.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use rust_xlsxwriter::Workbook;

use crate::suite::{abbe, text};

const PROGRAM: &str = env!("CARGO_BIN_EXE_abbe");

/// A small measured session: a circle of two axes.
const SESSION: &str = r#"[machine]
chain = "w X b Y t"
[machine.axis.X]
[machine.axis.Y]

[instrument]
kind = "ballbar"
noise_um = 0.3

[unknowns]
errors = ["EC0Y"]

[[test]]
name = "NAME"
data = "circle.csv"
bar_mm = 100.0
workpiece_ball_mm = [0, 0, 0]
spindle_ball_mm = [0, 0, 0]
workpiece_ball_u_um = [2, 2, 0]
"#;

/// A folder with that session and its readings.
pub struct TestFolder(pub tempfile::TempDir);

impl TestFolder {
    pub fn new() -> TestFolder {
        let place = TestFolder(tempfile::tempdir().unwrap());
        let mut table = String::from("run,x_mm,y_mm,length_mm\n");
        for k in 0..90 {
            let (sin, cos) = (f64::from(k) * 4.0).to_radians().sin_cos();
            let noise = f64::from(k * 37 % 11 - 5) * 1e-4;
            table += &format!("1,{:.6},{:.6},{:.6}\n", -100.0 * cos, 100.0 * sin, 100.0 + noise);
        }
        place.put("circle.csv", &table);
        place.put("session.toml", &SESSION.replace("NAME", "XY"));
        place
    }

    pub fn put(&self, name: &str, contents: &str) {
        fs::write(self.at(name), contents).unwrap();
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn fit(&self, arguments: &[&str]) -> Output {
        let session = self.at("session.toml");
        abbe(&[&["fit", text(&session)], arguments].concat())
    }

    /// Runs a shell line in the folder, with `abbe` as the program.
    pub fn shell(&self, line: &str) -> Output {
        let path = std::env::var("PATH").unwrap_or_default();
        let folder = Path::new(PROGRAM).parent().unwrap();
        Command::new("sh")
            .args(["-c", line])
            .current_dir(self.0.path())
            .env("PATH", format!("{}:{path}", folder.display()))
            .stdin(Stdio::null())
            .output()
            .unwrap()
    }

    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

/// Asserts exit status 1 and these parts of the message.
#[track_caller]
fn refused(output: &Output, parts: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "`{part}` is not in\n{stderr}");
    }
}

#[track_caller]
fn done(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_session_that_reads_outside_its_folder_needs_permission() {
    let place = TestFolder::new();
    fs::create_dir(place.at("inner")).unwrap();
    place.put("inner/session.toml", &SESSION.replace("NAME", "XY").replace("circle.csv", "../circle.csv"));
    for command in [
        "fit inner/session.toml",
        "plan inner/session.toml",
        "trace --list inner/session.toml",
        "simulate inner/session.toml --out new",
    ] {
        let output = place.shell(&format!("abbe {command}"));
        refused(&output, &["session.toml:", "is outside the session's folder", "--allow-outside"]);
        done(&place.shell(&format!("abbe {command} --allow-outside")));
    }
    // A folder on the command line is permitted.
    done(&place.shell("abbe fit inner/session.toml --data inner/.."));
}

#[test]
fn a_full_standard_output() {
    let place = TestFolder::new();
    let output = place.shell("abbe fit session.toml > /dev/full");
    refused(&output, &["standard output: cannot be written", "No space left"]);
}

#[test]
fn a_closed_pipe_ends_without_a_message() {
    let place = TestFolder::new();
    let output = place.shell("abbe fit session.toml | head -n 1");
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    place.put("commands.csv", &format!("x_mm\n{}", "1\n".repeat(20_000)));
    let output = place.shell(
        "abbe fit session.toml --save model.json --quiet && abbe compensate model.json commands.csv --out - | head -n 1",
    );
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn an_interrupted_compensation_leaves_no_file() {
    let place = TestFolder::new();
    place.put("commands.csv", &format!("x_mm\n{}", "1\n".repeat(4_000_000)));
    let before = place.names().len();
    let output = place.shell(
        "abbe fit session.toml --save model.json --quiet; abbe compensate model.json commands.csv --out out.csv & \
         until ls -A | grep -q '^.abbe-'; do :; done; kill -INT $!; wait $!",
    );
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(place.names().len(), before + 1, "{:?}", place.names());
}

#[test]
fn a_full_device_for_a_file() {
    let place = TestFolder::new();
    refused(&place.fit(&["--json", "/dev/full"]), &["/dev/full: cannot be written", "No space left"]);
    let device = fs::metadata("/dev/full").unwrap().file_type();
    assert!(device.is_char_device(), "/dev/full was replaced");
}

/// Too little memory for the rows of a file is an error with the line at which it ended.
#[test]
#[cfg(target_os = "linux")]
fn too_little_memory_for_a_table_is_an_error() {
    let place = TestFolder::new();
    let rows: String = (0..2_000_000).map(|k| format!("{},{},0,100\n", k / 1000, k % 100)).collect();
    place.put("circle.csv", &format!("run,x_mm,y_mm,length_mm\n{rows}"));
    // What the program takes for an empty file leaves room for some of the rows.
    let output = place.shell("ulimit -v 100000; exec abbe fit session.toml --threads 1");
    refused(&output, &["circle.csv:", "too little memory for more than", "split the file into several tests"]);
}

/// Help and version are outputs as all others.
#[test]
fn a_full_device_for_help_is_an_error() {
    let place = TestFolder::new();
    for line in ["abbe --help", "abbe --version", "abbe fit --help", "abbe fit -h"] {
        let output = place.shell(&format!("{line} > /dev/full"));
        refused(&output, &["standard output: cannot be written", "No space left"]);
        let output = place.shell(&format!("{line} | head -n 1"));
        assert!(output.status.success() && output.stderr.is_empty() && !output.stdout.is_empty(), "{line}");
    }
}

/// What a program of the next measurement cannot be written to is named as it would be called.
#[test]
fn a_full_disk_names_the_folder_of_the_next_measurement() {
    let place = TestFolder::new();
    let session = crate::suite::ready("hermle-c600u/measured/session.toml");
    let before = place.names();
    let line = format!("ulimit -f 16; exec abbe trace {} --next next --control linuxcnc --quiet", text(&session));
    let output = place.shell(&line);
    refused(&output, &["next/", "cannot be written", "File too large"]);
    assert!(!String::from_utf8_lossy(&output.stderr).contains(".abbe-"), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(place.names(), before);
}

#[test]
fn a_full_disk_leaves_existing_files_unchanged() {
    // The limit on the file size is one block: the same error as on a full disk, whether the signal is ignored or not.
    for (option, file, trap) in [
        ("--report", "out.html", "trap '' XFSZ; "),
        ("--json", "out.json", ""),
        ("--csv", "out.csv", ""),
        ("--plots", "plots", ""),
    ] {
        let place = TestFolder::new();
        if option != "--plots" {
            place.put(file, "old");
        }
        let before = place.names();
        let output = place.shell(&format!("{trap}ulimit -f 0; exec abbe fit session.toml {option} {file}"));
        refused(&output, &[file, "cannot be written", "File too large"]);
        assert_eq!(place.names(), before, "{option}");
        if option != "--plots" {
            assert_eq!(fs::read_to_string(place.at(file)).unwrap(), "old");
        }
    }
}

#[test]
fn standard_output_as_a_file() {
    let place = TestFolder::new();
    let piped = place.shell("abbe fit session.toml --json /dev/stdout | cat");
    let printed = String::from_utf8(piped.stdout).unwrap();
    assert!(printed.contains("readings, noise") && printed.contains("\"rms_um\""), "{printed}");
    done(&place.shell("abbe fit session.toml --json /dev/stdout > both.txt"));
    assert_eq!(fs::read_to_string(place.at("both.txt")).unwrap(), printed);
}

#[test]
fn a_write_protected_file() {
    let place = TestFolder::new();
    place.put("out.json", "old");
    fs::set_permissions(place.at("out.json"), fs::Permissions::from_mode(0o444)).unwrap();
    let output = place.fit(&["--json", text(&place.at("out.json"))]);
    refused(&output, &["out.json: cannot be written: the file is write-protected"]);
    assert!(output.stdout.is_empty(), "refused before the work");
    assert_eq!(fs::read_to_string(place.at("out.json")).unwrap(), "old");
}

#[test]
fn an_output_that_would_replace_an_input() {
    let place = TestFolder::new();
    place.put("errors.toml", "EC0Y = \"5 arcsec\"\n");
    place.put("machine.toml", "chain = \"w b X t\"\n[axis.X]\n");
    place.put("functions.toml", "[[function]]\nerror = \"EXX\"\nof = \"X\"\nat_mm = [0, 1]\nvalues_um = [0, 1]\n");
    symlink(place.at("circle.csv"), place.at("link.csv")).unwrap();
    fs::create_dir(place.at("plans")).unwrap();
    let outside = SESSION.replace("NAME", "circle").replace("\"circle.csv\"", "\"../circle.csv\"");
    place.put("plans/session.toml", &outside);
    let held = |place: &TestFolder| {
        let files = place.names().into_iter().filter(|name| name != "plans");
        files.map(|name| (fs::read_to_string(place.at(&name)).unwrap(), name)).collect::<Vec<_>>()
    };
    let before = held(&place);
    for (line, name) in [
        ("fit session.toml --json session.toml", "session.toml"),
        ("fit session.toml --csv ./circle.csv", "./circle.csv"),
        ("fit session.toml --json link.csv", "link.csv"),
        ("trace session.toml --quiet --write session.toml", "session.toml"),
        ("plan session.toml --no-effects --json circle.csv", "circle.csv"),
        ("equation session.toml --test XY --out session.toml", "session.toml"),
        ("simulate session.toml --out run --values errors.toml --json errors.toml", "errors.toml"),
        ("simulate plans/session.toml --allow-outside --out . --force", "circle.csv"),
        ("volumetric machine.toml --map functions.toml --functions functions.toml", "functions.toml"),
        ("volumetric machine.toml --map map.csv --functions functions.toml --json machine.toml", "machine.toml"),
    ] {
        let why = format!("{name}: cannot be written: it is one of the files that are read; name another");
        refused(&place.shell(&format!("abbe {line}")), &[&why]);
        assert!(held(&place) == before, "{line}");
    }
    for line in [
        "fit session.toml --json out --csv ./out",
        "fit session.toml --report out --json out",
        "volumetric machine.toml --map out --functions functions.toml --json out",
    ] {
        let why = "out: two results would be written there; name another file for one of them";
        refused(&place.shell(&format!("abbe {line}")), &[why]);
        assert!(held(&place) == before, "{line}");
    }
}

#[test]
fn a_missing_folder() {
    let place = TestFolder::new();
    let output = place.fit(&["--csv", text(&place.at("nowhere/out.csv"))]);
    refused(&output, &["out.csv: cannot be written: there is no folder", "make it first"]);
    assert!(output.stdout.is_empty(), "refused before the work");
}

#[test]
fn a_file_for_a_folder() {
    let place = TestFolder::new();
    place.put("file", "");
    refused(&place.fit(&["--json", text(&place.at("file/out.json"))]), &["there is no folder"]);
    refused(&place.fit(&["--plots", text(&place.at("file"))]), &["file: this is a file; name a folder"]);
}

#[test]
fn a_folder_for_a_file() {
    let place = TestFolder::new();
    refused(&place.fit(&["--json", text(place.0.path())]), &["this is a folder; name a file in it"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_write_protected_folder() {
    let place = TestFolder::new();
    refused(&place.fit(&["--json", "/proc/out.json"]), &["/proc/out.json: cannot be written"]);
}

#[test]
fn a_link_stays_a_link_and_permissions_stay() {
    let place = TestFolder::new();
    place.put("real.json", "old");
    fs::set_permissions(place.at("real.json"), fs::Permissions::from_mode(0o600)).unwrap();
    symlink("real.json", place.at("link.json")).unwrap();
    done(&place.fit(&["--json", text(&place.at("link.json"))]));
    assert!(fs::symlink_metadata(place.at("link.json")).unwrap().is_symlink());
    assert!(fs::read_to_string(place.at("real.json")).unwrap().contains("\"rms_um\""));
    assert_eq!(fs::metadata(place.at("real.json")).unwrap().permissions().mode() & 0o777, 0o600);
}

#[test]
fn a_pipe_for_a_session() {
    let place = TestFolder::new();
    let fitted = place.shell("cat session.toml | abbe fit /dev/stdin --data .");
    done(&fitted);
    // The next steps name the file.
    let result = |stdout: &[u8]| {
        let printed = String::from_utf8(stdout.to_vec()).unwrap();
        printed.split("\nNext:").next().map(str::to_string)
    };
    assert_eq!(result(&fitted.stdout), result(&place.fit(&[]).stdout));
    // Input from a pipe is used as read.
    done(&place.shell("cat session.toml | abbe simulate /dev/stdin --data . --out new"));
    assert!(fs::read_to_string(place.at("new/session.toml")).unwrap().contains("name = \"XY\""));
    // Its checksum is that of what was read.
    done(&place.shell("cat session.toml | abbe fit /dev/stdin --data . --report out.html"));
    assert!(place.at("out.html").exists());
}

#[test]
fn cells_at_opposite_corners_of_a_sheet() {
    let place = TestFolder::new();
    let mut book = Workbook::new();
    let sheet = book.add_worksheet();
    sheet.write_string(0, 0, "x_mm").unwrap();
    sheet.write_number(1_048_575, 16_383, 1.0).unwrap();
    book.save(place.at("far.xlsx")).unwrap();
    place.put("session.toml", &SESSION.replace("NAME", "XY").replace("circle.csv", "far.xlsx"));
    refused(&place.fit(&[]), &["far.xlsx: cells from column 1 to column 16384; the limit is 1000 columns"]);
}

#[test]
fn names_that_are_formulas_are_text_in_a_spreadsheet() {
    for name in ["=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(1,2)", " =1"] {
        let place = TestFolder::new();
        place.put("session.toml", &SESSION.replace("NAME", name));
        let table = place.at("patterns.csv");
        done(&abbe(&["plan", text(&place.at("session.toml")), "--patterns", text(&table)]));
        let mut reader = csv::Reader::from_path(&table).unwrap();
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        assert!(!rows.is_empty());
        assert!(rows.iter().all(|row| row[0] == format!("'{name}")), "{name}: {:?}", rows[0]);
        // Numbers stay numbers, including negative ones.
        assert!(rows.iter().any(|row| row[row.len() - 1].starts_with('-')));
    }
}

#[test]
fn control_characters_are_not_shown() {
    let place = TestFolder::new();
    let table = fs::read_to_string(place.at("circle.csv")).unwrap();
    place.put("circle.csv", &table.replace("length_mm", "\x1b]0;owned\x07\x1b[2J"));
    let output = place.fit(&[]);
    refused(&output, &["circle.csv:1", "?]0;owned??[2J"]);
    assert!(!output.stderr.contains(&0x1b));
}

#[test]
fn names_of_files_that_are_not_utf8() {
    use std::os::unix::ffi::OsStrExt;
    let place = TestFolder::new();
    let odd = place.0.path().join(std::ffi::OsStr::from_bytes(b"caf\xe9 \xc3\xa4"));
    fs::create_dir(&odd).unwrap();
    for name in ["session.toml", "circle.csv"] {
        fs::copy(place.at(name), odd.join(name)).unwrap();
    }
    let run = Command::new(PROGRAM)
        .arg("fit")
        .arg(odd.join("session.toml"))
        .arg("--json")
        .arg(odd.join("out.json"))
        .arg("--report")
        .arg(odd.join("out.html"))
        .output()
        .unwrap();
    done(&run);
    assert!(odd.join("out.json").exists() && odd.join("out.html").exists());
}
