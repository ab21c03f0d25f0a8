//! Drivers: the independent variable of an effect. Each file holds one; the registry below lists them.
//!
//! A driver gives its values in a test in numbers, for a fit, and in symbols, for a printed equation.

mod kind;
mod quantity;
mod reference;
mod sample;
mod unit;

pub use kind::{DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
pub use quantity::DriverQuantity;
pub use reference::Reference;
pub use sample::{DriverPart, DriverSample};
pub use time::SECONDS_PER_HOUR;
pub use unit::DriverUnit;

use std::fmt;

use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::scalar::Nominal;

/// Declares the modules, the enumeration and the list of all drivers.
macro_rules! drivers {
    ($($visibility:vis $module:ident: $driver:ident $(($name:ident))? => $kind:expr,)+) => {
        $($visibility mod $module;)+

        /// The independent variable of an effect.
        #[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Driver {
            $(
                #[doc = concat!("`", stringify!($module), "`")]
                $driver $((drivers!(@text $name)))?,
            )+
        }

        /// All drivers.
        pub const DRIVERS: &[&Entry] = &[$(&$module::ENTRY,)+];

        impl Driver {
            /// What is particular to the driver.
            pub fn kind(&self) -> Box<dyn DriverKind + '_> {
                match self {
                    $(Driver::$driver $(($name))? => Box::new($kind),)+
                }
            }

            /// The state of the driver at a reading in symbols; `named` gives the symbol of a quantity. `None` if the
            /// effect lacks an axis that the driver needs.
            pub fn symbols<N: Nominal>(
                &self,
                input: &SymbolInput<'_, N>,
                named: &impl Fn(DriverQuantity) -> N,
            ) -> Option<DriverSample<N>> {
                match self {
                    $(Driver::$driver $(($name))? => $kind.symbols(input, named),)+
                }
            }
        }
    };
    (@text $name:ident) => { String };
}

drivers! {
    none: None => none::NoDriver,
    axis: Axis(name) => axis::AxisDriver(name),
    time: Time => time::Time,
    pub column: Column(name) => column::Column(name),
    gravity: Gravity => gravity::Gravity { at: None },
    gravity_at: GravityAt(name) => gravity::Gravity { at: Some(name) },
    speed_squared: SpeedSquared => speed_squared::SpeedSquared,
}

impl Driver {
    /// Parses the word of a driver, such as `time`, or the name of a column, such as `spindle_temperature_c`; any other
    /// text is the name of an axis.
    pub fn parse(text: &str) -> Driver {
        match DRIVERS.iter().find(|entry| entry.word == Some(text)) {
            Some(entry) => (entry.driver)(text),
            None if gravity_at::named(text).is_some() => (gravity_at::ENTRY.driver)(text),
            None if column::is_name(text) => Driver::Column(text.to_string()),
            None => Driver::Axis(text.to_string()),
        }
    }

    /// As [`Driver::parse`], on a machine: an axis of that name comes before a column.
    pub fn parse_on(machine: &Machine, text: &str) -> Driver {
        match Driver::parse(text) {
            Driver::Column(name) if machine.axis_index(&name).is_some() => Driver::Axis(name),
            driver => driver,
        }
    }

    /// The axis whose position the driver is; `None` for other drivers.
    pub fn axis(&self, machine: &Machine) -> Option<usize> {
        match self {
            Driver::Axis(name) => machine.axis_index(name),
            _ => None,
        }
    }

    /// The kind of the axis whose position the driver is.
    pub fn axis_kind(&self, machine: &Machine) -> Option<AxisKind> {
        self.axis(machine).map(|axis| machine.axes[axis].kind)
    }

    /// The kind of the axis that the driver is about: the one that it names, or else that of the component.
    pub fn kind_of_axis(&self, machine: &Machine, component_axis: Option<usize>) -> Option<AxisKind> {
        let axis = match self {
            Driver::Axis(name) => machine.axis_index(name),
            _ => component_axis,
        };
        axis.map(|axis| machine.axes[axis].kind)
    }

    /// The words of the drivers that are neither an axis nor none, in files.
    pub fn words() -> Vec<&'static str> {
        let words = DRIVERS.iter().filter_map(|entry| entry.word);
        words.filter(|word| Driver::parse(word) != Driver::None).collect()
    }
}

impl fmt::Display for Driver {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let own = |entry: &&&Entry| entry.word.is_some_and(|word| (entry.driver)(word) == *self);
        let word = DRIVERS.iter().find(own).and_then(|entry| entry.word);
        match self {
            Driver::Axis(name) | Driver::Column(name) => formatter.write_str(word.unwrap_or(name)),
            Driver::GravityAt(name) => formatter.write_str(&gravity_at::word(name)),
            _ => formatter.write_str(word.unwrap_or_default()),
        }
    }
}

/// Suffixes of the keys of all drivers' numbers, each once, in the order of the registry.
pub(crate) fn unit_suffixes() -> Vec<&'static str> {
    let mut suffixes = Vec::new();
    for suffix in DRIVERS.iter().flat_map(|entry| entry.units).flat_map(|unit| unit.suffixes()) {
        if !suffixes.contains(&suffix) {
            suffixes.push(suffix);
        }
    }
    suffixes
}
