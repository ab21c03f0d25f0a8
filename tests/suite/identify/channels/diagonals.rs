//! Diagonals of ISO 230-6 and the uncertainty of positioning figures: closed forms, the plant, and simulated tests.

use abbe::identify::figure::{Figure, find};
use abbe::identify::positioning::diagonal::{self, DiagonalKind, DiagonalTest};
use abbe::identify::positioning::{self, Contributions, PositioningTest};

use super::*;

/// Box whose diagonal is 700 mm long.
pub(super) const LOW: [f64; 3] = [-300.0, -100.0, 0.0];
pub(super) const HIGH: [f64; 3] = [300.0, 100.0, 300.0];
const SIDES: [f64; 3] = [600.0, 200.0, 300.0];
const LENGTH: f64 = 700.0;
/// Positions on a diagonal, from its start.
const STEPS: i32 = 10;

/// Errors of the axes of a mill in these tests, mm/mm, rad and mm.
#[derive(Default)]
pub(super) struct Box3 {
    /// Scale of X, Y, Z.
    pub scale: [f64; 3],
    /// EC0Y, EB0Z, EA0Z.
    pub squareness: [f64; 3],
    /// What X lacks in negative direction.
    pub backlash: f64,
}

impl Box3 {
    /// The point of the tool at commanded positions, by the plant.
    fn tool(&self, at: [f64; 3], x_falls: bool) -> Vector3<f64> {
        let chain = Chain::from_code("wbXYZt");
        let place = |letter| ['X', 'Y', 'Z'].iter().position(|other| *other == letter).unwrap();
        let errors = |letter: char| {
            let (mut location, mut motion, axis) = ([0.0; 6], [0.0; 6], place(letter));
            motion[axis] = self.scale[axis] * at[axis];
            match letter {
                'X' => motion[0] -= if x_falls { self.backlash } else { 0.0 },
                'Y' => location[5] = self.squareness[0],
                _ => (location[4], location[3]) = (self.squareness[1], self.squareness[2]),
            }
            [location, motion]
        };
        State::of(&chain, &|letter| at[place(letter)], &errors).tool[1].apply(Vector3::zeros())
    }

    /// Data of runs along a line, forwards and backwards, from a laser along it that counts from 12.5 mm.
    pub fn data(
        &self,
        [from, to]: [[f64; 3]; 2],
        in_turn: bool,
        runs: i32,
        noise_mm: f64,
        random: &mut Pcg64,
    ) -> String {
        let way: Vector3<f64> = Vector3::from(to) - Vector3::from(from);
        let beam = way.normalize();
        let mut states = vec![from];
        for step in 1..=STEPS {
            let share = f64::from(step) / f64::from(STEPS);
            for axis in 0..3 {
                let mut state = *states.last().unwrap();
                state[axis] = from[axis] + share * way[axis];
                if in_turn && way[axis] != 0.0 {
                    states.push(state);
                } else if !in_turn && axis == 2 {
                    states.push(std::array::from_fn(|axis| from[axis] + share * way[axis]));
                }
            }
        }
        let mut text = String::from("run,x_mm,y_mm,z_mm,displacement_mm\n");
        for run in 1..=2 * runs {
            let back = run % 2 == 0;
            for k in 0..states.len() {
                let state @ [x, y, z] = states[if back { states.len() - 1 - k } else { k }];
                let displacement =
                    beam.dot(&self.tool(state, back == (way.x > 0.0))) + 12.5 + noise_mm * normal(random);
                text += &format!("{run},{x},{y},{z},{displacement:.9}\n");
            }
        }
        text
    }
}

/// The ends of the body diagonal whose axes rise as the letters say.
pub(super) fn body(name: &str) -> [[f64; 3]; 2] {
    let end = |of: [[f64; 3]; 2]| {
        std::array::from_fn(|axis| if name.as_bytes()[axis] == b'P' { of[0][axis] } else { of[1][axis] })
    };
    [end([LOW, HIGH]), end([HIGH, LOW])]
}

