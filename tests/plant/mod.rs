//! The plant: an independent simulator for tests, which shares no code with `abbe-model`.
//!
//! Motions are exact rigid motions with unit quaternions, errors are displaced bodies, and no formula is of first
//! order. A [`Recipe`] makes a [`SimulatedSession`]: the files that Abbe reads, which declare no effect, and the true
//! values. An [`Oracle`] knows the effect and gives bounds for the results.
//!
//! ```text
//! let effect = Injected::new(EZC, Driver::Axis(AxisName::C), Shape::Harmonic { order: 3, phase_deg: 0.0 }, 2.0);
//! let recipe = Recipe::new(Kind::Rotary, 7).with(effect);
//! let draw = recipe.draw();
//! draw.write(folder)?;
//! let oracle = Oracle::new(&recipe);                      // once for a kind of session
//! oracle.smallest_significant_amplitude(&effect, 1.96);   // µm
//! oracle.alias_class(&effect, 0.95, 2.0);                 // EZC order 3, EAC order 2, …
//! oracle.heldout_rms_um(&draw, &draw.truth.effects);      // the lower bound of the held-out error
//! ```
#![allow(dead_code, unused_imports)] // a test binary uses a part of it

pub mod chain;
pub mod component;
pub mod effect;
pub mod families;
pub mod files;
pub mod fitting;
pub mod kind;
pub mod machine;
pub mod naming;
pub mod noise;
pub mod oracle;
pub mod plan;
pub mod pose;
pub mod recipe;
pub mod robot;
pub mod rtest;
pub mod scan;
pub mod schedule;
pub mod spindle;
pub mod whitening;

pub use component::{AxisName, Cartesian, Component, Freedom};
pub use effect::{Decay, Driver, Injected, Profile, Shape};
pub use families::Family;
pub use kind::Kind;
pub use naming::{EffectLabel, from_name, named};
pub use noise::Noise;
pub use oracle::{Alias, Oracle};
pub use plan::Plan;
pub use recipe::{Recipe, SimulatedSession, Truth};
pub use scan::{Detected, Scan};
pub use spindle::Spindle;

mod check_effects;
mod check_frames;
mod check_oracle;
mod check_sample;
