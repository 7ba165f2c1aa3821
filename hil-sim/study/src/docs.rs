//! The figures of the reference models, in `docs/MODEL.md`.

pub mod blocks;
pub mod model;
