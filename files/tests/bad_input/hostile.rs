//! Tests of malicious input: names that lead elsewhere, unlimited nesting and growth, files beyond every limit.

use std::fs;
use std::path::Path;

use abbe_files::{ReadOptions, SourceMap};
use abbe_model::Diagnostic;
use abbe_model::session::Session;

use super::{DATA, MACHINE, SESSION, assert_contains, error_text, session, with_data, with_machine, with_session};

/// One test per input: its name, the resulting message, and the text that it must contain.
macro_rules! refused {
    ($($name:ident: $error_text:expr => [$($part:expr),+ $(,)?])+) => {
        $(#[test]
        fn $name() {
            assert_contains(&$error_text, &[$($part),+]);
        })+
    };
}

/// A folder with the session in `inner` and its data both in `inner/sub` and outside, beside `inner`.
struct Sandbox(tempfile::TempDir);

impl Sandbox {
    fn new() -> Sandbox {
        let sandbox = Sandbox(tempfile::tempdir().unwrap());
        fs::create_dir_all(sandbox.at("inner/sub")).unwrap();
        fs::create_dir(sandbox.at("other")).unwrap();
        for file in ["inner/machine.toml", "machine.toml"] {
            fs::write(sandbox.at(file), MACHINE).unwrap();
        }
        for file in ["inner/C100.csv", "inner/sub/C100.csv", "other/C100.csv", "C100.csv"] {
            fs::write(sandbox.at(file), DATA).unwrap();
        }
        sandbox
    }

