//! One reset: the run up to it, the hold behind it, the command and what came of it.

use interstage::restart::{Reset, Restart, Stopped};
use interstage::tick::Event;
use serde::Serialize;

use super::ResetError;
use super::aim::Aim;
use crate::bench::{Bench, Passed, STEP};
use crate::faults::Fault;
use crate::log::{Line, Strings};
use crate::params::PLACES;
use crate::peripherals::rcc::Cause;
use hil_sim::log::Run;
use hil_sim::scenario::{Direction, Scenario};

/// Longest start-up, ms: longer than the waiting for every sensor and the self-test.
const START_MS: u32 = 6000;
/// Longest time from being caught to the watchdog's reset, ms.
const BITE_MS: u32 = 250;
/// Longest time from the supply's warning to its reset, ms.
const FALLS_MS: u32 = 2;
/// How long the idle drive is watched before the command, ms.
const WATCHED_MS: u32 = 200;
/// Longest way to either end, ms.
const RUN_MS: u32 = 60_000;
/// Most motion from the reset to the command, mm: what the wheel runs on when its motor
/// loses its power.
const MOTION_MM: f64 = 0.5;
/// Longest time from being caught to the cut of the bridges, s: as long as the tick is not
/// what hangs, the run goes on under control until a task has been missed for 50 ms, and 80 ms
/// more until the system timer finds the watchdog unfed.
const HUNG_S: f64 = 0.131;
/// Most change of the preload meanwhile, of what it was: the rubber relaxes, the gears hold.
const PRELOAD_PART: f64 = 0.25;
/// And whatever it was, N.
const PRELOAD_N: f64 = 3.0;
/// Most difference of the position of the record from the true one, mm: the estimate's
/// error over a run, and a tick.
const RECORD_MM: f64 = 2.0;
/// How old the record may be, ms.
const RECORD_MS: f64 = 3.0;
/// Off the end of travel at most, mm.
const ARRIVED_MM: f64 = 1.0;

/// What resets the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The supply falls too low: memory is lost, a millisecond after the warning.
    BrownOut,
    /// What runs is caught in a loop, and the watchdog ends it.
    Watchdog,
    /// The reset pin.
    Pin,
    /// A debugger, or the program itself.
    Software,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Self; 4] = [Self::BrownOut, Self::Watchdog, Self::Pin, Self::Software];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::BrownOut => "brown-out",
            Self::Watchdog => "watchdog",
            Self::Pin => "pin",
            Self::Software => "software",
        }
    }

    /// What the board has to report.
    const fn reset(self) -> Reset {
        match self {
            Self::BrownOut => Reset::Power,
            Self::Watchdog => Reset::Watchdog,
            Self::Pin => Reset::Pin,
            Self::Software => Reset::Software,
        }
    }
}

/// A reset to be made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Number in the campaign.
    pub index: u64,
    /// Seed of plant and noise.
    pub seed: u64,
    /// The run that is broken off.
    pub way: Direction,
    /// What breaks it off.
    pub kind: Kind,
    /// The mode that it is aimed at, if it is.
    pub aim: Option<Aim>,
    /// Time from the command, s; of an aimed one it tells the place in the mode.
    pub after_s: f64,
    /// Part of a millisecond on top.
    pub part: f64,
    /// What is commanded afterwards.
    pub then: Direction,
}

/// What came of one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct After {
    /// The case.
    #[serde(flatten)]
    pub case: Case,
    /// Mode when it came, by the board's log.
    pub mode: String,
    /// Where the wheel was, mm.
    pub position_mm: f64,
    /// The record said why the board restarted and what the drive was doing.
    pub record: bool,
    /// The stored parameters are as they were, to the byte.
    pub parameters: bool,
    /// Nothing was driven, the wheel stood and the preload stayed.
    pub held: bool,
    /// Who hung, by the record; empty if nobody did, or with interrupts masked.
    pub late: String,
    /// Motion from being caught to the reset, mm.
    pub hung_mm: f64,
    /// Motion from the reset to the command, mm.
    pub motion_mm: f64,
    /// Change of preload meanwhile, N.
    pub preload_n: f64,
    /// Arrived where it was sent.
    pub completed: bool,
    /// It said that it had to go the other way first, and arrived there when told to.
    pub other_way: bool,
    /// What was found wrong.
    pub wrong: Vec<String>,
}

/// A board in the middle of a case.
struct Under<'a> {
    bench: Bench<'a>,
    /// What it said last of its mode.
    mode: String,
    /// Code of the last fault that it reported.
    fault: Option<u16>,
    /// Something was driven.
    driven: bool,
    /// Who sees the log.
    show: &'a dyn Fn(f64, &Line),
}

