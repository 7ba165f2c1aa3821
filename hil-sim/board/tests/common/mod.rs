//! The firmware for the emulated board, built once, and a running board.

pub(crate) mod cli;

use std::sync::OnceLock;
use std::time::Duration;

use hil_sim::faults::campaign::{Case, FaultCampaign, Outcome, Twin};
use hil_sim::firmware::{self, Profile};
use hil_sim::probe::{Port, PortError};
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Kind, Target};
use interstage::restart::Restart;
use rig_board::bench::{Bench, Passed};
use rig_board::campaign::{self, Firmware};
use rig_board::core::Register;
use rig_board::elf::FLASH;
use rig_board::faults::switch;
use rig_board::log::Strings;
use rig_board::machine::Machine;
use rig_board::peripherals::rcc::Cause;
use rig_board::run::{self, Ran, RunOptions};

/// The image as it would be flashed.
pub(crate) fn elf() -> &'static [u8] {
    static ELF: OnceLock<Vec<u8>> = OnceLock::new();
    ELF.get_or_init(|| firmware::image(Profile::Release).expect("the firmware builds"))
}

/// The strings of its log.
pub(crate) fn strings() -> &'static Strings {
    static STRINGS: OnceLock<Strings> = OnceLock::new();
    STRINGS.get_or_init(|| Strings::of(elf()).expect("it logs"))
}

/// The prototype with these parameters.
pub(crate) fn scenario(sets: &[&str]) -> Scenario {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    Scenario::resolve(Some("prototype"), None, &sets).expect("a scenario")
}

/// A run of a scenario, with its rows if wanted.
pub(crate) fn ran(scenario: &Scenario, rows: bool) -> Ran {
    let options = RunOptions { rows, ..RunOptions::default() };
    run::run(elf(), scenario, &options, |_, _| {}).expect("a run")
}

/// Tries these faults on the board, so many instants each: none is undetected or harmful.
pub(crate) fn tried(cases: Vec<Case>, instants: usize) -> Outcome {
    let firmware = Firmware { elf: elf(), strings: strings() };
    let campaign = FaultCampaign { scenario: Scenario::default(), instants, cases };
    let twin = |scenario: &Scenario| campaign::twin(firmware, scenario);
    let watched = |scenario: &Scenario, twin: &Twin| campaign::watched(firmware, scenario, twin);
    let outcome = campaign.on("board", twin, watched).complete(&|| {}).expect("a campaign");
    let failures: Vec<_> = outcome.matrix.iter().flat_map(|line| &line.failures).collect();
    assert_eq!((outcome.undetected, outcome.unheld), (0, 0), "{failures:#?}");
    outcome
}

/// A fault without magnitude.
pub(crate) const fn fault(target: Target, kind: Kind) -> Injection {
    Injection::at(target, kind, 0.0, 0.0)
}

/// A port at a probe on USB, where accesses take time and what is sent goes in pieces.
pub(crate) struct OnUsb<P> {
    pub(crate) port: P,
    accesses: u32,
    /// Time that they took and that has not passed at the port, ns; less than nothing if its last
    /// pause was longer.
    owed_ns: i64,
}

impl<P: Port> OnUsb<P> {
    pub(crate) const fn new(port: P) -> Self {
        Self { port, accesses: 0, owed_ns: 0 }
    }

    /// Lets the time of so many accesses pass: half a millisecond each, and an eighth of a second
    /// now and then.
    fn access(&mut self, accesses: u32) -> Result<(), PortError> {
        for _ in 0..accesses {
            self.accesses += 1;
            self.owed_ns += if self.accesses.is_multiple_of(400) { 125_000_000 } else { 500_000 };
        }
        while self.owed_ns > 0 {
            let before = self.port.now();
            self.port.pass()?;
            self.owed_ns -= (self.port.now() - before).as_nanos() as i64;
        }
        Ok(())
    }
}

impl<P: Port> Port for OnUsb<P> {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        // The offsets; then data and read offset.
        self.access(1)?;
        let bytes = self.port.up(channel)?;
        self.access(if bytes.is_empty() { 0 } else { 2 })?;
        Ok(bytes)
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        self.access(4)?;
        self.port.down(channel, &bytes[..bytes.len().min(5)])
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.port.reset()
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        self.access(1)?;
        self.port.memory(address, into)
    }

    fn pass(&mut self) -> Result<(), PortError> {
        self.port.pass()
    }

    fn now(&self) -> Duration {
        self.port.now()
    }
}

/// A running board with its two logs.
pub(crate) struct Board {
    pub(crate) bench: Bench<'static>,
    /// Lines of the text log.
    pub(crate) log: Vec<String>,
    /// Bytes of the binary log.
    pub(crate) frames: Vec<u8>,
}

impl Board {
    /// Before power-up, with these parameters of the scenario.
    pub(crate) fn off(sets: &[&str]) -> Self {
        let bench = Bench::new(elf(), strings(), &scenario(sets)).expect("a bench");
        Self { bench, log: Vec::new(), frames: Vec::new() }
    }

