//! A second implementation of the core, in pure Rust and by others, has its say: the
//! control tick gives the same bits on it, by as many instructions.
//!
//! `rsemu` 0.0.7 loses the state of conditional blocks and of the floating-point unit when
//! an interrupt comes, so that it is no engine for the firmware; here nothing interrupts.

use std::sync::Arc;

use hil_sim::firmware::{Profile, build_binary};
use hil_sim::scenario::Scenario;
use interstage_images::tick::{Preset, Taken};
use rig_board::cycles::{IMAGE, record};
use rig_board::elf::{FLASH, Loaded, RAM};
use rig_board::image::{ARGUMENTS, Image};
use rsemu::core::space::{AddressSpace, RamStore, Region, UnassignedPolicy};
use rsemu::cpu::arm::v7m::{ArmV7m, Config};

/// Where the host leaves arguments and takes answers.
const MAILBOX: u32 = ARGUMENTS;
const MAILBOX_BYTES: u32 = 1 << 20;
const ANSWERS: u32 = MAILBOX + 0x1000;
/// Where calls return to.
const RETURN: u32 = MAILBOX + MAILBOX_BYTES - 4;
/// The breakpoint instruction, at which the image waits to be called.
const BKPT: [u8; 2] = [0x00, 0xBE];
/// Most instructions of a call.
const PATIENCE: u64 = 100_000_000;

/// The measurement image on the other core.
struct Second {
    cpu: ArmV7m,
    mailbox: Arc<RamStore>,
    loaded: Loaded,
    stack: u32,
}

impl Second {
    fn start(elf: &[u8]) -> Self {
        let loaded = Loaded::of(elf).expect("an image");
        let space = AddressSpace::new("mem", 32).with_unassigned(UnassignedPolicy::FAULT);
        let store = |name, base: u32, bytes: u32| {
            let ram = Arc::new(RamStore::new(bytes.into()));
            let region = Region::ram(name, Arc::clone(&ram));
            space.topology().map(region, base.into()).expect("room");
            ram
        };
        let flash = store("flash", FLASH.base, FLASH.size);
        flash.write_at(0, &loaded.flash).expect("fits");
        store("ram", RAM.base, RAM.size);
        let mailbox = store("mailbox", MAILBOX, MAILBOX_BYTES);
        let mut config = Config::CORTEX_M4F;
        config.reset_vtor = FLASH.base;
        let cpu = ArmV7m::new(config);
        cpu.attach_space(Arc::new(space));
        cpu.step();
        let stack = cpu.reg(13);
        let second = Self { cpu, mailbox, loaded, stack };
        let waits = |at: u32| {
            let offset = at.wrapping_sub(FLASH.base) as usize;
            second.loaded.flash.get(offset..offset + 2) == Some(&BKPT[..])
        };
        second.run(waits);
        second
    }

    /// Runs until the program counter is at such a place; so many instructions.
    fn run(&self, over: impl Fn(u32) -> bool) -> u64 {
        for count in 0..PATIENCE {
            if over(self.cpu.pc()) {
                return count;
            }
            assert!(self.cpu.step() > 0 && !self.cpu.is_locked_up(), "at {:#x}", self.cpu.pc());
        }
        panic!("it does not end: at {:#x}", self.cpu.pc());
    }

    fn function(&self, name: &str) -> u32 {
        let found = self.loaded.functions.iter().find(|function| function.name == name);
        found.expect("a function").range.start
    }

    /// Calls a function; what it returns, and its instructions.
    fn call(&self, function: u32, argument: u32) -> (u32, u64) {
        self.cpu.set_reg(0, argument);
        self.cpu.set_reg(13, self.stack);
        self.cpu.set_reg(14, RETURN | 1);
        self.cpu.set_pc(function);
        let instructions = self.run(|at| at & !1 == RETURN);
        (self.cpu.reg(0), instructions)
    }

    fn put(&self, address: u32, words: &[u32]) {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        self.mailbox.write_at(u64::from(address - MAILBOX), &bytes).expect("fits");
    }

    fn get<const N: usize>(&self, address: u32) -> [u32; N] {
        std::array::from_fn(|word| {
            let at = u64::from(address - MAILBOX) + 4 * word as u64;
            let byte = |byte| self.mailbox.read_u8(at + byte).expect("there");
            u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])
        })
    }
}

#[test]
fn another_core_takes_the_same_instructions_to_the_same_bits() {
    if !hil_sim::testing::long() {
        return;
    }
    let path = build_binary(IMAGE.0, IMAGE.1, Profile::Release, &[]).expect("the image builds");
    let elf = std::fs::read(path).expect("readable");
    let second = Second::start(&elf);
    let mut first = Image::start(&elf).expect("an image");
    for sets in ["run.direction=deploy", "run.direction=retract"] {
        let scenario = Scenario::resolve(Some("prototype"), None, &[sets.to_owned()]);
        let ticks = record(&scenario.expect("a scenario")).expect("a run");
        let calls = ["tick_build", "tick_load", "tick_step", "tick_plan", "tick_save"];
        let [build, load, step, plan, save] = calls.map(|name| second.function(name));
        second.call(build, Preset::Prototype as u32);
        first.call(build, &[Preset::Prototype as u32]).expect("builds");
        for (number, tick) in ticks.iter().enumerate() {
            let words = tick.given.words();
            second.put(ARGUMENTS, &words);
            first.put(ARGUMENTS, &words).expect("a mailbox");
            for (function, argument) in [(load, ARGUMENTS), (step, 0), (plan, 0), (save, ANSWERS)] {
                let call = first.call(function, &[argument]).expect("returns");
                let (value, instructions) = second.call(function, argument);
                assert_eq!(instructions, call.meter.instructions, "tick {number}");
                if function == plan {
                    assert_eq!(value, call.value, "tick {number}");
                }
            }
            let taken = Taken::from_words(second.get(ANSWERS));
            assert_eq!(taken, tick.taken, "{sets}: tick {number}");
        }
    }
}
