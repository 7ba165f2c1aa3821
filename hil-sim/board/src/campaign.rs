//! The campaign on the emulated board: the firmware as it is flashed, broken at its pins and
//! registers, judged by the same judge.
//!
//! What the drive does in each tick is read where a restart would find it, in the record in
//! the board's memory; nothing is asked of the firmware for it.

mod parameters;
mod restart;

use interstage::fault::Limit;
use interstage::params::{CompileError, slots};
use interstage::restart::{CRASH_WORDS, DriveSnapshot, SNAPSHOT_WORDS, later};
use interstage::supervise::{Command, Mode};
use interstage::tick::{Entry, Event, Output};
use interstage::units::Q16;

use crate::bench::{Bench, BenchError, Passed};
use crate::chip::Pin;
use crate::chip::map::PARAMETER_SETS;
use crate::fault_injector::{Saving, letter};
use crate::log::Strings;
use crate::peripherals::rcc::Cause;
use crate::run::{RunError, store};
use hil_sim::faults::campaign::operator::Operator;
use hil_sim::faults::campaign::twin::Twin;
use hil_sim::faults::campaign::{AFTER_S, Campaign, Instant, LONGEST_S, Outcome, crossed, doing};
use hil_sim::faults::judge::{Finding, Judge};
use hil_sim::faults::sets;
use hil_sim::params::set_of;
use hil_sim::record::Run;
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Target};
use parameters::Parameters;
use restart::Hold;

/// Symbol of the record in the board's memory.
const RECORD: &str = "INTERSTAGE_RETAINED";
/// What it says of an image of which a bit has turned over.
const IMAGE: &str = "image: ";
/// How that is reported, in the matrix.
const IMAGE_DAMAGED: &str = "image damaged";
/// The same where it can no longer say so.
const IMAGE_LIGHT: &str = "image damaged, by the light alone";
/// How long it may take to say what the light tells, s.
const SAYS_S: f64 = 1.0;
/// Ticks that a record may be ahead of the clock since a restart.
const AHEAD: u64 = 2;

/// An image and how its log reads.
#[derive(Clone, Copy)]
pub struct Firmware<'a> {
    /// The image.
    pub elf: &'a [u8],
    /// Its strings.
    pub strings: &'a Strings,
}

/// Makes all runs of a campaign on the emulated board, as [`Campaign::run`] does in
/// software.
///
/// # Errors
/// [`RunError`] if a run without a fault cannot be made.
pub fn run(
    campaign: &Campaign,
    firmware: Firmware<'_>,
    done: &(dyn Fn() + Sync),
) -> Result<Outcome, RunError> {
    let twin = |scenario: &Scenario| twin(firmware, scenario);
    let watched = |scenario: &Scenario, twin: &Twin| watched(firmware, scenario, twin);
    campaign.run_on("board", twin, watched, done)
}

/// A board under way.
struct Board<'a> {
    bench: Bench<'a>,
    record: u32,
    /// The last tick of which there is a record.
    mode: Mode,
    speed: Q16,
    /// Milliseconds since the board last started.
    up: u64,
    restarts: usize,
    /// A command that the console has not taken yet.
    owed: Option<Command>,
    frames: Vec<u8>,
    /// What it said of why it restarted.
    said: usize,
    /// What it said of its parameters since it last started.
    parameters: Parameters,
    /// When it first said that its image is damaged, s.
    image_s: Option<f64>,
    /// It has said something since it last started.
    heard: bool,
    /// When the light first told of a damaged image, s.
    light_s: Option<f64>,
}

impl<'a> Board<'a> {
    fn new(firmware: Firmware<'a>, scenario: &Scenario) -> Result<Self, RunError> {
        let bench = Bench::new(firmware.elf, firmware.strings, scenario);
        let mut bench = bench.map_err(BenchError::from)?;
        store(bench.machine_mut(), scenario)?;
        let record = bench.machine().image().symbol(RECORD);
        let record = record.map_err(BenchError::from)?;
        Ok(Self {
            bench,
            record: record + 4 * CRASH_WORDS as u32,
            mode: Mode::Boot,
            speed: Q16::ZERO,
            up: 0,
            restarts: 0,
            owed: None,
            frames: Vec::new(),
            said: 0,
            parameters: Parameters::default(),
            image_s: None,
            heard: false,
            light_s: None,
        })
    }

    /// A millisecond with a command or none. Gives what the controller put out as far as it
    /// matters to the judge.
    fn step(&mut self, command: Option<Command>) -> Result<Output, RunError> {
        Ok(self.step_with(command)?.0)
    }

