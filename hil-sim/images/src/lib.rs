//! What the host and the measurement image exchange: plain words in one memory, in the
//! order in which they are declared.
//!
//! # Reduced model
//!
//! 1. The host calls `model_build(preset)` of the image, with a [`tick::Preset`] as `u32`;
//!    it returns 1 if the models of all arithmetics are ready.
//! 2. For each of [`model::VARIANTS`] and each of [`model::points`], the host writes
//!    [`model::Given::words`] of the point's `forward` (`inverse`) to memory and calls the
//!    variant's function `forward` (`inverse`) with their address in r0. The function
//!    returns the answer as bits of Q15.16.
//! 3. `rig-board cycles --json` does this for [`model::PRESET`] and prints
//!
//! ```json
//! {
//!   "variants": [{
//!     "name": "fixed",
//!     "forward_cycles": 466,
//!     "inverse_cycles": 319,
//!     "outputs": [123456, -1]
//!   }],
//!   "tick": { "mean": 3708.0, "worst": 5090 }
//! }
//! ```
//!
//! Cycles are those of the costliest call, textbook Cortex-M4. `outputs` holds the answer
//! of every point forwards, then of every point back. `tick` is the control tick over a
//! deployment.
//!
//! # Control tick
//!
//! See [`tick`]: `tick_build(preset)`, then `tick_load`, `tick_step`, `tick_plan` and
//! `tick_save` for each tick.

#![no_std]

pub mod digest;
pub mod model;
pub mod number;
pub mod tick;
