//! Power lost at every operation, and everything else that can be wrong.

use std::collections::BTreeSet;

use embassy_futures::block_on;
use proptest::prelude::*;

use super::super::{Header, MAX_SET, SCHEMA, compile};
use super::*;
use crate::rig::Rig;

/// Flash by its rules, whose power can fail.
#[derive(Clone)]
pub(in crate::params) struct Flash {
    slots: [Vec<u8>; 2],
    /// Operations left until the power fails.
    left: Option<usize>,
    /// Random bits of what an operation cut short leaves.
    noise: u64,
    operations: usize,
    /// Double words that cannot be read, by slot and offset.
    torn: BTreeSet<(usize, usize)>,
}

impl Flash {
    pub(in crate::params) fn blank() -> Self {
        let slots = [vec![0xFF; SLOT_BYTES], vec![0xFF; SLOT_BYTES]];
        let (noise, torn) = (0x9E37_79B9_7F4A_7C15, BTreeSet::new());
        Self { slots, left: None, noise, operations: 0, torn }
    }

    /// Turns a bit of this byte over in the place in force.
    pub(in crate::params) fn flip(&mut self, at: usize) {
        let slot = stored(self).expect("no damage").expect("a set").slot;
        self.slots[slot as usize][at] ^= 1;
    }

    fn random(&mut self) -> u64 {
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 7;
        self.noise ^= self.noise << 17;
        self.noise
    }

    /// How the operation goes: done, cut short, or never begun.
    fn operate(&mut self) -> Result<bool, Refusal> {
        self.operations += 1;
        match &mut self.left {
            None => Ok(true),
            Some(0) => Err(Refusal::Flash),
            Some(left) => {
                *left -= 1;
                Ok(*left > 0)
            }
        }
    }
}

impl SetMemory for Flash {
    fn bytes(&self, slot: Slot) -> &[u8] {
        &self.slots[slot as usize]
    }

    fn is_readable(&self, slot: Slot) -> bool {
        self.torn.iter().all(|(torn, _)| *torn != slot as usize)
    }

    async fn erase(&mut self, slot: Slot, page: usize) -> Result<(), Refusal> {
        let complete = self.operate()?;
        let range = page * PAGE_BYTES..(page + 1) * PAGE_BYTES;
        self.torn.retain(|(in_slot, at)| *in_slot != slot as usize || !range.contains(at));
        if !complete {
            self.torn.extend(range.clone().step_by(WORD_BYTES).map(|at| (slot as usize, at)));
        }
        for at in range {
            let bits = if complete { u64::MAX } else { self.random() };
            self.slots[slot as usize][at] |= bits as u8;
        }
        if complete { Ok(()) } else { Err(Refusal::Flash) }
    }

    async fn program(
        &mut self,
        slot: Slot,
        offset: usize,
        word: [u8; WORD_BYTES],
    ) -> Result<(), Refusal> {
        assert!(offset.is_multiple_of(WORD_BYTES), "{offset}");
        let complete = self.operate()?;
        let kept = if complete { 0 } else { self.random() };
        if !complete {
            self.torn.insert((slot as usize, offset));
        }
        let place = &mut self.slots[slot as usize][offset..offset + WORD_BYTES];
        assert!(place.iter().all(|byte| *byte == 0xFF), "programmed twice");
        for (index, (to, from)) in place.iter_mut().zip(word).enumerate() {
            *to = from | (kept >> (8 * index)) as u8;
        }
        if complete { Ok(()) } else { Err(Refusal::Flash) }
    }
}

pub(in crate::params) fn set(name: &str) -> Vec<u8> {
    compile(name, &Rig::prototype()).unwrap().to_vec()
}

/// Flash with this set alone.
fn holding(set: &[u8]) -> Flash {
    let mut flash = Flash::blank();
    block_on(save(&mut flash, set)).unwrap();
    flash
}

async fn save(flash: &mut Flash, set: &[u8]) -> Result<(), Refusal> {
    let mut draft = Draft::begin(flash, set.len()).await?;
    for piece in set.chunks(48) {
        draft.append(flash, piece).await?;
    }
    draft.seal(flash).await
}

