//! Access of a debug probe to memory and core registers.

use super::Machine;
use crate::core::{CoreError, Register};
use crate::elf::FLASH;
use crate::peripherals::flash::Wrong;

impl Machine {
    /// Reads memory, as a debug probe does.
    pub fn peek(&self, address: u32, into: &mut [u8]) -> Result<(), CoreError> {
        self.core.read(address, into)
    }

    /// Address of the first occurrence of these bytes in flash.
    pub fn find(&self, bytes: &[u8]) -> Result<Option<u32>, CoreError> {
        let mut flash = vec![0; FLASH.size as usize];
        self.core.read(FLASH.base, &mut flash)?;
        let mut places = flash.windows(bytes.len().max(1));
        Ok(places.position(|place| place == bytes).map(|at| FLASH.base + at as u32))
    }

    pub fn word(&self, address: u32) -> Result<u32, CoreError> {
        let mut bytes = [0; 4];
        self.core.read(address, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Writes memory, as a debug probe does.
    pub fn poke(&mut self, address: u32, bytes: &[u8]) -> Result<(), CoreError> {
        self.core.write(address, bytes)
    }

    /// Makes bits of the double word of flash at this address wrong: one, which the chip corrects,
    /// or two, which also change in the memory.
    pub fn spoil(&mut self, address: u32, wrong: Wrong) -> Result<(), CoreError> {
        let address = address & !7;
        if wrong == Wrong::Two {
            let mut bytes = [0; 8];
            self.core.read(address, &mut bytes)?;
            // The lowest bit of the first word and of the second.
            let flipped = u64::from_le_bytes(bytes) ^ (1 << 32 | 1);
            self.core.write(address, &flipped.to_le_bytes())?;
        }
        self.chip_mut().flash.spoil(address, wrong);
        self.core.set_spoilt(self.core.bus().flash.spoilt())
    }

    pub fn register(&self, register: Register) -> Result<u32, CoreError> {
        self.core.register(register)
    }

    pub const fn pc(&self) -> u32 {
        self.pc
    }

    pub fn set_register(&mut self, register: Register, value: u32) -> Result<(), CoreError> {
        if register == Register::Pc {
            self.pc = value & !1;
        }
        self.core.set_register(register, value)
    }
}
