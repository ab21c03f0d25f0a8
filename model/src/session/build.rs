//! Sessions built in memory, with the checks and defaults that a session file has.
//!
//! A ball bar on a five-axis machine. The workpiece ball lies at radius 100 mm on the table, the spindle ball 75 mm
//! above its centre, so that the bar has 125 mm. The axis of C is 10 µm away from its nominal position along X:
//!
//! ```
//! use abbe_model::chain::Machine;
//! use abbe_model::component::ErrorName;
//! use abbe_model::instrument::ballbar::BallBar;
//! use abbe_model::instrument::{InstrumentKind, Station};
//! use abbe_model::session::Session;
//! use abbe_model::session::build::NewTest;
//! use abbe_model::session::columns::Columns;
//!
//! let machine = Machine::from_code("[wCAbYXZt]")?;
//! let mut session = Session::new(machine, InstrumentKind::BallBar);
//! session.noise_mm = Some(0.3e-3);
//! session.unknowns = ["EX0C", "EY0C"].iter().filter_map(|name| ErrorName::parse(name)).collect();
//!
//! let c_rad: Vec<f64> = (0..360).map(|degree| f64::from(degree).to_radians()).collect();
//! let read = |c: &f64| ((0.01 - 100.0 * c.sin()).powi(2) + (100.0 * c.cos()).powi(2) + 75.0_f64.powi(2)).sqrt();
//! let columns = Columns {
//!     observed: c_rad.iter().map(read).collect(),
//!     axes: vec![("C".into(), c_rad)],
//!     ..Columns::default()
//! };
//! let bar = BallBar { workpiece_ball: [0.0, 100.0, 0.0], spindle_ball: [0.0; 3], bar: 125.0 };
//! session.add_test(NewTest::new("C100", Station::BallBar(bar.clone())).at("Z", 75.0).readings(columns.clone()))?;
//! assert_eq!(session.tests[0].readings.as_ref().map(|readings| readings.rows()), Some(360));
//!
//! // Without the position of Z, the bar does not reach from ball to ball.
//! let fault = session.add_test(NewTest::new("again", Station::BallBar(bar)).readings(columns)).unwrap_err();
//! assert!(fault.to_string().contains("a bar of 125.0000 mm cannot reach between its balls"));
//! # Ok::<(), abbe_model::ModelError>(())
//! ```

use std::sync::Arc;

use super::check;
use super::columns::{Columns, number};
use super::expression::Length;
use super::motion::Motion;
use super::{Prior, Session, Test, planned, setups};
use crate::chain::Machine;
use crate::error::ModelError;
use crate::instrument::{Entry, Fault, InstrumentKind, Station};

impl Session {
    /// A session without tests. The errors to be estimated are the defaults of the instrument; the noise is estimated.
    pub fn new(machine: Machine, instrument: InstrumentKind) -> Session {
        Session {
            unknowns: instrument.default_errors(&machine),
            machine: Arc::new(machine),
            constants: Vec::new(),
            instrument,
            noise_mm: None,
            resolution_mm: None,
            effects: Vec::new(),
            tests: Vec::new(),
            socket_distances: Vec::new(),
            tolerance: None,
            clearance: None,
            warnings: Vec::new(),
            about: Vec::new(),
        }
    }

    /// Adds a test, with the checks of a `[[test]]` of a session file. Warnings about a usable test are added to
    /// [`Session::warnings`]. After an error the session is unchanged.
    ///
    /// # Errors
    /// [`ModelError::Session`] if the test cannot be used: its name is taken, a number is out of range, its motion or
    /// its readings do not fit its set-up.
    pub fn add_test(&mut self, test: NewTest) -> Result<(), ModelError> {
        let added = test.checked(self);
        let (test, warnings) = added.map_err(|(message, help)| ModelError::Session { message, help })?;
        self.warnings.extend(warnings);
        self.tests.push(test);
        Ok(())
    }
}

/// A test to be added to a session. What is not stated has the default of a session file.
#[derive(Clone, Debug)]
pub struct NewTest {
    name: String,
    station: Station<f64>,
    priors: Vec<(&'static str, Prior)>,
    setup: Option<String>,
    spindle_setup: Option<String>,
    bar_setup: Option<String>,
    socket: Option<String>,
    motion: Option<Motion>,
    at: Vec<(String, f64)>,
    columns: Option<Columns>,
}

impl NewTest {
    /// A test of this name with the nominal set-up of its instrument, mm.
    pub fn new(name: &str, station: Station<f64>) -> NewTest {
        NewTest {
            name: name.to_string(),
            station,
            priors: Vec::new(),
            setup: None,
            spindle_setup: None,
            bar_setup: None,
            socket: None,
            motion: None,
            at: Vec::new(),
            columns: None,
        }
    }

    /// The prior of every parameter of an object of the instrument, such as `workpiece_ball` or `bar`
    /// ([`InstrumentParameter::thing`](crate::instrument::InstrumentParameter::thing)).
    pub fn prior(mut self, thing: &'static str, prior: Prior) -> Self {
        self.priors.push((thing, prior));
        self
    }

    /// The name shared by tests with the same mounted workpiece ball.
    pub fn setup(mut self, name: &str) -> Self {
        self.setup = Some(name.to_string());
        self
    }

