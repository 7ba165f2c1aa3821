//! Hardware in the loop: sensors, bridges, button and time are the host's
//! ([`interstage::hal::hil`]). Everything else is the firmware as it is flashed.
//!
//! The real bridges have no power: their pins are outputs that stand low, and no timer
//! drives them.

mod clock;
mod desk;
mod parts;
mod serve;

pub(crate) use parts::{Analog, Angle, Bridges, Button, Wheel, split};
pub(crate) use serve::serve;