impl Under<'_> {
    /// A millisecond.
    fn step(&mut self) -> Result<(), ResetError> {
        let (passed, lines) = self.bench.step()?;
        self.look(&passed, &lines);
        Ok(())
    }

    fn look(&mut self, passed: &Passed, lines: &[Line]) {
        let drives = &passed.drives;
        self.driven |= drives.drive_on && drives.drive != 0.0;
        self.driven |= drives.preload_on && drives.preload != 0.0;
        for line in lines {
            (self.show)(self.bench.time_s(), line);
            if let Some(mode) = line.behind("mode: ") {
                mode.clone_into(&mut self.mode);
            }
            if let Some((code, _)) = line.behind("] fault ").and_then(|f| f.split_once(": ")) {
                self.fault = code.parse().ok();
            }
        }
    }

    /// Goes on until the mode begins so; whether it did in time.
    fn until(&mut self, modes: &[&str], milliseconds: u32) -> Result<bool, ResetError> {
        for _ in 0..milliseconds {
            if modes.iter().any(|mode| self.mode.starts_with(mode)) {
                return Ok(true);
            }
            self.step()?;
        }
        Ok(false)
    }

    /// Goes on for so many milliseconds.
    fn pass(&mut self, milliseconds: u32) -> Result<(), ResetError> {
        (0..milliseconds).try_for_each(|_| self.step())
    }

    /// Goes on until the mode contains this, or the drive rests.
    fn until_within(&mut self, part: &str, milliseconds: u32) -> Result<(), ResetError> {
        for _ in 0..milliseconds {
            if self.mode.contains(part) || self.rests() {
                break;
            }
            self.step()?;
        }
        Ok(())
    }

    /// Goes on as long as the mode contains this.
    fn while_within(&mut self, part: &str, milliseconds: u32) -> Result<(), ResetError> {
        for _ in 0..milliseconds {
            if !self.mode.contains(part) {
                break;
            }
            self.step()?;
        }
        Ok(())
    }

    /// Goes on until the board is reset, and adds where the wheel is in each millisecond;
    /// whether it was in time.
    fn until_reset(&mut self, milliseconds: u32, way: &mut Vec<f64>) -> Result<bool, ResetError> {
        for _ in 0..milliseconds {
            self.step()?;
            way.push(self.bench.plant().truth().position_mm);
            if !self.bench.machine().restarts().is_empty() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Arrived or held.
    fn rests(&self) -> bool {
        ["deployed", "retracted", "fault hold"].contains(&self.mode.as_str())
    }

    fn send(&mut self, way: Direction) -> Result<bool, ResetError> {
        let letter = match way {
            Direction::Deploy => b's',
            Direction::Retract => b'r',
        };
        self.mode.clear();
        Ok(self.bench.send(letter)?)
    }
}

/// What the log says on arrival.
const fn arrived(way: Direction) -> &'static str {
    match way {
        Direction::Deploy => "deployed",
        Direction::Retract => "retracted",
    }
}

const fn other(way: Direction) -> Direction {
    match way {
        Direction::Deploy => Direction::Retract,
        Direction::Retract => Direction::Deploy,
    }
}

/// Code of [`interstage::fault::Fault::PositionUnknown`].
const POSITION_UNKNOWN: u16 = interstage::fault::Fault::PositionUnknown.code();

