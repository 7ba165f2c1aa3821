//! The models' registers against ST's description of the chip.

mod exceptions;

use std::collections::BTreeSet;
use std::process::Command;

use rig_board::chip::Chip;
use rig_board::chip::description::{self, Field, FieldAccess, Register};
use rig_board::core::{Access, Bus};

use exceptions::{FIELDS, RESETS};

/// Runs with the chip's accesses.
struct Prober(Chip);

impl Prober {
    /// After power-up; with the clocks on and the locks open unless `reset` values are wanted.
    fn new(locked: bool) -> Self {
        let mut prober = Self(Chip::new(0x0800_0000));
        if !locked {
            for name in ["AHB1ENR", "AHB2ENR", "APB1ENR1", "APB2ENR"] {
                let enable = description::find("RCC", name).expect("described");
                prober.write(enable.address, enable.bits(|_| true));
            }
            let key =
                |peripheral, name| description::find(peripheral, name).expect("described").address;
            for word in [0x4567_0123, 0xCDEF_89AB] {
                prober.write(key("FLASH", "KEYR"), word);
            }
            prober.write(key("IWDG", "KR"), 0x5555);
        }
        prober
    }

    const fn access(address: u32) -> Access {
        Access { address, size: 4, pc: 0, now: 1000 }
    }

    /// A word; none if no model answers.
    fn read(&mut self, address: u32) -> Option<u32> {
        let before = self.0.strays().count();
        let value = self.0.read(Self::access(address));
        (self.0.strays().count() == before).then_some(value)
    }

    /// Whether a model takes this word.
    fn write(&mut self, address: u32, value: u32) -> bool {
        let before = self.0.strays().count();
        self.0.write(Self::access(address), value);
        self.0.strays().count() == before
    }
}

/// The register's name with its peripheral's.
fn name(register: &Register) -> String {
    format!("{}.{}", register.peripheral, register.name)
}

/// The reason why this may differ; `*` in the list is any part of a name.
fn reason(
    list: &[(&'static str, &'static str)],
    name: &str,
    used: &mut BTreeSet<&'static str>,
) -> Option<&'static str> {
    let covers = |pattern: &str| {
        let mut rest = name;
        let mut parts = pattern.split('*').enumerate().peekable();
        while let Some((index, part)) = parts.next() {
            let at = if index == 0 {
                rest.starts_with(part).then_some(0)
            } else if parts.peek().is_none() {
                rest.len().checked_sub(part.len()).filter(|_| rest.ends_with(part))
            } else {
                rest.find(part)
            };
            let Some(at) = at else { return false };
            rest = &rest[at + part.len()..];
        }
        rest.is_empty()
    };
    let (pattern, reason) = list.iter().find(|(patterns, _)| patterns.split(' ').any(covers))?;
    used.insert(pattern);
    Some(reason)
}

/// Asserts that nothing differs without a reason, and that every reason is needed.
fn assert_listed(
    what: &str,
    list: &[(&'static str, &'static str)],
    differences: &[(String, String)],
    compared: usize,
    absent: usize,
) {
    let mut used = BTreeSet::new();
    let unexplained: Vec<_> =
        differences.iter().filter(|(name, _)| reason(list, name, &mut used).is_none()).collect();
    let listed = differences.len() - unexplained.len();
    println!("{what}: {compared} compared, {listed} listed exceptions, {absent} that no model has");
    let needless: Vec<_> = list.iter().filter(|(pattern, _)| !used.contains(pattern)).collect();
    assert!(unexplained.is_empty(), "{}: {unexplained:#?}", unexplained.len());
    assert!(needless.is_empty(), "without a difference: {needless:#?}");
}

#[test]
fn values_after_reset_are_those_of_the_description() {
    let (mut compared, mut absent, mut differences) = (0, 0, Vec::new());
    for register in description::registers() {
        let mut chip = Prober::new(register.peripheral == "RCC");
        if register.peripheral == "FLASH" || register.peripheral == "IWDG" {
            chip = Prober::new(true);
        }
        let Some(got) = chip.read(register.address) else {
            absent += 1;
            continue;
        };
        compared += 1;
        if got != register.reset {
            let how = format!("{got:#010x}, described {:#010x}", register.reset);
            differences.push((name(register), how));
        }
    }
    assert_listed("Values after reset", &RESETS, &differences, compared, absent);
    assert!(compared > 380, "{compared}");
}

/// How the model of a register treats a field, if that is not as described.
fn difference(register: &Register, field: &Field) -> Option<&'static str> {
    let address = register.address;
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
fn fields_are_where_the_description_has_them() {
    let (mut compared, mut absent, mut differences) = (0, 0, Vec::new());
    for register in description::registers() {
        if Prober::new(false).read(register.address).is_none() {
            absent += register.fields.len();
            continue;
        }
        for field in &register.fields {
            compared += 1;
            if let Some(how) = difference(register, field) {
                differences.push((format!("{}.{}", name(register), field.name), how.to_owned()));
            }
        }
        // Layouts of one offset share its bits.
        let layouts = description::at(register.address);
        let known = layouts.iter().fold(0, |bits, layout| bits | layout.bits(|_| true));
        let mut chip = Prober::new(false);
        let before = chip.read(register.address);
        if chip.write(register.address, !known | before.unwrap_or(0)) {
            let kept = chip.read(register.address).unwrap_or(0) & !known & !register.reset;
            if kept != 0 {
                differences.push((name(register), format!("keeps reserved bits {kept:#010x}")));
            }
        }
    }
    assert_listed("Fields", &FIELDS, &differences, compared, absent);
    assert!(compared > 3000, "{compared}");
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
    let strays = board.machine().chip().strays();
    let texts: Vec<_> = strays.iter().map(ToString::to_string).collect();
    assert!(texts.is_empty(), "{texts:#?}");
    let accepted: Vec<_> = strays.accepted().map(|stray| (stray.peripheral, stray.name)).collect();
    assert_eq!(accepted, [("RCC", "CFGR"), ("TIM2", "SR")]);
}
