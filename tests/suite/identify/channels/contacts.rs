//! Composed measurements against the plant: a stylus that touches a sphere on a tilting rotary table, and the centres that a
//! probing cycle returns.

use abbe::model::document::composed::{Channel, Target as Stated};
use abbe::model::document::session::Parts;
use abbe::model::document::value::{Direction, Length, Three, Uncertainty};
use abbe::model::instrument::composed;

use super::scatter::assert_standard;
use super::*;

/// A table that tilts about A and turns about C, under three linear axes.
const TILTING: &str = r#"
[machine]
name = "Tilting"
chain = "w C A b Y X Z t"
axis.C.direction = [0, 0, 1]
axis.A.direction = [1, 0, 0]
axis.X.direction = [1, 0, 0]
axis.Y.direction = [0, 1, 0]
axis.Z.direction = [0, 0, 1]
"#;

/// The location errors of A and C in these tests, in µm and arcsec.
const ERRORS: [&str; 8] = ["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"];

/// Centre of the sphere as stated, in the table frame, and the radius at which the stylus touches, mm.
const SPHERE: [f64; 3] = [80.0, 10.0, 40.0];
const RADIUS: f64 = 15.5;

/// A machine with errors, a sphere that is up to 0.3 mm from where it is stated, and a stylus that was set to 5 µm.
struct Shop {
    chain: Chain,
    truth: Vec<f64>,
    sphere: Vector3<f64>,
    stylus: Vector3<f64>,
    radius: f64,
}

impl Shop {
    fn drawn(random: &mut Pcg64) -> Shop {
        Shop {
            chain: Chain::from_code("wCAbYXZt"),
            truth: ERRORS.iter().map(|_| uniform(random, 30.0)).collect(),
            sphere: Vector3::from(SPHERE) + Vector3::from_fn(|_, _| uniform(random, 0.3)),
            stylus: Vector3::from_fn(|_, _| 5e-3 * normal(random)),
            radius: RADIUS + 1e-3 * normal(random),
        }
    }

    /// The sphere less the stylus in R, mm, with the axes at these positions, mm and rad.
    fn apart(&self, xyz: Vector3<f64>, [a, c]: [f64; 2]) -> Vector3<f64> {
        let position = |letter| match letter {
            'X' => xyz.x,
            'Y' => xyz.y,
            'Z' => xyz.z,
            'A' => a,
            _ => c,
        };
        let errors = |letter: char| {
            let mut location = [0.0; 6];
            for (name, value) in ERRORS.iter().zip(&self.truth) {
                if name.ends_with(letter) {
                    let freedom = "XYZABC".find(&name[1..2]).unwrap();
                    location[freedom] = value * if freedom < 3 { 1e-3 } else { ARCSECOND };
                }
            }
            [location, [0.0; 6]]
        };
        let state = State::of(&self.chain, &position, &errors);
        state.table[1].apply(self.sphere) - state.tool[1].apply(self.stylus)
    }

    /// Where the linear axes bring the stylus to the centre: they have no errors.
    fn centre(&self, rotary: [f64; 2]) -> Vector3<f64> {
        self.apart(Vector3::zeros(), rotary)
    }

    /// Where a stylus triggers that comes along a direction towards the nominal centre.
    fn contact(&self, rotary: [f64; 2], towards: Vector3<f64>) -> Vector3<f64> {
        let stated = Shop {
            truth: vec![0.0; ERRORS.len()],
            sphere: SPHERE.into(),
            stylus: Vector3::zeros(),
            chain: self.chain.clone(),
            ..*self
        };
        let aim = stated.centre(rotary);
        let gap = |along: f64| self.apart(aim + towards * along, rotary).norm() - self.radius;
        // From outside to the centre.
        let (mut outside, mut inside) = (-2.0 * RADIUS, 0.0);
        for _ in 0..80 {
            let middle = 0.5 * (outside + inside);
            if gap(middle) > 0.0 { outside = middle } else { inside = middle }
        }
        aim + towards * outside
    }
}

/// The positions of A and C, rad.
fn rotary() -> impl Iterator<Item = [f64; 2]> {
    [-60.0_f64, -25.0, 0.0, 35.0, 70.0]
        .into_iter()
        .flat_map(|a| [0.0_f64, 90.0, 180.0, 270.0].map(|c| [a.to_radians(), c.to_radians()]))
}

