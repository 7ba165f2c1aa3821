//! Names of functions by address, from the image's debug information, so that what was
//! inlined keeps its name.

use addr2line::Context;
use gimli::{Dwarf, EndianSlice, LittleEndian, SectionId};
use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSection};

type Slice<'a> = EndianSlice<'a, LittleEndian>;

/// Names of functions by address.
pub(super) struct Names<'a>(Context<Slice<'a>>);

impl<'a> Names<'a> {
    /// Reads the debug information of `elf`.
    pub(super) fn read(elf: &'a [u8]) -> Self {
        let file = ElfFile32::<Endianness>::parse(elf).expect("an image");
        let section = |id: SectionId| -> Result<Slice<'a>, gimli::Error> {
            let data = file.section_by_name(id.name()).and_then(|s| s.data().ok());
            Ok(EndianSlice::new(data.unwrap_or_default(), LittleEndian))
        };
        let dwarf = Dwarf::load(section).expect("debug information");
        Self(Context::from_dwarf(dwarf).expect("debug information"))
    }

    /// The functions of the source at this address, innermost first, none without debug
    /// information.
    pub(super) fn frames(&self, address: u32) -> Vec<Frame> {
        let Ok(mut frames) = self.0.find_frames(address.into()).skip_all_loads() else {
            return Vec::new();
        };
        let mut found = Vec::new();
        while let Ok(Some(frame)) = frames.next() {
            let named = frame.function.and_then(|name| name.demangle().ok().map(|n| short(&n)));
            let place = frame.location;
            found.push(Frame {
                function: named.unwrap_or_default(),
                file: place.as_ref().and_then(|p| p.file).map(shortened).unwrap_or_default(),
                line: place.and_then(|p| p.line).unwrap_or_default(),
            });
        }
        found
    }
}

/// A function of the source, and a place in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Frame {
    /// Name, with the crate's.
    pub(super) function: String,
    /// File: of this project from its folder on, of others from that of their crate on.
    pub(super) file: String,
    /// Line, 0 where the compiler gives none.
    pub(super) line: u32,
}

/// A path of the debug information from where it says something.
fn shortened(path: &str) -> String {
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/");
    let own = own.strip_suffix("hil-sim/board/").unwrap_or(own);
    if let Some(rest) = path.strip_prefix(own) {
        return rest.to_owned();
    }
    if let Some((_, rest)) = path.split_once("/registry/src/") {
        return rest.split_once('/').map_or(rest, |(_, rest)| rest).to_owned();
    }
    match path.split_once("/library/") {
        Some((_, rest)) => rest.to_owned(),
        // A library's, as `firmware::build` leaves it.
        None => path.strip_prefix('/').unwrap_or(path).to_owned(),
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
