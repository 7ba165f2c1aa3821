//! Stress of plant and controller: whether numbers stay finite, bounded and honest at
//! the ends of every range.

pub mod cases;
mod drive;
pub mod hostile;
pub mod plant;
pub mod primitives;
pub mod refine;
mod roll;
pub mod settle;