/// A line of a data file.
fn line(xyz: Vector3<f64>, [a, c]: [f64; 2]) -> String {
    format!("{:.7},{:.7},{:.7},{:.9},{:.9}\n", xyz.x, xyz.y, xyz.z, a.to_degrees(), c.to_degrees())
}

const COLUMNS: &str = "x_mm,y_mm,z_mm,a_deg,c_deg\n";

fn composed_session(channels: &str) -> String {
    format!(
        "{TILTING}[instrument]\nkind = \"composed\"\nnoise_um = 1\n[unknowns]\nerrors = {ERRORS:?}\n\
         [[target]]\nname = \"stylus\"\nframe = \"tool\"\npoint_mm = [0, 0, 0]\npoint_u_um = [5, 5, 5]\n\
         [[target]]\nname = \"sphere\"\nframe = \"table\"\npoint_mm = {SPHERE:?}\npoint_u_um = inf\n{channels}\
         [[test]]\nname = \"S\"\ndata = \"S.csv\"\n"
    )
}

/// Five contacts at each of 20 positions of the table: over simulated sessions the errors, the radius and the place of the
/// sphere scatter about the truth as their uncertainties state.
#[test]
fn contacts_with_a_sphere_scatter_as_they_state() {
    let mut random = Pcg64::seed_from_u64(451);
    let folder = Folder::new();
    let text = composed_session(&format!(
        "[[target]]\nname = \"R\"\nlength_mm = {RADIUS}\nlength_u_um = 1\n\
         [[channel]]\nname = \"contact\"\ndistance = [\"stylus\", \"sphere\"]\nless = [\"R\"]\nreading = 0\n"
    ));
    let mut of_parameters = vec![Vec::new(); ERRORS.len() + 2];
    for _ in 0..sessions() {
        let shop = Shop::drawn(&mut random);
        let mut data = COLUMNS.to_string();
        for rotary in rotary() {
            for towards in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]] {
                let towards = Vector3::from(towards);
                let xyz = shop.contact(rotary, towards) + towards * 1e-3 * normal(&mut random);
                data += &line(xyz, rotary);
            }
        }
        folder.write("S.csv", &data);
        let mut truth: Vec<(&'static str, f64)> = ERRORS.iter().copied().zip(shop.truth.iter().copied()).collect();
        truth.push(("R.length", 1e3 * (shop.radius - RADIUS)));
        truth.push(("sphere.z[S]", 1e3 * (shop.sphere.z - SPHERE[2])));
        of_parameters.iter_mut().zip(pulls(&folder.session(&text), &truth)).for_each(|(all, pull)| all.push(pull));
    }
    for (pulls, id) in of_parameters.iter().zip(ERRORS.into_iter().chain(["R.length", "sphere.z[S]"])) {
        assert_standard(id, pulls);
    }
}

/// Centres as a probing cycle returns them are an R-test that reads nothing in any direction: the same estimates with the
/// same uncertainties.
#[test]
fn centres_of_a_sphere_are_an_r_test_that_reads_zero() {
    let mut random = Pcg64::seed_from_u64(996);
    let folder = Folder::new();
    let shop = Shop::drawn(&mut random);
    let (mut centres, mut zeros) = (COLUMNS.to_string(), COLUMNS.replace('\n', ",dx_um,dy_um,dz_um\n"));
    for rotary in rotary() {
        let xyz = shop.centre(rotary) + Vector3::from_fn(|_, _| 1e-3 * normal(&mut random));
        centres += &line(xyz, rotary);
        zeros += &line(xyz, rotary).replace('\n', ",0,0,0\n");
    }
    let channels = [("x", [1, 0, 0]), ("y", [0, 1, 0]), ("z", [0, 0, 1])].map(|(name, direction)| {
        format!(
            "[[target]]\nname = \"along_{name}\"\nframe = \"table\"\ndirection = {direction:?}\n\
             [[channel]]\nname = \"{name}\"\nalong = [\"stylus\", \"sphere\", \"along_{name}\"]\nreading = 0\n"
        )
    });
    folder.write("S.csv", &centres);
    let composed = folder.session(&composed_session(&channels.concat()));
    folder.write("S.csv", &zeros);
    let r_test = folder.session(&format!(
        "{TILTING}[instrument]\nkind = \"r-test\"\nnoise_um = 1\n[unknowns]\nerrors = {ERRORS:?}\n\
         [[test]]\nname = \"S\"\ndata = \"S.csv\"\nsetting = \"E\"\nworkpiece_ball_mm = {SPHERE:?}\n\
         workpiece_ball_u_um = inf\nspindle_ball_mm = [0, 0, 0]\nspindle_ball_u_um = [5, 5, 5]\n"
    ));
    let [composed, r_test] = [composed, r_test].map(|session| {
        let (problem, found) = prepare(&session, 1).unwrap();
        let all = fit::parameters(&problem, &found);
        ERRORS.map(|id| {
            let found = all.iter().find(|parameter| parameter.id == id).unwrap();
            (found.value, found.u)
        })
    });
    for ((id, (value, u)), (other, other_u)) in ERRORS.iter().zip(composed).zip(r_test) {
        assert!(
            (value - other).abs() < 1e-5 * other_u && (u - other_u).abs() < 1e-6 * other_u,
            "{id}: {value} {u} {other} {other_u}"
        );
    }
}

