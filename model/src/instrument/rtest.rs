//! The R-test: three displacement sensors in a nest around a master ball measure its position, as the vector
//! `P_s − P_w`.
//!
//! The vector is in the table frame if the nest is on the table (E-setting), and in the tool frame if the nest is in
//! the spindle (Es-setting):
//!
//! ```text
//! E:   m = T_w⁻¹·P_s − w          Es:   m = s − T_s⁻¹·P_w          r = D · Rᵀ(ω₁, φ₁, θ₁) · m
//! ```
//!
//! `w` and `s` are the points of table and tool that nominally coincide. ω₁, φ₁, θ₁ are the orientation errors of the
//! nest. The rows of `D` are the measuring directions of the sensors; without `D` the reading is already in X, Y, Z.
//! Yamaji, Hamabata & Ihara, Evaluation of linear axis motion error of machine tools using an R-test device (HPC 2014),
//! Section 4: sensor outputs become machine coordinates by `R = R_φ·R_θ·R_ω` (Eqs. 1–3). The matrices above Eq. 1 are
//! printed in a different order from the expanded equations and the text.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::check::MAX_MM;
use super::set_up::{self, SetUp, Stated, Written};
use super::{Contact, 
    Checked, Entry, Fault, Following, Geometry, Handling, Instrument, InstrumentParameter, InstrumentPoint, Misreading, Reading, SharedBy,
    Station, Target, default_errors, point,
};
use crate::median::median;
use crate::chain::{Frame, MachineState};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::frames::{Coordinate, Point, Rotation, SinCos, cross, turn_about};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::unit::Unit;

/// Both points, then ω₁, φ₁ and θ₁ of the nest.
pub const PARAMETERS: [InstrumentParameter; 9] = InstrumentParameter::all(&[
    &InstrumentParameter::point("workpiece_ball", SharedBy::Setup),
    &InstrumentParameter::point("spindle_ball", SharedBy::SpindleSetup),
    &[
        InstrumentParameter::angle("sensor", "omega", SharedBy::Sensors),
        InstrumentParameter::angle("sensor", "phi", SharedBy::Sensors),
        InstrumentParameter::angle("sensor", "theta", SharedBy::Sensors),
    ],
]);

/// Index of ω₁ in [`PARAMETERS`].
pub const SENSOR: usize = 6;

/// The points on bodies, that of the table first.
const POINTS: &[(&str, Frame)] = &[("workpiece_ball", Frame::Table), ("spindle_ball", Frame::Tool)];

pub(super) const ENTRY: Entry = Entry {
    is_two_sided: true,
    default_errors: default_errors::positions_and_orientations,
    ..Entry::new(["r-test", "an R-test"], &PARAMETERS, schema::properties::<Keys>, POINTS, read)
};

/// The channels.
const VECTOR_CHANNELS: [Channel; 3] = Channel::vector(["dx", "dy", "dz"]);
const SENSOR_CHANNELS: [Channel; 3] = Channel::vector(["du", "dv", "dw"]);

/// The columns of a vector in the frame that carries the sensors, and those of the single sensors.
const VECTOR: [Column; 3] = Column::vector(["dx", "dy", "dz"], Unit::Micrometre);
const SENSORS: [Column; 3] = Column::vector(["du", "dv", "dw"], Unit::Micrometre);

/// The columns of two directions, or of two sensors, are exchanged.
const VECTOR_EXCHANGED: [Misreading; 3] = [
    exchanged::<0, 1>("dx, dy", "the columns dx and dy are exchanged"),
    exchanged::<0, 2>("dx, dz", "the columns dx and dz are exchanged"),
    exchanged::<1, 2>("dy, dz", "the columns dy and dz are exchanged"),
];
const SENSORS_EXCHANGED: [Misreading; 3] = [
    exchanged::<0, 1>("du, dv", "the columns du and dv are exchanged"),
    exchanged::<0, 2>("du, dw", "the columns du and dw are exchanged"),
    exchanged::<1, 2>("dv, dw", "the columns dv and dw are exchanged"),
];

const fn exchanged<const A: usize, const B: usize>(columns: &'static str, words: &'static str) -> Misreading {
    Misreading { kind: super::MisreadingKind::Order, columns, words, reread: |values| values.swap(A, B) }
}

