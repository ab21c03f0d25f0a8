//! Readings of a test and their derivatives by every component, by dual numbers through the one chain.
//!
//! A *slot* is a component that the chain can see: the machine's errors ([`crate::chain::ERRORS_PER_AXIS`] an axis), then the instrument's own
//! unknowns. Slots are seeded in packs; a slot that is neither seeded nor different from zero is left out of the chain altogether.

use crate::axis::AxisKind;
use crate::chain::{AxisPosition, BodyErrors, Machine};
use crate::gradient::Gradient;
use crate::instrument::Station;
use crate::scalar::Scalar;
use crate::session::readings::Readings;

/// Slots seeded at once.
const PACK: usize = 8;

type PackDual = Gradient<PACK>;

/// What the components are, reading by reading.
#[derive(Clone, Debug, Default)]
pub struct SlotValues {
    /// The part of each slot that is the same for all readings, mm or rad.
    pub constant: Vec<f64>,
    /// What is added reading by reading: slot, and a value a row.
    pub varying: Vec<(usize, Vec<f64>)>,
}

impl SlotValues {
    /// All zero, for a test with this many slots.
    pub fn zero(slots: usize) -> Self {
        SlotValues {
            constant: vec![0.0; slots],
            varying: Vec::new(),
        }
    }

    fn at(&self, slot: usize, row: usize) -> f64 {
        let varying = self.varying.iter().filter(|(varied, _)| *varied == slot);
        self.constant[slot] + varying.map(|(_, values)| values[row]).sum::<f64>()
    }

    fn is_zero(&self, slot: usize) -> bool {
        self.constant[slot] == 0.0 && self.varying.iter().all(|(varied, _)| *varied != slot)
    }

    fn varies(&self, slot: usize) -> bool {
        self.varying.iter().any(|(varied, _)| *varied == slot)
    }
}

/// Derivatives of readings by components.
#[derive(Clone, Debug)]
pub struct Sensitivities {
    /// The slots, in the order asked for.
    pub slots: Vec<usize>,
    /// The readings, mm: rows × coordinates, a reading's coordinates together.
    pub readings_mm: Vec<f64>,
    /// For each slot, the derivative of each scalar reading: mm/mm or mm/rad.
    pub derivatives: Vec<Vec<f64>>,
}

/// A test made ready: its states with sines and cosines taken once.
#[derive(Clone, Debug)]
pub struct TestModel<'a> {
    machine: &'a Machine,
    station: Station<f64>,
    states: Vec<AxisPosition<f64>>,
    rows: usize,
}

impl<'a> TestModel<'a> {
    /// From the states that the readings list.
    pub fn new(machine: &'a Machine, station: Station<f64>, readings: &Readings) -> Self {
        let rows = readings.rows();
        let mut states = Vec::with_capacity(rows * machine.axes.len());
        for row in 0..rows {
            for (axis, column) in machine.axes.iter().zip(&readings.positions) {
                states.push(AxisPosition::new(axis.kind, column[row]));
            }
        }
        TestModel {
            machine,
            station,
            states,
            rows,
        }
    }

    /// The instrument as set up.
    pub fn station(&self) -> &Station<f64> {
        &self.station
    }

    /// Number of readings.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Scalar coordinates of a reading.
    pub fn coordinates(&self) -> usize {
        self.station.kind().coordinates()
    }

    /// Number of slots: the machine's errors, then the instrument's unknowns.
    pub fn slots(&self) -> usize {
        self.machine.error_slots() + self.station.kind().unknowns().len()
    }

    /// The slots that can move a reading of this test at all: errors of the axes between ball and bed that are applied (a linear axis has no
    /// position errors), and all of the instrument's unknowns. An instrument that holds no workpiece point leaves that side out.
    pub fn effective_slots(&self) -> Vec<usize> {
        let two_sided = self.station.kind().is_two_sided();
        let machine = (0..self.machine.error_slots()).filter(|slot| {
            let axis = slot / crate::chain::ERRORS_PER_AXIS;
            let within = slot % crate::chain::ERRORS_PER_AXIS;
            let applied = self.machine.axes[axis].kind == AxisKind::Rotary || within >= 3;
            applied && (two_sided || axis >= self.machine.workpiece_side)
        });
        machine.chain(self.machine.error_slots()..self.slots()).collect()
    }

