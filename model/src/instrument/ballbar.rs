//! The double ball bar: `L = ‖P_w − P_s‖`, the distance between a ball on the table and a ball in the spindle.
//!
//! The reading refers to the stated length of the bar: a bar that is `δ` longer than stated reads `L − δ`. A sensor
//! with the gain error `k` adds `k·(L − L_bar)`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::channel::Channel;
use super::column::{Column, Quantity};
use super::check::{MAX_MM, doubt_on_scatter};
use super::set_up::{self, SetUp, Stated};
use super::{Contact, Checked, Entry, Fault, Following, Geometry, Handling, Instrument, InstrumentParameter, InstrumentPoint, Reading, SharedBy, Station, Target, default_errors};
use crate::median::median;
use crate::chain::{AxisPosition, Frame, Machine, MachineState};
use crate::document::node::Node;
use crate::document::{Fault as KeyFault, schema, value as document};
use crate::frames::Point;
use crate::scalar::{Nominal, Scalar};
use crate::session::Prior;
use crate::unit::{InternalUnit, Unit};

/// Both balls, the length of the bar, the gain of the sensor.
pub const PARAMETERS: [InstrumentParameter; 8] = InstrumentParameter::all(&[
    &InstrumentParameter::point("workpiece_ball", SharedBy::Setup),
    &InstrumentParameter::point("spindle_ball", SharedBy::SpindleSetup),
    &[InstrumentParameter::length("bar", "", SharedBy::BarSetup)],
    &[InstrumentParameter::new("gain", "", InternalUnit::Ratio, SharedBy::Session)],
]);

/// Index of the length of the bar in [`PARAMETERS`].
pub const BAR: usize = 6;
/// Index of the gain of the sensor in [`PARAMETERS`].
pub const GAIN: usize = 7;

/// The points on bodies, that of the table first.
const POINTS: &[(&str, Frame)] = &[("workpiece_ball", Frame::Table), ("spindle_ball", Frame::Tool)];

pub(super) const ENTRY: Entry = Entry {
    is_two_sided: true,
    needs_every_axis: false,
    default_errors: default_errors::positions_and_orientations,
    ..Entry::new(["ballbar", "a double ball bar"], &PARAMETERS, schema::properties::<Keys>, POINTS, read)
};

/// The channels.
const CHANNELS: [Channel; 1] = [Channel::length("length")];

/// The columns of a ball bar.
const COLUMNS: [Column; 2] =
    [Column::new("length", Unit::Millimetre, Quantity::Length), Column::new("deviation", Unit::Micrometre, Quantity::Deviation)];

/// Balls that are closer to each other than this coincide, mm.
const MIN_MM: f64 = 1e-6;

/// The keys of a test.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Calibrated length.
    bar_mm: document::Length,
    #[serde(default)]
    bar_u_um: document::Uncertainty,
    /// Workpiece ball in the table frame, such as [0, 100, 0].
    workpiece_ball_mm: document::Point,
    #[serde(default)]
    workpiece_ball_u_um: document::Uncertainties,
    /// Spindle ball in the tool frame, such as [0, 0, 0].
    spindle_ball_mm: document::Point,
    #[serde(default)]
    spindle_ball_u_um: document::Uncertainties,
    /// Tests with the same name share the assembled bar.
    bar_setup: Option<String>,
}

fn read(set_up: &Stated<'_>) -> Result<SetUp, KeyFault> {
    let keys: Keys = set_up.keys()?;
    let bar = set_up.positive("bar_mm", &keys.bar_mm)?;
    let workpiece_ball = set_up.point("workpiece_ball", &keys.workpiece_ball_mm)?;
    let spindle_ball = set_up.point("spindle_ball", &keys.spindle_ball_mm)?;
    let balls = set_up::lengths(&keys.workpiece_ball_u_um).chain(set_up::lengths(&keys.spindle_ball_u_um));
    // The bar, and the gain of its sensor.
    let priors = balls.chain([set_up::length(keys.bar_u_um), Prior::Known]).collect();
    let station = Station::BallBar(BallBar { workpiece_ball, spindle_ball, bar });
    Ok(SetUp { bar_setup: keys.bar_setup, ..SetUp::new(station, priors) })
}

