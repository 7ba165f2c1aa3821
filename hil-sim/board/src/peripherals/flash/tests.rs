//! The rules of the reference manual, one a test.

use super::*;
use crate::description::Field;
use crate::peripherals::rcc::Cause;
use crate::peripherals::tests::write;

const PROGRAM: u32 = cr::PG.mask;
const PAGE: u32 = bits(&[cr::PER, cr::STRT]);
const ERASED: [u8; 8] = [0xFF; 8];
/// The first page of the second bank.
const PLACE: u32 = BASE + BANK_BYTES;

fn unlocked() -> Flash {
    let mut flash = Flash::default();
    for key in KEYS {
        write(&mut flash, KEYR, key, 0);
    }
    flash
}

fn programming() -> Flash {
    let mut flash = unlocked();
    write(&mut flash, CR, PROGRAM, 0);
    flash
}

fn status(flash: &mut Flash) -> u32 {
    flash.read(SR, 0).expect("modelled")
}

/// Writes a double word over `before` and waits for its end.
fn program(flash: &mut Flash, address: u32, value: u64, before: [u8; 8]) -> Option<Change> {
    flash.store(address, 4, value as u32);
    flash.store(address + 4, 4, (value >> 32) as u32);
    if flash.needs() == Some(address) {
        flash.found(before, 0);
    }
    flash.advance(PROGRAM_CYCLES);
    flash.take_change()
}

#[test]
fn two_keys_in_their_order_open_it() {
    let mut flash = unlocked();
    assert_eq!(flash.read(CR, 0), Some(cr::OPTLOCK.mask));
    write(&mut flash, CR, cr::LOCK.mask, 0);
    write(&mut flash, CR, PROGRAM, 0);
    assert_eq!(flash.read(CR, 0), Some(bits(&[cr::LOCK, cr::OPTLOCK])), "locked, it takes nothing");
}

#[test]
fn a_wrong_key_locks_it_until_reset() {
    let mut flash = Flash::default();
    for key in [1, KEYS[0], KEYS[1]] {
        write(&mut flash, KEYR, key, 0);
    }
    assert_eq!(flash.read(CR, 0).map(|word| cr::LOCK.of(word)), Some(1));
    assert_eq!(flash.reset(), None);
    for key in KEYS {
        write(&mut flash, KEYR, key, 0);
    }
    assert_eq!(flash.read(CR, 0).map(|word| cr::LOCK.of(word)), Some(0));
}

#[test]
fn a_double_word_takes_its_time_and_its_two_words() {
    let mut flash = programming();
    flash.store(PLACE, 4, 0x0403_0201);
    assert_eq!((status(&mut flash), flash.needs()), (0, None));
    flash.store(PLACE + 4, 4, 0x0807_0605);
    assert_eq!(flash.needs(), Some(PLACE));
    flash.found(ERASED, 1000);
    assert_eq!((status(&mut flash), flash.deadline()), (sr::BSY.mask, 1000 + PROGRAM_CYCLES));
    flash.advance(999 + PROGRAM_CYCLES);
    assert_eq!(flash.take_change(), None);
    flash.advance(1000 + PROGRAM_CYCLES);
    let bytes = [1, 2, 3, 4, 5, 6, 7, 8];
    assert_eq!(flash.take_change(), Some(Change::Programmed { address: PLACE, bytes }));
    assert_eq!(status(&mut flash), 0, "its end shows only where it is to interrupt");
}

#[test]
fn only_erased_flash_takes_anything_but_zeros() {
    let mut flash = programming();
    let used = 7_u64.to_le_bytes();
    assert_eq!(program(&mut flash, PLACE, 6, used), None);
    assert_eq!(status(&mut flash), sr::PROGERR.mask);
    write(&mut flash, SR, sr::PROGERR.mask, 0);
    assert!(program(&mut flash, PLACE, 0, used).is_some());
    assert_eq!(status(&mut flash), 0);
}

