//! The independent watchdog, on its own oscillator of 32 kHz.

use super::{HZ, Peripheral, Write};

const KR: u32 = 0x00;
const PR: u32 = 0x04;
const RLR: u32 = 0x08;
const SR: u32 = 0x0C;
const WINR: u32 = 0x10;

/// Nominal frequency of its oscillator, Hz; the chip's may be 4 % off (29.5 to 34 kHz
/// over temperature).
const LSI_HZ: u64 = 32_000;

/// The watchdog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Iwdg {
    prescaler: u32,
    reload: u32,
    window: u32,
    open: bool,
    /// Cycle at which it expires, once started.
    expires: u64,
    started: bool,
}

impl Default for Iwdg {
    fn default() -> Self {
        Self {
            prescaler: 0,
            reload: 0xFFF,
            window: 0xFFF,
            open: false,
            expires: u64::MAX,
            started: false,
        }
    }
}

impl Iwdg {
    /// Core cycles from a refresh to expiry.
    pub fn timeout(&self) -> u64 {
        let divider = 4_u64 << self.prescaler.min(6);
        (u64::from(self.reload) + 1) * divider * HZ / LSI_HZ
    }

    /// Whether it has expired.
    pub const fn has_expired(&self, now: u64) -> bool {
        self.expires <= now
    }

    fn refresh(&mut self, now: u64) {
        if self.started {
            self.expires = now + self.timeout();
        }
    }
}

impl Peripheral for Iwdg {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        match offset {
            // A write is complete at once.
            KR | SR => Some(0),
            PR => Some(self.prescaler),
            RLR => Some(self.reload),
            WINR => Some(self.window),
            _ => None,
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Option<()> {
        match (offset, write.value & 0xFFFF) {
            (KR, key) => {
                self.open = key == 0x5555;
                match key {
                    0xAAAA => self.refresh(now),
                    0xCCCC => {
                        self.started = true;
                        self.refresh(now);
                    }
                    _ => {}
                }
            }
            (PR, value) if self.open => self.prescaler = value & 7,
            (RLR, value) if self.open => self.reload = value & 0xFFF,
            // A window that forbids early refreshes is not modelled.
            (WINR, value) if value & 0xFFF != 0xFFF => return None,
            (WINR, _) => self.refresh(now),
            (PR | RLR, _) => {}
            _ => return None,
        }
        Some(())
    }

    fn deadline(&self) -> u64 {
        self.expires
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(dog: &mut Iwdg, offset: u32, value: u32, now: u64) {
        dog.write(offset, Write { value, mask: u32::MAX }, now).expect("modelled");
    }

    #[test]
    fn it_expires_after_its_time_unless_it_is_refreshed() {
        let mut dog = Iwdg::default();
        for (offset, value) in [(KR, 0xCCCC), (KR, 0x5555), (PR, 0), (RLR, 799), (KR, 0xAAAA)] {
            write(&mut dog, offset, value, 0);
        }
        // 800 * 4 / 32 kHz = 100 ms.
        assert_eq!(dog.timeout(), HZ / 10);
        assert!(!dog.has_expired(HZ / 10 - 1) && dog.has_expired(HZ / 10));
        write(&mut dog, KR, 0xAAAA, HZ / 20);
        assert!(!dog.has_expired(HZ / 10));
    }

    #[test]
    fn its_time_is_locked() {
        let mut dog = Iwdg::default();
        write(&mut dog, RLR, 1, 0);
        assert_eq!(dog.read(RLR, 0), Some(0xFFF));
    }
}
