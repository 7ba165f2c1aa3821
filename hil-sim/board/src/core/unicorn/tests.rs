//! Small pieces of machine code, with cycles counted by hand.

use super::*;
use crate::timing::REFILL;

const FLASH: u32 = 0x0800_0000;
const RAM: u32 = 0x2000_0000;

/// A core with this code at the beginning of flash and a breakpoint after it.
fn core(code: &[u16]) -> UnicornCore {
    let mut bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
    bytes.extend([0x00, 0xBE]);
    let range = FLASH..FLASH + bytes.len() as u32;
    bytes.resize(0x1000, 0);
    let memories = [
        Memory { base: FLASH, size: 0x1000, access: Access::Code },
        Memory { base: RAM, size: 0x1000, access: Access::Data },
    ];
    let counted = Counted { base: FLASH, bytes: &bytes, code: std::slice::from_ref(&range) };
    let mut core = UnicornCore::new(&memories, &counted, NoBus).expect("a core");
    core.set_register(Register::R(0), RAM).expect("set");
    core.set_register(Register::Sp, RAM + 0x1000).expect("set");
    core
}

/// Cycles and instructions of the code, the breakpoint's own taken off.
fn cost(core: &mut UnicornCore) -> (u64, u64) {
    let before = core.meter();
    let stop = core.run(FLASH, 10_000).expect("runs");
    assert!(matches!(stop, Stop::Breakpoint(_)), "{stop:?}");
    let spent = core.meter().since(before);
    (spent.cycles - 1, spent.instructions - 1)
}

/// Code, contents of registers, cycles and instructions.
type Priced = (&'static [u16], &'static [(u8, u32)], (u64, u64));

#[test]
fn code_costs_its_cycles() {
    /// cmp r1, #0; beq to the breakpoint; nop
    const BRANCH: &[u16] = &[0x2900, 0xD000, 0xBF00];
    /// cmp r1, #0; itt eq; ldmeq r0, {r2, r3, r4}; udiveq r5, r6, r7
    const CONDITIONAL: &[u16] = &[0x2900, 0xBF04, 0xE890, 0x001C, 0xFBB6, 0xF5F7];
    /// sdiv r1, r2, r3
    const DIVISION: &[u16] = &[0xFB92, 0xF1F3];
    /// udiv r1, r2, r3
    const UNSIGNED: &[u16] = &[0xFBB2, 0xF1F3];
    let cases: [Priced; 12] = [
        // adds r1, r1, #1; ldr r2, [r0]; push {r1, r2, r3}; ldrd r4, r5, [r0]
        (&[0x3101, 0x6802, 0xB40E, 0xE9D0, 0x4500], &[], (1 + 2 + 4 + 3, 4)),
        (BRANCH, &[(1, 0)], (2 + REFILL, 2)),
        (BRANCH, &[(1, 1)], (3, 3)),
        // What a condition skips costs one cycle.
        (CONDITIONAL, &[(1, 1)], (4, 4)),
        (CONDITIONAL, &[(1, 0), (6, u32::MAX), (7, 1)], (2 + 4 + 12, 4)),
        (DIVISION, &[(2, -5_i32 as u32), (3, 7)], (2, 1)),
        (DIVISION, &[(2, -1_i32 as u32), (3, 1)], (3, 1)),
        (DIVISION, &[(2, i32::MIN as u32), (3, 1)], (12, 1)),
        (UNSIGNED, &[(2, 5), (3, 0)], (2, 1)),
        (UNSIGNED, &[(2, u32::MAX), (3, 1)], (12, 1)),
        // movs r1, #3; subs r1, #1; bne to the subtraction
        (&[0x2103, 0x3901, 0xD1FD], &[], (1 + 3 * 2 + 2 * REFILL, 7)),
        // vdiv.f32 s0, s1, s2; vadd.f32 s0, s0, s1; vfma.f32 s0, s1, s2
        (&[0xEE80, 0x0A81, 0xEE30, 0x0A20, 0xEEA0, 0x0A81], &[], (14 + 1 + 3, 3)),
    ];
    for (code, registers, expected) in cases {
        let mut core = core(code);
        for (register, value) in registers {
            core.set_register(Register::R(*register), *value).expect("set");
        }
        assert_eq!(cost(&mut core), expected, "{code:x?} {registers:x?}");
    }
}

#[test]
fn a_loop_without_end_is_stopped_when_its_cycles_are_spent() {
    // b to itself
    let mut core = core(&[0xE7FE]);
    assert_eq!(core.run(FLASH, 1_000), Ok(Stop::Spent(FLASH)));
    assert!((1_000..1_004).contains(&core.meter().cycles));
}

#[test]
fn an_access_to_nothing_names_its_place() {
    // nop; ldr r1, [r2]
    let mut core = core(&[0xBF00, 0x6811]);
    core.set_register(Register::R(2), 0x4000_0000).expect("set");
    let stop = core.run(FLASH, 1_000).expect("stops");
    assert_eq!(stop, Stop::Fault { at: FLASH + 2, fault: Fault::Read });
}

#[test]
fn a_page_first_met_in_a_conditional_block_leaves_no_condition_behind() {
    // cmp r1, #0; ittt eq; ldreq r2, [r0]; streq r2, [r0, #4]; moveq r3, #7;
    // b over a nop; movs r4, #5; adds r4, #1
    let code = [0x2900, 0xBF02, 0x6802, 0x6042, 0x2307, 0xE000, 0xBF00, 0x2405, 0x3401];
    let mut core = core(&code);
    core.set_register(Register::R(1), 0).expect("set");
    core.write(RAM, &9_u32.to_le_bytes()).expect("RAM");
    cost(&mut core);
    let registers = [2, 3, 4].map(|r| core.register(Register::R(r)).expect("a register"));
    assert_eq!(registers, [9, 7, 6]);
}

#[test]
fn a_program_may_write_what_it_runs_in_ram() {
    // str r2, [r0]; bx r3, with `movs r5, #1; bx lr` and then `movs r5, #2; bx lr` in r2
    let mut core = core(&[0x6002, 0x4718]);
    core.set_register(Register::R(3), RAM | 1).expect("set");
    core.set_register(Register::Lr, (FLASH + 4) | 1).expect("set");
    for value in [1, 2, 1, 3] {
        core.set_register(Register::R(2), 0x4770_2500 | value).expect("set");
        let stop = core.run(FLASH, 10_000).expect("runs");
        assert_eq!(stop, Stop::Breakpoint(FLASH + 4));
        assert_eq!(core.register(Register::R(5)), Ok(value));
    }
}

#[test]
fn a_counted_read_in_a_conditional_block_leaves_no_condition_behind() {
    // cmp r1, #0; itt ne; ldrbne r2, [r0], #1; cmpne r0, r3; beq.w to the breakpoint;
    // movs r4, #5; adds r4, #1. The branch lies across two pages: a block of its own.
    let piece = [0x2900, 0xBF1C, 0xF810, 0x2B01, 0x4298, 0xF000, 0x8001, 0x2405, 0x3401];
    let mut code = vec![0xBF00; (0x400 - 12) / 2];
    code.extend(piece);
    let mut core = core(&code);
    core.count_waits(Memory { base: FLASH, size: 0x1000, access: Access::Code }).expect("set");
    for (register, value) in [(0, FLASH), (1, 1), (3, 0)] {
        core.set_register(Register::R(register), value).expect("set");
    }
    cost(&mut core);
    assert_eq!(core.register(Register::R(4)), Ok(6));
}