/// A ball bar as set up for one test, lengths in mm.
///
/// ```
/// use abbe_model::chain::{AxisPosition, BodyErrors, Machine};
/// use abbe_model::instrument::{Station, Target};
/// use abbe_model::instrument::ballbar::{BAR, BallBar};
///
/// let machine = Machine::from_code("wbXYZt")?;
/// let state: Vec<_> = machine.axes.iter().map(|axis| AxisPosition::new(axis.kind, 0.0)).collect();
/// let none = vec![BodyErrors::<f64>::NONE; 3];
/// let spindle_ball = Target::on_tool([60.0, 0.0, 80.0]);
/// let bar = BallBar { workpiece_ball: Target::on_table([0.0; 3]), spindle_ball, bar: 100.0 };
/// let station = Station::BallBar(bar);
/// assert_eq!(station.read(&machine, &state, &none, |_| None).channels(), [100.0]);
/// // A bar that is 2 µm longer than stated reads 2 µm less.
/// let longer = |unknown| (unknown == BAR).then_some(0.002);
/// assert_eq!(station.read(&machine, &state, &none, longer).channels(), [99.998]);
/// # Ok::<(), abbe_model::Diagnostic>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BallBar<N> {
    /// Centre of the workpiece ball.
    pub workpiece_ball: Target<N>,
    /// Centre of the spindle ball.
    pub spindle_ball: Target<N>,
    /// Calibrated length of the bar.
    pub bar: N,
}

impl BallBar<f64> {
    /// From the origin of the table frame to that of the tool frame, of no length.
    pub const ORIGINS: BallBar<f64> =
        BallBar { workpiece_ball: Target::on_table([0.0; 3]), spindle_ball: Target::on_tool([0.0; 3]), bar: 0.0 };

    /// The two ball centres in R, nominal: workpiece ball, spindle ball; mm.
    pub fn nominal_mm(&self, machine: &Machine, state: &[AxisPosition<f64>]) -> [[f64; 3]; 2] {
        [self.workpiece_ball, self.spindle_ball].map(|ball| ball.nominal_mm(machine, state))
    }
}

impl<N: Nominal> BallBar<N> {
    /// The two ball centres in R: workpiece ball, spindle ball.
    pub fn balls<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: &impl Fn(usize) -> Option<S>,
    ) -> (Point<S>, Point<S>) {
        (self.workpiece_ball.in_r(at, 0, unknown), self.spindle_ball.in_r(at, 3, unknown))
    }
}

impl<N> Geometry<N> for BallBar<N> {
    type Over<M> = BallBar<M>;

    fn map<M>(&self, to: &impl Fn(&N) -> M) -> BallBar<M> {
        BallBar {
            workpiece_ball: self.workpiece_ball.map(to),
            spindle_ball: self.spindle_ball.map(to),
            bar: to(&self.bar),
        }
    }
    /// The reading, mm.
    fn reading<S: Scalar<Nominal = N>>(
        &self,
        at: MachineState<'_, S>,
        unknown: impl Fn(usize) -> Option<S>,
    ) -> Reading<S>
    where
        N: Nominal,
    {
        let (workpiece, spindle) = self.balls(at, &unknown);
        let distance = workpiece.minus(spindle).norm();
        let length = match unknown(BAR) {
            Some(bar) => distance - bar,
            None => distance,
        };
        Reading::scalar(match unknown(GAIN) {
            Some(gain) => length + gain * (distance - self.bar),
            None => length,
        })
    }
    fn points(&self) -> [Option<InstrumentPoint<'_, N>>; 2] {
        [
            InstrumentPoint::of("workpiece ball", &self.workpiece_ball, 0),
            InstrumentPoint::of("spindle ball", &self.spindle_ball, 3),
        ]
    }
}

