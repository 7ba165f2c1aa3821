//! The schedule: speed and preload that hold the gap at the next step.

#![deny(clippy::float_arithmetic)]

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;

use super::guard::Guard;
use super::plan::{Outcome, Plan, PlanRequest, Review, Strategy};
use super::reduced::{Point, ReducedModel, Scale};
use super::timing::Timing;
use crate::fault::Limit;
use crate::rig::MAX_STEPS;
use crate::units::{Direction, Millimetres, MillimetresPerSecond, Newtons, Ratio, Seconds, q16};

/// Largest correction of the stiffness scale by one crossing.
const LARGEST_CORRECTION: Ratio = q16(100_000);

/// Relative difference of an observed stiffness above which it is rejected.
const OUTLIER: Ratio = q16(350_000);
/// Relative difference of an observed stiffness above which it is reported. Rubber that is off
/// by three deviations makes 0.12 at the first crossing; the rest is the measurement, where a
/// stiff guess costs most. Two of 1,500 random rigs exceed 0.20.
const STRANGE: Ratio = q16(270_000);

/// Sixteenths of the gap taken off until the slip margin holds, at most.
const SLIP_TRIES: usize = 8;

/// The model side of the schedule; runs outside the tick. The default is a place to read one
/// into.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Planner {
    model: ReducedModel,
    guard: Guard,
    timing: Timing,
    strategy: Strategy,
    /// Radial force that the arm's inclination adds at each step, N.
    arm_thrust: heapless::Vec<Newtons, MAX_STEPS>,
    /// Coupling times load: arm thrust per tangent of the arm angle, N.
    coupling: Newtons,
    /// Gap to hold, deploy and retract, mm.
    gap_ref: [Millimetres; 2],
    /// Gap aimed at, a reserve below it, mm.
    target: [Millimetres; 2],
    cruise_speed: MillimetresPerSecond,
    least_speed: MillimetresPerSecond,
    safe_speed: MillimetresPerSecond,
    /// Speed at which the pre-tightener just follows the spring at lift-off, mm/s.
    climb_speed: MillimetresPerSecond,
    /// Crossing speed set by a comparison, mm/s.
    prescribed_speed: Option<MillimetresPerSecond>,
    /// Whether the crossing speed also applies between the steps.
    uniform: bool,
    cruise_preload: Newtons,
    /// Preload that the plan may ask for, N.
    most_preload: Newtons,
    /// Friction of tread on wall as far as known.
    friction: Ratio,
    /// The part of it that may be used.
    usable: Ratio,
    scale_range: (Ratio, Ratio),
    gain: Ratio,
}

impl Planner {
    /// Answers a request.
    pub fn plan(&self, request: &PlanRequest) -> Plan {
        let outcome = request.review.map(|review| self.review(&review, request.scale));
        let scale = outcome.map_or(request.scale, |o| o.scale);
        let (cruise_speed, moved) = self.guard.below(self.cruise_speed);
        let limits = [moved.then_some(Limit::ResonanceAvoided), None, None];
        let mut plan = Plan {
            sequence: request.sequence,
            step: request.step,
            direction: request.direction,
            cruise_speed,
            cross_speed: cruise_speed,
            cruise_preload: self.between_steps(),
            cross_preload: self.between_steps(),
            gap: self.target_of(request.direction),
            slip_margin: self.usable,
            brake_way: Millimetres::ZERO,
            brake_time: Seconds::ZERO,
            brake_horizon: Millimetres::ZERO,
            // Without look-ahead the preload rises when the step is detected, never before.
            look_ahead: self.strategy != Strategy::Reactive,
            limits,
            outcome,
        };
        if request.step > 0 {
            self.crossing(request, scale, &mut plan);
        }
        if self.uniform {
            plan.cruise_speed = plan.cross_speed;
        }
        self.braking(&mut plan);
        plan
    }

    /// Gap that the schedule holds in this direction, mm.
    pub fn gap_ref(&self, direction: Direction) -> Millimetres {
        self.gap_ref[direction as usize]
    }

