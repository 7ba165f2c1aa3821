//! The firmware on the emulated board as a source of its binary log.

use crate::bench::Bench;
use crate::log::{Line, Strings};
use hil_sim::record::{Source, SourceError, letter, starter};
use hil_sim::scenario::Scenario;

/// Milliseconds that the board runs at each reading.
const STEPS: u32 = 20;
/// Longest run without an operator, s.
const LONGEST_S: f64 = 120.0;

fn broken(error: impl std::error::Error + Send + Sync + 'static) -> SourceError {
    SourceError::Other(Box::new(error))
}

/// The firmware on the emulated board, the plant at its pins.
pub struct Emulated<'a> {
    bench: Bench<'a>,
    lines: Vec<Line>,
    start: Option<u8>,
    attended: bool,
    idle: bool,
    left: Option<u32>,
}

impl<'a> Emulated<'a> {
    /// A board with this image. Unless it is `attended` by an operator it is started
    /// as soon as it is idle and ends when the drive has arrived.
    ///
    /// # Errors
    /// [`SourceError::Other`] if the image is none.
    pub fn new(
        elf: &[u8],
        strings: &'a Strings,
        scenario: &Scenario,
        attended: bool,
    ) -> Result<Self, SourceError> {
        let bench = Bench::new(elf, strings, scenario).map_err(broken)?;
        let start = letter(starter(scenario.run.direction));
        Ok(Self {
            bench,
            lines: Vec::new(),
            start: (!attended).then_some(start),
            attended,
            idle: false,
            left: None,
        })
    }

    /// The board and what is at its pins, to be tampered with.
    pub fn bench(&mut self) -> &mut Bench<'a> {
        &mut self.bench
    }

    /// Lines of the text log since the last call.
    pub fn take_lines(&mut self) -> Vec<Line> {
        std::mem::take(&mut self.lines)
    }

    fn step(&mut self) -> Result<bool, SourceError> {
        if self.left == Some(0) {
            return Ok(false);
        }
        self.left = self.left.map(|left| left - 1);
        if self.idle
            && let Some(letter) = self.start
            && self.bench.send(letter).map_err(broken)?
        {
            self.start = None;
        }
        let (_, lines) = self.bench.step().map_err(broken)?;
        for line in &lines {
            self.idle |= line.text.contains("mode: idle");
            let over = ["mode: deployed", "mode: retracted", "mode: fault hold"];
            let over = over.iter().any(|mode| line.text.contains(mode));
            if over && !self.attended {
                self.left.get_or_insert(100);
            }
        }
        self.lines.extend(lines);
        if !self.attended && self.bench.time_s() >= LONGEST_S {
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
