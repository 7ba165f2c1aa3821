//! Impact: stress waves in the tread between corner and hub.
//!
//! A rod of the rubber as long as the tread is thick, loaded on its face, bounded by the
//! hub: positive waves run inwards, negative ones come back (33-36). The study writes
//! Kelvin-Voigt's equation (37) and attenuation (40) under the three-parameter law (38);
//! here it is that law throughout, `rho (u_tt + p_1 u_ttt) = q_0 u_xx + q_1 u_xxt`:
//! [`dispersion`] over frequency, [`rod`] over time.

pub mod dispersion;
mod history;
pub mod rod;
pub mod rubber;

pub use history::{hub_reflection, stress};
pub use rubber::Rubber;
