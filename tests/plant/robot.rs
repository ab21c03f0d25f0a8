//! Simulated robots: serial chains by the convention of Denavit and Hartenberg, which share no code with `abbe-model`, and
//! an oracle that knows the form of their errors.
//!
//! ```text
//! T_i = Rz(θ_i + δθ_i) Tz(d_i + δd_i) Tx(a_i + δa_i) Rx(α_i + δα_i) Ry(δβ_i)     δβ between parallel axes (Hayati)
//! θ_i = q_i + Σ A cos(n q_i − φ) + τ_i(q)/k_i                                    τ: moment of the masses and the payload
//! ```

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use nalgebra::{DMatrix, DVector, Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;

/// A robot of a kind: parameters, masses, ranges, orders of its gears.
struct RobotKind {
    a_mm: &'static [f64],
    alpha_deg: &'static [f64],
    d_mm: &'static [f64],
    masses_kg: &'static [f64],
    middle_deg: &'static [f64],
    range_deg: &'static [f64],
    gears: [u32; 3],
}

const KINDS: [RobotKind; 3] = [
    RobotKind {
        a_mm: &[0.0, -425.0, -392.2, 0.0, 0.0, 0.0],
        alpha_deg: &[90.0, 0.0, 0.0, 90.0, -90.0, 0.0],
        d_mm: &[162.5, 0.0, 0.0, 133.3, 99.7, 99.6],
        masses_kg: &[3.7, 8.4, 2.3, 1.2, 1.2, 0.25],
        middle_deg: &[0.0, -60.0, 60.0, 0.0, 0.0, 0.0],
        range_deg: &[170.0, 120.0, 140.0, 170.0, 170.0, 170.0],
        gears: [17, 101, 2],
    },
    RobotKind {
        a_mm: &[0.0; 7],
        alpha_deg: &[-90.0, 90.0, 90.0, -90.0, -90.0, 90.0, 0.0],
        d_mm: &[360.0, 0.0, 420.0, 0.0, 400.0, 0.0, 126.0],
        masses_kg: &[4.0, 4.0, 3.0, 2.7, 1.7, 1.8, 0.3],
        middle_deg: &[0.0; 7],
        range_deg: &[160.0, 110.0, 160.0, 110.0, 160.0, 110.0, 170.0],
        gears: [16, 2, 160],
    },
    RobotKind {
        a_mm: &[0.0, 270.0, 70.0, 0.0, 0.0, 0.0],
        alpha_deg: &[-90.0, 0.0, -90.0, 90.0, -90.0, 0.0],
        d_mm: &[290.0, 0.0, 0.0, 302.0, 0.0, 72.0],
        masses_kg: &[6.0, 5.0, 4.0, 2.0, 1.0, 0.2],
        middle_deg: &[0.0, -20.0, 10.0, 0.0, 0.0, 0.0],
        range_deg: &[160.0, 100.0, 90.0, 150.0, 110.0, 170.0],
        gears: [25, 3, 2],
    },
];

/// The target in the frame of the flange, mm.
const TARGET_MM: [f64; 3] = [40.0, 0.0, 60.0];
/// Standard deviation of an error of a length, mm.
const LENGTH_MM: f64 = 0.2;
/// Standard deviation of an error of an angle, rad.
const ANGLE: f64 = 3e-4;

/// An angular error of a joint over its own angle.
#[derive(Clone, Copy, Debug)]
pub struct Wave {
    pub joint: usize,
    pub order: u32,
    pub amplitude: f64,
    pub phase: f64,
}

/// What a simulated robot has beside geometric errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effects {
    /// Nothing.
    None,
    /// Eccentricities, orders of gears and compliance, each with some probability.
    Drawn,
    /// One eccentricity that moves the target by this many standard deviations of the noise.
    Eccentricity(u32),
}

/// A simulated robot and the poses at which it is measured.
pub struct Robot {
    kind: &'static RobotKind,
    /// Errors δθ, δd, δa, δα, δβ of each joint, rad and mm.
    errors: Vec<[f64; 5]>,
    pub waves: Vec<Wave>,
    /// Compliance of each joint, rad/(N·m), and payload, kg.
    compliance: Option<(Vec<f64>, f64)>,
    /// The tracker's frame.
    frame: Isometry3<f64>,
    /// Standard deviation of a coordinate, mm.
    pub noise_mm: f64,
    pub poses: usize,
    random: Pcg64Mcg,
}