    /// The same, with what passed at the pins.
    fn step_with(&mut self, command: Option<Command>) -> Result<(Output, Passed), RunError> {
        self.owed = command.or(self.owed);
        if let Some(owed) = self.owed
            && self.bench.send(letter(owed))?
        {
            self.owed = None;
        }
        let (passed, lines) = self.bench.step()?;
        self.frames.extend(self.bench.take_frames());
        self.up += 1;
        let restarts = self.bench.machine().restarts().len();
        if restarts > std::mem::replace(&mut self.restarts, restarts) {
            (self.mode, self.speed, self.up) = (Mode::Boot, Q16::ZERO, 0);
            self.parameters = Parameters::default();
            self.heard = false;
        }
        self.heard |= !lines.is_empty();
        // Nothing else lights it before the first word of a start.
        if self.restarts > 0 && !self.heard && self.bench.machine().chip().level(Pin::LIGHT) {
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
            // More than there is room for comes in no millisecond.
            let _ = output.events.push(Entry { at: 0, event });
        };
        if let Mode::FaultHold(fault) = self.mode
            && before != self.mode
        {
            say(Event::Fault(fault));
        }
        for line in &lines {
            let limit = line.behind("] limit ").and_then(|said| said.split_once(": "));
            let code = limit.and_then(|(code, _)| code.parse().ok());
            let known = Limit::ALL.into_iter().find(|limit| Some(limit.code()) == code);
            known.into_iter().for_each(|limit| say(Event::Limit(limit)));
            self.said += usize::from(line.text.starts_with("restarted "));
            self.parameters.look(&line.text, self.up);
            if line.text.starts_with(IMAGE) {
                self.image_s.get_or_insert(self.bench.time_s());
            }
        }
        output.telemetry.mode = self.mode;
        output.telemetry.speed_ref = self.speed;
        Ok((output, passed))
    }

    /// The record of the latest tick since the board started.
    fn snapshot(&self) -> Result<Option<DriveSnapshot>, RunError> {
        let read = |place: u32| -> Result<Option<DriveSnapshot>, RunError> {
            let mut words = [0; SNAPSHOT_WORDS];
            for (at, word) in (0..).zip(&mut words) {
                let address = self.record + 4 * (place * SNAPSHOT_WORDS as u32 + at);
                let read = self.bench.machine().word(address);
                *word = read.map_err(BenchError::from)?;
            }
            Ok(DriveSnapshot::open(&words))
        };
        let snapshot = later(read(0)?, read(1)?);
        // That of before a restart is not of now.
        Ok(snapshot.filter(|snapshot| u64::from(snapshot.tick) <= self.up + AHEAD))
    }

    /// What restarted it first, if it reported every restart.
    fn restart(&self) -> Option<&'static str> {
        let (_, cause) = self.bench.machine().restarts().first()?;
        let told = Run::of_stream(&self.frames).events;
        let told = told.iter().filter(|entry| matches!(entry.event, Event::Restart(_))).count();
        // Power that came up the first time is told as well.
        (self.said > 0 || told > self.restarts).then_some(match cause {
            Cause::Power => "reset by supply",
            Cause::Pin => "reset by pin",
            Cause::Software => "reset by software",
            Cause::Watchdog => "reset by watchdog",
        })
    }
}

/// The same run without the fault.
fn twin(firmware: Firmware<'_>, scenario: &Scenario) -> Result<Twin, RunError> {
    let mut board = Board::new(firmware, scenario)?;
    let mut operator = Operator::default();
    let mut twin = Twin::new(scenario).map_err(|error| RunError::Scenario(error.to_string()))?;
    let mut over_s = 0.0;
    while board.bench.time_s() < LONGEST_S && over_s < AFTER_S {
        let t_s = board.bench.time_s();
        let command = operator.command(board.mode);
        if !operator.started() {
            twin.started_s = t_s;
        }
        let output = board.step(command)?;
        let over = operator.over(board.mode);
        twin.note(t_s, board.mode, &output, over);
        over_s = if over { over_s + 1e-3 } else { 0.0 };
    }
    Ok(twin)
}

