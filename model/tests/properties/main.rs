//! Properties that hold for every machine, axes and errors.

mod chain;
mod drawn_shapes;
mod expressions;
mod machines;
mod readings;
mod shapes;
