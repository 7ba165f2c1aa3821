//! A static that one function after the other fills and uses.

use core::cell::UnsafeCell;

/// A value that is absent until put there.
pub(super) struct Slot<T>(UnsafeCell<Option<T>>);

// SAFETY: the image has one thread and no interrupts.
unsafe impl<T> Sync for Slot<T> {}

impl<T> Slot<T> {
    pub(super) const fn new() -> Self {
        Self(UnsafeCell::new(None))
    }

    /// The slot's contents. One reference at a time: each function takes its slots
    /// once and lets go of them on return.
    #[expect(clippy::mut_from_ref, reason = "one thread, and each function takes a slot once")]
    pub(super) fn get(&self) -> &mut Option<T> {
        // SAFETY: as above.
        unsafe { &mut *self.0.get() }
    }
}
