//! Real-time transfer to the debug probe: log, telemetry and console.
//!
//! A probe that attaches may switch the log channel to blocking, and once it has
//! left, the first full buffer would stall the core until the watchdog bites.
//! So the log has a logger of its own here: it gathers a frame, puts the channel
//! back to skipping, and writes the frame whole or not at all. What is lost is
//! counted.
//!
//! It shuts out no interrupt meanwhile: a line of many numbers takes as long as half a
//! control tick, which would begin that much later. All lines come from thread mode; one
//! of an interrupt that finds another under way is lost, and counted.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use defmt::Encoder;
use rtt_target::{ChannelMode, DownChannel, UpChannel, rtt_init};

/// Longest frame, bytes: a panic message with its place.
const FRAME: usize = 512;

static LOST: AtomicU32 = AtomicU32::new(0);

/// The channels that are not the log.
pub(crate) struct Channels {
    /// Up 1: frames of the binary log.
    pub(crate) telemetry: Frames,
    /// Down 0: operator's letters.
    pub(crate) console: DownChannel,
    /// Up 2 and down 1: the binary line.
    pub(crate) line: (UpChannel, DownChannel),
}

/// Sets up the channels; the log works from here on. Call once, first of all.
///
/// The binary log's buffer lies where all else is whole words, and so on a whole word, like
/// the frames: copied word by word they cost a third.
#[cfg(not(feature = "hil"))]
pub(crate) fn init() -> Channels {
    let channels = rtt_init! {
        up: {
            0: { size: 2048, mode: ChannelMode::NoBlockSkip, name: "defmt" }
            1: { size: 4096, mode: ChannelMode::NoBlockSkip, name: "telemetry", section: ".uninit.telemetry" }
            2: { size: 128, mode: ChannelMode::NoBlockSkip, name: "line" }
        }
        down: {
            0: { size: 16, name: "console" }
            1: { size: 128, name: "line" }
        }
    };
    log_to(channels.up.0);
    Channels {
        telemetry: Frames(channels.up.1),
        console: channels.down.0,
        line: (channels.up.2, channels.down.1),
    }
}

/// The same with up 3 and down 2, over which the host closes the loop.
#[cfg(feature = "hil")]
pub(crate) fn init() -> (Channels, (UpChannel, DownChannel)) {
    let channels = rtt_init! {
        up: {
            0: { size: 2048, mode: ChannelMode::NoBlockSkip, name: "defmt" }
            1: { size: 4096, mode: ChannelMode::NoBlockSkip, name: "telemetry", section: ".uninit.telemetry" }
            2: { size: 128, mode: ChannelMode::NoBlockSkip, name: "line" }
            3: { size: 64, mode: ChannelMode::NoBlockSkip, name: "hil" }
        }
        down: {
            0: { size: 16, name: "console" }
            1: { size: 128, name: "line" }
            2: { size: 64, name: "hil" }
        }
    };
    log_to(channels.up.0);
    let rest = Channels {
        telemetry: Frames(channels.up.1),
        console: channels.down.0,
        line: (channels.up.2, channels.down.1),
    };
    (rest, (channels.up.3, channels.down.2))
}

fn log_to(channel: UpChannel) {
    // SAFETY: nothing has been logged yet, so nobody else holds the state.
    unsafe { (*STATE.0.get()).channel = Some(channel) };
}

/// The binary log's channel.
pub(crate) struct Frames(UpChannel);

impl Frames {
    /// Writes a frame whole, or not at all; says which. What a probe may have set the
    /// channel to does not matter.
    pub(crate) fn send(&mut self, frame: &[u8]) -> bool {
        self.0.set_mode(ChannelMode::NoBlockSkip);
        self.0.write(frame) == frame.len()
    }
}

/// Log frames lost since boot; wraps.
pub(crate) fn lost() -> u32 {
    LOST.load(Ordering::Relaxed)
}

/// The frame under way.
struct State {
    channel: Option<UpChannel>,
    encoder: Encoder,
    bytes: [u8; FRAME],
    length: usize,
    cut: bool,
}

impl State {
    /// Runs one call of the encoder, its output appended to the frame.
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
        channel.set_mode(ChannelMode::NoBlockSkip);
        let frame = self.bytes.get(..self.length).unwrap_or_default();
        if self.cut || channel.write(frame) < self.length {
            LOST.fetch_add(1, Ordering::Relaxed);
        }
    }
}

struct Shared(UnsafeCell<State>);

// SAFETY: touched only in `init`, before anything is logged, and by who has found `OPEN`
// false and made it true, until that makes it false again; this chip has one core.
unsafe impl Sync for Shared {}

static STATE: Shared = Shared(UnsafeCell::new(State {
    channel: None,
    encoder: Encoder::new(),
    bytes: [0; FRAME],
    length: 0,
    cut: false,
}));

/// A frame is under way.
static OPEN: AtomicBool = AtomicBool::new(false);

/// Frames that have begun meanwhile, in interrupts, and have not ended.
static NESTED: AtomicU32 = AtomicU32::new(0);

#[defmt::global_logger]
struct Logger;

// SAFETY: `acquire` either has the state to itself until `release`, or gives the frame up
// and what it writes is left out. An interrupt that logs has ended its frame when the one
// that it interrupted goes on.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        if OPEN.swap(true, Ordering::Acquire) {
            NESTED.fetch_add(1, Ordering::Relaxed);
            LOST.fetch_add(1, Ordering::Relaxed);
            return;
        }
        // SAFETY: nobody else has found it free.
        let state = unsafe { &mut *STATE.0.get() };
        state.length = 0;
        state.cut = false;
        state.encode(|encoder, out| encoder.start_frame(out));
    }

    unsafe fn flush() {
        // Would wait for the probe.
    }

    unsafe fn write(bytes: &[u8]) {
        if NESTED.load(Ordering::Relaxed) > 0 {
            return;
        }
        // SAFETY: between `acquire` and `release` of the frame that has it.
        let state = unsafe { &mut *STATE.0.get() };
        state.encode(|encoder, out| encoder.write(bytes, out));
    }

    unsafe fn release() {
        let nested = NESTED.load(Ordering::Relaxed);
        if nested > 0 {
            NESTED.store(nested - 1, Ordering::Relaxed);
            return;
        }
        // SAFETY: as in `write`; let go before the next can have it.
        let state = unsafe { &mut *STATE.0.get() };
        state.encode(|encoder, out| encoder.end_frame(out));
        state.send();
        OPEN.store(false, Ordering::Release);
    }
}
