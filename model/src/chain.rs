//! The kinematic chain of a machine over an open scalar.
//!
//! From the bed outwards `P_w = T_A T_C w` on the workpiece side and `P_s = T_Y T_X T_Z s` on the tool side of
//! `w C A b Y X Z t`,
//!
//! ```text
//! rotary axis, direction d, origin o:   T(q) = Trans(o) · E0 · E(q) · Rot(d, q) · Trans(−o)
//! linear axis:                          T(q) = Trans(o + q·d′) · E(q) · Trans(−o),   d′ = d + ω0 × d
//! ```
//!
//! with `E0 = Trans(EX0k, EY0k, EZ0k) · Rx(EA0k) · Ry(EB0k) · Rz(EC0k)` the location errors, `E(q)` the error motions
//! in the same order, and ω0 the squareness errors `(EA0k, EB0k, EC0k)` of a linear axis.

use crate::Diagnostic;
use crate::axis::{Axis, AxisKind};
use crate::body::Body;
use crate::code::StructuralCode;
use crate::component::{ErrorKind, ErrorName};
use crate::diagnostic::{Area, Code};
use crate::frames::{FixedPose, Point, Rotation, SinCos, SmallMotion, cross_nominal};
use crate::scalar::{Nominal, Scalar};
use crate::words::{MAX_QUOTED, cut};

/// Number of error slots per axis: six location errors, then six error motions.
pub const ERRORS_PER_AXIS: usize = 12;

/// A machine: axes in a serial chain from workpiece over bed to tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// The display name.
    pub name: String,
    /// The axes in the order of the structural code, from workpiece to tool.
    pub axes: Vec<Axis>,
    /// Number of axes on the workpiece side.
    pub workpiece_side: usize,
    /// Rotation convention of the error angles.
    pub rotation: Rotation,
    /// Direction of gravity in R, a unit vector.
    pub gravity: [f64; 3],
    /// The flange of a robot in R with all axes at zero: the frame in which what is mounted there is reported.
    pub flange: Option<FixedPose>,
    /// Bodies that can collide.
    pub bodies: Vec<Body>,
}

/// The frame of a body. Its coordinates are those of R with all axes at zero and no errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Frame {
    /// The bed: R.
    Bed,
    /// What the last axis of the workpiece side carries; the bed without such an axis.
    Table,
    /// What the last axis of the tool side carries; the bed without such an axis.
    Tool,
    /// What an axis carries, by index in [`Machine::axes`].
    Axis(usize),
}

impl Frame {
    /// Its word in files: `table`, `axis A`.
    pub fn word(self, machine: &Machine) -> String {
        match self {
            Frame::Bed => "bed".to_string(),
            Frame::Table => "table".to_string(),
            Frame::Tool => "tool".to_string(),
            Frame::Axis(axis) => format!("axis {}", machine.axes[axis].name),
        }
    }
}

/// Position of an axis; for a rotary axis with its sine and cosine, computed once.
#[derive(Clone, Copy, Debug)]
pub struct AxisPosition<N> {
    /// mm or radians.
    pub value: N,
    /// Sine and cosine of a rotary axis; unused for a linear axis.
    pub turn: SinCos<N>,
}

impl<N: Nominal> AxisPosition<N> {
    /// The position of an axis of this kind.
    pub fn new(kind: AxisKind, value: N) -> Self {
        let turn = match kind {
            AxisKind::Rotary => SinCos::by(value),
            AxisKind::Linear => SinCos { sin: N::constant(0.0), cos: N::constant(1.0) },
        };
        AxisPosition { value, turn }
    }
}

/// The errors of one axis, prepared for the transformation of points. `None` is an exact zero and costs nothing.
#[derive(Clone, Copy, Debug)]
pub struct BodyErrors<S> {
    location: Option<SmallMotion<S>>,
    squareness: Option<[S; 3]>,
    motion: Option<SmallMotion<S>>,
}

impl<S: Scalar> BodyErrors<S> {
    /// No errors.
    pub const NONE: BodyErrors<S> = BodyErrors { location: None, squareness: None, motion: None };

    /// Whether no error of the axis turns its frame. A squareness error changes the direction of travel, not the frame.
    pub fn turns_nothing(&self) -> bool {
        self.location.is_none() && self.motion.is_none()
    }

