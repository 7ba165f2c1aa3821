//! Faults on purpose: what can be broken and when, the tampering between sensors,
//! controller, actuators and plant, the judgement of a run that was tampered with, and the
//! campaign over all of them.
//!
//! What is found, what is borne and what is neither: `docs/SAFETY.md`.

pub mod campaign;
mod catalogue;
mod hardware;
mod injection;
pub mod judge;
mod sensors;
pub mod sets;
mod tamper;

pub use catalogue::{CATALOGUE, Entry, entry};
pub use hardware::HARDWARE;
pub use injection::{From, Injection, Kind, Target};
pub use tamper::Tamper;