/// A test of a laser along a line.
pub(super) fn test(name: &str, [from, to]: [[f64; 3]; 2]) -> String {
    let beam: [f64; 3] = (Vector3::from(to) - Vector3::from(from)).normalize().into();
    format!("[[test]]\nname = \"{name}\"\ndata = \"{name}.csv\"\nbeam = {beam:?}\n")
}

/// The diagonals of data.
fn found(tests: &[(&str, [[f64; 3]; 2], String)]) -> Vec<DiagonalTest> {
    let folder = Folder::new();
    let mut text = format!("{MILL}[instrument]\nkind = \"laser\"\nnoise_um = 0.1\n");
    for (name, ends, data) in tests {
        folder.write(&format!("{name}.csv"), data);
        text += &test(name, *ends);
    }
    let session = folder.session(&text);
    let kept: Vec<Vec<bool>> =
        session.tests.iter().map(|test| vec![false; test.readings.as_ref().unwrap().rows()]).collect();
    assert!(positioning::of_session(&session, &kept).is_empty());
    diagonal::of_session(&session, &kept)
}

fn value(figures: &[Figure], id: &str) -> Option<f64> {
    find(figures, id).map(|figure| figure.value)
}

fn close(found: Option<f64>, expected: f64, what: &str) {
    let found = found.unwrap_or_else(|| panic!("no {what}"));
    assert!((found - expected).abs() < 2e-3, "{what}: {found}, not {expected}");
}

/// Squareness, scale and backlash: a point of the diagonal with the sides `a` has the deviation `a · δ / |a|`.
#[test]
fn figures_of_body_diagonals_are_those_of_the_closed_form() {
    let mut random = Pcg64::seed_from_u64(6);
    let [gamma, scale, backlash] = [30e-6, -20e-6, 1.5e-3];
    let machine = Box3 { scale: [scale, 0.0, 0.0], squareness: [gamma, 0.0, 0.0], backlash };
    let names = ["PPP", "NPP", "PNP", "PPN"];
    let tests = names.map(|name| (name, body(name), machine.data(body(name), false, 2, 0.0, &mut random)));
    let found = found(&tests);
    assert_eq!(found.len(), 4);
    for (test, name) in found.iter().zip(names) {
        assert_eq!((test.kind, test.direction.as_str(), test.in_turn), (DiagonalKind::Body, name, false));
        assert_eq!((test.axes.join(""), test.read.positions.len()), ("XYZ".into(), 11));
        assert!((test.length_mm - LENGTH).abs() < 1e-9);
        // Y leans towards −X by the squareness.
        let [x, y] = [0, 1].map(|axis| if name.as_bytes()[axis] == b'P' { SIDES[axis] } else { -SIDES[axis] });
        let slope_um = 1e3 * x * (scale * x - gamma * y) / LENGTH;
        let lost_um = 1e3 * x.abs() * backlash / LENGTH;
        let figures = &test.read.figures;
        close(value(figures, "mean_range"), slope_um.abs(), "M");
        close(value(figures, "systematic_forward"), slope_um.abs(), "E forward");
        close(value(figures, "systematic_backward"), slope_um.abs(), "E backward");
        close(value(figures, "systematic"), slope_um.abs() + lost_um, "E");
        close(value(figures, "reversal"), lost_um, "B");
        close(value(figures, "repeatability"), lost_um, "R");
        let last = test.read.positions.last().unwrap();
        assert!((last.at - LENGTH).abs() < 1e-9);
        // The deviation grows along the diagonal, and both directions are where they belong.
        let first = test.read.positions[0].forward.unwrap().mean;
        close(Some(last.forward.unwrap().mean - first), slope_um, "end less start");
    }
    let largest = diagonal::largest(&found);
    assert_eq!((largest.len(), largest[0].tests.len()), (1, 4));
    let most = found.iter().map(|test| value(&test.read.figures, "systematic").unwrap()).fold(0.0, f64::max);
    assert_eq!(value(&largest[0].figures, "systematic"), Some(most));
    let ids: Vec<&str> = largest[0].figures.iter().map(|figure| figure.definition.id).collect();
    assert_eq!(ids, ["systematic", "repeatability", "reversal", "mean_range"]);
}

