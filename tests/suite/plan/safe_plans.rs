//! Plans of `abbe new --from-code` are safe as they come: an independent program reads the NC programs of their tests,
//! moves table and spindle with kinematics of its own, and measures what stays between them.

#[path = "../../../codegen/tests/equations/nc/decode.rs"]
#[allow(dead_code)] // The reader of plain text is for another test.
mod decode;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use toml::Table;

use self::decode::{Counting, Move, Positions, canonical, of_g_codes, of_three_decimals};
use crate::suite::{abbe, text};

/// Machines with all kinds of table and head.
const CODES: [&str; 14] = [
    "[wCbXYZt]",
    "[wAbXYZt]",
    "[wCAbYXZt]",
    "[wCBbXYZt]",
    "[wBAXYbZt]",
    "[wCBAbXYZt]",
    "[wCXbYZAt]",
    "[wCbXYZAt]",
    "[wCbXYZBt]",
    "[wAXYbZBt]",
    "[wXYbZCAt]",
    "[wbXYZCBt]",
    "[wXYbZABt]",
    "[wbXYZBAt]",
];
/// What has to stay between two parts, mm.
const LEAST_MM: f64 = 5.0;

/// An axis as its file states it.
struct Axis {
    letter: char,
    direction: Vector3<f64>,
    origin: Vector3<f64>,
}

/// A machine as its file states it: the axes of each side from the outermost to the bed.
struct Machine {
    workpiece: Vec<Axis>,
    tool: Vec<Axis>,
    table: [[f64; 3]; 2],
    spindle: [[f64; 3]; 2],
}

/// What a test sets up.
struct SetUp {
    name: String,
    bar: f64,
    workpiece: Point3<f64>,
    spindle: Point3<f64>,
}

fn table(path: &Path) -> Table {
    std::fs::read_to_string(path).unwrap().parse().unwrap()
}

fn number(value: &toml::Value) -> f64 {
    match value {
        toml::Value::Integer(number) => *number as f64,
        toml::Value::Float(number) => *number,
        // The expressions of these plans.
        toml::Value::String(words) => {
            let (mut sum, mut sign) = (0.0, 1.0);
            for word in words.replace("sqrt(R_e^2 - R^2)", "lift").replace('-', "- ").split_whitespace() {
                match word {
                    "+" => sign = 1.0,
                    "-" => sign = -1.0,
                    "R" | "R_c" => sum += sign * 100.0,
                    "R_e" => sum += sign * 150.0,
                    "lift" => sum += sign * 12_500.0_f64.sqrt(),
                    other => sum += sign * other.parse::<f64>().unwrap(),
                }
            }
            sum
        }
        other => panic!("{other}"),
    }
}

fn vector(value: &toml::Value) -> [f64; 3] {
    let numbers: Vec<f64> = value.as_array().unwrap().iter().map(number).collect();
    numbers.try_into().unwrap()
}

fn corners(value: &toml::Value) -> [[f64; 3]; 2] {
    let corners: Vec<[f64; 3]> = value.as_array().unwrap().iter().map(vector).collect();
    corners.try_into().unwrap()
}

impl Machine {
    fn read(path: &Path) -> Machine {
        let file = table(path);
        let chain: Vec<char> = file["chain"].as_str().unwrap().chars().filter(|c| !c.is_whitespace()).collect();
        let bed = chain.iter().position(|letter| *letter == 'b').unwrap();
        let axis = |letter: &char| {
            let own = &file["axis"][&letter.to_string()];
            Axis {
                letter: *letter,
                direction: vector(&own["direction"]).into(),
                origin: own.get("origin_mm").map_or(Vector3::zeros(), |origin| vector(origin).into()),
            }
        };
        let body = |name: &str| {
            let bodies = file["body"].as_array().unwrap();
            let own = bodies.iter().find(|body| body["name"].as_str() == Some(name)).unwrap();
            // Table and spindle are carried by the outermost axes.
            let carrier = own.get("axis").map(|axis| axis.as_str().unwrap().chars().next().unwrap());
            let outermost = if name == "table" { &chain[..bed][1..] } else { &chain[bed + 1..chain.len() - 1] };
            let outermost = if name == "table" { outermost.first() } else { outermost.last() };
            assert_eq!(carrier, outermost.copied(), "{name}");
            corners(&own["box_mm"])
        };
        Machine {
            workpiece: chain[1..bed].iter().map(axis).collect(),
            tool: chain[bed + 1..chain.len() - 1].iter().rev().map(axis).collect(),
            table: body("table"),
            spindle: body("spindle"),
        }
    }

