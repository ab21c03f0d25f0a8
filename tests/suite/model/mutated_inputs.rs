//! Mutated inputs of every kind of file, and what is no file: no panic, no other exit status than those of the page on
//! limits, no long message, no wait, no more than 1.5 GB of memory, nothing half-written.
//!
//! `ABBE_MUTATIONS` is the number of mutated inputs (100 by default), `ABBE_MUTATIONS_FIRST` that of the first. The seed is
//! fixed: the number of a failing input names it.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rust_xlsxwriter::Workbook;

use crate::suite::command::faults::TestFolder;

/// Largest address space of the program, KiB.
const MEMORY: u64 = 1_500_000;
/// Longest time of a command, s. It is a wait, not slow work: the commands take a tenth of a second.
const SECONDS: u64 = 100;
/// Largest text on standard error, bytes.
const MAX_MESSAGE: usize = 20_000;

/// The files that are mutated, each with the commands that read it.
const INPUTS: [(&str, &[&str]); 21] = [
    (
        "session.toml",
        &[
            "fit session.toml --json out.json",
            "plan session.toml --no-effects --json out.json",
            "trace session.toml --only EXY --json out.json",
            "simulate session.toml --out out",
            "equation session.toml --all-tests",
            "nc session.toml --control linuxcnc --out out",
            "sheet session.toml --out out.html",
            "validate model.json session.toml --json out.json",
        ],
    ),
    ("plan.toml", &["plan plan.toml --json out.json", "plan plan.toml --improve 1", "simulate plan.toml --out out"]),
    ("machine.toml", &["plan plan.toml --no-effects", "volumetric machine.toml", "simulate plan.toml --out out"]),
    (
        "circle.csv",
        &["fit session.toml --json out.json --report out.html", "fleet run session.toml --out out --no-trace"],
    ),
    ("circle.jsonl", &["fit lines.toml --json out.json"]),
    ("circle.xlsx", &["fit book.toml --json out.json"]),
    ("ballbar.b5r", &["fit xml.toml --json out.json"]),
    ("body.stl", &["plan plan.toml --no-effects --json out.json"]),
    (
        "model.json",
        &[
            "validate model.json session.toml --json out.json",
            "compare model.json session.toml --json out.json",
            "compensate model.json positions.csv --out out.csv",
            "export model.json --as urdf --out out.urdf",
        ],
    ),
    ("positions.csv", &["compensate model.json positions.csv --out out.csv --json out.json"]),
    ("list.txt", &["fleet run --sessions list.txt --out out --no-trace --json out.json"]),
    ("known.csv", &["fleet history results --known-changes known.csv --json out.json"]),
    (
        "RECORD",
        &["fleet history results --json out.json", "fleet run session.toml --out results --no-trace --json out.json"],
    ),
    (
        "NOTE",
        &["fleet history results --json out.json", "fleet run session.toml --out results --no-trace --json out.json"],
    ),
    ("errors.toml", &["simulate session.toml --out out --values errors.toml"]),
    (
        "robot.urdf",
        &["new out --from-urdf robot.urdf", "new out --from-urdf robot.urdf --tip l3 --measured-by sockets"],
    ),
    (
        "robot.csv",
        &["new out --from-dh robot.csv --convention standard", "new out --from-dh robot.csv --convention modified"],
    ),
    (
        "foreign.csv",
        &[
            "import foreign.csv --machine axes.toml --out out --kind ballbar --set bar_mm=100 --set workpiece_ball_mm=[0,0,0] --set \
             spindle_ball_mm=[0,0,0] --json out.json",
        ],
    ),
    ("certificate.toml", &["fit session.toml --dcc out.html --json out.json"]),
    ("stars.dat", &["fit stars.toml --json out.json"]),
    ("functions.toml", &["volumetric axes.toml --functions functions.toml --map out.csv --places 3 --json out.json"]),
];

