//! The core and our interrupt controller, by a program that tests them from inside.

use hil_sim::firmware::{Profile, build_binary};
use rig_board::core::Register;
use rig_board::exceptions::number::INTERRUPT;
use rig_board::machine::Machine;

/// What the program checks, in its order.
const CHECKS: [&str; 15] = [
    "supervisor calls",
    "conditional blocks",
    "floating point kept across an interrupt",
    "a more urgent interrupt inside another",
    "PRIMASK",
    "BASEPRI",
    "WFI wakes for what is masked",
    "WFE and SEV",
    "process stack",
    "LDREX and STREX",
    "number of the exception",
    "one interrupt after the other",
    "square root, quotient, conversion",
    "compares while a timer interrupts",
    "cycle counter",
];

/// Enough for all of them.
const PATIENCE: u64 = 100_000_000;
/// TIM3's interrupt.
const TIM3: u8 = INTERRUPT + 29;

/// The board at the end of the checks.
fn checked() -> Machine {
    let path = build_binary("interstage-images", "selftest", Profile::Release, &[]);
    let elf = std::fs::read(path.expect("the image builds")).expect("readable");
    let mut machine = Machine::new(&elf).expect("an image");
    machine.chip_mut().defects.full_clock = true;
    let stop = machine.run_until(PATIENCE).expect("runs");
    assert!(stop.is_some() && machine.place().contains("main"), "ended in {}", machine.place());
    machine
}

#[test]
fn the_core_passes_its_own_test() {
    let machine = checked();
    let failed = machine.word(machine.image.symbol("FAILED").expect("a symbol")).expect("RAM");
    let failed: Vec<&str> =
        (0..CHECKS.len()).filter(|bit| failed >> bit & 1 != 0).map(|bit| CHECKS[bit]).collect();
    assert!(failed.is_empty(), "{failed:?}");
    assert_eq!(machine.chip().strays.count(), 0);
}

#[test]
fn a_conditional_block_may_be_interrupted_in_every_place() {
    let mut machine = checked();
    let symbol = |machine: &Machine, name| machine.image.symbol(name).expect("a symbol");
    let (given, returned) = (symbol(&machine, "GIVEN"), symbol(&machine, "RETURNED"));
    let functions = machine.image.functions.iter();
    let block = functions.filter(|f| f.name == "conditional").map(|f| f.range.clone()).next();
    let block = block.expect("a function");
    let mut interrupted = 0;
    for value in [0_u32, 1, 2, 5, 9, 0x40] {
        let wanted = reference(value);
        for place in (block.start..block.end).step_by(2) {
            machine.poke(given, &value.to_le_bytes()).expect("RAM");
            machine.poke(returned, &[0; 4]).expect("RAM");
            // After the breakpoint instruction at which the core stopped.
            machine.set_register(Register::Pc, machine.pc() + 2).expect("a register");
            let until = machine.now() + PATIENCE;
            if machine.run_to(place, until).expect("runs") {
                machine.chip_mut().system.exceptions.pend(TIM3);
                interrupted += 1;
                machine.run_until(until).expect("runs").expect("a breakpoint");
            }
            let got = machine.word(returned).expect("RAM");
            assert_eq!(got, wanted, "given {value}, interrupted at {place:#x}");
        }
    }
    assert!(interrupted > 6 * 12, "{interrupted}");
}

/// What the block computes.
fn reference(given: u32) -> u32 {
    let mut value = if given > 5 { given + 1100 } else { given + 3 };
    if value == 5 {
        value = ((value << 4) + 3) ^ 0x40;
    }
    value + if value & 1 != 0 { 0x1_0000 } else { 0x2_0000 }
}