/// Least triple product of three measuring directions. Below it, one coordinate has twenty times the noise.
const MIN_VOLUME: f64 = 0.05;

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Sensors on the table ("E") or in the spindle ("Es").
    setting: Setting,
    /// Master ball or centre of the nest on the table, in the table frame, such as [0, 100, 0].
    workpiece_ball_mm: document::Point,
    #[serde(default)]
    workpiece_ball_u_um: document::Uncertainties,
    /// Master ball or centre of the nest in the spindle, in the tool frame, such as [0, 0, 0].
    spindle_ball_mm: document::Point,
    #[serde(default)]
    spindle_ball_u_um: document::Uncertainties,
    /// Omega, phi, theta of the sensors; readings are then the values of the single sensors.
    sensor_angles_deg: Option<document::Three<Degrees>>,
    /// The direction of each sensor in the frame that carries them, instead of the angles.
    sensor_directions: Option<document::Three<document::Direction>>,
    /// Standard uncertainty of the sensors' orientation, arcsec.
    #[serde(default)]
    sensor_u_arcsec: document::Uncertainties,
}

/// One of three angles.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
struct Degrees(f64);

impl document::Coordinate for Degrees {
    const THREE: &'static str = "the three angles ω, φ, θ";
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    let workpiece_ball = set_up.point("workpiece_ball", &keys.workpiece_ball_mm)?;
    let spindle_ball = set_up.point("spindle_ball", &keys.spindle_ball_mm)?;
    let sensors = read_sensors(&keys)?.map(|rows| rows.map(|row| row.map(Written::number)));
    let balls = set_up::lengths(&keys.workpiece_ball_u_um).chain(set_up::lengths(&keys.spindle_ball_u_um));
    let priors = balls.chain(set_up::angles(&keys.sensor_u_arcsec)).collect();
    let station = Station::RTest(RTest { setting: keys.setting, workpiece_ball, spindle_ball, sensors });
    Ok(SetUp::new(station, priors))
}

/// The measuring directions of three sensors: from ω, φ, θ, or stated; `None` if readings are in X, Y, Z.
fn read_sensors(keys: &Keys) -> Result<Option<[[f64; 3]; 3]>, KeyFault> {
    let [a, b, c] = match (&keys.sensor_angles_deg, &keys.sensor_directions) {
        (None, None) => return Ok(None),
        (Some(document::Three(angles)), None) => {
            let orientation = Orientation::new(angles.map(|angle| angle.0.to_radians()), Rotation::Exact);
            let unit = |i: usize| Point(std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
            return Ok(Some(std::array::from_fn(|i| orientation.to_machine(unit(i)).0)));
        }
        (None, Some(document::Three(directions))) => directions.map(|direction| direction.0),
        (Some(_), Some(_)) => {
            let help = "keep one of them: either states the measuring directions of the sensors";
            let message = "both `sensor_angles_deg` and `sensor_directions`";
            return Err(KeyFault::new(message, help).on_key().at("sensor_directions"));
        }
    };
    let normal = cross(a, Point(b)).0;
    let volume: f64 = (0..3).map(|i| normal[i] * c[i]).sum();
    if volume.abs() < MIN_VOLUME {
        let message = format!(
            "the three `sensor_directions` lie almost in a plane (their triple product is {volume:.3}; 1 at right \
             angles)"
        );
        let help = "three coordinates need three independent measuring directions; check the directions";
        return Err(KeyFault::new(message, help).at("sensor_directions"));
    }
    Ok(Some([a, b, c]))
}

/// The body that carries the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
#[schemars(inline, extend("enum" = ["E", "Es"]))]
pub enum Setting {
    /// E: the sensors on the table, the master ball in the spindle.
    Table,
    /// Es: the sensors in the spindle, the master ball on the table.
    Spindle,
}

impl Serialize for Setting {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(match self {
            Setting::Table => "E",
            Setting::Spindle => "Es",
        })
    }
}

impl TryFrom<String> for Setting {
    type Error = String;

    fn try_from(word: String) -> Result<Setting, String> {
        match word.as_str() {
            "E" => Ok(Setting::Table),
            "Es" => Ok(Setting::Spindle),
            _ => Err(format!(
                "the text \"{word}\"; \"E\" (sensors on the table) or \"Es\" (sensors in the spindle) is expected"
            )),
        }
    }
}

