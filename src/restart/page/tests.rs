use proptest::prelude::*;

use super::super::{flash_log, image_checksum};
use super::*;
use crate::restart::{DriveSnapshot, MissedCheckIns, PackedSpeed, PackedZeros};
use crate::units::{Q16, q16};

const BLANK: Page = [0xFF; PAGE_BYTES];

fn put(page: &mut Page, index: usize, [low, high]: Word) {
    let at = index * WORD_BYTES;
    assert_eq!(page[at..at + WORD_BYTES], [0xFF; WORD_BYTES], "only what is blank is written");
    page[at..at + 4].copy_from_slice(&low.to_le_bytes());
    page[at + 4..at + 8].copy_from_slice(&high.to_le_bytes());
}

/// Puts double words one behind the other.
fn put_all(page: &mut Page, first: usize, words: impl IntoIterator<Item = Word>) {
    for (index, word) in (first..).zip(words) {
        put(page, index, word);
    }
}

fn snapshot(tick: u32) -> DriveSnapshot {
    DriveSnapshot {
        tick,
        position: Q16::from_num(f64::from(tick) * 0.008),
        mode: 7,
        level: 1,
        fault: 0,
        missed: MissedCheckIns::NOBODY,
        packed_speed: PackedSpeed::of(q16(8 << 16), true),
        packed_zeros: PackedZeros::default(),
    }
}

/// Writes a record, of which only so many double words come through.
fn write(page: &mut Page, snapshot: &DriveSnapshot, words: usize) {
    let first = flash_log::free(page).expect("room");
    put_all(page, first, flash_log::words(snapshot).into_iter().take(words));
}

#[test]
fn a_record_is_found_until_it_is_taken() {
    let mut page = BLANK;
    assert_eq!(flash_log::latest(&page), None);
    for tick in [1000, 2000] {
        write(&mut page, &snapshot(tick), 3);
        let latest = flash_log::latest(&page).expect("a record");
        assert_eq!(latest.snapshot, Some(snapshot(tick)));
        put(&mut page, latest.mark, flash_log::TAKEN);
        assert_eq!(flash_log::latest(&page), None);
    }
}

#[test]
fn a_mark_that_was_broken_off_takes_nothing() {
    let mut page = BLANK;
    write(&mut page, &snapshot(3), 3);
    let mark = flash_log::latest(&page).expect("a record").mark;
    put(&mut page, mark, [0, u32::MAX]);
    let again = flash_log::Latest { mark, snapshot: Some(snapshot(3)) };
    assert_eq!(flash_log::latest(&page), Some(again));
}

#[test]
fn a_record_that_was_broken_off_is_none_and_is_not_written_over() {
    for words in 1..3 {
        let mut page = BLANK;
        write(&mut page, &snapshot(5), words);
        let latest = flash_log::latest(&page).expect("something");
        assert_eq!(latest.snapshot, None);
        write(&mut page, &snapshot(6), 3);
        assert_eq!(flash_log::latest(&page).and_then(|l| l.snapshot), Some(snapshot(6)));
    }
}

/// A supply that goes again while a start takes what it had left, and this time too fast.
#[test]
fn behind_a_record_that_was_not_taken_one_that_was_broken_off_hides_nothing() {
    for words in 0..3 {
        let mut page = BLANK;
        write(&mut page, &snapshot(4), 3);
        let first = flash_log::latest(&page).expect("a record").mark;
        write(&mut page, &snapshot(5), words);
        let latest = flash_log::latest(&page).expect("a record");
        assert_eq!(latest.snapshot, Some(snapshot(4)));
        put(&mut page, latest.mark, flash_log::TAKEN);
        assert_eq!(flash_log::latest(&page), None);
        // Once it was taken there is nothing to find.
        let mut page = BLANK;
        write(&mut page, &snapshot(4), 3);
        put(&mut page, first, flash_log::TAKEN);
        write(&mut page, &snapshot(5), words);
        assert_eq!(flash_log::latest(&page).and_then(|latest| latest.snapshot), None);
    }
}

#[test]
fn a_page_holds_64_records() {
    let mut page = BLANK;
    for tick in 0..64 {
        write(&mut page, &snapshot(tick), 3);
    }
    assert_eq!(flash_log::latest(&page).and_then(|l| l.snapshot), Some(snapshot(63)));
    assert_eq!(flash_log::free(&page), None);
}

