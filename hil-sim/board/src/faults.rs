//! Faults of the hardware at registers and pins, which can be switched on during a run.

use std::fmt;
use std::str::FromStr;

use super::chip::Pin;
use super::core::CoreError;
use super::elf::FLASH;
use super::machine::Machine;
use super::peripherals::HZ;
use super::peripherals::flash::Wrong;
use super::peripherals::pwr::{HOLDS, Then};
use super::peripherals::rcc::Cause;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// An analogue input reads this code, in parts of 2^16: preload sensor (0), compression
    /// sensor (1), drive's (2) or pre-tightener's bridge (3).
    StuckCode(usize, u16),
    /// These bits of the angle sensor's answers are inverted.
    BitErrors(u16),
    /// The angle sensor does not answer.
    AngleLost,
    /// The angle sensor misses a clock edge of its next frame.
    AngleDisturbed,
    /// The angle sensor's magnet is gone.
    MagnetLost,
    /// Bits of the double word of flash at this address are wrong: one, which the chip corrects,
    /// or two, which a read of it reports; of these the data's or the correction's own.
    WrongBits(u32, Wrong),
    /// The option bytes make one bank of the flash.
    OneBank,
    /// The wire of the emergency stop is shorted to ground.
    StopShorted,
    /// The wire of the emergency stop is torn.
    StopTorn,
    /// A debugger halts the core for so many milliseconds.
    Halted(u16),
    /// Line A (0) or B (1) of the wheel encoder is broken.
    EncoderLine(usize),
    /// DMA moves nothing.
    DmaStalled,
    /// Writes that clear the flags of the time driver's timer have no effect.
    TimerFlags,
    /// The button's interrupt line stays active.
    ButtonStorm,
    /// The supply falls below the detector's threshold, and a millisecond later power is lost.
    BrownOut,
    /// Power is lost without a warning, and comes back.
    SupplyCut,
    /// The supply falls below the detector's threshold for half a millisecond.
    SupplyDip,
    /// The reset pin is pulled for a moment.
    ResetPin,
    /// A debugger requests a reset.
    Software,
    /// The running task or interrupt hangs in an endless loop.
    Caught,
    /// A bit of flash or RAM is inverted, beyond what the memory corrects: address of the
    /// byte, and bit in it.
    BitFlip(u32, u8),
}

impl Fault {
    /// Switches the fault on.
    pub fn strike(self, machine: &mut Machine) -> Result<(), CoreError> {
        self.switch(machine, true)
    }

    /// Switches the fault on or off. A single event (a reset, a hang, a flipped bit) is not
    /// undone.
    pub fn switch(self, machine: &mut Machine, on: bool) -> Result<(), CoreError> {
        let now = machine.now();
        let chip = machine.chip_mut();
        match self {
            Self::StuckCode(input, code) => {
                chip.defects.stuck_codes[input & 3] = on.then_some(code);
            }
            Self::BitErrors(bits) => chip.angle.bit_errors = if on { bits } else { 0 },
            Self::AngleLost => chip.angle.lost = on,
            Self::AngleDisturbed => chip.angle.disturbed = on,
            Self::MagnetLost => chip.angle.set_magnet(!on),
            Self::EncoderLine(line) => chip.defects.encoder_lines[line & 1] = on,
            Self::DmaStalled => chip.defects.dma_stalled = on,
            Self::TimerFlags => chip.defects.timer_flags_stick = on,
            Self::ButtonStorm => {
                chip.defects.button_storm = on;
                chip.settle(now);
            }
            Self::OneBank => chip.flash.set_single_bank(on),
            Self::StopShorted => {
                chip.defects.stop_shorted = on;
                chip.settle(now);
            }
            Self::StopTorn => {
                for pin in [Pin::STOP_DRIVE, Pin::STOP_PRELOAD] {
                    chip.drive(pin, on, now);
                }
            }
            _ if !on => {}
            Self::WrongBits(address, wrong) => return machine.spoil(address, wrong),
            Self::Halted(milliseconds) => machine.halt(u64::from(milliseconds) * (HZ / 1000)),
            Self::BrownOut => chip.supply_falls(now + HOLDS, Then::Gone, now),
            Self::SupplyDip => chip.supply_falls(now + HOLDS / 2, Then::Back, now),
            Self::SupplyCut => return machine.restart(Cause::Power),
            Self::ResetPin => return machine.restart(Cause::Pin),
            Self::Software => return machine.restart(Cause::Software),
            Self::Caught => return machine.hang(),
            Self::BitFlip(address, bit) => {
                let mut byte = [0];
                machine.peek(address, &mut byte)?;
                return machine.poke(address, &[byte[0] ^ 1 << (bit & 7)]);
            }
        }
        Ok(())
    }
}

/// A fault with the time at which it strikes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed {
    /// From power-up, s.
    pub at_s: f64,
    pub fault: Fault,
}

/// A fault that is spelt wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}`: expected <fault>@<seconds> with preload-sensor=<code>, compression-sensor=<code>, \
     drive-readback=<code>, pretightener-readback=<code>, angle-bits=<mask>, angle-lost, \
     angle-disturbed, magnet-lost, encoder-line-a, encoder-line-b, dma-stalled, timer-flags, button-storm, \
     one-bank, stop-shorted, stop-torn, halted=<milliseconds>, one-wrong-bit=<address>, \
     two-wrong-bits=<address>, wrong-check-bits=<address>, brown-out, supply-cut, supply-dip, software-reset, reset-pin, caught \
     or flip=<address>.<bit>"
)]
pub struct Misspelt(String);

