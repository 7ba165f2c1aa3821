//! A board under way that is reset, and what it reports then.

use hil_sim::record::Run;
use hil_sim::scenario::Scenario;
use interstage::restart::Restart;
use interstage::tick::Event;
use rig_board::bench::{Bench, Passed};
use rig_board::core::Register;
use rig_board::peripherals::rcc::Cause;

use super::{elf, strings};

/// A board under way.
pub(crate) struct Board {
    pub(crate) bench: Bench<'static>,
    pub(crate) log: Vec<String>,
}

impl Board {
    pub(crate) fn idle() -> Self {
        let bench = Bench::new(elf(), strings(), &Scenario::default()).expect("a bench");
        let mut board = Self { bench, log: Vec::new() };
        board.until("mode: idle", 3000);
        board
    }

    /// Deploying.
    pub(crate) fn moving() -> Self {
        let mut board = Self::idle();
        assert!(board.bench.send(b's').expect("runs"));
        board.until("deploying: cruise", 4000);
        board.step();
        board.bench.take_frames();
        board
    }

    pub(crate) fn step(&mut self) -> Passed {
        let (passed, lines) = self.bench.step().expect("runs");
        self.log.extend(lines.into_iter().map(|line| line.text));
        passed
    }

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

    /// Address of the first function whose name contains this.
    pub(crate) fn function(&self, name: &str) -> u32 {
        let functions = &self.bench.machine().image().functions;
        let found = functions.iter().find(|function| function.name.contains(name));
        found.unwrap_or_else(|| panic!("no function {name}")).range.start
    }

    pub(crate) fn set(&mut self, register: Register, value: u32) {
        self.bench.machine_mut().set_register(register, value).expect("a register");
    }

    /// The reset that comes within so many milliseconds, and after how many; what was
    /// driven meanwhile.
    pub(crate) fn reset(&mut self, milliseconds: u32) -> (Cause, u32, Vec<bool>) {
        let before = self.bench.machine().restarts().len();
        let mut driven = Vec::new();
        for after in 0..milliseconds {
            let drives = self.step().drives;
            driven.push(drives.drive_on && drives.drive != 0.0);
            if let Some((_, cause)) = self.bench.machine().restarts().get(before) {
                return (*cause, after, driven);
            }
        }
        panic!("no reset in {milliseconds} ms: {:#?}", self.log);
    }

    /// What the start reports; nothing moves until it is idle, and then.
    pub(crate) fn report(&mut self) -> Restart {
        let mut lines = self.log.len();
        for _ in 0..3000 {
            let drives = self.step().drives;
            assert!(!drives.drive_on && !drives.preload_on, "moves before a command");
            if self.log[lines..].iter().any(|line| line.contains("mode: idle")) {
                break;
            }
            lines = self.log.len();
        }
        let stream = self.bench.take_frames();
        let mut reports =
            Run::of_stream(&stream).events.into_iter().filter_map(|entry| match entry.event {
                Event::Restart(restart) => Some(restart),
                _ => None,
            });
        reports.next_back().expect("a report")
    }
}
