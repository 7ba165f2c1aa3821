//! Controller of a rubber-wheeled drive that climbs the steps inside a telescoping sleeve. It raises
//! the radial preload ahead of each step as far as the speed requires, so that the gap between wheel
//! and wall stays as it is at the safe, slow speed.
//!
//! One call of [`tick::Controller::step`] is one millisecond:
//!
//! 1. [`sense`]: sensor codes become speed, preload, compression and radius, each with its age.
//! 2. [`estimate`]: position between the steps, contact stage, and the gap of a crossing.
//! 3. [`supervise`]: the operator's commands, modes, faults and limits, by one transition table.
//! 4. [`control`]: the schedule of speed and preload, then the loops that follow it. What a
//!    crossing needs comes from the [`model`], outside the tick.
//! 5. [`tick::Output`]: the commands of both bridges, and a row for the [`log`].
//!
//! A tick is fixed point, without allocation and without waiting, and time is an argument. The async
//! [`tasks`] around it are generic over the traits of a board ([`hal`]). All of it builds on the host,
//! where the virtual rig runs it:
//!
//! ```
//! use interstage::rig::Rig;
//! use interstage::sense::raw::SensorFrame;
//! use interstage::tick::{Controller, Input, State};
//!
//! // The rig, once: a parameter that is out of range is refused here.
//! let rig = Rig::prototype();
//! let controller = Controller::try_build(&rig)?;
//! let mut state = State::default();
//!
//! // Sensors of a rig at the stow end, without preload. The wheel's centre is 125 mm from the axis.
//! let arm_rad = ((150.0 - 25.0 - rig.rig.arm_pivot_radius_mm) / rig.rig.arm_length_mm).asin();
//! let arm = (arm_rad / core::f64::consts::TAU * 16384.0 + rig.sense.angle_zero_code).round() as u16;
//! let parity = (arm.count_ones() % 2) as u16;
//! // Five per cent of the converter's range is zero.
//! let unloaded = 3277;
//! // Wheel encoder, preload sensor, compression sensor, arm angle.
//! let frame = |at| SensorFrame::taken(at, [0, unloaded, unloaded, arm | parity << 15]);
//!
//! // Without a command nothing moves, whatever the sensors say.
//! for now in 0..100 {
//!     let input = Input { now, sensors: frame(now), ..Input::default() };
//!     let output = controller.step(&mut state, &input);
//!     assert!(state.mode().is_at_rest());
//!     assert!(!output.drive.enable && !output.preload.enable);
//! }
//! # Ok::<(), interstage::rig::RigError>(())
//! ```

#![warn(missing_docs)]
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
// The control path is fixed point; where SI numbers come in, they are allowed one by one.
#![cfg_attr(not(test), deny(clippy::float_arithmetic))]
// The board's futures run on executors of one core; none has to be `Send`.
#![allow(async_fn_in_trait)]

pub mod control;
pub mod estimate;
pub mod fault;
pub mod hal;
pub mod log;
pub mod model;
pub mod numeric;
pub mod params;
pub mod restart;
#[allow(clippy::float_arithmetic, reason = "the rig is written in SI")]
pub mod rig;
pub mod sense;
pub mod supervise;
pub mod tasks;
pub mod tick;
pub mod units;
