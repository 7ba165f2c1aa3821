//! Judges a run with a fault by the true state of the plant, not by the controller's estimate:
//! was the mechanism held, did it move uncommanded, was the fault reported.

use interstage::fault::{Fault, Limit};
use interstage::rig::{OVERPRESSURE_PART, Rig};
use interstage::supervise::Mode;
use interstage::supervise::{OVERPRESSURE_TICKS, off_reference_mm};
use interstage::tick::{Event, Output};
use interstage::units::Direction;
use serde::{Deserialize, Serialize};

use crate::plant::draw::STOP_ROOM_MM;
use crate::plant::rig::Truth;
use crate::plant::wall::touch_mm;
use crate::scenario::injection::{Injection, Kind, Target, entry, restarts};
use crate::scenario::{Scenario, TICK_S};

/// Time within which 123 finds a wheel off its reference, s: two spans of the cross-check, which are
/// the controller's on every rig.
const OFF_REFERENCE_S: f64 = 0.012;
/// Gap that a run may have, parts of the reference gap, which is the rig's.
pub(crate) const GAP_PART: f64 = 1.1;
/// Limits that report what the controller does about its task, not that anything is wrong.
const OPERATIONAL: [Limit; 5] = [
    Limit::PreloadLimited,
    Limit::SpeedFloor,
    Limit::ResonanceAvoided,
    Limit::PreloadWait,
    Limit::SlipMarginLow,
];
/// Speed that counts as rest, mm/s.
const REST_MM_S: f64 = 0.01;

/// What became of a fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Finding {
    /// A fault that names it was latched.
    Found,
    /// A limit that names it was reported, and not by the same run without the fault.
    Limited,
    /// It was reported, but as something else.
    Otherwise,
    /// Nothing was reported, and the run ended as it should, within all bounds.
    Tolerated,
    /// Nothing was reported, and the run left a bound or did not end as it reports.
    #[default]
    Undetected,
}

impl Finding {
    /// Of a fault that ended in this restart, or in a start that holds, if it was reported.
    pub fn of_restart(fault: Option<&Injection>, reported: Option<&str>) -> Self {
        let own = fault.map_or(&[][..], |fault| restarts(fault.target, fault.kind));
        match reported {
            None => Self::Undetected,
            Some(said) if own.iter().any(|own| said.starts_with(own)) => Self::Found,
            Some(_) => Self::Otherwise,
        }
    }
}

/// Bounds of the mechanism, which follow from the rig.
#[derive(Clone, Copy, Debug, Default)]
struct Bounds {
    preload_n: f64,
    motion_mm: f64,
    faster_mm_s: f64,
    slows_mm_s2: f64,
    gap_part: f64,
    end_mm: f64,
}

/// Distance in which the wheel coasts from the largest speed with the motor's time constant,
/// `m v_0 / F_stall`, mm.
pub fn coasts_mm(rig: &Rig) -> f64 {
    let drive = &rig.drive;
    let mass_kg = drive.reflected_mass_kg + rig.plant.moved_mass_kg;
    let coasts_s = 1e-3 * mass_kg * drive.no_load_speed_mm_s / drive.stall_force_n;
    drive.cruise_speed_mm_s * coasts_s
}