/// A face of two axes, and a laser that looks along the diagonal from its other end: the names are those of the diagonal.
#[test]
fn a_face_diagonal_is_named_by_its_axes() {
    let mut random = Pcg64::seed_from_u64(7);
    let machine = Box3 { squareness: [30e-6, 0.0, 0.0], ..Box3::default() };
    let ends = [[300.0, -100.0, 0.0], [-300.0, 100.0, 0.0]];
    let back = [ends[1], ends[0]];
    let tests = [
        ("there", ends, machine.data(ends, false, 1, 0.0, &mut random)),
        ("back", back, machine.data(back, false, 1, 0.0, &mut random)),
    ];
    for test in found(&tests) {
        assert_eq!((test.kind, test.axes.join(""), test.direction.as_str()), (DiagonalKind::Face, "XY".into(), "NP"));
        // −γ y x / √(x² + y²)
        close(value(&test.read.figures, "mean_range"), 30e-3 * 600.0 * 200.0 / 600.0_f64.hypot(200.0), "M");
        let [first, last] = [0, 10].map(|k: usize| test.read.positions[k].forward.unwrap().mean);
        assert!(last > first, "{first} {last}");
    }
}

/// At each step X moves, then Y, then Z: the laser reads the part of each along the diagonal. The deviation of X stays while
/// Y and Z move.
#[test]
fn a_step_diagonal_reads_after_every_move() {
    let mut random = Pcg64::seed_from_u64(8);
    let machine = Box3 { scale: [25e-6, 0.0, 0.0], ..Box3::default() };
    let found = found(&[("S", body("PPP"), machine.data(body("PPP"), true, 2, 0.0, &mut random))]);
    let [test] = &found[..] else { panic!("{found:?}") };
    assert!(test.in_turn && test.direction == "PPP" && test.read.positions.len() == 31);
    let mean = |k: usize| test.read.positions[k].forward.unwrap().mean;
    let of_step_um = 25e-3 * 60.0 * SIDES[0] / LENGTH;
    for step in 0..10 {
        close(Some(mean(3 * step + 1) - mean(3 * step)), of_step_um, "X");
        close(Some(mean(3 * step + 3) - mean(3 * step + 1)), 0.0, "Y and Z");
    }
    close(value(&test.read.figures, "systematic"), 10.0 * of_step_um, "E");
    // X falls back by its share of the diagonal.
    let share = SIDES[0] / LENGTH;
    assert!((test.read.positions[1].at - 60.0 * share).abs() < 1e-6);
}

/// Points all over the box are no diagonal, nor is a diagonal that the beam does not follow.
#[test]
fn other_ways_have_no_figures() {
    let mut random = Pcg64::seed_from_u64(9);
    let machine = Box3::default();
    let data = machine.data(body("PPP"), false, 1, 0.0, &mut random);
    // A beam that leaves the diagonal by more than a degree.
    let [from, to] = body("PPP");
    assert!(found(&[("beside", [from, [to[0], to[1], to[2] + 20.0]], data)]).is_empty());
    let mut scattered = String::from("run,x_mm,y_mm,z_mm,displacement_mm\n");
    for _ in 0..40 {
        let at: [f64; 3] = std::array::from_fn(|_| uniform(&mut random, 90.0));
        let along = Vector3::from(SIDES).normalize().dot(&Vector3::from(at));
        scattered += &format!("1,{},{},{},{along:.9}\n", at[0], at[1], at[2]);
    }
    assert!(found(&[("all over", body("PPP"), scattered)]).is_empty());
}

/// Contributors of a laser in the test of uncertainties.
const CONTRIBUTORS: &str = "contributors = { device_u_um_m = 0.5, misalignment_mm = 2, expansion_um_m_k = 11.5, temperature_u_k = 0.1, \
                            temperature_difference_k = 2, expansion_u_um_m_k = 1, environment_um = 1.2, setup_u_um = 0.3 }\n";

