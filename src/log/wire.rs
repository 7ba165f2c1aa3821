//! Records as differences: what changes little from tick to tick takes one byte.

use serde::{Deserialize, Serialize};

use super::number;
use super::record::{Flags, Record};
use super::telemetry::Telemetry;
use crate::hal::Duty;
use crate::units::Q16;

/// Numbers of a record.
const NUMBERS: usize = 23;

/// A record as whole numbers, or the difference of two. postcard writes each in as many
/// bytes as it needs, 1 to 5.
///
/// Differences wrap, so that any two records have one and no bit is lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Wire([i32; NUMBERS]);

/// Most bytes that a [`Wire`] takes.
pub(super) const LONGEST: usize = 5 * NUMBERS;

impl Wire {
    /// The record as numbers.
    #[inline(never)]
    pub(super) fn of(record: &Record) -> Self {
        let Record { telemetry: t, codes, ages, bridges: [drive, pretightener], flags } = record;
        let [wheel, load_cell, tread, arm] = codes;
        let [wheel_age, load_cell_age, tread_age, arm_age] = *ages;
        Self([
            t.at as i32,
            i32::from(*wheel),
            i32::from(*load_cell),
            i32::from(*tread),
            // The frame's parity, its highest bit, jumps: as the lowest it weighs little.
            i32::from(arm.rotate_left(1)),
            // The arm's age lowest: read every second tick, it is the one that changes.
            i32::from_le_bytes([arm_age, wheel_age, load_cell_age, tread_age]),
            i32::from_le_bytes([t.level, t.stage as u8, number::of_mode(t.mode), 0]),
            i32::from(flags.to_bits()),
            t.position.to_bits(),
            t.speed.to_bits(),
            t.speed_ref.to_bits(),
            t.preload.to_bits(),
            t.preload_ref.to_bits(),
            t.compression.to_bits(),
            t.radius.to_bits(),
            t.gap_predicted.to_bits(),
            t.slip_margin.to_bits(),
            t.vibration.to_bits(),
            t.distance.to_bits(),
            i32::from(t.drive.to_bits()),
            i32::from(t.pretightener.to_bits()),
            i32::from(*drive),
            i32::from(*pretightener),
        ])
    }

    /// The record of the numbers; none if one of them has no meaning.
    pub(super) fn record(&self) -> Option<Record> {
        let [at, wheel, load_cell, tread, arm, ages, state, flags, rest @ ..] = self.0;
        let [q @ .., drive, pretightener, drive_code, pretightener_code] = rest;
        let q: [Q16; 11] = q.map(Q16::from_bits);
        let [arm_age, wheel_age, load_cell_age, tread_age] = ages.to_le_bytes();
        let [level, stage, mode, _] = state.to_le_bytes();
        let code = |number: i32| u16::try_from(number).ok();
        let duty = |number: i32| i16::try_from(number).ok().map(Duty::from_bits);
        Some(Record {
            telemetry: Telemetry {
                at: at as u32,
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
                drive: duty(drive)?,
                pretightener: duty(pretightener)?,
            },
            codes: [code(wheel)?, code(load_cell)?, code(tread)?, code(arm)?.rotate_right(1)],
            ages: [wheel_age, load_cell_age, tread_age, arm_age],
            bridges: [code(drive_code)?, code(pretightener_code)?],
            flags: Flags::from_bits(code(flags)?),
        })
    }

    /// Writes it; so many bytes.
    pub(super) fn put(&self, room: &mut [u8]) -> usize {
        postcard::serialize_with_flavor(self, Room { bytes: room, used: 0 }).unwrap_or(0)
    }

    /// The difference to what came before.
    pub(super) fn since(&self, before: &Self) -> Self {
        let mut difference = *self;
        for (number, before) in difference.0.iter_mut().zip(before.0) {
            *number = number.wrapping_sub(before);
        }
        difference
    }

    /// What has this difference to what came before.
    pub(super) fn after(&self, before: &Self) -> Self {
        let mut sum = *self;
        for (number, before) in sum.0.iter_mut().zip(before.0) {
            *number = number.wrapping_add(before);
        }
        sum
    }
}

/// Bytes one by one: most numbers take a single one, for which a call that copies costs
/// several times the rest.
struct Room<'a> {
    bytes: &'a mut [u8],
    used: usize,
}

impl postcard::ser_flavors::Flavor for Room<'_> {
    type Output = usize;

    #[inline(always)]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        let room = self.bytes.get_mut(self.used).ok_or(postcard::Error::SerializeBufferFull)?;
        *room = byte;
        self.used += 1;
        Ok(())
    }

    fn finalize(self) -> postcard::Result<usize> {
        Ok(self.used)
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
        let before = Record::EMPTY;
        let mut after = before;
        after.telemetry.at += 1;
        // Parity and age of the arm's frame alternate.
        after.codes[3] ^= 0x8000;
        after.ages[3] += 1;
        let difference = Wire::of(&after).since(&Wire::of(&before));
        let mut bytes = [0; LONGEST];
        assert_eq!(postcard::to_slice(&difference, &mut bytes).unwrap().len(), NUMBERS);
    }

    #[test]
    fn numbers_without_meaning_are_no_record() {
        let sound = Wire::of(&Record::EMPTY);
        assert!(sound.record().is_some());
        // Stage 0, mode 99, a code and a duty beyond 16 bits.
        let state = |mode, stage| i32::from_le_bytes([0, stage, mode, 0]);
        for (place, number) in [(6, state(0, 0)), (6, state(99, 1)), (1, 65_536), (20, 32_768)] {
            let mut meaningless = sound;
            meaningless.0[place] = number;
            assert_eq!(meaningless.record(), None, "{place}");
        }
    }
}
