//! The virtual rig: a physical plant for the controller, the scenarios of its runs, and the
//! reports on them.

pub mod bringup;
pub mod campaign;
pub mod cli;
pub(crate) mod compare;
pub mod envelope;
pub mod faults;
pub mod files;
pub mod firmware;
pub mod hil;
pub mod identify;
pub mod injector;
pub mod live;
pub mod montecarlo;
pub(crate) mod oracle;
pub mod params;
pub mod plant;
pub mod probe;
pub mod progress;
pub mod provision;
pub mod record;
pub mod replay;
pub mod report;
pub mod rollout;
pub mod scenario;
pub mod session;
pub mod stress;
pub(crate) mod sweep;
pub mod table;
pub mod testing;
