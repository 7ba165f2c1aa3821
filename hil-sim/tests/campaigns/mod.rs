//! Faults, holds and the stress of plant and controller.

mod accepted;
mod envelope;
mod faults;
mod holds;
mod hostile;
mod refine;
mod settle;
mod stress;

/// The parity bit of an angle's word.
fn parity(angle: u16) -> u16 {
    ((angle.count_ones() & 1) as u16) << 15
}
