//! How often trace is right: sessions from the plant, of which it gets the files and nothing else.
//!
//! The bounds that are asserted are those that the program has to reach, within the sampling error of the counts. Every run of the tests makes a few
//! sessions of each kind; the figures in `docs/development/validation.md` are those of
//!
//! ```text
//! ABBE_STUDY=400 cargo test --profile checked --test main study -- --nocapture --test-threads 1
//! ```

mod judging;
mod rates;
mod sessions;

mod clean;
mod outside;
mod pairs;
mod single;
