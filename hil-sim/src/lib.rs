//! The virtual rig: a physical plant for the controller, the scenarios it is run
//! in, and what is shown of a run.

pub mod bench;
#[cfg(feature = "board")]
pub mod board;
pub mod capture;
pub mod cli;
pub mod compare;
pub mod constants;
pub mod docs;
pub mod export;
pub mod faults;
pub mod firmware;
pub mod hil;
pub mod identify;
pub mod live;
pub mod log;
pub mod montecarlo;
#[cfg(feature = "board")]
pub mod panics;
pub mod paper;
pub mod params;
pub mod plant;
pub mod probe;
pub mod progress;
pub mod provision;
pub mod record;
pub mod reference;
pub mod replay;
pub mod report;
#[cfg(feature = "board")]
pub mod resets;
pub mod scenario;
pub mod sil;
pub mod stress;
pub mod table;
pub mod testing;