/// What takes the place of a file: shell lines that make `$F`.
const NO_FILES: [&str; 12] = [
    "ln -s /dev/null $F",
    "ln -s /dev/zero $F",
    "ln -s /dev/full $F",
    "ln -s /dev/urandom $F",
    "ln -s $F $F",
    "ln -s loop $F; ln -s $F loop",
    "ln -s nowhere $F",
    "mkdir $F",
    "mkfifo $F; (timeout 20 sh -c ': > $F') &",
    "mkfifo $F; (timeout 20 cat /dev/zero > $F) &",
    "mkfifo $F; (timeout 20 yes 1,2,3,4 > $F) &",
    "ln -s . $F",
];

/// A folder with one file of each kind.
fn folder() -> TestFolder {
    let place = TestFolder::new();
    let session = fs::read_to_string(place.at("session.toml")).unwrap();
    let data = fs::read_to_string(place.at("circle.csv")).unwrap();
    let about = "[about]\nserial_number = \"M\"\nsession_id = \"1\"\ndate = \"2026-11-23\"\n\n";
    place.put("session.toml", &format!("{about}{session}"));
    let rows: Vec<Vec<&str>> = data.lines().map(|line| line.split(',').collect()).collect();
    let lines = rows[1..].iter().map(|row| {
        let cells = rows[0].iter().zip(row).map(|(name, cell)| format!("\"{name}\": {cell}"));
        format!("{{{}}}\n", cells.collect::<Vec<_>>().join(", "))
    });
    place.put("circle.jsonl", &lines.collect::<String>());
    place.put("lines.toml", &session.replace("circle.csv", "circle.jsonl"));
    let mut book = Workbook::new();
    let sheet = book.add_worksheet();
    for (k, row) in rows.iter().enumerate() {
        for (column, cell) in row.iter().enumerate() {
            match cell.parse::<f64>() {
                Ok(number) => sheet.write_number(k as u32, column as u16, number).unwrap(),
                Err(_) => sheet.write_string(k as u32, column as u16, *cell).unwrap(),
            };
        }
    }
    book.save(place.at("circle.xlsx")).unwrap();
    place.put("book.toml", &session.replace("circle.csv", "circle.xlsx"));
    let readings: Vec<String> = (0..360).map(|k| format!("{}", f64::from(k * 37 % 11 - 5) * 0.1)).collect();
    let run = |way: &str| {
        format!("<RUN><RUN_DIRECTION>{way}</RUN_DIRECTION><READINGS>{}</READINGS></RUN>", readings.join(" "))
    };
    place.put(
        "ballbar.b5r",
        &format!("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<BALLBAR>{}{}</BALLBAR>\n", run("CCW"), run("CW")),
    );
    let path = "data = \"ballbar.b5r\"\ncolumns = { deviation_um = \"READINGS\" }\npath = { kind = \"circle\", plane = \"XY\", \
                radius_mm = 100, from_deg = 0, to_deg = 359, step_deg = 1 }";
    place.put("xml.toml", &session.replace("data = \"circle.csv\"", path));
    place.put(
        "machine.toml",
        "name = \"M\"\nchain = \"w C b X Y Z t\"\naxis = { C = {}, X = {}, Y = {}, Z = {} }\n\
         [[body]]\nname = \"block\"\naxis = \"Z\"\nstl = \"body.stl\"\n",
    );
    place.put(
        "plan.toml",
        "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"ballbar\"\nnoise_um = 0.5\n[[test]]\n\
         name = \"C100\"\nbar_mm = 125\nworkpiece_ball_mm = [0, 100, 0]\nspindle_ball_mm = [0, 0, 0]\n\
         at = { z_mm = 75 }\nsweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 5, runs = 2 }\n",
    );
    let corner = |k: usize| {
        format!("vertex {} {} {}\n", 10 * i32::from(k == 1), 10 * i32::from(k == 2), 100 + 10 * i32::from(k == 3))
    };
    let facet = |face: &[usize; 3]| {
        let corners: String = face.iter().map(|k| corner(*k)).collect();
        format!("facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n")
    };
    let facets: String = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].iter().map(facet).collect();
    place.put("body.stl", &format!("solid t\n{facets}endsolid t\n"));
    place.put("positions.csv", "time_s,x_mm,y_mm\n0,0,0\n1,10,20\n2,-30,5\n");
    let joint = |k: usize, z: f64| {
        format!(
            "  <joint name=\"j{k}\" type=\"revolute\">\n    <parent link=\"l{k}\"/><child link=\"l{}\"/>\n    <origin xyz=\"0.3 0 {z}\" rpy=\"{} 0 0\"/>\n\
             <axis xyz=\"0 0 1\"/><limit lower=\"-2.5\" upper=\"2.5\" effort=\"1\" velocity=\"1\"/>\n  </joint>\n",
            k + 1,
            std::f64::consts::FRAC_PI_2 * f64::from(k as u32 % 2)
        )
    };
    let links: String = (0..5).map(|k| format!("  <link name=\"l{k}\"/>\n")).collect();
    let joints: String = (0..4).map(|k| joint(k, 0.1 * k as f64)).collect();
    place.put("robot.urdf", &format!("<?xml version=\"1.0\"?>\n<robot name=\"arm\">\n{links}{joints}</robot>\n"));
    place.put(
        "robot.csv",
        "joint,type,a_mm,alpha_deg,d_mm,theta_deg,lower_deg,upper_deg\none,R,0,90,254,q1,-170,170\ntwo,R,508,0,0,q2 + 30,-120,120\n\
         three,R,0,-pi/2,0,q3,-150,150\nfour,R,20,90,400,q4 - 90°,-170,170\n",
    );
    let foreign = rows[1..].iter().map(|row| format!("{};{};{}\n", row[1], row[2], row[3]).replace('.', ","));
    place.put("foreign.csv", &format!("Messung 1\nX [mm];Y [mm];Länge [mm]\n{}", foreign.collect::<String>()));
    place.put("certificate.toml", abbe::certificate::EXAMPLE);
    let star = |k: u32| {
        let (azimuth, elevation) = (f64::from(k * 37 % 360), 20.0 + f64::from(k * 13 % 60));
        format!("{azimuth:.4} {elevation:.4} {:.4} {:.4}\n", azimuth + 0.001 * f64::from(k % 3), elevation + 0.002)
    };
    let stars: String = (0..40).map(star).collect();
    place.put("stars.dat", &format!("A night\n: ALTAZ\n31 57 30\n{stars}END\n"));
    place.put(
        "stars.toml",
        "[machine]\nchain = \"w b AZ EL t\"\naxis.AZ = { kind = \"rotary\", direction = [0, 0, -1] }\n\
         axis.EL = { kind = \"rotary\", direction = [0, -1, 0] }\n[instrument]\nkind = \"pointing\"\nnoise_arcsec = 2\n\
         [[test]]\nname = \"night\"\nline_of_sight = [1, 0, 0]\ndata = \"stars.dat\"\n",
    );
    place.put("list.txt", "# sessions\nsession.toml\nlines.toml\n");
    place.put("known.csv", "machine_id,date,parameter,change,unit\nM,2026-11-01,EC0Y,1.5,arcsec\n");
    place.put("errors.toml", "EC0Y = \"2 arcsec\"\n");
    place.put(
        "axes.toml",
        "chain = \"w X b Y t\"\n[axis.X]\ntravel_mm = [-100, 100]\n[axis.Y]\ntravel_mm = [-100, 100]\n",
    );
    place.put(
        "functions.toml",
        "[constant]\nEC0Y = \"-4.0 arcsec\"\n[[function]]\nerror = \"EXX\"\ntable = { at_mm = [-100, 0, 100], um = [-6, 0, 3.5] }\n\
         [[function]]\nerror = \"EYX\"\npolynomial = { scale_mm = 100, um = [0, -2.4, 1.6] }\n",
    );
    for line in [
        "abbe new arm --from-urdf robot.urdf && abbe new arm2 --from-dh robot.csv --convention standard",
        "abbe fit stars.toml --quiet && abbe fit session.toml --dcc out.html --quiet && rm out.html",
        "abbe import foreign.csv --machine axes.toml --out im --kind ballbar --set bar_mm=100 --set workpiece_ball_mm=[0,0,0] \
         --set spindle_ball_mm=[0,0,0]",
        "abbe fit session.toml --save model.json --quiet",
        "abbe fleet run session.toml --out results --no-trace --quiet",
    ] {
        let output = place.shell(line);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
    place
}

