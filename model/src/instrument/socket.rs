//! A ball in fixed sockets: the tool's ball is at the same point in every pose of one socket.
//!
//! The reading is the closure `P_s − s`, the ball in R less the socket in R; the observed value is zero.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::set_up::{self, SetUp, Stated, Written};
use super::{Contact, 
    Entry, Fault, Geometry, Group, Handling, Instrument, InstrumentParameter, InstrumentPoint, Reading, SharedBy, Station, Target,
    default_errors, point,
};
use crate::chain::{Frame, MachineState};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::unit::Unit;

/// The socket in R, then the ball in the tool frame.
pub const PARAMETERS: [InstrumentParameter; 6] = InstrumentParameter::all(&[
    &InstrumentParameter::point("socket", SharedBy::Socket),
    &InstrumentParameter::point("ball", SharedBy::SpindleSetup),
]);

/// The points on bodies, that of the table first.
const POINTS: &[(&str, Frame)] = &[("ball", Frame::Tool)];

pub(super) const ENTRY: Entry = Entry {
    free: Some("socket"),
    reads_poses: true,
    has_readings: false,
    default_errors: default_errors::all_locations,
    // The ball at a robot's flange stays mounted from socket to socket.
    spindle_setup: Some("tool"),
    ..Entry::new(["socket", "a ball in fixed sockets"], &PARAMETERS, schema::properties::<Keys>, POINTS, read)
};

/// The channels.
const CHANNELS: [Channel; 3] = {
    let [x, y, z] = Channel::vector(["x", "y", "z"]);
    [x.of_contact(), y.of_contact(), z.of_contact()]
};

/// The column of a socket: a pose consists of axis positions only.
const COLUMNS: [Column; 1] = [Column::new("socket", Unit::One, Quantity::Socket)];

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Ball in the tool frame.
    ball_mm: document::Point,
    #[serde(default)]
    ball_u_um: document::Uncertainties,
    /// The socket of all poses of the test.
    socket: Option<String>,
    /// Where it is in R, for plans; default: the mean of the poses in the data.
    socket_mm: Option<document::Point>,
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    let ball = set_up.point("ball", &keys.ball_mm)?;
    let priors = [Prior::Free; 3].into_iter().chain(set_up::lengths(&keys.ball_u_um)).collect();
    let stated = keys.socket_mm.map(|point| set_up.coordinates("socket_mm", &point)).transpose()?;
    if stated.is_some() && keys.socket.is_none() {
        let help = "add `socket = \"…\"`, the name of the socket of all poses of the test";
        return Err(KeyFault::new("`socket_mm` without the name of the socket", help).at("socket_mm"));
    }
    let is_located = stated.is_some();
    let socket = stated.unwrap_or_else(|| [0.0; 3].map(Written::number));
    let station = Station::Socket(Socket { ball, socket, is_located });
    Ok(SetUp { socket: keys.socket, ..SetUp::new(station, priors) })
}

/// A ball and its socket, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Socket<N> {
    /// Centre of the ball.
    pub ball: Target<N>,
    /// Centre of the socket in R.
    pub socket: [N; 3],
    /// Whether that centre is known: stated, or the mean of poses.
    pub is_located: bool,
}

impl<N> Geometry<N> for Socket<N> {
    type Over<M> = Socket<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> Socket<M> {
        Socket { ball: self.ball.map(to), socket: point(&self.socket, to), is_located: self.is_located }
    }
    /// The closure: ball less socket, mm.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let ball = self.ball.in_r(at, 3, &unknown);
        let socket = Target { frame: Frame::Bed, mm: self.socket };
        Reading::of(ball.minus(socket.displaced(0, &unknown)).0)
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        [None, InstrumentPoint::of("ball", &self.ball, 3)]
    }
}

impl Instrument for Socket<f64> {
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let keys = Keys {
            ball_mm: set_up::written_point(self.ball.mm),
            ball_u_um: set_up::written_lengths(priors, 3),
            socket: None,
            socket_mm: self.is_located.then(|| set_up::written_point(self.socket)),
        };
        set_up::written(&keys, &[])
    }
    fn handling(&self) -> Handling {
        Handling { beside: Some("Sockets, fixed where the ball reaches them".into()), ..Handling::default() }
    }
    fn contact(&self) -> Contact {
        Contact::InR(self.socket)
    }
    fn is_located(&self) -> bool {
        self.is_located
    }
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        [None, Some(&mut self.ball)]
    }
    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }
    fn columns(&self) -> &'static [Column] {
        &COLUMNS
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let help = "add the column, or add `socket = \"…\"` to the test if all its poses have one socket";
        (!has(Quantity::Socket)).then(|| ("`socket`".into(), help.into()))
    }
    /// The mean of the points.
    fn placed(&self, group: &Group<'_>) -> Option<Station<f64>> {
        let points = group.tool_points();
        let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let socket = Socket { socket: [mean.x, mean.y, mean.z], is_located: true, ..self.clone() };
        (!points.is_empty()).then_some(Station::Socket(socket))
    }
}
