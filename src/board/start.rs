//! What a start finds of the time before it.

use embassy_stm32::pac;
use interstage::restart::{DriveSnapshot, Reset, Restart, Stopped};

use super::{retained, supply};

/// What there is to report of the time before this start, which may have `waited` for its
/// supply. Call once, before the control tick begins.
///
/// What the drive was doing stays kept until the tick writes over it, so that a second reset
/// right behind the first, as of a pin that bounces or a supply that flickers, finds it too.
pub(crate) fn report(waited: bool) -> Restart {
    let found = supply::found();
    let in_flash = found.and_then(|latest| latest.snapshot);
    let mut restart = Restart {
        reset: reset(),
        snapshot: retained::snapshot().or(in_flash),
        crash: retained::crash().or(in_flash.map(|_| retained::now(Stopped::Supply))),
    };
    // The watchdog has reasons of its own for doubt.
    if waited && restart.reset != Reset::Watchdog {
        restart.reset = Reset::Power;
    }
    retained::forget_but(restart.standing());
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    supply::take(found);
    say(&restart);
    restart
}

/// Why the chip started, by its flags, which gather until they are forgotten.
fn reset() -> Reset {
    let flags = pac::RCC.csr().read();
    // Every reset of the chip's own pulls the pin too; a supply that comes up raises the
    // flag of one that was too low.
    if flags.iwdgrstf() {
        Reset::Watchdog
    } else if flags.borrstf() {
        Reset::Power
    } else if flags.sftrstf() {
        Reset::Software
    } else if flags.pinrstf() {
        Reset::Pin
    } else {
        Reset::Other
    }
}

/// Says it, if it was not the operator's switch.
fn say(restart: &Restart) {
    if restart.reset != Reset::Power {
        defmt::error!("restarted {=str}", restart.reset.sentence());
    }
    if restart.shut_out() {
        defmt::error!("a hang with interrupts shut out");
    }
    if let Some(crash) = &restart.crash {
        match crash.stopped {
            Stopped::Panic { place, line } => {
                defmt::error!("panicked in line {=u32}, place {=u32:#x}", line, place);
            }
            Stopped::Fault { pc, lr, cfsr, hfsr } => defmt::error!(
                "hard fault at {=u32:#x} from {=u32:#x}, CFSR {=u32:#x}, HFSR {=u32:#x}",
                pc,
                lr,
                cfsr,
                hfsr
            ),
            Stopped::Hang { pc, lr, missed, .. } => defmt::error!(
                "{=str} did not come, at {=u32:#x} from {=u32:#x}",
                missed.name(),
                pc,
                lr
            ),
            Stopped::Supply => defmt::error!("the supply fell too low"),
            Stopped::Image => defmt::error!("a bit of the image had turned over"),
        }
    }
    if let Some(DriveSnapshot { tick, position, mode, level, fault, missed, .. }) = restart.snapshot
    {
        defmt::warn!(
            "before: tick {=u32}, mode {=u8}, {=f32} mm, level {=u8}, last fault {=u16}, late: {=str}",
            tick,
            mode,
            position.to_num::<f32>(),
            level & !DriveSnapshot::UNSURE,
            fault,
            missed.name()
        );
    }
}
