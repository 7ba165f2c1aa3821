//! An image of the board: its flash, its code, its symbols.

use std::collections::BTreeMap;
use std::ops::Range;

use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, SymbolKind, elf};

use super::core::unicorn::{Access, Memory};
use super::error::ImageError;

pub const FLASH: Memory = Memory { base: 0x0800_0000, size: 512 * 1024, access: Access::Code };
/// SRAM1, SRAM2 and the alias of the CCM SRAM behind them.
pub const RAM: Memory = Memory { base: 0x2000_0000, size: 128 * 1024, access: Access::Data };

/// The addresses below RAM. The reference manual reserves them, so that an access there may be
/// answered; here it is, as by RAM. Only the memory protection unit keeps a stack out of them.
pub(crate) const BELOW: Memory =
    Memory { base: 0x1FFF_8000, size: 32 * 1024, access: Access::Data };

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its code.
    pub range: Range<u32>,
    /// Its name, as in the source.
    pub name: String,
}

/// An image's memory and symbols.
pub struct Loaded {
    /// The complete flash.
    pub flash: Vec<u8>,
    /// Address ranges of instructions.
    pub code: Vec<Range<u32>>,
    /// Functions in the order of their addresses.
    pub functions: Vec<Function>,
    /// Every symbol with its value and size.
    symbols: BTreeMap<String, (u32, u32)>,
}

impl Loaded {
    /// Reads segments and symbols of an image.
    pub fn of(elf: &[u8]) -> Result<Self, ImageError> {
        let file = ElfFile32::<Endianness>::parse(elf).map_err(ImageError::form)?;
        let endian = file.endian();
        let mut flash = vec![0xFF; FLASH.size as usize];
        for segment in file.elf_program_headers() {
            let data =
                segment.data(endian, elf).map_err(|()| ImageError::form("a segment is cut off"))?;
            if segment.p_type(endian) != elf::PT_LOAD || data.is_empty() {
                continue;
            }
            let at = segment.p_paddr(endian).wrapping_sub(FLASH.base) as usize;
            let place = flash.get_mut(at..at + data.len());
            place
                .ok_or_else(|| ImageError::form("a segment lies outside the flash"))?
                .copy_from_slice(data);
        }
        let mut functions: Vec<Function> = file.symbols().filter_map(|s| function(&s)).collect();
        functions.sort_by_key(|f| f.range.start);
        functions.dedup_by_key(|f| f.range.start);
        let code = code(&file);
        if code.is_empty() {
            return Err(ImageError::form("its code is not marked by mapping symbols"));
        }
        let named = |s: &object::read::elf::ElfSymbol32<'_, '_, _>| {
            Some((s.name().ok()?.to_owned(), (s.address() as u32, s.size() as u32)))
        };
        let symbols = file.symbols().filter_map(|s| named(&s)).collect();
        Ok(Loaded { flash, code, functions, symbols })
    }

    /// Symbols with their values and sizes, in the order of their names.
    pub(crate) fn symbols(&self) -> impl Iterator<Item = (&str, u32, u32)> {
        self.symbols.iter().map(|(name, (value, size))| (name.as_str(), *value, *size))
    }

    pub fn symbol(&self, name: &str) -> Result<u32, ImageError> {
        self.symbols
            .get(name)
            .map(|(value, _)| *value)
            .ok_or_else(|| ImageError::Missing(name.to_owned()))
    }
}

/// Index of the function at an address, of functions in the order of their addresses.
pub fn function_at(functions: &[Function], address: u32) -> Option<usize> {
    let after = functions.partition_point(|f| f.range.start <= address);
    after.checked_sub(1).filter(|found| functions[*found].range.contains(&address))
}

pub fn named(functions: &[Function], address: u32) -> &str {
    function_at(functions, address).map_or("nowhere", |found| &functions[found].name)
}

fn function<'a>(symbol: &impl ObjectSymbol<'a>) -> Option<Function> {
    if symbol.kind() != SymbolKind::Text || symbol.size() == 0 {
        return None;
    }
    // Bit 0 says that it is Thumb code.
    let start = symbol.address() as u32 & !1;
    let name = format!("{:#}", rustc_demangle::demangle(symbol.name().ok()?));
    Some(Function { range: start..start + symbol.size() as u32, name })
}

/// Address ranges of instructions in flash: from each `$t` to the next mapping symbol.
fn code(file: &ElfFile32<'_, Endianness>) -> Vec<Range<u32>> {
    let kind = |name: &str| match name.as_bytes() {
        [b'$', kind @ (b't' | b'd' | b'a')] => Some(*kind),
        [b'$', kind @ (b't' | b'd' | b'a'), b'.', ..] => Some(*kind),
        _ => None,
    };
    let flash = FLASH.base..FLASH.base + FLASH.size;
    let mut marks: Vec<(u32, u8)> = file
        .symbols()
        .filter_map(|s| Some((s.address() as u32, kind(s.name().ok()?)?)))
        .filter(|(address, _)| flash.contains(address))
        .collect();
    marks.sort_unstable();
    let text = file.symbols().filter_map(|s| function(&s)).map(|f| f.range.end).max();
    let end = (text.unwrap_or(flash.start), b'd');
    marks.push(end);
    marks
        .windows(2)
        .filter(|pair| pair[0].1 == b't' && pair[0].0 < pair[1].0)
        .map(|pair| pair[0].0..pair[1].0)
        .collect()
}
