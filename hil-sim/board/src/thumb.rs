//! Thumb-2 as far as timing needs it: length and cost class of an instruction, and whether it is
//! conditional.

/// Cost class of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Any other.
    Plain,
    /// Reads or writes so many words.
    Access(u8),
    /// Multiplies and accumulates into 32 bits.
    Accumulate,
    /// Divides register `n` by register `m`.
    Divide {
        signed: bool,
        /// Register of the dividend.
        n: u8,
        /// Register of the divisor.
        m: u8,
    },
    /// Moves two words between the register files.
    FloatPair,
    /// Multiplies and accumulates in the floating-point unit.
    FloatAccumulate,
    /// Divides or takes a root in the floating-point unit.
    FloatDivide,
    /// Puts the next so many instructions under a condition.
    IfThen(u8),
}

/// An instruction as timing sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Bytes: 2 or 4.
    pub size: u32,
    pub kind: Kind,
}

/// Decodes the instruction at the beginning of `code`; `None` if it is cut off there.
///
/// Source: ARMv7-M Architecture Reference Manual, A5 (encodings).
pub(crate) fn decode(code: &[u8]) -> Option<Instruction> {
    let half = |at: usize| Some(u16::from_le_bytes([*code.get(at)?, *code.get(at + 1)?]));
    let first = half(0)?;
    Some(if first >> 11 >= 0b11101 {
        Instruction { size: 4, kind: wide(first, half(2)?) }
    } else {
        Instruction { size: 2, kind: narrow(first) }
    })
}

fn words(registers: u16) -> Kind {
    Kind::Access(registers.count_ones() as u8)
}

fn narrow(op: u16) -> Kind {
    match op >> 8 {
        0x48..=0x9F => Kind::Access(1),
        0xB4 | 0xB5 | 0xBC | 0xBD => words(op & 0x1FF),
        0xBF if op & 0xF != 0 => Kind::IfThen(4 - (op & 0xF).trailing_zeros() as u8),
        0xC0..=0xCF => words(op & 0xFF),
        _ => Kind::Plain,
    }
}

fn wide(a: u16, b: u16) -> Kind {
    match a >> 8 {
        0xE8 | 0xE9 if a & 0x40 == 0 => words(b),
        0xE8 | 0xE9 if is_single(a, b) => Kind::Access(1),
        0xE8 | 0xE9 => Kind::Access(2),
        0xEC..=0xEF => float(a, b),
        0xF8 | 0xF9 => Kind::Access(1),
        0xFB => multiply(a, b),
        _ => Kind::Plain,
    }
}

/// Exclusive accesses and table branches, among the loads and stores of two words.
fn is_single(a: u16, b: u16) -> bool {
    let exclusive = a & 0xFFE0 == 0xE840;
    // LDREXB, LDREXH, STREXB, STREXH, TBB, TBH.
    let short = a & 0xFFE0 == 0xE8C0 && matches!(b >> 4 & 0xF, 0 | 1 | 4 | 5);
    exclusive || short
}

fn multiply(a: u16, b: u16) -> Kind {
    let (n, m) = ((a & 0xF) as u8, (b & 0xF) as u8);
    match (a >> 4 & 0xF, b >> 4 & 0xF) {
        // With no register to add it is a plain multiplication.
        (0x0, 0x0 | 0x1) if b >> 12 != 0xF => Kind::Accumulate,
        (0x9, 0xF) => Kind::Divide { signed: true, n, m },
        (0xB, 0xF) => Kind::Divide { signed: false, n, m },
        _ => Kind::Plain,
    }
}

fn float(a: u16, b: u16) -> Kind {
    if !matches!(b >> 8 & 0xF, 10 | 11) {
        return Kind::Plain;
    }
    let double = b & 0x100 != 0;
    match a >> 8 {
        0xEE if b & 0x10 == 0 => float_operation(a, b),
        0xEC if a & 0xE0 == 0x40 => Kind::FloatPair,
        0xED if a & 0x20 == 0 => Kind::Access(if double { 2 } else { 1 }),
        0xEC | 0xED => Kind::Access((b & 0xFF) as u8),
        _ => Kind::Plain,
    }
}

fn float_operation(a: u16, b: u16) -> Kind {
    match a >> 4 & 0xB {
        0x0 | 0x1 | 0x9 | 0xA => Kind::FloatAccumulate,
        0x8 => Kind::FloatDivide,
        0xB if a & 0xF == 1 && b >> 6 & 3 == 3 => Kind::FloatDivide,
        _ => Kind::Plain,
    }
}

