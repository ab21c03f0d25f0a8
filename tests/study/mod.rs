//! How often trace is right: sessions from the plant, of which it gets the files and nothing else.
//!
//! By default a small seeded sample is run and bounds are asserted that hold with the sampling error of the counts. The figures in
//! `docs/trace.md` are those of
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
