//! Which image this is.

unsafe extern "C" {
    /// The note that the linker writes, see `memory.x`: three words of head, the name
    /// `GNU` with its zero, then the hash of the image.
    static __build_id: [u8; 24];
}

/// First eight bytes of the image's hash. `readelf -n` shows the whole of it.
pub(super) fn id() -> [u8; 8] {
    let mut id = [0; 8];
    // SAFETY: the linker script keeps the note, which is longer than what is read, in
    // flash, where nothing changes it.
    let note = unsafe { &__build_id };
    id.copy_from_slice(&note[16..]);
    id
}
