//! A measurement image on the core: the host calls its functions and counts their cycles.

use super::core::unicorn::{Access, Counted, Memory, UnicornCore};
use super::core::{Meter, NoBus, Register, Stop};
use super::elf::{FLASH, Loaded, RAM, named};
use super::error::ImageError;
use super::spread::Spread;

/// System control space, which the start-up code writes; here plain memory.
const SYSTEM: Memory = Memory { base: 0xE000_0000, size: 1024 * 1024, access: Access::Data };
/// Memory for arguments and results, in the chip's window for external memory.
const MAILBOX: Memory = Memory { base: 0x6000_0000, size: 1024 * 1024, access: Access::Data };
/// Return address of calls: a breakpoint at the mailbox's end.
const RETURN: u32 = MAILBOX.base + MAILBOX.size - 4;
/// First address for arguments.
pub(crate) const ARGUMENTS: u32 = MAILBOX.base;
/// Longest call, cycles: ten seconds of the chip's time.
const PATIENCE: u64 = 1_700_000_000;
const BKPT: [u8; 2] = [0x00, 0xBE];

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Call {
    pub value: u32,
    pub meter: Meter,
}

/// An image after its start-up code.
pub struct Image {
    core: UnicornCore,
    loaded: Loaded,
    stack: u32,
}

impl Image {
    /// Loads the image in `elf` and runs its start-up code.
    pub fn start(elf: &[u8]) -> Result<Self, ImageError> {
        let loaded = Loaded::of(elf)?;
        let counted = Counted { base: FLASH.base, bytes: &loaded.flash, code: &loaded.code };
        let mut core = UnicornCore::new(&[FLASH, RAM, SYSTEM, MAILBOX], &counted, NoBus)?;
        core.write(RETURN, &BKPT)?;
        let vector = |at: usize| {
            let bytes: [u8; 4] = loaded.flash[at..at + 4].try_into().unwrap_or_default();
            u32::from_le_bytes(bytes)
        };
        let (stack, reset) = (vector(0), vector(4));
        core.set_register(Register::Sp, stack)?;
        let mut image = Self { core, loaded, stack };
        match image.core.run(reset, PATIENCE)? {
            Stop::Breakpoint(at) if image.name(at).contains("main") => Ok(image),
            stop => Err(image.lost("start-up", stop)),
        }
    }

    /// Writes words to the mailbox from `address` on.
    pub fn put(&mut self, address: u32, words: &[u32]) -> Result<(), ImageError> {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        Ok(self.core.write(address, &bytes)?)
    }

    /// Reads words from the mailbox.
    pub fn get<const N: usize>(&self, address: u32) -> Result<[u32; N], ImageError> {
        let mut bytes = vec![[0; 4]; N];
        self.core.read(address, bytes.as_flattened_mut())?;
        Ok(std::array::from_fn(|index| u32::from_le_bytes(bytes[index])))
    }

    /// Address of a function, for [`Image::call`].
    pub fn function(&self, name: &str) -> Result<u32, ImageError> {
        self.loaded.symbol(name)
    }

    /// Calls a function with at most four arguments.
    pub fn call(&mut self, function: u32, arguments: &[u32]) -> Result<Call, ImageError> {
        for (number, value) in arguments.iter().enumerate() {
            self.core.set_register(Register::R(number as u8), *value)?;
        }
        self.core.set_register(Register::Sp, self.stack)?;
        self.core.set_register(Register::Lr, RETURN | 1)?;
        let before = self.core.meter();
        match self.core.run(function, PATIENCE)? {
            Stop::Breakpoint(at) if at & !3 == RETURN => Ok(Call {
                value: self.core.register(Register::R(0))?,
                meter: self.core.meter().since(before),
            }),
            stop => Err(self.lost(self.name(function), stop)),
        }
    }

    /// The error of a call that stopped elsewhere than at its end.
    fn lost(&self, function: &str, stop: Stop) -> ImageError {
        let at = match stop {
            Stop::Fault { at, .. }
            | Stop::Breakpoint(at)
            | Stop::Spent(at)
            | Stop::Call(at)
            | Stop::Return(at)
            | Stop::Event(at)
            | Stop::Wait(at) => at,
        };
        let (function, at) = (function.to_owned(), format!("{}: {stop:x?}", self.name(at)));
        ImageError::Lost { function, at }
    }

    /// Calls a function once for each input, whose words are passed by reference. Returns the
    /// values and the cost of the calls; `worst_input` is the index of an input.
    pub fn measure(
        &mut self,
        function: &str,
        inputs: &[Vec<u32>],
    ) -> Result<(Vec<u32>, Spread), ImageError> {
        let function = self.function(function)?;
        let mut values = Vec::with_capacity(inputs.len());
        let mut spread = Spread::default();
        for (index, words) in inputs.iter().enumerate() {
            self.put(ARGUMENTS, words)?;
            let call = self.call(function, &[ARGUMENTS])?;
            values.push(call.value);
            spread.note(call.meter, index);
        }
        Ok((values, spread))
    }

    fn name(&self, address: u32) -> &str {
        named(&self.loaded.functions, address)
    }
}