impl Bounds {
    /// - Preload: that at which 120 trips, of a sensor that reads too little by its stated error,
    ///   and what the screw adds at its full slew while the fault is confirmed and in its own dead
    ///   time and lag. The screw's stop, at 1.25 of the limit, is farther.
    /// - Motion: what the wheel may be off its reference before 123 is reported, and the distance
    ///   in which it coasts. A wheel that slips, or is torn where it carries, may slide off the corner
    ///   it is on, by its run over that, `sqrt(R^2 - (R - h)^2)`, which no bridge can hold it on.
    ///   It may do so again: what it loses each time is counted from the farthest place.
    /// - Faster than its reference, along the command: what 123 lets pass of a wheel whose encoder
    ///   is right, and never beyond the drive's speed without load. That is no harm on a wall; at
    ///   a step the gap bounds it. The reference counts as slowing by the profile.
    /// - Gap: as in a run that reports nothing. A wheel that slips lifts off as it slides, and the
    ///   reference is that of the table's steps alone.
    /// - End: the room before the end stop, which is the same on every virtual rig. There a wheel
    ///   ends whose encoder went wrong on the last millimetres.
    fn of(rig: &Rig, slips: bool, strange_step: bool) -> Self {
        let (preload, drive, rig_mm) = (&rig.preload, &rig.drive, &rig.rig);
        let trips_n = preload.limit_n * (1.0 + OVERPRESSURE_PART) / (1.0 - rig.sense.preload_error);
        let late_s = f64::from(OVERPRESSURE_TICKS) * TICK_S + rig.preload_latency_s();
        let run_mm = touch_mm(rig_mm.wheel_radius_mm, rig_mm.step_height_mm);
        let off_mm = off_reference_mm(rig);
        let faster_mm_s = off_mm / OFF_REFERENCE_S;
        Self {
            preload_n: trips_n + preload.slew_n_per_s * late_s,
            motion_mm: if slips { run_mm } else { off_mm + coasts_mm(rig) },
            faster_mm_s: faster_mm_s.min(drive.no_load_speed_mm_s - drive.cruise_speed_mm_s),
            slows_mm_s2: drive.acceleration_mm_s2,
            gap_part: if slips || strange_step { f64::INFINITY } else { GAP_PART },
            end_mm: STOP_ROOM_MM,
        }
    }
}

/// Axial speed, mm/s: an axle that sinks on the rubber of a wheel that stands is held, and so is one
/// at a stop, behind which the rubber relaxes.
fn moves_mm_s(truth: &Truth) -> f64 {
    let (axle, rigid) = (truth.speed_mm_s, truth.rigid_mm_s);
    if axle * rigid > 0.0 { axle.signum() * axle.abs().min(rigid.abs()) } else { 0.0 }
}

/// The record of a run under judgement.
#[derive(Clone, Debug, Default)]
pub struct Judge {
    bounds: Bounds,
    /// Codes that name what was injected; none if nothing was, and any report is of nothing.
    codes: Option<&'static [u16]>,
    ends_mm: (f64, f64),
    /// Largest distance from the end while it reported arrival, mm.
    off_mm: f64,
    position_mm: f64,
    asked_mm_s: f64,
    /// Distances moved since the fault came, mm: beyond what was commanded, in sum, and back from
    /// the farthest place.
    beyond_mm: f64,
    behind_mm: f64,
    /// Largest preload since the fault came, N.
    pub peak_preload_n: f64,
    /// The largest sum of both, mm.
    pub motion_mm: f64,
    /// First fault latched since the fault came: when, s, and its code.
    pub fault: Option<(f64, u16)>,
    /// Limits since the fault came: when, s, and code.
    pub limits: Vec<(f64, u16)>,
    /// Since when both bridges have been off and nothing has moved, s.
    pub rest_s: Option<f64>,
    mode: Mode,
    /// Commands came at random: any rest is a right end.
    commanded: bool,
    /// What was injected is a reset of this kind.
    reset: Option<Kind>,
}

impl Judge {
    /// Before the first tick of a run.
    pub(crate) fn new(scenario: &Scenario, truth: &Truth) -> Self {
        let fault = scenario.run.faults.first();
        let target = fault.map(|fault| fault.target);
        let reset = fault.filter(|fault| fault.target == Target::Reset);
        let slips = matches!(target, Some(Target::Wheel | Target::Tread));
        let commanded = target == Some(Target::Commands);
        let anomaly = scenario.run.anomalies.first().map(|step| (Target::Step, step.kind()));
        let injected = fault.map(|fault| (fault.target, fault.kind)).or(anomaly);
        let codes = injected.and_then(|(of, kind)| entry(of, kind)).map(|entry| entry.codes);
        Self {
            bounds: Bounds::of(&scenario.rig, slips, !scenario.run.anomalies.is_empty()),
            codes,
            ends_mm: (0.0, scenario.rig.rig.travel_mm),
            position_mm: truth.position_mm,
            commanded,
            reset: reset.map(|fault| fault.kind),
            ..Self::default()
        }
    }

