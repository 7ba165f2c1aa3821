//! Preload loop: the reference runs at the actuator's slew, its rate is fed forward, and
//! feedback acts only on what a model of the actuator did not expect.
//!
//! The pre-tightener integrates duty into force behind a dead time and a lag. The reference goes
//! through the same dead time and lag in a model, and the loop corrects the difference between
//! that and the sensor (Smith 1957). With dead time, lag and slew all three standard
//! deviations off it overshoots by less than 2.1 N; the nominal actuator by 0.3 N. Where spring
//! and ramp together ask for more than the slew, the reference goes only as far as the screw can.

use heapless::Deque;

use super::schedule::REACHED_PART;
use crate::model::timing::SLEW_PART;
use crate::numeric::{LowPass, LowPassState, between, checked};
use crate::rig::{Rig, RigError};
use crate::units::{Duty, Newtons, NewtonsPerSecond, Q16, TICK_HZ, per_tick, q16};

/// Longest dead time modelled, ticks; the rig's parameters end there.
pub const LONGEST_DELAY: usize = 256;
/// Rate of correction per error times dead time and lag: what an integrating actuator
/// bears with these off by half.
const CORRECTION: f64 = 0.4;
/// Fastest correction, 1/s.
const FASTEST_CORRECTION: f64 = 3.0;
/// Part of the slew that the correction may use: a preload sensor that reads wrong cannot make
/// the preload run away faster than it is noticed.
const CORRECTION_PART: f64 = 0.3;

/// Dead times and lags of its slew that the preload may be behind the model before the reference
/// waits: what the model makes with these off by half.
const LEAD: f64 = 0.5;
/// Part of its rate at which the reference then goes on: that of the slowest actuator that is no
/// fault, which is also in time for the longest rise.
const WAITING_PART: Q16 = q16(500_000);

/// The actuator as known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct PreloadLoop {
    /// Change of the reference in a tick, N.
    step: Newtons,
    /// Duty per rate, s/N.
    per_rate: Q16,
    /// Rate of correction per error, 1/s.
    correction: Q16,
    /// Largest rate of correction, N/s.
    most_correction: NewtonsPerSecond,
    /// Largest rate of the actuator, N/s.
    slew: NewtonsPerSecond,
    /// See [`LEAD`], N.
    lead: Newtons,
    /// Error that may stand, N: half of that with which the preload is reached.
    standing: Newtons,
    /// Ticks for which it does where no step has caused it: twice what the loop takes to answer.
    stands: u16,
    delay: usize,
    lag: LowPass,
}

/// Reference and model.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PreloadLoopState {
    /// Reference after the slew limit, N.
    reference: Newtons,
    /// References inside the dead time, the oldest first.
    pipeline: Deque<Newtons, LONGEST_DELAY>,
    model: LowPassState,
    /// Ticks for which an error has stood.
    stood: u16,
    /// Rate that holds what stands, N/s.
    holding: NewtonsPerSecond,
    running: bool,
}

impl PreloadLoop {
    /// The actuator of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let slew = rig.preload.slew_n_per_s;
        let ticks = libm::round(rig.preload.delay_s * f64::from(TICK_HZ)) as usize;
        Ok(Self {
            step: checked("preload.slew_n_per_s", slew * 1e-3)? * SLEW_PART,
            per_rate: checked("preload.slew_n_per_s", 1.0 / slew)?,
            correction: checked("preload.delay_s", correction(rig))?,
            most_correction: checked("preload.slew_n_per_s", slew * CORRECTION_PART)?,
            slew: checked("preload.slew_n_per_s", slew)?,
            lead: checked("preload.delay_s", LEAD * slew * rig.preload_latency_s())?,
            standing: checked("preload.limit_n", rig.preload.limit_n)? * REACHED_PART.half(),
            stands: (2.0 * answer_s(rig) * f64::from(TICK_HZ)) as u16,
            delay: ticks.min(LONGEST_DELAY - 1),
            lag: LowPass::build(rig.preload.lag_s),
        })
    }

    /// One tick towards `target` at `measured`, both N. `drift` is the rate at which the wheel's
    /// own motion will change the spring's force when this tick's duty takes effect, N/s.
    pub fn step(
        &self,
        state: &mut PreloadLoopState,
        target: Newtons,
        measured: Newtons,
        drift: NewtonsPerSecond,
    ) -> Duty {
        if !state.running {
            state.start(measured, self.delay);
        }
        let change = between(target - state.reference, -self.step, self.step);
        // An actuator that does not keep up is waited for, but not without end.
        let behind = state.model.output() - measured;
        let falls_back = if change < Q16::ZERO { behind < -self.lead } else { behind > self.lead };
        let rate = change * Q16::from_num(TICK_HZ as i16) - drift;
        let beyond = rate - between(rate, -self.slew, self.slew);
        let change = if falls_back { change * WAITING_PART } else { change };
        state.reference += change - Q16::narrow(per_tick(beyond));
        // The dead time is shorter than the pipeline: there is room.
        let _ = state.pipeline.push_back(state.reference);
        let delayed = state.pipeline.pop_front().unwrap_or(state.reference);
        let expected = self.lag.step(&mut state.model, delayed);
        let error = expected - measured;
        let stands = change == Q16::ZERO && error.abs() > self.standing;
        state.stood = if stands { state.stood.saturating_add(1) } else { 0 };
        let most = self.most_correction;
        if state.stood > self.stands {
            // Of a screw that sticks, or whose load takes duty to hold: critically damped.
            let more = per_tick((error * self.correction).half() * self.correction.half());
            state.holding = between(state.holding + Q16::narrow(more), -most, most);
        }
        let correction = between(error * self.correction + state.holding, -most, most);
        Duty::saturating((rate + correction) * self.per_rate)
    }
}