/// Deviations of five runs in each direction over 600 mm, µm: a slope of 40 µm, lost motion, and runs that scatter, most at
/// one position. With errors of every reading, and in proportion to the length, from `extra`.
fn axis_data(extra: &mut dyn FnMut() -> f64, over_length_um: f64) -> String {
    let mut text = String::from("run,x_mm,deviation_um\n");
    for run in 1..=10_i32 {
        let back = run % 2 == 0;
        for step in 0..=10_i32 {
            let step = if back { 10 - step } else { step };
            let x = f64::from(60 * step - 300);
            let scatter = f64::from((run * 7 + step * 3) % 5 - 2) * if step == 4 { 4.0 } else { 1.0 };
            let lost = if back { -3.0 - f64::from(step) } else { 0.0 };
            let deviation = (40.0 + over_length_um) * x / 600.0 + lost + scatter + extra();
            text += &format!("{run},{x},{deviation:.9}\n");
        }
    }
    text
}

fn positioning_of(folder: &Folder, data: &str) -> PositioningTest {
    folder.write("X.csv", data);
    let session = folder.session(&format!(
        "{MILL}[instrument]\nkind = \"laser\"\nnoise_um = 0.1\n[[test]]\nname = \"X\"\ndata = \"X.csv\"\nbeam = [1, 0, 0]\n{CONTRIBUTORS}"
    ));
    positioning::of_session(&session, &[vec![false; 110]]).remove(0)
}

/// By hand: over 0.6 m the device has 0.3 µm, a lateral deviation of 2 mm shortens by 2²/1200 mm = 10/3 µm at most, the
/// temperature has 11.5 · 0.6 · 0.1 = 0.69 µm, the expansion 2 · 0.6 · 1 = 1.2 µm, the set-up 0.3 µm, a reading 1.2/√12 µm.
#[test]
fn expanded_uncertainties_are_those_of_the_closed_form() {
    let test = positioning_of(&Folder::new(), &axis_data(&mut || 0.0, 0.0));
    let Contributions { device, misalignment, temperature, expansion, environment, setup, .. } =
        test.read.uncertainty.unwrap();
    let expanded = |id: &str| 2.0 * find(&test.read.figures, id).unwrap().u.unwrap();
    let root = 12.0_f64.sqrt();
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found}, not {expected}");
    near(device, 0.6);
    near(misalignment, 2.0 * 10.0 / 3.0 / root);
    near(temperature, 1.38);
    near(expansion, 2.4);
    near(environment, 2.4 / root);
    near(setup, 0.6);
    let over_length: f64 = [device, misalignment, temperature, expansion, setup].iter().map(|u| u * u).sum();
    let with = |share: f64| (over_length + share * environment * environment).sqrt();
    // A mean of five has a fifth of the variance of a reading, s a quarter; E↑ compares two means, M two means of ten.
    near(expanded("systematic_forward"), with(0.4));
    near(expanded("mean_range"), with(0.2));
    near(expanded("accuracy_forward"), with(2.0 * (0.2 + 4.0 / 4.0)));
    near(expanded("repeatability_forward"), 2.0 * environment);
    near(expanded("reversal"), 0.4_f64.sqrt() * environment);
    near(expanded("mean_reversal"), (0.4_f64 / 11.0).sqrt() * environment);
}

