//! Reference models: the study's theory in its corrected form, to hold the plant and
//! the controller against. `docs/MODEL.md` leads from the printed equations to these.
//!
//! One file a stage, in the study's own order, each stage driven by the one before:
//! [`solid`] is the rubber, [`collision`] the force of a crossing, [`impact`] the stress
//! waves that it sends through the tread, [`vibration`] the motion of the arm on
//! [`beam`]. A crossing is described once, by a [`Case`]. Nothing here is fitted beyond the three numbers of the tread
//! that `interstage::rig` names as fitted.

pub mod beam;
mod case;
pub mod collision;
mod error;
pub mod impact;
pub mod solid;
pub mod vibration;

pub use case::{Case, Resolution};
pub use error::ReferenceError;