    /// Looks at a tick: the controller's output and the true state after it. `active`: the
    /// fault is active.
    pub fn look(&mut self, t_s: f64, output: &Output, truth: &Truth, active: bool) {
        let moves_mm_s = moves_mm_s(truth);
        self.position_mm = truth.position_mm;
        self.mode = output.telemetry.mode;
        // The wheel follows the reference with a lag: the recent maximum counts.
        let asked = f64::from(output.telemetry.speed_ref.to_bits()) / 65_536.0;
        self.asked_mm_s = asked.abs().max(self.asked_mm_s - self.bounds.slows_mm_s2 * TICK_S);
        if !active {
            return;
        }
        self.peak_preload_n = self.peak_preload_n.max(truth.preload_n);
        self.count(moves_mm_s * TICK_S);
        if let Mode::Complete(direction) = self.mode {
            let (stow_mm, end_mm) = self.ends_mm;
            let end_mm = if direction == Direction::Deploy { end_mm } else { stow_mm };
            self.off_mm = self.off_mm.max((self.position_mm - end_mm).abs());
        }
        for entry in &output.events {
            match entry.event {
                Event::Fault(fault) if self.fault.is_none() => {
                    self.fault = Some((t_s, fault.code()));
                }
                Event::Limit(limit) => self.limits.push((t_s, limit.code())),
                _ => {}
            }
        }
        let off = !output.drive.enable && !output.preload.enable;
        let still = moves_mm_s.abs() < REST_MM_S && truth.tread_mm_s.abs() < REST_MM_S;
        self.rest_s = (off && still).then(|| self.rest_s.unwrap_or(t_s));
    }

    /// Counts what was not commanded of the motion of a tick, mm.
    fn count(&mut self, moved_mm: f64) {
        if let Mode::Run(direction, _) | Mode::Stopping(direction) = self.mode {
            let along = f64::from(direction.sign()) * moved_mm;
            let most = (self.asked_mm_s + self.bounds.faster_mm_s) * TICK_S;
            self.beyond_mm += (along - most).max(0.0);
            self.behind_mm = (self.behind_mm - along).max(0.0);
        } else {
            self.beyond_mm += moved_mm.abs();
        }
        self.motion_mm = self.motion_mm.max(self.beyond_mm + self.behind_mm);
    }

    /// Which bounds of the mechanism were exceeded, in words; empty if it was safe. `gap_part` is
    /// the largest gap over the reference.
    pub(crate) fn harms(&self, gap_part: f64) -> Vec<String> {
        let mut harms = Vec::new();
        let most = self.bounds.preload_n;
        if self.peak_preload_n > most {
            harms.push(format!("preload {:.1} N, at most {most:.1}", self.peak_preload_n));
        }
        if self.motion_mm > self.bounds.motion_mm {
            let (moved, most) = (self.motion_mm, self.bounds.motion_mm);
            harms.push(format!("{moved:.2} mm uncommanded, at most {most:.2}"));
        }
        if gap_part > self.bounds.gap_part {
            harms.push(format!("gap {gap_part:.2} of the reference"));
        }
        if self.off_mm > self.bounds.end_mm {
            harms.push(format!("{:.1} mm from the end it says it reached", self.off_mm));
        }
        if self.rest_s.is_none() {
            harms.push("not at rest at its end".to_owned());
        }
        harms
    }

