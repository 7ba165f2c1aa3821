//! A static that the functions fill and use in turn.

use core::cell::{Cell, UnsafeCell};
use core::mem::MaybeUninit;

/// A value that is absent until put there. It never drops what it holds.
pub(super) struct Slot<T> {
    there: Cell<bool>,
    value: UnsafeCell<MaybeUninit<T>>,
}

// SAFETY: the image has one thread and no interrupts.
unsafe impl<T> Sync for Slot<T> {}

impl<T> Slot<T> {
    pub(super) const fn new() -> Self {
        Self { there: Cell::new(false), value: UnsafeCell::new(MaybeUninit::uninit()) }
    }

    /// Puts what `make` returns into the slot, in place.
    #[inline(always)]
    pub(super) fn put(&self, make: impl FnOnce() -> T) {
        // SAFETY: one thread; whoever has a reference from `get` has let go of it.
        unsafe { (*self.value.get()).write(make()) };
        self.there.set(true);
    }

    /// The slot's contents. One reference at a time: each function takes its slots
    /// once and lets go of them on return.
    #[expect(clippy::mut_from_ref, reason = "one thread, and each function takes a slot once")]
    pub(super) fn get(&self) -> Option<&mut T> {
        // SAFETY: as above; what is there has been written.
        self.there.get().then(|| unsafe { (*self.value.get()).assume_init_mut() })
    }

    /// Empties the slot.
    pub(super) fn take(&self) -> Option<T>
    where
        T: Copy,
    {
        let value = self.get().copied();
        self.there.set(false);
        value
    }
}