    fn at(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn read(&self, from: &str, to: &str, options: &ReadOptions) -> Result<Session, Diagnostic> {
        assert!(SESSION.contains(from));
        fs::write(self.at("inner/session.toml"), SESSION.replace(from, to)).unwrap();
        abbe_files::session(&self.at("inner/session.toml"), options)
    }

    fn data(&self, name: &str) -> Result<Session, Diagnostic> {
        self.read("\"C100.csv\"", &format!("\"{name}\""), &ReadOptions::default())
    }

    /// With a data file of this name, the session and its sources.
    fn with_sources(&self, name: &str) -> Result<(Session, SourceMap), Diagnostic> {
        let text = SESSION.replace("\"C100.csv\"", &format!("\"{name}\""));
        fs::write(self.at("inner/session.toml"), text).unwrap();
        abbe_files::session_with_sources(&self.at("inner/session.toml"), &ReadOptions::default())
    }

    fn machine(&self, name: &str) -> Result<Session, Diagnostic> {
        self.read("\"machine.toml\"", &format!("\"{name}\""), &ReadOptions::default())
    }

    fn absolute(&self, name: &str) -> String {
        self.at(name).to_str().unwrap().to_string()
    }
}

fn data_at(name: &str) -> String {
    error_text(Sandbox::new().data(name))
}

fn machine_at(name: &str) -> String {
    error_text(Sandbox::new().machine(name))
}

const OUTSIDE: &str = "is outside the session's folder: ";

refused! {
    data_above: data_at("../C100.csv") => ["session.toml:10", "`data = \"../C100.csv\"`", OUTSIDE, "allow files outside"]
    data_above_by_a_detour: data_at("sub/../../C100.csv") => ["session.toml:10", OUTSIDE]
    data_in_another_branch: data_at("../other/C100.csv") => ["session.toml:10", OUTSIDE, "other"]
    missing_data_in_the_parent_folder: data_at("../nowhere.csv") => ["session.toml:10", "`../nowhere.csv` does not exist"]
    data_that_are_a_folder: data_at("sub") => ["sub:0", "it is a folder"]
    data_without_a_name: data_at("") => ["it is a folder"]
    data_with_a_nul: data_at("a\\u0000b") => ["session.toml:10", "control character U+0000"]
    a_machine_above: machine_at("../machine.toml") => ["session.toml:2", "`file = \"../machine.toml\"`", OUTSIDE]
    a_machine_that_is_a_folder: machine_at("sub") => ["this is a folder; the machine file must be a file"]
    a_machine_that_is_data: machine_at("C100.csv") => ["C100.csv:1", "not valid TOML"]
}

#[test]
fn an_absolute_name_outside() {
    let sandbox = Sandbox::new();
    let outside = sandbox.absolute("C100.csv").replace('\\', "/");
    assert_contains(&error_text(sandbox.data(&outside)), &["session.toml:10", OUTSIDE, "allow files outside"]);
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_that_leads_out() {
    let sandbox = Sandbox::new();
    std::os::unix::fs::symlink(sandbox.at("C100.csv"), sandbox.at("inner/link.csv")).unwrap();
    assert_contains(&error_text(sandbox.data("link.csv")), &["session.toml:10", "`data = \"link.csv\"`", OUTSIDE]);
}

#[cfg(unix)]
#[test]
fn a_folder_that_is_a_symbolic_link_out() {
    let sandbox = Sandbox::new();
    std::os::unix::fs::symlink(sandbox.at("other"), sandbox.at("inner/link")).unwrap();
    assert_contains(&error_text(sandbox.data("link/C100.csv")), &["session.toml:10", OUTSIDE]);
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_that_leads_in_a_circle() {
    let sandbox = Sandbox::new();
    std::os::unix::fs::symlink(sandbox.at("inner/loop.csv"), sandbox.at("inner/loop.csv")).unwrap();
    assert_contains(&error_text(sandbox.data("loop.csv")), &["session.toml:10", "`loop.csv` does not exist"]);
}

#[cfg(unix)]
#[test]
fn a_device() {
    assert_contains(&data_at("/dev/zero"), &["session.toml:10", OUTSIDE]);
    let sandbox = Sandbox::new();
    let options = ReadOptions { allow_outside: true, ..ReadOptions::default() };
    let endless = sandbox.read("\"C100.csv\"", "\"/dev/zero\"", &options);
    assert_contains(&error_text(endless), &["zero:1", "a line of more than 1048576 bytes"]);
}

#[test]
fn above_the_data_directory_is_outside_too() {
    let sandbox = Sandbox::new();
    let options = ReadOptions { data_directory: Some(sandbox.at("other")), ..ReadOptions::default() };
    assert_contains(
        &error_text(sandbox.read("\"C100.csv\"", "\"../C100.csv\"", &options)),
        &["session.toml:10", OUTSIDE],
    );
}

#[test]
fn files_inside_are_read_under_any_name() {
    let sandbox = Sandbox::new();
    let inside = sandbox.absolute("inner/sub/C100.csv").replace('\\', "/");
    for name in ["C100.csv", "./C100.csv", "sub/C100.csv", "sub/../C100.csv", "../inner/C100.csv", &inside] {
        assert!(sandbox.data(name).is_ok(), "{name}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("sub/C100.csv", sandbox.at("inner/link.csv")).unwrap();
        assert!(sandbox.data("link.csv").is_ok());
    }
    let elsewhere = ReadOptions { data_directory: Some(sandbox.at("other")), ..ReadOptions::default() };
    fs::remove_file(sandbox.at("inner/C100.csv")).unwrap();
    assert!(sandbox.read("kind", "kind", &elsewhere).is_ok());
    let trusted = ReadOptions { allow_outside: true, ..ReadOptions::default() };
    assert!(sandbox.read("\"C100.csv\"", "\"../C100.csv\"", &trusted).is_ok());
}

fn ball(expression: &str) -> String {
    with_session("[0, 100, 0]", &format!("[0, \"{expression}\", 0]"))
}

fn nested(open: &str, close: &str, times: usize) -> String {
    format!("{}1{}", open.repeat(times), close.repeat(times))
}

refused! {
    lists_nested_without_end: error_text(session(MACHINE, &format!("x = {}", nested("[", "]", 100_000)), None)) => ["session.toml:1", "not valid TOML", "recursion", "nested 80 levels deep"]
    tables_nested_without_end: error_text(session(MACHINE, &format!("x = {}", nested("{a=", "}", 100_000)), None)) => ["session.toml:1", "not valid TOML", "recursion", "nested 80 levels deep"]
    keys_of_many_parts: error_text(session(MACHINE, &format!("a{} = 1", ".a".repeat(100_000)), None)) => ["session.toml:1", "not valid TOML", "recursion", "nested 80 levels deep"]
    headers_of_many_parts: error_text(session(MACHINE, &format!("[a{}]\nx = 1", ".a".repeat(100_000)), None)) => ["session.toml:1", "not valid TOML", "recursion", "nested 80 levels deep"]
    a_key_twice: with_session("noise_um = 0.3", "noise_um = 0.3\nnoise_um = 0.4") => ["session.toml:7", "not valid TOML", "duplicate key"]
    an_expression_beyond_all_length: ball(&"1+".repeat(300)) => ["session.toml:12", "an expression of 600 characters; the limit is 400"]
    parentheses_beyond_all_depth: ball(&nested("(", ")", 60)) => ["session.toml:12", "nested deeper than 40"]
    roots_beyond_all_depth: ball(&nested("sqrt(", ")", 60)) => ["session.toml:12", "nested deeper than 40"]
    signs_beyond_all_depth: ball(&nested("-", "", 60)) => ["session.toml:12", "nested deeper than 40"]
    squares_that_double_each_time: ball(&nested("(", ")^2", 38)) => ["session.toml:12", "too many nested squares"]
    a_power_other_than_two: ball("2^3") => ["`^` with a power other than 2"]
    a_division_by_zero: ball("1/0") => ["session.toml:12", "evaluates to inf"]
    a_root_of_a_negative_number: ball("sqrt(0-1)") => ["session.toml:12", "evaluates to NaN"]
    an_expression_that_breaks_off: ball("1+") => ["the expression ends where a number or a constant is expected"]
    an_expression_that_goes_on: ball("1 1") => ["`1` where the expression should end"]
    a_call_of_another_function: ball("exec(1)") => ["no constant `exec`"]
    a_constant_with_the_name_of_the_root: with_session("[[test]]", "[constants]\nsqrt = 1\n[[test]]") => ["a constant cannot have the name `sqrt`"]
    a_constant_without_a_value: with_session("[[test]]", "[constants]\nR = { means = \"radius\" }\n[[test]]") => ["the constant `R` has no `mm`"]
    a_constant_with_an_unknown_key: with_session("[[test]]", "[constants]\nR = { mm = 1, unit = \"mm\" }\n[[test]]") => ["the constant `R` has the unknown key `unit`"]
    more_constants_than_anybody_names: with_session("[[test]]", &format!("[constants]\n{}\n[[test]]", (0..1200).map(|k| format!("c{k} = 1\n")).collect::<String>())) => ["[constants] has 1200 entries; the limit is 1000"]
    more_tests_than_anybody_runs: error_text(session(MACHINE, &format!("{SESSION}{}", "[[test]]\n".repeat(1200)), Some(DATA))) => ["`test` is a list of 1201; the limit is 1000"]
    more_effects_than_anybody_declares: with_session("[[test]]", &format!("{}\n[[test]]", "[[effect]]\n".repeat(1200))) => ["`effect` is a list of 1200; the limit is 1000"]
    more_axes_than_any_machine_has: with_machine("w C A b Y X Z t", &format!("w {}b t", (0..80).map(|k| format!("J{k} ")).collect::<String>())) => ["machine.toml:2", "81 bodies; the limit is 64 axes"]
    an_axis_with_a_name_of_other_signs: with_machine("w C A b Y X Z t", "w =cmd() b t") => ["machine.toml:2", "`=cmd()` is not an axis name"]
    a_name_that_steers_the_terminal: with_session("\"C100\"", "\"\\u001b[2J\"") => ["session.toml:9", "control character U+001B"]
    a_name_of_several_lines: with_session("\"C100\"", "\"a\\nb\"") => ["session.toml:9", "control character U+000A"]
    a_name_of_nothing: with_session("\"C100\"", "\"  \"") => ["session.toml:9", "a test without a name"]
    a_whole_number_of_forty_digits: with_session("noise_um = 0.3", &format!("noise_um = -{}", "9".repeat(40))) => ["session.toml:6", "too large; the limit is 1e12"]
    a_number_beyond_all_numbers: with_session("noise_um = 0.3", "noise_um = 1e999") => ["session.toml:6", "`noise_um` is infinite"]
    a_list_where_a_number_belongs: with_session("noise_um = 0.3", "noise_um = [0.3]") => ["session.toml:6", "`noise_um` is a list of 1; a number is expected"]
    a_date_where_a_number_belongs: with_session("noise_um = 0.3", "noise_um = 2026-01-01") => ["session.toml:6", "`noise_um` is a date"]
    a_date_where_a_length_belongs: with_session("bar_mm = 100.0", "bar_mm = 2024-01-01") => ["session.toml:11", "`bar_mm` is a date"]
    a_date_where_a_position_belongs: with_session("bar_mm = 100.0", "bar_mm = 100.0\nat = { x_mm = 0080-01-01 }") => ["`x_mm` is a date"]
    a_position_in_metres_beyond_a_kilometre: with_session("bar_mm = 100.0", "bar_mm = 100.0\nat = { x_m = \"2000\" }") => ["`x_m` = \"2000\" evaluates to 2000, which is too large; the limit is 1 km"]
    more_columns_than_any_file_has: with_session("data = \"C100.csv\"", &format!("data = \"C100.csv\"\ncolumns = {{ {} }}", (0..1200).map(|k| format!("c{k} = \"{k}\"")).collect::<Vec<_>>().join(", "))) => ["has 1200 entries; the limit is 1000"]
    a_point_of_two_coordinates: with_session("[0, 100, 0]", "[0, 100]") => ["session.toml:12", "a list of 2; a list of three lengths is expected"]
    a_sweep_of_steps_beyond_count: with_session("data = \"C100.csv\"", "sweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 1e-9 }") => ["session.toml:10", "the limit is 1000000 readings"]
    a_sweep_without_a_step: with_session("data = \"C100.csv\"", "sweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 0 }") => ["session.toml:10", "`step_deg` must be greater than 0"]
    runs_beyond_count: with_session("data = \"C100.csv\"", "sweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 1, runs = 1000000 }") => ["session.toml:10", "the limit is 1000000 readings"]
}

/// Reads a data file of arbitrary bytes.
fn with_bytes(bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("machine.toml"), MACHINE).unwrap();
    fs::write(at("session.toml"), SESSION).unwrap();
    fs::write(at("C100.csv"), bytes).unwrap();
    error_text(abbe_files::session(&at("session.toml"), &ReadOptions::default()))
}

fn utf16(text: &str) -> Vec<u8> {
    let mut bytes = vec![0xff, 0xfe];
    bytes.extend(text.encode_utf16().flat_map(u16::to_le_bytes));
    bytes
}

refused! {
    a_table_in_utf16_that_breaks_off: with_bytes(&utf16(DATA.trim_end())[..2 * DATA.trim_end().len() + 1]) => ["C100.csv:5", "the line is not valid UTF-16LE"]
    a_table_with_the_line_ends_of_old: with_bytes(DATA.replace('\n', "\r").as_bytes()) => ["C100.csv:1", "a carriage return within a line", "LF or CRLF"]
    a_cell_that_is_not_utf8: with_bytes(&DATA.replace("100.0010", "100.0~").bytes().map(|b| if b == b'~' { 0xe4 } else { b }).collect::<Vec<_>>()) => ["C100.csv:3", "column 4", "is not a number"]
    a_cell_with_a_nul: with_data(&DATA.replace("100.0010", "100\0")) => ["C100.csv:3", "column 4", "is not a number"]
    a_cell_with_a_formula: with_data(&DATA.replace("100.0010", "=1+1")) => ["C100.csv:3", "`=1+1` is not a number"]
    an_unclosed_quote: with_data(&DATA.replace("100.0010", "\"100.0010")) => ["C100.csv:3", "a quote is not closed"]
    a_run_number_that_is_not_an_integer: with_data(&DATA.replace("1,1,90", "1,1.5,90")) => ["C100.csv:3", "`1.5` is not a run number"]
    a_column_twice: with_data(&DATA.replace("time_s", "run")) => ["C100.csv:1", "`run`"]
    a_cell_too_many: with_data(&DATA.replace("100.0010", "100.0010,7")) => ["C100.csv:3", "5 cells", "4 columns"]
}

/// A sparse file of this number of NUL bytes, which occupies no disk space.
fn sparse(name: &str, bytes: u64) -> String {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("machine.toml"), MACHINE).unwrap();
    let columns = "columns = { deviation_um = \"READINGS\" }\n";
    fs::write(at("session.toml"), SESSION.replace("C100.csv", name) + columns).unwrap();
    let file = fs::File::create(at(name)).unwrap();
    file.set_len(bytes).unwrap();
    let read = |file: &Path| abbe_files::session(file, &ReadOptions::default());
    error_text(read(&at(if name.ends_with(".toml") { name } else { "session.toml" })))
}

refused! {
    a_gigabyte_in_one_line: sparse("C100.csv", 1 << 30) => ["C100.csv:1", "a line of more than 1048576 bytes"]
    a_table_beyond_the_limit: sparse("C100.csv", (2 << 30) + 1) => ["C100.csv:0", "a data file of 2147483649 bytes; the limit is 2147483648", "split the file"]
    a_spreadsheet_beyond_the_limit: sparse("C100.xlsx", (64 << 20) + 1) => ["C100.xlsx:0", "a spreadsheet of 67108865 bytes; the limit is 67108864"]
    a_ball_bar_file_beyond_the_limit: sparse("C100.b5r", (64 << 20) + 1) => ["C100.b5r:0", "more than 67108864 bytes"]
    a_session_beyond_the_limit: sparse("other.toml", (8 << 20) + 1) => ["other.toml:0", "the session file has more than 8388608 bytes", "readings belong in CSV files"]
}

#[test]
fn a_spreadsheet_that_unpacks_without_end() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("machine.toml"), MACHINE).unwrap();
    fs::write(at("session.toml"), SESSION.replace("C100.csv", "C.xlsx")).unwrap();
    let mut writer = zip::ZipWriter::new(fs::File::create(at("C.xlsx")).unwrap());
    writer.start_file("xl/sharedStrings.xml", zip::write::SimpleFileOptions::default()).unwrap();
    for _ in 0..257 {
        writer.write_all(&vec![b' '; 1 << 20]).unwrap();
    }
    writer.finish().unwrap();
    assert!(fs::metadata(at("C.xlsx")).unwrap().len() < 1 << 20);
    assert_contains(
        &error_text(abbe_files::session(&at("session.toml"), &ReadOptions::default())),
        &["C.xlsx:0", "unpacks to more than 268435456 bytes", "export it as CSV"],
    );
}

