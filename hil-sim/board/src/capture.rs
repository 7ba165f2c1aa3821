//! The firmware on the emulated board as a source of its binary log.

use crate::bench::Bench;
use crate::log::Strings;
use hil_sim::record::{Source, SourceError};
use hil_sim::scenario::Scenario;
use hil_sim::session::longest_s;

/// Milliseconds that the board runs at each reading.
const STEPS: u32 = 20;
/// Milliseconds that the board runs on after the drive has arrived.
const AFTER: u32 = 100;
/// Modes in which a run without an operator is over.
const OVER: [&str; 3] = ["mode: deployed", "mode: retracted", "mode: fault hold"];

fn broken(error: impl std::error::Error + Send + Sync + 'static) -> SourceError {
    SourceError::Other(Box::new(error))
}

/// The firmware on the emulated board, the plant at its pins.
pub struct Emulated<'a> {
    bench: Bench<'a>,
    attended: bool,
    /// Longest run without an operator, s.
    longest_s: f64,
    /// Milliseconds until the run ends, once that is known.
    left: Option<u32>,
}

impl<'a> Emulated<'a> {
    /// A board with this image and the scenario's parameters. Without an operator (`attended`) the drive starts as soon as
    /// it is idle, and the source ends when the drive has arrived.
    pub fn new(
        elf: &[u8],
        strings: &'a Strings,
        scenario: &Scenario,
        attended: bool,
    ) -> Result<Self, SourceError> {
        let mut bench = Bench::new(elf, strings, scenario).map_err(broken)?;
        crate::run::store(bench.machine_mut(), scenario).map_err(broken)?;
        if !attended {
            bench.start_when_idle();
        }
        Ok(Self { bench, attended, longest_s: longest_s(&scenario.rig), left: None })
    }

    /// Runs the board for a millisecond; false if the run is over.
    fn step(&mut self) -> Result<bool, SourceError> {
        if self.left == Some(0) {
            return Ok(false);
        }
        self.left = self.left.map(|left| left - 1);
        let (_, lines) = self.bench.step().map_err(broken)?;
        for line in &lines {
            if !self.attended && OVER.iter().any(|mode| line.text.contains(mode)) {
                self.left.get_or_insert(AFTER);
            }
        }
        if !self.attended && self.bench.time_s() >= self.longest_s {
            self.left.get_or_insert(1);
        }
        Ok(true)
    }
}

impl Source for Emulated<'_> {
    fn read(&mut self) -> Result<Option<Vec<u8>>, SourceError> {
        for _ in 0..STEPS {
            if !self.step()? {
                let rest = self.bench.take_frames();
                return Ok((!rest.is_empty()).then_some(rest));
            }
        }
        Ok(Some(self.bench.take_frames()))
    }

    fn send(&mut self, letter: u8) -> Result<(), SourceError> {
        self.bench.send(letter).map_err(broken)?;
        Ok(())
    }
}