impl Case {
    /// Makes it; `place` is what the flash holds of parameters, `watch` sees the log.
    ///
    /// # Errors
    /// [`ResetError`] if the engine or the plant fails.
    pub fn make(
        &self,
        elf: &[u8],
        strings: &Strings,
        scenario: &Scenario,
        place: &[u8],
        watch: &(dyn Fn(u64, f64, &Line) + Sync),
    ) -> Result<After, ResetError> {
        let mut scenario = scenario.clone();
        scenario.run.seed = self.seed;
        // The way back begins where the way out has ended.
        scenario.run.direction = Direction::Deploy;
        let mut bench =
            Bench::new(elf, strings, &scenario).map_err(crate::bench::BenchError::from)?;
        bench.machine_mut().poke(PLACES, place).map_err(crate::bench::BenchError::from)?;
        let show = |t_s: f64, line: &Line| watch(self.index, t_s, line);
        let mut board =
            Under { bench, mode: String::new(), fault: None, driven: false, show: &show };
        let mut wrong = Vec::new();
        self.lead_up(&mut board, &mut wrong)?;
        let mode = board.mode.clone();
        let before = *board.bench.plant().truth();
        let position_mm = before.position_mm;
        board.bench.take_frames();
        let way = self.strike(&mut board, &mut wrong)?;
        let struck_ms = board.bench.time_s() * 1e3;

        // The hold, up to the command; in the millisecond of the reset there was drive.
        board.step()?;
        let reset = *board.bench.plant().truth();
        let reset_mm = reset.position_mm;
        let hung_mm = (reset_mm - position_mm).abs();
        let hung_n = (reset.preload_n - before.preload_n).abs();
        board.driven = false;
        board.mode.clear();
        if !board.until(&["idle", "fault hold"], START_MS)? || board.mode != "idle" {
            wrong.push(format!("not idle after the reset but {:?}", board.mode));
        }
        for _ in 0..WATCHED_MS {
            board.step()?;
        }
        let truth = *board.bench.plant().truth();
        let motion_mm = (truth.position_mm - reset_mm).abs();
        let preload_n = (truth.preload_n - reset.preload_n).abs();
        let mut held = true;
        let mut holds = |good: bool, why: &dyn Fn() -> String| {
            if !good {
                held = false;
                wrong.push(why());
            }
        };
        holds(!board.driven, &|| "driven without a command".to_owned());
        holds(motion_mm <= MOTION_MM, &|| format!("moved by {motion_mm:.2} mm"));
        let most_mm = HUNG_S * scenario.rig.drive.cruise_speed_mm_s + MOTION_MM;
        holds(hung_mm <= most_mm, &|| format!("ran on for {hung_mm:.2} mm"));
        let most_n = HUNG_S * scenario.rig.preload.slew_n_per_s + PRELOAD_N;
        holds(hung_n <= most_n, &|| format!("preload went on by {hung_n:.1} N"));
        let allowed = PRELOAD_N.max(PRELOAD_PART * reset.preload_n.abs());
        holds(preload_n <= allowed, &|| {
            format!("preload {:.1} N at the reset, {:.1} N after", reset.preload_n, truth.preload_n)
        });

        let stream = board.bench.take_frames();
        let restart =
            Run::of_stream(&stream).events.into_iter().find_map(|entry| match entry.event {
                Event::Restart(restart) => Some(restart),
                _ => None,
            });
        let unrecorded = self.misses(restart.as_ref(), &way, struck_ms);
        let record = unrecorded.is_none();
        let late = match restart.and_then(|restart| restart.crash).map(|crash| crash.stopped) {
            Some(Stopped::Hang { missed, .. }) => missed.name().to_owned(),
            _ => String::new(),
        };
        wrong.extend(unrecorded);

        let (completed, other_way) = self.go_on(&mut board, &scenario, &mut wrong)?;

        let mut stored = vec![0; place.len()];
        board.bench.machine().peek(PLACES, &mut stored).map_err(crate::bench::BenchError::from)?;
        let parameters = stored == place;
        if !parameters {
            wrong.push("the stored parameters changed".to_owned());
        }
        Ok(After {
            case: *self,
            mode,
            position_mm,
            record,
            parameters,
            held,
            late,
            hung_mm,
            motion_mm,
            preload_n,
            completed,
            other_way,
            wrong,
        })
    }

    /// The run up to the reset.
    fn lead_up(&self, board: &mut Under<'_>, wrong: &mut Vec<String>) -> Result<(), ResetError> {
        let part = self.after_s / super::WITHIN_S;
        if let Some(aim) = self.aim.filter(|aim| aim.comes_before_the_command()) {
            board.until(&[aim.name()], START_MS)?;
            // The shortest of them takes a tenth of a second.
            return board.pass((part * 95.0) as u32);
        }
        let mut missed = !board.until(&["idle"], START_MS)?;
        if self.way == Direction::Retract {
            missed |= !board.send(Direction::Deploy)?;
            missed |= !board.until(&["deployed"], RUN_MS)?;
        }
        missed |= !board.send(self.way)?;
        if missed {
            wrong.push(format!("not set going but {:?}", board.mode));
        }
        let Some(aim) = self.aim else { return board.pass((self.after_s * 1e3) as u32) };
        // Legs come once a step: of which, the part says.
        let (step, part) = ((part * 3.0) as u32, (part * 3.0).fract());
        match aim {
            Aim::Cruise | Aim::Approach | Aim::Crossing | Aim::Settle => {
                for _ in 0..step {
                    board.until_within(aim.name(), RUN_MS)?;
                    board.while_within(aim.name(), RUN_MS)?;
                }
                board.until_within(aim.name(), RUN_MS)?;
                board.pass((part * 60.0) as u32)
            }
            Aim::Complete => {
                board.until(&[arrived(self.way)], RUN_MS)?;
                board.pass((part * 500.0) as u32)
            }
            Aim::Stopping | Aim::FaultHold => {
                board.until_within("ing: ", RUN_MS)?;
                board.pass((f64::from(step) * 600.0) as u32 + 100)?;
                if aim == Aim::Stopping {
                    board.bench.send(b'x')?;
                    board.until_within(aim.name(), BITE_MS)?;
                    return board.pass((part * 30.0) as u32);
                }
                // Ticks are lost, which is a fault.
                let engine = crate::bench::BenchError::from;
                Fault::ButtonStorm.strike(board.bench.machine_mut()).map_err(engine)?;
                board.pass(5)?;
                Fault::ButtonStorm.heal(board.bench.machine_mut());
                board.until_within(aim.name(), BITE_MS)?;
                board.pass((part * 300.0) as u32)
            }
            Aim::Preloading => {
                board.until_within(aim.name(), BITE_MS)?;
                board.pass((part * 60.0) as u32)
            }
            Aim::SelfTest | Aim::Zeroing | Aim::Idle => Ok(()),
        }
    }