/// An R-test as set up for one test, lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct RTest<N> {
    /// The body that carries the sensors.
    pub setting: Setting,
    /// The point on the table: the centre of the nest in E, of the master ball in Es.
    pub workpiece_ball: Target<N>,
    /// The point in the spindle: the centre of the master ball in E, of the nest in Es.
    pub spindle_ball: Target<N>,
    /// The measuring direction of each sensor in the carrying frame, row by row; `None` if readings are in that frame.
    pub sensors: Option<[[N; 3]; 3]>,
}

/// Three rotations between sensors and machine: `R = R_φ·R_θ·R_ω` with
///
/// ```text
///       ⎛ 1    0     0   ⎞        ⎛ cos φ  0  −sin φ ⎞        ⎛  cos θ  sin θ  0 ⎞
/// R_ω = ⎜ 0  cos ω  sin ω⎟  R_φ = ⎜   0    1     0   ⎟  R_θ = ⎜ −sin θ  cos θ  0 ⎟
///       ⎝ 0 −sin ω  cos ω⎠        ⎝ sin φ  0   cos φ ⎠        ⎝    0      0    1 ⎠
/// ```
///
/// ```
/// use abbe_model::frames::{Point, Rotation};
/// use abbe_model::instrument::rtest::Orientation;
///
/// // Eq. (4) of the paper: sensor u measures cos(−35.264°)·X + sin(−35.264°)·Z.
/// let angles: [f64; 3] = [135.0_f64, -35.264, 0.0].map(f64::to_radians);
/// let machine = Orientation::new(angles, Rotation::Exact).to_machine(Point([1.0, 0.0, 0.0])).0;
/// assert!((machine[0] - 0.81650).abs() < 1e-5 && machine[1] == 0.0 && (machine[2] + 0.57735).abs() < 1e-5);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Orientation<S> {
    omega: SinCos<S>,
    phi: SinCos<S>,
    theta: SinCos<S>,
}

impl<S: Scalar> Orientation<S> {
    /// From ω, φ, θ in radians. The small-angle form replaces the sine by the angle and the cosine by 1, as in Eqs. (7)
    /// to (9), which keep products of two angles and omit their squares.
    pub fn new(angles: [S; 3], rotation: Rotation) -> Self {
        let [omega, phi, theta] = angles.map(|angle| match rotation {
            Rotation::Exact => {
                let (sin, cos) = angle.sin_cos();
                SinCos { sin, cos }
            }
            Rotation::SmallAngle => SinCos { sin: angle, cos: S::constant(1.0) },
        });
        Orientation { omega, phi, theta }
    }

    /// `R · v`: from sensor coordinates to the frame that carries the sensors.
    pub fn to_machine(&self, sensors: Point<S>) -> Point<S> {
        let [omega, phi, theta] =
            [self.omega, self.phi, self.theta].map(|turn| SinCos { sin: -turn.sin, cos: turn.cos });
        let about_u = turn_about(Coordinate::X, omega, sensors);
        let about_w = turn_about(Coordinate::Z, theta, about_u);
        turn_about(Coordinate::Y, phi, about_w)
    }

    /// `Rᵀ · v`: from the carrying frame to sensor coordinates.
    pub fn to_sensors(&self, machine: Point<S>) -> Point<S> {
        let about_v = turn_about(Coordinate::Y, self.phi, machine);
        let about_w = turn_about(Coordinate::Z, self.theta, about_v);
        turn_about(Coordinate::X, self.omega, about_w)
    }
}

impl<N: Nominal> RTest<N> {
    /// `P_s − P_w` in the frame that carries the sensors, mm.
    pub fn difference<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: &impl Fn(usize) -> Option<S>,
    ) -> Point<S> {
        let (table, spindle) = (&self.workpiece_ball, &self.spindle_ball);
        match self.setting {
            Setting::Table => {
                let ball = spindle.in_r(at, 3, unknown);
                at.in_frame(table.frame, ball).minus(table.displaced(0, unknown))
            }
            Setting::Spindle => {
                let ball = table.in_r(at, 0, unknown);
                spindle.displaced(3, unknown).minus(at.in_frame(spindle.frame, ball))
            }
        }
    }
}