#[test]
fn an_image_is_known_by_its_first_start() {
    let mut page = BLANK;
    let images = [([1, 2, 3, 4, 5, 6, 7, 8], 77), ([9; 8], 78)];
    assert_eq!(image_checksum::sum_of(&page, images[0].0), None);
    for (id, sum) in images {
        let first = image_checksum::free(&page).expect("room");
        put_all(&mut page, first, image_checksum::entry(id, sum));
    }
    for (id, sum) in images {
        assert_eq!(image_checksum::sum_of(&page, id), Some(sum));
    }
    assert_eq!(image_checksum::sum_of(&page, [0; 8]), None);
}

#[test]
fn an_entry_that_was_broken_off_is_none_and_is_not_written_over() {
    let mut page = BLANK;
    put(&mut page, 0, image_checksum::entry([3; 8], 5)[0]);
    assert_eq!(image_checksum::sum_of(&page, [3; 8]), None);
    assert_eq!(image_checksum::free(&page), Some(2));
}

#[test]
fn a_page_of_seals_fills_up() {
    let mut page = BLANK;
    for image in 0..128_u8 {
        let first = image_checksum::free(&page).expect("room");
        put_all(&mut page, first, image_checksum::entry([image; 8], 1));
    }
    assert_eq!(image_checksum::free(&page), None);
}

proptest! {
    #[test]
    fn a_bit_or_two_of_the_hash_make_no_new_image(
        id: [u8; 8],
        sum: u32,
        bit in 0_usize..64,
        other in 0_usize..64,
    ) {
        let mut page = BLANK;
        put_all(&mut page, 0, image_checksum::entry(id, sum));
        let mut turned = id;
        turned[bit / 8] ^= 1 << (bit % 8);
        prop_assert_eq!(image_checksum::sum_of(&page, turned), Some(sum));
        turned[other / 8] ^= 1 << (other % 8);
        prop_assert_eq!(image_checksum::sum_of(&page, turned), Some(sum));
        page[bit / 8] ^= 1 << (bit % 8);
        page[other / 8] ^= 1 << (other % 8);
        prop_assert_eq!(image_checksum::sum_of(&page, id), Some(sum));
    }

    #[test]
    fn a_bit_of_a_sum_is_no_other_sum(id: [u8; 8], sum: u32, bit in 0_usize..64) {
        let mut page = BLANK;
        put_all(&mut page, 0, image_checksum::entry(id, sum));
        page[8 + bit / 8] ^= 1 << (bit % 8);
        prop_assert_eq!(image_checksum::sum_of(&page, id), None);
    }

    #[test]
    fn a_change_of_one_word_changes_the_sum(
        words in prop::collection::vec(any::<u32>(), 1..200),
        place: prop::sample::Index,
        change in 1_u32..,
    ) {
        let mut changed = words.clone();
        changed[place.index(words.len())] ^= change;
        prop_assert_ne!(image_checksum::sum_on(0, &words), image_checksum::sum_on(0, &changed));
    }

    #[test]
    fn two_bits_of_a_double_word_change_the_sum(
        words in prop::collection::vec(any::<[u32; 2]>(), 1..20),
        place: prop::sample::Index,
    ) {
        let sum = |words: &[[u32; 2]]| image_checksum::sum_on(0, words.as_flattened());
        let place = place.index(words.len());
        let before = sum(&words);
        for (one, other) in (0..64).flat_map(|one| (0..one).map(move |other| (one, other))) {
            let mut changed = words.clone();
            for bit in [one, other] {
                changed[place][bit / 32] ^= 1 << (bit % 32);
            }
            prop_assert_ne!(sum(&changed), before, "{} and {}", one, other);
        }
    }

    #[test]
    fn a_sum_is_the_same_in_one_go_and_in_parts(
        words in prop::collection::vec(any::<u32>(), 0..200),
        part in 1_usize..50,
    ) {
        let sum = words.chunks(part).fold(0, image_checksum::sum_on);
        prop_assert_eq!(sum, image_checksum::sum_on(0, &words));
    }

    #[test]
    fn a_damaged_page_is_read_without_harm(bytes in prop::collection::vec(any::<u8>(), PAGE_BYTES)) {
        let page: Page = bytes.try_into().expect("a page");
        // Random words hardly ever pass for a record.
        prop_assert_eq!(flash_log::latest(&page).and_then(|latest| latest.snapshot), None);
        prop_assert_eq!(flash_log::free(&page), None);
        prop_assert_eq!(image_checksum::free(&page), None);
    }
}