    /// The reset, at its part of a millisecond. Gives where the wheel was in the
    /// milliseconds up to it.
    fn strike(
        &self,
        board: &mut Under<'_>,
        wrong: &mut Vec<String>,
    ) -> Result<Vec<f64>, ResetError> {
        let mut way = vec![board.bench.plant().truth().position_mm];
        let machine = board.bench.machine_mut();
        let engine = crate::bench::BenchError::from;
        machine.run_on(machine.now() + (self.part * STEP as f64) as u64).map_err(engine)?;
        match self.kind {
            Kind::BrownOut => {
                Fault::BrownOut.strike(machine).map_err(engine)?;
                if !board.until_reset(FALLS_MS, &mut way)? {
                    wrong.push("not reset by a supply that is gone".to_owned());
                }
            }
            Kind::Pin => Fault::ResetPin.strike(machine).map_err(engine)?,
            Kind::Software => machine.restart(Cause::Software).map_err(engine)?,
            Kind::Watchdog => {
                Fault::Caught.strike(machine).map_err(engine)?;
                if !board.until_reset(BITE_MS, &mut way)? {
                    wrong.push(format!("not reset {BITE_MS} ms after it was caught"));
                }
            }
        }
        Ok(way)
    }

    /// What the record lacks.
    fn misses(&self, restart: Option<&Restart>, way: &[f64], struck_ms: f64) -> Option<String> {
        let Some(restart) = restart else { return Some("no record".to_owned()) };
        let fail = |what: &str| Some(format!("record: {what}: {restart}"));
        if restart.reset != self.kind.reset() {
            return fail("another reset");
        }
        let Some(snapshot) = &restart.snapshot else { return fail("nothing of the run") };
        let since_ms = struck_ms - f64::from(snapshot.tick);
        let later_ms = f64::from(match self.kind {
            Kind::Watchdog => BITE_MS,
            Kind::BrownOut => FALLS_MS,
            Kind::Pin | Kind::Software => 0,
        });
        if !(-1.0..=RECORD_MS + later_ms).contains(&since_ms) {
            return fail("of another time");
        }
        let back = (since_ms.max(0.0) as usize).min(way.len() - 1);
        let at = way[way.len() - 1 - back];
        if (snapshot.position.to_num::<f64>() - at).abs() > RECORD_MM {
            return fail(&format!("not at {at:.2} mm"));
        }
        match (self.kind, restart.crash.map(|crash| crash.stopped)) {
            (Kind::Watchdog, Some(Stopped::Hang { missed, .. })) if !missed.is_nobody() => None,
            (Kind::BrownOut, Some(Stopped::Supply)) => None,
            (Kind::BrownOut, None) => fail("nothing of the supply"),
            // Caught in a critical section nothing gets through that could tell who.
            (_, None) => None,
            (_, Some(_)) => fail("a crash that was none"),
        }
    }

    /// The command after the reset: whether it arrived, and whether the other way.
    fn go_on(
        &self,
        board: &mut Under<'_>,
        scenario: &Scenario,
        wrong: &mut Vec<String>,
    ) -> Result<(bool, bool), ResetError> {
        let mut way = self.then;
        for turned in [false, true] {
            board.fault = None;
            if !board.send(way)? {
                break;
            }
            // Some modes are of no length: it may be held before it is looked at.
            board.until(&[arrived(way), "fault hold"], RUN_MS)?;
            if board.mode.starts_with(arrived(way)) {
                let end = match way {
                    Direction::Deploy => scenario.rig.rig.travel_mm,
                    Direction::Retract => 0.0,
                };
                let at = board.bench.plant().truth().position_mm;
                let there = (at - end).abs() <= ARRIVED_MM;
                if !there {
                    wrong.push(format!("{} at {at:.2} mm", arrived(way)));
                }
                return Ok((there && !turned, there && turned));
            }
            if turned || board.fault != Some(POSITION_UNKNOWN) {
                break;
            }
            // As its sentence says: the other way.
            way = other(way);
            for _ in 0..WATCHED_MS {
                board.step()?;
            }
            board.bench.send(b'0')?;
            board.mode.clear();
            board.until(&["idle"], START_MS)?;
        }
        let at = board.bench.plant().truth().position_mm;
        wrong
            .push(format!("did not arrive: {:?}, fault {:?}, {at:.2} mm", board.mode, board.fault));
        Ok((false, false))
    }
}