    /// The motion of what the outermost axis of a side carries.
    fn moved(side: &[Axis], at: &Positions) -> Isometry3<f64> {
        side.iter().fold(Isometry3::identity(), |inner, axis| {
            let q = at[&axis.letter];
            let own = if "ABC".contains(axis.letter) {
                let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis.direction), q.to_radians());
                Translation3::from(axis.origin) * turn * Translation3::from(-axis.origin)
            } else {
                Isometry3::from_parts(Translation3::from(q * axis.direction), UnitQuaternion::identity())
            };
            own * inner
        })
    }

    /// The motion of the tool as the table sees it.
    fn tool_over_table(&self, at: &Positions) -> Isometry3<f64> {
        Machine::moved(&self.workpiece, at).inverse() * Machine::moved(&self.tool, at)
    }
}

fn set_ups(path: &Path) -> Vec<SetUp> {
    let tests = table(path);
    let of = |test: &toml::Value| SetUp {
        name: test["name"].as_str().unwrap().into(),
        bar: number(&test["bar_mm"]),
        workpiece: vector(&test["workpiece_ball_mm"]).into(),
        spindle: vector(&test["spindle_ball_mm"]).into(),
    };
    tests["test"].as_array().unwrap().iter().map(of).collect()
}

/// The distance of a point from a box.
fn to_box(point: &Point3<f64>, [low, high]: &[[f64; 3]; 2]) -> f64 {
    let beyond = |i: usize| (low[i] - point[i]).max(point[i] - high[i]).max(0.0);
    (0..3).map(|i| beyond(i).powi(2)).sum::<f64>().sqrt()
}

/// Points between two others.
fn between(a: Point3<f64>, b: Point3<f64>, count: usize) -> Vec<Point3<f64>> {
    (0..=count).map(|k| a + (b - a) * (k as f64 / count as f64)).collect()
}

/// Points of the surface of the spindle, 10 mm apart across it.
fn of_spindle([low, high]: &[[f64; 3]; 2]) -> Vec<Point3<f64>> {
    let mut points = Vec::new();
    let along = |i: usize, k: usize, count: usize| low[i] + (high[i] - low[i]) * k as f64 / count as f64;
    for x in 0..=12 {
        for y in 0..=12 {
            let on_side = x % 12 == 0 || y % 12 == 0;
            for z in 0..=if on_side { 8 } else { 0 } {
                points.push([along(0, x, 12), along(1, y, 12), along(2, z, 8)].into());
            }
        }
    }
    points
}

/// The parts of a test, and what is measured between them.
struct Clearances<'m> {
    machine: &'m Machine,
    set_up: &'m SetUp,
    spindle: Vec<Point3<f64>>,
    stand: Vec<Point3<f64>>,
    holder: Vec<Point3<f64>>,
    stem: f64,
}

impl<'m> Clearances<'m> {
    fn of(machine: &'m Machine, set_up: &'m SetUp, plan: &Table) -> Self {
        let sizes = &plan["clearance"];
        let (down, up) = (&sizes["workpiece_holder"], &sizes["spindle_holder"]);
        let foot = set_up.workpiece - Vector3::z() * number(&down["length_mm"]);
        let nose = set_up.spindle + Vector3::z() * number(&up["length_mm"]);
        Clearances {
            machine,
            set_up,
            spindle: of_spindle(&machine.spindle),
            stand: between(set_up.workpiece, foot, 20),
            holder: between(set_up.spindle, nose, 20),
            stem: number(&down["radius_mm"]),
        }
    }

