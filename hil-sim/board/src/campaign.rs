//! The fault campaign on the emulated board: the firmware as it is flashed, faults at its pins
//! and registers, and the judge of the software campaign.
//!
//! The state of the drive in each tick is read from the restart record in the board's memory,
//! without a request to the firmware.

mod parameters;
mod restart;

use interstage::fault::Limit;
use interstage::params::{CompileError, slots};
use interstage::restart::{CRASH_WORDS, DriveSnapshot, Restart, SNAPSHOT_WORDS, later};
use interstage::supervise::{Command, Mode};
use interstage::tick::{Entry, Event, Output};
use interstage::units::Q16;

use crate::bench::Bench;
use crate::chip::Pin;
use crate::chip::map::PARAMETER_SETS;
use crate::error::BoardError;
use crate::fault_injector::Saving;
use crate::log::{Line, Strings};
use crate::params::store;
use crate::peripherals::rcc::Cause;
use hil_sim::faults::campaign::{AFTER_S, Instant, Trial, Twin};
use hil_sim::faults::judge::Finding;
use hil_sim::faults::sets;
use hil_sim::injector::FaultTimes;
use hil_sim::params::set_of;
use hil_sim::plant::rig::{Drives, VirtualRig};
use hil_sim::record::{Run, letter};
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Kind, Target};
use hil_sim::session::RunningRig;
use parameters::Parameters;
use restart::Hold;

/// Symbol of the record in the board's memory.
const RECORD: &str = "INTERSTAGE_RETAINED";
/// Beginning of the log's line about a damaged image.
const IMAGE: &str = "image: ";
/// The same in the matrix.
const IMAGE_DAMAGED: &str = "image damaged";
/// A damaged image that only the light reports, in the matrix.
const IMAGE_LIGHT: &str = "image damaged, by the light alone";
/// Longest time from the light to the log's line, s.
const LIGHT_TO_LOG_S: f64 = 1.0;
/// Most ticks that a record is ahead of the milliseconds since the start.
const AHEAD: u64 = 2;

/// An image and the strings of its log.
#[derive(Clone, Copy)]
pub struct Firmware<'a> {
    pub elf: &'a [u8],
    pub strings: &'a Strings,
}

/// A running board, seen from outside.
pub struct Board<'a> {
    pub(crate) bench: Bench<'a>,
    /// Mean commands at its bridges over the last millisecond.
    drives: Drives,
    /// Address of the first snapshot of the restart record.
    record: u32,
    /// Mode and speed in the last snapshot.
    mode: Mode,
    speed: Q16,
    /// Milliseconds since the last start.
    up: u64,
    pub(crate) restarts: usize,
    /// A command that the console has not accepted yet.
    pending: Option<Command>,
    frames: Vec<u8>,
    /// Lines of the log in the last millisecond.
    pub(crate) lines: Vec<Line>,
    /// Lines of the log about a restart.
    restart_lines: usize,
    /// The log about parameters since the last start.
    parameters: Parameters,
    /// First line of the log about a damaged image, s.
    image_s: Option<f64>,
    /// The log has a line since the last start.
    has_logged: bool,
    /// When the light first reported a damaged image, s.
    light_s: Option<f64>,
}

impl<'a> Board<'a> {
    /// A board with this image and the scenario's parameters, off.
    pub fn new(firmware: Firmware<'a>, scenario: &Scenario) -> Result<Self, BoardError> {
        let mut bench = Bench::new(firmware.elf, firmware.strings, scenario)?;
        store(&mut bench.machine, scenario)?;
        let record = bench.machine.image.symbol(RECORD)?;
        Ok(Self {
            bench,
            drives: Drives::default(),
            record: record + 4 * CRASH_WORDS as u32,
            mode: Mode::Boot,
            speed: Q16::ZERO,
            up: 0,
            restarts: 0,
            pending: None,
            frames: Vec::new(),
            lines: Vec::new(),
            restart_lines: 0,
            parameters: Parameters::default(),
            image_s: None,
            has_logged: false,
            light_s: None,
        })
    }

