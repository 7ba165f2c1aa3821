//! Capture: sensor codes and duties around a trigger, at 100 Hz from 0.3 s before it to 0.9 s
//! after it, kept in memory until they have been sent. It serves a reader that is absent or too
//! slow for the stream of ticks.

#![deny(clippy::float_arithmetic)]

use heapless::{HistoryBuf, Vec};
use serde::{Deserialize, Serialize};

use super::record::Record;
use crate::sense::raw::SensorId;
use crate::supervise::{Leg, Mode, codes};
use crate::units::{Direction, Millimetres, Q16, Tick, q16};

/// Ticks from one sample to the next.
pub const EVERY: u32 = 10;

/// Samples of a capture.
pub const SAMPLES: usize = 120;

/// Samples after the trigger; the others are history.
pub const AFTER: u8 = 90;

/// Samples in a chunk.
pub const CHUNK_SAMPLES: usize = 16;

/// Distance to the face at which a retracting wheel counts as there, mm.
const CLOSE: Millimetres = q16(500_000);

/// What triggered a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Trigger {
    /// By position, the wheel touches the step ahead.
    Step,
    /// A fault was latched.
    Fault,
    /// The operator gave a command.
    Command,
}

/// A sample of a capture, 16 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CaptureSample {
    /// Low half of its tick.
    pub at: u16,
    /// Codes of wheel, preload sensor, compression sensor, arm.
    pub codes: [u16; SensorId::COUNT],
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

/// A part of a capture, in one frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CaptureChunk {
    /// The trigger.
    pub trigger: Trigger,
    /// Time of the trigger.
    pub at: Tick,
    /// Index of the chunk's first sample in the capture.
    pub first: u8,
    /// Samples of the complete capture.
    pub of: u8,
    /// The samples.
    pub samples: Vec<CaptureSample, CHUNK_SAMPLES>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Progress {
    /// Keeps the latest samples, waits for a trigger.
    #[default]
    Watching,
    /// Triggered; so many samples are still to come.
    Filling(Trigger, Tick, u8),
    /// Complete; so many samples have been sent.
    Draining(Trigger, Tick, u8),
}

/// The ring of samples and the trigger's state.
#[derive(Debug, Default)]
pub struct Capture {
    samples: HistoryBuf<CaptureSample, SAMPLES>,
    progress: Progress,
    since: u32,
    /// This approach has triggered already.
    triggered: bool,
    held: bool,
}

impl Capture {
    /// A capture that waits.
    pub const fn new() -> Self {
        Self {
            samples: HistoryBuf::new(),
            progress: Progress::Watching,
            since: 0,
            triggered: false,
            held: false,
        }
    }

    /// Takes one tick into account; `corner` is the travel of the wheel over a corner, mm.
    pub fn look(&mut self, record: &Record, corner: Millimetres) {
        if let Some(trigger) = self.trigger(record, corner)
            && match self.progress {
                Progress::Watching => true,
                // A fault outweighs what was to be seen before it.
                Progress::Filling(before, ..) | Progress::Draining(before, ..) => {
                    trigger == Trigger::Fault && before != Trigger::Fault
                }
            }
        {
            self.progress = Progress::Filling(trigger, record.at(), AFTER);
        }
        self.since += 1;
        if self.since < EVERY || matches!(self.progress, Progress::Draining(..)) {
            return;
        }
        self.since = 0;
        self.samples.write(CaptureSample::of(record));
        if let Progress::Filling(trigger, at, left) = self.progress {
            self.progress = match left {
                0 | 1 => Progress::Draining(trigger, at, 0),
                _ => Progress::Filling(trigger, at, left - 1),
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
                self.triggered = false;
                false
            }
        };
        let step = reached && !self.triggered;
        self.triggered |= reached;
        if fault {
            Some(Trigger::Fault)
        } else if step {
            Some(Trigger::Step)
        } else {
            record.flags.command().map(|_| Trigger::Command)
        }
    }