/// Names of the faults without a value.
const PLAIN: [(&str, Fault); 17] = [
    ("angle-lost", Fault::AngleLost),
    ("angle-disturbed", Fault::AngleDisturbed),
    ("magnet-lost", Fault::MagnetLost),
    ("one-bank", Fault::OneBank),
    ("stop-shorted", Fault::StopShorted),
    ("stop-torn", Fault::StopTorn),
    ("encoder-line-a", Fault::EncoderLine(0)),
    ("encoder-line-b", Fault::EncoderLine(1)),
    ("dma-stalled", Fault::DmaStalled),
    ("timer-flags", Fault::TimerFlags),
    ("button-storm", Fault::ButtonStorm),
    ("brown-out", Fault::BrownOut),
    ("supply-cut", Fault::SupplyCut),
    ("supply-dip", Fault::SupplyDip),
    ("software-reset", Fault::Software),
    ("reset-pin", Fault::ResetPin),
    ("caught", Fault::Caught),
];
/// Names of the analogue inputs that can be stuck, in the order of [`Fault::StuckCode`].
const INPUTS: [&str; 4] =
    ["preload-sensor", "compression-sensor", "drive-readback", "pretightener-readback"];
/// Names of the faults of flash, with an address.
const WRONG: [(&str, Wrong); 3] = [
    ("one-wrong-bit", Wrong::One),
    ("two-wrong-bits", Wrong::Two),
    ("wrong-check-bits", Wrong::Check),
];

/// A number in decimal or, after 0x, in hexadecimal.
fn number(text: &str) -> Option<u32> {
    match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

fn fault(text: &str) -> Option<Fault> {
    let Some((name, value)) = text.split_once('=') else {
        return PLAIN.into_iter().find(|(name, _)| *name == text).map(|(_, fault)| fault);
    };
    if name == "flip" {
        let (address, bit) = value.split_once('.')?;
        let bit = bit.parse().ok().filter(|bit| *bit < 8)?;
        return Some(Fault::BitFlip(number(address)?, bit));
    }
    let value = number(value)?;
    if let Some((_, wrong)) = WRONG.into_iter().find(|(known, _)| *known == name) {
        return FLASH.holds(value).then_some(Fault::WrongBits(value, wrong));
    }
    let half = u16::try_from(value).ok()?;
    if name == "halted" {
        return Some(Fault::Halted(half));
    }
    if name == "angle-bits" {
        return Some(Fault::BitErrors(half));
    }
    let input = INPUTS.iter().position(|input| *input == name)?;
    Some(Fault::StuckCode(input, half))
}

impl FromStr for Timed {
    type Err = Misspelt;

    fn from_str(text: &str) -> Result<Self, Misspelt> {
        let parsed = text.split_once('@').and_then(|(name, at)| {
            let at_s = at.parse().ok().filter(|at: &f64| at.is_finite() && *at >= 0.0)?;
            Some(Self { at_s, fault: fault(name)? })
        });
        parsed.ok_or_else(|| Misspelt(text.to_owned()))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::StuckCode(input, code) => write!(f, "{}={code:#x}", INPUTS[input & 3]),
            Self::BitErrors(mask) => write!(f, "angle-bits={mask:#x}"),
            Self::BitFlip(address, bit) => write!(f, "flip={address:#x}.{bit}"),
            Self::Halted(milliseconds) => write!(f, "halted={milliseconds}"),
            Self::WrongBits(address, wrong) => {
                let named = WRONG.iter().find(|(_, known)| *known == wrong);
                write!(f, "{}={address:#x}", named.map_or("", |(name, _)| name))
            }
            plain => {
                let named = PLAIN.iter().find(|(_, fault)| *fault == plain);
                f.write_str(named.map_or("encoder-line-b", |(name, _)| name))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_reads_as_it_is_written() {
        let mut faults = PLAIN.map(|(_, fault)| fault).to_vec();
        faults.extend([0, 1, 2, 3].map(|input| Fault::StuckCode(input, 0x1234)));
        faults.extend([Fault::BitErrors(0x8000), Fault::BitFlip(0x0800_1234, 7)]);
        faults.extend([Fault::Halted(50), Fault::WrongBits(0x0800_1238, Wrong::One)]);
        faults.push(Fault::WrongBits(0x0807_E000, Wrong::Two));
        for fault in faults {
            let timed = format!("{fault}@5.25").parse();
            assert_eq!(timed, Ok(Timed { at_s: 5.25, fault }));
        }
    }

    #[test]
    fn a_misspelt_fault_is_named() {
        for text in [
            "",
            "angle-lost",
            "angle-lost@",
            "angle-lost@-1",
            "tread@1",
            "compression-sensor=70000@1",
            "flip=1.9@1",
            "two-wrong-bits=0x20000000@1",
        ] {
            let error = text.parse::<Timed>().expect_err("misspelt").to_string();
            assert!(error.starts_with(&format!("`{text}`")), "{error}");
        }
    }
}
