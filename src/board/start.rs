//! What a start reports of the run before.

use interstage::restart::{DriveSnapshot, Reset, Restart, Stopped};

use super::registers::RCC;
use super::{retained, supply};

/// Report of the run before this start, which may have `waited` for its supply. Call once,
/// before the control tick begins.
///
/// The snapshot stays kept until the first tick overwrites it, so that a second reset directly
/// after the first finds it too: a bouncing pin, a flickering supply.
pub(crate) fn report(waited: bool) -> Restart {
    let found = supply::found();
    let in_flash = found.and_then(|latest| latest.snapshot);
    let mut restart = Restart {
        reset: reset(),
        snapshot: retained::snapshot().or(in_flash),
        crash: retained::crash().or(in_flash.map(|_| retained::now(Stopped::Supply))),
    };
    // After the watchdog the position is doubtful anyway.
    if waited && restart.reset != Reset::Watchdog {
        restart.reset = Reset::Power;
    }
    retained::keep_only(restart.at_start());
    RCC.csr().modify(|w| w.set_rmvf(true));
    supply::take(found);
    log(&restart);
    restart
}

/// Why the chip started, by flags that accumulate until they are cleared.
fn reset() -> Reset {
    let flags = RCC.csr().read();
    // Every internal reset pulls the pin too; a supply that comes up sets the brown-out flag.
    let causes = [
        (flags.iwdgrstf(), Reset::Watchdog),
        (flags.borrstf(), Reset::Power),
        (flags.sftrstf(), Reset::Software),
        (flags.pinrstf(), Reset::Pin),
    ];
    causes.into_iter().find(|(set, _)| *set).map_or(Reset::Other, |(_, cause)| cause)
}

/// Logs it; a plain power-up is not worth an error.
fn log(restart: &Restart) {
    if restart.reset != Reset::Power {
        defmt::error!("restarted {=str}", restart.reset.sentence());
    }
    if restart.interrupts_masked() {
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
