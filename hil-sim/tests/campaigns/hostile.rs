//! The controller under hostile inputs: rigs at the ends of every parameter; least, largest,
//! alternating and random codes; stale and wrong times; plans that no planner gives. Nothing
//! panics, and no bridge is on in a mode that forbids it.
//!
//! Overflow is checked in this build: a sum that wraps by mistake panics.

use super::at_end;
use crate::common::RIGS;
use crate::common::echo::Echo;
use hil_sim::plant::sensors::with_parity;
use hil_sim::scenario::{Scenario, ScenarioError};
use interstage::model::history::History;
use interstage::model::{Learned, Plan, PlanRequest, Planner, Review};
use interstage::rig::Rig;
use interstage::sense::raw::{BridgeCode, BridgeCodes, SensorFrame, SensorId};
use interstage::supervise::{Command, Mode};
use interstage::tick::{Controller, Input, Output, State};
use interstage::units::{Direction, Q16, Tick};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Inputs of the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Feed {
    Least,
    Largest,
    Alternating,
    /// Valid codes of a rig that jumps.
    Jumping,
    Garbage,
    /// Plausible codes at rest, random plans and commands.
    Plans,
}

const FEEDS: [Feed; 6] = {
    use Feed::{Alternating, Garbage, Jumping, Largest, Least, Plans};
    [Least, Largest, Alternating, Jumping, Garbage, Plans]
};

/// Sections of the keys that the controller is built from.
const SECTIONS: [&str; 7] = ["rig", "tread", "plant", "preload", "drive", "sense", "control"];

#[test]
fn nothing_panics_or_switches_a_bridge_on_whatever_comes_in() {
    let (ticks, requests) = if hil_sim::testing::long() { (20_000, 40) } else { (2000, 12) };
    let rigs = corner_rigs();
    assert!(rigs.len() > 150, "{}", rigs.len());
    rigs.par_iter().for_each(|(name, rig)| {
        let controller = Controller::try_build(rig).unwrap_or_else(|why| panic!("{name}: {why}"));
        let planner = Planner::try_build(rig).unwrap_or_else(|why| panic!("{name}: {why}"));
        for feed in FEEDS {
            let broken = fed(&controller, &planner, feed, ticks, 1);
            assert_eq!(broken, None, "{name}, {feed:?}");
        }
        ask(&planner, requests, 1);
    });
}

fn fed(
    controller: &Controller,
    planner: &Planner,
    feed: Feed,
    ticks: u32,
    seed: u64,
) -> Option<String> {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ feed as u64);
    let mut state = State::default();
    let mut answer: Option<Plan> = None;
    let mut echo = Echo::default();
    let mut bridges = Some(BridgeCodes::default());
    // Across the wrap of the clock.
    let start = u32::MAX - ticks / 3;
    for tick in 0..ticks {
        let now = start.wrapping_add(tick);
        let input = Input {
            now,
            sensors: frame(feed, tick, now, bridges, &mut random),
            command: tick.is_multiple_of(97).then(|| {
                let all = [Command::Start, Command::Reset, Command::Retract, Command::Stop];
                all[random.random_range(0..4)]
            }),
            service: None,
            plan: answer.take(),
            overrun: feed == Feed::Garbage && random.random_range(0..50) == 0,
            emergency_stop: feed == Feed::Garbage && random.random_range(0..400) == 0,
        };
        let output = controller.step(&mut state, &input);
        // Sound bridges: with others the controller would hold before it meets the rest.
        let sound = echo.read(&output);
        bridges = match feed {
            Feed::Garbage if random.random_range(0..50) == 0 => None,
            Feed::Garbage if random.random_range(0..20) == 0 => {
                let any = BridgeCode::new(random.random());
                Some(BridgeCodes { drive: any, ..sound })
            }
            _ => Some(sound),
        };
        answer = output.request.as_ref().map(|request| match feed {
            Feed::Plans => wild(request, planner, &mut random),
            _ => planner.plan(request),
        });
        if let Some(why) = unsafe_output(&output) {
            return Some(format!("{why} in tick {tick}"));
        }
    }
    None
}

/// Outputs that no input may cause.
fn unsafe_output(output: &Output) -> Option<String> {
    let mode = output.telemetry.mode;
    let drives = matches!(mode, Mode::Run(..) | Mode::Stopping(_));
    let presses = drives || matches!(mode, Mode::Preload(_));
    if output.drive.enable && !drives {
        return Some(format!("the drive is on in {mode:?}"));
    }
    if output.preload.enable && !presses {
        return Some(format!("the pre-tightener is on in {mode:?}"));
    }
    for command in [output.drive, output.preload] {
        if command.duty.to_bits() == i16::MIN {
            return Some("a duty beyond full".to_owned());
        }
    }
    (output.telemetry.vibration < Q16::ZERO).then(|| "a negative amplitude".to_owned())
}

