//! What a crossing measures: flat ground, the compression of a wheel that falls, and the gap.

use super::{CrossingWatch, HEIGHT_MOST, HOLD, Lift, PER_FALL, WatchInput, WatchState};
use crate::numeric::{divide, sqrt};
use crate::units::{Millimetres, Q16, Ratio, Travel, q16};

/// Travel over which ground within [`HOLD`] is a wall, mm. On a corner less than 2.1 mm before its face
/// is as flat, by `d (2 x - d) / 2 R`, and then 0.09 mm below its wall, by `x^2 / 2 R`.
const FLAT: Travel = q16(1_500_000).widen();

/// What the wall behind a step shows of the crossing, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Step height; the nominal one if what is measured is not plausible.
    pub height: Millimetres,
    /// Gap with that height.
    pub gap: Millimetres,
    /// Gap of a wheel as deep in the corner at the nominal height.
    pub gap_as_table: Millimetres,
    /// By how much that height changes the distance to the face at the lift.
    pub shift: Millimetres,
    /// The measured height lies within [`HEIGHT_MOST`] of the table.
    pub plausible: bool,
}

impl CrossingWatch {
    /// Place in the kept depths of a wheel that has sunk by `fall`, and the part beyond it.
    fn fall_index(&self, fall: Millimetres) -> Option<(usize, Ratio)> {
        let place = (fall - self.step + HEIGHT_MOST) * PER_FALL;
        let index = usize::try_from(place.floor()).ok()?;
        Some((index, place - Q16::from_num(index as i32)))
    }

    /// Keeps the compression at the present fall.
    pub(super) fn keep_depth(&self, state: &mut WatchState, seen: &WatchInput) {
        let kept = self.fall_index(seen.radius - state.baseline.output());
        let slot = kept.and_then(|(index, _)| state.depths.get_mut(index));
        if let Some(slot) = slot.filter(|slot| **slot == Q16::ZERO) {
            *slot = seen.compression;
        }
    }

    /// Compression as the wheel had sunk by `fall`, mm, if that was seen: by the two falls before
    /// it, since behind it the lower wall may carry.
    pub(super) fn depth_at(&self, state: &WatchState, fall: Millimetres) -> Option<Millimetres> {
        let (index, part) = self.fall_index(fall)?;
        let before = *state.depths.get(index.checked_sub(1)?)?;
        let here = *state.depths.get(index)?;
        (here > Q16::ZERO && before > Q16::ZERO).then(|| here + (here - before) * part)
    }

    /// What a lift-off shows with this depth at the corner and the centre this high above the
    /// lower wall, for a step of height h, mm: `y^2 - (y-h)^2 = h (2y - h)`.
    pub(in crate::estimate) fn measure(
        &self,
        depth: Millimetres,
        height: Millimetres,
        step: Millimetres,
    ) -> Lift {
        let reach = self.radius - depth;
        let over = height - step;
        let chord = step * (height + over);
        Lift {
            depth,
            height,
            gap: sqrt((reach * reach + chord).max(Q16::ZERO)) - self.radius,
            distance: sqrt((reach * reach - over * over).max(Q16::ZERO)),
        }
    }

    /// By how much an edge `ahead` seems further out per part of this compression that the sensor misses,
    /// mm: `c (R - c) / a`.
    pub(in crate::estimate) fn leverage(
        &self,
        depth: Millimetres,
        ahead: Millimetres,
    ) -> Millimetres {
        divide(depth * (self.radius - depth), ahead.max(Millimetres::ONE))
    }
}

/// Whether the wheel is on a wall: where its place does not tell, by ground that is flat.
pub(super) fn is_clear(state: &mut WatchState, seen: &WatchInput) -> bool {
    let ground = seen.radius - seen.compression;
    if (ground - state.level).abs() > HOLD {
        (state.sampled, state.level) = (seen.travel, ground);
    }
    let flat = seen.travel.saturating_sub(state.sampled).saturating_abs() >= FLAT;
    seen.clear.unwrap_or(flat)
}
