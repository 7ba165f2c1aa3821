//! Compression against preload, through the tread's stiffness, on a wheel at rest.
//!
//! Pressed on a wall a ring of rubber with memory carries `E = K c^(3/2)` when relaxed, with
//! `K = 4/3 k_inf L sqrt(2 R)`; while it is being pressed, `F = E + (s - 1)(E - q)`, where `q`
//! follows `E` with the relaxation time. So preload and compression sensor check each other,
//! as far as the rubber is known. A rolling wheel is not checked: the law is too simple for
//! it.

#![deny(clippy::float_arithmetic)]

use crate::numeric::{LowPass, LowPassState, checked, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{Millimetres, Newtons, Q16, Ratio, q16};

/// Part of the load that the compression may show too much or too little. Rubber that is off
/// by three deviations of 4 % makes 0.13, gains of both sensors 0.03, the noise of what they
/// zeroed 0.01; the worst of the random rigs is 0.17.
const BAND: Ratio = q16(220_000);
/// Least preload at which it is checked, part of the cruise preload: the wheel rolls from about
/// 0.4 of it on.
const LEAST_PART: f64 = 0.3;
/// Ticks after which what the tread remembers from before is forgotten far enough.
const FORGETS: u16 = 300;
/// Ticks that it must be off.
const OFF_TICKS: u16 = 50;

/// The tread as known.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct TreadLaw {
    /// `K`, N/mm^(3/2).
    rate: Q16,
    /// `1 / s`.
    instant: Ratio,
    memory: LowPass,
    /// Least preload at which it is checked, N.
    least: Newtons,
}

/// State of a [`TreadLaw`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TreadState {
    /// `q`, N.
    memory: LowPassState,
    ticks: u16,
    off: u16,
}

