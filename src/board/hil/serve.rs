//! The host's line, in thread mode: below every task, so it runs only while all of them wait.

use core::sync::atomic::Ordering;

use cortex_m::peripheral::DWT;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use interstage::hal::hil::{FIRST, Given, PROTOCOL, Taken, ToBoard, ToHost};
use interstage::log::codes;
use interstage::params::link::{FrameReader, frame};
use interstage::units::Tick;
use rtt_target::DownChannel;

use super::clock;
use super::host_io::{self, PRESSED};
use crate::board::rtt::Frames;
use crate::board::safety::UNFED;
use crate::board::{EXCHANGE, guard};

/// Cycles of a millisecond.
const MILLISECOND: u32 = 170_000;

/// Time without a tick after which the host counts as gone: longer than a probe's hub or host is
/// busy with something else.
const SILENCE: u32 = 200 * MILLISECOND;

/// Waits for a host, calls `begin`, which starts the tasks, and serves the host's ticks. Before
/// a host has come nothing runs but the watchdog, which this feeds: it runs only while every task
/// waits.
///
/// When the host falls silent, the sensors do. The board continues alone, a tick a millisecond,
/// so that the controller finds the fault, switches the bridges off and holds, and the ticks
/// feed the watchdog. Only a restart ends that.
pub(super) fn serve((up, down): (Frames, DownChannel), begin: impl FnOnce()) -> ! {
    guard::count_cycles();
    // SAFETY: what the tasks get at `begin` is set up once more, to the same.
    let mut dog = IndependentWatchdog::new(unsafe { IWDG::steal() }, guard::TIMEOUT_US);
    dog.unleash();
    let mut line = HostConnection { up, down, reader: FrameReader::new() };
    while line.take() != Some(ToBoard::Hello { protocol: PROTOCOL }) {
        dog.pet();
    }
    begin();
    let mut run = Run { next: FIRST, last: None, alone: false, unfed: 0 };
    line.send(&run.next_tick());
    let mut heard = DWT::cycle_count();
    loop {
        dog.pet();
        UNFED.store(run.unfed, Ordering::Relaxed);
        if let Some(message) = line.take() {
            if let Some(answer) = run.answer(message) {
                line.send(&answer);
            }
            if !run.alone {
                heard = DWT::cycle_count();
            }
        } else if run.alone && DWT::cycle_count().wrapping_sub(heard) >= MILLISECOND {
            heard = heard.wrapping_add(MILLISECOND);
            run.tick(host_io::get().given.silent());
        } else if DWT::cycle_count().wrapping_sub(heard) >= SILENCE {
            heard = DWT::cycle_count();
            run.alone = true;
        }
    }
}

struct Run {
    next: Tick,
    /// The latest tick and what it gave.
    last: Option<(Tick, Taken)>,
    alone: bool,
    /// [`UNFED`] after it: between ticks time is the host's, and does not count.
    unfed: u32,
}

impl Run {
    const fn next_tick(&self) -> ToHost {
        ToHost::Next { tick: self.next, alone: self.alone }
    }

    /// Executes a message; no answer to one of another protocol.
    fn answer(&mut self, message: ToBoard) -> Option<ToHost> {
        match message {
            ToBoard::Hello { protocol } => (protocol == PROTOCOL).then(|| self.next_tick()),
            ToBoard::Tick(tick, given) if tick == self.next && !self.alone => {
                self.tick(given);
                let (drive, preload) = host_io::get().commands;
                let mode = EXCHANGE.telemetry().map_or(0, |seen| codes::of_mode(seen.mode));
                let taken = Taken::new(drive, preload, mode);
                self.last = Some((tick, taken));
                Some(ToHost::Done(tick, taken))
            }
            // The host missed the answer.
            ToBoard::Tick(tick, _) => Some(match self.last {
                Some((last, taken)) if last == tick && !self.alone => ToHost::Done(last, taken),
                _ => self.next_tick(),
            }),
        }
    }

    /// A tick; the command first, because its task has to pass it on.
    fn tick(&mut self, given: Given) {
        host_io::change(|io| {
            io.given = given;
            io.cut |= given.stop;
        });
        if let Some(command) = codes::command(given.command) {
            PRESSED.signal(command);
            clock::settle();
        }
        clock::advance(self.next);
        self.unfed = UNFED.load(Ordering::Relaxed);
        self.next = self.next.wrapping_add(1);
    }
}

struct HostConnection {
    up: Frames,
    down: DownChannel,
    reader: FrameReader,
}

impl HostConnection {
    /// The next complete message that has arrived.
    fn take(&mut self) -> Option<ToBoard> {
        let mut byte = [0];
        while self.down.read(&mut byte) > 0 {
            if let Some(message) = self.reader.take(byte[0]) {
                return Some(message);
            }
        }
        None
    }

    /// A host that does not read asks again.
    fn send(&mut self, message: &ToHost) {
        if let Some(frame) = frame(message) {
            let _ = self.up.send(&frame);
        }
    }
}
