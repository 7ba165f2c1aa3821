//! Faults of what a start reads: wrong bits in the stored parameters, interrupted saves, and
//! option bytes that make one bank of the flash.
//!
//! They do not affect the current run, whose constants are in RAM; the next start finds them.
//! So the run is judged as any other, then the board is restarted. It must run on the active
//! set, or, after a save, on the old or the new one, intact to the byte; or hold and report
//! the damage. To run on any other set is a harm, and so is to hold with an intact set. A bit
//! of the image's own set is also one of the image, and is reported as such after the start.

use interstage::params::slots::SLOT_BYTES;

use super::{AFTER_S, Board, IMAGE, IMAGE_DAMAGED, Saving};
use crate::chip::map::PARAMETER_SETS;
use crate::error::BoardError;
use crate::peripherals::rcc::Cause;
use hil_sim::faults::campaign::{Instant, Trial};
use hil_sim::faults::judge::{Finding, Judge};
use hil_sim::faults::sets;
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Onset, Target};
use hil_sim::session::RunningRig;

/// A start that holds, in the matrix.
const HELD: &str = "parameters damaged";
/// The same in the log.
const DAMAGED: &str = "parameters: the set is damaged";
/// A start that holds for its option bytes, in the matrix and in the log.
const ONE_BANK: &str = "flash: one bank";
/// Beginning of the log's line about the rig of a start that runs.
const RUNS: &str = "rig ";

/// The log about parameters since the last start.
#[derive(Clone, Debug, Default)]
pub(super) struct Parameters {
    /// Name of the active set.
    rig: Option<String>,
    /// First line about damage, ms after the start.
    damaged: Option<u64>,
    /// The damage is that of the option bytes.
    one_bank: bool,
}

impl Parameters {
    /// Reads a line of the log, `up` milliseconds after the start.
    pub(super) fn read(&mut self, text: &str, up: u64) {
        self.one_bank |= text.starts_with(ONE_BANK);
        if self.one_bank || text.starts_with(DAMAGED) || text.starts_with(IMAGE) {
            self.damaged.get_or_insert(up);
        }
        if let Some((name, _)) = text.strip_prefix(RUNS).and_then(|rest| rest.split_once(", ")) {
            self.rig = Some(name.to_owned());
        }
    }

    /// Whether the board holds because of them.
    pub(super) const fn holds(&self) -> bool {
        self.damaged.is_some()
    }
}

/// Judges such a fault after its run.
pub(super) fn judged(
    mut board: Board<'_>,
    mut trial: Trial<'_>,
    scenario: &Scenario,
) -> Result<Instant, BoardError> {
    let injection = &scenario.run.faults[0];
    let saving = board.bench.saving();
    let (mut finding, mut end) = (trial.finding(), trial.judge.end());
    let report = trial.report();
    let before = injection.from() == Onset::Time(0.0);
    if saving.is_none() && !before {
        power_cycle(&mut board, &mut trial.judge)?;
    }
    let mut harms = trial.harms();
    harms.extend(harm(&board, scenario, injection)?);
    let held = board.parameters.holds();
    use Target::{ImageSet, OptionBytes, StoredSet};
    let lost = matches!(injection.target, StoredSet | ImageSet | OptionBytes);
    if held && !lost {
        harms.push("holds although its parameters are intact".to_owned());
    }
    if saving.is_some() && before && !trial.crossed {
        harms.push("does not complete after the save".to_owned());
    }
    let why = match (board.image_s, board.parameters.one_bank) {
        (Some(_), _) => IMAGE_DAMAGED,
        (None, true) => ONE_BANK,
        (None, false) => HELD,
    };
    let restart = if held { Some(why) } else { board.restart().filter(|_| saving.is_some()) };
    if held {
        (finding, end) = (Finding::of_restart(Some(injection), restart), "hold");
    } else if lost || saving.is_some() && restart.is_none() {
        finding = Finding::Undetected;
    } else if saving.is_some() && finding == Finding::Tolerated {
        finding = Finding::of_restart(Some(injection), restart);
    }
    Ok(Instant {
        at_s: board.fault_times().struck_s,
        during: "at rest".into(),
        finding,
        code: report.map(|(_, code)| code),
        restart: restart.map(Into::into),
        // From the start that finds the damage.
        latency_ms: board.parameters.damaged.map(|up| up as f64),
        rest_ms: None,
        end: end.into(),
        harms,
        ..trial.found(None)
    })
}

/// Switches power off and on, and watches the board for a while.
fn power_cycle(board: &mut Board<'_>, judge: &mut Judge) -> Result<(), BoardError> {
    board.bench.machine.restart(Cause::Power)?;
    let until_s = board.time_s() + AFTER_S;
    while board.time_s() < until_s {
        let t_s = board.time_s();
        let output = board.step(None)?;
        judge.look(t_s, &output, board.plant().truth(), true);
    }
    Ok(())
}

/// Defect of the set on which the board runs, if it runs.
fn harm(
    board: &Board<'_>,
    scenario: &Scenario,
    injection: &Injection,
) -> Result<Option<String>, BoardError> {
    let Some(name) = board.parameters.rig.as_deref() else {
        let says = board.parameters.holds();
        return Ok((!says).then(|| "says nothing of its parameters".to_owned()));
    };
    // The image's own set keeps its name when a bit is inverted; the finding shows that it runs.
    if injection.target == Target::ImageSet {
        return Ok(None);
    }
    let right = match (injection.target, board.bench.saving()) {
        (Target::ParameterSave, Some(Saving::Stored)) => name == sets::SAVED,
        (Target::ParameterSave, _) => [sets::KEPT, sets::SAVED].contains(&name),
        _ => name == sets::KEPT,
    };
    if !right {
        return Ok(Some(format!("runs on the set `{name}`")));
    }
    let mut flash = vec![0; 2 * SLOT_BYTES];
    board.bench.machine.peek(PARAMETER_SETS, &mut flash)?;
    let set = sets::set(name, &scenario.rig)?;
    let intact = flash.windows(set.len()).any(|bytes| bytes == set);
    Ok((!intact).then(|| format!("runs on the set `{name}`, of which a bit is another")))
}