    /// A direction turned from the moved side of an axis to its bed side.
    pub(crate) fn turn(&self, axis: &Axis, position: &AxisPosition<S::Nominal>, direction: Point<S>) -> Point<S> {
        let turned = if axis.kind == AxisKind::Rotary { axis.rotate(position.turn, direction) } else { direction };
        [&self.motion, &self.location].into_iter().flatten().fold(turned, |turned, error| error.rotate(turned))
    }

    /// The inverse of [`BodyErrors::turn`] without errors.
    pub(crate) fn turn_back(axis: &Axis, position: &AxisPosition<S::Nominal>, direction: Point<S>) -> Point<S> {
        let back = SinCos { sin: -position.turn.sin, cos: position.turn.cos };
        if axis.kind == AxisKind::Rotary { axis.rotate(back, direction) } else { direction }
    }

    /// From location errors and error motions, each `[EX, EY, EZ, EA, EB, EC]` in mm and radians.
    pub fn new(kind: AxisKind, rotation: Rotation, location: Option<[S; 6]>, motion: Option<[S; 6]>) -> Self {
        let motion = motion.map(|six| SmallMotion::new(six, rotation));
        match kind {
            AxisKind::Rotary => {
                BodyErrors { location: location.map(|six| SmallMotion::new(six, rotation)), squareness: None, motion }
            }
            AxisKind::Linear => {
                BodyErrors { location: None, squareness: location.map(|six| [six[3], six[4], six[5]]), motion }
            }
        }
    }
}

/// A machine at a state of its axes, with errors.
#[derive(Clone, Copy, Debug)]
pub struct MachineState<'a, S: Scalar> {
    /// The machine.
    pub machine: &'a Machine,
    /// The positions of its axes.
    pub state: &'a [AxisPosition<S::Nominal>],
    /// The errors of its axes.
    pub errors: &'a [BodyErrors<S>],
}

impl<S: Scalar> MachineState<'_, S> {
    /// A point of a frame in R: [`Machine::in_r`].
    pub fn in_r(&self, frame: Frame, point: Point<S>) -> Point<S> {
        self.machine.in_r(frame, self.state, self.errors, point)
    }

    /// A point of R in a frame: [`Machine::in_frame`].
    pub fn in_frame(&self, frame: Frame, point: Point<S>) -> Point<S> {
        self.machine.in_frame(frame, self.state, self.errors, point)
    }
}

/// The kind of an axis does not follow from its name.
pub const UNKNOWN_AXIS_KIND: Code = Code { area: Area::Session, word: "unknown-axis-kind" };

/// [`UNKNOWN_AXIS_KIND`] in words.
pub fn unknown_axis_kind(axis: &str) -> Diagnostic {
    let axis = cut(axis, MAX_QUOTED);
    let message =
        format!("axis `{axis}` is not an ISO 841 letter; state its `kind` (\"rotary\" or \"linear\") and `direction`");
    Diagnostic::coded(UNKNOWN_AXIS_KIND, message)
}

