//! Which function of an image branches to which.

use std::collections::{BTreeMap, VecDeque};

use rig_board::elf::{FLASH, Function, Loaded, function_at};
use rig_board::thumb;

/// A branch out of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Branch {
    pub(super) from: u32,
    /// The function that it leads to; none if a register says where.
    pub(super) to: Option<usize>,
}

/// Functions, and what each branches to.
pub(super) struct Graph {
    /// In the order of their addresses.
    pub(super) functions: Vec<Function>,
    /// Branches of the function of the same number.
    pub(super) branches: Vec<Vec<Branch>>,
}

/// What an instruction does to the flow of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flow {
    /// Continues with the next one, or inside the function by a table.
    On,
    /// Branches there, perhaps coming back.
    To(u32),
    /// Branches where a register says.
    Register,
}

/// `bits` of a number with sign.
fn signed(value: u32, bits: u32) -> u32 {
    ((value << (32 - bits)) as i32 >> (32 - bits)) as u32
}

/// The flow of the instruction in `halves` at `address`.
///
/// Source: ARMv7-M Architecture Reference Manual, A7.7.12 (B), A7.7.18 (BL), A7.7.19
/// (BLX), A7.7.20 (BX).
fn flow(a: u16, b: Option<u16>, address: u32) -> Flow {
    let pc = address.wrapping_add(4);
    let Some(b) = b else {
        return match a {
            _ if a & 0xFF00 == 0xDE00 || a & 0xFF00 == 0xDF00 => Flow::On,
            _ if a & 0xF000 == 0xD000 => {
                Flow::To(pc.wrapping_add(signed(u32::from(a & 0xFF) << 1, 9)))
            }
            _ if a & 0xF800 == 0xE000 => {
                Flow::To(pc.wrapping_add(signed(u32::from(a & 0x7FF) << 1, 12)))
            }
            // BLX, MOV into the program counter; BX of anything but the link register, which returns.
            _ if matches!(a & 0xFF87, 0x4780 | 0x4687) => Flow::Register,
            _ if a & 0xFF87 == 0x4700 && a & 0x78 != 0x70 => Flow::Register,
            _ => Flow::On,
        };
    };
    // Loads of the program counter from anywhere but the stack.
    if matches!(a & 0xFFF0, 0xF8D0 | 0xF850) && b >> 12 == 0xF && a & 0xF != 0xD {
        return Flow::Register;
    }
    if a & 0xF800 != 0xF000 || b & 0x8000 == 0 {
        return Flow::On;
    }
    let (s, j1, j2) = (u32::from(a >> 10 & 1), u32::from(b >> 13 & 1), u32::from(b >> 11 & 1));
    let low = u32::from(b & 0x7FF) << 1;
    if b & 0x1000 != 0 {
        // BL and the long B: 24 bits of offset.
        let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
        let offset = s << 24 | i1 << 23 | i2 << 22 | u32::from(a & 0x3FF) << 12 | low;
        return Flow::To(pc.wrapping_add(signed(offset, 25)));
    }
    // Under a condition; 0b111x are system instructions.
    if b & 0x4000 == 0 && a >> 7 & 7 != 7 {
        let offset = s << 20 | j2 << 19 | j1 << 18 | u32::from(a & 0x3F) << 12 | low;
        return Flow::To(pc.wrapping_add(signed(offset, 21)));
    }
    Flow::On
}

impl Graph {
    /// Reads the code of an image.
    pub(super) fn of(elf: &[u8]) -> Self {
        let image = Loaded::of(elf).expect("an image");
        let functions = image.functions.clone();
        let branches = functions.iter().map(|function| branches(&image, &functions, function));
        Self { branches: branches.collect(), functions }
    }

    /// Everything that can be reached from the roots, with the path, the root
    /// first; not through functions that `ends` picks.
    pub(super) fn reach(
        &self,
        roots: &[usize],
        ends: &dyn Fn(&str) -> bool,
    ) -> BTreeMap<usize, Vec<usize>> {
        let mut reached: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut next: VecDeque<Vec<usize>> = roots.iter().map(|root| vec![*root]).collect();
        while let Some(path) = next.pop_front() {
            let Some(&at) = path.last() else { continue };
            if reached.contains_key(&at) || ends(&self.functions[at].name) {
                continue;
            }
            for to in self.branches[at].iter().filter_map(|branch| branch.to) {
                next.push_back([path.as_slice(), &[to]].concat());
            }
            reached.insert(at, path);
        }
        reached
    }
}

/// Branches that leave a function.
fn branches(image: &Loaded, functions: &[Function], function: &Function) -> Vec<Branch> {
    let mut found = Vec::new();
    for code in &image.code {
        let (from, to) = (code.start.max(function.range.start), code.end.min(function.range.end));
        let place = |address: u32| (address - FLASH.base) as usize;
        let Some(bytes) = (from < to).then(|| image.flash.get(place(from)..place(to))).flatten()
        else {
            continue;
        };
        for (address, instruction, _) in thumb::sweep(bytes, from) {
            let start = (address - from) as usize;
            let half = |offset: usize| {
                let pair = bytes.get(start + offset..start + offset + 2)?;
                Some(u16::from_le_bytes([pair[0], pair[1]]))
            };
            let Some(first) = half(0) else { continue };
            let second = if instruction.size == 4 { half(2) } else { None };
            match flow(first, second, address) {
                Flow::To(to) if !function.range.contains(&to) => {
                    // The target of a branch outside every function is unknown.
                    found.push(Branch { from: address, to: function_at(functions, to) });
                }
                Flow::Register => found.push(Branch { from: address, to: None }),
                Flow::On | Flow::To(_) => {}
            }
        }
    }
    found
}

#[test]
fn branches_lead_where_the_manual_says() {
    let at = 0x0800_1000;
    for (a, b, expected) in [
        // b .; b .+0x10; bne .-8; beq.w .+0x200
        (0xE7FE, None, Flow::To(at)),
        (0xE006, None, Flow::To(at + 0x10)),
        (0xD1FA, None, Flow::To(at - 8)),
        (0xF000, Some(0x80FE), Flow::To(at + 0x200)),
        // bl .+4; bl .-4; b.w .-0x800; bl far ahead and far behind
        (0xF000, Some(0xF800), Flow::To(at + 4)),
        (0xF7FF, Some(0xFFFE), Flow::To(at)),
        (0xF7FF, Some(0xBBFE), Flow::To(at - 0x800)),
        (0xF3FF, Some(0xD7FE), Flow::To(at + 0x00FF_F000 + 0x1000)),
        // blx r3; bx r2; bx lr; mov pc, r1; udf; svc; ldr r0, [r1]
        (0x4798, None, Flow::Register),
        (0x4710, None, Flow::Register),
        (0x4770, None, Flow::On),
        (0x468F, None, Flow::Register),
        (0xDE01, None, Flow::On),
        (0xDF00, None, Flow::On),
        (0x6808, None, Flow::On),
        // ldr.w pc, [r0, r1, lsl #2]; ldr.w r1, [r0]; pop.w {pc}; dmb; msr
        (0xF850, Some(0xF021), Flow::Register),
        (0xF8D0, Some(0x1000), Flow::On),
        (0xF85D, Some(0xFB04), Flow::On),
        (0xF3BF, Some(0x8F5F), Flow::On),
        (0xF380, Some(0x8810), Flow::On),
    ] {
        assert_eq!(flow(a, b, at), expected, "{a:#x} {b:x?}");
    }
}
