//! Readings of a test and their derivatives by every component, computed through the chain.
//!
//! A *slot* is a component of the chain: the machine's errors ([`crate::chain::ERRORS_PER_AXIS`] per axis), then the
//! instrument's parameters. The chain is recorded once per test over symbols. Reverse accumulation gives its
//! derivatives by all slots at the cost of a few readings, whatever the number of slots. Both are
//! [evaluated](crate::replay) over the columns of readings. An axis that does not move in a test is a constant of the
//! recording. A slot that is zero and not requested is omitted.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use crate::axis::AxisKind;
use crate::chain::{AxisPosition, Machine};
use crate::expression::{Arena, Operand, Symbol};
use crate::frames::SinCos;
use crate::instrument::Station;
use crate::instrument::channel::Channel;
use crate::replay::Replay;
use crate::scalar::Nominal;
use crate::session::readings::Readings;

/// Values of the components for each reading.
#[derive(Clone, Debug, Default)]
pub struct SlotValues {
    /// The constant term of each slot, mm or rad.
    pub constant: Vec<f64>,
    /// The varying terms: slot, and one value per row.
    pub varying: Vec<(usize, Vec<f64>)>,
}

impl SlotValues {
    /// All zero, for a test with this number of slots.
    pub fn zero(slots: usize) -> Self {
        SlotValues { constant: vec![0.0; slots], varying: Vec::new() }
    }

    fn varies(&self, slot: usize) -> bool {
        self.varying.iter().any(|(varied, _)| *varied == slot)
    }

    /// The values of a varying slot in a range of rows.
    fn column(&self, slot: usize, rows: Range<usize>) -> Vec<f64> {
        let mut sum = vec![self.constant[slot]; rows.len()];
        for (_, values) in self.varying.iter().filter(|(varied, _)| *varied == slot) {
            for (sum, value) in sum.iter_mut().zip(&values[rows.clone()]) {
                *sum += value;
            }
        }
        sum
    }
}

/// Derivatives of readings by components.
#[derive(Clone, Debug)]
pub struct Sensitivities {
    /// The slots in the requested order.
    pub slots: Vec<usize>,
    /// The readings, mm or rad times the weights: rows × channels, the channels of a reading together.
    pub readings: Vec<f64>,
    /// For each slot, the derivative of each scalar reading: in mm or rad per mm or rad.
    pub derivatives: Vec<Vec<f64>>,
}

/// Variables of the recorded chain.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantity {
    /// Position of a moving axis, by its index in the machine.
    Position(usize),
    /// The sine of that position.
    Sine(usize),
    /// The cosine of that position.
    Cosine(usize),
    /// A component.
    Slot { slot: usize, varies: bool },
}

/// Key of a recording: its slots, whether they vary, and the slots of the derivatives.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct RecordingKey {
    slots: Vec<(usize, bool)>,
    derivatives: Vec<usize>,
}

/// Position of an axis in every row.
#[derive(Clone, Debug)]
enum AxisColumn {
    /// Equal in all rows.
    Fixed(AxisPosition<f64>),
    /// Positions, and for a rotary axis their sines and cosines, computed once.
    Moving { position: Vec<f64>, sine: Vec<f64>, cosine: Vec<f64> },
}

impl AxisColumn {
    fn new(kind: AxisKind, positions: &[f64]) -> AxisColumn {
        let first = positions.first().copied().unwrap_or(0.0);
        if positions.iter().all(|position| *position == first) {
            return AxisColumn::Fixed(AxisPosition::new(kind, first));
        }
        let (sine, cosine) = match kind {
            AxisKind::Rotary => positions.iter().map(|position| position.sin_cos()).unzip(),
            AxisKind::Linear => (Vec::new(), Vec::new()),
        };
        AxisColumn::Moving { position: positions.to_vec(), sine, cosine }
    }

    fn at(&self, row: usize) -> AxisPosition<f64> {
        match self {
            AxisColumn::Fixed(position) => *position,
            AxisColumn::Moving { position, sine, cosine } => AxisPosition {
                value: position[row],
                turn: match sine.get(row) {
                    Some(sin) => SinCos { sin: *sin, cos: cosine[row] },
                    None => SinCos { sin: 0.0, cos: 1.0 },
                },
            },
        }
    }
}

/// A test prepared for evaluation: its states with sines and cosines, and its recorded chain.
#[derive(Clone, Debug)]
pub struct TestModel {
    machine: Arc<Machine>,
    station: Station<f64>,
    axis_columns: Vec<AxisColumn>,
    rows: usize,
    /// Factor on each channel.
    weights: Vec<f64>,
    recorded: Arc<Mutex<HashMap<RecordingKey, Arc<Replay<Quantity>>>>>,
}

