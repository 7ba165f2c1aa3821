//! Limit cycles and drift: under constant inputs every filter, observer and loop comes to
//! stand to the last bit within a stated time, from the far end of its range as well.

use interstage::control::preload_loop::{PreloadLoop, PreloadLoopState};
use interstage::control::profile::{Profile, ProfileState};
use interstage::control::speed_loop::{SpeedLoop, SpeedLoopState};
use interstage::estimate::vibration::{VibrationObserver, VibrationState};
use interstage::numeric::{LowPass, LowPassState};
use interstage::rig::Rig;
use interstage::sense::raw::{
    AdcCode, AngleFrame, BridgeCode, BridgeCodes, EncoderCount, Sample, SensorFrame,
};
use interstage::sense::{Senses, SensesState};
use interstage::tick::{Controller, Input, State};
use interstage::units::Q16;
use serde::Serialize;

/// Ticks for which an output must stand.
const STANDS: u32 = 3000;

/// How a stage comes to rest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// Stage and input.
    pub name: String,
    /// Ticks after which its output changed no more.
    pub settled_after: u32,
    /// Ticks within which it has to.
    pub within: u32,
    /// Whether it does.
    pub holds: bool,
}

/// Runs `step` until `within`, and as long again as an output must stand.
fn settles<T: PartialEq>(
    name: impl Into<String>,
    within: u32,
    mut step: impl FnMut(u32) -> T,
) -> Line {
    let (mut last, mut changed) = (None, 0);
    for tick in 0..within + STANDS {
        let output = Some(step(tick));
        if output != last {
            (last, changed) = (output, tick);
        }
    }
    Line { name: name.into(), settled_after: changed, within, holds: changed <= within }
}

/// All stages with state.
///
/// # Panics
/// If the presets cannot be built.
#[must_use]
pub fn run() -> Vec<Line> {
    let mut lines = Vec::new();
    for (preset, rig) in [("prototype", Rig::prototype()), ("fe", Rig::fe())] {
        loops(&mut lines, preset, &rig);
        sensed(&mut lines, preset, &rig);
    }
    lines.extend([0.001, 0.005, 0.06, 1.0, 20.0].into_iter().flat_map(low_pass));
    lines
}

/// 49 bits of error, 28 below the point: `tau ln 2^45` and the ticks for the last one.
fn low_pass(tau_s: f64) -> Vec<Line> {
    let filter = LowPass::build(tau_s);
    let within = (35.0 * tau_s * 1e3) as u32 + 10;
    let ends = [(Q16::MIN, Q16::MAX), (Q16::MAX, Q16::ZERO), (Q16::ZERO, Q16::DELTA)];
    let line = |(from, to): (Q16, Q16)| {
        let mut state = LowPassState::at(from);
        let name = format!("low-pass of {tau_s} s, from {from} to {to}");
        settles(name, within, |_| filter.step(&mut state, to))
    };
    ends.into_iter().map(line).collect()
}

fn loops(lines: &mut Vec<Line>, preset: &str, rig: &Rig) {
    let speed_loop = SpeedLoop::try_build(rig).expect("a preset");
    let preload_loop = PreloadLoop::try_build(rig).expect("a preset");
    let profile = Profile::try_build(rig).expect("a preset");
    let vibration = VibrationObserver::try_build(rig).expect("a preset");
    let q = Q16::from_num::<f64>;
    for (wanted, measured) in [(5.0, 5.0), (30.0, 0.0), (-8.0, 30.0), (32_767.0, -32_768.0)] {
        let mut state = SpeedLoopState::default();
        // The integral runs to its limit, half of the duty, at the slowest gain.
        let name = format!("{preset}: speed loop, {measured} mm/s for {wanted}");
        lines.push(settles(name, 60_000, |_| {
            speed_loop.step(&mut state, q(wanted), q(measured), q(7.0))
        }));
    }
    for (target, measured) in [(40.0, 40.0), (40.0, 0.0), (0.0, 200.0), (32_767.0, -32_768.0)] {
        let mut state = PreloadLoopState::default();
        let name = format!("{preset}: preload loop, {measured} N for {target}");
        // A reference that runs at the slew to any target, then dead time and lag.
        let within = if target > 1000.0 { 3_000_000 } else { 20_000 };
        lines.push(settles(name, within, |_| {
            preload_loop.step(&mut state, q(target), q(measured), Q16::ZERO)
        }));
    }
    for target in [0.0, 0.013, 3.0, 30.0] {
        let mut state = ProfileState::default();
        for _ in 0..200 {
            profile.step(&mut state, q(17.0));
        }
        let name = format!("{preset}: profile to {target} mm/s");
        lines.push(settles(name, 2000, |_| {
            profile.step(&mut state, q(target));
            state.speed()
        }));
    }
    let mut state = VibrationState::default();
    for tick in 0..500_u32 {
        vibration.step(&mut state, if tick % 3 == 0 { Q16::MAX } else { Q16::ZERO });
    }
    lines.push(settles(format!("{preset}: vibration observer at rest"), 600, |_| {
        vibration.step(&mut state, q(0.35))
    }));
}

