//! The virtual rig: a physical plant for the controller, the scenarios it is run
//! in, and what is shown of a run.

pub mod capture;
pub mod cli;
pub mod compare;
pub mod export;
pub mod faults;
pub mod firmware;
pub mod hil;
pub mod identify;
pub mod injector;
pub mod live;
pub mod log;
pub mod montecarlo;
pub mod params;
pub mod plant;
pub mod probe;
pub mod progress;
pub mod provision;
pub mod record;
pub mod replay;
pub mod report;
pub mod scenario;
pub mod sil;
pub mod stress;
pub mod table;
pub mod testing;