#[test]
fn nesting_up_to_the_limit_is_read() {
    let deep = |levels: usize| error_text(session(MACHINE, &format!("x = {}", nested("[", "]", levels)), None));
    assert_contains(&deep(79), &["the file has the unknown key `x`"]);
    assert_contains(&deep(81), &["nested 80 levels deep"]);
}

fn with_xml(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("machine.toml"), MACHINE).unwrap();
    let columns = "columns = { deviation_um = \"READINGS\" }\n";
    fs::write(at("session.toml"), SESSION.replace("C100.csv", "C.b5r") + columns).unwrap();
    fs::write(at("C.b5r"), text).unwrap();
    error_text(abbe_files::session(&at("session.toml"), &ReadOptions::default()))
}

refused! {
    elements_nested_without_end: with_xml(&"<a>\n".repeat(100_000)) => ["C.b5r:101", "elements are nested deeper than 100"]
    entities_that_multiply: with_xml("<!DOCTYPE a [<!ENTITY x \"yyyyyyyy\"><!ENTITY z \"&x;&x;&x;&x;\">]><a>&z;</a>") => ["C.b5r:0", "it has no element READINGS"]
    elements_that_cross: with_xml("<a><b></a></b>") => ["C.b5r:1", "not valid XML"]
    an_element_without_its_end: with_xml("<a>\n<b>") => ["C.b5r:2", "it ends within <b>"]
}

