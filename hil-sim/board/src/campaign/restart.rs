//! A reset at a random instant: it must be recorded, the drive must hold until a command, the
//! stored parameters must be unchanged, and the next run must arrive.

use interstage::fault::Fault;
use interstage::restart::{Reset, Restart, Stopped};
use interstage::supervise::{Command, Mode};
use interstage::units::Direction;

use super::{Board, reports};
use crate::chip::map::PARAMETER_SETS;
use crate::error::BoardError;
use crate::peripherals::rcc::Cause;
use hil_sim::faults::judge::coasts_mm;
use hil_sim::plant::rig::Truth;
use hil_sim::scenario::Scenario;
use hil_sim::session::{RunningRig, drive, longest_s};

// Times of chip and firmware, the same on every rig.
/// Longest time from a hang to the cut of the bridges, s. If another task than the tick hangs,
/// the run stays under control until the task has been missed for 50 ms; 80 ms later the system
/// timer finds that the watchdog was not refreshed.
const HUNG_S: f64 = 0.131;
/// Oldest record, ticks before the reset.
const RECORD_TICKS: usize = 3;
/// From the supply's warning, or from the hang, to the reset, ticks.
const FALLS_TICKS: usize = 2;
const WATCHDOG_TICKS: usize = 250;
/// A fault hold takes no reset before it has lasted 100 ms.
const HOLD_S: f64 = 0.15;

// Parts of what the rig has.
/// Most change of the preload in the hold, relative: the rubber relaxes, the gears hold.
const PRELOAD_PART: f64 = 0.25;
/// Largest error of the recorded position, over the tolerance of a step: within it the estimate
/// finds the next one, and the rubber winds up by less than another one and a half.
const RECORD_TOLERANCES: f64 = 2.5;
/// The same of the distance from the end of travel on arrival, where the rubber has unwound.
const ARRIVED_TOLERANCES: f64 = 1.25;

/// The plant and the pins around a reset.
#[derive(Default)]
pub(super) struct Hold {
    /// Bytes of the stored parameters.
    place: Vec<u8>,
    /// Position in each millisecond up to the reset, mm.
    positions_mm: Vec<f64>,
    /// The plant when the fault struck, after the reset, and in the last millisecond before a
    /// command.
    struck: Option<Truth>,
    reset: Option<Truth>,
    last: Option<Truth>,
    /// A bridge was driven without a command.
    driven: bool,
    /// A command has been given since.
    commanded: bool,
}

impl Hold {
    /// Before the first millisecond, with these stored parameters.
    pub(super) fn new(place: Vec<u8>) -> Self {
        Self { place, ..Self::default() }
    }

    /// Looks at a millisecond.
    pub(super) fn look(&mut self, board: &Board<'_>, command: Option<Command>) {
        let truth = board.plant().truth();
        if board.fault_times().struck_s.is_some() {
            self.struck.get_or_insert(*truth);
        }
        if board.restarts == 0 {
            self.positions_mm.push(truth.position_mm);
            return;
        }
        self.commanded |= command.is_some();
        if self.commanded {
            return;
        }
        // The bridges were driven in the millisecond of the reset.
        if self.last.is_some() {
            self.reset.get_or_insert(*truth);
            let drives = &board.drives;
            self.driven |= drives.drive_on && drives.drive != 0.0;
            self.driven |= drives.preload_on && drives.preload != 0.0;
        }
        self.last = Some(*truth);
    }

    /// Bounds that the hold violated.
    fn harms(&self, scenario: &Scenario) -> Vec<String> {
        let (Some(struck), Some(reset), Some(last)) = (self.struck, self.reset, self.last) else {
            return vec!["no hold after the reset".to_owned()];
        };
        let turned_mm = scenario.rig.rig.wheel_radius_mm * (last.rotation_rad - reset.rotation_rad);
        let motion_mm = (last.position_mm - reset.position_mm).abs().min(turned_mm.abs());
        let hung_mm = (reset.position_mm - struck.position_mm).abs();
        let hung_n = (reset.preload_n - struck.preload_n).abs();
        let preload_n = (last.preload_n - reset.preload_n).abs();
        // The wheel coasts when its motor loses power, and so does the screw. An axle that moves on
        // the rubber of a wheel that stands is held.
        let rig = &scenario.rig;
        let (coasts_mm, slew) = (coasts_mm(rig), rig.preload.slew_n_per_s);
        let coasts_n = slew * rig.preload_latency_s();
        let most_mm = HUNG_S * rig.drive.cruise_speed_mm_s + coasts_mm;
        let most_n = HUNG_S * slew + coasts_n;
        let changed_n = coasts_n.max(PRELOAD_PART * reset.preload_n.abs());
        let bounds = [
            (motion_mm <= coasts_mm, format!("moved by {motion_mm:.2} mm after the reset")),
            (hung_mm <= most_mm, format!("ran on for {hung_mm:.2} mm")),
            (hung_n <= most_n, format!("preload went on by {hung_n:.1} N")),
            (preload_n <= changed_n, format!("preload changed by {preload_n:.1} N")),
            (!self.driven, "driven without a command".to_owned()),
        ];
        bounds.into_iter().filter(|(good, _)| !good).map(|(_, harm)| harm).collect()
    }

