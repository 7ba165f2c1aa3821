//! Records as differences: what changes little from tick to tick takes one byte.

use serde::{Deserialize, Serialize};

use super::number;
use super::record::{Flags, Record};
use super::telemetry::Telemetry;
use crate::hal::Duty;
use crate::units::Q16;

/// A record as whole numbers, or the difference of two. postcard writes each in as many
/// bytes as it needs, 1 to 5.
///
/// Differences wrap, so that any two records have one and no bit is lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Wire {
    at: u32,
    codes: [i16; 4],
    /// The arm's age lowest: read every second tick, it is the one that changes.
    ages: i32,
    /// Mode, stage, level.
    state: i32,
    flags: i16,
    quantities: [i32; 11],
    duties: [i16; 2],
}

/// Most bytes that a [`Wire`] takes.
pub(super) const LONGEST: usize = 5 + 4 * 3 + 5 + 5 + 3 + 11 * 5 + 2 * 3;

impl Wire {
    /// The record as numbers.
    #[must_use]
    pub(super) fn of(record: &Record) -> Self {
        let Record { telemetry: t, codes: [wheel, load_cell, tread, arm], ages, flags } = record;
        let [wheel_age, load_cell_age, tread_age, arm_age] = *ages;
        Self {
            at: t.at,
            // The frame's parity, its highest bit, jumps: as the lowest it weighs little.
            codes: [*wheel, *load_cell, *tread, arm.rotate_left(1)].map(|code| code as i16),
            ages: i32::from_le_bytes([arm_age, wheel_age, load_cell_age, tread_age]),
            state: i32::from_le_bytes([t.level, t.stage as u8, number::of_mode(t.mode), 0]),
            flags: flags.to_bits() as i16,
            quantities: [
                t.position,
                t.speed,
                t.speed_ref,
                t.preload,
                t.preload_ref,
                t.compression,
                t.radius,
                t.gap_predicted,
                t.slip_margin,
                t.vibration,
                t.distance,
            ]
            .map(Q16::to_bits),
            duties: [t.drive, t.pretightener].map(Duty::to_bits),
        }
    }

    /// The record of the numbers; none if mode or stage have no meaning.
    #[must_use]
    pub(super) fn record(&self) -> Option<Record> {
        let [arm_age, wheel_age, load_cell_age, tread_age] = self.ages.to_le_bytes();
        let [level, stage, mode, _] = self.state.to_le_bytes();
        let [wheel, load_cell, tread, arm] = self.codes.map(|code| code as u16);
        let q = self.quantities.map(Q16::from_bits);
        let [drive, pretightener] = self.duties.map(Duty::from_bits);
        Some(Record {
            telemetry: Telemetry {
                at: self.at,
                mode: number::mode(mode)?,
                stage: number::stage(stage)?,
                position: q[0],
                speed: q[1],
                speed_ref: q[2],
                preload: q[3],
                preload_ref: q[4],
                compression: q[5],
                radius: q[6],
                level,
                gap_predicted: q[7],
                slip_margin: q[8],
                vibration: q[9],
                distance: q[10],
                drive,
                pretightener,
            },
            codes: [wheel, load_cell, tread, arm.rotate_right(1)],
            ages: [wheel_age, load_cell_age, tread_age, arm_age],
            flags: Flags::from_bits(self.flags as u16),
        })
    }

    /// The difference to what came before.
    #[must_use]
    pub(super) fn since(&self, before: &Self) -> Self {
        self.with(before, u32::wrapping_sub, i32::wrapping_sub, i16::wrapping_sub)
    }

    /// What has this difference to what came before.
    #[must_use]
    pub(super) fn after(&self, before: &Self) -> Self {
        before.with(self, u32::wrapping_add, i32::wrapping_add, i16::wrapping_add)
    }

    fn with(
        &self,
        other: &Self,
        time: fn(u32, u32) -> u32,
        long: fn(i32, i32) -> i32,
        short: fn(i16, i16) -> i16,
    ) -> Self {
        let mut result = *self;
        result.at = time(self.at, other.at);
        result.ages = long(self.ages, other.ages);
        result.state = long(self.state, other.state);
        result.flags = short(self.flags, other.flags);
        for (one, other) in result.codes.iter_mut().zip(other.codes) {
            *one = short(*one, other);
        }
        for (one, other) in result.quantities.iter_mut().zip(other.quantities) {
            *one = long(*one, other);
        }
        for (one, other) in result.duties.iter_mut().zip(other.duties) {
            *one = short(*one, other);
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::super::record::tests::any_record;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_record_comes_back_from_its_difference(one in any_record(), other in any_record()) {
            let (a, b) = (Wire::of(&one), Wire::of(&other));
            prop_assert_eq!(a.record(), Some(one));
            prop_assert_eq!(b.since(&a).after(&a).record(), Some(other));
        }

        #[test]
        fn no_difference_is_longer_than_said(one in any_record(), other in any_record()) {
            let mut bytes = [0; LONGEST];
            let difference = Wire::of(&other).since(&Wire::of(&one));
            let used = postcard::to_slice(&difference, &mut bytes).unwrap().len();
            let (back, rest) = postcard::take_from_bytes::<Wire>(&bytes[..used]).unwrap();
            prop_assert_eq!(back, difference);
            prop_assert!(rest.is_empty());
        }
    }

    #[test]
    fn a_tick_without_news_takes_a_byte_a_number() {
        let before = Record::empty();
        let mut after = before;
        after.telemetry.at += 1;
        // Parity and age of the arm's frame alternate.
        after.codes[3] ^= 0x8000;
        after.ages[3] += 1;
        let difference = Wire::of(&after).since(&Wire::of(&before));
        let mut bytes = [0; LONGEST];
        assert_eq!(postcard::to_slice(&difference, &mut bytes).unwrap().len(), 21);
    }

    #[test]
    fn numbers_without_meaning_are_no_record() {
        let meaningless = Wire { state: i32::from_le_bytes([0, 0, 0, 0]), ..Wire::default() };
        assert_eq!(meaningless.record(), None);
        let meaningless = Wire { state: i32::from_le_bytes([0, 1, 99, 0]), ..Wire::default() };
        assert_eq!(meaningless.record(), None);
    }
}
