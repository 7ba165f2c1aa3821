//! The virtual rig: a physical plant for the controller, the scenarios it is run
//! in, and what is shown of a run.

pub mod record;
