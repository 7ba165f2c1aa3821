//! The memory protection unit, as far as it keeps the program out of places: regions without
//! any access over the default memory map.
//!
//! Source: ARMv7-M Architecture Reference Manual, B3.5.

use super::super::{Why, Write};

const TYPE: u32 = 0xD90;
const CTRL: u32 = 0xD94;
const RNR: u32 = 0xD98;
const RBAR: u32 = 0xD9C;
const RASR: u32 = 0xDA0;

const REGIONS: usize = 8;
/// Of CTRL: on, on in faults too, default map for privileged accesses.
const ENABLE: u32 = 1;
const IN_FAULTS: u32 = 1 << 1;
const DEFAULT_MAP: u32 = 1 << 2;
/// Of RBAR: the region's number is in the lowest four bits.
const VALID: u32 = 1 << 4;
/// Of RASR: access permission, and subregions that are left out.
const ACCESS: u32 = 7 << 24;
const SUBREGIONS: u32 = 0xFF << 8;

/// The memory protection unit.
#[derive(Clone, Debug, Default)]
pub struct Mpu {
    control: u32,
    selected: usize,
    /// Base and attributes of each region.
    regions: [(u32, u32); REGIONS],
    changed: bool,
}

impl Mpu {
    pub(super) fn read(&self, offset: u32) -> Option<u32> {
        let (base, attributes) = self.regions[self.selected];
        Some(match offset {
            TYPE => (REGIONS as u32) << 8,
            CTRL => self.control,
            RNR => self.selected as u32,
            RBAR => base | self.selected as u32,
            RASR => attributes,
            _ => return None,
        })
    }

    pub(super) fn write(&mut self, offset: u32, write: Write) -> Result<(), Why> {
        let value = write.value;
        match offset {
            // On, it lets the default map through; nothing else is modelled.
            CTRL if value & ENABLE != 0 && value & (DEFAULT_MAP | IN_FAULTS) != DEFAULT_MAP => {
                return Err(Why::NoModel);
            }
            CTRL => self.control = value & 7,
            RNR => self.selected = value as usize % REGIONS,
            RBAR => {
                if value & VALID != 0 {
                    self.selected = (value & 0xF) as usize % REGIONS;
                }
                self.regions[self.selected].0 = value & !0x1F;
            }
            RASR if value & 1 != 0 && value & (ACCESS | SUBREGIONS) != 0 => {
                return Err(Why::NoModel);
            }
            RASR => self.regions[self.selected].1 = value,
            _ => return Err(Why::NoModel),
        }
        self.changed = true;
        Ok(())
    }

    /// Whether [`Mpu::take_change`] has something new.
    pub(super) const fn has_changed(&self) -> bool {
        self.changed
    }

    /// Places without access, address and bytes, if they have changed since the last call.
    pub(crate) fn take_change(&mut self) -> Option<Vec<(u32, u32)>> {
        std::mem::take(&mut self.changed).then(|| {
            let on = self.control & ENABLE != 0;
            let regions = self.regions.iter().filter(|(_, attributes)| on && attributes & 1 != 0);
            regions.map(|(base, attributes)| (*base, 2 << (attributes >> 1 & 0x1F))).collect()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(mpu: &mut Mpu, offset: u32, value: u32) -> Result<(), Why> {
        mpu.write(offset, Write { value, mask: u32::MAX })
    }

    #[test]
    fn a_region_without_access_acts_while_the_unit_is_on() {
        let mut mpu = Mpu::default();
        assert_eq!(mpu.take_change(), None);
        write(&mut mpu, RBAR, 0x1FFF_8000 | VALID | 3).expect("modelled");
        // 2^15 bytes.
        write(&mut mpu, RASR, 1 << 28 | 14 << 1 | 1).expect("modelled");
        assert_eq!(mpu.take_change(), Some(vec![]));
        write(&mut mpu, CTRL, ENABLE | DEFAULT_MAP).expect("modelled");
        assert_eq!(mpu.take_change(), Some(vec![(0x1FFF_8000, 0x8000)]));
        assert_eq!(mpu.read(RNR), Some(3));
    }

    #[test]
    fn what_is_not_modelled_is_refused() {
        let mut mpu = Mpu::default();
        assert_eq!(write(&mut mpu, CTRL, ENABLE), Err(Why::NoModel), "without the default map");
        assert_eq!(write(&mut mpu, RASR, 3 << 24 | 1), Err(Why::NoModel), "a region with access");
    }
}