    /// Where the axes stand at a row.
    pub fn state(&self, row: usize) -> &[AxisPosition<f64>] {
        let axes = self.machine.axes.len();
        &self.states[row * axes..(row + 1) * axes]
    }

    /// The instrument's unknowns at a row, from slots for which `carried` holds.
    fn unknowns<S: Scalar<Nominal = f64>>(
        &self,
        carried: impl Fn(usize) -> bool,
        slot: impl Fn(usize) -> S,
    ) -> Vec<Option<S>> {
        let range = self.machine.error_slots()..self.slots();
        range.map(|index| carried(index).then(|| slot(index))).collect()
    }

    /// The reading at a row.
    fn read<S: Scalar<Nominal = f64>>(
        &self,
        row: usize,
        bodies: &[BodyErrors<S>],
        unknowns: &[Option<S>],
    ) -> crate::instrument::Reading<S> {
        self.station
            .read(self.machine, self.state(row), bodies, |unknown| unknowns[unknown])
    }

    /// The readings, mm: rows × coordinates.
    pub fn readings_mm(&self, values: &SlotValues) -> Vec<f64> {
        let carried = |slot: usize| !values.is_zero(slot);
        let errors = self.machine.error_slots();
        let machine_varies = (0..errors).any(|slot| values.varies(slot));
        let instrument_varies = (errors..self.slots()).any(|slot| values.varies(slot));
        let bodies_at = |row: usize| self.machine.body_errors(carried, |slot| values.at(slot, row));
        let unknowns_at = |row: usize| self.unknowns(carried, |slot| values.at(slot, row));
        if self.rows == 0 {
            return Vec::new();
        }
        let (mut bodies, mut unknowns) = (bodies_at(0), unknowns_at(0));
        let mut readings = Vec::with_capacity(self.rows * self.coordinates());
        for row in 0..self.rows {
            if machine_varies && row > 0 {
                bodies = bodies_at(row);
            }
            if instrument_varies && row > 0 {
                unknowns = unknowns_at(row);
            }
            let reading = self.read(row, &bodies, &unknowns);
            readings.extend_from_slice(reading.coordinates());
        }
        readings
    }

    /// The readings of a range of rows and their derivatives by `slots`.
    pub fn sensitivities(
        &self,
        values: &SlotValues,
        slots: &[usize],
        rows: std::ops::Range<usize>,
    ) -> Sensitivities {
        let scalars = rows.len() * self.coordinates();
        let mut result = Sensitivities {
            slots: slots.to_vec(),
            readings_mm: Vec::with_capacity(scalars),
            derivatives: vec![Vec::with_capacity(scalars); slots.len()],
        };
        if rows.is_empty() {
            return result;
        }
        let errors = self.machine.error_slots();
        let machine_varies = (0..errors).any(|slot| values.varies(slot));
        let instrument_varies = (errors..self.slots()).any(|slot| values.varies(slot));
        let packs: Vec<&[usize]> = if slots.is_empty() {
            vec![&[]]
        } else {
            slots.chunks(PACK).collect()
        };
        for (pack_index, pack) in packs.iter().enumerate() {
            let carried = |slot: usize| pack.contains(&slot) || !values.is_zero(slot);
            let seeded = |slot: usize, row: usize| -> PackDual {
                let value = values.at(slot, row);
                match pack.iter().position(|seed| *seed == slot) {
                    Some(place) => PackDual::seed(value, place),
                    None => PackDual::constant(value),
                }
            };
            let bodies_at = |row: usize| self.machine.body_errors(carried, |slot| seeded(slot, row));
            let unknowns_at = |row: usize| self.unknowns(carried, |slot| seeded(slot, row));
            let (mut bodies, mut unknowns) = (bodies_at(rows.start), unknowns_at(rows.start));
            for row in rows.clone() {
                if machine_varies && row > rows.start {
                    bodies = bodies_at(row);
                }
                if instrument_varies && row > rows.start {
                    unknowns = unknowns_at(row);
                }
                let reading = self.read(row, &bodies, &unknowns);
                for value in reading.coordinates() {
                    if pack_index == 0 {
                        result.readings_mm.push(value.value);
                    }
                    for place in 0..pack.len() {
                        result.derivatives[pack_index * PACK + place].push(value.by[place]);
                    }
                }
            }
        }
        result
    }
}
