//! Evaluation of the chain, over symbols for the equation and over numbers for its check.

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, BodyErrors, Machine, MachineState};
use abbe_model::frames::{Point, SinCos};
use abbe_model::instrument::ballbar;
use abbe_model::instrument::probe::ProbeGeometry;
use abbe_model::scalar::{Nominal, Scalar};

use crate::constant::ROUNDING;
use crate::effect::AxisStates;
use crate::error;
use crate::subject::{Source, Subject};
use crate::variable::Variable;

/// All quantities from which a reading is computed.
pub(crate) struct Run<'m, S: Scalar> {
    pub(crate) machine: &'m Machine,
    pub(crate) subject: Subject<S::Nominal>,
    pub(crate) state: Vec<AxisPosition<S::Nominal>>,
    pub(crate) errors: Vec<BodyErrors<S>>,
    unknowns: Vec<(usize, S)>,
    /// The contributions to each slot, machine errors before instrument parameters: indices of parameters, and their
    /// factors.
    slots: Vec<Vec<Contribution<S::Nominal>>>,
}

/// A parameter in a slot: its index, and its basis function if it is a coefficient of an effect.
type Contribution<N> = (usize, Option<N>);

impl<'m, S: Scalar> Run<'m, S> {
    /// `nominal` gives lengths and positions of moving axes, `small` the parameters by index.
    pub(crate) fn new(
        machine: &'m Machine,
        source: &impl Source,
        parameters: &[Variable],
        nominal: &impl Fn(Variable) -> S::Nominal,
        small: &impl Fn(usize) -> S,
    ) -> Result<Self, Diagnostic> {
        let length = |name: &str| nominal(Variable::Length(name.to_string()));
        let subject = source.subject(&length);
        let mut held = Vec::with_capacity(machine.axes.len());
        let mut state = Vec::with_capacity(machine.axes.len());
        // Only rotary axes are followed.
        let turned = |axis: &str| nominal(Variable::Position { axis: axis.to_string(), kind: AxisKind::Rotary });
        for axis in &machine.axes {
            let held_position = source.held(&axis.name, &length, &turned);
            held.push(held_position.is_some());
            let symbol = || nominal(Variable::Position { axis: axis.name.clone(), kind: axis.kind });
            state.push(match held_position {
                Some(position) if source.held_symbol(&axis.name).is_none() => at_rest(axis.kind, position),
                _ => AxisPosition::new(axis.kind, symbol()),
            });
        }
        let unknowns = subject.unknowns();
        let movement = AxisStates { machine, state: &state, held: &held };
        let mut slots = vec![Vec::new(); machine.error_slots() + unknowns.len()];
        let mut basis = Vec::new();
        for (index, parameter) in parameters.iter().enumerate() {
            match parameter {
                Variable::Error(name) => {
                    let slot = machine.error_slot(name);
                    let slot = slot.ok_or_else(|| error::no_axis(machine, name.to_string(), &name.axis))?;
                    slots[slot].push((index, None));
                }
                Variable::Instrument(unknown) => {
                    let slot = unknowns.iter().position(|known| known == unknown);
                    let slot = slot.ok_or_else(|| error::no_parameter(parameter.meaning()))?;
                    slots[machine.error_slots() + slot].push((index, None));
                }
                Variable::Coefficient(coefficient) => {
                    let effect = &coefficient.effect;
                    // The coefficients of one effect are consecutive.
                    if coefficient.index == 0 {
                        basis.clear();
                        effect.shape.basis(&movement.sample(effect, nominal)?, &mut basis);
                    }
                    for part in effect.parts(machine) {
                        let mut of_part = basis.clone();
                        part.basis(&mut of_part);
                        let own = of_part[coefficient.index];
                        for (slot, factor) in movement.slots(&part.component, unknowns, nominal) {
                            let share = factor.map_or(own, |factor| own * factor);
                            slots[slot].push((index, Some(share)));
                        }
                    }
                }
                Variable::Length(_) | Variable::Position { .. } | Variable::Driver(_) => {}
            }
        }
        let mut run = Run { machine, subject, state, errors: Vec::new(), unknowns: Vec::new(), slots };
        run.seed(small);
        Ok(run)
    }

    /// Changes the values of the parameters and keeps the nominal quantities.
    pub(crate) fn seed(&mut self, small: &impl Fn(usize) -> S) {
        let zero = S::nominal(S::Nominal::constant(0.0));
        let value = |slot: usize| in_slot(&self.slots[slot], small);
        self.errors = self.machine.body_errors(|slot| !self.slots[slot].is_empty(), |slot| value(slot).unwrap_or(zero));
        let first = self.machine.error_slots();
        let unknowns = (first..self.slots.len()).filter_map(|slot| Some((slot - first, value(slot)?)));
        self.unknowns = unknowns.collect();
    }

