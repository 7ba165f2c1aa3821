//! Reports of a tick: findings of the estimate, contact stage, vibration, telemetry.

use super::{Controller, Event, Pass, State, Telemetry};
use crate::control::schedule::Targets;
use crate::estimate::crossing::Contact;
use crate::estimate::{ContactStage, Findings, PositionConfidence, Shown};
use crate::fault::{Fault, Limit};
use crate::model::planner::{KNOWN_SCALE, SHOWN_DEVIATION};
use crate::model::{Learned, Review};
use crate::numeric::part;
use crate::supervise::{Leg, Mode};
use crate::units::{Q16, q16};

use super::state::Approach;

impl Controller {
    pub(super) fn take_findings(&self, state: &mut State, tick: &mut Pass<'_>, found: Findings) {
        found.limits.into_iter().for_each(|limit| tick.log(Event::Limit(limit)));
        if let Some(slip) = found.slip {
            tick.log(Event::Limit(Limit::WheelSlipped));
            tick.log(Event::Slip(slip));
        }
        if found.advanced {
            let sped_up = state.approach.begun.released && state.estimate.lifting().is_some();
            state.approach = Approach { sped_up, ..Approach::default() };
        }
        if let Some((open, plausible)) = found.closed {
            state.planning.closed = Some(open);
            state.planning.review = open.lift.map(|point| Review {
                direction: open.direction,
                history: point.history,
                distance: point.distance,
                held: point.held,
                felt_at: open.felt.map(|_| open.felt_at),
                tan_arm: point.tan_arm,
                gap_as_table: point.gap_as_table,
                gap: open.gap,
                trusted: open.expected && plausible,
                slipped: open.slip.lost > Q16::ZERO,
            });
        }
        let shown =
            found.shown.is_some_and(|shown| self.learn(&mut state.planning.learned, &shown, tick));
        if found.replan || shown {
            self.ask(state, tick);
        }
        if let Some(fault) = found.fault {
            tick.fail(fault);
        }
    }

    /// What the tread and the drive have shown before the first crossing; whether it is other than
    /// known. What a crossing has shown of the tread goes before it. A load that the tread does not
    /// bear is none: duty and speed of the drive do not match.
    fn learn(&self, learned: &mut Learned, shown: &Shown, tick: &mut Pass<'_>) -> bool {
        let before = learned.extra_load;
        if let Some(load) = shown.load {
            // Within two sigmas of it, the known load is the better one.
            let extra = load - self.load;
            let within = extra.abs() < shown.load_sigma + shown.load_sigma;
            learned.extra_load = if within { Q16::ZERO } else { extra };
        }
        let reloaded = learned.extra_load - before;
        let thrust = reloaded * self.arm_coupling * tick.sensed.tan_arm;
        if !shown.bears(thrust) {
            tick.fail(Fault::DutyMismatch);
        }
        let stiffness = shown.stiffness(thrust);
        let stiffer = learned.scale == Q16::ONE && stiffness > Q16::ONE;
        if stiffer {
            learned.scale = stiffness;
            if stiffness > KNOWN_SCALE {
                learned.deviation = SHOWN_DEVIATION;
                learned.unknown = true;
            }
        }
        reloaded != Q16::ZERO || stiffer
    }

    /// Observes the arm's mode from the approach to a step until the step is passed. The observer
    /// starts again each time, so its earlier state does not matter.
    pub(super) fn follow_vibration(&self, state: &mut State, tick: &Pass<'_>) {
        let awake = matches!(state.mode, Mode::Run(_, Leg::Approach | Leg::Crossing));
        let compression = tick.sensed.compression.value;
        self.vibration.track(&mut state.vibration, compression, awake, self.skipping);
    }

    pub(super) fn note_stage(&self, state: &mut State, tick: &mut Pass<'_>) {
        let stage = match (state.mode, state.estimate.contact()) {
            (Mode::Run(..) | Mode::Stopping(_), Contact::Both) => ContactStage::StaticFriction,
            (Mode::Run(..) | Mode::Stopping(_), Contact::Corner) => ContactStage::Sliding,
            (Mode::Run(..) | Mode::Stopping(_), Contact::Leaving) => ContactStage::Rolling,
            (Mode::Run(..) | Mode::Stopping(_), Contact::Wall) => ContactStage::Continuous,
            (Mode::Preload(_), _) => ContactStage::Preloaded,
            _ if tick.sensed.preload_filtered > q16(1_000_000) => state.stage,
            _ => ContactStage::Initial,
        };
        if stage != state.stage {
            state.stage = stage;
            tick.log(Event::Stage(stage));
        }
    }

    pub(super) fn telemetry(&self, state: &State, tick: &Pass<'_>, targets: &Targets) -> Telemetry {
        let crossing = matches!(state.mode, Mode::Run(_, Leg::Crossing | Leg::Approach));
        let plan = state.planning.plan.as_ref();
        let friction = self.friction.min(state.planning.learned.slips);
        let planned = plan.map_or(friction, |plan| plan.slip_margin);
        let rolling = friction - part(self.load_of(state), tick.pressed());
        let is_sure = state.estimate.confidence() == PositionConfidence::Sure;
        Telemetry {
            at: tick.now,
            mode: state.mode,
            stage: state.stage,
            position: state.estimate.position,
            position_sigma: if is_sure { self.estimator.sigma(&state.estimate) } else { Q16::MAX },
            speed: tick.sensed.speed.value,
            speed_ref: state.outwards(state.profile.speed()),
            preload: tick.sensed.preload.value,
            preload_ref: targets.preload,
            compression: tick.sensed.compression.value,
            radius: tick.sensed.radius.value,
            level: state.estimate.level,
            gap_predicted: plan.map_or(Q16::ZERO, |plan| plan.gap),
            slip_margin: if crossing { planned.min(rolling) } else { rolling },
            vibration: state.vibration.peak(),
            distance: self.estimator.distance(&state.estimate).unwrap_or(Q16::MAX),
            drive: tick.output.drive.duty,
            pretightener: tick.output.preload.duty,
        }
    }
}