    /// What became of the fault. `known` are the limits of the same run without it,
    /// `gap_part` the largest gap over the reference, `crossed` whether every step was
    /// crossed; a stop on command is as good an end as arrival.
    pub(crate) fn finding(&self, known: &[u16], gap_part: f64, crossed: bool) -> Finding {
        let ended = match self.mode {
            Mode::Complete(_) => crossed || self.commanded,
            _ => self.mode.is_at_rest(),
        };
        if let Some(kind) = self.reset {
            // The start itself is reported: the judgement is of the rest of the run.
            let ended = matches!(self.mode, Mode::Complete(_)) || self.fault.is_some();
            if ended && !self.false_alarm(kind) { Finding::Found } else { Finding::Undetected }
        } else if self.fault.is_some_and(|(_, code)| self.names(code)) {
            Finding::Found
        } else if self.new_limits(known).any(|(_, code)| self.names(code)) {
            Finding::Limited
        } else if self.report(known).is_some() {
            Finding::Otherwise
        } else if ended && self.harms(gap_part).is_empty() && gap_part <= GAP_PART {
            Finding::Tolerated
        } else {
            Finding::Undetected
        }
    }

    /// Whether a run after a reset reports something untrue. Only a run without a confirmed
    /// record may report that its position is unknown, or at its end that no step lay ahead.
    fn false_alarm(&self, kind: Kind) -> bool {
        let limited = |limit: Limit| self.limits.iter().any(|(_, code)| *code == limit.code());
        let (lost, unconfirmed) = (kind != Kind::Recorded, limited(Limit::PositionUnconfirmed));
        let honest = |code| {
            let is = |fault: Fault| code == fault.code();
            lost && (is(Fault::PositionUnknown) || unconfirmed && is(Fault::PlaceUnconfirmed))
        };
        let untrue = [Limit::StepExtra, Limit::StepMissing, Limit::CompressionStrange];
        self.fault.is_some_and(|(_, code)| !honest(code)) || untrue.into_iter().any(limited)
    }

    fn names(&self, code: u16) -> bool {
        self.codes.is_none_or(|codes| codes.contains(&code))
    }

    /// Limits that say that something is wrong, and that the run without the fault does not report.
    fn new_limits(&self, known: &[u16]) -> impl Iterator<Item = (f64, u16)> {
        let new = move |(_, code): &(f64, u16)| {
            !known.contains(code) && OPERATIONAL.iter().all(|limit| limit.code() != *code)
        };
        self.limits.iter().copied().filter(new)
    }

    /// The report that counts, when, s, and its code: the fault or else the first limit, one that
    /// names what was injected before others.
    pub(crate) fn report(&self, known: &[u16]) -> Option<(f64, u16)> {
        let all = || self.fault.into_iter().chain(self.new_limits(known));
        all().find(|(_, code)| self.names(*code)).or(all().next())
    }

    /// How the run ended, in a word.
    pub fn end(&self) -> &'static str {
        match self.mode {
            Mode::FaultHold(_) => "fault hold",
            Mode::Complete(_) => "arrived",
            Mode::Idle => "idle",
            Mode::Boot | Mode::SelfTest | Mode::Zero => "start",
            Mode::Preload(_) | Mode::Run(..) | Mode::Stopping(_) => "under way",
            Mode::Service => "service",
        }
    }
}

#[cfg(test)]
mod tests {
    use interstage::sense::raw::SensorId;
    use interstage::supervise::Leg;
    use interstage::tick::Entry;
    use interstage::units::{MotorCommand, Q16};

    use super::*;

    const RUN: Mode = Mode::Run(Direction::Deploy, Leg::Cruise);