/// A pipe is read once, as a stream.
#[cfg(unix)]
#[test]
fn a_pipe_is_read_as_a_stream() {
    let sandbox = Sandbox::new();
    let pipe = sandbox.at("inner/pipe.csv");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    let writer = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::write(pipe, DATA).unwrap()
    });
    let (session, sources) = sandbox.with_sources("pipe.csv").unwrap();
    writer.join().unwrap();
    assert_eq!(session.tests[0].readings.as_ref().unwrap().rows(), 4);
    let stamp = sources.files.iter().find(|stamp| stamp.file == pipe).unwrap();
    assert_eq!(stamp.read().unwrap().count, DATA.len() as u64);
}

/// The checksum of a file is that of the bytes that were read, whatever becomes of the file.
#[test]
fn files_have_the_checksums_of_what_was_read() {
    let sandbox = Sandbox::new();
    let (_, sources) = sandbox.with_sources("C100.csv").unwrap();
    let names: Vec<_> = sources.files.iter().map(|stamp| stamp.file.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["session.toml", "machine.toml", "C100.csv"]);
    let before: Vec<_> = sources.files.iter().map(|stamp| stamp.sha256().unwrap()).collect();
    fs::write(sandbox.at("inner/C100.csv"), format!("{DATA}4,1,300,100\n")).unwrap();
    assert_eq!(sources.files[2].sha256().unwrap(), before[2]);
    let (_, again) = sandbox.with_sources("C100.csv").unwrap();
    let changed: Vec<bool> =
        again.files.iter().zip(&before).map(|(stamp, sum)| stamp.sha256().unwrap() != *sum).collect();
    assert_eq!(changed, [false, false, true]);
}

#[cfg(unix)]
#[test]
fn folders_and_files_of_any_name_are_read() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    for name in [&b"with space"[..], b"caf\xe9", "größe µm".as_bytes(), b"-rf", b"a'b\"c"] {
        let inner = folder.path().join(std::ffi::OsStr::from_bytes(name));
        fs::create_dir(&inner).unwrap();
        fs::write(inner.join("machine.toml"), MACHINE).unwrap();
        fs::write(inner.join("C 100.csv"), DATA).unwrap();
        fs::write(inner.join("my session.toml"), SESSION.replace("C100.csv", "C 100.csv")).unwrap();
        assert!(abbe_files::session(&inner.join("my session.toml"), &ReadOptions::default()).is_ok());
    }
}