impl Instrument for BallBar<f64> {
    fn written(&self, priors: &[Prior]) -> Option<Node> {
        let keys = Keys {
            bar_mm: set_up::rounded(self.bar).into(),
            bar_u_um: set_up::written_u(priors.get(BAR), Unit::Micrometre),
            workpiece_ball_mm: set_up::written_point(self.workpiece_ball.mm),
            workpiece_ball_u_um: set_up::written_lengths(priors, 0),
            spindle_ball_mm: set_up::written_point(self.spindle_ball.mm),
            spindle_ball_u_um: set_up::written_lengths(priors, 3),
            bar_setup: None,
        };
        set_up::written(&keys, &[])
    }
    fn handling(&self) -> Handling {
        Handling {
            probed: Some("workpiece ball"),
            taken_off: Some("the bar"),
            changes: Some("changes of the bar"),
            ..Handling::default()
        }
    }
    fn contact(&self) -> Contact {
        Contact::AtDistance(self.bar)
    }
    fn points_mut(&mut self) -> [Option<&mut Target<f64>>; 2] {
        [Some(&mut self.workpiece_ball), Some(&mut self.spindle_ball)]
    }
    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }
    fn columns(&self) -> &'static [Column] {
        &COLUMNS
    }
    fn missing(&self, has: &dyn Fn(Quantity) -> bool) -> Option<Fault> {
        let missing = !has(Quantity::Length) && !has(Quantity::Deviation);
        let help = "a ball bar needs `length_mm`, or `deviation_um` from `bar_mm`";
        missing.then(|| ("with the bar readings".into(), help.into()))
    }
    fn reference_mm(&self) -> f64 {
        self.bar
    }
    fn following(&self) -> Following {
        Following::AtBar
    }
    /// The distance between the balls is the length of the bar.
    fn check_set_up(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        let mut deviations = checked.nominal(Station::BallBar(self.clone()));
        let mut farthest = (0, 0.0_f64);
        for (row, length) in deviations.iter_mut().enumerate() {
            // A length of zero has no direction, so that no error changes it to first order.
            if *length < MIN_MM {
                return Err((
                    format!(
                        "test \"{}\", reading {}: the two balls nominally coincide, but the bar is {:e} mm long",
                        checked.test,
                        row + 1,
                        self.bar
                    ),
                    "check `bar_mm`, the two ball positions and the axis positions in `at` and the data".into(),
                ));
            }
            *length -= self.bar;
            if length.abs() > farthest.1 {
                farthest = (row, length.abs());
            }
        }
        let nominal = self.bar + median(&mut deviations);
        if (nominal - self.bar).abs() <= MAX_MM {
            return Ok(());
        }
        Err((
            format!(
                "test \"{}\": a bar of {:.4} mm cannot reach between its balls, which nominally lie {nominal:.3} mm \
                 apart (median of {} positions; farthest from it at {})",
                checked.test,
                self.bar,
                deviations.len(),
                checked.place(farthest.0)
            ),
            "possible causes are degrees read as radians (or radians as degrees), and a ball position, an axis \
             position in `at` or an axis direction that is not as on the machine"
                .into(),
        ))
    }
    fn doubt(&self, checked: &Checked<'_>) -> Option<String> {
        let deviations = checked.readings.observed.iter().map(|length| length - self.bar);
        doubt_on_scatter(&mut deviations.collect::<Vec<_>>())
    }
    /// The bar reaches at every position of a plan.
    fn check_planned(&self, checked: &Checked<'_>) -> Result<(), Fault> {
        let off = checked.nominal(Station::BallBar(self.clone())).into_iter().enumerate();
        let farthest = off.max_by(|(_, a), (_, b)| (a - self.bar).abs().total_cmp(&(b - self.bar).abs()));
        let Some((row, apart)) = farthest.filter(|(_, apart)| (apart - self.bar).abs() > MAX_MM) else {
            return Ok(());
        };
        Err((
            format!(
                "test \"{}\": a bar of {:.4} mm cannot reach between its balls at {}, where they nominally lie {apart:.3} mm apart",
                checked.test,
                self.bar,
                checked.place(row)
            ),
            "keep the balls at one distance over the whole motion: one of them on the axis of a sweep, or a path of kind \
             \"follow\""
                .into(),
        ))
    }
    /// The readings are near the length of the bar.
    fn check_observed(&self, test: &str, observed: &[f64]) -> Result<(), Fault> {
        let mut deviations: Vec<f64> = observed.iter().map(|length| length - self.bar).collect();
        let read = self.bar + median(&mut deviations);
        if (read - self.bar).abs() <= MAX_MM {
            return Ok(());
        }
        Err((
            format!(
                "test \"{test}\": a bar of {:.4} mm read {read:.3} mm (median of {} readings)",
                self.bar,
                deviations.len()
            ),
            "is the column a deviation from `bar_mm` rather than a length, or in another unit than its name says?"
                .into(),
        ))
    }
}
