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

/// Relative difference of an observed stiffness beyond which it is not believed.
const OUTLIER: Ratio = q16(350_000);
/// Stiffness that a measured gap may ask for beyond the estimated one, part of that: what is
/// more is reported. Rubber that is off by three deviations makes 0.12 at the first crossing;
/// the rest is the measurement, of which a stiff guess is the dearest. Of 1,500 random rigs two
/// come beyond 0.20.
const STRANGE: Ratio = q16(270_000);

/// Sixteenths of the gap taken off until the slip margin holds, at most.
const SLIP_TRIES: usize = 8;

/// The model side of the schedule; runs outside the tick. The default is room to read one
/// into, and plans nothing.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Planner {
    model: ReducedModel,
    guard: Guard,
    timing: Timing,
    strategy: Strategy,
    /// Radial force per preload and wall level that the arm's wedge adds, N, by step.
    wedge: heapless::Vec<Newtons, MAX_STEPS>,
    /// Coupling times load: wedge per tangent of the arm angle, N.
    coupling: Newtons,
    /// Gap to hold, way out and way back, mm.
    gap_ref: [Millimetres; 2],
    /// Gap aimed at, a reserve below it, mm.
    target: [Millimetres; 2],
    cruise_speed: MillimetresPerSecond,
    least_speed: MillimetresPerSecond,
    safe_speed: MillimetresPerSecond,
    /// Speed at which the pre-tightener just follows the spring at lift-off, mm/s.
    climb_speed: MillimetresPerSecond,
    /// Crossing speed that a comparison prescribes, mm/s.
    prescribed_speed: Option<MillimetresPerSecond>,
    /// Whether the crossing speed holds between the steps as well.
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
        let mut limits = Limits::default();
        if moved {
            limits.add(Limit::ResonanceAvoided);
        }
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
            // Without look-ahead the preload rises when the step is felt, never before.
            look_ahead: self.strategy != Strategy::Reactive,
            limits: [None; 3],
            outcome,
        };
        if request.step > 0 {
            self.crossing(request, scale, &mut plan, &mut limits);
        }
        if self.uniform {
            plan.cruise_speed = plan.cross_speed;
        }
        self.ways(&mut plan);
        plan.limits = limits.0;
        plan
    }

    /// Gap that the schedule holds on this way, mm.
    pub fn gap_ref(&self, direction: Direction) -> Millimetres {
        self.gap_ref[way(direction)]
    }

    /// Speed and preload at the step.
    fn crossing(&self, request: &PlanRequest, scale: Ratio, plan: &mut Plan, limits: &mut Limits) {
        let scale = Scale::new(scale);
        let at = Point { direction: request.direction, speed: self.least_speed, scale };
        let wedge = self.wedge_at(request.step);
        let most = match self.strategy {
            Strategy::Scheduled | Strategy::Limit => self.most_preload,
            Strategy::Constant | Strategy::Reactive => self.cruise_preload,
        };
        let gap = self.gripping_gap(&at, request.direction);
        let ceiling = self.prescribed_speed.unwrap_or(plan.cruise_speed);
        let floor = self.least_speed.min(plan.cruise_speed);
        // No faster than the pre-tightener can follow the spring over the corner.
        let ceiling = ceiling.min(self.climb_speed.max(floor));
        let found = self.model.speed(&at, gap, most + wedge, floor.min(ceiling), ceiling);
        let speed = self.prescribed_speed.unwrap_or(found);
        let (speed, moved) = self.guard.below(speed.max(floor));
        if moved {
            limits.add(Limit::ResonanceAvoided);
        }
        // A band that reaches below the floor is crossed in: too slow is worse.
        let speed = speed.max(floor);
        let at = Point { speed, ..at };
        let wanted = self.model.force(&at, gap) - wedge;
        plan.cross_speed = speed;
        if wanted > most && speed <= floor {
            limits.add(Limit::SpeedFloor);
        } else if wanted >= most * q16(980_000) && speed < self.safe_speed {
            limits.add(Limit::PreloadLimited);
        }
        plan.cross_preload = match self.strategy {
            Strategy::Scheduled => wanted.clamp(self.cruise_preload, most),
            Strategy::Constant => self.cruise_preload,
            Strategy::Limit => self.most_preload,
            Strategy::Reactive => wanted.clamp(self.cruise_preload, self.most_preload),
        };
        let carried = plan.cross_preload.min(most) + wedge;
        let crossing = self.model.crossing(&at, carried);
        plan.gap = crossing.gap;
        let margin = crossing.slip_margin;
        plan.slip_margin = margin;
        if margin < self.friction - self.usable {
            limits.add(Limit::SlipMarginLow);
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

    /// How far and how long before the step braking must begin.
    fn ways(&self, plan: &mut Plan) {
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
        let (gap_predicted, slip_margin) = (crossing.gap, crossing.slip_margin);
        if !review.trusted {
            return Outcome { gap_predicted, slip_margin, scale, bounded: false, strange: false };
        }
        let observed = self.model.observed_scale(&at, review.gap, force);
        let off = (observed - scale).abs();
        let strange = off > STRANGE * scale;
        // Farther off than any tread or tolerance, it is the measurement that is wrong.
        if off > OUTLIER * scale {
            return Outcome { gap_predicted, slip_margin, scale, bounded: false, strange };
        }
        let step = ((observed - scale) * self.gain).clamp(-LARGEST_CORRECTION, LARGEST_CORRECTION);
        let (low, high) = self.scale_range;
        let wanted = scale + step;
        let scale = wanted.clamp(low, high);
        Outcome { gap_predicted, slip_margin, scale, bounded: scale != wanted, strange }
    }

    fn wedge_at(&self, step: u8) -> Newtons {
        let index = usize::from(step).saturating_sub(1);
        self.wedge.get(index).copied().unwrap_or(Newtons::ZERO)
    }

    fn between_steps(&self) -> Newtons {
        match self.strategy {
            Strategy::Limit => self.most_preload,
            _ => self.cruise_preload,
        }
    }

    fn target_of(&self, direction: Direction) -> Millimetres {
        self.target[way(direction)]
    }
}

/// Limits met, at most three.
#[derive(Default)]
struct Limits([Option<Limit>; 3]);

impl Limits {
    fn add(&mut self, limit: Limit) {
        if self.0.contains(&Some(limit)) {
            return;
        }
        if let Some(free) = self.0.iter_mut().find(|slot| slot.is_none()) {
            *free = Some(limit);
        }
    }
}

const fn way(direction: Direction) -> usize {
    match direction {
        Direction::Deploy => 0,
        Direction::Retract => 1,
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
    fn a_crossing_that_the_preload_slows_is_told() {
        let (mut limited, mut free) = (0, 0);
        for gap_mm in [0.0, 1.5, 1.75, 2.0, 2.25, 2.5] {
            let mut rig = Rig::prototype();
            rig.control.gap_ref_mm = gap_mm;
            let planner = Planner::try_build(&rig).expect("a sound rig");
            for (scale, direction) in [0.8, 1.0, 1.25]
                .into_iter()
                .flat_map(|scale| Direction::ALL.map(|way| (scale, way)))
            {
                let scale = Ratio::from_num(scale);
                let request = PlanRequest { sequence: 1, direction, step: 2, scale, review: None };
                let plan = planner.plan(&request);
                let told = plan.limits.contains(&Some(Limit::PreloadLimited));
                let floored = plan.limits.contains(&Some(Limit::SpeedFloor));
                let at_limit = plan.cross_preload >= planner.most_preload * q16(980_000);
                let slow = plan.cross_speed < planner.safe_speed;
                assert_eq!(told, at_limit && slow && !floored, "{gap_mm} {plan:?}");
                limited += u32::from(told);
                free += u32::from(!told && !floored);
            }
        }
        assert!(limited > 0 && free > 0, "{limited} {free}");
    }

    /// Plans of a rig that is changed like this, either way, for treads around the nominal.
    fn plans(change: impl Fn(&mut Rig)) -> Vec<(Planner, Plan)> {
        let mut rig = Rig::prototype();
        change(&mut rig);
        let Ok(planner) = Planner::try_build(&rig) else { return Vec::new() };
        let cases = [0.8, 1.0, 1.25].into_iter().flat_map(|s| Direction::ALL.map(|way| (s, way)));
        cases
            .map(|(scale, direction)| {
                let scale = Ratio::from_num(scale);
                let request = PlanRequest { sequence: 1, direction, step: 2, scale, review: None };
                (planner.clone(), planner.plan(&request))
            })
            .collect()
    }

    #[test]
    fn a_crossing_that_no_speed_makes_narrow_enough_is_told() {
        let (mut floored, mut free) = (0, 0);
        for gap_mm in [0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5] {
            for (planner, plan) in plans(|rig| rig.control.gap_ref_mm = gap_mm) {
                let told = plan.limits.contains(&Some(Limit::SpeedFloor));
                let slowest = plan.cross_speed <= planner.least_speed;
                let hardest = plan.cross_preload == planner.most_preload;
                let wide = plan.gap > planner.target_of(plan.direction);
                assert_eq!(told, slowest && hardest && wide, "{gap_mm} {plan:?}");
                floored += u32::from(told);
                free += u32::from(!told);
            }
        }
        assert!(floored > 0 && free > 0, "{floored} {free}");
    }

    #[test]
    fn a_crossing_that_leaves_too_little_friction_is_told() {
        let (mut slips, mut grips) = (0, 0);
        for mu in [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1] {
            for (planner, plan) in plans(|rig| rig.plant.mu = mu) {
                let told = plan.limits.contains(&Some(Limit::SlipMarginLow));
                let wanted = planner.friction - planner.usable;
                assert_eq!(told, plan.slip_margin < wanted, "{mu} {plan:?}");
                // Told or not, the margin is that of the friction left over.
                let margin = plan.slip_margin.to_num::<f64>();
                assert!(
                    margin < mu && (wanted.to_num::<f64>() - 0.1).abs() < 1e-4,
                    "{mu} {margin}"
                );
                slips += u32::from(told);
                grips += u32::from(!told);
            }
        }
        assert!(slips > 0 && grips > 0, "{slips} {grips}");
    }
}