/// The scatter of the figures of tests that are read with such errors.
#[test]
fn expanded_uncertainties_are_the_scatter_of_simulated_tests() {
    let mut random = Pcg64::seed_from_u64(9);
    let folder = Folder::new();
    let of_axis = positioning_of(&folder, &axis_data(&mut || 0.0, 0.0)).read;
    let stated = of_axis.uncertainty.unwrap();
    let over_length = [stated.device, stated.misalignment, stated.temperature, stated.expansion, stated.setup];
    let of = [
        "accuracy",
        "accuracy_forward",
        "systematic",
        "systematic_backward",
        "mean_range",
        "repeatability",
        "reversal",
        "mean_reversal",
    ];
    const DRAWS: usize = 400;
    let mut drawn = vec![Vec::with_capacity(DRAWS); of.len()];
    for _ in 0..DRAWS {
        let length: f64 = over_length.iter().map(|expanded| 0.5 * expanded * normal(&mut random)).sum();
        let data = axis_data(&mut || 0.5 * stated.environment * normal(&mut random), length);
        let test = positioning_of(&folder, &data);
        of.iter().zip(&mut drawn).for_each(|(id, drawn)| drawn.push(value(&test.read.figures, id).unwrap()));
    }
    for (number, (of, drawn)) in of.iter().zip(&drawn).enumerate() {
        let count = DRAWS as f64;
        let mean = drawn.iter().sum::<f64>() / count;
        let deviation = (drawn.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
        let u = find(&of_axis.figures, of).unwrap().u.unwrap();
        println!("figure {number}: u {u:.4}, scatter {deviation:.4}");
        // Four standard deviations of a standard deviation.
        assert!((deviation / u - 1.0).abs() < 4.0 / (2.0 * count).sqrt(), "{number}: {deviation}, stated {u}");
    }
}

/// Contributors of another unit, and of an instrument without such figures, are refused.
#[test]
fn contributors_that_do_not_belong_to_the_instrument_are_refused() {
    let folder = Folder::new();
    let refused = |text: &str, expected: &str| {
        folder.write("session.toml", &format!("{MILL}{text}"));
        let fault = files::session(&folder.0.path().join("session.toml"), &ReadOptions::default()).unwrap_err();
        let fault = format!("{fault}; {}", fault.help().unwrap_or_default());
        assert!(fault.contains(expected), "{fault}");
    };
    let sweep = "sweep = { axis = \"X\", from_mm = -300, to_mm = 300, step_mm = 30 }\n";
    let laser = format!("[instrument]\nkind = \"laser\"\n[[test]]\nname = \"X\"\nbeam = [1, 0, 0]\n{sweep}");
    refused(&format!("{laser}contributors = {{ device_u_arcsec = 1 }}\n"), "`device_u_arcsec` is of angles");
    refused(&format!("{laser}contributors = {{ device_um = 1 }}\n"), "device_u_um");
    refused(&format!("{laser}contributors = {{ environment_um = -1 }}\n"), "environment_um");
    let tracker = format!("[instrument]\nkind = \"tracker\"\n[[test]]\nname = \"X\"\ntarget_mm = [0, 0, 0]\n{sweep}");
    refused(
        &format!("{tracker}contributors = {{ device_u_um = 1 }}\n"),
        "a laser tracker has no figures of positioning",
    );
    let line = |path: &str| {
        format!(
            "[instrument]\nkind = \"laser\"\n[[test]]\nname = \"D\"\nbeam = [1, 1, 0]\npath = {{ kind = \"line\", {path} }}\n"
        )
    };
    refused(&line("from = { x_mm = 0 }, to = { x_mm = 9 }, step_mm = 1"), "fewer than two axes");
    refused(&line("from = { x_mm = 0, y_mm = 0 }, to = { x_mm = 9 }, step_mm = 1"), "add `y_mm`");
    refused(
        &line("from = { x_mm = 0, y_mm = 0 }, to = { x_mm = 9, y_mm = 9, z_mm = 1 }, step_mm = 1"),
        "`from` does not",
    );
    refused(&line("from = { x_mm = 0, y_mm = 0 }, to = { x_mm = 9, y_mm = 0 }, step_mm = 1"), "at = { y_mm = … }");
    refused(
        &line("from = { x_mm = 0, y_mm = 0, c_deg = 1 }, to = { x_mm = 9, y_mm = 9 }, step_mm = 1"),
        "no position of a linear axis",
    );
    refused(
        &line("from = { x_mm = 0, y_mm = 0 }, to = { x_mm = 9, y_mm = 9 }, step_mm = 99"),
        "larger than the whole motion",
    );
}