    /// A judge of the prototype, so many times as large, as fast and as strong, that has seen this
    /// mode at this reference and true speed, mm/s, under this preload, N, for 100 ms.
    fn judged(scale: f64, mode: Mode, (asked, speed): (f64, f64), preload_n: f64) -> Judge {
        let (mut scenario, mut output) = (Scenario::default(), Output::default());
        let Rig { rig, preload, drive, .. } = &mut scenario.rig;
        let forces = [&mut preload.limit_n, &mut preload.slew_n_per_s];
        let speeds = [&mut drive.no_load_speed_mm_s, &mut drive.cruise_speed_mm_s];
        let sizes = [&mut rig.wheel_radius_mm, &mut rig.travel_mm];
        [forces, speeds, sizes].into_iter().flatten().for_each(|value| *value *= scale);
        let (speed_mm_s, rigid_mm_s) = (speed, speed);
        let mut truth = Truth { preload_n, speed_mm_s, rigid_mm_s, ..Truth::default() };
        let mut judge = Judge::new(&scenario, &truth);
        output.telemetry.mode = mode;
        output.telemetry.speed_ref = Q16::from_num(asked);
        for tick in 0..100 {
            truth.position_mm += speed * TICK_S;
            judge.look(f64::from(tick) * TICK_S, &output, &truth, true);
        }
        judge
    }

    #[test]
    fn motion_is_uncommanded_beyond_its_reference_against_it_and_at_rest() {
        // 0.11 mm and 2 counts in 12 ms are 12.36 mm/s, with counts twice as long 15.56.
        for (scale, more) in [(1.0, 12.36), (2.0, 15.56)] {
            let moved_mm = |mode, asked, speed| judged(scale, mode, (asked, speed), 40.0).motion_mm;
            assert!(moved_mm(RUN, 8.0, 7.94 + more) < 1e-9);
            assert!((moved_mm(RUN, 8.0, 18.0 + more) - 1.0).abs() < 0.01);
            assert!((moved_mm(RUN, 8.0, -8.0) - 0.8).abs() < 0.01);
            let hold = Mode::FaultHold(Fault::DriveStalled);
            assert!((moved_mm(hold, 0.0, 1.0) - 0.1).abs() < 1e-9);
        }
    }

    #[test]
    fn a_harm_is_named() {
        let hold = Mode::FaultHold(Fault::Overpressure);
        let [out, back] = Direction::ALL.map(Mode::Complete);
        // Motion: 0.15 and 0.46 mm, twice as large 0.19 and 1.85 mm.
        for (scale, most_mm) in [(1.0, 0.61), (2.0, 2.03)] {
            let judged = |mode, speed, part| judged(scale, mode, (0.0, speed), part * scale);
            let harm = |mode, speed, part| judged(mode, speed, part).harms(1.0).concat();
            // 1.1 of 50 N by a sensor that reads 1.5 % too little, and 25 N/s for 10, 80 and 60 ms.
            assert_eq!(harm(hold, 0.0, 59.5) + &harm(back, 0.0, 40.0), "");
            assert!(harm(hold, 0.0, 59.7).starts_with(&format!("preload {:.1} N", 59.7 * scale)));
            assert_eq!(harm(hold, 9.9 * most_mm, 40.0), "not at rest at its end");
            assert!(harm(hold, 10.1 * most_mm, 40.0).contains("mm uncommanded"));
            assert_eq!(judged(hold, 0.0, 40.0).harms(1.11), ["gap 1.11 of the reference"]);
            let far = format!("{:.1} mm from the end", 80.0 * scale);
            assert!(harm(out, 0.0, 40.0).starts_with(&far));
        }
    }