/// The name of an input in the folder.
fn name_of(place: &TestFolder, input: &str) -> String {
    let kind = match input {
        "RECORD" => "results",
        "NOTE" => "sessions",
        other => return other.to_string(),
    };
    let output = place.shell(&format!("find results/{kind} -name '*.json'"));
    String::from_utf8(output.stdout).unwrap().trim().to_string()
}

/// Runs a command within its limits.
fn run(place: &TestFolder, command: &str) -> Output {
    let line = format!("ulimit -v {MEMORY}; exec timeout -s KILL {SECONDS} {} {command}", env!("CARGO_BIN_EXE_abbe"));
    let mut shell = Command::new("sh");
    shell.args(["-c", &line]).current_dir(place.0.path()).stdin(Stdio::null()).output().unwrap()
}

/// Asserts what holds for any input.
fn check(place: &TestFolder, what: &str, output: &Output) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    let start: String = stderr.chars().take(2000).collect();
    assert!(matches!(output.status.code(), Some(0..=2)), "{what}: {:?}\n{start}", output.status);
    assert!(!stderr.contains("panicked") && !stderr.contains("a fault of abbe"), "{what}: {start}");
    assert!(stderr.len() <= MAX_MESSAGE, "{what}: a message of {} bytes\n{start}", stderr.len());
    let is_whole = output.status.success();
    let json = place.at("out.json");
    if let Ok(text) = fs::read(&json) {
        assert!(serde_json::from_slice::<serde_json::Value>(&text).is_ok(), "{what}: half a document");
    } else {
        assert!(!(is_whole && what.contains("out.json")), "{what}: no document\n{start}");
    }
    let mut folders = vec![place.0.path().to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap().map(Result::unwrap) {
            let name = entry.file_name().to_string_lossy().into_owned();
            assert!(!name.starts_with(".abbe-") && !name.ends_with(".claim"), "{what}: {name} is left");
            if entry.file_type().unwrap().is_dir() {
                folders.push(entry.path());
            }
        }
    }
}

