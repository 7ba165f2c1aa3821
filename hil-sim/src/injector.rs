//! Injects the faults of a scenario into a run: into sensor codes, bridge duties, the plant,
//! the tick, the commands and the log.

mod sensor;

use std::collections::VecDeque;

use interstage::sense::raw::SensorFrame;
use interstage::supervise::Command;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use sensor::FaultySensor;

use crate::plant::rig::{Drives, Truth, VirtualRig};
use crate::scenario::injection::{Injection, Kind, Onset, Target};
use crate::scenario::{Direction, Scenario, TICK_S};

/// Difference of duty from which on a fault acts.
const ACTS: f64 = 0.02;
/// Difference of duty from which on the readback must show the fault: its tolerance band, and
/// as much for an error of the supply. A constant, and a part of the duty.
const SHOWS: (f64, f64) = (0.04, 0.0625);
/// Half of the torn sector, rad.
const TORN_RAD: f64 = 0.35;
/// Distance within which a corner that carries again is the same corner, mm.
const SAME_CORNER_MM: f64 = 5.0;

/// The snapshot of the last tick that a reset finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RecordFound {
    /// As it was written.
    Intact,
    /// Not trusted, with its position off by so much, mm.
    Off(f64),
    /// Nothing.
    Gone,
}

/// When faults came and acted, s since boot; of a task that is made to hang, and of a save that
/// is interrupted, all are the time of that.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaultTimes {
    /// The first fault came.
    pub struck_s: Option<f64>,
    /// A fault first changed the duty of an actuator; other faults act as soon as they come.
    pub acts_s: Option<f64>,
    /// The same, where a fault of a bridge counts only from a difference of duty on that the
    /// readback must show.
    pub shows_s: Option<f64>,
}

/// The faults of a run and their states.
pub struct FaultInjector {
    faults: Vec<Active>,
    random: ChaCha8Rng,
    t_s: f64,
    /// Corners touched so far, and the position of the last one, mm.
    corners: (u8, Option<f64>),
    /// Whether the run deploys.
    outwards: bool,
    /// Undamaged plant: friction, load, relaxed and instant stiffness.
    undamaged: Option<(f64, f64, f64, f64)>,
}

struct Active {
    injection: Injection,
    /// When it came, s.
    since_s: Option<f64>,
    over: bool,
    /// Whether a fault that acts once has acted.
    done: bool,
    /// Whether it was active at the last call of [`FaultInjector::changes`].
    known: bool,
    /// When it first changed a duty, s.
    acts_s: Option<f64>,
    /// When it first changed a duty so far that the readback must show it, s.
    shows_s: Option<f64>,
    sensor: Option<FaultySensor>,
    /// Duty of an actuator when the fault came.
    kept: Option<f64>,
    /// Delayed duties.
    pipeline: VecDeque<f64>,
    /// Angle of the wheel at the middle of the torn sector, rad.
    torn_rad: f64,
    /// Speed of an actuator's motor, parts of its speed without load; of the drive that of the
    /// tread over this many mm/s, of the pre-tightener its bridge's output with the lag of the
    /// drawn plant, ticks.
    turns: f64,
    no_load_mm_s: f64,
    lag_ticks: f64,
}

impl FaultInjector {
    /// The faults of a scenario; none if it has none.
    pub fn of(scenario: &Scenario) -> Option<Self> {
        let injections = &scenario.run.faults;
        let plant = scenario.plant();
        let active = |injection: &Injection| Active {
            injection: *injection,
            since_s: None,
            over: false,
            done: false,
            known: false,
            acts_s: None,
            shows_s: None,
            sensor: injection.target.is_sensor().then(|| {
                let (target, kind) = (injection.target, injection.kind);
                FaultySensor::new(target, kind, injection.magnitude(), &scenario.rig)
            }),
            kept: None,
            pipeline: VecDeque::new(),
            torn_rad: 0.0,
            turns: 0.0,
            no_load_mm_s: plant.drive.no_load_mm_s,
            lag_ticks: plant.lag_s / TICK_S,
        };
        (!injections.is_empty()).then(|| Self {
            faults: injections.iter().map(active).collect(),
            random: ChaCha8Rng::seed_from_u64(scenario.run.seed ^ 0x00fa_0175),
            t_s: 0.0,
            corners: (0, None),
            outwards: scenario.run.direction == Direction::Deploy,
            undamaged: None,
        })
    }

