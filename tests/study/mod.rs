//! Studies of the reliability of trace: it reads only the files of sessions that the plant simulates.
//!
//! The tests assert the target rates within the sampling error of the counts. By default they simulate a few sessions
//! of each kind. The figures in `docs/development/validation.md` are those of
//!
//! ```text
//! ABBE_STUDY=400 cargo test --profile checked --test main study -- --nocapture --test-threads 1
//! ```

mod judging;
mod rates;
mod sessions;

mod carried;
mod clean;
mod columns;
mod fleet;
mod gate;
mod numbers;
mod outside;
mod pairs;
mod power;
mod robots;
mod single;
mod speed;
