//! Reference models: the study's theory in its corrected form, to hold the plant and
//! the controller against.

pub mod beam;