    /// Speed and preload at the step.
    fn crossing(&self, request: &PlanRequest, scale: Ratio, plan: &mut Plan) {
        let scale = Scale::new(scale);
        let at = Point { direction: request.direction, speed: self.least_speed, scale };
        let arm_thrust = self.arm_thrust_at(request.step);
        let most = match self.strategy {
            Strategy::Scheduled | Strategy::Limit => self.most_preload,
            Strategy::Constant | Strategy::Reactive => self.cruise_preload,
        };
        let gap = self.gripping_gap(&at, request.direction);
        let ceiling = self.prescribed_speed.unwrap_or(plan.cruise_speed);
        let floor = self.least_speed.min(plan.cruise_speed);
        // No faster than the pre-tightener can follow the spring over the corner.
        let ceiling = ceiling.min(self.climb_speed.max(floor));
        let found = self.model.speed(&at, gap, most + arm_thrust, floor.min(ceiling), ceiling);
        let speed = self.prescribed_speed.unwrap_or(found);
        let (speed, moved) = self.guard.below(speed.max(floor));
        if moved {
            add(&mut plan.limits, Limit::ResonanceAvoided);
        }
        // A band that reaches below the floor is entered: too slow would be worse.
        let speed = speed.max(floor);
        let at = Point { speed, ..at };
        let wanted = self.model.force(&at, gap) - arm_thrust;
        plan.cross_speed = speed;
        if wanted > most && speed <= floor {
            add(&mut plan.limits, Limit::SpeedFloor);
        } else if wanted >= most * q16(980_000) && speed < self.safe_speed {
            add(&mut plan.limits, Limit::PreloadLimited);
        }
        plan.cross_preload = match self.strategy {
            Strategy::Scheduled => wanted.clamp(self.cruise_preload, most),
            Strategy::Constant => self.cruise_preload,
            Strategy::Limit => self.most_preload,
            Strategy::Reactive => wanted.clamp(self.cruise_preload, self.most_preload),
        };
        let carried = plan.cross_preload.min(most) + arm_thrust;
        let crossing = self.model.crossing(&at, carried);
        plan.gap = crossing.gap;
        let margin = crossing.slip_margin;
        plan.slip_margin = margin;
        if margin < self.friction - self.usable {
            add(&mut plan.limits, Limit::SlipMarginLow);
        }
    }

    /// The target gap, or the largest below it that leaves the slip margin.
    fn gripping_gap(&self, at: &Point, direction: Direction) -> Millimetres {
        let mut gap = self.target_of(direction);
        for _ in 0..SLIP_TRIES {
            if self.model.utilisation(at, gap) <= self.usable {
                break;
            }
            gap -= gap * q16(62_500);
        }
        gap
    }

    /// Distance and time of braking before the step.
    fn braking(&self, plan: &mut Plan) {
        plan.brake_horizon = self.timing.longest_brake_way(plan.cruise_speed.max(plan.cross_speed));
        plan.brake_way = self.timing.brake_way(plan.cruise_speed, plan.cross_speed);
        plan.brake_time = self.timing.speed_change(plan.cruise_speed - plan.cross_speed);
    }

    /// Compares a crossing with the model and corrects the stiffness, bounded.
    fn review(&self, review: &Review, scale: Ratio) -> Outcome {
        let at =
            Point { direction: review.direction, speed: review.speed, scale: Scale::new(scale) };
        let force = review.preload + self.coupling * review.tan_arm;
        let crossing = self.model.crossing(&at, force);
        let unchanged = |strange| Outcome {
            gap_predicted: crossing.gap,
            slip_margin: crossing.slip_margin,
            scale,
            bounded: false,
            strange,
        };
        if !review.trusted {
            return unchanged(false);
        }
        let observed = self.model.observed_scale(&at, review.gap, force);
        let off = (observed - scale).abs();
        let strange = off > STRANGE * scale;
        // Further off than any tread or tolerance, the measurement is wrong.
        if off > OUTLIER * scale {
            return unchanged(strange);
        }
        let step = ((observed - scale) * self.gain).clamp(-LARGEST_CORRECTION, LARGEST_CORRECTION);
        let (low, high) = self.scale_range;
        let wanted = scale + step;
        let scale = wanted.clamp(low, high);
        Outcome { scale, bounded: scale != wanted, ..unchanged(strange) }
    }

    fn arm_thrust_at(&self, step: u8) -> Newtons {
        let index = usize::from(step).saturating_sub(1);
        self.arm_thrust.get(index).copied().unwrap_or(Newtons::ZERO)
    }

    fn between_steps(&self) -> Newtons {
        match self.strategy {
            Strategy::Limit => self.most_preload,
            _ => self.cruise_preload,
        }
    }

    fn target_of(&self, direction: Direction) -> Millimetres {
        self.target[direction as usize]
    }
}