fn name(flash: &Flash) -> Option<String> {
    let set = stored(flash).expect("no damage")?.set;
    let Header { name, .. } = ParameterSet::open(set).unwrap().header().clone();
    Some(name.as_str().to_owned())
}

#[test]
fn sets_take_turns() {
    let mut flash = Flash::blank();
    assert_eq!(stored(&flash), Ok(None));
    for round in 0..7 {
        let set = set(&format!("rig {round}"));
        block_on(save(&mut flash, &set)).unwrap();
        let now = stored(&flash).unwrap().unwrap();
        assert_eq!(now.set, set);
        assert_eq!(now.sequence, round + 1);
        assert_eq!(now.slot, if round % 2 == 0 { Slot::A } else { Slot::B });
    }
}

#[test]
fn a_place_written_from_outside_is_the_same() {
    let set = set("mine");
    let flash = holding(&set);
    assert_eq!(slot_image(&set, 1).unwrap(), *flash.bytes(Slot::A));
    assert_eq!(slot_image(&[0; MAX_SET + 1], 1), None);
}

#[test]
fn the_sequence_may_wrap() {
    let mut flash = holding(&set("old"));
    flash.slots[0][4..8].copy_from_slice(&u32::MAX.to_le_bytes());
    block_on(save(&mut flash, &set("new"))).unwrap();
    assert_eq!(name(&flash).as_deref(), Some("new"));
    assert_eq!(stored(&flash).unwrap().unwrap().sequence, 0);
}

#[test]
fn power_lost_at_any_operation_leaves_the_old_set_or_the_new() {
    let (old, new) = (set("old"), set("new"));
    for before in 1..=2 {
        let mut flash = Flash::blank();
        for _ in 0..before {
            block_on(save(&mut flash, &old)).unwrap();
        }
        let mut uncut = flash.clone();
        uncut.operations = 0;
        block_on(save(&mut uncut, &new)).unwrap();
        assert_eq!(name(&uncut).as_deref(), Some("new"));
        let (mut kept, mut torn_headers) = (0, 0);
        for cut in 0..uncut.operations {
            for seed in 1..=3 {
                let mut flash = flash.clone();
                flash.left = Some(cut);
                flash.noise = flash.noise.wrapping_mul(2 * seed + 1);
                assert_eq!(block_on(save(&mut flash, &new)), Err(Refusal::Flash), "{cut}");
                let mut after = Flash { left: None, ..flash };
                let before = name(&after);
                block_on(mend(&mut after)).unwrap();
                assert!(after.torn.is_empty(), "cut at {cut}: {:?}", after.torn);
                assert_eq!(name(&after), before, "cut at {cut}");
                match name(&after).as_deref() {
                    Some("old") => kept += 1,
                    // The last operation may have been complete in effect.
                    Some("new") if cut + 1 >= uncut.operations => torn_headers += 1,
                    other => panic!("cut at {cut}: {other:?}"),
                }
                // And the next save does it.
                block_on(save(&mut after, &new)).unwrap();
                assert_eq!(name(&after).as_deref(), Some("new"), "cut at {cut}");
            }
        }
        assert!(kept > 3 * (uncut.operations - 2), "{kept}, {torn_headers}");
    }
}

#[test]
fn a_damaged_set_in_force_is_neither_mended_away_nor_replaced_by_silence() {
    let mut flash = holding(&set("only"));
    flash.slots[0][500] ^= 3;
    flash.torn.insert((0, 496));
    block_on(mend(&mut flash)).unwrap();
    assert_eq!(stored(&flash), Err(Damaged(Slot::A)));
    assert!(!flash.torn.is_empty());
    block_on(save(&mut flash, &set("again"))).unwrap();
    assert_eq!(stored(&flash).unwrap().unwrap().slot, Slot::A);
}

#[test]
fn what_is_not_a_set_never_takes_force() {
    let mut flash = holding(&set("old"));
    let mut wrong = set("wrong");
    wrong[100] ^= 1;
    assert_eq!(block_on(save(&mut flash, &wrong)), Err(Refusal::Damaged));
    assert_eq!(name(&flash).as_deref(), Some("old"));

    let mut foreign = set("foreign");
    foreign[0] = SCHEMA as u8 + 1;
    foreign.truncate(foreign.len() - 4);
    foreign.extend(crate::log::crc32(&foreign).to_le_bytes());
    assert_eq!(block_on(save(&mut flash, &foreign)), Err(Refusal::Schema));
    assert_eq!(name(&flash).as_deref(), Some("old"));
}

