//! A menu made ready: the information of every entry, evaluated once.

use rayon::prelude::*;

use super::information::{Root, Shared, sum};
use super::linear::Linearisation;
use super::menu::{Entry, Menu};
use crate::error::IdentifyError;
use crate::parameters::{Parameter, Role};
use crate::problem::Problem;

/// A menu made ready: the information of every entry on the shared unknowns.
pub struct Prepared {
    /// The shared unknowns.
    pub shared: Shared,
    /// The plan's own information.
    pub base: Root,
    /// The entries.
    pub entries: Vec<Ready>,
}

/// An entry with its information.
pub struct Ready {
    /// The entry; its name says what is left mounted.
    pub entry: Entry,
    /// Its information.
    pub root: Root,
}

impl Prepared {
    /// The menu of a problem whose folds are its tests, at the unknowns' values `beta`. `asked` are the unknowns that the goal is about.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn new(
        problem: &Problem<'_>,
        beta: &[f64],
        entries: Vec<Entry>,
        menu: &Menu,
        asked: &[usize],
    ) -> Result<Prepared, IdentifyError> {
        let list = &problem.parameters.list;
        let kept: Vec<usize> = (0..list.len())
            .filter(|j| !asked.contains(j) && may_be_shared(problem, &list[*j]))
            .collect();
        let shared = Shared::of(problem, &kept, asked);
        let linear = Linearisation::of(problem, beta)?;
        let base = shared.root_of(problem, &linear)?;
        let ready: Vec<Vec<Ready>> = entries
            .into_par_iter()
            .map(|entry| ready(problem, &shared, entry, menu))
            .collect::<Result<_, IdentifyError>>()?;
        Ok(Prepared {
            shared,
            base,
            entries: ready.into_iter().flatten().collect(),
        })
    }

    /// The plan with some entries added.
    pub fn with(&self, entries: &[usize]) -> Root {
        entries.iter().fold(self.base.clone(), |root, entry| {
            sum(root.as_ref(), self.entries[*entry].root.as_ref())
        })
    }

    /// The entry after which a figure (the smaller the better) stands best, and the figures of all.
    pub fn best(&self, root: &Root, figure: &(impl Fn(&Root) -> f64 + Sync)) -> Option<(usize, Vec<f64>)> {
        let figures: Vec<f64> = self
            .entries
            .par_iter()
            .map(|ready| figure(&sum(root.as_ref(), ready.root.as_ref())))
            .collect();
        let best = (0..figures.len()).min_by(|a, b| figures[*a].total_cmp(&figures[*b]))?;
        Some((best, figures))
    }
}

/// Whether a new test can share an unknown: errors and effects, a mounted workpiece ball, the spindle ball of the last test, the sensor.
fn may_be_shared(problem: &Problem<'_>, parameter: &Parameter) -> bool {
    if parameter.role != Role::Setup {
        return true;
    }
    let last = problem
        .tests
        .last()
        .map_or("", |test| test.spindle_setup.as_str());
    parameter.id.starts_with("workpiece_ball.")
        || (parameter.id.starts_with("spindle_ball.") && parameter.id.ends_with(&format!("[{last}]")))
        || !parameter.id.contains('[')
}

/// The information of an entry, with its own spindle ball and, where the menu allows it, with the one that is left mounted.
fn ready(
    problem: &Problem<'_>,
    shared: &Shared,
    entry: Entry,
    menu: &Menu,
) -> Result<Vec<Ready>, IdentifyError> {
    let mut variants = vec![entry];
    let last = problem.tests.last().filter(|_| menu.keep_spindle_ball);
    if let Some(last) = last
        && last.station.tool_point_mm() == variants[0].test.station.tool_point_mm()
    {
        let mut left = variants[0].clone();
        left.test.spindle_setup = last.spindle_setup.clone();
        left.name
            .push_str(&format!(", spindle ball left as in {}", last.name));
        variants.push(left);
    }
    let weight = (menu.thin.max(1) as f64).sqrt();
    variants
        .into_iter()
        .map(|entry| {
            let mut session = problem.session.clone();
            session.tests = vec![entry.test.clone()];
            session.effects = Vec::new();
            session.socket_distances = Vec::new();
            let mut noise = problem.noise.clone();
            noise.sigma_mm /= weight;
            let mut alone = Problem::new(&session, noise, 0)?;
            alone.origin = problem.origin;
            for effect in &problem.parameters.effects {
                alone.add_effect(effect)?;
            }
            let root = shared.root_of_test(&alone)?;
            Ok(Ready { entry, root })
        })
        .collect()
}
