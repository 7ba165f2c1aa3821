//! Faults of the hardware at the level of registers and pins, to be switched on while a
//! run goes on.

use std::fmt;
use std::str::FromStr;

use super::core::CoreError;
use super::machine::Machine;
use super::peripherals::pwr::{HOLDS, Then};
use super::peripherals::rcc::Cause;

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The input of preload sensor (0), compression sensor (1), drive's (2) or pre-tightener's bridge (3)
    /// reads this, in parts of 2^16.
    StuckCode(usize, u16),
    /// These bits of the angle sensor's answers are turned over.
    BitErrors(u16),
    /// The angle sensor does not answer.
    AngleLost,
    /// Line A (0) or B (1) of the wheel encoder is broken.
    EncoderLine(usize),
    /// DMA moves nothing.
    DmaStalled,
    /// Clearing the flags of the time driver's timer has no effect.
    TimerFlags,
    /// The button's interrupt line asks without end, whatever the handler does.
    ButtonStorm,
    /// The supply falls too low for a moment: the detector tells of it, and a millisecond later
    /// power is gone.
    BrownOut,
    /// The supply is gone for a moment, without a warning.
    SupplyCut,
    /// The supply falls below the detector's threshold for half a millisecond, and comes back.
    SupplyDip,
    /// The reset pin is pulled for a moment.
    ResetPin,
    /// A debugger asks for a reset.
    Software,
    /// What runs is caught in a loop without end: the task, or the interrupt.
    Caught,
    /// A bit of flash or RAM is turned over, past what the memory would correct: byte and
    /// bit in it.
    BitFlip(u32, u8),
}

impl Fault {
    /// Switches the fault on.
    ///
    /// # Errors
    /// [`CoreError`] if the engine fails or there is no memory at the address.
    pub fn strike(self, machine: &mut Machine) -> Result<(), CoreError> {
        let chip = machine.chip_mut();
        match self {
            Self::StuckCode(converter, code) => {
                chip.defects.stuck_codes[converter & 3] = Some(code);
            }
            Self::BitErrors(bits) => chip.angle.bit_errors = bits,
            Self::AngleLost => chip.angle.lost = true,
            Self::EncoderLine(line) => chip.defects.encoder_lines[line & 1] = true,
            Self::DmaStalled => chip.defects.dma_stalled = true,
            Self::TimerFlags => chip.defects.timer_flags_stick = true,
            Self::ButtonStorm => {
                chip.defects.button_storm = true;
                let now = machine.now();
                machine.chip_mut().look_again(now);
            }
            Self::BrownOut => {
                let now = machine.now();
                machine.chip_mut().supply_falls(now + HOLDS, Then::Gone, now);
            }
            Self::SupplyCut => return machine.restart(Cause::Power),
            Self::SupplyDip => {
                let now = machine.now();
                machine.chip_mut().supply_falls(now + HOLDS / 2, Then::Back, now);
            }
            Self::ResetPin => return machine.restart(Cause::Pin),
            Self::Software => return machine.restart(Cause::Software),
            Self::Caught => return machine.catch(),
            Self::BitFlip(address, bit) => {
                let mut byte = [0];
                machine.peek(address, &mut byte)?;
                return machine.poke(address, &[byte[0] ^ 1 << (bit & 7)]);
            }
        }
        Ok(())
    }

    /// Switches it off. What has happened once stays so.
    pub fn heal(self, machine: &mut Machine) {
        let chip = machine.chip_mut();
        match self {
            Self::StuckCode(converter, _) => chip.defects.stuck_codes[converter & 3] = None,
            Self::BitErrors(_) => chip.angle.bit_errors = 0,
            Self::AngleLost => chip.angle.lost = false,
            Self::EncoderLine(line) => chip.defects.encoder_lines[line & 1] = false,
            Self::DmaStalled => chip.defects.dma_stalled = false,
            Self::TimerFlags => chip.defects.timer_flags_stick = false,
            Self::ButtonStorm => {
                chip.defects.button_storm = false;
                let now = machine.now();
                machine.chip_mut().look_again(now);
            }
            Self::BrownOut
            | Self::SupplyCut
            | Self::SupplyDip
            | Self::Software
            | Self::ResetPin
            | Self::Caught
            | Self::BitFlip(..) => {}
        }
    }
}

/// A fault with the time at which it comes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed {
    /// From power-up, s.
    pub at_s: f64,
    /// What.
    pub fault: Fault,
}

/// A fault that is spelt wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}`: expected <fault>@<seconds> with preload-sensor=<code>, compression-sensor=<code>, \
     drive-readback=<code>, pretightener-readback=<code>, angle-bits=<mask>, angle-lost, encoder-a, encoder-b, dma-stalled, timer-flags, button-storm, \
     brown-out, supply-cut, supply-dip, reset-pin, caught or flip=<address>.<bit>"
)]
pub struct Misspelt(String);

