//! The published study beside the virtual rig: its models in corrected form, its figures
//! and claims, and run time against error.

pub mod bench;
pub mod cli;
mod figure;
pub mod paper;
mod reference;
