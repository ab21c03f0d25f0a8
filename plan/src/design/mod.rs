//! Optimal design: which candidates, tests or poses, tell most beside what is known.
//!
//! A candidate is a block of whitened sensitivities `J` to the shared parameters: the rows of a reading, or a square
//! root of the information of a test. With the information `M` of what is chosen, its square root `R` and `M = RᵀR`,
//!
//! ```text
//! M + JᵀJ,        z = R⁻ᵀJᵀ,        C − C Jᵀ (I + zᵀz)⁻¹ J C
//! ```
//!
//! - [`information`]: square roots of information on named parameters;
//! - [`goal`]: what a design makes small, for all kinds of candidates;
//! - [`exchange`]: greedy choice and exchange; [`bound`]: how far a design is from the best one.

pub mod bound;
pub mod exchange;
pub mod goal;
pub mod information;

pub use exchange::Design;
pub use goal::Goal;
