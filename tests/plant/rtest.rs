//! The R-test of the plant: three sensors about a master ball, each of which reads the displacement of the ball along
//! its direction.
//!
//! Nest and ball are separate bodies. The nest moves with the table or the spindle and is displaced and rotated with
//! it. A sensor reads along its present direction in R. No reading is transformed by angles.

use super::component::{AxisName, Component, unit_size};
use super::effect::Injected;
use super::machine::{Commanded, Displacement, Machine, Stated};
use super::noise::normal;
use super::pose::{Pose, turn_about};
use super::schedule::{Instant, Test, instants};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::fmt::Write;
use std::path::Path;

/// The body that carries the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NestOn {
    /// E-setting: the ball is in the spindle.
    Table,
    /// Es-setting: the ball is on the table.
    Spindle,
}

/// The sensors of one mount.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nest {
    /// The body that carries them.
    pub on: NestOn,
    /// The direction of each sensor, in the frame of its body.
    pub directions: [Vector3<f64>; 3],
    /// Rotation of the nest on its body: about X by −ω, then Z by −θ, then Y by −φ; rad.
    pub misaligned: [f64; 3],
}

impl Nest {
    /// Sensors along X, Y and Z.
    pub fn along_the_axes(on: NestOn) -> Nest {
        Nest { on, directions: [Vector3::x(), Vector3::y(), Vector3::z()], misaligned: [0.0; 3] }
    }
}

/// The readings of the three sensors, mm: the displacement of the point in the spindle from the point on the table
/// along each.
pub fn reading_mm(
    machine: &Machine,
    nest: &Nest,
    commanded: &Commanded,
    stated: &Stated,
    displacement: &Displacement,
) -> [f64; 3] {
    let position: [f64; 5] = std::array::from_fn(|i| {
        commanded.position[i] + displacement.position[i] - commanded.velocity[i] * displacement.delay
    });
    let table = machine.workpiece_point(&position, displacement, stated.workpiece_ball_mm);
    let spindle = machine.tool_point(&position, displacement, stated.spindle_ball_mm);
    let chain = match nest.on {
        NestOn::Table => &[AxisName::A, AxisName::C][..],
        NestOn::Spindle => &[AxisName::Y, AxisName::X, AxisName::Z][..],
    };
    let body = chain.iter().fold(Pose::identity(), |body, axis| {
        let i = axis.index();
        let motion = machine.axes[i].motion(position[i], &displacement.location[i], &displacement.motion[i]);
        body.then_inner(motion)
    });
    let [omega, phi, theta] = nest.misaligned;
    let mounted = turn_about(Vector3::y(), -phi) * turn_about(Vector3::z(), -theta) * turn_about(Vector3::x(), -omega);
    nest.directions.map(|direction| (body.turn * (mounted * direction)).dot(&(spindle - table)))
}

/// A session of R-tests on the plant.
#[derive(Clone, Debug)]
pub struct Session {
    /// The tests; `stated.bar_mm` is not used.
    pub tests: Vec<Test>,
    /// The sensors, the same in every test.
    pub nest: Nest,
    /// Constant errors in all tests, which the session may declare: µm and arcsec.
    pub errors: Vec<(Component, f64)>,
    /// Undeclared effects.
    pub effects: Vec<Injected>,
    /// The errors that the session file lists under `[unknowns]`.
    pub declared: Vec<Component>,
    /// Standard deviation of a reading, µm.
    pub noise_um: f64,
    /// Seed of the noise and of the mount errors.
    pub seed: u64,
}

/// Standard uncertainty of the mounts of ball and nest, µm.
const MOUNT_U_UM: f64 = 10.0;

impl Session {
    /// Draws mounts and noise, simulates the readings and writes the folder; the session file declares no effect.
    ///
    /// # Errors
    /// If the folder or a file cannot be written.
    pub fn write(&self, folder: &Path) -> std::io::Result<()> {
        let machine = Machine::default();
        let mut random = Pcg64Mcg::seed_from_u64(self.seed);
        let mut mounts: Vec<[f64; 3]> = Vec::new();
        for _ in &self.tests {
            mounts.push([(); 3].map(|()| MOUNT_U_UM * 1e-3 * normal(&mut random)));
        }
        let instants = instants(&machine, &self.tests);
        std::fs::create_dir_all(folder)?;
        std::fs::write(folder.join("machine.toml"), MACHINE)?;
        std::fs::write(folder.join("session.toml"), self.session_toml())?;
        for (index, test) in self.tests.iter().enumerate() {
            let mut text = "time_s,run,x_mm,y_mm,z_mm,a_deg,c_deg,dx_um,dy_um,dz_um\n".to_string();
            for instant in instants.iter().filter(|instant| instant.test == index) {
                let read = self.counted_um(&machine, instant, mounts[index]);
                let [x, y, z, a, c] = instant.commanded.position;
                let (time_s, run) = (instant.time_s, instant.run);
                let _ = write!(text, "{time_s:.3},{run},{x:.6},{y:.6},{z:.6}");
                let _ = write!(text, ",{:.6},{:.6}", a.to_degrees(), c.to_degrees());
                for value in read {
                    let _ = write!(text, ",{:.2}", value + self.noise_um * normal(&mut random));
                }
                text.push('\n');
            }
            std::fs::write(folder.join(format!("{}.csv", test.name)), text)?;
        }
        Ok(())
    }

    /// The sensor readings without noise, µm.
    fn counted_um(&self, machine: &Machine, instant: &Instant, mount_mm: [f64; 3]) -> [f64; 3] {
        let mut displacement = Displacement { workpiece_ball: mount_mm, ..Displacement::default() };
        for (component, value) in &self.errors {
            displacement.add(*component, value * unit_size(component.unit()));
        }
        for effect in &self.effects {
            effect.displace(instant, &mut displacement);
        }
        let stated = &self.tests[instant.test].stated;
        reading_mm(machine, &self.nest, &instant.commanded, stated, &displacement).map(|mm| mm * 1e3)
    }

    fn session_toml(&self) -> String {
        let names: Vec<String> = self.declared.iter().map(|error| format!("\"{error}\"")).collect();
        let setting = match self.nest.on {
            NestOn::Table => "E",
            NestOn::Spindle => "Es",
        };
        let mut text = format!(
            "[machine]\nfile = \"machine.toml\"\n\n[instrument]\nkind = \"r-test\"\nnoise_um = {}\n\n[unknowns]\nerrors = [{}]\n",
            self.noise_um,
            names.join(", ")
        );
        for test in &self.tests {
            let _ = write!(
                text,
                "\n[[test]]\nname = \"{name}\"\ndata = \"{name}.csv\"\nsetting = \"{setting}\"\nworkpiece_ball_mm = {:?}\n\
                 spindle_ball_mm = {:?}\nworkpiece_ball_u_um = {MOUNT_U_UM:?}\n",
                test.stated.workpiece_ball_mm,
                test.stated.spindle_ball_mm,
                name = test.name,
            );
        }
        text
    }
}

/// The Hermle C600U with an A axis of unlimited travel, like that of Machine B in the paper.
const MACHINE: &str = "name = \"Plant\"\nchain = \"w C A b Y X Z t\"\n\n[axis.C]\ndirection = [0, 0, 1]\n\n\
                       [axis.A]\ndirection = [1, 0, 0]\n\n[axis.X]\n[axis.Y]\n[axis.Z]\n";