    /// Snapshot of the latest tick since the board started.
    fn snapshot(&self) -> Result<Option<DriveSnapshot>, BoardError> {
        let read = |place: u32| -> Result<Option<DriveSnapshot>, BoardError> {
            let mut words = [0; SNAPSHOT_WORDS];
            for (at, word) in (0..).zip(&mut words) {
                let address = self.record + 4 * (place * SNAPSHOT_WORDS as u32 + at);
                *word = self.bench.machine.word(address)?;
            }
            Ok(DriveSnapshot::open(&words))
        };
        let snapshot = later(read(0)?, read(1)?);
        // A snapshot from before the restart is excluded.
        Ok(snapshot.filter(|snapshot| u64::from(snapshot.tick) <= self.up + AHEAD))
    }

    /// Cause of the first restart, if the board reported every restart.
    fn restart(&self) -> Option<&'static str> {
        let (_, cause) = self.bench.machine.restarts().first()?;
        // The first power-up is reported as well.
        (self.restart_lines > 0 || reports(&self.frames).len() > self.restarts).then_some(
            match cause {
                Cause::Power => "reset by supply",
                Cause::Pin => "reset by pin",
                Cause::Software => "reset by software",
                Cause::Watchdog => "reset by watchdog",
            },
        )
    }
}

/// The reports of starts in a binary log.
pub fn reports(frames: &[u8]) -> Vec<Restart> {
    let events = Run::of_stream(frames).events.into_iter();
    let reports = events.filter_map(|entry| match entry.event {
        Event::Restart(restart) => Some(restart),
        _ => None,
    });
    reports.collect()
}

impl RunningRig for Board<'_> {
    type Error = BoardError;

    /// The output is what the judge needs of it.
    fn step(&mut self, command: Option<Command>) -> Result<Output, BoardError> {
        self.pending = command.or(self.pending);
        if let Some(pending) = self.pending
            && self.bench.send(letter(pending))?
        {
            self.pending = None;
        }
        let (passed, lines) = self.bench.step()?;
        self.drives = passed.drives;
        self.frames.extend(self.bench.take_frames());
        self.up += 1;
        let restarts = self.bench.machine.restarts().len();
        if restarts > std::mem::replace(&mut self.restarts, restarts) {
            (self.mode, self.speed, self.up) = (Mode::Boot, Q16::ZERO, 0);
            self.parameters = Parameters::default();
            self.has_logged = false;
        }
        self.has_logged |= !lines.is_empty();
        // Before the first line of a start, the light is on for a damaged image only.
        if self.restarts > 0 && !self.has_logged && self.bench.machine.chip().level(Pin::LIGHT) {
            self.light_s.get_or_insert(self.bench.time_s());
        }
        let mut output = Output::default();
        output.drive.enable = passed.drives.drive_on;
        output.preload.enable = passed.drives.preload_on;
        let before = self.mode;
        let snapshot = self.snapshot()?;
        if let Some((snapshot, mode)) =
            snapshot.and_then(|snapshot| Some((snapshot, snapshot.mode()?)))
        {
            (self.mode, self.speed) = (mode, snapshot.packed_speed.speed());
        }
        let mut say = |event| {
            // A millisecond has fewer events than the output holds.
            let _ = output.events.push(Entry { at: 0, event });
        };
        if let Mode::FaultHold(fault) = self.mode
            && before != self.mode
        {
            say(Event::Fault(fault));
        }
        for line in &lines {
            let limit = line.after("] limit ").and_then(|said| said.split_once(": "));
            let code = limit.and_then(|(code, _)| code.parse().ok());
            let known = Limit::ALL.into_iter().find(|limit| Some(limit.code()) == code);
            known.into_iter().for_each(|limit| say(Event::Limit(limit)));
            self.restart_lines += usize::from(line.text.starts_with("restarted "));
            self.parameters.read(&line.text, self.up);
            if line.text.starts_with(IMAGE) {
                self.image_s.get_or_insert(self.bench.time_s());
            }
        }
        self.lines = lines;
        output.telemetry.mode = self.mode;
        output.telemetry.speed_ref = self.speed;
        Ok(output)
    }

    fn mode(&self) -> Mode {
        self.mode
    }

    /// During a save of parameters the operator gives no command.
    fn is_free(&self) -> bool {
        self.bench.saving() != Some(Saving::Writing)
    }

    fn time_s(&self) -> f64 {
        self.bench.time_s()
    }

    fn plant(&self) -> &VirtualRig {
        &self.bench.plant
    }

    fn fault_times(&self) -> FaultTimes {
        self.bench.fault_times()
    }

    fn take_log(&mut self, _: bool) -> Vec<u8> {
        std::mem::take(&mut self.frames)
    }
}

