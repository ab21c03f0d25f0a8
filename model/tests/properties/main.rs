//! What holds for every machine, whatever its axes and errors.

mod chain;
mod expressions;
mod machines;
mod readings;
mod session;
mod shapes;
