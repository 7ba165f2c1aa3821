//! Reports of a tick: findings of the estimate, contact stage, vibration, telemetry.

use super::{Controller, Event, State, Telemetry, TickContext};
use crate::control::schedule::Targets;
use crate::estimate::crossing::Contact;
use crate::estimate::{ContactStage, Findings};
use crate::model::Review;
use crate::numeric::part;
use crate::supervise::{Leg, Mode};
use crate::units::{Duty, MotorCommand, Q16, Ratio, q16};

use super::state::Approach;

/// Stiffness at rest over that of the rolling tread up to which the tread is as known: three
/// deviations of random rigs, 0.99 +- 0.012.
const RATIO_WITHIN: Ratio = q16(1_030_000);
/// By how much a crossing is stiffer than known, per ratio beyond that. Fitted to 160 rigs drawn
/// from the wide ranges: the stiffness that the first crossing shows grows with the power 2.6 of
/// the ratio, +- 24 %; too stiff a guess only costs time.
const SCALE_PER_RATIO: Q16 = q16(4_000_000);

impl Controller {
    pub(super) fn take_findings(
        &self,
        state: &mut State,
        tick: &mut TickContext<'_>,
        found: Findings,
    ) {
        found.limits.into_iter().for_each(|limit| tick.log(Event::Limit(limit)));
        if found.advanced {
            state.approach = Approach::default();
        }
        if let Some((open, plausible)) = found.closed {
            state.planning.closed = Some(open);
            state.planning.review = open.lift.map(|point| Review {
                direction: open.direction,
                speed: point.speed,
                preload: point.remembered,
                tan_arm: point.tan_arm,
                gap: point.gap,
                trusted: open.expected && plausible,
            });
        }
        // What a crossing has shown goes before what the tread shows ahead of it.
        let ratio = found.tread.filter(|_| state.planning.scale == Q16::ONE).unwrap_or(Q16::ONE);
        let stiffer = ratio > RATIO_WITHIN;
        if stiffer {
            state.planning.scale += (ratio - RATIO_WITHIN) * SCALE_PER_RATIO;
        }
        if found.replan || stiffer {
            self.ask(state, tick);
        }
        if let Some(fault) = found.fault {
            tick.fail(fault);
        }
    }

    /// Observes the arm's mode from the approach to a step until the step is passed. The observer
    /// starts again each time, so its earlier state does not matter.
    pub(super) fn follow_vibration(&self, state: &mut State, tick: &TickContext<'_>) {
        let awake = matches!(state.mode, Mode::Run(_, Leg::Approach | Leg::Crossing));
        let compression = tick.sensed.compression.value;
        self.vibration.track(&mut state.vibration, compression, awake, self.skipping);
    }

    pub(super) fn note_stage(&self, state: &mut State, tick: &mut TickContext<'_>) {
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

    pub(super) fn telemetry(
        &self,
        state: &State,
        tick: &TickContext<'_>,
        targets: &Targets,
    ) -> Telemetry {
        let duty = |command: MotorCommand| if command.enable { command.duty } else { Duty::ZERO };
        let crossing = matches!(state.mode, Mode::Run(_, Leg::Crossing | Leg::Approach));
        let plan = state.planning.plan.as_ref();
        let planned = plan.map_or(self.friction, |plan| plan.slip_margin);
        let rolling = self.friction - part(self.load, tick.pressed());
        let sensed = tick.sensed;
        Telemetry {
            at: tick.now,
            mode: state.mode,
            stage: state.stage,
            position: state.estimate.position,
            speed: sensed.speed.value,
            speed_ref: state.signed_speed(),
            preload: sensed.preload.value,
            preload_ref: targets.preload,
            compression: sensed.compression.value,
            radius: sensed.radius.value,
            level: state.estimate.level,
            gap_predicted: plan.map_or(Q16::ZERO, |plan| plan.gap),
            slip_margin: if crossing { planned.min(rolling) } else { rolling },
            vibration: state.vibration.peak(),
            distance: self.estimator.distance(&state.estimate).unwrap_or(Q16::MAX),
            drive: duty(tick.output.drive),
            pretightener: duty(tick.output.preload),
        }
    }
}