    /// The factor of an effect's coefficient in each slot that it changes.
    pub(crate) fn bases(&self, index: usize) -> impl Iterator<Item = S::Nominal> {
        let shares = self.slots.iter().flatten();
        shares.filter(move |(parameter, _)| *parameter == index).filter_map(|(_, basis)| *basis)
    }

    /// The errors and instrument parameters that effects determine, and their values.
    pub(crate) fn driven_errors(&self, small: &impl Fn(usize) -> S) -> Vec<(Variable, S)> {
        let first = self.machine.error_slots();
        let mut driven_errors = Vec::new();
        for (slot, shares) in self.slots.iter().enumerate() {
            let effects_alone = !shares.is_empty() && shares.iter().all(|(_, basis)| basis.is_some());
            if let (true, Some(value)) = (effects_alone, in_slot(shares, small)) {
                let variable = match slot.checked_sub(first) {
                    None => Variable::Error(self.machine.error_name(slot)),
                    Some(index) => Variable::Instrument(self.subject.unknowns()[index]),
                };
                driven_errors.push((variable, value));
            }
        }
        driven_errors
    }

    /// The instrument parameter in a slot, if included.
    pub(crate) fn unknown(&self, slot: usize) -> Option<S> {
        let found = self.unknowns.iter().find(|(known, _)| *known == slot);
        found.map(|(_, value)| *value)
    }

    /// The length error of the bar and the gain error of its sensor, if a bar is read and they are included.
    pub(crate) fn bar_parameters(&self) -> [Option<S>; 2] {
        let is_read = self.subject.bar().is_some();
        [ballbar::BAR, ballbar::GAIN].map(|slot| self.unknown(slot).filter(|_| is_read))
    }

    /// The geometry of a probe's reading; `None` for any other subject.
    pub(crate) fn probe_geometry(&self) -> Option<ProbeGeometry<S>> {
        let probe = self.subject.probe()?;
        let at = MachineState { machine: self.machine, state: &self.state, errors: &self.errors };
        Some(probe.geometry(at, |slot| self.unknown(slot)))
    }

    /// The coordinates of the reading.
    pub(crate) fn read(&self) -> Vec<S> {
        self.subject.read(self.machine, &self.state, &self.errors, |slot| self.unknown(slot))
    }

    /// Computes the reading from its coordinate groups: the bar, or the stylus and step of a probe. `None` if the
    /// reading is the groups themselves.
    pub(crate) fn reading_of_groups(&self, groups: &[S]) -> Option<S> {
        if let Some(geometry) = self.probe_geometry() {
            return Some(with_groups(&geometry, groups).distance());
        }
        self.subject.bar()?;
        let [x, y, z] = [groups[0], groups[1], groups[2]];
        Some(self.length_reading((x * x + y * y + z * z).sqrt()))
    }

    /// The reading of a ball bar from the distance between its balls, with the parameters of the bar; the distance
    /// itself for any other subject.
    pub(crate) fn length_reading(&self, distance: S) -> S {
        let Some(bar) = self.subject.bar() else {
            return distance;
        };
        let [error, gain] = self.bar_parameters();
        let length = match error {
            Some(error) => distance - error,
            None => distance,
        };
        match gain {
            Some(gain) => length + gain * (distance - bar.bar),
            None => length,
        }
    }
}

/// The position of an axis that does not move. Its sine and cosine are 0, ±½ and ±1 where they are so to rounding: the
/// cosine of 90° is no 6e-17.
fn at_rest<N: Nominal>(kind: AxisKind, position: N) -> AxisPosition<N> {
    let plain = |turn: N| {
        let known = turn.known().map(|value| (2.0 * value).round() / 2.0);
        let near = known.filter(|near| turn.known().is_some_and(|value| (value - near).abs() < ROUNDING));
        near.map_or(turn, N::constant)
    };
    let position = AxisPosition::new(kind, position);
    let SinCos { sin, cos } = position.turn;
    AxisPosition { turn: SinCos { sin: plain(sin), cos: plain(cos) }, ..position }
}

/// The sum of the contributions to a slot.
fn in_slot<S: Scalar>(shares: &[Contribution<S::Nominal>], small: &impl Fn(usize) -> S) -> Option<S> {
    let value = |(index, basis): &Contribution<S::Nominal>| match basis {
        Some(basis) => small(*index) * *basis,
        None => small(*index),
    };
    shares.iter().map(value).reduce(|sum, value| sum + value)
}

/// Replaces the six coordinates of stylus and step.
pub(crate) fn with_groups<S: Scalar>(geometry: &ProbeGeometry<S>, groups: &[S]) -> ProbeGeometry<S> {
    ProbeGeometry {
        stylus: Point(std::array::from_fn(|i| groups[i])),
        step: Point(std::array::from_fn(|i| groups[i + 3])),
        ..*geometry
    }
}
