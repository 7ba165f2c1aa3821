//! Delta code of records: a map of the fields that changed, then their differences and words.
//!
//! ```text
//! map, complete words | differences, half a word or a word each | words that changed
//! ```
//! Two bits of the map for each field coded as a difference: 0 none, 1 half a word, 2 a word;
//! one bit for each word that is copied. The tick of a record is coded as its difference from
//! one more than that before. Little-endian throughout.

use super::record::{Flags, Record};
use crate::sense::raw::SensorId;
use crate::supervise::codes;
use crate::tick::Telemetry;
use crate::units::{Duty, Q16};

/// Words of the sensors' ages and of their codes.
const AGES: usize = SensorId::COUNT.div_ceil(4);
const CODES: usize = SensorId::COUNT.div_ceil(2);

/// Fields of a record coded as differences: tick, ages, and those of [`Telemetry`].
const NUMBERS: usize = 1 + AGES + Telemetry::QUANTITIES;

/// Words of a record that are copied.
const WORDS: usize = CODES + 4;

/// Bits of the map before those of the words.
const DIFFERENCES: usize = 2 * NUMBERS;

const MAP: usize = (DIFFERENCES + WORDS).div_ceil(32) * 4;

const _: () = assert!(MAP <= 8, "the map is kept in a u64");

/// A record as integers. Differences wrap, so that no bit is lost between any two records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct DeltaRecord {
    numbers: [u32; NUMBERS],
    words: [u32; WORDS],
}

/// Most bytes that a [`DeltaRecord`] takes.
pub(super) const LONGEST: usize = MAP + 4 * (NUMBERS + WORDS);

const fn word(low: u16, high: u16) -> u32 {
    low as u32 | (high as u32) << 16
}

const fn halves(word: u32) -> [u16; 2] {
    [word as u16, (word >> 16) as u16]
}

/// The first of these values.
fn filled<T: Default, const N: usize>(values: impl IntoIterator<Item = T>) -> [T; N] {
    let mut values = values.into_iter();
    core::array::from_fn(|_| values.next().unwrap_or_default())
}

impl DeltaRecord {
    /// Zeros: the first record of a frame is coded as the difference from them.
    pub(super) const ZERO: Self = Self { numbers: [0; NUMBERS], words: [0; WORDS] };

    pub(super) const fn at(&self) -> u32 {
        self.numbers[0]
    }

    pub(super) fn of(record: &Record) -> Self {
        let Record { telemetry: t, codes, mut ages, bridges, flags } = *record;
        // The last age lowest: the arm's changes in every tick, as it is read every second one.
        ages.rotate_right(1);
        let ages = ages
            .chunks(4)
            .map(|four| four.iter().rev().fold(0, |word, age| word << 8 | u32::from(*age)));
        let quantities = t.quantities().map(|quantity| quantity.to_bits() as u32);
        let codes = codes.chunks(2).map(|two| word(two[0], two.get(1).copied().unwrap_or(0)));
        let rest = [
            word(bridges[0], bridges[1]),
            word(t.drive.to_bits() as u16, t.pretightener.to_bits() as u16),
            u32::from_le_bytes([t.level, t.stage as u8, codes::of_mode(t.mode), 0]),
            flags.0.into(),
        ];
        Self {
            numbers: filled([t.at].into_iter().chain(ages).chain(quantities)),
            words: filled(codes.chain(rest)),
        }
    }

    /// The record of the integers; none if one of them has no meaning.
    pub(super) fn record(&self) -> Option<Record> {
        let (ages, quantities) = self.numbers[1..].split_at(AGES);
        let (sensors, &[bridges, duties, state, flags]) = self.words.split_last_chunk()?;
        let mut ages: [u8; SensorId::COUNT] = filled(ages.iter().flat_map(|age| age.to_le_bytes()));
        ages.rotate_left(1);
        let [level, stage, mode, rest] = state.to_le_bytes();
        let [drive, pretightener] = halves(duties).map(|half| Duty::from_bits(half as i16));
        let (at, mode, stage) = (self.at(), codes::mode(mode)?, codes::stage(stage)?);
        (rest == 0).then_some(())?;
        let t = Telemetry { at, mode, stage, level, drive, pretightener, ..Telemetry::default() };
        let quantities = filled(quantities.iter().map(|bits| Q16::from_bits(*bits as i32)));
        Some(Record {
            telemetry: t.with_quantities(quantities),
            codes: filled(sensors.iter().flat_map(|word| halves(*word))),
            ages,
            bridges: halves(bridges),
            flags: Flags(u16::try_from(flags).ok()?),
        })
    }

    /// Writes the difference from `before`, and replaces that; returns the bytes written.
    pub(super) fn put(&self, before: &mut Self, room: &mut [u8; LONGEST]) -> usize {
        let mut list = List { map: 0, used: MAP, room };
        before.numbers[0] = before.at().wrapping_add(1);
        for (place, (number, before)) in self.numbers.iter().zip(&before.numbers).enumerate() {
            list.number(place, *number, *before);
        }
        for (place, (word, before)) in self.words.iter().zip(&before.words).enumerate() {
            if word != before {
                list.map |= 1 << (DIFFERENCES + place);
                list.put(word.to_le_bytes());
            }
        }
        list.room[..MAP].copy_from_slice(&list.map.to_le_bytes()[..MAP]);
        *before = *self;
        list.used
    }