impl<N> Geometry<N> for RTest<N> {
    type Over<M> = RTest<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> RTest<M> {
        RTest {
            setting: self.setting,
            workpiece_ball: self.workpiece_ball.map(to),
            spindle_ball: self.spindle_ball.map(to),
            sensors: self.sensors.as_ref().map(|rows| rows.each_ref().map(|row| point(row, to))),
        }
    }
    /// The reading: the three sensor values, or the vector in the carrying frame, mm.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let mut vector = self.difference(at, &unknown);
        let carried = (SENSOR..SENSOR + 3).any(|index| unknown(index).is_some());
        if carried {
            let angles = std::array::from_fn(|i| unknown(SENSOR + i).unwrap_or_else(|| S::constant(0.0)));
            vector = Orientation::new(angles, at.machine.rotation).to_sensors(vector);
        }
        let Some(sensors) = &self.sensors else {
            return Reading::of(vector.0);
        };
        let [x, y, z] = vector.0;
        Reading::of(sensors.map(|[a, b, c]| x * a + y * b + z * c))
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        let (table, spindle) = match self.setting {
            Setting::Table => ("nest with the sensors", "master ball"),
            Setting::Spindle => ("master ball", "nest with the sensors"),
        };
        [
            InstrumentPoint::of(table, &self.workpiece_ball, 0),
            InstrumentPoint::of(spindle, &self.spindle_ball, 3),
        ]
    }
}

impl RTest<f64> {
    /// The point of the body that carries the sensors.
    pub fn nest(&self) -> &Target<f64> {
        match self.setting {
            Setting::Table => &self.workpiece_ball,
            Setting::Spindle => &self.spindle_ball,
        }
    }

    fn columns_help(&self) -> &'static str {
        if self.sensors.is_some() {
            "the test states the sensor directions: it needs the sensor values `du_um`, `dv_um` and `dw_um`; without \
             `sensor_angles_deg` and `sensor_directions` it needs `dx_um`, `dy_um` and `dz_um`"
        } else {
            "an R-test needs `dx_um`, `dy_um` and `dz_um`; the values of single sensors, `du_um`, `dv_um` and \
             `dw_um`, need `sensor_angles_deg` or `sensor_directions` in the test"
        }
    }
}

