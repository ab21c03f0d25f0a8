//! A planned session: tests, parameters with their priors, all instants, and the reading at each.

use super::component::{Cartesian, Component, unit_size};
use super::effect::Injected;
use super::kind::{BAR_U_UM, Kind, SPINDLE_BALL_U_UM};
use super::machine::{Displacement, Machine};
use super::schedule::{Instant, Test, instants};

/// A parameter: a constant error of a component in some of the tests.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// `EY0A`, `workpiece_ball[P1].x`, `spindle_ball[A100].z`, `bar[C150]`.
    pub id: String,
    /// The component.
    pub component: Component,
    /// For each test, whether the parameter belongs to it.
    pub in_test: Vec<bool>,
    /// Standard uncertainty of the set-up, µm; `None` for an error of the machine.
    pub prior_u_um: Option<f64>,
}

/// A planned session: its tests, its parameters, all instants.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The kind of session.
    pub kind: Kind,
    /// Whether all tests share one mount of the spindle ball and one bar calibration, as the session file then states.
    pub shared_mounts: bool,
    /// The machine.
    pub machine: Machine,
    /// The tests.
    pub tests: Vec<Test>,
    /// Errors of the machine first, then set-up parameters.
    pub unknowns: Vec<Unknown>,
    /// Every reading, in the order of time.
    pub instants: Vec<Instant>,
}

impl Plan {
    /// A plan of this kind with readings `step_deg` apart.
    pub fn new(kind: Kind, step_deg: f64, shared_mounts: bool) -> Plan {
        let machine = Machine::default();
        Plan::of_tests(kind, machine, kind.tests(step_deg), shared_mounts)
    }

    /// A plan of given tests.
    pub fn of_tests(kind: Kind, machine: Machine, tests: Vec<Test>, shared_mounts: bool) -> Plan {
        let instants = instants(&machine, &tests);
        let mut unknowns: Vec<Unknown> = kind
            .unknowns()
            .into_iter()
            .map(|component| Unknown {
                id: component.to_string(),
                component,
                in_test: vec![true; tests.len()],
                prior_u_um: None,
            })
            .collect();
        let mut add = |component: Component, letter: &str, name: &str, owners: &[String], u_um: f64| {
            let mut listed: Vec<&String> = Vec::new();
            for owner in owners {
                if listed.contains(&owner) {
                    continue;
                }
                listed.push(owner);
                unknowns.push(Unknown {
                    id: format!("{name}[{owner}]{letter}"),
                    component,
                    in_test: owners.iter().map(|other| other == owner).collect(),
                    prior_u_um: Some(u_um),
                });
            }
        };
        let setups: Vec<String> = tests.iter().map(|test| test.setup.clone()).collect();
        let mounts: Vec<String> =
            tests.iter().map(|test| if shared_mounts { "S1".to_string() } else { test.name.clone() }).collect();
        let bars: Vec<String> =
            tests.iter().map(|test| if shared_mounts { bar_setup(test) } else { test.name.clone() }).collect();
        for (i, letter) in [".x", ".y", ".z"].into_iter().enumerate() {
            let axis = Cartesian(i);
            add(Component::WorkpieceBall(axis), letter, "workpiece_ball", &setups, kind.workpiece_ball_u_um());
            add(Component::SpindleBall(axis), letter, "spindle_ball", &mounts, SPINDLE_BALL_U_UM);
        }
        add(Component::Bar, "", "bar", &bars, BAR_U_UM);
        Plan { kind, shared_mounts, machine, tests, unknowns, instants }
    }

    /// The reading without noise and rounding, mm; `values` are those of [`Plan::unknowns`] in µm and arcsec.
    pub fn reading_mm(&self, instant: &Instant, values: &[f64], effects: &[Injected]) -> f64 {
        let mut displacement = Displacement::default();
        for (unknown, value) in self.unknowns.iter().zip(values) {
            if unknown.in_test[instant.test] {
                let size = unit_size(unknown.component.unit());
                displacement.add(unknown.component, value * size);
            }
        }
        for effect in effects {
            effect.displace(instant, &mut displacement);
        }
        let stated = &self.tests[instant.test].stated;
        self.machine.reading_mm(&instant.commanded, stated, &displacement)
    }
}

/// The name of a shared bar calibration: bars of one length are one bar.
pub fn bar_setup(test: &Test) -> String {
    format!("B{}", test.stated.bar_mm)
}
