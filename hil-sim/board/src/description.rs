//! The registers as ST describes them: names, addresses, values after reset, fields.
//!
//! The one place of the registers' positions: the models take them from here, the chip names
//! accesses by it and finds writes to reserved bits. `build.rs` makes constants of
//! `data/stm32g474.csv`, which `data/stm32g474.py` makes of ST's SVD.
//!
//! The models stay independent of what the firmware expects: a description has positions and
//! no behaviour, which is written in [`crate::peripherals`] from the reference manual. Nor is it the
//! firmware's own, whose registers come from `stm32-metapac`, a table kept by hand since it was
//! taken from such an SVD. With the types of that crate an error in it would be the model's too;
//! so it shows as an access to a reserved bit, to a register that no model has, or as a failed run.

include!(concat!(env!("OUT_DIR"), "/description.rs"));

/// What a program can do with a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldAccess {
    /// Only read it.
    Read,
    /// Write a value.
    Write,
    /// Set it or start something by a 1.
    SetByOne,
    ClearByOne,
    ClearByZero,
}

/// A field of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    pub name: &'static str,
    /// Offset of its register in the block, bytes.
    pub register: u32,
    /// Its bits in the register.
    pub mask: u32,
    /// What a program can do with it.
    pub access: FieldAccess,
}

impl Field {
    const fn new(name: &'static str, register: u32, lowest: u32, bits: u32, access: char) -> Self {
        let access = match access {
            'r' => FieldAccess::Read,
            'w' => FieldAccess::Write,
            's' => FieldAccess::SetByOne,
            'c' => FieldAccess::ClearByOne,
            'z' => FieldAccess::ClearByZero,
            _ => panic!("no access"),
        };
        Self { name, register, mask: (u32::MAX >> (32 - bits)) << lowest, access }
    }

    /// Its value in a register with this content.
    pub const fn of(self, word: u32) -> u32 {
        (word & self.mask) >> self.mask.trailing_zeros()
    }

    /// A value in its place.
    pub const fn at(self, value: u32) -> u32 {
        value << self.mask.trailing_zeros() & self.mask
    }

    /// Whether it is other than 0 in a register with this content.
    pub const fn is_in(self, word: u32) -> bool {
        word & self.mask != 0
    }
}

pub const fn bits(fields: &[Field]) -> u32 {
    let (mut bits, mut at) = (0, 0);
    while at < fields.len() {
        bits |= fields[at].mask;
        at += 1;
    }
    bits
}

/// A register of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    pub name: &'static str,
    /// Offset in the block, bytes.
    pub offset: u32,
    /// Value after reset.
    pub reset: u32,
    /// Fields, from the lowest bit on.
    pub fields: &'static [Field],
    /// Bits of all fields.
    pub known: u32,
    /// Bits that a program can change.
    pub writable: u32,
}

impl Register {
    const fn new(name: &'static str, offset: u32, reset: u32, fields: &'static [Field]) -> Self {
        let (mut writable, mut at) = (0, 0);
        while at < fields.len() {
            if !matches!(fields[at].access, FieldAccess::Read) {
                writable |= fields[at].mask;
            }
            at += 1;
        }
        Self { name, offset, reset, fields, known: bits(fields), writable }
    }
}

/// A peripheral at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Peripheral {
    pub name: &'static str,
    /// Address of its first register.
    pub address: u32,
    /// Its registers by their offsets; one with two layouts has two entries.
    pub registers: &'static [Register],
}

/// The peripheral to which an address belongs, and the layouts of the register there.
pub fn at(address: u32) -> Option<(Peripheral, impl Iterator<Item = &'static Register> + Clone)> {
    let after = PERIPHERALS.partition_point(|of| of.address <= address);
    let of = PERIPHERALS[after.checked_sub(1)?];
    Some((of, of.registers.iter().filter(move |layout| of.address + layout.offset == address)))
}

/// A register with its address.
pub fn find(peripheral: &str, name: &str) -> Option<(u32, &'static Register)> {
    let of = PERIPHERALS.iter().find(|of| of.name == peripheral)?;
    let register = of.registers.iter().find(|register| register.name == name)?;
    Some((of.address + register.offset, register))
}

/// Number of an interrupt.
pub fn interrupt(name: &str) -> Option<u8> {
    INTERRUPTS.iter().find(|(known, _)| *known == name).map(|(_, number)| *number)
}

/// Bits that a write to an address can change, and of the bits written as 1 those that no field
/// has and that are not 1 after reset. An address without a description has no reserved bits.
pub(crate) fn writable(address: u32, ones: u32) -> (u32, u32) {
    match at(address) {
        Some((_, layouts)) if layouts.clone().next().is_some() => {
            let known = layouts.clone().fold(0, |bits, layout| bits | layout.known | layout.reset);
            (layouts.fold(0, |bits, layout| bits | layout.writable), ones & !known)
        }
        _ => (u32::MAX, 0),
    }
}