/// A run with its fault beside its twin.
fn watched(firmware: Firmware<'_>, scenario: &Scenario, twin: &Twin) -> Result<Instant, RunError> {
    let mut board = Board::new(firmware, scenario)?;
    let mut judge = Judge::new(scenario, board.bench.plant().truth());
    let mut operator = Operator::default();
    let reset = scenario.run.faults.first().is_some_and(Injection::resets_board);
    let mut hold = reset.then(|| keep(&mut board, scenario)).transpose()?;
    let early = scenario.run.faults.is_empty();
    let of_image = scenario.run.faults.iter().any(|fault| fault.target == Target::Image);
    let (mut during, mut after_s) = (None, 0.0);
    let (mut worst_mm, mut back_s) = (0.0f64, None);
    while board.bench.time_s() < LONGEST_S && after_s < AFTER_S {
        let t_s = board.bench.time_s();
        let before = board.mode;
        // Who saves parameters does not press buttons meanwhile.
        let free = board.bench.saving() != Some(Saving::Writing);
        let command = if free { operator.command(before) } else { None };
        let (output, passed) = board.step_with(command)?;
        if let Some(hold) = &mut hold {
            hold.look(&board, &passed, command);
        }
        let struck = early || board.bench.struck_s().is_some();
        if struck && !early && during.is_none() {
            during = Some(doing(before));
        }
        let truth = board.bench.plant().truth();
        judge.look(t_s, &output, truth, struck);
        if board.mode.moves() {
            worst_mm = worst_mm.max(truth.separation_mm);
        }
        if board.restarts > 0 && back_s.is_none() {
            back_s = Some(t_s);
        }
        // A fault that is still to come is waited for only where something goes on.
        let saves = matches!(board.bench.saving(), Some(Saving::Asked | Saving::Writing));
        let over = match (board.image_s, board.light_s) {
            (Some(_), _) => true,
            // It may still say so.
            (None, Some(light_s)) => t_s > light_s + SAYS_S,
            // The whole of it is looked at in some seconds.
            (None, None) if of_image => false,
            (None, None) => !saves && (operator.over(board.mode) || board.parameters.holds()),
        };
        after_s = if over { after_s + 1e-3 } else { 0.0 };
    }
    let (gap_part, crossed) = crossed(board.bench.plant(), twin, worst_mm);
    if scenario.run.faults.first().is_some_and(|fault| fault.target.is_of_sets()) {
        return parameters::judged(board, judge, scenario, twin, (gap_part, crossed));
    }
    let restart = match (board.image_s, board.light_s) {
        (Some(_), _) => Some(IMAGE_DAMAGED),
        (None, Some(_)) => Some(IMAGE_LIGHT),
        (None, None) => board.restart().filter(|_| !of_image),
    };
    let finding = match (judge.finding(&twin.limits, gap_part, crossed), board.restarts) {
        (finding, 0) if !of_image => finding,
        _ if restart.is_some() => Finding::Found,
        _ => Finding::Undetected,
    };
    let report = judge.fault.or_else(|| judge.new_limit(&twin.limits));
    let at_s = board.bench.struck_s();
    let told_s = match report {
        Some((at_s, _)) => Some(at_s),
        None => board.image_s.or(board.light_s).or(back_s).filter(|_| restart.is_some()),
    };
    let since = |from_s: Option<f64>| Some(1e3 * (told_s? - from_s?).max(0.0));
    let (around, unrecorded) = match hold {
        Some(hold) => hold.judged(&mut board, scenario)?,
        None => (Vec::new(), None),
    };
    let finding = if unrecorded.is_some() { Finding::Undetected } else { finding };
    let harms = judge.harms().into_iter().chain(around).chain(unrecorded).collect();
    let injection = scenario.run.faults.first();
    Ok(Instant {
        seed: scenario.run.seed,
        at_s,
        magnitude: injection.map(Injection::magnitude),
        during: during.unwrap_or("at rest"),
        finding,
        code: report.map(|(_, code)| code),
        restart,
        latency_ms: since(board.bench.tells_s()).or(since(board.bench.acts_s()).map(|_| 0.0)),
        rest_ms: judge.fault.and_then(|(at_s, _)| Some(1e3 * (judge.rest_s? - at_s).max(0.0))),
        end: if board.image_s.is_some() { "hold" } else { judge.end() },
        peak_preload_n: judge.peak_preload_n,
        motion_mm: judge.motion_mm,
        gap_part,
        harms,
    })
}

/// Stores the rig's parameters in the board's flash, to be found there after a reset.
fn keep(board: &mut Board<'_>, scenario: &Scenario) -> Result<Hold, RunError> {
    let set = set_of(sets::KEPT, &scenario.rig)?;
    let place = slots::slot_image(&set, 7).ok_or(CompileError::Room)?;
    board.bench.machine_mut().poke(PARAMETER_SETS, &place).map_err(BenchError::from)?;
    Ok(Hold::new(place.to_vec()))
}