    /// When the faults came and acted.
    pub fn times(&self) -> FaultTimes {
        let first = |time: fn(&Active) -> Option<f64>| {
            self.faults.iter().filter_map(time).min_by(f64::total_cmp)
        };
        let shows = |fault: &Active| {
            let in_bridge = fault.is_of_actuator() && fault.injection.kind.is_in_bridge();
            if in_bridge { fault.shows_s } else { fault.acts_s() }
        };
        FaultTimes {
            struck_s: first(|fault| fault.since_s),
            acts_s: first(Active::acts_s),
            shows_s: first(shows),
        }
    }

    /// Begins a tick: faults start and end.
    pub fn begin(&mut self, t_s: f64, truth: &Truth) {
        self.t_s = t_s;
        if truth.corner_n > 0.0 {
            let (count, last_mm) = &mut self.corners;
            if last_mm.is_none_or(|mm| (mm - truth.position_mm).abs() > SAME_CORNER_MM) {
                *count = count.saturating_add(1);
            }
            *last_mm = Some(truth.position_mm);
        }
        for fault in &mut self.faults {
            let due = match fault.injection.from() {
                Onset::Time(at_s) => t_s >= at_s,
                Onset::Position(mm) if self.outwards => truth.position_mm >= mm,
                Onset::Position(mm) => truth.position_mm <= mm,
                Onset::Crossing(crossing) => self.corners.0 >= crossing,
            };
            if due && fault.since_s.is_none() {
                fault.since_s = Some(t_s);
                fault.torn_rad = truth.rotation_rad;
            }
            if fault.injection.target == Target::Drive {
                fault.turns = truth.tread_mm_s / fault.no_load_mm_s;
            }
            let ends = |since_s: f64| fault.injection.duration_s.map(|s| since_s + s);
            fault.over = fault.since_s.and_then(ends).is_some_and(|end_s| t_s >= end_s);
        }
    }

    /// The faults that have started (true) or ended since the last call.
    pub fn changes(&mut self) -> Vec<(Injection, bool)> {
        let mut changes = Vec::new();
        for fault in &mut self.faults {
            let active = fault.is_active();
            if active != std::mem::replace(&mut fault.known, active) {
                changes.push((fault.injection, active));
            }
        }
        changes
    }

    /// Distorts the sensor codes for the controller.
    pub fn sensors(&mut self, frame: &mut SensorFrame) {
        let t_s = self.t_s;
        for fault in &mut self.faults {
            let since_s = fault.since_s.filter(|_| !fault.over).map(|since_s| t_s - since_s);
            if let Some(sensor) = &mut fault.sensor {
                sensor.read(frame, t_s, since_s, &mut self.random);
            }
        }
    }

    /// The command that the controller gets.
    pub fn command(&mut self, given: Option<Command>) -> Option<Command> {
        let flooding = self.is(Target::Commands, Kind::Flooding).is_some();
        let rate = self.is(Target::Commands, Kind::Random);
        let random = &mut self.random;
        let dice = rate.filter(|rate| random.random::<f64>() < rate * TICK_S);
        let any = dice.map(|_| Command::ALL[random.random_range(0..Command::ALL.len())]);
        given.or(any).or(flooding.then_some(Command::Reset))
    }

    /// Whether this control tick is lost.
    pub fn lost(&self) -> bool {
        self.faults.iter().any(|fault| {
            let overrun = fault.injection.kind == Kind::Overrun;
            let since = fault.since_s.map_or(f64::INFINITY, |since_s| self.t_s - since_s);
            overrun && since < fault.injection.magnitude() - 0.5 * TICK_S
        })
    }

    /// The reset of this tick, if there is one, by the snapshot that it finds.
    pub(crate) fn reset(&mut self) -> Option<RecordFound> {
        let here = |fault: &&mut Active| {
            fault.injection.target == Target::Reset && fault.since_s.is_some() && !fault.done
        };
        let fault = self.faults.iter_mut().find(here)?;
        fault.done = true;
        Some(match fault.injection.kind {
            Kind::Gone => RecordFound::Gone,
            Kind::Offset => RecordFound::Off(fault.injection.magnitude()),
            _ => RecordFound::Intact,
        })
    }

    pub(crate) fn model_hangs(&self) -> bool {
        self.is(Target::Model, Kind::Hung).is_some()
    }

    /// Whether the log is not read.
    pub fn log_gone(&self) -> bool {
        self.is(Target::Log, Kind::Gone).is_some()
    }