impl Machine {
    /// A machine from a structural code of ISO 841 letters: directions of R, origins at R's origin, no travel stated.
    ///
    /// # Errors
    /// If the code is invalid or an axis is not an ISO 841 letter.
    pub fn from_code(text: &str) -> Result<Machine, Diagnostic> {
        let code = StructuralCode::parse(text)?;
        let axes = code
            .axes()
            .map(|name| {
                let kind = AxisKind::of_letter(name);
                let direction = Axis::direction_of_letter(name);
                let (Some(kind), Some(direction)) = (kind, direction) else {
                    return Err(unknown_axis_kind(name));
                };
                Ok(Axis { name: name.clone(), kind, direction, origin_mm: [0.0; 3], travel: None, joint: None })
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Machine {
            name: text.to_string(),
            workpiece_side: code.workpiece_side.len(),
            axes,
            rotation: Rotation::Exact,
            gravity: [0.0, 0.0, -1.0],
            flange: None,
            bodies: Vec::new(),
        })
    }

    /// The structural code, spaced.
    pub fn code(&self) -> String {
        let names = |axes: &[Axis]| axes.iter().map(|axis| axis.name.clone()).collect();
        StructuralCode {
            workpiece_side: names(&self.axes[..self.workpiece_side]),
            tool_side: names(&self.axes[self.workpiece_side..]),
        }
        .spaced()
    }

    /// The axis that carries another: its neighbour towards the bed. `None` for an axis on the bed.
    pub fn carrier(&self, axis: usize) -> Option<usize> {
        if axis < self.workpiece_side {
            Some(axis + 1).filter(|next| *next < self.workpiece_side)
        } else {
            axis.checked_sub(1).filter(|next| *next >= self.workpiece_side)
        }
    }

    /// Whether an axis is level at every position of the axes that carry it: at right angles to gravity, while the rotary
    /// axes below it are along gravity. The elevation of a mount is.
    pub fn stays_level(&self, axis: usize) -> bool {
        const LEVEL: f64 = 1e-3;
        let along = |axis: &usize| {
            let direction = self.axes[*axis].direction;
            direction.iter().zip(self.gravity).map(|(a, b)| a * b).sum::<f64>()
        };
        let below = std::iter::successors(self.carrier(axis), |axis| self.carrier(*axis));
        let mut turning = below.filter(|axis| self.axes[*axis].kind == AxisKind::Rotary);
        along(&axis).abs() < LEVEL && turning.all(|axis| along(&axis).abs() > 1.0 - LEVEL)
    }

    /// The index of an axis in [`Machine::axes`].
    pub fn axis_index(&self, name: &str) -> Option<usize> {
        self.axes.iter().position(|axis| axis.name == name)
    }

    /// The positions of all axes, mm or rad, as the chain takes them.
    pub fn axis_positions(&self, positions: &[f64]) -> Vec<AxisPosition<f64>> {
        self.axes.iter().zip(positions).map(|(axis, position)| AxisPosition::new(axis.kind, *position)).collect()
    }

    /// Number of error slots of the machine: [`ERRORS_PER_AXIS`] per axis, in the order of [`Machine::axes`].
    pub fn error_slots(&self) -> usize {
        self.axes.len() * ERRORS_PER_AXIS
    }

    /// The slot of an error; `None` if the machine has no such axis.
    pub fn error_slot(&self, name: &ErrorName) -> Option<usize> {
        let axis = self.axis_index(&name.axis)?;
        let kind = match name.kind {
            ErrorKind::Location => 0,
            ErrorKind::Motion => 6,
        };
        Some(axis * ERRORS_PER_AXIS + kind + name.freedom.index())
    }

    /// The name of the error in a slot.
    pub fn error_name(&self, slot: usize) -> ErrorName {
        let within = slot % ERRORS_PER_AXIS;
        ErrorName {
            kind: if within < 6 { ErrorKind::Location } else { ErrorKind::Motion },
            freedom: crate::component::Freedom::ALL[within % 6],
            axis: self.axes[slot / ERRORS_PER_AXIS].name.clone(),
        }
    }

    /// The slots of the error motions along or about the axis' own direction, each with its direction cosine. Together
    /// they are equivalent to an offset of the axis position, such as that of a delayed position reading.
    pub fn slots_along(&self, axis: usize) -> impl Iterator<Item = (usize, f64)> {
        let turns = usize::from(self.axes[axis].kind == AxisKind::Rotary) * 3;
        let start = axis * ERRORS_PER_AXIS + 6 + turns;
        let shares = self.axes[axis].direction.into_iter().enumerate();
        shares.filter(|(_, along)| *along != 0.0).map(move |(i, along)| (start + i, along))
    }

    /// The prepared errors of every axis, from the slots for which `carried` holds; the others are exact zeros.
    /// `slot(i)` gives the value of slot `i`.
    pub fn body_errors<S: Scalar>(
        &self,
        carried: impl Fn(usize) -> bool,
        slot: impl Fn(usize) -> S,
    ) -> Vec<BodyErrors<S>> {
        let six = |start: usize| {
            (start..start + 6)
                .any(&carried)
                .then(|| std::array::from_fn(|i| if carried(start + i) { slot(start + i) } else { S::constant(0.0) }))
        };
        self.axes
            .iter()
            .enumerate()
            .map(|(index, axis)| {
                let start = index * ERRORS_PER_AXIS;
                BodyErrors::new(axis.kind, self.rotation, six(start), six(start + 6))
            })
            .collect()
    }

    /// The axes between a frame and the bed, from the frame on.
    #[inline]
    pub fn carriers(&self, frame: Frame) -> impl DoubleEndedIterator<Item = usize> + Clone {
        let (count, side) = (self.axes.len(), self.workpiece_side);
        let (first, carriers) = match frame {
            Frame::Bed => (0, 0),
            Frame::Table => (0, side),
            Frame::Tool => (count.saturating_sub(1), count - side),
            Frame::Axis(axis) if axis < side => (axis, side - axis),
            Frame::Axis(axis) => (axis, axis + 1 - side),
        };
        (0..carriers).map(move |k| if first < side { first + k } else { first - k })
    }

    /// A point of a frame in R: `P_w` of the table frame, `P_s` of the tool frame.
    #[inline]
    pub fn in_r<S: Scalar>(
        &self,
        frame: Frame,
        state: &[AxisPosition<S::Nominal>],
        errors: &[BodyErrors<S>],
        point: Point<S>,
    ) -> Point<S> {
        self.carriers(frame).fold(point, |point, index| self.push(index, state, errors, point))
    }

    /// A point of R in a frame: the inverse of [`Machine::in_r`]. For small-angle errors the inverse of `I + [θ]×` is taken
    /// as `I − [θ]×`. It is exact to first order and deviates by `θ²` (1e-9 of a length at 6.5″, 0.2 µm in 200 mm at 206″).
    #[inline]
    pub fn in_frame<S: Scalar>(
        &self,
        frame: Frame,
        state: &[AxisPosition<S::Nominal>],
        errors: &[BodyErrors<S>],
        point: Point<S>,
    ) -> Point<S> {
        self.carriers(frame).rev().fold(point, |point, index| self.pull(index, state, errors, point))
    }

    /// Transforms a point from the moved side of axis `index` to its bed side: one step of the chain.
    pub fn push<S: Scalar>(
        &self,
        index: usize,
        state: &[AxisPosition<S::Nominal>],
        errors: &[BodyErrors<S>],
        point: Point<S>,
    ) -> Point<S> {
        push(&self.axes[index], &state[index], &errors[index], point)
    }

    /// Transforms a point from the bed side of axis `index` to its moved side: the inverse of [`Machine::push`].
    pub fn pull<S: Scalar>(
        &self,
        index: usize,
        state: &[AxisPosition<S::Nominal>],
        errors: &[BodyErrors<S>],
        point: Point<S>,
    ) -> Point<S> {
        pull(&self.axes[index], &state[index], &errors[index], point)
    }

    /// The moment about axis `index` of a unit weight at a point of a frame, mm, in mm (newton millimetre per newton):
    /// `d · ((p − o) × g)` with the nominal chain. 0 about an axis that does not carry the frame.
    pub fn gravity_moment_mm(
        &self,
        index: usize,
        state: &[AxisPosition<f64>],
        frame: Frame,
        point_mm: [f64; 3],
    ) -> f64 {
        if self.carriers(frame).all(|axis| axis != index) {
            return 0.0;
        }
        let none = vec![BodyErrors::<f64>::NONE; self.axes.len()];
        self.moment_about_mm(index, state, self.in_r(frame, state, &none, Point(point_mm)).0)
    }

    /// The moment about axis `index` of a unit weight at the origin of the axis `loaded`, which the axis carries, in mm;
    /// `None` if it does not carry it.
    pub fn gravity_moment_of_axis_mm(&self, index: usize, state: &[AxisPosition<f64>], loaded: usize) -> Option<f64> {
        self.carries(index, loaded)
            .then(|| self.moment_about_mm(index, state, self.carried_mm(loaded, state, self.axes[loaded].origin_mm)))
    }

    /// Whether an axis carries another one: both are on one side of the bed, and it is nearer to the bed.
    pub fn carries(&self, index: usize, other: usize) -> bool {
        match index < self.workpiece_side {
            true => other < index,
            false => other > index,
        }
    }

    /// The moment about an axis of a unit weight at a point of R, in mm.
    fn moment_about_mm(&self, index: usize, state: &[AxisPosition<f64>], load: [f64; 3]) -> f64 {
        let (origin, direction) = self.axis_line(index, state);
        let lever = std::array::from_fn(|i| load[i] - origin[i]);
        let moment = crate::frames::cross(lever, Point(self.gravity)).0;
        let about: f64 = (0..3).map(|i| direction[i] * moment[i]).sum();
        // A weight on the axis or above it has no moment. Rounding would leave a coefficient of no size.
        if about.abs() < NO_MOMENT_MM { 0.0 } else { about }
    }

    /// A point of an axis and its direction in R, with the nominal chain.
    pub fn axis_line(&self, index: usize, state: &[AxisPosition<f64>]) -> ([f64; 3], [f64; 3]) {
        let axis = &self.axes[index];
        let origin = self.carried_mm(index, state, axis.origin_mm);
        let tip = self.carried_mm(index, state, std::array::from_fn(|i| axis.origin_mm[i] + axis.direction[i]));
        (origin, std::array::from_fn(|i| tip[i] - origin[i]))
    }

    /// A point of the line of an axis in R: only the bodies between the axis and the bed carry it.
    fn carried_mm(&self, index: usize, state: &[AxisPosition<f64>], point_mm: [f64; 3]) -> [f64; 3] {
        let none = BodyErrors::<f64>::NONE;
        let carriers = self.carriers(Frame::Axis(index)).skip(1);
        carriers.fold(Point(point_mm), |point, k| push(&self.axes[k], &state[k], &none, point)).0
    }
}

/// Moment of a unit weight that is rounding, mm.
const NO_MOMENT_MM: f64 = 1e-9;

/// The origin of an axis, mm, unless it is that of its frame.
#[derive(Clone, Copy)]
struct OffOrigin([f64; 3]);

// The coordinates one by one: `array::map` is not inlined in these functions.
impl OffOrigin {
    #[inline(always)]
    fn of(axis: &Axis) -> Option<OffOrigin> {
        let [x, y, z] = axis.origin_mm;
        (x != 0.0 || y != 0.0 || z != 0.0).then_some(OffOrigin([x, y, z]))
    }

