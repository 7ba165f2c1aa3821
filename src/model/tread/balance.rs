//! Balance of the contact with what presses the wheel.

use super::relaxation::Stride;
use super::sums::Sums;
use super::{Axial, Contact, Drive, PitchedTread};
use crate::numeric::divide;
use crate::units::{Millimetres, Q16};

impl<const PITCH: u32, const ELEMENTS: usize> PitchedTread<PITCH, ELEMENTS> {
    /// Contact with the height corrected, and the correction, mm: one step of Newton's method.
    pub(super) fn correction(
        &self,
        sums: &Sums,
        stride: &Stride,
        drive: &Drive,
    ) -> (Contact, Millimetres) {
        // In millimetres of relaxed depth, which keep their bits whatever the rubber's stiffness.
        let rate = self.rate * drive.scale;
        let pressed = divide(drive.pressed, rate);
        let depth = |sum: i64| Q16::saturating_from_bits(sum >> 30);
        let (c, s) = (depth(sums.cos), depth(sums.sin));
        let loads = Q16::from_bits(stride.loads >> 10);
        let dc = -(loads * Q16::from_bits(sums.moves));
        let ds = -(loads * Q16::saturating_from_bits(sums.tan >> 29));
        let used = |c: Q16, s: Q16| match drive.axial {
            Axial::Pushed => Q16::ZERO,
            Axial::Driven(_) if c <= Q16::ZERO => Q16::ZERO,
            Axial::Driven(load) => divide(divide(load, rate) + s, c),
        };
        let u = used(c, s);
        let du = if u == Q16::ZERO { u } else { divide(ds - u * dc, c) };
        let slope = dc + u * ds + du * s;
        let missing = pressed - c - u * s;
        let change = if slope < Q16::ZERO { divide(missing, slope) } else { -missing };
        let (c, s) = (c + dc * change, s + ds * change);
        let contact = Contact {
            radial: c * rate,
            axial: s * rate,
            utilisation: used(c, s),
            ..Contact::default()
        };
        (contact, change)
    }
}
