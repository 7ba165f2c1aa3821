//! Faults of the hardware at registers and pins, which can be switched on during a run.

use super::chip::Pin;
use super::core::CoreError;
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
    /// Switches the fault on or off. A single event (a reset, a hang, a flipped bit) is not
    /// undone.
    pub fn switch(self, machine: &mut Machine, on: bool) -> Result<(), CoreError> {
        let now = machine.now();
        let chip = machine.chip_mut();
        match self {
            Self::StuckCode(input, code) => {
                chip.defects.stuck_codes[input] = on.then_some(code);
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
