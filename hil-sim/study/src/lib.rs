//! The published study beside the virtual rig: its models in corrected form, its figures
//! and claims, and run time against error.

pub mod bench;
pub mod cli;
pub mod figure;
pub mod figure_svg;
pub mod paper;
pub mod reference;
