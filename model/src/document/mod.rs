//! The documents of users: every key of every file, once.
//!
//! A document is a value of serde types. Their fields are the keys, and their doc comments are the documentation and the
//! schema. It comes from a TOML file, from JSON or from a Python dict, by way of one tree of values ([`node`]). The crate
//! `abbe-files` reads the tree from a text and turns the document into the domain of [`session`](crate::session). A fault
//! has the path of keys that leads to it ([`fault`]), by which that crate finds its place in the file. [`of_domain`] goes
//! from the domain to documents, [`mod@print`] writes a document, and [`edit`] edits the text of a user.

#![allow(rustdoc::broken_intra_doc_links, reason = "the schema has the same texts, with `[machine]` for a table")]

pub mod composed;
mod de;
pub mod edit;
pub mod effect;
pub mod fault;
mod kind;
pub mod layout;
pub mod machine;
pub mod measurement;
pub mod movement;
pub mod node;
pub mod of_domain;
pub mod print;
pub mod schema;
pub mod session;
pub mod tolerance;
pub mod value;

pub use de::{LIST, from_node};
pub use fault::Fault;