fn remove(path: &Path) {
    let _ = if path.is_dir() && !path.is_symlink() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
}

/// Removes the outputs.
fn clear(place: &TestFolder) {
    for name in ["out", "out.json", "out.html", "out.csv", "out.urdf", "loop"] {
        remove(&place.at(name));
    }
}

/// Puts back the results, which a run writes too.
fn restore_results(place: &TestFolder, name: &str, original: &[u8]) {
    remove(&place.at(name));
    fs::write(place.at(name), original).unwrap();
}

const TOKENS: [&str; 38] = [
    "nan",
    "inf",
    "-inf",
    "1e300",
    "-1e300",
    "1e-300",
    "1e12",
    "1e9",
    "-1",
    "0",
    "-0.0",
    "999999999999999999999",
    "0x10",
    "\"",
    "'",
    "[",
    "]",
    "{",
    "}",
    "[[test]]\n",
    "[machine]\n",
    ",",
    ";",
    "\n",
    "\r",
    "\t",
    "=",
    "#",
    "\u{feff}",
    "\u{0}",
    "\u{1b}[2J",
    "\u{202e}",
    "𝄞",
    "<",
    "&",
    "]]>",
    "../../../etc/passwd",
    "/dev/zero",
];

/// A mutated copy: one to four changes of bytes, tokens, lines and lengths.
fn mutated(original: &[u8], random: &mut Pcg64Mcg) -> Vec<u8> {
    let mut bytes = original.to_vec();
    for _ in 0..random.random_range(1..=4) {
        let length = bytes.len();
        let at = random.random_range(0..=length);
        let end = (at + random.random_range(1..=40)).min(length);
        let token = TOKENS[random.random_range(0..TOKENS.len())];
        match random.random_range(0..12) {
            0 if at < length => bytes[at] = random.random_range(0..=255),
            1 => drop(bytes.splice(at..at, [random.random_range(0..=255)])),
            2 => drop(bytes.drain(at..end)),
            3 => bytes.truncate(at),
            4 => drop(bytes.splice(at..at, token.bytes())),
            5 => drop(bytes.splice(at..end, token.bytes())),
            // A number is another one.
            6 | 7 => {
                let is_digit = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-');
                if let Some(start) = bytes[at..].iter().position(is_digit).map(|k| at + k) {
                    let end = bytes[start..].iter().position(|byte| !is_digit(byte)).map_or(length, |k| start + k);
                    bytes.splice(start..end, token.bytes());
                }
            }
            // A line is removed, repeated, or moved.
            8 | 9 => {
                let mut lines: Vec<Vec<u8>> =
                    bytes.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
                if !lines.is_empty() {
                    let line = lines.remove(random.random_range(0..lines.len()));
                    // Two thousand long lines would be a large file, not a wrong one.
                    let most = 1 + (1 << 20) / (line.len() + 1);
                    for _ in 0..[0, 1, 2, 2000][random.random_range(0..4)].min(most) {
                        lines.insert(random.random_range(0..=lines.len()), line.clone());
                    }
                    bytes = lines.concat();
                }
            }
            // A long word.
            10 => {
                let word = ["k", "9", "(", "[", " ", "a.", "-", "ä"][random.random_range(0..8)];
                bytes.splice(at..at, word.repeat([70, 3000, 200_000][random.random_range(0..3)]).into_bytes());
            }
            // Names are exchanged.
            _ => {
                let text = String::from_utf8_lossy(&bytes).into_owned();
                let words: Vec<&str> = text
                    .split(|sign: char| !sign.is_alphanumeric() && sign != '_')
                    .filter(|word| word.len() > 1)
                    .collect();
                if words.len() > 1 {
                    let [from, to] = [0; 2].map(|_| words[random.random_range(0..words.len())]);
                    bytes = text.replacen(from, to, 1).into_bytes();
                }
            }
        }
    }
    bytes
}

