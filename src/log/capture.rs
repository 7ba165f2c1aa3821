//! The capture: what happened around a moment that matters, kept in memory until it has
//! been read.
//!
//! The stream of ticks tells more while someone reads it. The capture is for when nobody
//! does, or too slowly: it keeps raw codes and both bridges' duties at 100 Hz from 0.3 s
//! before its trigger to 0.9 s after it, and holds them until they have found room on
//! the channel.

#![deny(clippy::float_arithmetic)]

use heapless::{HistoryBuf, Vec};
use serde::{Deserialize, Serialize};

use super::record::Record;
use crate::supervise::{Leg, Mode, codes};
use crate::units::{Direction, Millimetres, Q16, Tick, q16};

/// Ticks from one shot to the next.
pub const EVERY: u32 = 10;

/// CaptureChunk that a capture has.
pub const SHOTS: usize = 120;

/// CaptureChunk after the trigger; the others are history.
pub const AFTER: u8 = 90;

/// CaptureChunk in a frame.
pub const IN_FRAME: usize = 16;

/// Way before the face at which a step counts as reached when it is dropped off, mm.
const CLOSE: Millimetres = q16(500_000);

/// What set a capture off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Trigger {
    /// By position, the wheel should be touching the step ahead now.
    Step,
    /// A fault was latched.
    Fault,
    /// The operator gave a command.
    Command,
}

/// A moment of a capture, 16 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CaptureSample {
    /// Low half of its tick.
    pub at: u16,
    /// Codes of wheel, preload sensor, tread, arm.
    pub codes: [u16; 4],
    /// Duties of drive and pre-tightener, Q15.
    pub duties: [i16; 2],
    /// Number of the mode.
    pub mode: u8,
    /// Number of the contact stage.
    pub stage: u8,
}

impl CaptureSample {
    fn of(record: &Record) -> Self {
        let seen = &record.telemetry;
        Self {
            at: seen.at as u16,
            codes: record.codes,
            duties: [seen.drive.to_bits(), seen.pretightener.to_bits()],
            mode: codes::of_mode(seen.mode),
            stage: seen.stage as u8,
        }
    }
}

/// A piece of a capture, as it is sent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CaptureChunk {
    /// What set it off.
    pub trigger: Trigger,
    /// When.
    pub at: Tick,
    /// Place of the piece's first shot in the capture.
    pub first: u8,
    /// CaptureChunk of the whole capture.
    pub of: u8,
    /// The shots.
    pub shots: Vec<CaptureSample, IN_FRAME>,
}

/// What a capture is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Doing {
    /// Keeps the latest, waits for a trigger.
    #[default]
    Watching,
    /// Triggered; so many shots are still to come.
    Filling(Trigger, Tick, u8),
    /// Whole; so many shots have been sent.
    Draining(Trigger, Tick, u8),
}

/// The ring of a capture, and what it waits for.
#[derive(Debug, Default)]
pub struct Capture {
    shots: HistoryBuf<CaptureSample, SHOTS>,
    doing: Doing,
    since: u32,
    /// This approach has set it off already.
    told: bool,
    held: bool,
}

impl Capture {
    /// A capture that waits.
    pub const fn new() -> Self {
        Self {
            shots: HistoryBuf::new(),
            doing: Doing::Watching,
            since: 0,
            told: false,
            held: false,
        }
    }

    /// Looks at a tick; `corner` is the way of the wheel over a corner, mm.
    pub fn look(&mut self, record: &Record, corner: Millimetres) {
        let trigger = self.trigger(record, corner);
        match (self.doing, trigger) {
            (Doing::Watching, Some(trigger)) => {
                self.doing = Doing::Filling(trigger, record.at(), AFTER);
            }
            // A fault outweighs what was to be seen before it.
            (
                Doing::Filling(Trigger::Step | Trigger::Command, ..)
                | Doing::Draining(Trigger::Step | Trigger::Command, ..),
                Some(Trigger::Fault),
            ) => self.doing = Doing::Filling(Trigger::Fault, record.at(), AFTER),
            _ => {}
        }
        self.since += 1;
        if self.since < EVERY || matches!(self.doing, Doing::Draining(..)) {
            return;
        }
        self.since = 0;
        self.shots.write(CaptureSample::of(record));
        if let Doing::Filling(trigger, at, left) = self.doing {
            self.doing = match left {
                0 | 1 => Doing::Draining(trigger, at, 0),
                _ => Doing::Filling(trigger, at, left - 1),
            };
        }
    }

    fn trigger(&mut self, record: &Record, corner: Millimetres) -> Option<Trigger> {
        let seen = &record.telemetry;
        let held = matches!(seen.mode, Mode::FaultHold(_));
        let fault = held && !self.held;
        self.held = held;
        let reached = match seen.mode {
            Mode::Run(Direction::Deploy, Leg::Approach | Leg::Crossing) => seen.distance <= corner,
            Mode::Run(Direction::Retract, Leg::Approach | Leg::Crossing) => seen.distance <= CLOSE,
            _ => {
                self.told = false;
                false
            }
        };
        let step = reached && !self.told;
        self.told |= reached;
        if fault {
            Some(Trigger::Fault)
        } else if step {
            Some(Trigger::Step)
        } else {
            record.flags.command().map(|_| Trigger::Command)
        }
    }

