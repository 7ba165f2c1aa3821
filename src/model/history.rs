//! How the wheel came to a crossing: what a review rolls the tread through again.

use crate::numeric::divide;
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Travel, ticks_to_seconds,
};

/// Strides kept: on the published wheel 9.6 mm of tread, more than a patch before lift-off.
pub const STRIDES: usize = 48;

/// Ticks in which a wheel that moves makes a stride: one that takes longer stands, and its tread
/// relaxes.
const STANDS: u16 = 2000;

/// A stride: its ticks, of more than 127 to 16, and the radial force at its end, 1/64 N.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct HistoryStride {
    code: u8,
    force: u16,
}

impl HistoryStride {
    /// A stride of this duration in ticks, up to 2000, under this force, N, from 0 to 1023.
    pub fn new(ticks: u16, pressed: Newtons) -> Self {
        let code = if ticks < 128 { ticks } else { 128 + (ticks - 128) / 16 };
        Self {
            code: u8::try_from(code).unwrap_or(u8::MAX),
            force: u16::try_from(pressed.to_bits().max(0) >> 10).unwrap_or(u16::MAX),
        }
    }

    /// Its duration in ticks; 0 for none.
    pub fn ticks(self) -> u32 {
        let code = u32::from(self.code);
        if code < 128 { code } else { 128 + (code - 128) * 16 }
    }

    /// Radial force, N.
    pub const fn pressed(self) -> Newtons {
        Q16::from_bits((self.force as i32) << 10)
    }
}

/// The last strides of a wheel that rolls in one direction.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct History {
    /// The newest last; those before the first are empty.
    #[serde(with = "serde_big_array::BigArray")]
    strides: [HistoryStride; STRIDES],
}

impl Default for History {
    fn default() -> Self {
        Self { strides: [HistoryStride::default(); STRIDES] }
    }
}

/// The history as it is being written.
#[derive(Clone, Copy, Debug, Default)]
pub struct HistoryWriter {
    history: History,
    direction: Direction,
    /// Travel of the tread at the last stride's end, mm; none before the first.
    from: Option<Travel>,
    ticks: u16,
}

impl History {
    /// A wheel that has rolled in strides of so many ticks under this force, N.
    pub fn steady(ticks: u16, pressed: Newtons) -> Self {
        Self { strides: [HistoryStride::new(ticks, pressed); STRIDES] }
    }

    /// Its strides, the oldest first.
    pub fn strides(&self) -> impl Iterator<Item = HistoryStride> + '_ {
        self.strides.iter().copied().filter(|stride| stride.code > 0)
    }

    /// Mean speed over the last 0.6 mm of tread, in which it does most of its relaxing, mm/s.
    pub fn speed(&self, stride: Millimetres) -> MillimetresPerSecond {
        let ticks: u32 = self.strides.iter().rev().take(3).map(|stride| stride.ticks()).sum();
        divide(stride + stride + stride, ticks_to_seconds(ticks.max(1)))
    }

    /// Adds a stride, in place of the oldest.
    pub fn push(&mut self, stride: HistoryStride) {
        self.strides.rotate_left(1);
        if let Some(last) = self.strides.last_mut() {
            *last = stride;
        }
    }
}

impl HistoryWriter {
    /// One tick at this travel of the tread, mm outwards, under this force, N.
    pub fn step(&mut self, stride: Millimetres, way: Direction, travel: Travel, pressed: Newtons) {
        let from = *self.from.get_or_insert(travel);
        self.ticks = self.ticks.saturating_add(1);
        if way != self.direction || self.ticks > STANDS {
            *self = Self { direction: way, from: Some(travel), ..Self::default() };
            return;
        }
        let stride = if way == Direction::Deploy { stride } else { -stride };
        let end = from.saturating_add(stride.widen());
        if (way == Direction::Deploy) == (travel >= end) && travel != from {
            self.history.push(HistoryStride::new(self.ticks, pressed));
            (self.from, self.ticks) = (Some(end), 0);
        }
    }

    /// The strides so far.
    pub const fn history(&self) -> &History {
        &self.history
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::q16;

    #[test]
    fn strides_are_those_of_the_travel_and_a_wheel_that_stands_begins_again() {
        let stride = q16(200_000);
        for direction in [Direction::Deploy, Direction::Retract] {
            let mut writer = HistoryWriter::default();
            let sign = i64::from(direction.sign());
            let mut travel = Travel::ZERO;
            let roll = |writer: &mut HistoryWriter, ticks: u32, travel: &mut Travel| {
                for _ in 0..ticks {
                    *travel += Travel::lit("0.01") * Travel::from_num(sign);
                    writer.step(stride, direction, *travel, q16(40_500_000));
                }
            };
            roll(&mut writer, 400, &mut travel);
            assert!((18..=20).contains(&writer.history().strides().count()));
            assert!(writer.history().strides().skip(1).all(|s| (19..=21).contains(&s.ticks())));
            assert!(writer.history().strides().all(|s| s.pressed() == q16(40_500_000)));
            assert!((writer.history().speed(stride) - q16(10_000_000)).abs() < q16(500_000));
            roll(&mut writer, 4000, &mut travel);
            assert_eq!(writer.history().strides().count(), STRIDES);
            for _ in 0..=STANDS {
                writer.step(stride, direction, travel, Q16::ZERO);
            }
            assert_eq!(writer.history().strides().count(), 0);
        }
    }
}