/// Every instruction of `code`, which begins at `address`, and whether it is conditional.
pub fn sweep(code: &[u8], address: u32) -> impl Iterator<Item = (u32, Instruction, bool)> {
    let (mut at, mut under) = (0, 0);
    std::iter::from_fn(move || {
        let found = decode(code.get(at..)?)?;
        let place = (address + at as u32, found, under > 0);
        under = match found.kind {
            Kind::IfThen(count) => count,
            _ => under.saturating_sub(1),
        };
        at += found.size as usize;
        Some(place)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_have_the_classes_of_the_manual() {
        for (halves, kind) in [
            (&[0x4801][..], Kind::Access(1)),      // ldr r0, [pc, #4]
            (&[0x9001], Kind::Access(1)),          // str r0, [sp, #4]
            (&[0xB5F0], Kind::Access(5)),          // push {r4-r7, lr}
            (&[0xBD10], Kind::Access(2)),          // pop {r4, pc}
            (&[0xC80F], Kind::Access(4)),          // ldm r0!, {r0-r3}
            (&[0xE92D, 0x4FF0], Kind::Access(9)),  // push.w {r4-r11, lr}
            (&[0xE9D0, 0x1200], Kind::Access(2)),  // ldrd r1, r2, [r0]
            (&[0xE8D0, 0xF001], Kind::Access(1)),  // tbb [r0, r1]
            (&[0xE851, 0x0F00], Kind::Access(1)),  // ldrex r0, [r1]
            (&[0xF8D0, 0x1800], Kind::Access(1)),  // ldr.w r1, [r0, #2048]
            (&[0x1840], Kind::Plain),              // adds r0, r0, r1
            (&[0xFB80, 0x0101], Kind::Plain),      // smull r0, r1, r0, r1
            (&[0xFBE2, 0x0164], Kind::Plain),      // umaal r0, r1, r2, r4
            (&[0xFB00, 0xF001], Kind::Plain),      // mul r0, r0, r1
            (&[0xFB00, 0x2001], Kind::Accumulate), // mla r0, r0, r1, r2
            (&[0xFB00, 0x2011], Kind::Accumulate), // mls r0, r0, r1, r2
            (&[0xFB93, 0xF0F5], Kind::Divide { signed: true, n: 3, m: 5 }), // sdiv r0, r3, r5
            (&[0xFBB3, 0xF0F5], Kind::Divide { signed: false, n: 3, m: 5 }), // udiv r0, r3, r5
            (&[0xEE30, 0x0A20], Kind::Plain),      // vadd.f32 s0, s0, s1
            (&[0xEE80, 0x0A20], Kind::FloatDivide), // vdiv.f32 s0, s0, s1
            (&[0xEEB1, 0x0AC0], Kind::FloatDivide), // vsqrt.f32 s0, s0
            (&[0xEEA0, 0x0A20], Kind::FloatAccumulate), // vfma.f32
            (&[0xEE00, 0x0A20], Kind::FloatAccumulate), // vmla.f32
            (&[0xED90, 0x0A00], Kind::Access(1)),  // vldr s0, [r0]
            (&[0xED90, 0x0B00], Kind::Access(2)),  // vldr d0, [r0]
            (&[0xED2D, 0x8B04], Kind::Access(4)),  // vpush {d8, d9}
            (&[0xECBD, 0x8B04], Kind::Access(4)),  // vpop {d8, d9}
            (&[0xEE00, 0x0A10], Kind::Plain),      // vmov s0, r0
            (&[0xEC41, 0x0B10], Kind::FloatPair),  // vmov d0, r0, r1
            (&[0xBF00], Kind::Plain),              // nop
        ] {
            let bytes: Vec<u8> = halves.iter().flat_map(|half: &u16| half.to_le_bytes()).collect();
            let size = bytes.len() as u32;
            assert_eq!(decode(&bytes), Some(Instruction { size, kind }), "{halves:x?}");
        }
    }

    #[test]
    fn a_condition_covers_what_it_names() {
        // ittt eq; ldr; ldr; ldr; ldr
        let bytes: Vec<u8> = [0xBF02_u16, 0x6800, 0x6800, 0x6800, 0x6800]
            .iter()
            .flat_map(|h| h.to_le_bytes())
            .collect();
        let under: Vec<bool> = sweep(&bytes, 0).map(|(_, _, under)| under).collect();
        assert_eq!(under, [false, true, true, true, false]);
    }

    #[test]
    fn half_an_instruction_is_none() {
        assert_eq!(decode(&[0x2D, 0xE9]), None);
        assert_eq!(decode(&[0x2D]), None);
    }
}
