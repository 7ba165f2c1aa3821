//! Memory that no start clears: every reset keeps it except a loss of the supply.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use interstage::restart::{CRASH_WORDS, Crash, DriveSnapshot, SNAPSHOT_WORDS, Stopped, later};

use super::image;

#[repr(C)]
struct Kept {
    crash: [u32; CRASH_WORDS],
    /// Even and odd ticks.
    snapshots: [[u32; SNAPSHOT_WORDS]; 2],
}

struct Shared(UnsafeCell<MaybeUninit<Kept>>);

// SAFETY: written by the control tick, and by handlers that never return, on one core; read before
// the tick begins. Torn or unwritten words are plain integers, and the record's check rejects them.
unsafe impl Sync for Shared {}

/// A probe finds it by this name.
#[unsafe(link_section = ".uninit.retained")]
#[unsafe(export_name = "INTERSTAGE_RETAINED")]
static KEPT: Shared = Shared(UnsafeCell::new(MaybeUninit::uninit()));

fn kept() -> *mut Kept {
    KEPT.0.get().cast()
}

pub(super) fn keep(snapshot: &DriveSnapshot) {
    let place = (snapshot.tick & 1) as usize;
    // SAFETY: see `Shared`; the index is 0 or 1.
    unsafe { (&raw mut (*kept()).snapshots[place]).write_volatile(snapshot.seal()) }
}

/// Snapshot of the last complete tick.
#[inline(never)]
pub(super) fn snapshot() -> Option<DriveSnapshot> {
    // SAFETY: see `Shared`; read by a start, and by handlers that never return.
    let [even, odd] = unsafe { (&raw const (*kept()).snapshots).read_volatile() };
    later(DriveSnapshot::open(&even), DriveSnapshot::open(&odd))
}

/// What stopped the program before this start, if something did.
pub(super) fn crash() -> Option<Crash> {
    // SAFETY: nothing else runs yet. The words may be unwritten: a volatile read of any value.
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

/// Keeps this alone, until the first tick overwrites it.
pub(super) fn keep_only(snapshot: Option<DriveSnapshot>) {
    let first = snapshot.map_or([0; SNAPSHOT_WORDS], |snapshot| snapshot.seal());
    // SAFETY: nothing else runs at a start. The order matters: a reset in between finds the
    // snapshot in one place or the other.
    unsafe {
        (&raw mut (*kept()).snapshots).write_volatile([first, [0; SNAPSHOT_WORDS]]);
        (&raw mut (*kept()).crash).write_volatile([0; CRASH_WORDS]);
    }
}