    /// The bridge duties that the plant gets.
    pub fn drives(&mut self, asked: Drives) -> Drives {
        let (mut drives, t_s) = (asked, self.t_s);
        for fault in &mut self.faults {
            let active = fault.is_active();
            match fault.injection.target {
                Target::Drive => {
                    drives.lost[0] = fault.drive(active, &mut drives.drive, drives.drive_on);
                }
                Target::Pretightener => {
                    drives.lost[1] = fault.drive(active, &mut drives.preload, drives.preload_on);
                }
                // The button's other contact is in the motors' supply.
                Target::StopWire if active && fault.injection.kind == Kind::Shorted => {
                    (drives.drive, drives.preload) = (0.0, 0.0);
                }
                _ => continue,
            }
            let worked = drives.worked();
            for (works, asked) in worked.into_iter().zip([asked.drive, asked.preload]) {
                let other = (works - asked).abs();
                if other > ACTS {
                    fault.acts_s.get_or_insert(t_s);
                }
                if other > SHOWS.0 + SHOWS.1 * asked.abs() {
                    fault.shows_s.get_or_insert(t_s);
                }
            }
        }
        drives
    }

    /// Damages the plant.
    pub fn plant(&mut self, plant: &mut VirtualRig) {
        use Target::{Load, Spring, Tread, Wheel};
        let damages =
            |fault: &Active| matches!(fault.injection.target, Wheel | Tread | Spring | Load);
        if !self.faults.iter().any(damages) {
            return;
        }
        let p = plant.parameters();
        let undamaged = (p.mu, p.load_n, p.ring.k_inf, p.ring.k_0);
        let (mu, load_n, k_inf, k_0) = *self.undamaged.get_or_insert(undamaged);
        let turned = plant.truth().rotation_rad;
        for fault in &mut self.faults {
            let active = fault.is_active();
            let part = if active { fault.injection.magnitude() } else { 1.0 };
            match (fault.injection.target, fault.injection.kind) {
                (Wheel, Kind::Slip) => plant.set_friction(mu * part),
                (Load, Kind::Doubled) => plant.set_load(load_n * part),
                (Tread, Kind::Torn) => {
                    let near = (turned - fault.torn_rad).abs() < TORN_RAD;
                    let part = if near { part } else { 1.0 };
                    plant.set_stiffness(k_inf * part, k_0 * part);
                }
                // A broken spring does not heal.
                (Spring, Kind::Broken) if active && fault.kept.is_none() => {
                    fault.kept = Some(part);
                    plant.break_spring(part);
                }
                _ => {}
            }
        }
    }

    /// Magnitude of such a fault, if it is active.
    fn is(&self, target: Target, kind: Kind) -> Option<f64> {
        let is = |injection: &Injection| (injection.target, injection.kind) == (target, kind);
        let fault = self.faults.iter().find(|fault| is(&fault.injection) && fault.is_active());
        fault.map(|fault| fault.injection.magnitude())
    }
}

impl Active {
    const fn is_active(&self) -> bool {
        self.since_s.is_some() && !self.over
    }

    const fn is_of_actuator(&self) -> bool {
        matches!(self.injection.target, Target::Drive | Target::Pretightener)
    }

    const fn acts_s(&self) -> Option<f64> {
        if self.is_of_actuator() { self.acts_s } else { self.since_s }
    }

    /// What a bridge leaves of a duty that keeps the motor's current, the duty beyond its speed, to
    /// the magnitude. It regulates towards no output, never through it.
    fn regulated(&self, duty: f64) -> f64 {
        let most = self.injection.magnitude().abs();
        let left = duty.clamp(self.turns - most, self.turns + most);
        if left * duty <= 0.0 { 0.0 } else { duty.signum() * left.abs().min(duty.abs()) }
    }

    /// Puts in the duty of the faulty bridge. Returns the part that is lost behind it.
    fn drive(&mut self, active: bool, duty: &mut f64, on: bool) -> f64 {
        let kind = self.injection.kind;
        if kind == Kind::Delayed {
            let depth = (self.injection.magnitude() / TICK_S).round() as usize;
            self.pipeline.push_back(if on { *duty } else { 0.0 });
            while self.pipeline.len() > depth + 1 {
                self.pipeline.pop_front();
            }
        }
        let acts = active && on;
        if acts {
            let kept = *self.kept.get_or_insert(*duty);
            *duty = match kind {
                Kind::Off => 0.0,
                Kind::Stuck => kept,
                Kind::Reversed => -*duty,
                Kind::Delayed => self.pipeline.front().copied().unwrap_or(*duty),
                Kind::Runaway => self.injection.magnitude(),
                Kind::Regulating => self.regulated(*duty),
                _ => *duty,
            };
        } else {
            self.kept = None;
        }
        if self.injection.target == Target::Pretightener {
            // The self-locking screw stops at once.
            let turns = self.turns + (*duty - self.turns) / self.lag_ticks.max(1.0);
            self.turns = if on { turns } else { 0.0 };
        }
        match kind {
            _ if !acts => 0.0,
            Kind::Stalled => 1.0,
            Kind::Weak => 1.0 - self.injection.magnitude(),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests;