#[test]
fn breaking_a_rule_raises_its_flag_and_programs_nothing() {
    type Breaks = fn(&mut Flash);
    let cases: [(Breaks, Field); 5] = [
        (|flash| flash.store(PLACE, 2, 0), sr::SIZERR),
        (|flash| flash.store(PLACE + 4, 4, 0), sr::PGAERR),
        (
            |flash| {
                flash.store(PLACE, 4, 0);
                flash.store(PLACE + 12, 4, 0);
            },
            sr::PGAERR,
        ),
        (
            |flash| {
                write(flash, CR, 0, 0);
                flash.store(PLACE, 4, 0);
            },
            sr::PGSERR,
        ),
        (|flash| write(flash, CR, PROGRAM | PAGE, 0), sr::PGSERR),
    ];
    for (breaks, flag) in cases {
        let mut flash = programming();
        breaks(&mut flash);
        assert_eq!(status(&mut flash), flag.mask);
        // An error that is not cleared makes the next one.
        write(&mut flash, CR, PROGRAM, 0);
        assert_eq!(program(&mut flash, PLACE, 1, ERASED), None);
        assert_eq!(status(&mut flash), flag.mask | sr::PGSERR.mask);
        write(&mut flash, SR, u32::MAX, 0);
        assert!(program(&mut flash, PLACE, 1, ERASED).is_some());
    }
}

#[test]
fn a_page_of_either_bank_is_erased_in_its_time() {
    for (control, address, size) in [
        (PAGE | cr::PNB.at(5), BASE + 5 * PAGE_BYTES, PAGE_BYTES),
        (PAGE | cr::BKER.mask | cr::PNB.at(127), BASE + 2 * BANK_BYTES - PAGE_BYTES, PAGE_BYTES),
        (bits(&[cr::MER2, cr::STRT]), BASE + BANK_BYTES, BANK_BYTES),
    ] {
        let mut flash = unlocked();
        write(&mut flash, CR, control, 50);
        assert_eq!((status(&mut flash), flash.deadline()), (sr::BSY.mask, 50 + ERASE_CYCLES));
        flash.advance(50 + ERASE_CYCLES);
        assert_eq!(flash.take_change(), Some(Change::Erased { address, size }));
    }
}

#[test]
fn the_end_and_errors_interrupt_where_that_is_wanted() {
    let mut flash = unlocked();
    write(&mut flash, CR, bits(&[cr::PG, cr::EOPIE, cr::ERRIE]), 0);
    assert!(program(&mut flash, PLACE, 1, ERASED).is_some());
    assert!(flash.requests());
    write(&mut flash, SR, sr::EOP.mask, 0);
    assert!(!flash.requests());
    flash.store(PLACE, 1, 0);
    assert!(flash.requests());
}

#[test]
fn power_lost_in_an_operation_leaves_half_of_it() {
    let mut flash = programming();
    flash.cut_power(Cut::Within(2));
    assert!(program(&mut flash, PLACE, 1, ERASED).is_some() && flash.ends_by().is_none());
    assert_eq!(program(&mut flash, PLACE + 8, 0x1111_2222_3333_4444, ERASED), None);
    assert_eq!(flash.ends_by(), Some(Cause::Power));
    let bytes = [0x44, 0x44, 0x33, 0x33, 0xFF, 0xFF, 0xFF, 0xFF];
    assert_eq!(flash.reset(), Some(Change::Programmed { address: PLACE + 8, bytes }));
    assert_eq!(flash.ends_by(), None, "it comes back and stays");
}

#[test]
fn an_operation_in_which_a_reset_comes_is_half_done_and_complete_before_a_loss_of_power() {
    assert_eq!(erased_until(Cut::Pulled(1)), (Some(Cause::Pin), PAGE_BYTES / 2));
    assert_eq!(erased_until(Cut::After(1)), (Some(Cause::Power), PAGE_BYTES));
}

/// Erases the first page until this ends it: what ended it, and how much is erased.
fn erased_until(cut: Cut) -> (Option<Cause>, u32) {
    let mut flash = unlocked();
    flash.cut_power(cut);
    write(&mut flash, CR, PAGE, 0);
    flash.advance(ERASE_CYCLES);
    let cause = flash.ends_by();
    let Some(Change::Erased { address: BASE, size }) = flash.reset() else {
        panic!("nothing erased at the beginning");
    };
    (cause, size)
}

#[test]
fn option_bytes_are_not_modelled() {
    let mut flash = unlocked();
    assert_eq!(
        flash.write(CR, Write { value: cr::OPTSTRT.mask, mask: u32::MAX }, 0),
        Err(Why::NoModel)
    );
}

