//! Properties that hold for every machine, axes and errors.

mod chain;
mod expressions;
mod machines;
mod readings;
mod session;
mod shapes;