impl TestModel {
    /// From the axis positions of the readings.
    pub fn new(machine: impl Into<Arc<Machine>>, station: Station<f64>, readings: &Readings) -> Self {
        let machine = machine.into();
        let axes = machine.axes.iter().zip(&readings.positions);
        let axis_columns = axes.map(|(axis, positions)| AxisColumn::new(axis.kind, positions)).collect();
        let weights = vec![1.0; station.channels().len()];
        TestModel { machine, station, axis_columns, rows: readings.rows(), weights, recorded: Arc::default() }
    }

    /// The same with channels multiplied by weights, such that all have the same noise.
    pub fn weighted(self, weights: Vec<f64>) -> Self {
        TestModel { weights, recorded: Arc::default(), ..self }
    }

    /// The instrument as set up.
    pub fn station(&self) -> &Station<f64> {
        &self.station
    }

    /// Factor on each channel.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Number of readings.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The channels of a reading.
    pub fn channels(&self) -> &[Channel] {
        self.station.channels()
    }

    /// Number of slots: the machine's errors, then the instrument's parameters.
    pub fn slots(&self) -> usize {
        self.machine.error_slots() + self.station.kind().unknowns().len()
    }

    /// The slots that can affect a reading of this test: the applied errors of the axes between ball and bed (a linear
    /// axis has no position errors), and all parameters of the instrument. Without a point there, the axes on the workpiece
    /// side are excluded.
    pub fn effective_slots(&self) -> Vec<usize> {
        let two_sided = self.station.kind().is_two_sided();
        let targets = self.station.points().into_iter().flatten();
        let carriers: Vec<usize> = targets.flat_map(|point| self.machine.carriers(point.target.frame)).collect();
        let machine = (0..self.machine.error_slots()).filter(|slot| {
            let axis = slot / crate::chain::ERRORS_PER_AXIS;
            let within = slot % crate::chain::ERRORS_PER_AXIS;
            let applied = self.machine.axes[axis].kind == AxisKind::Rotary || within >= 3;
            applied && (two_sided || axis >= self.machine.workpiece_side || carriers.contains(&axis))
        });
        machine.chain(self.machine.error_slots()..self.slots()).collect()
    }

    /// Positions of the axes in a row.
    pub fn state(&self, row: usize) -> Vec<AxisPosition<f64>> {
        self.axis_columns.iter().map(|axis_column| axis_column.at(row)).collect()
    }

    /// The recorded chain: the channels of the reading, then for each of them its derivatives by the requested
    /// slots.
    fn recording(&self, values: &SlotValues, derivatives: &[usize]) -> Arc<Replay<Quantity>> {
        let mut included: Vec<bool> = values.constant.iter().map(|value| *value != 0.0).collect();
        derivatives.iter().for_each(|slot| included[*slot] = true);
        let slots = (0..self.slots())
            .filter(|slot| included[*slot] || values.varies(*slot))
            .map(|slot| (slot, values.varies(slot)))
            .collect();
        let key = RecordingKey { slots, derivatives: derivatives.to_vec() };
        // After a panic in another thread every recording is either complete or absent.
        let mut recorded = self.recorded.lock().unwrap_or_else(PoisonError::into_inner);
        match recorded.get(&key) {
            Some(replay) => replay.clone(),
            None => {
                let replay = Arc::new(self.record(&key));
                recorded.insert(key, replay.clone());
                replay
            }
        }
    }

