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
use hil_sim::plant::rig::Truth;
use hil_sim::scenario::Scenario;
use hil_sim::session::RunningRig;

/// Most motion from the reset to the command, mm: the wheel coasts when its motor loses power. An axle
/// that moves on the rubber of a wheel that stands is held.
const MOTION_MM: f64 = 0.5;
/// Longest time from a hang to the cut of the bridges, s. If another task than the tick hangs,
/// the run stays under control until the task has been missed for 50 ms; 80 ms later the system
/// timer finds that the watchdog was not refreshed.
const HUNG_S: f64 = 0.131;
/// Most change of the preload in the hold, relative: the rubber relaxes, the gears hold.
const PRELOAD_PART: f64 = 0.25;
/// The same, absolute, N.
const PRELOAD_N: f64 = 3.0;
/// Largest error of the recorded position, mm: that of the estimate, and a tick's travel.
const RECORD_MM: f64 = 2.0;
/// Oldest record, ticks before the reset.
const RECORD_TICKS: usize = 3;
/// From the supply's warning, or from the hang, to the reset, ticks.
const FALLS_TICKS: usize = 2;
const WATCHDOG_TICKS: usize = 250;
/// Largest distance from the end of travel on arrival, mm.
const ARRIVED_MM: f64 = 1.0;
/// Longest run to either end, ms.
const RUN_MS: u32 = 60_000;
/// A fault hold takes no reset before it has lasted 100 ms.
const HOLD_MS: u32 = 150;

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
        let most_mm = HUNG_S * scenario.rig.drive.cruise_speed_mm_s + MOTION_MM;
        let most_n = HUNG_S * scenario.rig.preload.slew_n_per_s + PRELOAD_N;
        let changed_n = PRELOAD_N.max(PRELOAD_PART * reset.preload_n.abs());
        let bounds = [
            (motion_mm <= MOTION_MM, format!("moved by {motion_mm:.2} mm after the reset")),
            (hung_mm <= most_mm, format!("ran on for {hung_mm:.2} mm")),
            (hung_n <= most_n, format!("preload went on by {hung_n:.1} N")),
            (preload_n <= changed_n, format!("preload changed by {preload_n:.1} N")),
            (!self.driven, "driven without a command".to_owned()),
        ];
        bounds.into_iter().filter(|(good, _)| !good).map(|(_, harm)| harm).collect()
    }

    /// Defect of the record.
    fn record(&self, cause: Cause, restart: Option<&Restart>) -> Option<String> {
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
        if (snapshot.position.to_num::<f64>() - at).abs() > RECORD_MM {
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
        let unrecorded = self.record(cause, reports.get(1).or(reports.first()));
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
    let mut direction = Direction::ALL[(scenario.run.seed % 2) as usize];
    for _ in 0..2 {
        let command = match direction {
            Direction::Deploy => Command::Start,
            Direction::Retract => Command::Retract,
        };
        board.step(Some(command))?;
        let mut left = false;
        for _ in 0..RUN_MS {
            board.step(None)?;
            left |= !matches!(board.mode, Mode::Idle | Mode::Complete(_));
            let arrived = board.mode == Mode::Complete(direction);
            if arrived || left && board.mode.is_at_rest() {
                break;
            }
        }
        if board.mode == Mode::Complete(direction) {
            let end_mm = match direction {
                Direction::Deploy => scenario.rig.rig.travel_mm,
                Direction::Retract => 0.0,
            };
            let at_mm = board.plant().truth().position_mm;
            let far = (at_mm - end_mm).abs() > ARRIVED_MM;
            return Ok(far.then(|| format!("says it arrived at {at_mm:.2} mm")));
        }
        let lost = [Fault::PositionUnknown, Fault::PlaceUnconfirmed].map(Mode::FaultHold);
        if !lost.contains(&board.mode) {
            break;
        }
        // As the faults' texts advise: the other direction.
        direction = direction.opposite();
        for _ in 0..HOLD_MS {
            board.step(None)?;
        }
        board.step(Some(Command::Reset))?;
        for _ in 0..RUN_MS {
            if board.mode == Mode::Idle {
                break;
            }
            board.step(None)?;
        }
    }
    let at_mm = board.plant().truth().position_mm;
    Ok(Some(format!("did not arrive after the reset: {:?}, {at_mm:.2} mm", board.mode)))
}
