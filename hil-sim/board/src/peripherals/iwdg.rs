//! The independent watchdog, on its own oscillator of 32 kHz.

use super::registers::Registers;
use super::{HZ, Peripheral, Why, Write};
use crate::description::{IWDG, bits, iwdg::*};

/// Nominal frequency of its oscillator, Hz.
pub(crate) const LSI_HZ: u64 = 32_000;

/// Periods of its oscillator after which a written prescaler or reload value acts.
const UPDATE: u64 = 5;

/// Of the status: an update of prescaler and reload value is in progress.
const UPDATING: u32 = bits(&[sr::PVU, sr::RVU]);

/// Prescaler and reload value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Time {
    prescaler: u32,
    reload: u32,
}

impl Time {
    /// After reset: the longest time of the fastest prescaler, 512 ms.
    const RESET: Self = Self { prescaler: 0, reload: 0xFFF };

    /// Core cycles, with the oscillator at this frequency.
    fn cycles(self, lsi_hz: u64) -> u64 {
        let divider = 4_u64 << self.prescaler.min(6);
        (u64::from(self.reload) + 1) * divider * HZ / lsi_hz
    }
}

/// The watchdog.
///
/// Once started it counts down from the reset value; what was written to prescaler and reload
/// register acts from the first refresh on that follows the update. An update takes periods of
/// the oscillator, which runs only after the start.
#[derive(Clone, Debug)]
pub struct Iwdg {
    registers: Registers,
    acting: Time,
    /// Cycle at which what was written acts.
    updated: u64,
    open: bool,
    /// Cycle at which it expires, once started.
    expires: u64,
    pub started: bool,
    /// Frequency of its oscillator, Hz; to be set before it is started.
    pub lsi_hz: u64,
}

impl Default for Iwdg {
    fn default() -> Self {
        Self {
            // A window that forbids early refreshes is not modelled.
            registers: Registers::of(IWDG, &[PR, RLR], &[], &[KR, WINR]),
            acting: Time::RESET,
            updated: 0,
            open: false,
            expires: u64::MAX,
            started: false,
            lsi_hz: LSI_HZ,
        }
    }
}

impl Iwdg {
    /// After a reset of the chip: as it came up, with the same oscillator.
    pub(crate) fn after_reset(&self) -> Self {
        Self { lsi_hz: self.lsi_hz, ..Self::default() }
    }

    /// Core cycles from a refresh to expiry.
    pub(crate) fn timeout(&self) -> u64 {
        self.acting.cycles(self.lsi_hz)
    }

    /// Stands still for so many cycles.
    pub const fn freeze(&mut self, cycles: u64) {
        self.expires = self.expires.saturating_add(cycles);
        self.updated = self.updated.saturating_add(cycles);
    }

    pub(crate) const fn has_expired(&self, now: u64) -> bool {
        self.expires <= now
    }

    fn refresh(&mut self, now: u64) {
        self.settle(now);
        if self.started {
            self.expires = now + self.timeout();
        }
    }

    /// An update that is over acts.
    fn settle(&mut self, now: u64) {
        if self.started && self.updated <= now {
            self.acting = self.written();
        }
    }

    fn start(&mut self, now: u64) {
        if !self.started {
            self.started = true;
            self.updated = now + UPDATE * HZ / self.lsi_hz;
            self.expires = now + Time::RESET.cycles(self.lsi_hz);
        }
    }

    fn written(&self) -> Time {
        let field = |field| self.registers.field(field);
        Time { prescaler: field(pr::PR), reload: field(rlr::RL) }
    }

    fn updates(&self, now: u64) -> bool {
        self.written() != self.acting && !(self.started && self.updated <= now)
    }
}

impl Peripheral for Iwdg {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        match offset {
            SR => Some(if self.updates(now) { UPDATING } else { 0 }),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        match offset {
            KR => {
                let key = kr::KEY.of(write.value);
                self.open = key == 0x5555;
                match key {
                    0xAAAA => self.refresh(now),
                    0xCCCC => self.start(now),
                    _ => {}
                }
            }
            PR | RLR if self.open => {
                self.settle(now);
                self.registers.write(offset, write)?;
                self.updated = now + UPDATE * HZ / self.lsi_hz;
            }
            PR | RLR => {}
            WINR => {
                self.registers.write(offset, write)?;
                self.refresh(now);
            }
            _ => return Err(Why::NoModel),
        }
        Ok(())
    }

    fn deadline(&self) -> u64 {
        self.expires
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::tests::write;

    #[test]
    fn it_expires_after_its_time_unless_it_is_refreshed() {
        let mut dog = started();
        let fed = UPDATE * HZ / LSI_HZ;
        write(&mut dog, KR, 0xAAAA, fed);
        // 800 * 4 / 32 kHz = 100 ms.
        assert_eq!(dog.timeout(), HZ / 10);
        let end = fed + HZ / 10;
        assert!(!dog.has_expired(end - 1) && dog.has_expired(end));
        write(&mut dog, KR, 0xAAAA, HZ / 20);
        assert!(!dog.has_expired(end));
    }

    #[test]
    fn its_first_time_is_the_longest_until_it_is_refreshed_after_the_update() {
        let longest = 4096 * 4 * HZ / LSI_HZ;
        let mut dog = started();
        assert!(!dog.has_expired(longest - 1) && dog.has_expired(longest));
        assert_eq!(dog.read(SR, 0), Some(UPDATING));
        write(&mut dog, KR, 0xAAAA, 1);
        assert!(!dog.has_expired(longest), "the update is not over");
        assert_eq!(dog.read(SR, UPDATE * HZ / LSI_HZ), Some(0));
    }

    /// Set before its start, as embassy does.
    fn started() -> Iwdg {
        let mut dog = Iwdg::default();
        for (offset, value) in [(KR, 0x5555), (PR, 0), (RLR, 799), (KR, 0xCCCC)] {
            write(&mut dog, offset, value, 0);
        }
        dog
    }

    #[test]
    fn its_time_is_locked() {
        let mut dog = Iwdg::default();
        write(&mut dog, RLR, 1, 0);
        assert_eq!(dog.read(RLR, 0), Some(0xFFF));
    }
}