    fn record(&self, key: &RecordingKey) -> Replay<Quantity> {
        let arena = Arena::new();
        let constant = Symbol::constant;
        let state: Vec<AxisPosition<Symbol<'_, Quantity>>> =
            (self.machine.axes.iter().zip(&self.axis_columns).enumerate())
                .map(|(index, (axis, axis_column))| match axis_column {
                    AxisColumn::Fixed(position) => AxisPosition {
                        value: constant(position.value),
                        turn: SinCos { sin: constant(position.turn.sin), cos: constant(position.turn.cos) },
                    },
                    AxisColumn::Moving { .. } => AxisPosition {
                        value: arena.variable(Quantity::Position(index)),
                        turn: match axis.kind {
                            AxisKind::Rotary => SinCos {
                                sin: arena.variable(Quantity::Sine(index)),
                                cos: arena.variable(Quantity::Cosine(index)),
                            },
                            AxisKind::Linear => SinCos { sin: constant(0.0), cos: constant(1.0) },
                        },
                    },
                })
                .collect();
        let slots: HashMap<usize, Symbol<'_, Quantity>> =
            (key.slots.iter()).map(|&(slot, varies)| (slot, arena.variable(Quantity::Slot { slot, varies }))).collect();
        let bodies = self.machine.body_errors(|slot| slots.contains_key(&slot), |slot| slots[&slot]);
        let first = self.machine.error_slots();
        let station = self.station.map(|number| constant(*number));
        let reading = station.read(&self.machine, &state, &bodies, |unknown| slots.get(&(first + unknown)).copied());
        let weighted = |(value, weight): (&Symbol<'_, Quantity>, &f64)| match *weight {
            1.0 => value.operand(),
            weight => (*value * constant(weight)).operand(),
        };
        let channels: Vec<Operand> = reading.channels().iter().zip(&self.weights).map(weighted).collect();
        let by: Vec<Operand> = key.derivatives.iter().map(|slot| slots[slot].operand()).collect();
        let gradients = channels.iter().flat_map(|channel| arena.gradient(*channel, &by));
        let outputs: Vec<Operand> = channels.iter().copied().chain(gradients).collect();
        Replay::new(&arena, &outputs, |quantity| match quantity {
            Quantity::Slot { varies, .. } => *varies,
            Quantity::Position(_) | Quantity::Sine(_) | Quantity::Cosine(_) => true,
        })
    }

    /// Computes the readings of a range of rows and their derivatives by the slots, block by block, so that they need
    /// not be in memory together. `put` receives the index of an output, the first row of the block relative to the
    /// start of the range, and one value per row. Outputs are the channels of the reading in mm or rad, then for
    /// each channel its derivatives by the slots.
    pub fn sweep(
        &self,
        values: &SlotValues,
        derivatives: &[usize],
        rows: Range<usize>,
        put: impl FnMut(usize, usize, &[f64]),
    ) {
        let recording = self.recording(values, derivatives);
        let varying: HashMap<usize, Vec<f64>> =
            (values.varying.iter()).map(|(slot, _)| (*slot, values.column(*slot, rows.clone()))).collect();
        let axis_column = |axis: usize| match &self.axis_columns[axis] {
            AxisColumn::Moving { position, sine, cosine } => [position, sine, cosine].map(|column| column.as_slice()),
            AxisColumn::Fixed(_) => [&[][..]; 3],
        };
        recording.run(
            rows.len(),
            |quantity| match quantity {
                Quantity::Slot { slot, .. } => values.constant[*slot],
                Quantity::Position(_) | Quantity::Sine(_) | Quantity::Cosine(_) => f64::NAN,
            },
            |quantity| match quantity {
                Quantity::Position(axis) => &axis_column(*axis)[0][rows.clone()],
                Quantity::Sine(axis) => &axis_column(*axis)[1][rows.clone()],
                Quantity::Cosine(axis) => &axis_column(*axis)[2][rows.clone()],
                Quantity::Slot { slot, .. } => &varying[slot],
            },
            put,
        );
    }

    /// The readings, mm or rad: rows × channels.
    pub fn readings(&self, values: &SlotValues) -> Vec<f64> {
        let channels = self.channels().len();
        let mut readings = vec![0.0; self.rows * channels];
        self.sweep(values, &[], 0..self.rows, |channel, start, column| {
            scatter(&mut readings, channels, channel, start, column);
        });
        readings
    }

    /// The readings of a range of rows and their derivatives by `slots`.
    pub fn sensitivities(&self, values: &SlotValues, slots: &[usize], rows: Range<usize>) -> Sensitivities {
        let channels = self.channels().len();
        let scalars = rows.len() * channels;
        let mut result = Sensitivities {
            slots: slots.to_vec(),
            readings: vec![0.0; scalars],
            derivatives: vec![vec![0.0; scalars]; slots.len()],
        };
        self.sweep(values, slots, rows, |output, start, column| {
            let (channel, into) = match output.checked_sub(channels) {
                None => (output, &mut result.readings),
                Some(by) => (by / slots.len(), &mut result.derivatives[by % slots.len()]),
            };
            scatter(into, channels, channel, start, column);
        });
        result
    }
}

/// Writes one channel of consecutive readings; `into` is readings × channels.
fn scatter(into: &mut [f64], channels: usize, channel: usize, start: usize, column: &[f64]) {
    if channels == 1 {
        into[start..start + column.len()].copy_from_slice(column);
        return;
    }
    let targets = into[start * channels + channel..].iter_mut().step_by(channels);
    targets.zip(column).for_each(|(target, value)| *target = *value);
}