#[test]
fn pieces_have_to_fit() {
    let mut flash = Flash::blank();
    assert_eq!(block_on(Draft::begin(&mut flash, MAX_SET + 1)), Err(Refusal::Length));
    let mut draft = block_on(Draft::begin(&mut flash, 20)).unwrap();
    let mut append = |piece: &[u8]| block_on(draft.append(&mut flash, piece));
    assert_eq!(append(&[0; 7]), Err(Refusal::Piece));
    assert_eq!(append(&[0; 24]), Err(Refusal::Length));
    assert_eq!(append(&[0; 16]), Ok(()));
    assert_eq!(append(&[0; 4]), Ok(()));
    assert_eq!(append(&[0; 1]), Err(Refusal::Length));
    let short = block_on(Draft::begin(&mut flash, 20)).unwrap();
    assert_eq!(block_on(short.seal(&mut flash)), Err(Refusal::Length));
}

proptest! {
    #[test]
    fn a_number_stored_long_ago_is_told_from_its_neighbours(sequence: u32, bit in 0..32) {
        prop_assert_ne!(fold(sequence), fold(sequence ^ 1_u32 << bit));
        prop_assert_ne!(fold(sequence), fold(sequence.wrapping_add(2)));
    }

    #[test]
    fn a_flipped_bit_is_told_or_changes_nothing(
        at in 0..SLOT_BYTES, bit in 0_u8..8, first: u32, in_b: bool, spare: bool,
    ) {
        flip(in_b, first, spare, 8 * at + usize::from(bit));
    }
}

/// Turns a bit over in the place in force or in the spare one, and judges what is in force.
fn flip(in_b: bool, first: u32, spare: bool, bit: usize) {
    let (old, new) = (set("old"), set("new"));
    let mut flash = Flash::blank();
    let (to, from) = if in_b { (1, 0) } else { (0, 1) };
    flash.slots[from] = slot_image(&old, first).unwrap().to_vec();
    flash.slots[to] = slot_image(&new, first.wrapping_add(1)).unwrap().to_vec();
    assert_eq!(name(&flash).as_deref(), Some("new"));
    flash.slots[if spare { from } else { to }][bit / 8] ^= 1 << (bit % 8);
    let filler = bit / 8 >= PREFIX + new.len();
    match stored(&flash) {
        Ok(found) => {
            assert_eq!(found.map(|stored| stored.set), Some(&new[..]), "bit {bit}");
            assert!(spare || filler, "bit {bit} went unseen");
        }
        Err(Damaged(slot)) => {
            assert!(!spare && !filler, "bit {bit} of the spare set stops the drive");
            assert_eq!(slot as usize, to);
        }
    }
    // Whatever it was, the next save is in force.
    let next = set("next");
    block_on(save(&mut flash, &next)).unwrap();
    assert_eq!(name(&flash).as_deref(), Some("next"), "bit {bit}");
}

#[test]
fn every_bit_of_seal_and_length_is_guarded() {
    for bit in 0..8 * PREFIX {
        for (in_b, first) in [(false, 1), (true, 2), (true, 7), (false, 0xFFFE), (true, 0x1_FFFE)] {
            for spare in [false, true] {
                flip(in_b, first, spare, bit);
            }
        }
    }
}

#[test]
fn a_place_of_earlier_firmware_without_a_fold_is_read() {
    let mut flash = Flash::blank();
    let set = set("old");
    flash.slots[0] = slot_image(&set, 7).unwrap().to_vec();
    let length = set.len() as u32;
    flash.slots[0][8..16].copy_from_slice(&pair(length, !length));
    assert_eq!(name(&flash).as_deref(), Some("old"));
    block_on(save(&mut flash, &self::set("new"))).unwrap();
    assert_eq!(name(&flash).as_deref(), Some("new"));
    // Out of force, and damaged: its number still shows that.
    flash.slots[0][500] ^= 1;
    assert_eq!(name(&flash).as_deref(), Some("new"));
}
