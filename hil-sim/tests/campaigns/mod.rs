//! Faults, holds and the stress of plant and controller.

mod faults;
mod holds;
mod hostile;
mod refine;
mod settle;
mod stress;