    /// Defect of the record.
    fn record(&self, cause: Cause, restart: Option<&Restart>, most_mm: f64) -> Option<String> {
        let Some(restart) = restart else { return Some("no record".to_owned()) };
        let fail = |what: &str| Some(format!("record: {what}: {restart}"));
        let (reset, later) = match cause {
            Cause::Power => (Reset::Power, FALLS_TICKS),
            Cause::Watchdog => (Reset::Watchdog, WATCHDOG_TICKS),
            Cause::Pin => (Reset::Pin, 0),
            Cause::Software => (Reset::Software, 0),
        };
        if restart.reset != reset {
            return fail("another reset");
        }
        // A loss of power without a warning erases the record.
        let warned = matches!(restart.crash.map(|crash| crash.stopped), Some(Stopped::Supply));
        let Some(snapshot) = &restart.snapshot else {
            return (cause != Cause::Power).then(|| "record: nothing of the run".to_owned());
        };
        let ticks = self.positions_mm.len();
        let tick = snapshot.tick as usize;
        if tick > ticks + 1 || tick + RECORD_TICKS + later < ticks {
            return fail("of another time");
        }
        let at = self.positions_mm[tick.min(ticks - 1)];
        if (snapshot.position.to_num::<f64>() - at).abs() > most_mm {
            return fail(&format!("not at {at:.2} mm"));
        }
        match (cause, restart.crash.map(|crash| crash.stopped)) {
            (Cause::Watchdog, Some(Stopped::Hang { missed, .. })) if !missed.is_nobody() => None,
            (Cause::Power, _) if warned => None,
            (Cause::Power, None) => fail("nothing of the supply"),
            // A hang in a critical section masks the interrupt that names the task.
            (_, None) => None,
            (_, Some(_)) => fail("a crash that was none"),
        }
    }

    /// Harms around the reset and in the run after it, and the defect of the record.
    pub(super) fn judged(
        self,
        board: &mut Board<'_>,
        scenario: &Scenario,
    ) -> Result<(Vec<String>, Option<String>), BoardError> {
        let Some((_, cause)) = board.bench.machine.restarts().first().copied() else {
            return Ok((Vec::new(), Some("no reset".to_owned())));
        };
        // The first power-up is reported as well.
        let reports = reports(&board.frames);
        let most_mm = RECORD_TOLERANCES * scenario.rig.rig.step_tolerance_mm;
        let unrecorded = self.record(cause, reports.get(1).or(reports.first()), most_mm);
        let mut harms = self.harms(scenario);
        harms.extend(next_run(board, scenario)?);
        let mut stored = vec![0; self.place.len()];
        board.bench.machine.peek(PARAMETER_SETS, &mut stored)?;
        if stored != self.place {
            harms.push("the stored parameters changed".to_owned());
        }
        Ok((harms, unrecorded))
    }
}

/// Runs the drive to an end, to the other one first if it does not know its position; returns
/// the harm.
fn next_run(board: &mut Board<'_>, scenario: &Scenario) -> Result<Option<String>, BoardError> {
    let (rig, longest_s) = (&scenario.rig.rig, longest_s(&scenario.rig));
    let mut direction = Direction::ALL[(scenario.run.seed % 2) as usize];
    for _ in 0..2 {
        let (command, end_mm) = match direction {
            Direction::Deploy => (Command::Start, rig.travel_mm),
            Direction::Retract => (Command::Retract, 0.0),
        };
        let (mut command, mut left) = (Some(command), false);
        let operator = |_| command.take();
        drive(board, longest_s, operator, |board, _, _| {
            left |= !matches!(board.mode, Mode::Idle | Mode::Complete(_));
            board.mode == Mode::Complete(direction) || left && board.mode.is_at_rest()
        })?;
        if board.mode == Mode::Complete(direction) {
            let at_mm = board.plant().truth().position_mm;
            let far = (at_mm - end_mm).abs() > ARRIVED_TOLERANCES * rig.step_tolerance_mm;
            return Ok(far.then(|| format!("says it arrived at {at_mm:.2} mm")));
        }
        let lost = [Fault::PositionUnknown, Fault::PlaceUnconfirmed].map(Mode::FaultHold);
        if !lost.contains(&board.mode) {
            break;
        }
        // As the faults' texts advise: the other direction.
        direction = direction.opposite();
        drive(board, HOLD_S, |_| None, |_, _, _| false)?;
        let mut reset = Some(Command::Reset);
        drive(board, longest_s, |_| reset.take(), |board, _, _| board.mode == Mode::Idle)?;
    }
    let at_mm = board.plant().truth().position_mm;
    Ok(Some(format!("did not arrive after the reset: {:?}, {at_mm:.2} mm", board.mode)))
}
