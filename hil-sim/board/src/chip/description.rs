//! The registers as ST describes them: names, addresses, values after reset, fields.
//!
//! Independent of the models: nothing in [`crate::peripherals`] reads it. The chip names
//! accesses by it and finds writes to reserved bits; a test compares the models with it.
//! Source: `data/stm32g474.csv`, made by `data/stm32g474.py`.

use std::ops::Range;
use std::sync::OnceLock;

static TABLE: &str = include_str!("../../data/stm32g474.csv");

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
    /// Its bits in the register.
    pub mask: u32,
    /// What a program can do with it.
    pub access: FieldAccess,
}

/// A register of a peripheral.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Register {
    /// Name of the peripheral.
    pub peripheral: &'static str,
    /// Name of the register.
    pub name: &'static str,
    pub address: u32,
    /// Value after reset.
    pub reset: u32,
    /// Fields, from the lowest bit on.
    pub fields: Vec<Field>,
}

impl Register {
    /// Bits of all fields that `of` accepts.
    pub fn bits(&self, of: impl Fn(&Field) -> bool) -> u32 {
        self.fields.iter().filter(|field| of(field)).fold(0, |bits, field| bits | field.mask)
    }
}

/// The description of the chip.
struct Table {
    /// In the order of their addresses; an offset with two layouts has two entries.
    registers: Vec<Register>,
    interrupts: Vec<(&'static str, u8)>,
}

/// A value of the table, decimal or hexadecimal.
fn number(text: &str) -> u32 {
    let value =
        text.strip_prefix("0x").map_or_else(|| text.parse(), |hex| u32::from_str_radix(hex, 16));
    value.expect("the table holds numbers")
}

fn field(text: &'static str) -> Field {
    let parts: Vec<&str> = text.split(':').collect();
    let [name, lowest, bits, access] = parts[..] else { panic!("a field: {text}") };
    let access = match access {
        "r" => FieldAccess::Read,
        "w" => FieldAccess::Write,
        "s" => FieldAccess::SetByOne,
        "c" => FieldAccess::ClearByOne,
        "z" => FieldAccess::ClearByZero,
        other => panic!("an access: {other}"),
    };
    Field { name, mask: (u32::MAX >> (32 - number(bits))) << number(lowest), access }
}

fn parse() -> Table {
    let lines = || TABLE.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let mut table = Table { registers: Vec::new(), interrupts: Vec::new() };
    for line in lines() {
        match line[..] {
            ["peripheral", peripheral, block, base] => {
                for line in lines() {
                    let ["register", of, name, offset, reset, fields] = line[..] else { continue };
                    if of == block {
                        table.registers.push(Register {
                            peripheral,
                            name,
                            address: number(base) + number(offset),
                            reset: number(reset),
                            fields: fields.split_whitespace().map(field).collect(),
                        });
                    }
                }
            }
            ["interrupt", name, line] => table.interrupts.push((name, number(line) as u8)),
            _ => {}
        }
    }
    table.registers.sort_by_key(|register| register.address);
    table
}

fn table() -> &'static Table {
    static PARSED: OnceLock<Table> = OnceLock::new();
    PARSED.get_or_init(parse)
}

/// All registers, in the order of their addresses.
pub fn registers() -> &'static [Register] {
    &table().registers
}

/// The layouts of the register at an address; none if no description has it.
pub fn at(address: u32) -> &'static [Register] {
    let registers = registers();
    let from = registers.partition_point(|register| register.address < address);
    let range: Range<usize> =
        from..from + registers[from..].iter().take_while(|r| r.address == address).count();
    &registers[range]
}

pub fn find(peripheral: &str, name: &str) -> Option<&'static Register> {
    registers().iter().find(|register| register.peripheral == peripheral && register.name == name)
}

/// Number of an interrupt.
pub fn interrupt(name: &str) -> Option<u8> {
    table().interrupts.iter().find(|(known, _)| *known == name).map(|(_, number)| *number)
}

/// Bits that a write to an address can change, and of the bits written as 1 those that no field
/// has and that are not 1 after reset. An address without a description has no reserved bits.
pub fn writable(address: u32, ones: u32) -> (u32, u32) {
    let layouts = at(address);
    if layouts.is_empty() {
        return (u32::MAX, 0);
    }
    let any = |of: &dyn Fn(&Register) -> u32| layouts.iter().fold(0, |bits, r| bits | of(r));
    let known = any(&|register| register.bits(|_| true) | register.reset);
    (any(&|register| register.bits(|field| field.access != FieldAccess::Read)), ones & !known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_register_is_found_by_name_and_by_address_with_its_fields() {
        let register = find("TIM8", "BDTR").expect("described");
        assert_eq!(register.address, 0x4001_3444);
        let moe = register.fields.iter().find(|field| field.name == "MOE").expect("described");
        assert_eq!((moe.mask, moe.access), (1 << 15, FieldAccess::Write));
        assert_eq!(at(0x4001_3418).len(), 2, "compare and capture");
        assert!(at(0x4001_0800).is_empty());
        assert_eq!(interrupt("DMA1_CH8"), Some(96));
    }

    #[test]
    fn a_reserved_bit_is_one_that_no_field_has() {
        let lock = find("GPIOC", "LCKR").expect("described").address;
        assert_eq!(writable(lock, 0xFFFE_0001), (0x1_FFFF, 0xFFFE_0000));
        assert_eq!(writable(0xE000_ED08, u32::MAX), (u32::MAX, 0), "not described");
        let control = find("RCC", "CR").expect("described").address;
        assert_eq!(writable(control, 1 << 10).0 & 1 << 10, 0, "HSIRDY is only read");
    }
}