fn sensed(lines: &mut Vec<Line>, preset: &str, rig: &Rig) {
    let frame = |at, code: (u16, u16, u16, u16)| SensorFrame {
        wheel: Some(Sample { code: EncoderCount::new(code.0), at }),
        load_cell: Some(Sample { code: AdcCode::new(code.1), at }),
        tread: Some(Sample { code: AdcCode::new(code.2), at }),
        arm: Some(Sample { code: AngleFrame::new(code.3 | parity(code.3)), at }),
        bridges: Some(BridgeCodes { drive: BridgeCode::of(0), pretightener: BridgeCode::of(0) }),
    };
    let senses = Senses::try_build(rig).expect("a preset");
    // Rolling and loaded, then everything stands.
    let mut state = SensesState::default();
    for tick in 0..2000_u32 {
        let codes = ((tick / 3) as u16, 20_000 + tick as u16, 9000, 4111 - (tick / 20) as u16);
        senses.step(&mut state, tick, &frame(tick, codes), Q16::ZERO);
    }
    let still = (666, 22_000, 9000, 4011);
    lines.push(settles(format!("{preset}: sensors of a wheel that stops"), 4000, |tick| {
        let now = 2000 + tick;
        let sensed = senses.step(&mut state, now, &frame(now, still), Q16::ZERO);
        let analog = (sensed.preload.value, sensed.preload_filtered, sensed.compression_filtered);
        (
            sensed.travel,
            sensed.speed.value,
            analog,
            sensed.radius.value,
            sensed.tan_arm,
            sensed.level,
        )
    }));
    // The whole tick, idle.
    let controller = Controller::try_build(rig).expect("a preset");
    let mut state = State::default();
    lines.push(settles(format!("{preset}: controller at rest"), 4000, |now| {
        let sensors = frame(now, (7, 3277, 3277, 4111));
        let output = controller.step(&mut state, &Input { now, sensors, ..Input::default() });
        let mut telemetry = output.telemetry;
        telemetry.at = 0;
        (output.drive, output.preload, telemetry)
    }));
}

fn parity(angle: u16) -> u16 {
    ((angle.count_ones() & 1) as u16) << 15
}

/// What is left of a tone after very many ticks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drift {
    /// Ticks run.
    pub ticks: u64,
    /// Amplitude shown after the first thousand ticks, largest, um.
    pub first_um: f64,
    /// The same in the last thousand ticks, um.
    pub last_um: f64,
    /// Ticks of rest after which nothing was left; none if something stays.
    pub forgotten_after: Option<u32>,
    /// Whether nothing drifted and nothing stayed.
    pub holds: bool,
}

/// Shakes the vibration observer with a periodic tone for `ticks`, then lets it rest.
///
/// # Panics
/// If the prototype cannot be built.
#[must_use]
pub fn drift(ticks: u64) -> Drift {
    let observer = VibrationObserver::try_build(&Rig::prototype()).expect("a preset");
    // 276 Hz at 1 kHz comes again after 250 ticks.
    let tone: Vec<Q16> = (0..250)
        .map(|n| {
            let phase = std::f64::consts::TAU * 0.276 * f64::from(n);
            Q16::from_num(0.35 + 0.1 * phase.sin())
        })
        .collect();
    let mut state = VibrationState::default();
    observer.reset(&mut state, tone[0]);
    let period = |state: &mut VibrationState| {
        tone.iter().map(|&x| observer.step(state, x)).fold(Q16::ZERO, Ord::max)
    };
    let um = |x: Q16| x.to_num::<f64>() * 1e3;
    let periods = (ticks / 250).max(8);
    let mut first = Q16::ZERO;
    let mut last = Q16::ZERO;
    for index in 0..periods {
        let peak = period(&mut state);
        if (4..8).contains(&index) {
            first = first.max(peak);
        }
        if index + 4 >= periods {
            last = last.max(peak);
        }
    }
    let rest = tone[249];
    let still = VibrationState::default();
    let mut zero = still;
    observer.reset(&mut zero, rest);
    let forgotten_after = (0..2000).find(|_| {
        observer.step(&mut state, rest);
        state == zero
    });
    let holds = first == last && forgotten_after.is_some_and(|ticks| ticks < 1000);
    Drift { ticks: periods * 250, first_um: um(first), last_um: um(last), forgotten_after, holds }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_inputs_give_constant_outputs() {
        for line in run() {
            assert!(line.holds, "{line:?}");
        }
    }

    #[test]
    fn a_stage_that_rings_is_told() {
        assert!(!settles("rings", 100, |tick| tick % 2).holds);
        assert_eq!(settles("settles", 100, |tick| tick.min(60)).settled_after, 60);
    }

    #[test]
    fn a_million_ticks_do_not_drift() {
        let drift = drift(1_000_000);
        assert!(drift.holds, "{drift:?}");
    }
}
