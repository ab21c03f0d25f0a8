//! Properties that hold for every machine and session that files can state.

#[path = "../../../model/tests/properties/drawn_shapes.rs"]
mod drawn_shapes;
#[path = "../../../model/tests/properties/machines.rs"]
mod machines;

mod session;