    /// Powered up and idle.
    pub(crate) fn idle() -> Self {
        let mut board = Self::off(&[]);
        board.until("mode: idle", 3000);
        board
    }

    pub(crate) fn moving() -> Self {
        let mut board = Self::idle();
        board.send(b's');
        board.until("deploying: cruise", 4000);
        board.step();
        board.frames.clear();
        board
    }

    pub(crate) fn step(&mut self) -> Passed {
        let (passed, lines) = self.bench.step().expect("runs");
        self.log.extend(lines.into_iter().map(|line| line.text));
        self.frames.extend(self.bench.take_frames());
        passed
    }

    pub(crate) fn run(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.step();
        }
    }

    /// Runs until the log has this text.
    pub(crate) fn until(&mut self, text: &str, milliseconds: u32) {
        let from = self.log.len();
        for _ in 0..milliseconds {
            self.step();
            if self.log[from..].iter().any(|line| line.contains(text)) {
                return;
            }
        }
        panic!("no `{text}` in {milliseconds} ms: {:#?}", &self.log[from..]);
    }

    pub(crate) fn said(&self, text: &str) -> bool {
        self.log.iter().any(|line| line.contains(text))
    }

    pub(crate) fn send(&mut self, letter: u8) {
        assert!(self.bench.send(letter).expect("runs"), "the console listens");
    }

    /// Asserts that no bridge is enabled for so long.
    pub(crate) fn assert_off(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            let drives = self.step().drives;
            assert!(!drives.drive_on && !drives.preload_on);
        }
    }

    /// Opens or closes the contact of the emergency stop.
    pub(crate) fn open_stop(&mut self, open: bool) {
        let now = self.machine().now();
        self.machine().chip_mut().press_stop(open, now);
    }

    pub(crate) fn position_mm(&self) -> f64 {
        self.bench.plant.truth().position_mm
    }

    pub(crate) fn machine(&mut self) -> &mut Machine {
        &mut self.bench.machine
    }

    pub(crate) fn strike(&mut self, fault: Injection) {
        switch(self.machine(), &fault, true).expect("strikes");
    }

    /// Inverts this bit of a byte of the image.
    pub(crate) fn flip(&mut self, address: u32, bit: u32) {
        let bit = f64::from(8 * (address - FLASH.base) + bit);
        self.strike(Injection::at(Target::Image, Kind::BitErrors, 0.0, bit));
    }

    /// Address of the first function whose name contains this.
    pub(crate) fn function(&self, name: &str) -> u32 {
        let functions = &self.bench.machine.image.functions;
        let found = functions.iter().find(|function| function.name.contains(name));
        found.unwrap_or_else(|| panic!("no function {name}")).range.start
    }

    pub(crate) fn set(&mut self, register: Register, value: u32) {
        self.machine().set_register(register, value).expect("a register");
    }

    /// Asserts that this resets the board within so many milliseconds, and that the drive is off
    /// from the millisecond `cut` on; after how many the reset came.
    pub(crate) fn ends(&mut self, cause: Cause, milliseconds: u32, cut: usize) -> u32 {
        let (found, after, driven) = self.reset(milliseconds);
        assert_eq!(found, cause, "{:#?}", self.log);
        assert!(!driven.iter().skip(cut).any(|driven| *driven), "{driven:?}");
        after
    }

    /// Cause and time, ms, of the reset within so many milliseconds, and when the drive was on
    /// before it.
    pub(crate) fn reset(&mut self, milliseconds: u32) -> (Cause, u32, Vec<bool>) {
        let before = self.bench.machine.restarts().len();
        let mut driven = Vec::new();
        for after in 0..milliseconds {
            let drives = self.step().drives;
            driven.push(drives.drive_on && drives.drive != 0.0);
            if let Some((_, cause)) = self.bench.machine.restarts().get(before) {
                return (*cause, after, driven);
            }
        }
        panic!("no reset in {milliseconds} ms: {:#?}", self.log);
    }

    /// The report of a start, during which nothing moves.
    pub(crate) fn report(&mut self) -> Restart {
        let lines = self.log.len();
        for _ in 0..3000 {
            self.assert_off(1);
            if self.log[lines..].iter().any(|line| line.contains("mode: idle")) {
                break;
            }
        }
        let reports = campaign::reports(&std::mem::take(&mut self.frames));
        *reports.last().expect("a report")
    }
}

/// The probe at a board whose log is kept.
impl Port for &mut Board {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        self.bench.up(channel)
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        self.bench.down(channel, bytes)
    }

    fn reset(&mut self) -> Result<(), PortError> {
        Port::reset(&mut self.bench)
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        self.bench.memory(address, into)
    }

    fn pass(&mut self) -> Result<(), PortError> {
        self.step();
        Ok(())
    }

    fn now(&self) -> Duration {
        self.bench.now()
    }
}