impl Instrument for RTest<f64> {
    /// The master ball in the middle of the nest.
    fn approaches(&self) -> Vec<[f64; 3]> {
        vec![[0.0; 3]]
    }
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let keys = Keys {
            setting: self.setting,
            workpiece_ball_mm: set_up::written_point(self.workpiece_ball.mm),
            workpiece_ball_u_um: set_up::written_lengths(priors, 0),
            spindle_ball_mm: set_up::written_point(self.spindle_ball.mm),
            spindle_ball_u_um: set_up::written_lengths(priors, 3),
            sensor_angles_deg: None,
            sensor_directions: self.sensors.map(|rows| document::Three(rows.map(set_up::written_direction))),
            sensor_u_arcsec: set_up::written_angles(priors, SENSOR),
        };
        set_up::written(&keys, &[])
    }
    fn handling(&self) -> Handling {
        let probed = (self.setting == Setting::Spindle).then_some("master ball");
        Handling {
            probed,
            taken_off: Some("the nest with the sensors"),
            begins: Some("Bring the ball into the nest"),
            ..Handling::default()
        }
    }
    fn contact(&self) -> Contact {
        Contact::AtDistance(0.0)
    }
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        [Some(&mut self.workpiece_ball), Some(&mut self.spindle_ball)]
    }
    fn channels(&self) -> &[Channel] {
        if self.sensors.is_some() { &SENSOR_CHANNELS } else { &VECTOR_CHANNELS }
    }
    fn columns(&self) -> &'static [Column] {
        if self.sensors.is_some() { &SENSORS } else { &VECTOR }
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let column = self.columns().iter().find(|column| !has(column.quantity))?;
        Some((format!("`{}`", column.name(column.unit)), self.columns_help().into()))
    }
    fn misreadings(&self) -> &'static [Misreading] {
        if self.sensors.is_some() { &SENSORS_EXCHANGED } else { &VECTOR_EXCHANGED }
    }
    fn help_on_column(&self, stem: &str) -> Option<&'static str> {
        let other = if self.sensors.is_some() { &VECTOR } else { &SENSORS };
        other.iter().any(|column| column.stem == stem).then(|| self.columns_help())
    }
    fn sensors(&self) -> SharedBy {
        match self.setting {
            Setting::Table => SharedBy::Setup,
            Setting::Spindle => SharedBy::SpindleSetup,
        }
    }
    fn following(&self) -> Following {
        Following::Touching(
            "`offset` is the direction of a bar; an R-test has no bar and measures all three directions at once",
            "remove it; the readings can be resolved into radial, tangential and axial components after a fit",
        )
    }
    /// The master ball is nominally in the nest at every reading.
    fn check_set_up(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        let nominal = checked.nominal(Station::RTest(self.clone()));
        for (row, values) in nominal.chunks_exact(self.channels().len()).enumerate() {
            let apart = values.iter().map(|x| x * x).sum::<f64>().sqrt();
            if apart > MAX_MM {
                return Err((
                    format!(
                        "test \"{}\", reading {}: the master ball nominally lies {apart:.3} mm from the centre of \
                         the sensors; the limit is {MAX_MM} mm",
                        checked.test,
                        row + 1
                    ),
                    "check `workpiece_ball_mm`, `spindle_ball_mm` and the axis positions in `at` and the data: the \
                     linear axes must follow the rotary axis"
                        .into(),
                ));
            }
        }
        Ok(())
    }
    /// The readings are within the range of the sensors.
    fn check_observed(&self, test: &str, observed: &[f64]) -> Result<(), Fault> {
        let mut sizes: Vec<f64> = observed.iter().map(|value| value.abs()).collect();
        let read = median(&mut sizes);
        if read <= MAX_MM {
            return Ok(());
        }
        Err((
            format!(
                "test \"{test}\": the sensors read {read:.3} mm (median of {} values); the limit is {MAX_MM} mm",
                sizes.len()
            ),
            "are the columns in another unit than their name says, or relative to another zero than the ball in the \
             middle of the nest?"
                .into(),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::Machine;

    fn three(reading: Reading<f64>) -> [f64; 3] {
        std::array::from_fn(|i| reading.channels()[i])
    }

    /// Each sensor angle transforms the reading by the transpose of its own matrix above, and by nothing else.
    #[test]
    fn sensor_orientation_errors_rotate_the_reading() {
        let machine = Machine {
            name: "none".into(),
            axes: Vec::new(),
            workpiece_side: 0,
            rotation: Rotation::Exact,
            gravity: [0.0, 0.0, -1.0],
            flange: None,
            bodies: Vec::new(),
        };
        let at = MachineState { machine: &machine, state: &[], errors: &[] };
        let [x, y, z] = [0.03, -0.05, 0.07];
        let vectors =
            RTest { setting: Setting::Table, workpiece_ball: Target::on_table([0.0; 3]), spindle_ball: Target::on_tool([x, y, z]), sensors: None };
        let directions = [[0.6, 0.8, 0.0], [0.0, 0.6, 0.8], [0.8, 0.0, 0.6]];
        let counts = RTest { sensors: Some(directions), ..vectors.clone() };
        let (sin, cos) = 0.4_f64.sin_cos();
        for (index, turned) in [
            [x, cos * y - sin * z, sin * y + cos * z],
            [cos * x + sin * z, y, -sin * x + cos * z],
            [cos * x - sin * y, sin * x + cos * y, z],
        ]
        .into_iter()
        .enumerate()
        {
            let askew = |unknown: usize| (unknown == SENSOR + index).then_some(0.4);
            let near = |found: [f64; 3], expected: [f64; 3]| {
                let far = (0..3).any(|i| (found[i] - expected[i]).abs() > 1e-15);
                assert!(!far, "angle {index}: {found:?}, not {expected:?}");
            };
            near(three(vectors.reading(at, askew)), turned);
            let counted = directions.map(|direction| (0..3).map(|i| direction[i] * turned[i]).sum());
            near(three(counts.reading(at, askew)), counted);
        }
    }
}
