//! How often trace is right: sessions from the plant, of which it gets the files and nothing else.
//!
//! A study takes minutes to hours and is made where `ABBE_STUDY` gives the number of sessions a kind; the bounds that are asserted are those that the
//! program has to reach, within the sampling error of the counts. `docs/trace.md` says which it reaches. The figures there are those of
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