    #[inline(always)]
    fn forth<N: Nominal>(self) -> [N; 3] {
        let OffOrigin([x, y, z]) = self;
        [N::constant(x), N::constant(y), N::constant(z)]
    }

    #[inline(always)]
    fn back<N: Nominal>(self) -> [N; 3] {
        let OffOrigin([x, y, z]) = self;
        [N::constant(-x), N::constant(-y), N::constant(-z)]
    }
}

/// Transforms a point from the moved side of an axis to its bed side.
#[inline]
fn push<S: Scalar>(
    axis: &Axis,
    position: &AxisPosition<S::Nominal>,
    errors: &BodyErrors<S>,
    point: Point<S>,
) -> Point<S> {
    let origin = OffOrigin::of(axis);
    let mut point = origin.map_or(point, |origin| point.shifted(origin.back()));
    if axis.kind == AxisKind::Rotary {
        point = axis.rotate(position.turn, point);
    }
    if let Some(motion) = &errors.motion {
        point = motion.push(point);
    }
    if let Some(location) = &errors.location {
        point = location.push(point);
    }
    if axis.kind == AxisKind::Linear {
        for i in 0..3 {
            if let Some(along) = travel::<S>(axis, position, i) {
                point.0[i] = point.0[i] + along;
            }
        }
        if let Some(squareness) = errors.squareness {
            let tilt = cross_nominal::<S>(squareness, axis.direction);
            for i in 0..3 {
                point.0[i] = point.0[i] + tilt.0[i] * position.value;
            }
        }
    }
    origin.map_or(point, |origin| point.shifted(origin.forth()))
}

/// Transforms a point from the bed side of an axis to its moved side: the inverse of [`push`].
fn pull<S: Scalar>(
    axis: &Axis,
    position: &AxisPosition<S::Nominal>,
    errors: &BodyErrors<S>,
    point: Point<S>,
) -> Point<S> {
    let origin = OffOrigin::of(axis);
    let mut point = origin.map_or(point, |origin| point.shifted(origin.back()));
    if axis.kind == AxisKind::Linear {
        for i in 0..3 {
            if let Some(along) = travel::<S>(axis, position, i) {
                point.0[i] = point.0[i] - along;
            }
        }
        if let Some(squareness) = errors.squareness {
            let tilt = cross_nominal::<S>(squareness, axis.direction);
            for i in 0..3 {
                point.0[i] = point.0[i] - tilt.0[i] * position.value;
            }
        }
    }
    if let Some(location) = &errors.location {
        point = location.pull(point);
    }
    if let Some(motion) = &errors.motion {
        point = motion.pull(point);
    }
    if axis.kind == AxisKind::Rotary {
        let back = SinCos { sin: -position.turn.sin, cos: position.turn.cos };
        point = axis.rotate(back, point);
    }
    origin.map_or(point, |origin| point.shifted(origin.forth()))
}

/// Displacement by a linear axis along coordinate `i`; `None` if its direction has no component there.
fn travel<S: Scalar>(axis: &Axis, position: &AxisPosition<S::Nominal>, i: usize) -> Option<S::Nominal> {
    match axis.direction[i] {
        0.0 => None,
        1.0 => Some(position.value),
        along => Some(position.value * S::Nominal::constant(along)),
    }
}
