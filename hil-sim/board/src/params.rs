//! The emulated board at the end of the host's line, with flash that outlasts the run.

use std::fs;
use std::path::{Path, PathBuf};

use interstage::params::slots::SLOT_BYTES;

use crate::bench::Bench;
use crate::chip::map::PARAMETER_SETS;
use crate::log::Strings;
use hil_sim::params::{StoreError, Wire};
use hil_sim::scenario::Scenario;

/// Longest start-up, ms.
const START_MS: u32 = 3000;

/// A board that has been switched on, its flash from a file if that is there.
pub struct EmulatedBoard {
    bench: Bench<'static>,
    flash: PathBuf,
}

impl EmulatedBoard {
    /// Switches a board with this image on and waits until it is idle.
    pub fn start(elf: &[u8], flash: &Path) -> Result<Self, StoreError> {
        let wire = |error: &dyn std::fmt::Display| StoreError::Wire(error.to_string());
        let strings: &'static Strings =
            Box::leak(Box::new(Strings::of(elf).map_err(|error| wire(&error))?));
        let mut bench =
            Bench::new(elf, strings, &Scenario::default()).map_err(|error| wire(&error))?;
        if flash.exists() {
            let bytes = fs::read(flash).map_err(|source| failed(flash, source))?;
            if bytes.len() != 2 * SLOT_BYTES {
                let path = flash.display();
                let expected = 2 * SLOT_BYTES;
                return Err(StoreError::Wire(format!(
                    "{path}: {} bytes, expected {expected}, the flash that holds parameters",
                    bytes.len()
                )));
            }
            bench.machine_mut().poke(PARAMETER_SETS, &bytes).map_err(|error| wire(&error))?;
        }
        let mut board = Self { bench, flash: flash.to_owned() };
        for _ in 0..START_MS {
            let (_, lines) = board.bench.step().map_err(|error| wire(&error))?;
            // Parameters that the firmware refuses can still be read and changed.
            let up = |text: &str| text.contains("mode: idle") || text.contains("parameters: ");
            if lines.iter().any(|line| up(&line.text)) {
                return Ok(board);
            }
        }
        Err(StoreError::Silent { seconds: f64::from(START_MS) / 1000.0 })
    }

    /// Keeps the flash for the next time.
    pub fn keep(&self) -> Result<(), StoreError> {
        let mut bytes = vec![0; 2 * SLOT_BYTES];
        self.bench
            .machine()
            .peek(PARAMETER_SETS, &mut bytes)
            .map_err(|error| StoreError::Wire(error.to_string()))?;
        fs::write(&self.flash, bytes).map_err(|source| failed(&self.flash, source))
    }
}

fn failed(path: &Path, source: std::io::Error) -> StoreError {
    StoreError::File { path: path.display().to_string(), source }
}

impl Wire for EmulatedBoard {
    fn send(&mut self, bytes: &[u8]) -> Result<usize, String> {
        self.bench.line_send(bytes).map_err(|error| error.to_string())
    }

    fn receive(&mut self, milliseconds: u32) -> Result<Vec<u8>, String> {
        for _ in 0..milliseconds {
            self.bench.step().map_err(|error| error.to_string())?;
        }
        self.bench.line_take().map_err(|error| error.to_string())
    }
}