/// Joint angles and measured points.
pub struct Measured {
    pub angles: Vec<Vec<f64>>,
    pub points_mm: Vec<Vector3<f64>>,
}

impl Robot {
    /// The robot of a number.
    pub fn new(number: u64, effects: Effects) -> Robot {
        let mut random = Pcg64Mcg::seed_from_u64(7_000_003 + number);
        let kind = &KINDS[number as usize % KINDS.len()];
        let joints = kind.a_mm.len();
        let mut normal = |deviation: f64| Normal::new(0.0, deviation).unwrap().sample(&mut random);
        let errors = (0..joints)
            .map(|i| {
                let between_parallel = if kind.alpha_deg[i] == 0.0 { ANGLE } else { 0.0 };
                [normal(ANGLE), normal(LENGTH_MM), normal(LENGTH_MM), normal(ANGLE), normal(between_parallel)]
            })
            .collect();
        let turn = Vector3::new(normal(0.01), normal(0.01), normal(0.01));
        let shift = Translation3::new(1500.0 + normal(1.0), normal(1.0), normal(1.0));
        let poses = [100, 150, 200, 300, 500][random.random_range(0..5)];
        let noise_mm = random.random_range(0.015..0.05);
        let mut robot = Robot {
            kind,
            errors,
            waves: Vec::new(),
            compliance: None,
            frame: Isometry3::from_parts(shift, UnitQuaternion::from_scaled_axis(turn)),
            noise_mm,
            poses,
            random,
        };
        match effects {
            Effects::None => {}
            Effects::Drawn => robot.draw_effects(),
            Effects::Eccentricity(multiple) => {
                let joint = robot.random.random_range(0..3);
                // The target is about half a metre from the axis.
                let amplitude = f64::from(multiple) * robot.noise_mm / 500.0;
                let phase = robot.random.random_range(0.0..TAU);
                robot.waves.push(Wave { joint, order: 1, amplitude, phase });
            }
        }
        robot
    }

    fn draw_effects(&mut self) {
        let random = &mut self.random;
        let joints = self.errors.len();
        let mut order: Vec<usize> = (0..joints - 1).collect();
        for (most, orders, amplitudes) in [(4, vec![1], 1e-4..5e-4), (3, self.kind.gears.to_vec(), 3e-5..1.5e-4)] {
            order.shuffle(random);
            for &joint in &order[..random.random_range(0..most)] {
                let order = orders[random.random_range(0..orders.len())];
                let amplitude = random.random_range(amplitudes.clone());
                self.waves.push(Wave { joint, order, amplitude, phase: random.random_range(0.0..TAU) });
            }
        }
        if random.random_bool(0.8) {
            let spread = Normal::new(0.0, 0.5).unwrap();
            let of_joint = |i: usize| {
                let factor: f64 = spread.sample(random);
                (i + 1) as f64 / (2.5e5 * factor.exp())
            };
            let compliance = (0..joints).map(of_joint).collect();
            self.compliance = Some((compliance, random.random_range(0.0..3.0)));
        }
    }

    /// Whether its joints give under weights.
    pub fn is_compliant(&self) -> bool {
        self.compliance.is_some()
    }

    /// The frames of the chain with given errors: base first.
    fn frames(&self, angles: &[f64], errors: &[[f64; 5]]) -> Vec<Isometry3<f64>> {
        let mut frames = vec![Isometry3::identity()];
        for (i, angle) in angles.iter().enumerate() {
            let [theta, d, a, alpha, beta] = errors[i];
            let about = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
            let turn = Isometry3::from_parts(
                Translation3::new(0.0, 0.0, self.kind.d_mm[i] + d),
                about(Vector3::z(), angle + theta),
            );
            let twist = about(Vector3::x(), self.kind.alpha_deg[i].to_radians() + alpha) * about(Vector3::y(), beta);
            let along = Isometry3::from_parts(Translation3::new(self.kind.a_mm[i] + a, 0.0, 0.0), twist);
            frames.push(frames[i] * turn * along);
        }
        frames
    }