#[test]
fn mutated_inputs_end_with_a_result_or_a_message() {
    let number_of =
        |name: &str, usual: u64| std::env::var(name).map_or(usual, |text| text.parse().expect("a number of inputs"));
    let (first, end) = (number_of("ABBE_MUTATIONS_FIRST", 0), number_of("ABBE_MUTATIONS", 100));
    let count = end.saturating_sub(first);
    let place = folder();
    let (mut done, mut refused) = (0, 0);
    for number in first..end {
        let mut random = Pcg64Mcg::seed_from_u64(41 + number);
        let (input, commands) = INPUTS[number as usize % INPUTS.len()];
        let command = commands[random.random_range(0..commands.len())];
        let name = name_of(&place, input);
        let original = fs::read(place.at(&name)).unwrap();
        fs::write(place.at(&name), mutated(&original, &mut random)).unwrap();
        let output = run(&place, command);
        let what = format!("input {number}, {input}: abbe {command}");
        if std::env::var_os("ABBE_MUTATIONS").is_some() && !matches!(output.status.code(), Some(0..=2)) {
            let kept = std::env::temp_dir().join(format!("abbe-mutated-{number}"));
            let _ = fs::copy(place.at(&name), kept);
        }
        check(&place, &what, &output);
        if output.status.success() {
            done += 1
        } else {
            refused += 1
        }
        clear(&place);
        restore_results(&place, &name, &original);
    }
    println!("{count} mutated inputs: {done} with a result, {refused} refused");
    assert!(refused > count / 4, "the mutations change little: {refused} of {count} are refused");
}

#[test]
fn what_is_no_file_ends_with_a_message() {
    let all = std::env::var_os("ABBE_MUTATIONS").is_some();
    let place = folder();
    for (number, (input, commands)) in INPUTS.into_iter().enumerate() {
        let name = name_of(&place, input);
        let original = fs::read(place.at(&name)).unwrap();
        for (kind, line) in NO_FILES.into_iter().enumerate() {
            // All pairs take minutes.
            if !all && !(number + 5 * kind).is_multiple_of(6) {
                continue;
            }
            remove(&place.at(&name));
            // The writer of a pipe must not keep the output of the shell open.
            let line = line.replace("$F", &name).replace(") &", ") > /dev/null 2>&1 &");
            assert!(place.shell(&line).status.success(), "{line}");
            let command = commands[kind % commands.len()];
            check(&place, &format!("{line}: abbe {command}"), &run(&place, command));
            clear(&place);
            restore_results(&place, &name, &original);
        }
    }
}
