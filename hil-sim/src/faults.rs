//! The campaign of faults: every fault at random instants of random rigs, and the judgement
//! of what became of it.
//!
//! What is found, what is tolerated and what is neither: `docs/SAFETY.md`.

pub mod campaign;
pub mod judge;
pub mod sets;
