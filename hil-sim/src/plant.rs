//! The rig as physics, in f64; lengths in mm, forces in N, times in s. It knows
//! nothing of the controller's model.

pub(crate) mod actuators;
pub mod arm;
pub mod balance;
pub mod crossing;
pub mod draw;
pub(crate) mod grip;
pub mod ledger;
pub(crate) mod limits;
pub mod mismatch;
pub mod precision;
pub mod rig;
pub mod ring;
pub mod rolling;
pub mod sensors;
pub mod spread;
pub(crate) mod truth;
pub mod wall;
pub(crate) mod wind_up;