/// Errors of a millimetre and a milliradian on every axis: distance, projection and rotation between any bodies.
#[test]
fn composed_readings_at_large_errors_are_those_of_the_plant() {
    let mut random = Pcg64::seed_from_u64(46);
    let texts = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
    for code in ["wCAbYXZt", "wXbYZBCt", "wbXYZt", "wYXAbZBt"] {
        let (machine, chain) = (Machine::from_code(code).unwrap(), Chain::from_code(code));
        for _ in 0..50 {
            let large = Large::drawn(&machine, &chain, &mut random);
            let mut any = || large.frames[random.random_range(0..large.frames.len())];
            let [(of_p, p), (of_q, q), (of_d, d)] = [any(), any(), any()];
            let [p_mm, q_mm] = [(); 2].map(|()| -> [f64; 3] { std::array::from_fn(|_| uniform(&mut random, 200.0)) });
            let point = |name: &str, frame: Frame, mm: [f64; 3]| Stated {
                name: name.into(),
                frame: Some(frame.word(&machine)),
                point_mm: Some(Three(mm.map(Length::Number))),
                ..Stated::default()
            };
            let channel = |name: &str| Channel { name: name.into(), ..Channel::default() };
            let bodies = [of_p, of_q].map(|frame| frame.word(&machine));
            let parts = Parts {
                target: vec![
                    point("p", of_p, p_mm),
                    point("q", of_q, q_mm),
                    Stated { direction: Some(Direction([0.6, 0.0, 0.8])), point_mm: None, ..point("d", of_d, p_mm) },
                    Stated { name: "R".into(), length_mm: Some(Length::Number(15.5)), ..Stated::default() },
                ],
                channel: vec![
                    Channel {
                        distance: Some(texts(&["p", "q"])),
                        less: texts(&["R"]),
                        reading: Some(0.0),
                        ..channel("touch")
                    },
                    Channel {
                        along: Some(texts(&["p", "q", "d"])),
                        column: Some("height_um".into()),
                        ..channel("height")
                    },
                    Channel {
                        rotation: Some(texts(&[&bodies[0], &bodies[1], "d"])),
                        column: Some("turn_arcsec".into()),
                        zero_u_arcsec: Some(Uncertainty(1.0)),
                        ..channel("turn")
                    },
                ],
                ..Parts::default()
            };
            let (kind, keys) = composed::composed("composed".parse().unwrap(), &parts, &machine).unwrap();
            let station = kind.set_up(&keys, &[], &machine).unwrap().station.map(|length| length.mm);
            let apart = p[1].apply(large.moved(p_mm, 0)) - q[1].apply(large.moved(q_mm, 3));
            let [nominal, across, up] = [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.8, 0.0, 0.6]].map(Vector3::from);
            let turned = (nominal + across * large.unknowns[6] + up * large.unknowns[7]).normalize();
            let along = d[1].turn * turned;
            let expected = [
                apart.norm() - 15.5 - large.unknowns[8],
                along.dot(&apart),
                along.dot(&rotation(p, q)) + large.unknowns[9],
            ];
            near(&large.read(&station), &expected, "composed");
        }
    }
}
