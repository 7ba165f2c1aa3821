//! The host's line, in thread mode: below every task, so that what runs here finds all
//! of them waiting.

use cortex_m::peripheral::DWT;
use interstage::hal::hil::{FIRST, Given, PROTOCOL, Taken, ToBoard, ToHost};
use interstage::log::codes;
use interstage::params::link::{FrameReader, frame};
use interstage::tasks::Exchange;
use interstage::units::Tick;
use rtt_target::{ChannelMode, DownChannel, UpChannel};

use super::clock;
use super::desk::DESK;

/// Cycles of a millisecond.
const MILLISECOND: u32 = 170_000;

/// Without a tick for so long, the host is taken for gone: half of what the watchdog,
/// which the ticks feed, has patience for.
const SILENCE: u32 = 50 * MILLISECOND;

/// The channels up and down.
type Channels = (UpChannel, DownChannel);

/// Waits for a host, calls `begin`, which starts the tasks, and goes through the host's
/// ticks. Before a host has come nothing runs, and nothing bites.
///
/// A host that falls silent is to the controller what it is to a drive: sensors that
/// answer no more. The board goes on alone, a tick a millisecond, so that the controller
/// finds the fault, turns the bridges off and holds, and the watchdog is fed by ticks
/// that run. There is no way back but a restart.
pub(crate) fn serve(channels: Channels, exchange: &Exchange, begin: impl FnOnce()) -> ! {
    count_cycles();
    let mut line = Line { channels, gatherer: FrameReader::new() };
    while line.take() != Some(ToBoard::Hello { protocol: PROTOCOL }) {}
    begin();
    let mut course = Course { next: FIRST, last: None, alone: false };
    line.send(&course.stands());
    let mut heard = DWT::cycle_count();
    loop {
        if let Some(message) = line.take() {
            if let Some(answer) = course.answer(message, exchange) {
                line.send(&answer);
            }
            if !course.alone {
                heard = DWT::cycle_count();
            }
        } else if course.alone && DWT::cycle_count().wrapping_sub(heard) >= MILLISECOND {
            heard = heard.wrapping_add(MILLISECOND);
            course.tick(DESK.given().silent());
        } else if DWT::cycle_count().wrapping_sub(heard) >= SILENCE {
            heard = DWT::cycle_count();
            course.alone = true;
        }
    }
}

/// Lets the core count its cycles, of which the silence is measured.
fn count_cycles() {
    // SAFETY: nobody else uses either, and nothing is taken away from anybody.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
}

/// How far the run has come.
struct Course {
    next: Tick,
    /// The latest tick and what it gave.
    last: Option<(Tick, Taken)>,
    alone: bool,
}

impl Course {
    const fn stands(&self) -> ToHost {
        ToHost::Next { tick: self.next, alone: self.alone }
    }

    /// Does what the host wants; none for what is not of this protocol.
    fn answer(&mut self, message: ToBoard, exchange: &Exchange) -> Option<ToHost> {
        match message {
            ToBoard::Hello { protocol } => (protocol == PROTOCOL).then(|| self.stands()),
            ToBoard::Tick(tick, given) if tick == self.next && !self.alone => {
                self.tick(given);
                let (drive, preload) = DESK.commands();
                let mode = exchange.telemetry().map_or(0, |seen| codes::of_mode(seen.mode));
                let taken = Taken::new(drive, preload, mode);
                self.last = Some((tick, taken));
                Some(ToHost::Done(tick, taken))
            }
            // The answer has not been heard.
            ToBoard::Tick(tick, _) => Some(match self.last {
                Some((last, taken)) if last == tick && !self.alone => ToHost::Done(last, taken),
                _ => self.stands(),
            }),
        }
    }

    /// A tick: the command first, because its task has to pass it on.
    fn tick(&mut self, given: Given) {
        DESK.give(given);
        if let Some(command) = codes::command(given.command) {
            DESK.pressed.signal(command);
            clock::settle();
        }
        clock::advance(self.next);
        self.next = self.next.wrapping_add(1);
    }
}

/// Frames over the two channels.
struct Line {
    channels: Channels,
    gatherer: FrameReader,
}

impl Line {
    /// A message, if one is complete with what has come.
    fn take(&mut self) -> Option<ToBoard> {
        let mut byte = [0];
        while self.channels.1.read(&mut byte) > 0 {
            if let Some(message) = self.gatherer.take(byte[0]) {
                return Some(message);
            }
        }
        None
    }

    /// A host that does not read asks again.
    fn send(&mut self, message: &ToHost) {
        let up = &mut self.channels.0;
        // A probe may have switched it to blocking.
        up.set_mode(ChannelMode::NoBlockSkip);
        if let Some(frame) = frame(message) {
            let _ = up.write(&frame);
        }
    }
}