/// The run without the fault.
pub fn twin(firmware: Firmware<'_>, scenario: &Scenario) -> Result<Twin, BoardError> {
    Twin::run(Board::new(firmware, scenario)?, scenario, AFTER_S)
}

/// A run with its fault, compared with its twin.
pub fn watched(
    firmware: Firmware<'_>,
    scenario: &Scenario,
    twin: &Twin,
) -> Result<Instant, BoardError> {
    let mut board = Board::new(firmware, scenario)?;
    let injection = scenario.run.faults.first();
    let reset = injection.is_some_and(Injection::resets_board);
    let mut hold = reset.then(|| store_kept(&mut board, scenario)).transpose()?;
    // One wrong bit is corrected by the chip.
    let damages = |f: &Injection| f.target == Target::Image && f.kind != Kind::OneWrongBit;
    let of_image = scenario.run.faults.iter().any(damages);
    let mut back_s = None;
    let trial = Trial::run(&mut board, scenario, twin, AFTER_S, |board, t_s, command, over| {
        if let Some(hold) = &mut hold {
            hold.look(board, command);
        }
        if board.restarts > 0 {
            back_s.get_or_insert(t_s);
        }
        // Only a save in progress delays the end of the run.
        let saves = matches!(board.bench.saving(), Some(Saving::Requested | Saving::Writing));
        match (board.image_s, board.light_s) {
            (Some(_), _) => true,
            // The log's line can still follow.
            (None, Some(light_s)) => t_s > light_s + LIGHT_TO_LOG_S,
            // The check of the image takes some seconds.
            (None, None) if of_image => false,
            (None, None) => !saves && (over || board.parameters.holds()),
        }
    })?;
    if injection.is_some_and(|fault| fault.target.is_of_start()) {
        return parameters::judged(board, trial, scenario);
    }
    let restart = match (board.image_s, board.light_s) {
        (Some(_), _) => Some(IMAGE_DAMAGED),
        (None, Some(_)) => Some(IMAGE_LIGHT),
        (None, None) => board.restart().filter(|_| !of_image),
    };
    let reported_s = match trial.report() {
        Some((at_s, _)) => Some(at_s),
        None => board.image_s.or(board.light_s).or(back_s).filter(|_| restart.is_some()),
    };
    let mut found = trial.found(reported_s);
    let (around, unrecorded) = match hold {
        Some(hold) => hold.judged(&mut board, scenario)?,
        None => (Vec::new(), None),
    };
    found.finding = match board.restarts {
        _ if unrecorded.is_some() => Finding::Undetected,
        0 if !of_image => found.finding,
        _ => Finding::of_restart(injection, restart),
    };
    if board.image_s.is_some() {
        found.end = "hold".into();
    }
    found.harms.extend(around.into_iter().chain(unrecorded));
    Ok(Instant { restart: restart.map(Into::into), ..found })
}

/// Stores the rig's parameters in the board's flash, which the reset must not change.
fn store_kept(board: &mut Board<'_>, scenario: &Scenario) -> Result<Hold, BoardError> {
    let set = set_of(sets::KEPT, &scenario.rig)?;
    let place = slots::slot_image(&set, 7).ok_or(CompileError::Room)?;
    board.bench.machine.poke(PARAMETER_SETS, &place)?;
    Ok(Hold::new(place.to_vec()))
}