    /// The least clearance at a position, mm, below 0 if the spindle is below the table; with the bar if it is mounted.
    fn least(&self, at: &Positions, with_bar: bool) -> f64 {
        let tool = self.machine.tool_over_table(at);
        let table = tool.inverse();
        let (own, surface) = (self.machine, self.machine.table[1][2]);
        // Nothing of the tool goes below the surface, beside the table neither.
        let above = |point: Point3<f64>, mm: f64| if point.z < surface { point.z - surface } else { mm };
        let of_spindle = self.spindle.iter().map(|point| tool * point);
        let of_spindle = of_spindle.map(|point| above(point, to_box(&point, &own.table)));
        let of_holder = self.holder.iter().map(|point| tool * point);
        let of_holder = of_holder.map(|point| above(point, to_box(&point, &own.table) - self.stem));
        let of_stand = self.stand.iter().map(|point| to_box(&(table * point), &own.spindle) - self.stem);
        let least = of_spindle.chain(of_holder).chain(of_stand).fold(f64::INFINITY, f64::min);
        if !with_bar {
            return least;
        }
        let holder: Vec<Point3<f64>> = self.holder.iter().map(|point| tool * point).collect();
        let pairs = self.stand.iter().flat_map(|own| holder.iter().map(move |other| (own - other).norm()));
        let of_holders = pairs.map(|mm| mm - 2.0 * self.stem);
        let bar = between(self.set_up.workpiece, tool * self.set_up.spindle, 20);
        let of_bar =
            bar.iter().map(|point| to_box(&(table * point), &own.spindle).min(to_box(point, &own.table)) - self.stem);
        of_holders.chain(of_bar).fold(least, f64::min)
    }

    fn distance(&self, at: &Positions) -> f64 {
        (self.machine.tool_over_table(at) * self.set_up.spindle - self.set_up.workpiece).norm()
    }

    /// Largest difference of the distance of the balls from the bar along the measured paths, mm.
    fn off(&self, moves: &[Move]) -> f64 {
        let points = moves.iter().filter(|own| own.run.is_some()).flat_map(|own| &own.points);
        points.map(|at| (self.distance(at) - self.set_up.bar).abs()).fold(0.0, f64::max)
    }
}

/// The motions as LinuxCNC's interpreter prints them.
fn interpreted(interpreter: &Path, folder: &Path, file: &str) -> Vec<Move> {
    let mut yes = Command::new("yes").stdout(Stdio::piped()).spawn().unwrap();
    let input = yes.stdout.take().unwrap();
    let output = Command::new(interpreter).args(["-g", file]).current_dir(folder).stdin(input).output().unwrap();
    yes.kill().unwrap();
    yes.wait().unwrap();
    assert!(output.status.success(), "{file}: {}", String::from_utf8_lossy(&output.stderr));
    canonical(&String::from_utf8(output.stdout).unwrap())
}

/// Runs the command; nothing may be a warning.
fn quiet(arguments: &[&str]) {
    let output = abbe(arguments);
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && !messages.contains("warning"), "{arguments:?}: {messages}");
}

/// A machine of a code, its plan and its programs for a control.
fn made(folder: &Path, code: &str, more: &[&str]) -> PathBuf {
    let made = folder.join(code.trim_matches(['[', ']'])).join(more.concat());
    quiet(&[&["new", text(&made), "--from-code", code][..], more].concat());
    let plan = made.join("plan.toml");
    quiet(&["plan", text(&plan), "--no-effects"]);
    quiet(&["sheet", text(&plan), "--out", text(&made.join("sheets.html"))]);
    for control in ["linuxcnc", "fanuc"] {
        quiet(&["nc", text(&plan), "--control", control, "--out", text(&made.join(control))]);
    }
    made
}

/// The file of a test's program.
fn program(folder: &Path, extension: &str, test: &str) -> String {
    let name = test.replace(' ', "_");
    format!("{}.{extension}", if folder.ends_with("linuxcnc") { name.to_lowercase() } else { name })
}