    /// The next piece to be sent, if there is one; [`Capture::sent`] says that it was.
    pub fn piece(&self) -> Option<CaptureChunk> {
        let Doing::Draining(trigger, at, first) = self.doing else { return None };
        let rest = self.shots.oldest_ordered().skip(usize::from(first));
        let shots: Vec<CaptureSample, IN_FRAME> = rest.take(IN_FRAME).copied().collect();
        Some(CaptureChunk { trigger, at, first, of: self.shots.len() as u8, shots })
    }

    /// A piece has found room on the channel. After the last, the capture watches again.
    pub fn sent(&mut self, piece: &CaptureChunk) {
        let Doing::Draining(trigger, at, _) = self.doing else { return };
        let next = piece.first + piece.shots.len() as u8;
        if next < piece.of {
            self.doing = Doing::Draining(trigger, at, next);
        } else {
            self.shots.clear();
            self.doing = Doing::Watching;
        }
    }
}

const _: () = assert!(SHOTS <= u8::MAX as usize && (AFTER as usize) < SHOTS);
const _: () = assert!(CLOSE.to_bits() < Q16::ONE.to_bits());

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "positions of the test")]
mod tests {
    use super::*;
    use crate::fault::Fault;

    const CORNER: Millimetres = q16(13_500_000);

    fn row(at: Tick, mode: Mode, distance_mm: f64) -> Record {
        let mut record = Record::EMPTY;
        record.telemetry.at = at;
        record.telemetry.mode = mode;
        record.telemetry.distance = Q16::from_num(distance_mm);
        record
    }

    /// Drives towards a step at 10 mm/s from 20 mm before its face.
    fn approach(capture: &mut Capture, from: Tick, ticks: u32, mode: Mode) -> Tick {
        for tick in 0..ticks {
            capture.look(&row(from + tick, mode, 20.0 - 0.01 * f64::from(tick)), CORNER);
        }
        from + ticks
    }

    fn whole(capture: &mut Capture) -> Option<(Trigger, Tick, std::vec::Vec<CaptureSample>)> {
        let mut all = std::vec::Vec::new();
        let first = capture.piece()?;
        while let Some(piece) = capture.piece() {
            assert_eq!((piece.trigger, piece.at), (first.trigger, first.at));
            assert_eq!(usize::from(piece.first), all.len());
            all.extend(piece.shots.iter().copied());
            capture.sent(&piece);
        }
        assert_eq!(all.len(), usize::from(first.of));
        Some((first.trigger, first.at, all))
    }

    #[test]
    fn a_step_is_seen_from_before_the_predicted_touch_to_after_it() {
        let mut capture = Capture::new();
        approach(&mut capture, 1000, 2000, Mode::Run(Direction::Deploy, Leg::Approach));
        let (trigger, at, shots) = whole(&mut capture).expect("captured");
        assert_eq!(trigger, Trigger::Step);
        // 20 mm less 13.5 mm at 0.01 mm a tick.
        assert_eq!(at, 1650);
        assert_eq!(shots.len(), SHOTS);
        for pair in shots.windows(2) {
            assert_eq!(u32::from(pair[1].at.wrapping_sub(pair[0].at)), EVERY);
        }
        let before = shots.iter().filter(|shot| u32::from(shot.at) < at).count();
        assert_eq!(before, SHOTS - usize::from(AFTER));
        assert!(capture.piece().is_none());
    }

    #[test]
    fn a_step_that_is_dropped_off_is_reached_at_its_face() {
        let mut capture = Capture::new();
        approach(&mut capture, 0, 3000, Mode::Run(Direction::Retract, Leg::Approach));
        assert_eq!(whole(&mut capture).map(|(_, at, _)| at), Some(1950));
    }

    #[test]
    fn one_approach_sets_it_off_once() {
        let mut capture = Capture::new();
        let crossing = Mode::Run(Direction::Deploy, Leg::Crossing);
        approach(&mut capture, 0, 2000, crossing);
        assert!(whole(&mut capture).is_some());
        for tick in 2000..5000 {
            capture.look(&row(tick, crossing, 1.0), CORNER);
        }
        assert!(whole(&mut capture).is_none());
    }

    #[test]
    fn a_fault_outweighs_a_step_and_nothing_outweighs_a_fault() {
        let mut capture = Capture::new();
        let now = approach(&mut capture, 0, 700, Mode::Run(Direction::Deploy, Leg::Approach));
        let hold = Mode::FaultHold(Fault::DriveStalled);
        for tick in now..now + 2000 {
            capture.look(&row(tick, hold, 100.0), CORNER);
        }
        approach(&mut capture, 3000, 2000, Mode::Run(Direction::Deploy, Leg::Approach));
        let (trigger, at, _) = whole(&mut capture).expect("captured");
        assert_eq!((trigger, at), (Trigger::Fault, 700));
    }

    #[test]
    fn a_piece_that_found_no_room_is_offered_again() {
        let mut capture = Capture::new();
        let mut commanded = row(5, Mode::Idle, 100.0);
        commanded.flags = super::super::record::Flags::from_bits(1);
        capture.look(&commanded, CORNER);
        for tick in 6..2000 {
            capture.look(&row(tick, Mode::Idle, 100.0), CORNER);
        }
        let piece = capture.piece().expect("captured");
        assert_eq!(capture.piece(), Some(piece.clone()));
        assert_eq!(piece.trigger, Trigger::Command);
        capture.sent(&piece);
        assert_eq!(capture.piece().map(|next| next.first), Some(IN_FRAME as u8));
    }
}
