//! Real-time transfer to the debug probe: log, telemetry and console.
//!
//! A probe that attaches may switch the log channel to blocking, and once it has left, the
//! first full buffer would stall the core until the watchdog bites. So this logger gathers a
//! frame, sets the channel back to skipping, and writes the frame completely or not at all.
//! Lost frames are counted.
//!
//! It masks no interrupt: a line of many numbers takes half a control tick, which would delay
//! the next. All lines come from thread mode; one of an interrupt that finds another in
//! progress is lost and counted. The logger of `rtt-target` masks interrupts for a frame and
//! panics when a second one comes in between.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use defmt::Encoder;
use rtt_target::{ChannelMode, DownChannel, UpChannel, rtt_init};

/// Longest frame, bytes.
const FRAME: usize = 512;

static LOST: AtomicU32 = AtomicU32::new(0);

/// The channels other than the log.
pub(crate) struct Channels {
    /// Up 1: frames of the binary log.
    pub(crate) telemetry: Frames,
    /// Down 0: operator's letters.
    pub(crate) console: DownChannel,
    /// Up 2 and down 1: the binary line.
    pub(crate) line: (Frames, DownChannel),
}

/// Sets up the channels and the log, with these more channels, which are given back as well.
///
/// The binary log's buffer has a section of its own for word alignment: frames are copied by
/// words, at a third of the cost.
macro_rules! init {
    ([$($up:tt)*], [$($down:tt)*], $all:ident => $more:expr) => {{
        let $all = rtt_init! {
            up: {
                0: { size: 2048, mode: ChannelMode::NoBlockSkip, name: "defmt" }
                1: { size: 4096, mode: ChannelMode::NoBlockSkip, name: "telemetry", section: ".uninit.telemetry" }
                2: { size: 128, mode: ChannelMode::NoBlockSkip, name: "line" }
                $($up)*
            }
            down: {
                0: { size: 16, name: "console" }
                1: { size: 128, name: "line" }
                $($down)*
            }
        };
        log_to(Frames($all.up.0));
        let (telemetry, line) = (Frames($all.up.1), (Frames($all.up.2), $all.down.1));
        (Channels { telemetry, console: $all.down.0, line }, $more)
    }};
}

/// Sets up the channels and the log. Call once, first of all.
#[cfg(not(feature = "hil"))]
pub(crate) fn init() -> Channels {
    init!([], [], all => ()).0
}

/// The same with up 3 and down 2 for the closed loop with the host.
#[cfg(feature = "hil")]
pub(crate) fn init() -> (Channels, (Frames, DownChannel)) {
    init!(
        [3: { size: 64, mode: ChannelMode::NoBlockSkip, name: "hil" }],
        [2: { size: 64, name: "hil" }],
        all => (Frames(all.up.3), all.down.2)
    )
}

fn log_to(channel: Frames) {
    // SAFETY: nothing has been logged yet, so nobody else holds the state.
    unsafe { (*STATE.0.get()).channel = Some(channel) };
}

/// A channel to the host.
pub(crate) struct Frames(UpChannel);

impl Frames {
    /// Writes a frame completely or not at all, and returns which; resets a channel that a
    /// probe has switched to blocking.
    pub(crate) fn send(&mut self, frame: &[u8]) -> bool {
        self.0.set_mode(ChannelMode::NoBlockSkip);
        self.0.write(frame) == frame.len()
    }
}

/// Log frames lost since boot; wraps.
pub(crate) fn lost() -> u32 {
    LOST.load(Ordering::Relaxed)
}

struct State {
    channel: Option<Frames>,
    encoder: Encoder,
    bytes: [u8; FRAME],
    length: usize,
    cut: bool,
}

impl State {
    /// Runs one call of the encoder, and appends its output to the frame.
    fn encode(&mut self, call: impl FnOnce(&mut Encoder, &mut dyn FnMut(&[u8]))) {
        let Self { encoder, bytes, length, cut, .. } = self;
        call(encoder, &mut |part| match bytes.get_mut(*length..*length + part.len()) {
            Some(room) => {
                room.copy_from_slice(part);
                *length += part.len();
            }
            None => *cut = true,
        });
    }

    fn send(&mut self) {
        let Some(channel) = &mut self.channel else { return };
        let frame = self.bytes.get(..self.length).unwrap_or_default();
        if self.cut || !channel.send(frame) {
            LOST.fetch_add(1, Ordering::Relaxed);
        }
    }
}

struct Shared(UnsafeCell<State>);

// SAFETY: touched only in `init`, before anything is logged, and by the caller that changed
// `OPEN` from false to true, until it resets it; this chip has one core.
unsafe impl Sync for Shared {}

static STATE: Shared = Shared(UnsafeCell::new(State {
    channel: None,
    encoder: Encoder::new(),
    bytes: [0; FRAME],
    length: 0,
    cut: false,
}));

static OPEN: AtomicBool = AtomicBool::new(false);

/// Frames begun in interrupts meanwhile that have not ended.
static NESTED: AtomicU32 = AtomicU32::new(0);

#[defmt::global_logger]
struct Logger;

// SAFETY: `acquire` either owns the state until `release`, or drops the frame and its writes.
// An interrupt that logs has ended its frame when the interrupted one continues.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        if OPEN.swap(true, Ordering::Acquire) {
            NESTED.fetch_add(1, Ordering::Relaxed);
            LOST.fetch_add(1, Ordering::Relaxed);
            return;
        }
        // SAFETY: this call changed `OPEN`, see `Shared`.
        let state = unsafe { &mut *STATE.0.get() };
        state.length = 0;
        state.cut = false;
        state.encode(|encoder, out| encoder.start_frame(out));
    }

    unsafe fn flush() {
        // It would wait for the probe.
    }

    unsafe fn write(bytes: &[u8]) {
        if NESTED.load(Ordering::Relaxed) > 0 {
            return;
        }
        // SAFETY: between `acquire` and `release` of the owning frame.
        let state = unsafe { &mut *STATE.0.get() };
        state.encode(|encoder, out| encoder.write(bytes, out));
    }

    unsafe fn release() {
        let nested = NESTED.load(Ordering::Relaxed);
        if nested > 0 {
            NESTED.store(nested - 1, Ordering::Relaxed);
            return;
        }
        // SAFETY: as in `write`; released before the next frame can own it.
        let state = unsafe { &mut *STATE.0.get() };
        state.encode(|encoder, out| encoder.end_frame(out));
        state.send();
        OPEN.store(false, Ordering::Release);
    }
}
