//! The faults of the catalogue at the board's registers, lines and memories.

use super::chip::map::PARAMETER_SETS;
use super::core::CoreError;
use super::elf::FLASH;
use super::machine::Machine;
use super::peripherals::HZ;
use super::peripherals::flash::Wrong;
use super::peripherals::pwr::{HOLDS, Then};
use super::peripherals::rcc::Cause;
use hil_sim::params::set_of;
use hil_sim::scenario::injection::{Injection, Kind, Target};
use interstage::params::slots::SLOT_BYTES;
use interstage::rig::Rig;

/// Switches a fault of the hardware on or off; of another target, nothing changes. A single event
/// (a reset, a hang, a flipped bit) is not undone.
pub fn switch(machine: &mut Machine, fault: &Injection, on: bool) -> Result<(), CoreError> {
    use Target::{
        AngleBus, Debugger, Dma, EncoderLineA, EncoderLineB, Image, ImageSet, Interrupt, Magnet,
        OptionBytes, PreloadSensorConverter, Processor, ResetPin, SpareSet, StopWire, StoredSet,
        Supply, Timer, TreadConverter,
    };
    let (now, word) = (machine.now(), fault.magnitude() as u16);
    let chip = machine.chip_mut();
    match (fault.target, fault.kind) {
        (PreloadSensorConverter, _) => chip.defects.stuck_codes[0] = on.then_some(word),
        (TreadConverter, _) => chip.defects.stuck_codes[1] = on.then_some(word),
        (AngleBus, Kind::BitErrors) => chip.angle.bit_errors = if on { word } else { 0 },
        // The sensor misses a clock edge of its next frame.
        (AngleBus, Kind::Disturbed) => chip.angle.disturbed = on,
        (AngleBus, _) => chip.angle.lost = on,
        (Magnet, _) => chip.angle.set_magnet(!on),
        (EncoderLineA, _) => chip.defects.encoder_lines[0] = on,
        (EncoderLineB, _) => chip.defects.encoder_lines[1] = on,
        (Dma, _) => chip.defects.dma_stalled = on,
        (Timer, _) => chip.defects.timer_flags_stick = on,
        (Interrupt, _) => {
            chip.defects.button_storm = on;
            chip.settle(now);
        }
        (OptionBytes, _) => chip.flash.set_single_bank(on),
        (StopWire, kind) => {
            chip.defects.stop_wire = on.then_some(kind != Kind::Shorted);
            chip.press_stop(false, now);
        }
        _ if !on => {}
        (StoredSet | SpareSet | ImageSet | Image, kind) => {
            let Some((address, bit)) = place(machine, fault)? else { return Ok(()) };
            match kind {
                Kind::OneWrongBit => machine.spoil(address, Wrong::One)?,
                Kind::TwoWrongBits => machine.spoil(address, Wrong::Two)?,
                _ => {
                    let mut byte = [0];
                    machine.peek(address, &mut byte)?;
                    machine.poke(address, &[byte[0] ^ 1 << bit])?;
                }
            }
        }
        (Debugger, Kind::Halted) => machine.halt(u64::from(word) * (HZ / 1000)),
        (Debugger, _) => machine.restart(Cause::Software)?,
        // Below the detector's threshold; a millisecond later power is lost, or is back before.
        (Supply, Kind::Off) => chip.supply_falls(now + HOLDS, Then::Gone, now),
        (Supply, Kind::Weak) => chip.supply_falls(now + HOLDS / 2, Then::Back, now),
        (Supply, _) => machine.restart(Cause::Power)?,
        (ResetPin, _) => machine.restart(Cause::Pin)?,
        (Processor, _) => machine.hang()?,
        _ => {}
    }
    Ok(())
}

/// Address of the wrong byte of the image or of a parameter set, and the bit in it; none if the
/// image has no such set.
fn place(machine: &Machine, fault: &Injection) -> Result<Option<(u32, u32)>, CoreError> {
    let bit = fault.magnitude() as u32;
    let (base, bit) = match fault.target {
        Target::StoredSet => (Some(PARAMETER_SETS), bit),
        Target::SpareSet => (Some(PARAMETER_SETS + SLOT_BYTES as u32), bit),
        Target::ImageSet => {
            let set = set_of("prototype", &Rig::prototype()).unwrap_or_default();
            (machine.find(&set)?, bit % (8 * set.len() as u32).max(1))
        }
        _ => {
            let used = machine.image.flash.iter().rposition(|byte| *byte != 0xFF);
            (Some(FLASH.base), bit % (8 * used.map_or(1, |last| last as u32 + 1)))
        }
    };
    Ok(base.map(|base| (base + bit / 8, bit % 8)))
}