    /// The name shared by tests with the same mounted spindle ball.
    pub fn spindle_setup(mut self, name: &str) -> Self {
        self.spindle_setup = Some(name.to_string());
        self
    }

    /// The name shared by tests with the same assembled bar.
    pub fn bar_setup(mut self, name: &str) -> Self {
        self.bar_setup = Some(name.to_string());
        self
    }

    /// The socket of all readings.
    pub fn socket(mut self, name: &str) -> Self {
        self.socket = Some(name.to_string());
        self
    }

    /// The position at which the test holds an axis, mm or rad.
    pub fn at(mut self, axis: &str, position: f64) -> Self {
        self.at.push((axis.to_string(), position));
        self
    }

    /// The planned motion.
    pub fn motion(mut self, motion: Motion) -> Self {
        self.motion = Some(motion);
        self
    }

    /// The measured readings.
    pub fn readings(mut self, columns: Columns) -> Self {
        self.columns = Some(columns);
        self
    }

    /// The test, and warnings.
    fn checked(self, session: &Session) -> Result<(Test, Vec<String>), Fault> {
        let machine = &session.machine;
        check::name(&self.name, session.tests.iter().map(|test| test.name.as_str()))?;
        let kind = self.station.kind();
        let named = |message: String| format!("test \"{}\": {message}", self.name);
        if kind != session.instrument {
            return Err((
                named(format!(
                    "its instrument is a {}, that of the session a {}",
                    kind.word(),
                    session.instrument.word()
                )),
                "a session has tests of one instrument".into(),
            ));
        }
        check_station(&self.station).map_err(|(message, help)| (named(message), help))?;
        let priors = self.all_priors().map_err(|(message, help)| (named(message), help))?;
        let mut at = vec![0.0; machine.axes.len()];
        let mut listed = vec![false; machine.axes.len()];
        for (name, position) in &self.at {
            let axis = machine.named_axis(name).map_err(|(message, help)| (named(message), help))?;
            number(&format!("the position of {name}"), *position).map_err(|(message, help)| (named(message), help))?;
            at[axis] = *position;
            listed[axis] = true;
        }
        if self.columns.is_none() && matches!(self.motion, None | Some(Motion::List)) {
            return Err((
                named("neither readings nor a motion".into()),
                "add its readings, or the motion of the axes".into(),
            ));
        }
        planned::centre_circle(machine, &self.station, self.motion.as_ref(), &listed, &mut at);
        let readings = match &self.columns {
            Some(columns) => Some(
                columns
                    .readings(machine, kind, self.motion.as_ref(), &at, &listed)
                    .map_err(|(message, help)| (named(message), help))?,
            ),
            None => None,
        };
        let group = |stated: &Option<String>, default: &str| stated.clone().unwrap_or(default.to_string());
        let mut test = Test {
            geometry: self.station.map(|length| Length::Number(*length)),
            priors,
            setup: group(&self.setup, &self.name),
            spindle_setup: group(&self.spindle_setup, kind.spindle_setup(&self.name)),
            bar_setup: group(&self.bar_setup, &self.name),
            socket: self.socket,
            motion: self.motion,
            at_written: vec![None; at.len()],
            at,
            readings: None,
            station: self.station,
            name: self.name,
        };
        let mut warnings = match &readings {
            Some(readings) => check::readings(machine, &test, readings)?,
            None => {
                check::plan(machine, &test)?;
                Vec::new()
            }
        };
        warnings.extend(setups::differing(&session.tests, &test));
        test.readings = readings.map(Arc::new);
        Ok((test, warnings))
    }

    /// The priors of the instrument's parameters, in their order.
    fn all_priors(&self) -> Result<Vec<Prior>, Fault> {
        let kind = self.station.kind();
        let Entry { parameters, free, .. } = kind.entry();
        let prior = |thing: &'static str| if *free == Some(thing) { Prior::Free } else { Prior::Known };
        let mut priors: Vec<Prior> = parameters.iter().map(|parameter| prior(parameter.thing)).collect();
        for (thing, prior) in &self.priors {
            if let Prior::Gaussian(u) = prior
                && !(*u > 0.0 && u.is_finite())
            {
                return Err((
                    format!("the standard uncertainty of `{thing}` is {}", crate::words::number(*u)),
                    "it is greater than 0; `Prior::Known` means exactly known, `Prior::Free` unknown".into(),
                ));
            }
            let mut found = false;
            for (parameter, own) in kind.unknowns().iter().zip(&mut priors) {
                if parameter.thing == *thing {
                    *own = *prior;
                    found = true;
                }
            }
            if !found {
                let mut things: Vec<&str> = kind.unknowns().iter().map(|parameter| parameter.thing).collect();
                things.dedup();
                return Err((format!("a {} has no `{thing}`", kind.word()), format!("it has {}", things.join(", "))));
            }
        }
        Ok(priors)
    }
}

/// Checks the nominal set-up: finite numbers, and lengths above zero.
fn check_station(station: &Station<f64>) -> Result<(), Fault> {
    let numbers = std::cell::RefCell::new(Vec::new());
    station.map(|value| numbers.borrow_mut().push(*value));
    for value in numbers.into_inner() {
        number("a coordinate of the set-up", value)?;
    }
    match station.invalid_length() {
        None => Ok(()),
        Some(fault) => Err((fault, "state the calibrated length, mm".into())),
    }
}