    /// The moments about the joints by gravity, N·m, at nominal geometry.
    fn moments(&self, angles: &[f64], payload_kg: f64) -> Vec<f64> {
        let frames = self.frames(angles, &vec![[0.0; 5]; angles.len()]);
        let last = angles.len();
        let middle = |i: usize| 0.5 * (frames[i].translation.vector + frames[i + 1].translation.vector);
        let mut loads: Vec<_> = (0..last).map(|i| (middle(i), self.kind.masses_kg[i], i)).collect();
        loads.push((frames[last].transform_point(&TARGET_MM.into()).coords, payload_kg, last - 1));
        (0..last)
            .map(|joint| {
                let (axis, at) = (frames[joint].rotation * Vector3::z(), frames[joint].translation.vector);
                let of = |(place, mass, link): &(Vector3<f64>, f64, usize)| {
                    let weight = Vector3::new(0.0, 0.0, -9.81 * mass);
                    if *link >= joint { axis.dot(&((place - at) / 1e3).cross(&weight)) } else { 0.0 }
                };
                loads.iter().map(of).sum()
            })
            .collect()
    }

    /// The target in the tracker's frame at commanded angles.
    fn point(&self, angles: &[f64], unknowns: &Unknowns) -> Vector3<f64> {
        let mut actual = angles.to_vec();
        for (wave, [cos, sin]) in self.waves.iter().zip(&unknowns.waves) {
            let turned = f64::from(wave.order) * angles[wave.joint];
            actual[wave.joint] += cos * turned.cos() + sin * turned.sin();
        }
        if let Some((_, payload)) = &self.compliance {
            let moments = self.moments(angles, *payload);
            actual.iter_mut().zip(moments).zip(&unknowns.compliance).for_each(|((q, moment), c)| *q += moment * c);
        }
        let target = Vector3::from(TARGET_MM) + unknowns.target;
        let flange = self.frames(&actual, &unknowns.errors)[angles.len()];
        (unknowns.frame * flange.transform_point(&target.into())).coords
    }

    fn truth(&self) -> Unknowns {
        let parts = |wave: &Wave| [wave.amplitude * wave.phase.cos(), wave.amplitude * wave.phase.sin()];
        Unknowns {
            errors: self.errors.clone(),
            waves: self.waves.iter().map(parts).collect(),
            compliance: self.compliance.as_ref().map_or_else(Vec::new, |(compliance, _)| compliance.clone()),
            frame: self.frame,
            target: Vector3::zeros(),
        }
    }

    /// Measures random poses.
    pub fn measure(&mut self, poses: usize) -> Measured {
        let truth = self.truth();
        let noise = Normal::new(0.0, self.noise_mm).unwrap();
        let mut measured = Measured { angles: Vec::new(), points_mm: Vec::new() };
        for _ in 0..poses {
            let angle = |i: usize| {
                let deg = self.kind.middle_deg[i] + self.random.random_range(-1.0..1.0) * self.kind.range_deg[i];
                (deg * 1e6).round() * 1e-6
            };
            let angles: Vec<f64> = (0..self.errors.len()).map(angle).map(f64::to_radians).collect();
            let scatter = Vector3::from_fn(|_, _| noise.sample(&mut self.random));
            measured.points_mm.push(self.point(&angles, &truth) + scatter);
            measured.angles.push(angles);
        }
        measured
    }

