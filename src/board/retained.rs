//! Memory that no start clears: every reset but that of a lost supply leaves it as it is.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use interstage::restart::{CRASH_WORDS, Crash, DriveSnapshot, SNAPSHOT_WORDS, Stopped, later};

use super::image;

/// What is kept.
#[repr(C)]
struct Kept {
    crash: [u32; CRASH_WORDS],
    /// Even and odd ticks.
    snapshots: [[u32; SNAPSHOT_WORDS]; 2],
}

struct Shared(UnsafeCell<MaybeUninit<Kept>>);

// SAFETY: written by the control tick, and by handlers that never return, on one core;
// read before the tick begins. What is torn or never written is words like any other,
// and told from a record by its check.
unsafe impl Sync for Shared {}

/// By this name a probe finds it.
#[unsafe(link_section = ".uninit.retained")]
#[unsafe(export_name = "INTERSTAGE_RETAINED")]
static KEPT: Shared = Shared(UnsafeCell::new(MaybeUninit::uninit()));

fn kept() -> *mut Kept {
    KEPT.0.get().cast()
}

/// Keeps what the drive does in a tick.
pub(super) fn keep(snapshot: &DriveSnapshot) {
    let place = (snapshot.tick & 1) as usize;
    // SAFETY: see `Shared`; the index is 0 or 1.
    unsafe { (&raw mut (*kept()).snapshots[place]).write_volatile(snapshot.seal()) }
}

/// What is kept of the last complete tick.
#[inline(never)]
pub(super) fn snapshot() -> Option<DriveSnapshot> {
    // SAFETY: see `Shared`; read by a start, and by handlers that never return.
    let [even, odd] = unsafe { (&raw const (*kept()).snapshots).read_volatile() };
    later(DriveSnapshot::open(&even), DriveSnapshot::open(&odd))
}

/// What stopped the program before this start, if something did.
pub(super) fn crash() -> Option<Crash> {
    // SAFETY: nobody else is there yet. The words may never have been written, so they are
    // read as volatile memory that holds anything.
    Crash::open(&unsafe { (&raw const (*kept()).crash).read_volatile() })
}

/// Keeps why the program ends.
#[inline(never)]
pub(super) fn stop(stopped: Stopped) {
    // SAFETY: see `Shared`.
    unsafe { (&raw mut (*kept()).crash).write_volatile(now(stopped).seal()) }
}

/// A crash of this image.
pub(super) fn now(stopped: Stopped) -> Crash {
    let [a, b, c, d, ..] = image::id();
    Crash { build: u32::from_le_bytes([a, b, c, d]), stopped }
}

/// Keeps this alone until the first tick writes over it.
pub(super) fn forget_but(snapshot: Option<DriveSnapshot>) {
    let first = snapshot.map_or([0; SNAPSHOT_WORDS], |snapshot| snapshot.seal());
    // SAFETY: a start is alone. In this order: a reset that comes again finds here what it
    // was, in one place or the other.
    unsafe {
        (&raw mut (*kept()).snapshots).write_volatile([first, [0; SNAPSHOT_WORDS]]);
        (&raw mut (*kept()).crash).write_volatile([0; CRASH_WORDS]);
    }
}