/// Adds a limit, once; a plan holds three.
fn add(limits: &mut [Option<Limit>; 3], limit: Limit) {
    if !limits.contains(&Some(limit))
        && let Some(free) = limits.iter_mut().find(|slot| slot.is_none())
    {
        *free = Some(limit);
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the gaps are written in mm")]
mod tests {
    use super::*;
    use crate::rig::Rig;
    use crate::units::q16;

    /// What the planner makes of a crossing whose gap is this much wider than it predicts, mm.
    fn reviewed(wider: f64, trusted: bool) -> Outcome {
        let planner = Planner::try_build(&Rig::prototype()).expect("a sound rig");
        let scale = q16(1_000_000);
        let mut review = Review {
            direction: Direction::Deploy,
            speed: q16(8_000_000),
            preload: q16(47_000_000),
            tan_arm: q16(1_000_000),
            gap: Millimetres::from_num(2.5),
            trusted: false,
        };
        let predicted = planner.review(&review, scale).gap_predicted;
        review.gap = predicted + Millimetres::from_num(wider);
        review.trusted = trusted;
        planner.review(&review, scale)
    }

    #[test]
    fn a_gap_that_no_tread_of_the_rig_makes_is_strange_and_moves_little() {
        for wider in [0.0, 0.05, -0.05] {
            assert!(!reviewed(wider, true).strange, "{wider}");
        }
        for wider in [0.5, -0.4] {
            let outcome = reviewed(wider, true);
            let moved = (outcome.scale - q16(1_000_000)).abs();
            assert!(outcome.strange && moved <= LARGEST_CORRECTION, "{wider}: {outcome:?}");
            // Of a crossing that is not trusted nothing is concluded.
            assert!(!reviewed(wider, false).strange);
        }
    }

    #[test]
    fn a_gap_beyond_every_tread_corrects_nothing() {
        for wider in [1.0, 1.5, -1.0] {
            let outcome = reviewed(wider, true);
            assert_eq!(outcome.scale, q16(1_000_000), "{wider}: {outcome:?}");
            assert!(outcome.strange && !outcome.bounded);
        }
    }

    #[test]
    fn a_gap_that_the_friction_cannot_hold_is_made_smaller_until_it_can() {
        let mut smaller = 0;
        for mu in [0.5, 0.6, 0.7, 0.8, 0.9, 1.1] {
            let mut rig = Rig::prototype();
            rig.plant.mu = mu;
            let Ok(planner) = Planner::try_build(&rig) else { continue };
            for direction in Direction::ALL {
                let scale = Scale::NOMINAL;
                let at = Point { direction, speed: planner.least_speed, scale };
                let (target, gap) =
                    (planner.target_of(direction), planner.gripping_gap(&at, direction));
                let grips = |gap| planner.model.utilisation(&at, gap) <= planner.usable;
                if grips(target) {
                    assert_eq!(gap, target, "{mu}");
                    continue;
                }
                smaller += 1;
                // By sixteenths, eight times at most.
                let part = gap.to_num::<f64>() / target.to_num::<f64>();
                assert!((0.59..0.94).contains(&part), "{mu} {part}");
                assert!(grips(gap) || part < 0.6, "{mu} {gap}");
            }
        }
        assert!(smaller > 0);
    }

    #[test]
    fn a_crossing_slowed_by_its_preload_is_reported() {
        let (mut limited, mut free) = (0, 0);
        for gap_mm in [0.0, 1.5, 1.75, 2.0, 2.25, 2.5] {
            for (planner, plan) in plans(|rig| rig.control.gap_ref_mm = gap_mm) {
                let reported = plan.limits.contains(&Some(Limit::PreloadLimited));
                let floored = plan.limits.contains(&Some(Limit::SpeedFloor));
                let at_limit = plan.cross_preload >= planner.most_preload * q16(980_000);
                let slow = plan.cross_speed < planner.safe_speed;
                assert_eq!(reported, at_limit && slow && !floored, "{gap_mm} {plan:?}");
                limited += u32::from(reported);
                free += u32::from(!reported && !floored);
            }
        }
        assert!(limited > 0 && free > 0, "{limited} {free}");
    }

    /// Plans of a rig that is changed like this, in both directions, for treads around the nominal.
    fn plans(change: impl Fn(&mut Rig)) -> Vec<(Planner, Plan)> {
        let mut rig = Rig::prototype();
        change(&mut rig);
        let Ok(planner) = Planner::try_build(&rig) else { return Vec::new() };
        let cases = [0.8, 1.0, 1.25]
            .into_iter()
            .flat_map(|s| Direction::ALL.map(|direction| (s, direction)));
        cases
            .map(|(scale, direction)| {
                let scale = Ratio::from_num(scale);
                let request = PlanRequest { sequence: 1, direction, step: 2, scale, review: None };
                (planner.clone(), planner.plan(&request))
            })
            .collect()
    }

    #[test]
    fn a_crossing_that_no_speed_makes_narrow_enough_is_reported() {
        let (mut floored, mut free) = (0, 0);
        for gap_mm in [0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5] {
            for (planner, plan) in plans(|rig| rig.control.gap_ref_mm = gap_mm) {
                let reported = plan.limits.contains(&Some(Limit::SpeedFloor));
                let slowest = plan.cross_speed <= planner.least_speed;
                let hardest = plan.cross_preload == planner.most_preload;
                let wide = plan.gap > planner.target_of(plan.direction);
                assert_eq!(reported, slowest && hardest && wide, "{gap_mm} {plan:?}");
                floored += u32::from(reported);
                free += u32::from(!reported);
            }
        }
        assert!(floored > 0 && free > 0, "{floored} {free}");
    }

    #[test]
    fn a_crossing_that_leaves_too_little_friction_is_reported() {
        let (mut slips, mut grips) = (0, 0);
        for mu in [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1] {
            for (planner, plan) in plans(|rig| rig.plant.mu = mu) {
                let reported = plan.limits.contains(&Some(Limit::SlipMarginLow));
                let wanted = planner.friction - planner.usable;
                assert_eq!(reported, plan.slip_margin < wanted, "{mu} {plan:?}");
                // Reported or not, the margin is what the friction leaves.
                let margin = plan.slip_margin.to_num::<f64>();
                assert!(
                    margin < mu && (wanted.to_num::<f64>() - 0.1).abs() < 1e-4,
                    "{mu} {margin}"
                );
                slips += u32::from(reported);
                grips += u32::from(!reported);
            }
        }
        assert!(slips > 0 && grips > 0, "{slips} {grips}");
    }
}
