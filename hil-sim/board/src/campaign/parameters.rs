//! Faults of the stored parameters: bits turned over in flash, and saves that are broken off.
//!
//! They do nothing to the run under way, whose constants stand in RAM; the next start finds
//! them. So the run is judged as any other, then the board is started anew, and judged is
//! what it says then: it has to run on the set in force, or, after a save, on the old one or
//! the new one, whole to the byte; or hold and name the damage. A set that nobody put in
//! force is a harm, and so is a drive that holds although its set is whole. A bit of the
//! image's own set is one of the image too, and is told as such after its first start.

use interstage::params::slots::SLOT_BYTES;

use super::{AFTER_S, Board, IMAGE, IMAGE_DAMAGED, Saving, Twin};
use crate::bench::BenchError;
use crate::chip::map::PARAMETER_SETS;
use crate::peripherals::rcc::Cause;
use crate::run::RunError;
use hil_sim::faults::campaign::Instant;
use hil_sim::faults::judge::{Finding, Judge};
use hil_sim::faults::sets;
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Onset, Target};

/// How a start that holds reports it, in the matrix.
const HELD: &str = "parameters damaged";
/// What it says in the log.
const DAMAGED: &str = "parameters: the set is damaged";
/// What every start says that runs.
const RUNS: &str = "rig ";

/// What a board said of its parameters since it last started.
#[derive(Clone, Debug, Default)]
pub(super) struct Parameters {
    /// Name of the set that it runs on.
    rig: Option<String>,
    /// When it first said that they are damaged, ms.
    damaged: Option<u64>,
}

impl Parameters {
    /// Looks at a line that comes so many milliseconds after the start.
    pub(super) fn look(&mut self, text: &str, up: u64) {
        if text.starts_with(DAMAGED) || text.starts_with(IMAGE) {
            self.damaged.get_or_insert(up);
        }
        if let Some((name, _)) = text.strip_prefix(RUNS).and_then(|rest| rest.split_once(", ")) {
            self.rig = Some(name.to_owned());
        }
    }

    /// Whether it holds because of them.
    pub(super) const fn holds(&self) -> bool {
        self.damaged.is_some()
    }
}

/// What became of such a fault after its run.
pub(super) fn judged(
    mut board: Board<'_>,
    mut judge: Judge,
    scenario: &Scenario,
    twin: &Twin,
    (gap_part, crossed): (f64, bool),
) -> Result<Instant, RunError> {
    let injection = &scenario.run.faults[0];
    let saving = board.bench.saving();
    let (mut finding, mut end) = (judge.finding(&twin.limits, gap_part, crossed), judge.end());
    let report = judge.fault.or_else(|| judge.new_limit(&twin.limits));
    let before = injection.from() == Onset::Time(0.0);
    if saving.is_none() && !before {
        restart(&mut board, &mut judge)?;
    }
    let mut harms = judge.harms();
    harms.extend(harm(&board, scenario, injection)?);
    let held = board.parameters.holds();
    let lost = matches!(injection.target, Target::StoredSet | Target::ImageSet);
    if held && !lost {
        harms.push("holds although its parameters are whole".to_owned());
    }
    if saving.is_some() && before && !crossed {
        harms.push("does not complete after the save".to_owned());
    }
    let why = if board.image_s.is_some() { IMAGE_DAMAGED } else { HELD };
    let told = if held { Some(why) } else { board.restart().filter(|_| saving.is_some()) };
    if held {
        (finding, end) = (Finding::Found, "hold");
    } else if lost || saving.is_some() && told.is_none() {
        finding = Finding::Undetected;
    } else if saving.is_some() && finding == Finding::Tolerated {
        finding = Finding::Found;
    }
    Ok(Instant {
        seed: scenario.run.seed,
        at_s: board.bench.struck_s(),
        magnitude: Some(injection.magnitude()),
        during: "at rest",
        finding,
        code: report.map(|(_, code)| code),
        restart: told,
        // From the start that meets it.
        latency_ms: board.parameters.damaged.map(|up| up as f64),
        rest_ms: None,
        end,
        peak_preload_n: judge.peak_preload_n,
        motion_mm: judge.motion_mm,
        gap_part,
        harms,
    })
}

/// Power goes and comes back, and the board is watched for a while.
fn restart(board: &mut Board<'_>, judge: &mut Judge) -> Result<(), RunError> {
    board.bench.machine_mut().restart(Cause::Power).map_err(BenchError::from)?;
    let until_s = board.bench.time_s() + AFTER_S;
    while board.bench.time_s() < until_s {
        let t_s = board.bench.time_s();
        let output = board.step(None)?;
        judge.look(t_s, &output, board.bench.plant().truth(), true);
    }
    Ok(())
}

/// What is wrong with the set that the board runs on, if it runs.
fn harm(
    board: &Board<'_>,
    scenario: &Scenario,
    injection: &Injection,
) -> Result<Option<String>, RunError> {
    let Some(name) = board.parameters.rig.as_deref() else {
        let says = board.parameters.holds();
        return Ok((!says).then(|| "says nothing of its parameters".to_owned()));
    };
    // The image's own has the same name whether a bit of it is turned over or not; that it
    // runs at all is told by the judgement.
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
    board.bench.machine().peek(PARAMETER_SETS, &mut flash).map_err(BenchError::from)?;
    let set = sets::set(name, &scenario.rig)?;
    let whole = flash.windows(set.len()).any(|bytes| bytes == set);
    Ok((!whole).then(|| format!("runs on the set `{name}`, of which a bit is another")))
}
