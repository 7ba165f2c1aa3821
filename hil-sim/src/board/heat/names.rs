//! Names of functions by address, from the image's debug information, so that what was
//! inlined is still told apart.

use addr2line::Context;
use gimli::{Dwarf, EndianSlice, LittleEndian, SectionId};
use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSection};

use crate::board::elf::form;
use crate::board::image::ImageError;

type Slice<'a> = EndianSlice<'a, LittleEndian>;

/// Names of functions by address.
pub(super) struct Names<'a>(Context<Slice<'a>>);

impl<'a> Names<'a> {
    /// Reads the debug information of `elf`.
    pub(super) fn read(elf: &'a [u8]) -> Result<Self, ImageError> {
        let file = ElfFile32::<Endianness>::parse(elf).map_err(form)?;
        let section = |id: SectionId| -> Result<Slice<'a>, gimli::Error> {
            let data = file.section_by_name(id.name()).and_then(|s| s.data().ok());
            Ok(EndianSlice::new(data.unwrap_or_default(), LittleEndian))
        };
        let dwarf = Dwarf::load(section).map_err(form)?;
        Ok(Self(Context::from_dwarf(dwarf).map_err(form)?))
    }

    /// The innermost function at this address, without type parameters.
    pub(super) fn at(&self, address: u32) -> Option<String> {
        let mut frames = self.0.find_frames(address.into()).skip_all_loads().ok()?;
        let name = frames.next().ok()??.function?;
        Some(short(&name.demangle().ok()?))
    }
}

/// A demangled name without its hash.
fn short(name: &str) -> String {
    match name.rsplit_once("::h") {
        Some((path, hash)) if hash.len() == 16 && hash.bytes().all(|b| b.is_ascii_hexdigit()) => {
            path.to_owned()
        }
        _ => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hash_is_cut_and_nothing_else() {
        assert_eq!(short("a::b::h0123456789abcdef"), "a::b");
        assert_eq!(short("a::halve"), "a::halve");
    }
}