    /// The next chunk to send, if there is one; [`Capture::sent`] confirms it.
    pub fn chunk(&self) -> Option<CaptureChunk> {
        let Progress::Draining(trigger, at, first) = self.progress else { return None };
        let rest = self.samples.oldest_ordered().skip(usize::from(first));
        let samples = rest.take(CHUNK_SAMPLES).copied().collect();
        Some(CaptureChunk { trigger, at, first, of: self.samples.len() as u8, samples })
    }

    /// The chunk has been sent. After the last, the capture watches again.
    pub fn sent(&mut self, chunk: &CaptureChunk) {
        let Progress::Draining(trigger, at, _) = self.progress else { return };
        let next = chunk.first + chunk.samples.len() as u8;
        if next < chunk.of {
            self.progress = Progress::Draining(trigger, at, next);
        } else {
            self.samples.clear();
            self.progress = Progress::Watching;
        }
    }
}

const _: () = assert!(SAMPLES <= u8::MAX as usize && (AFTER as usize) < SAMPLES);
const _: () = assert!(CLOSE.to_bits() < Q16::ONE.to_bits());

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "positions of the test")]
mod tests {
    use super::*;
    use crate::fault::Fault;

    const CORNER: Millimetres = q16(13_500_000);

    fn row(at: Tick, mode: Mode, distance_mm: f64) -> Record {
        let mut record = Record::default();
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

    fn drained(capture: &mut Capture) -> Option<(Trigger, Tick, std::vec::Vec<CaptureSample>)> {
        let mut all = std::vec::Vec::new();
        let first = capture.chunk()?;
        while let Some(chunk) = capture.chunk() {
            assert_eq!((chunk.trigger, chunk.at), (first.trigger, first.at));
            assert_eq!(usize::from(chunk.first), all.len());
            all.extend(chunk.samples.iter().copied());
            capture.sent(&chunk);
        }
        assert_eq!(all.len(), usize::from(first.of));
        Some((first.trigger, first.at, all))
    }

    #[test]
    fn a_step_is_seen_from_before_the_predicted_touch_to_after_it() {
        let mut capture = Capture::new();
        approach(&mut capture, 1000, 2000, Mode::Run(Direction::Deploy, Leg::Approach));
        let (trigger, at, samples) = drained(&mut capture).expect("captured");
        assert_eq!(trigger, Trigger::Step);
        // 20 mm less 13.5 mm at 0.01 mm a tick.
        assert_eq!(at, 1650);
        assert_eq!(samples.len(), SAMPLES);
        for pair in samples.windows(2) {
            assert_eq!(u32::from(pair[1].at.wrapping_sub(pair[0].at)), EVERY);
        }
        let before = samples.iter().filter(|sample| u32::from(sample.at) < at).count();
        assert_eq!(before, SAMPLES - usize::from(AFTER));
        assert!(capture.chunk().is_none());
    }

    #[test]
    fn a_step_that_is_dropped_off_is_reached_at_its_face() {
        let mut capture = Capture::new();
        approach(&mut capture, 0, 3000, Mode::Run(Direction::Retract, Leg::Approach));
        assert_eq!(drained(&mut capture).map(|(_, at, _)| at), Some(1950));
    }

    #[test]
    fn one_approach_sets_it_off_once() {
        let mut capture = Capture::new();
        let crossing = Mode::Run(Direction::Deploy, Leg::Crossing);
        approach(&mut capture, 0, 2000, crossing);
        assert!(drained(&mut capture).is_some());
        for tick in 2000..5000 {
            capture.look(&row(tick, crossing, 1.0), CORNER);
        }
        assert!(drained(&mut capture).is_none());
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
        let (trigger, at, _) = drained(&mut capture).expect("captured");
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
        let chunk = capture.chunk().expect("captured");
        assert_eq!(capture.chunk(), Some(chunk.clone()));
        assert_eq!(chunk.trigger, Trigger::Command);
        capture.sent(&chunk);
        assert_eq!(capture.chunk().map(|next| next.first), Some(CHUNK_SAMPLES as u8));
    }
}