    /// Writes a session with the readings; states the noise if `stated`.
    pub fn write(&self, folder: &Path, name: &str, measured: &Measured, stated: bool) -> std::io::Result<()> {
        let joints = self.errors.len();
        let names: Vec<String> = (1..=joints).map(|i| format!("J{i}")).collect();
        let zero = self.frames(&vec![0.0; joints], &vec![[0.0; 5]; joints]);
        let mut machine = format!("name = \"robot\"\nchain = \"w b {} t\"\n", names.join(" "));
        for (name, frame) in names.iter().zip(&zero) {
            let (direction, origin) = (frame.rotation * Vector3::z(), frame.translation.vector);
            let list = |v: Vector3<f64>| format!("[{:.9}, {:.9}, {:.9}]", v.x, v.y, v.z);
            let (direction, origin) = (list(direction), list(origin));
            let _ =
                write!(machine, "\n[axis.{name}]\nkind = \"rotary\"\ndirection = {direction}\norigin_mm = {origin}\n");
        }
        std::fs::write(folder.join("machine.toml"), machine)?;
        let columns = names.iter().map(|name| format!("{}_deg", name.to_lowercase())).collect::<Vec<_>>().join(",");
        let mut csv = format!("{columns},px_mm,py_mm,pz_mm\n");
        for (angles, point) in measured.angles.iter().zip(&measured.points_mm) {
            let angles: String = angles.iter().map(|angle| format!("{:.9},", angle.to_degrees())).collect();
            let _ = writeln!(csv, "{angles}{:.6},{:.6},{:.6}", point.x, point.y, point.z);
        }
        std::fs::write(folder.join(format!("{name}.csv")), csv)?;
        let target = zero[joints].transform_point(&TARGET_MM.into());
        let noise = if stated { format!("noise_um = {:.6}\n", self.noise_mm * 1e3) } else { String::new() };
        let session = format!(
            "[machine]\nfile = \"machine.toml\"\n\n[instrument]\nkind = \"tracker\"\n{noise}\n[unknowns]\nerrors = [\"E?0J*\"]\n\n\
             [[test]]\nname = \"A\"\ndata = \"{name}.csv\"\npath = {{ kind = \"list\" }}\ntarget_mm = [{:.9}, {:.9}, {:.9}]\n\
             target_u_um = inf\n",
            target.x, target.y, target.z
        );
        std::fs::write(folder.join(format!("{name}.toml")), session)
    }
}

/// Everything that the oracle estimates.
#[derive(Clone)]
struct Unknowns {
    errors: Vec<[f64; 5]>,
    waves: Vec<[f64; 2]>,
    compliance: Vec<f64>,
    frame: Isometry3<f64>,
    target: Vector3<f64>,
}

impl Unknowns {
    fn count(&self) -> usize {
        5 * self.errors.len() + 2 * self.waves.len() + self.compliance.len() + 9
    }

    /// Adds a step in units of the sizes: 1 mm, 1 mrad, 10⁻⁵ rad/(N·m).
    fn moved(&self, step: &DVector<f64>) -> Unknowns {
        let mut next = self.clone();
        let mut values = step.iter().copied();
        let mut take = |size: f64| values.next().unwrap_or(0.0) * size;
        for [theta, d, a, alpha, beta] in &mut next.errors {
            *theta += take(1e-3);
            *d += take(1.0);
            *a += take(1.0);
            *alpha += take(1e-3);
            *beta += take(1e-3);
        }
        next.waves.iter_mut().flatten().for_each(|value| *value += take(1e-3));
        next.compliance.iter_mut().for_each(|value| *value += take(1e-5));
        let turn = Vector3::from_fn(|_, _| take(1e-3));
        let shift = Vector3::from_fn(|_, _| take(1.0));
        next.frame = Isometry3::from_parts(
            Translation3::from(next.frame.translation.vector + shift),
            UnitQuaternion::from_scaled_axis(turn) * next.frame.rotation,
        );
        next.target += Vector3::from_fn(|_, _| take(1.0));
        next
    }
}

/// A fit that knows which effects the robot has: its figures are the bounds of what any search reaches.
pub struct RobotOracle<'r> {
    robot: &'r Robot,
    unknowns: Unknowns,
}