impl TreadLaw {
    /// The tread of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let area = 1e-9 * rig.tread.k_inf_pa_per_m * rig.rig.wheel_width_mm;
        let rate = 4.0 / 3.0 * area * libm::sqrt(2.0 * rig.rig.wheel_radius_mm);
        Ok(Self {
            rate: checked("tread.k_inf_pa_per_m", rate)?,
            instant: checked("tread.stiffening", 1.0 / rig.tread.stiffening)?,
            memory: LowPass::build(rig.tread.tau_s),
            least: checked("preload.cruise_n", LEAST_PART * rig.preload.cruise_n)?,
        })
    }

    /// The wheel is at rest and has been pressed like this for long.
    pub const fn begin(&self, state: &mut TreadState, preload: Newtons) {
        *state = TreadState { memory: LowPassState::at(preload), ticks: 0, off: 0 };
    }

    /// A tick of a wheel at rest on a wall; true once, if compression and preload contradict
    /// each other. The arm's inclination may add `arm_thrust` to the preload, or nothing while
    /// the latch at the stow end carries the load.
    pub fn step(
        &self,
        state: &mut TreadState,
        preload: Newtons,
        arm_thrust: Newtons,
        compression: Millimetres,
    ) -> bool {
        let kept = state.memory.output();
        let felt = kept + (preload - kept) * self.instant;
        self.memory.step(&mut state.memory, felt);
        state.ticks = state.ticks.saturating_add(1);
        if state.ticks < FORGETS || preload < self.least {
            return false;
        }
        let shown = compression * sqrt(compression) * self.rate;
        let most = felt + arm_thrust;
        let off = shown > most + most * BAND || shown < felt - felt * BAND;
        state.off = if off { state.off.saturating_add(1) } else { 0 };
        state.off == OFF_TICKS
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Presses a wheel of rubber that is `stiff` times as stiff from nothing to the preload at
    /// which crossings are made, at the pre-tightener's slew, with sensors of these gains;
    /// gives the tick of the report.
    fn pressed(name: &str, stiff: f64, load_gain: f64, tread_gain: f64) -> Option<u32> {
        let rig = Rig::named(name).expect("a preset");
        let law = TreadLaw::try_build(&rig).expect("in range");
        let mut state = TreadState::default();
        law.begin(&mut state, Q16::ZERO);
        let area = 1e-9 * rig.tread.k_inf_pa_per_m * rig.rig.wheel_width_mm;
        let rate = stiff * 4.0 / 3.0 * area * (2.0 * rig.rig.wheel_radius_mm).sqrt();
        let (mut force, mut memory, s) = (0.0f64, 0.0f64, rig.tread.stiffening);
        (0..3000).find(|_| {
            force = (force + rig.preload.slew_n_per_s * 1e-3).min(0.95 * rig.preload.limit_n);
            // Many short steps of the same solid, by another integration.
            for _ in 0..20 {
                let elastic = (force + (s - 1.0) * memory) / s;
                memory += (elastic - memory) / rig.tread.tau_s * 50e-6;
            }
            let elastic = (force + (s - 1.0) * memory) / s;
            let compression = (elastic / rate).powf(2.0 / 3.0);
            law.step(
                &mut state,
                Q16::from_num(force * load_gain),
                Q16::ZERO,
                Q16::from_num(compression * tread_gain),
            )
        })
    }

    #[test]
    fn a_compression_sensor_that_is_a_fifth_off_is_told() {
        for name in ["prototype", "fe"] {
            assert_eq!(pressed(name, 1.0, 1.0, 1.0), None);
            assert!(pressed(name, 1.0, 1.0, 1.2).is_some());
            assert!(pressed(name, 1.0, 1.0, 1.0 / 1.2).is_some());
            assert!(pressed(name, 1.0, 0.7, 1.0).is_some());
        }
    }

    #[test]
    fn what_the_arm_may_add_excuses_as_much() {
        let law = TreadLaw::try_build(&Rig::prototype()).expect("in range");
        let relaxed = |arm_thrust: f64, compression: f64| {
            let mut state = TreadState::default();
            let preload = Q16::from_num(40.0);
            law.begin(&mut state, preload);
            (0..1000).any(|_| {
                law.step(&mut state, preload, Q16::from_num(arm_thrust), Q16::from_num(compression))
            })
        };
        let at = |force: f64| (force / law.rate.to_num::<f64>()).powf(2.0 / 3.0);
        assert!(!relaxed(0.0, at(40.0 * 1.2)) && relaxed(0.0, at(40.0 * 1.25)));
        assert!(!relaxed(8.0, at(48.0 * 1.2)) && relaxed(8.0, at(40.0 * 0.75)));
        assert!(relaxed(0.0, 0.0), "a sensor that shows nothing");
    }

    proptest! {
        #[test]
        fn rubber_within_its_tolerance_is_not(
            stiff in 0.88..1.12f64,
            load_gain in 0.985..1.015f64,
            tread_gain in 0.985..1.015f64,
        ) {
            prop_assert_eq!(pressed("prototype", stiff, load_gain, tread_gain), None);
        }
    }

    #[test]
    fn it_is_told_from_the_least_preload_on_and_after_its_ticks() {
        let rig = Rig::prototype();
        let law = TreadLaw::try_build(&rig).expect("in range");
        let told = |preload: Newtons| {
            let mut state = TreadState::default();
            law.begin(&mut state, preload);
            (1..2000).find(|_| law.step(&mut state, preload, Q16::ZERO, Q16::ZERO))
        };
        let least = Q16::from_num(LEAST_PART * rig.preload.cruise_n);
        assert_eq!(told(least - q16(10_000)), None);
        assert_eq!(told(q16(1_000_000)), None);
        // The first of the ticks that it must be off is that at which enough is forgotten.
        let ticks = u32::from(FORGETS + OFF_TICKS) - 1;
        assert_eq!(told(law.least), Some(ticks));
        assert_eq!(told(least + q16(10_000)), Some(ticks));
    }
}
