//! Stress of plant and controller: whether numbers stay finite, bounded and honest at
//! the ends of every range.

pub mod cases;
mod drive;
pub mod plant;
pub mod primitives;
mod roll;
