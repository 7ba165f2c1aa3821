//! Reference models: the study's theory in its corrected form, to hold the plant and
//! the controller against. `docs/MODEL.md` leads from the printed equations to these.
//!
//! One file a stage, in the study's own order, each stage driven by the one before:
//! [`rubber`] is the material, [`collision`] the force of a crossing, [`impact`] the stress
//! waves that it sends through the tread, [`vibration`] the motion of the arm, a [`beam`].
//! A [`ReferenceCase`] describes a crossing. Only the three numbers of the tread that
//! `interstage::rig` names as fitted are fitted.

pub(crate) mod beam;
mod case;
pub(crate) mod collision;
pub(crate) mod impact;
pub(crate) mod rubber;
pub(crate) mod vibration;

pub(crate) use case::ReferenceCase;
pub(crate) use rubber::Rubber;