/// Rate of correction per error, 1/s.
#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
fn correction(rig: &Rig) -> f64 {
    (CORRECTION / rig.preload_latency_s()).min(FASTEST_CORRECTION)
}

/// Time in which the loop answers what it was not told of, s: dead time, lag, and the time
/// constant of its correction.
#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
pub fn answer_s(rig: &Rig) -> f64 {
    rig.preload_latency_s() + 1.0 / correction(rig)
}

impl PreloadLoopState {
    /// Stops the loop; it starts again from the preload that it then finds.
    pub fn halt(&mut self) {
        self.running = false;
    }

    /// Reference after the slew limit, N; what is measured while the loop does not run.
    pub const fn reference(&self, measured: Newtons) -> Newtons {
        if self.running { self.reference } else { measured }
    }

    /// Preload that the actuator should have reached by now, N.
    pub fn due(&self) -> Newtons {
        if self.running { self.model.output() } else { Q16::ZERO }
    }

    fn start(&mut self, measured: Newtons, delay: usize) {
        self.reference = measured;
        self.pipeline.clear();
        for _ in 0..delay.min(LONGEST_DELAY - 1) {
            let _ = self.pipeline.push_back(measured);
        }
        self.model = LowPassState::at(measured);
        (self.stood, self.holding) = (0, Q16::ZERO);
        self.running = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Pre-tightener with dead time, lag and slew off by the given factors, which takes this duty to
    /// hold its load.
    fn run(target: f64, [delay, lag, slew]: [f64; 3], holds: f64, seconds: f64) -> Vec<f64> {
        let rig = Rig::prototype();
        let control = PreloadLoop::try_build(&rig).unwrap();
        let mut state = PreloadLoopState::default();
        let depth = (rig.preload.delay_s * delay * 1e3).round() as usize;
        let mut dead_time: std::collections::VecDeque<f64> = vec![0.0; depth].into();
        let (mut force, mut rate) = (33.3, 0.0);
        (0..(seconds * 1e3) as usize)
            .map(|_| {
                let out = control.step(
                    &mut state,
                    Q16::from_num(target),
                    Q16::from_num(force),
                    Q16::ZERO,
                );
                dead_time.push_back(f64::from(out.to_bits()) / 32768.0);
                let duty = dead_time.pop_front().unwrap() - holds;
                let command = duty * rig.preload.slew_n_per_s * slew;
                rate += (command - rate) * 1e-3 / (rig.preload.lag_s * lag);
                force += rate * 1e-3;
                force
            })
            .collect()
    }

    proptest! {
        #[test]
        fn the_preload_arrives_without_much_overshoot_on_any_drawn_actuator(
            target in 10.0..49.0f64,
            delay in 0.6..1.45f64,
            lag in 0.6..1.45f64,
            slew in 0.86..1.15f64,
        ) {
            let force = run(target, [delay, lag, slew], 0.0, 3.0);
            let end = *force.last().unwrap();
            prop_assert!((end - target).abs() < 0.1, "{end}");
            let beyond = force.iter().map(|f| (f - target) * (target - 33.3).signum());
            let overshoot = beyond.fold(f64::MIN, f64::max);
            prop_assert!(overshoot < 2.1, "{overshoot}");
        }
    }

    #[test]
    fn the_nominal_actuator_follows_the_slew_and_stands_in_the_time_allowed() {
        let force = run(48.0, [1.0; 3], 0.0, 2.0);
        let rig = Rig::prototype();
        let timing = crate::model::timing::Timing::try_build(&rig).unwrap();
        let allowed = timing.preload_change(Q16::from_num(48.0 - 33.3)).to_num::<f64>();
        let stands = force.iter().position(|f| *f > 47.5).unwrap() as f64 * 1e-3;
        assert!(stands <= allowed, "{stands} {allowed}");
        assert!(force.iter().all(|f| *f < 48.3));
    }

    /// A screw whose rate falls with its load would stand 1.5 N short by the correction alone, and
    /// the wheel would wait for it before a corner.
    #[test]
    fn a_screw_that_takes_duty_to_hold_its_load_arrives_without_overshoot() {
        let reached = Rig::prototype().preload.limit_n * REACHED_PART.to_num::<f64>();
        for slew in [0.86, 1.0, 1.15] {
            let force = run(47.8, [1.0, 1.0, slew], 0.18, 6.0);
            assert!(force[1500] < 47.8 - reached, "{slew} {}", force[1500]);
            assert!((force[5999] - 47.8).abs() < 0.6 * reached, "{slew} {}", force[5999]);
            assert!(force.iter().all(|f| *f < 47.8 + 0.2 * reached), "{slew}");
        }
    }

    #[test]
    fn what_held_the_load_of_one_run_is_not_carried_into_the_next() {
        let control = PreloadLoop::try_build(&Rig::prototype()).unwrap();
        let mut state = PreloadLoopState::default();
        let step = |state: &mut PreloadLoopState, measured: i16| {
            control.step(state, Q16::from_num(48), Q16::from_num(measured), Q16::ZERO)
        };
        let held = (0..9000).map(|tick| step(&mut state, if tick == 0 { 48 } else { 46 })).last();
        state.halt();
        assert!(held.is_some_and(|held| held != Duty::ZERO));
        assert_eq!(step(&mut state, 48), Duty::ZERO);
    }
}
