//! The emulated board as a place of parameters: its flash outlasts the run.

use std::fs;
use std::path::Path;

use interstage::params::CompileError;
use interstage::params::slots::{SLOT_BYTES, slot_image};
use interstage::rig::Rig;

use crate::bench::Bench;
use crate::chip::map::PARAMETER_SETS;
use crate::error::BoardError;
use crate::log::Strings;
use crate::machine::Machine;
use hil_sim::faults::sets;
use hil_sim::params::{StoreError, set_of};
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Target};

/// Longest start-up, ms.
const START_MS: u32 = 3000;

/// Stores the parameters of a rig that is not the image's own in the board's flash, as `rig
/// params` does. For a fault of stored parameters any rig is stored, with another one in the
/// spare slot.
pub(crate) fn store(machine: &mut Machine, scenario: &Scenario) -> Result<(), BoardError> {
    let of_sets = |fault: &Injection| fault.target.is_of_sets();
    let mut faults = scenario.run.faults.iter().filter(|fault| of_sets(fault));
    if faults.any(|fault| fault.target != Target::ImageSet) {
        machine.poke(PARAMETER_SETS, &sets::places(scenario)?)?;
        return Ok(());
    }
    if scenario.rig == Rig::prototype() {
        return Ok(());
    }
    let set = set_of(&scenario.preset, &scenario.rig)?;
    let place = slot_image(&set, 1).ok_or(CompileError::Room)?;
    machine.poke(PARAMETER_SETS, &place)?;
    Ok(())
}

/// Switches a board with this image on, its flash from a file if that is there, and waits until
/// it is idle.
pub(crate) fn start(elf: &[u8], flash: &Path) -> Result<Bench<'static>, StoreError> {
    let wire = |error: &dyn std::fmt::Display| StoreError::Wire(error.to_string());
    let strings: &'static Strings =
        Box::leak(Box::new(Strings::of(elf).map_err(|error| wire(&error))?));
    let mut bench = Bench::new(elf, strings, &Scenario::default()).map_err(|error| wire(&error))?;
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
        bench.machine.poke(PARAMETER_SETS, &bytes).map_err(|error| wire(&error))?;
    }
    for _ in 0..START_MS {
        let (_, lines) = bench.step().map_err(|error| wire(&error))?;
        // Parameters that the firmware refuses can still be read and changed.
        let up = |text: &str| text.contains("mode: idle") || text.contains("parameters: ");
        if lines.iter().any(|line| up(&line.text)) {
            return Ok(bench);
        }
    }
    Err(StoreError::Silent { seconds: f64::from(START_MS) / 1000.0 })
}

/// Keeps the board's flash in the file for the next time.
pub(crate) fn keep(board: &Bench<'_>, flash: &Path) -> Result<(), StoreError> {
    let mut bytes = vec![0; 2 * SLOT_BYTES];
    board
        .machine
        .peek(PARAMETER_SETS, &mut bytes)
        .map_err(|error| StoreError::Wire(error.to_string()))?;
    fs::write(flash, bytes).map_err(|source| failed(flash, source))
}

fn failed(path: &Path, source: std::io::Error) -> StoreError {
    StoreError::File { path: path.display().to_string(), source }
}
