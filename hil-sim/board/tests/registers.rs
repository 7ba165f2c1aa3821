//! The models' behaviour against ST's description: what they read after power-up, and what a write
//! of each field alone changes. The positions are the description's own.

mod exceptions;

use std::collections::BTreeSet;
use std::process::Command;

use rig_board::chip::Chip;
use rig_board::core::{Access, Bus};
use rig_board::description::{self, Field, FieldAccess};

use exceptions::EXCEPTIONS;

/// Runs with the chip's accesses.
struct Prober(Chip);

impl Prober {
    /// After power-up; with the clocks on and the locks open unless `locked`.
    fn new(locked: bool) -> Self {
        let mut prober = Self(Chip::new(0x0800_0000));
        let opened = [
            ("RCC", "AHB1ENR", u32::MAX),
            ("RCC", "AHB2ENR", u32::MAX),
            ("RCC", "APB1ENR1", u32::MAX),
            ("RCC", "APB2ENR", u32::MAX),
            ("FLASH", "KEYR", 0x4567_0123),
            ("FLASH", "KEYR", 0xCDEF_89AB),
            ("IWDG", "KR", 0x5555),
        ];
        for (peripheral, name, word) in opened.into_iter().filter(|_| !locked) {
            let (address, register) = description::find(peripheral, name).expect("described");
            prober.write(address, word & register.known);
        }
        prober
    }

    const fn access(address: u32) -> Access {
        Access { address, size: 4, pc: 0, now: 1000 }
    }

    /// A word; none if no model answers.
    fn read(&mut self, address: u32) -> Option<u32> {
        let before = self.0.strays.count();
        let value = self.0.read(Self::access(address));
        (self.0.strays.count() == before).then_some(value)
    }

    /// Whether a model takes this word.
    fn write(&mut self, address: u32, value: u32) -> bool {
        let before = self.0.strays.count();
        self.0.write(Self::access(address), value);
        self.0.strays.count() == before
    }
}

/// Whether a pattern covers a name, part by part; a part may end with `*` for any ending.
fn covers(pattern: &str, name: &str) -> bool {
    let (patterns, parts) = (pattern.split('.'), name.split('.'));
    let is_covered = |(pattern, part): (&str, &str)| {
        pattern.strip_suffix('*').map_or(part == pattern, |start| part.starts_with(start))
    };
    patterns.clone().count() == parts.clone().count() && patterns.zip(parts).all(is_covered)
}

/// How the model of a register treats a field, if that is not as described.
fn difference(address: u32, field: &Field) -> Option<&'static str> {
    let fresh = || Prober::new(false);
    let before = fresh().read(address)?;
    let after = |word: u32| {
        let mut chip = fresh();
        chip.write(address, word).then(|| chip.read(address)).flatten()
    };
    // A write that the model refuses is reported when it happens.
    let (set, cleared) = (after(before | field.mask), after(before & !field.mask));
    let kept = |word: Option<u32>, bits: u32| word.is_none_or(|word| word & field.mask == bits);
    let spills = |word: Option<u32>| word.is_some_and(|word| (word ^ before) & !field.mask != 0);
    let old = before & field.mask;
    match field.access {
        FieldAccess::Read if !kept(set, old) || !kept(cleared, old) => Some("can be written"),
        FieldAccess::Write if !kept(set, field.mask) => Some("does not keep ones"),
        FieldAccess::Write if !kept(cleared, 0) => Some("does not keep zeros"),
        FieldAccess::ClearByOne | FieldAccess::ClearByZero
            if !kept(set, 0) && !kept(cleared, 0) =>
        {
            Some("is not cleared")
        }
        _ if spills(set) || spills(cleared) => Some("changes other bits"),
        _ => None,
    }
}

#[test]
fn values_after_reset_and_fields_are_those_of_the_description() {
    let (mut registers, mut fields, mut differences) = (0, 0, Vec::new());
    for peripheral in description::PERIPHERALS {
        let locked = ["RCC", "FLASH", "IWDG"].contains(&peripheral.name);
        for register in peripheral.registers {
            let address = peripheral.address + register.offset;
            let name = format!("{}.{}", peripheral.name, register.name);
            let Some(reset) = Prober::new(locked).read(address) else { continue };
            registers += 1;
            if reset != register.reset {
                let how = format!("{reset:#010x}, described {:#010x}", register.reset);
                differences.push((name.clone(), how));
            }
            for field in register.fields {
                fields += 1;
                if let Some(how) = difference(address, field) {
                    differences.push((format!("{name}.{}", field.name), how.to_owned()));
                }
            }
            // Layouts of one offset share its bits.
            let (_, layouts) = description::at(address).expect("described");
            let known = layouts.fold(0, |bits, layout| bits | layout.known);
            let mut chip = Prober::new(false);
            let before = chip.read(address);
            if chip.write(address, !known | before.unwrap_or(0)) {
                let kept = chip.read(address).unwrap_or(0) & !known & !register.reset;
                if kept != 0 {
                    differences.push((name, format!("keeps reserved bits {kept:#010x}")));
                }
            }
        }
    }
    let mut used = BTreeSet::new();
    differences.retain(|(name, _)| {
        let is_known = |pattern: &&str| covers(pattern, name);
        let known = EXCEPTIONS.iter().flat_map(|(patterns, _)| patterns.split(' ')).find(is_known);
        used.extend(known);
        known.is_none()
    });
    assert!(differences.is_empty(), "{}: {differences:#?}", differences.len());
    let listed = EXCEPTIONS.iter().flat_map(|(patterns, _)| patterns.split(' '));
    let needless: Vec<_> = listed.filter(|pattern| !used.contains(pattern)).collect();
    assert!(needless.is_empty(), "without a difference: {needless:#?}");
    assert!(registers > 380 && fields > 3000, "{registers} registers, {fields} fields");
}

/// Cargo fetches the crate: only with `--long`.
#[test]
fn the_table_is_what_its_script_makes_of_the_crate() {
    if !hil_sim::testing::long() {
        return;
    }
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data/");
    let made = Command::new("python3").arg(format!("{folder}stm32g474.py")).output();
    let made = made.expect("Python 3");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let kept = std::fs::read(format!("{folder}stm32g474.csv")).expect("readable");
    assert!(made.stdout == kept, "data/stm32g474.csv is not what data/stm32g474.py writes");
}

/// Power-up and the first start; whole runs are held to the same in `firmware.rs`.
#[test]
fn the_firmware_keeps_to_the_description_and_the_rules_but_for_what_its_libraries_do() {
    let mut board = crate::common::Board::idle();
    let strays = &board.machine().chip().strays;
    let texts: Vec<_> = strays.iter().map(ToString::to_string).collect();
    assert!(texts.is_empty(), "{texts:#?}");
    let accepted: Vec<_> = strays.accepted().map(|stray| (stray.peripheral, stray.name)).collect();
    assert_eq!(accepted, [("RCC", "CFGR"), ("TIM2", "SR")]);
}