    #[test]
    fn what_is_not_reported_must_have_ended_well() {
        let back = Mode::Complete(Direction::Retract);
        let good = judged(1.0, back, (0.0, 0.0), 40.0);
        assert_eq!(good.finding(&[], 1.0, true), Finding::Tolerated);
        assert_eq!(good.finding(&[], 1.0, false), Finding::Undetected);
        assert_eq!(good.finding(&[], 1.3, true), Finding::Undetected);
        let moving = judged(1.0, RUN, (8.0, 8.0), 40.0);
        assert_eq!(moving.finding(&[], 1.0, true), Finding::Undetected);
        let mut limited = good.clone();
        limited.limits.push((0.1, Limit::StepLate.code()));
        assert_eq!(limited.finding(&[], 1.3, true), Finding::Limited);
        assert_eq!(limited.finding(&[Limit::StepLate.code()], 1.3, true), Finding::Undetected);
        // After a reset, an end that is not confirmed is honest with its limit alone.
        let mut lost = Judge { fault: Some((0.1, Fault::PlaceUnconfirmed.code())), ..good };
        assert!(lost.false_alarm(Kind::Off));
        lost.limits.push((0.1, Limit::PositionUnconfirmed.code()));
        assert!(!lost.false_alarm(Kind::Off) && lost.false_alarm(Kind::Recorded));
    }

    #[test]
    fn what_does_not_name_the_fault_is_found_as_something_else() {
        let of = |target, kind, codes: &[u16]| {
            let mut scenario = Scenario::default();
            scenario.run.faults = vec![Injection::at(target, kind, 0.0, 1.5)];
            let mut judge = Judge::new(&scenario, &Truth::default());
            judge.mode = Mode::Complete(Direction::Retract);
            judge.rest_s = Some(1.0);
            for code in codes {
                match code {
                    ..200 => judge.fault = Some((1.0, *code)),
                    _ => judge.limits.push((0.5, *code)),
                }
            }
            (judge.finding(&[], 1.0, true), judge.report(&[]).map(|(_, code)| code))
        };
        let finding = |codes: &[u16]| of(Target::Sensor(SensorId::WheelEncoder), Kind::Gain, codes);
        assert_eq!(finding(&[125]), (Finding::Found, Some(125)));
        assert_eq!(finding(&[136]), (Finding::Otherwise, Some(136)));
        assert_eq!(finding(&[219]), (Finding::Otherwise, Some(219)));
        assert_eq!(finding(&[219, 125]), (Finding::Found, Some(125)));
        // Those of the board's hardware are named by their own codes, too.
        for (target, kind, names, other) in [
            (Target::Dma, Kind::Stalled, 103, 123),
            (Target::StopWire, Kind::Shorted, 128, 123),
            (Target::Debugger, Kind::Halted, 216, 112),
            (Target::Image, Kind::BitErrors, 0, 123),
        ] {
            assert_eq!(of(target, kind, &[other]).0, Finding::Otherwise, "{target:?}");
            if names > 0 {
                let found = of(target, kind, &[names]).0;
                assert_eq!(found, if names < 200 { Finding::Found } else { Finding::Limited });
            }
        }
        let falls = Injection::at(Target::Supply, Kind::Off, 0.0, 0.0);
        let [own, other] = ["reset by supply", "reset by watchdog"]
            .map(|said| Finding::of_restart(Some(&falls), Some(said)));
        assert_eq!((own, other), (Finding::Found, Finding::Otherwise));
        // What the controller does about its task names nothing.
        assert_eq!(finding(&[205]), (Finding::Tolerated, None));
    }

    #[test]
    fn the_first_fault_after_the_injection_counts() {
        let mut judge = Judge::new(&Scenario::default(), &Truth::default());
        let mut output = Output::default();
        let mut say = |at: u32, fault, active| {
            output.events.clear();
            let event = Event::Fault(fault);
            output.events.push(Entry { at, event }).expect("room");
            judge.look(f64::from(at) * TICK_S, &output, &Truth::default(), active);
        };
        say(1, Fault::SelfTest, false);
        say(2, Fault::ArmAngleStale, true);
        say(3, Fault::SelfTest, true);
        assert_eq!(judge.fault, Some((0.002, Fault::ArmAngleStale.code())));
        assert_eq!(judge.rest_s, Some(0.002));
        output.drive = MotorCommand { enable: true, ..MotorCommand::OFF };
        judge.look(0.004, &output, &Truth::default(), true);
        assert_eq!(judge.rest_s, None);
    }
}