    /// Reads the record that follows `before`, and the bytes after it; none if incomplete.
    pub(super) fn take<'a>(before: &Self, bytes: &'a [u8]) -> Option<(Self, &'a [u8])> {
        let mut map = [0; 8];
        let (start, mut rest) = bytes.split_first_chunk::<MAP>()?;
        map[..MAP].copy_from_slice(start);
        let map = u64::from_le_bytes(map);
        let mut delta = *before;
        delta.numbers[0] = delta.at().wrapping_add(1);
        for (place, number) in delta.numbers.iter_mut().enumerate() {
            let difference = match map >> (2 * place) & 3 {
                0 => 0,
                1 => i32::from(i16::from_le_bytes(*take(&mut rest)?)),
                2 => i32::from_le_bytes(*take(&mut rest)?),
                _ => return None,
            };
            *number = number.wrapping_add_signed(difference);
        }
        for (place, word) in delta.words.iter_mut().enumerate() {
            if map >> (DIFFERENCES + place) & 1 != 0 {
                *word = u32::from_le_bytes(*take(&mut rest)?);
            }
        }
        Some((delta, rest))
    }
}

/// The code of a record as it is written.
struct List<'a> {
    map: u64,
    used: usize,
    room: &'a mut [u8; LONGEST],
}

impl List<'_> {
    /// Codes the number with this index in the map by its difference from the expected one.
    fn number(&mut self, place: usize, number: u32, expected: u32) {
        let difference = number.wrapping_sub(expected) as i32;
        if difference == 0 {
            return;
        }
        if let Ok(half) = i16::try_from(difference) {
            self.map |= 1 << (2 * place);
            self.put(half.to_le_bytes());
        } else {
            self.map |= 2 << (2 * place);
            self.put(difference.to_le_bytes());
        }
    }

    /// Appends bytes; the room suffices for every record.
    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        let rest = self.room.get_mut(self.used..);
        if let Some(place) = rest.and_then(|rest| rest.first_chunk_mut::<N>()) {
            *place = bytes;
        }
        self.used += N;
    }
}

fn take<'a, const N: usize>(rest: &mut &'a [u8]) -> Option<&'a [u8; N]> {
    let (bytes, behind) = rest.split_first_chunk()?;
    *rest = behind;
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::super::record::tests::any_record;
    use super::*;
    use proptest::prelude::*;

    /// The record behind another, as it is written.
    fn written(one: &Record, other: &Record) -> Vec<u8> {
        let mut room = [0xA5; LONGEST];
        let mut before = DeltaRecord::of(one);
        let used = DeltaRecord::of(other).put(&mut before, &mut room);
        assert_eq!(before, DeltaRecord::of(other));
        room[..used].to_vec()
    }

    proptest! {
        #[test]
        fn a_record_comes_back_from_its_difference(
            one in any_record(),
            other in any_record(),
            behind in prop::collection::vec(any::<u8>(), 0..5),
        ) {
            prop_assert_eq!(DeltaRecord::of(&one).record(), Some(one));
            let bytes = [written(&one, &other), behind.clone()].concat();
            let (back, rest) = DeltaRecord::take(&DeltaRecord::of(&one), &bytes).unwrap();
            prop_assert_eq!(back.record(), Some(other));
            prop_assert_eq!(rest, &behind);
        }

        #[test]
        fn what_is_cut_off_is_no_record(one in any_record(), other in any_record(), cut in 1..9_usize) {
            let bytes = written(&one, &other);
            prop_assert_eq!(DeltaRecord::take(&DeltaRecord::of(&one), &bytes[..bytes.len().saturating_sub(cut)]), None);
        }

        #[test]
        fn differences_within_half_a_word_take_that(step in any::<i16>()) {
            let one = Record::default();
            let mut other = one;
            other.telemetry.at = one.telemetry.at.wrapping_add(1);
            other.telemetry.speed = Q16::from_bits(step.into());
            prop_assert_eq!(written(&one, &other).len(), MAP + 2 * usize::from(step != 0));
        }
    }

    #[test]
    fn a_tick_without_news_takes_its_codes_and_ages_at_most() {
        let before = Record::default();
        let mut after = before;
        after.telemetry.at += 1;
        assert_eq!(written(&before, &after).len(), MAP);
        // Parity and age of the arm's frame alternate.
        after.codes[3] ^= 0x8000;
        after.ages[3] += 1;
        assert_eq!(written(&before, &after).len(), MAP + 4 + 2);
    }

    #[test]
    fn numbers_without_meaning_are_no_record() {
        let sound = DeltaRecord::of(&Record::default());
        assert!(sound.record().is_some());
        // Stage 0, mode 99, a byte that says nothing, flags beyond 16 bits.
        let state = |stage, mode, rest| u32::from_le_bytes([0, stage, mode, rest]);
        for (place, number) in
            [(4, state(0, 0, 0)), (4, state(1, 99, 0)), (4, state(1, 0, 1)), (5, 65_536)]
        {
            let mut meaningless = sound;
            meaningless.words[place] = number;
            assert_eq!(meaningless.record(), None, "{place}");
        }
        // A map with a difference of no length, and one with a word that is missing.
        for (map, behind) in [(3_u32, LONGEST), (1 << 31, 3)] {
            let bytes = [&map.to_le_bytes()[..], &vec![0; behind]].concat();
            assert_eq!(DeltaRecord::take(&sound, &bytes), None);
        }
    }
}
