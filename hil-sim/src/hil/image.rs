//! Identifies the image in a board's flash.

use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSection, ObjectSymbol};

use crate::firmware::FirmwareError;
use crate::probe::{Port, PortError};

/// Symbol of the channels' control block.
const BLOCK: &str = "_SEGGER_RTT";
/// Section of the linker's hash over the image.
const ID: &str = ".note.gnu.build-id";

/// Identity of an image: the linker's hash and its address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Address of the channels' control block.
    pub block: u32,
    place: u32,
    id: Vec<u8>,
}

impl Image {
    /// Of the image in `elf`.
    ///
    /// # Errors
    /// [`FirmwareError::Image`] if it is no image of the firmware.
    pub fn of(elf: &[u8]) -> Result<Self, FirmwareError> {
        let wrong = |what: &str| FirmwareError::Image(what.to_owned());
        let file =
            ElfFile32::<Endianness>::parse(elf).map_err(|error| wrong(&error.to_string()))?;
        let block = file.symbols().find(|symbol| symbol.name() == Ok(BLOCK));
        let block = block.ok_or_else(|| wrong("it has no RTT channels"))?;
        let section = file.section_by_name(ID).ok_or_else(|| wrong("it has no hash"))?;
        let id = section.data().map_err(|error| wrong(&error.to_string()))?.to_vec();
        // Addresses of a chip with 32 bits.
        Ok(Self { block: block.address() as u32, place: section.address() as u32, id })
    }

    /// Whether a board has this image in its flash.
    ///
    /// # Errors
    /// [`PortError`] if its memory cannot be read.
    pub fn is_on(&self, port: &mut dyn Port) -> Result<bool, PortError> {
        let mut there = vec![0; self.id.len()];
        port.memory(self.place, &mut there)?;
        Ok(there == self.id)
    }
}