#[test]
fn the_data_cache_is_off_during_an_operation_and_reset_after_it() {
    const CACHED: u32 = acr::DCEN.mask;
    const RESET: u32 = acr::DCRST.mask;
    let access = |flash: &mut Flash, value: u32| write(flash, ACR, value, 0);
    let hazards = |before: &[u32], after: &[u32]| {
        let mut flash = unlocked();
        before.iter().for_each(|value| access(&mut flash, *value));
        write(&mut flash, CR, PROGRAM, 0);
        program(&mut flash, PLACE, 1, ERASED).expect("programmed");
        after.iter().for_each(|value| access(&mut flash, *value));
        flash.cache_hazards
    };
    assert_eq!(hazards(&[], &[]), 1, "it is on after reset");
    assert_eq!(hazards(&[0], &[CACHED]), 1, "its content is old");
    assert_eq!(hazards(&[0], &[RESET, 0, CACHED]), 0);
    // A reset has no effect while it is on.
    let late = [CACHED, CACHED | RESET, 0, CACHED];
    assert_eq!(hazards(&[0], &late), 2);
}

#[test]
fn with_one_bank_a_page_has_four_kibibytes_and_the_bank_s_bit_no_meaning() {
    let mut flash = unlocked();
    flash.set_single_bank(true);
    assert_eq!(flash.read(OPTR, 0).map(|word| optr::DBANK.of(word)), Some(0));
    write(&mut flash, CR, PAGE | cr::BKER.mask | cr::PNB.at(124), 0);
    flash.advance(ERASE_CYCLES);
    let erased = Change::Erased { address: BASE + 124 * 4096, size: 4096 };
    assert_eq!(flash.take_change(), Some(erased));
    flash.reset();
    assert_eq!(
        flash.read(OPTR, 0).map(|word| optr::DBANK.of(word)),
        Some(0),
        "it is an option byte"
    );
}

#[test]
fn wrong_bits_are_reported_by_a_read_until_they_are_cleared() {
    let mut flash = Flash::default();
    flash.spoil(PLACE + 16, Wrong::Two);
    assert!(!flash.read_memory(PLACE + 12, 4) && !flash.read_memory(PLACE + 24, 4));
    assert!(flash.read_memory(PLACE + 14, 4), "it reaches into the double word");
    assert_eq!(flash.read(ECCR, 0), Some(bits(&[eccr::ECCD, eccr::BK_ECC]) | 2));
    assert!(!flash.read_memory(PLACE + 16, 4), "one report until it is cleared");
    write(&mut flash, ECCR, eccr::ECCD.mask, 0);
    assert!(!flash.has_two_wrong_bits());
    flash.reset();
    assert!(flash.read_memory(PLACE + 16, 1), "the memory keeps them");
}

#[test]
fn one_wrong_bit_is_corrected_and_noted() {
    let mut flash = Flash::default();
    flash.spoil(BASE + 24, Wrong::One);
    assert!(!flash.read_memory(BASE + 24, 4));
    assert_eq!(flash.read(ECCR, 0), Some(eccr::ECCC.mask | 3));
    write(&mut flash, ECCR, eccr::ECCC.mask, 0);
    assert_eq!(flash.read(ECCR, 0).map(|word| word >> 30), Some(0));
}

#[test]
fn what_loses_its_power_in_a_write_has_wrong_bits_until_it_is_erased() {
    let mut flash = programming();
    flash.store(PLACE, 4, 1);
    flash.store(PLACE + 4, 4, 2);
    flash.found(ERASED, 0);
    assert!(flash.reset().is_some());
    assert_eq!(flash.spoilt(), [(PLACE, 8)]);
    let mut erasing = |cut: bool| {
        for key in KEYS {
            write(&mut flash, KEYR, key, 0);
        }
        write(&mut flash, CR, PAGE | cr::BKER.mask, 0);
        if cut {
            flash.reset();
        } else {
            flash.advance(ERASE_CYCLES);
            flash.take_change();
        }
        flash.spoilt()
    };
    assert_eq!(erasing(true), [(PLACE + PAGE_BYTES / 2, PAGE_BYTES / 2)]);
    assert_eq!(erasing(false), []);
}