/// A number in decimal or, behind 0x, in hexadecimal.
fn number(text: &str) -> Option<u32> {
    match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

impl FromStr for Fault {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let (name, value) = text.split_once('=').map_or((text, None), |(n, v)| (n, Some(v)));
        let half = |text: &str| u16::try_from(number(text)?).ok();
        let fault = match (name, value) {
            ("preload-sensor", Some(code)) => half(code).map(|code| Self::StuckCode(0, code)),
            ("compression-sensor", Some(code)) => half(code).map(|code| Self::StuckCode(1, code)),
            ("drive-readback", Some(code)) => half(code).map(|code| Self::StuckCode(2, code)),
            ("pretightener-readback", Some(code)) => {
                half(code).map(|code| Self::StuckCode(3, code))
            }
            ("angle-bits", Some(mask)) => half(mask).map(Self::BitErrors),
            ("angle-lost", None) => Some(Self::AngleLost),
            ("encoder-a", None) => Some(Self::EncoderLine(0)),
            ("encoder-b", None) => Some(Self::EncoderLine(1)),
            ("dma-stalled", None) => Some(Self::DmaStalled),
            ("timer-flags", None) => Some(Self::TimerFlags),
            ("button-storm", None) => Some(Self::ButtonStorm),
            ("brown-out", None) => Some(Self::BrownOut),
            ("supply-cut", None) => Some(Self::SupplyCut),
            ("supply-dip", None) => Some(Self::SupplyDip),
            ("software-reset", None) => Some(Self::Software),
            ("reset-pin", None) => Some(Self::ResetPin),
            ("caught", None) => Some(Self::Caught),
            ("flip", Some(place)) => place.split_once('.').and_then(|(address, bit)| {
                let bit = bit.parse().ok().filter(|bit| *bit < 8)?;
                Some(Self::BitFlip(number(address)?, bit))
            }),
            _ => None,
        };
        fault.ok_or(())
    }
}

impl FromStr for Timed {
    type Err = Misspelt;

    fn from_str(text: &str) -> Result<Self, Misspelt> {
        let parsed = text.split_once('@').and_then(|(fault, at)| {
            let at_s = at.parse().ok().filter(|at: &f64| at.is_finite() && *at >= 0.0)?;
            Some(Self { at_s, fault: fault.parse().ok()? })
        });
        parsed.ok_or_else(|| Misspelt(text.to_owned()))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::StuckCode(0, code) => write!(f, "preload-sensor={code:#x}"),
            Self::StuckCode(1, code) => write!(f, "compression-sensor={code:#x}"),
            Self::StuckCode(2, code) => write!(f, "drive-readback={code:#x}"),
            Self::StuckCode(_, code) => write!(f, "pretightener-readback={code:#x}"),
            Self::BitErrors(mask) => write!(f, "angle-bits={mask:#x}"),
            Self::AngleLost => write!(f, "angle-lost"),
            Self::EncoderLine(0) => write!(f, "encoder-a"),
            Self::EncoderLine(_) => write!(f, "encoder-b"),
            Self::DmaStalled => write!(f, "dma-stalled"),
            Self::TimerFlags => write!(f, "timer-flags"),
            Self::ButtonStorm => write!(f, "button-storm"),
            Self::BrownOut => write!(f, "brown-out"),
            Self::SupplyCut => write!(f, "supply-cut"),
            Self::SupplyDip => write!(f, "supply-dip"),
            Self::ResetPin => write!(f, "reset-pin"),
            Self::Software => write!(f, "software-reset"),
            Self::Caught => write!(f, "caught"),
            Self::BitFlip(address, bit) => write!(f, "flip={address:#x}.{bit}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_reads_as_it_is_written() {
        for fault in [
            Fault::StuckCode(0, 0x1234),
            Fault::StuckCode(1, 0),
            Fault::StuckCode(2, 0x8000),
            Fault::StuckCode(3, 7),
            Fault::BitErrors(0x8000),
            Fault::AngleLost,
            Fault::EncoderLine(0),
            Fault::EncoderLine(1),
            Fault::DmaStalled,
            Fault::TimerFlags,
            Fault::ButtonStorm,
            Fault::BrownOut,
            Fault::SupplyCut,
            Fault::SupplyDip,
            Fault::ResetPin,
            Fault::Software,
            Fault::Caught,
            Fault::BitFlip(0x0800_1234, 7),
        ] {
            let timed = format!("{fault}@5.25").parse();
            assert_eq!(timed, Ok(Timed { at_s: 5.25, fault }));
        }
    }

    #[test]
    fn what_is_none_is_named() {
        for text in [
            "",
            "angle-lost",
            "angle-lost@",
            "angle-lost@-1",
            "tread@1",
            "compression-sensor=70000@1",
            "flip=1.9@1",
        ] {
            let error = text.parse::<Timed>().expect_err("misspelt").to_string();
            assert!(error.starts_with(&format!("`{text}`")), "{error}");
        }
    }
}