/// Asserts that the programs of a machine keep the bar and stay clear of everything. Returns the largest change of the
/// distance of the balls, the same on an increment of 0.001, and the least clearance, mm.
fn assert_safe(made: &Path, interpreter: Option<&Path>) -> [f64; 3] {
    let machine = Machine::read(&made.join("machine.toml"));
    let plan = table(&made.join("plan.toml"));
    let set_ups = set_ups(&made.join("plan.toml"));
    assert!(set_ups.len() > 1);
    // The extension is mounted once, and stays.
    assert!(set_ups.is_sorted_by_key(|test| test.bar), "{}", made.display());
    let rotary = machine.workpiece.iter().chain(&machine.tool).filter(|axis| "ABC".contains(axis.letter)).count();
    assert!(set_ups.len() >= 2 * rotary);
    let mut found = [0.0, 0.0, f64::INFINITY];
    for set_up in &set_ups {
        let clearances = Clearances::of(&machine, set_up, &plan);
        let folder = made.join("linuxcnc");
        let file = program(&folder, "ngc", &set_up.name);
        let text = std::fs::read_to_string(folder.join(&file)).unwrap();
        let mut moves = of_g_codes(&text, Counting::Turns);
        if let Some(interpreter) = interpreter {
            let run = interpreted(interpreter, &folder, &file);
            assert_eq!(run.len(), moves.len(), "{file}");
            moves = run;
        }
        let off = clearances.off(&moves);
        assert!(off < 1e-3, "{}: the distance of the balls changes by {off} mm", set_up.name);
        found[0] = off.max(found[0]);
        let measured = |own: &&Move| own.run.is_some();
        let first = moves.iter().position(|own| measured(&own)).unwrap();
        let last = moves.iter().rposition(|own| measured(&own)).unwrap();
        // The way to the first position, of the rotary and then of the linear axes, is the operator's.
        for (number, own) in moves.iter().enumerate().skip(2) {
            let points = own.points.iter().rev().step_by(own.points.len().div_ceil(40).max(1));
            for at in points {
                let mm = clearances.least(at, (first..=last).contains(&number));
                assert!(mm >= LEAST_MM, "{}, {}: {mm} mm at {at:?}", made.display(), set_up.name);
                found[2] = mm.min(found[2]);
            }
        }
        // A control of 0.001 mm that rounds, or cuts off.
        let folder = made.join("fanuc");
        let text = std::fs::read_to_string(folder.join(program(&folder, "nc", &set_up.name))).unwrap();
        for cuts in [false, true] {
            let off = clearances.off(&of_g_codes(&of_three_decimals(&text, cuts), Counting::Turns));
            assert!(off < 2e-3, "{}: on the increment the distance changes by {off} mm", set_up.name);
            found[1] = off.max(found[1]);
        }
    }
    found
}

/// Asserts that the sheets of a machine change the bar where its length changes, and nowhere else.
fn assert_bar_changes(made: &Path) {
    let sheets = std::fs::read_to_string(made.join("sheets.html")).unwrap();
    let pages: Vec<&str> = sheets.split("<section class=\"sheet\">").skip(2).collect();
    let set_ups = set_ups(&made.join("plan.toml"));
    assert_eq!(pages.len(), set_ups.len());
    let mut before: Option<&SetUp> = None;
    for (page, set_up) in pages.iter().zip(&set_ups) {
        let expected = match before {
            None => "Bar: assemble it without an extension".to_string(),
            Some(last) if last.bar == set_up.bar => format!("Bar: stays assembled as in test {}<", last.name),
            Some(_) => "Bar: put the extension of 50 mm on<".to_string(),
        };
        assert!(page.contains(&expected), "{}, {}: {expected}", made.display(), set_up.name);
        assert_eq!(page.matches("Bar: ").count(), 1);
        before = Some(set_up);
    }
}

#[test]
fn programs_of_generated_plans_are_safe_as_they_come() {
    let interpreter = test_needs::program("safe_plans", &["rs274"], &[]);
    let folder = tempfile::tempdir().unwrap();
    for code in CODES {
        let made = made(folder.path(), code, &[]);
        let [off, on_increment, least] = assert_safe(&made, interpreter.as_deref());
        println!("{code}: {:.2} um, on 0.001 mm {:.2} um, clearance {least:.1} mm", off * 1e3, on_increment * 1e3);
        assert_bar_changes(&made);
    }
}

/// Stated sizes move the balls, and a table above the tilting axis is measured on paths that the linear axes follow.
#[test]
fn programs_are_safe_with_stated_sizes() {
    let folder = tempfile::tempdir().unwrap();
    for (code, sizes) in [
        ("[wCAbYXZt]", &["--table-mm=-40", "--gauge-mm", "150"][..]),
        ("[wCBbXYZt]", &["--table-mm=60"]),
        ("[wAXYbZBt]", &["--table-mm=20", "--pivot-mm", "80", "--gauge-mm", "60"]),
        ("[wbXYZCAt]", &["--pivot-mm", "320", "--gauge-mm", "180", "--table-mm=-400"]),
        ("[wXYbZCBt]", &["--pivot-mm", "20", "--gauge-mm", "60"]),
    ] {
        assert_safe(&made(folder.path(), code, sizes), None);
    }
}
