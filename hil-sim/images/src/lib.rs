//! What the host and the measurement image exchange: plain words in one memory, in the
//! order in which they are declared.
//!
//! # Rollout
//!
//! 1. The host calls `model_build(preset)` of the image, with a [`tick::Preset`] as `u32`;
//!    it returns 1 if the tread is ready.
//! 2. For each crossing it calls `rollout`, with [`rollout::Given::words`] given by reference,
//!    which returns the gap as bits of Q15.16.
//!
//! The host has `rig-board cycles --script FILE` do this: a JSON array of steps
//! `{"call": {"function": .., "arguments": [..]}}` and
//! `{"measure": {"function": .., "inputs": [[..], ..]}}`. It prints an array of
//! `{"values": [..], "cost": {"max": ..}}`, a step each; cycles are textbook Cortex-M4.
//!
//! # Control tick
//!
//! See [`tick`]: `tick_build(preset)`, then `tick_load`, `tick_step`, `tick_plan` and
//! `tick_save` for each tick. `rig-board cycles` does this over a deployment and a
//! retraction, and prints `{"tick": {"max": .., "calls": .., "cycles": ..}}`.

#![no_std]

pub mod digest;
pub mod rollout;
pub mod tick;
