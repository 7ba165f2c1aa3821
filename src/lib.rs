//! Controller of a rubber-wheeled drive that climbs the steps inside a
//! telescoping sleeve: it raises the radial preload ahead of each step in
//! proportion to the speed, so that the gap between wheel and wall stays as on
//! the smooth wall.
//!
//! The control tick ([`tick`]) is fixed point, without allocation and without
//! waiting; the async [`tasks`] around it are generic over one board trait
//! ([`hal`]). All of it builds on the host, where the virtual rig runs it.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
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
pub mod rig;
pub mod sense;
pub mod supervise;
pub mod tasks;
pub mod tick;
pub mod units;