impl<'r> RobotOracle<'r> {
    /// Fits the readings.
    pub fn new(robot: &'r Robot, measured: &Measured) -> RobotOracle<'r> {
        let nominal = Unknowns {
            errors: vec![[0.0; 5]; robot.errors.len()],
            waves: vec![[0.0; 2]; robot.waves.len()],
            compliance: vec![0.0; robot.compliance.as_ref().map_or(0, |(compliance, _)| compliance.len())],
            frame: Isometry3::translation(1500.0, 0.0, 0.0),
            target: Vector3::zeros(),
        };
        let mut oracle = RobotOracle { robot, unknowns: nominal };
        for _ in 0..4 {
            let step = least_squares(&oracle.jacobian(measured), &oracle.residual(measured));
            oracle.unknowns = oracle.unknowns.moved(&step);
        }
        oracle
    }

    fn residual(&self, measured: &Measured) -> DVector<f64> {
        let poses = measured.angles.iter().zip(&measured.points_mm);
        let all = poses.flat_map(|(angles, point)| {
            let residual = point - self.robot.point(angles, &self.unknowns);
            [residual.x, residual.y, residual.z]
        });
        DVector::from_iterator(3 * measured.angles.len(), all)
    }

    fn jacobian(&self, measured: &Measured) -> DMatrix<f64> {
        const STEP: f64 = 1e-3;
        let count = self.unknowns.count();
        let mut jacobian = DMatrix::zeros(3 * measured.angles.len(), count);
        for j in 0..count {
            let unit = |sign: f64| DVector::from_fn(count, |k, _| if k == j { sign * STEP } else { 0.0 });
            let [up, down] = [1.0, -1.0].map(|sign| self.unknowns.moved(&unit(sign)));
            for (pose, angles) in measured.angles.iter().enumerate() {
                let change = self.robot.point(angles, &up) - self.robot.point(angles, &down);
                (0..3).for_each(|c| jacobian[(3 * pose + c, j)] = change[c] / (2.0 * STEP));
            }
        }
        jacobian
    }

    /// Rms of a coordinate, µm, over blocks of poses that the fit of the others predicts. The blocks are those of the nearest
    /// of ten poses in the space of cosines and sines.
    pub fn heldout_um(&self, measured: &Measured) -> f64 {
        let point = |angles: &Vec<f64>| angles.iter().flat_map(|q| [q.cos(), q.sin()]).collect::<Vec<f64>>();
        let points: Vec<Vec<f64>> = measured.angles.iter().map(point).collect();
        let mut centres: Vec<Vec<f64>> = points.iter().step_by(points.len() / 10).take(10).cloned().collect();
        let mut block_of = vec![0; points.len()];
        for _ in 0..50 {
            let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            for (block, point) in block_of.iter_mut().zip(&points) {
                let nearest =
                    (0..10).min_by(|a, b| distance(&centres[*a], point).total_cmp(&distance(&centres[*b], point)));
                *block = nearest.unwrap();
            }
            for (number, centre) in centres.iter_mut().enumerate() {
                let own: Vec<&Vec<f64>> = points
                    .iter()
                    .zip(&block_of)
                    .filter(|(_, block)| **block == number)
                    .map(|(point, _)| point)
                    .collect();
                if !own.is_empty() {
                    *centre =
                        (0..centre.len()).map(|k| own.iter().map(|p| p[k]).sum::<f64>() / own.len() as f64).collect();
                }
            }
        }
        let (jacobian, residual) = (self.jacobian(measured), self.residual(measured));
        let mut sum = 0.0;
        for block in 0..10 {
            let rows = |inside: bool| -> Vec<usize> {
                (0..residual.len()).filter(|row| (block_of[row / 3] == block) == inside).collect()
            };
            let (own, others) = (rows(true), rows(false));
            let step = least_squares(&jacobian.select_rows(&others), &residual.select_rows(&others));
            sum += (residual.select_rows(&own) - jacobian.select_rows(&own) * step).norm_squared();
        }
        (sum / residual.len() as f64).sqrt() * 1e3
    }

    /// Rms of a coordinate, µm, of poses that the fit has not seen, with the frame and the target estimated anew.
    pub fn predicted_um(&self, measured: &Measured) -> f64 {
        let residual = self.residual(measured);
        let count = self.unknowns.count();
        let of_setup = self.jacobian(measured).columns(count - 9, 9).into_owned();
        let remaining = &residual - &of_setup * least_squares(&of_setup, &residual);
        (remaining.norm_squared() / residual.len() as f64).sqrt() * 1e3
    }
}

/// The least-squares solution of minimum norm.
fn least_squares(jacobian: &DMatrix<f64>, residual: &DVector<f64>) -> DVector<f64> {
    let svd = jacobian.clone().svd(true, true);
    let least = 1e-9 * svd.singular_values.max();
    svd.solve(residual, least).unwrap()
}