fn frame(
    feed: Feed,
    tick: u32,
    now: Tick,
    bridges: Option<BridgeCodes>,
    random: &mut ChaCha8Rng,
) -> SensorFrame {
    let made = |wheel: u16, load: u16, tread: u16, arm: u16| SensorFrame {
        bridges,
        ..SensorFrame::taken(now, [wheel, load, tread, arm])
    };
    let even = |angle: u16| with_parity(angle & 0x3FFF);
    match feed {
        Feed::Least => made(0, 0, 0, 0),
        Feed::Largest => made(u16::MAX, u16::MAX, u16::MAX, u16::MAX),
        Feed::Alternating if tick.is_multiple_of(2) => made(0, 1311, 1311, even(0)),
        Feed::Alternating => made(0x8000, 64_224, 64_224, even(u16::MAX)),
        Feed::Jumping => made(
            (tick as u16).wrapping_mul(random.random_range(0..12)),
            random.random_range(1311..64_225),
            random.random_range(1311..64_225),
            even(random.random_range(2600..5000)),
        ),
        Feed::Garbage => {
            let mut frame =
                made(random.random(), random.random(), random.random(), random.random());
            let time = |at: &mut Tick, random: &mut ChaCha8Rng| match random.random_range(0..8) {
                0 => *at = random.random(),
                1 => *at = now.wrapping_sub(random.random_range(0..60)),
                2 => *at = now.wrapping_add(random.random_range(0..2000)),
                _ => {}
            };
            if let Some(sample) = &mut frame[SensorId::WheelEncoder] {
                time(&mut sample.at, random);
            }
            if let Some(sample) = &mut frame[SensorId::ArmAngle] {
                time(&mut sample.at, random);
            }
            if random.random_range(0..20) == 0 {
                frame[SensorId::PreloadSensor] = None;
            }
            frame
        }
        // At rest at the stow end, then rolling on with a load.
        Feed::Plans if tick < 3000 => made(0, 3277, 3277, even(4111)),
        Feed::Plans => {
            made((tick / 4) as u16, 12_500, 6000, even(4111 - (tick / 200) as u16 % 600))
        }
    }
}

fn wild(request: &PlanRequest, planner: &Planner, random: &mut ChaCha8Rng) -> Plan {
    let mut any = || match random.random_range(0..4) {
        0 => Q16::MIN,
        1 => Q16::MAX,
        2 => Q16::ZERO,
        _ => Q16::from_bits(random.random()),
    };
    let mut plan = planner.plan(request);
    for field in [
        &mut plan.cruise_speed,
        &mut plan.cross_speed,
        &mut plan.cruise_preload,
        &mut plan.cross_preload,
        &mut plan.gap,
        &mut plan.slip_margin,
        &mut plan.brake_distance,
        &mut plan.brake_time,
    ] {
        *field = any();
    }
    plan
}

/// Plans at random corners of what a request holds: none panics.
fn ask(planner: &Planner, requests: usize, seed: u64) {
    let ends = [Q16::MIN, Q16::from_num(-1), Q16::ZERO, Q16::DELTA, Q16::from_num(1), Q16::MAX];
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for index in 0..requests {
        let mut any = || ends[random.random_range(0..ends.len())];
        let direction = Direction::ALL[index % 2];
        let review = Review {
            direction,
            history: History::steady(index as u16, any()),
            distance: any(),
            held: any(),
            felt_at: Some(any()),
            tan_arm: any(),
            gap_as_table: any(),
            gap: any(),
            trusted: true,
            slipped: true,
        };
        let learned = Learned {
            scale: any(),
            extra_load: any(),
            grips: any(),
            slips: any(),
            ..Learned::default()
        };
        let request = PlanRequest {
            sequence: 1,
            direction,
            step: 2,
            learned,
            preload: Q16::from_num(33),
            distance: Q16::from_num(4),
            speed: Q16::ZERO,
            searching: false,
            review: Some(review),
            slipped: Some(any()),
        };
        let _ = planner.plan(&request);
    }
}

/// Both presets, and each with each number of the rig at each end of its range, or as near to it as
/// the others take.
fn corner_rigs() -> Vec<(String, Rig)> {
    let one = |preset: &&str| {
        let base = Scenario::named(preset).expect("a preset");
        let numbers = base.keys().into_iter().filter(|info| {
            let section = info.key.split('.').next().unwrap_or_default();
            SECTIONS.contains(&section)
        });
        let ends = numbers.filter_map(|info| Some((info.key, info.range?)));
        let corners = ends.flat_map(|(key, (least, most))| {
            [least, most].map(|end| {
                let (nearest, refusal) = at_end(&base, &key, end);
                // A refusal says what was expected instead.
                let says = |why: &ScenarioError| why.to_string().contains("expect");
                assert!(refusal.iter().all(says), "{refusal:?}");
                (format!("{preset}, {key} = {end}"), nearest.rig)
            })
        });
        let corners: Vec<_> = corners.collect();
        std::iter::once((preset.to_string(), base.rig)).chain(corners)
    };
    RIGS.iter().flat_map(one).collect()
}
