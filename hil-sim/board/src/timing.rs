//! Textbook Cortex-M4 timing: what each instruction costs on a core whose memories
//! answer at once.
//!
//! | instruction | cycles | rule |
//! |---|---|---|
//! | data processing, multiplication into 32 or 64 bits, 64-bit accumulation, DSP | 1 | table 3-1 |
//! | MLA, MLS | 2 | table 3-1 |
//! | load or store of n words, PUSH, POP, VLDR, VLDM, … | 1 + n | table 3-1; accesses that follow each other may overlap on silicon and do not here |
//! | branch taken, return, load of the program counter | + 2 | P, the refill of the pipeline, is 1 to 3 |
//! | SDIV, UDIV | 2 to 12 | [`division`] |
//! | VMLA, VMLS, VFMA, … | 3 | table 7-1 |
//! | VDIV, VSQRT | 14 | table 7-1 |
//! | VMOV of two words | 2 | table 7-1 |
//! | other floating point | 1 | table 7-1 |
//! | skipped by a condition, IT | 1 | table 3-1; on silicon an IT may cost nothing |
//! | exception entry, return | 12, 10 | chapter 3.9 |
//!
//! Source: ARM, Cortex-M4 Technical Reference Manual r0p1 (DDI 0439), tables 3-1 and
//! 7-1. There are no wait states of the flash in it, no contention on the bus, no
//! dependency between floating-point results. So it compares programs; what a chip
//! takes, its cycle counter measures.

use super::thumb::{Instruction, Kind};

/// Refill of the pipeline after a branch taken.
pub(crate) const REFILL: u64 = 2;

/// Cycles beyond the first that this instruction takes whatever its operands, branches
/// apart.
pub(crate) const fn extra(kind: Kind) -> u64 {
    match kind {
        Kind::Plain | Kind::IfThen(_) => 0,
        Kind::Access(words) => words as u64,
        Kind::Accumulate | Kind::FloatPair => 1,
        Kind::FloatAccumulate => 2,
        Kind::FloatDivide => 13,
        // Shortest; the operands say the rest.
        Kind::Divide { .. } => 1,
    }
}

/// Whether the cycles beyond the first are known only at execution: a condition or the
/// operands decide.
pub(crate) fn is_deferred(instruction: &Instruction, conditional: bool) -> bool {
    matches!(instruction.kind, Kind::Divide { .. }) || conditional && extra(instruction.kind) > 0
}

/// Cycles of a division `n / m`: 2 for a quotient of nothing, 12 for one of 32 bits,
/// and between them in proportion, rounded up.
///
/// The manual says 2 to 12 by the leading zeros and ones of the operands; the
/// proportion is our reading of it.
pub(crate) const fn division(signed: bool, n: u32, m: u32) -> u64 {
    let (n, m) =
        if signed { ((n as i32).unsigned_abs(), (m as i32).unsigned_abs()) } else { (n, m) };
    if m == 0 || n < m {
        return 2;
    }
    let bits = m.leading_zeros() - n.leading_zeros() + 1;
    2 + (bits as u64 * 10).div_ceil(32)
}
