//! From a rig to the planner's machine units, once at start.

use super::Planner;
use crate::model::dip::Dip;
use crate::model::formula::Formula;
use crate::model::guard::Guard;
use crate::model::plan::{KNOWN_DEVIATION, Strategy};
use crate::model::reduced::{ReducedModel, Scale};
use crate::model::timing::Timing;
use crate::numeric::checked;
use crate::rig::{MAX_STEPS, Rig, RigError};
use crate::units::{Direction, Millimetres, Ratio};

/// Rise and dip of the wheel at which a corner shows its place, mm.
const RISE_MM: f64 = 0.16;
const DIP_MM: f64 = 1.0;

/// How much farther the stiffness estimate may rise than fall.
const STIFFER_RANGE: f64 = 10.0;

/// Reserve below which the crossings do not change it.
const LEAST_RESERVE: f64 = 1e-3;
impl Planner {
    /// The scheduler of a rig.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        Self::try_build_as(rig, Strategy::Scheduled)
    }

    /// The scheduler of a rig with one of the strategies it is compared with.
    pub fn try_build_as(rig: &Rig, strategy: Strategy) -> Result<Self, RigError> {
        let model = ReducedModel::try_build(rig)?;
        let load = rig.plant.top_load_n * rig.plant.top_load_share;
        let tangents = (0..rig.rig.step_positions_mm.len()).map(|level| {
            let sine =
                (rig.centre_radius_mm(level) - rig.rig.arm_pivot_radius_mm) / rig.rig.arm_length_mm;
            sine / libm::sqrt(1.0 - sine * sine)
        });
        let tangents = tangents
            .map(|tangent| checked("rig.arm_length_mm", tangent))
            .collect::<Result<heapless::Vec<_, MAX_STEPS>, _>>()?;
        let first = tangents.first().map_or(0.0, |tangent: &Ratio| tangent.to_num::<f64>());
        let first = rig.plant.arm_coupling * load * first;
        let formula = Formula::new(rig);
        let reference = |direction| {
            if rig.control.gap_ref_mm > 0.0 {
                rig.control.gap_ref_mm
            } else {
                let speed = rig.control.safe_speed_mm_s;
                formula.gap_mm(direction, speed, rig.preload.cruise_n + first, Some(load))
            }
        };
        let references = [reference(Direction::Deploy), reference(Direction::Retract)];
        let gap = |value: f64| checked("control.gap_ref_mm", value);
        let reserve = rig.control.gap_reserve;
        let range = rig.control.adaptation_range;
        // As far as the model goes.
        let scale = |to| Ok(Scale::new(checked("control.adaptation_range", to)?).ratio());
        // With which a tread as known is corrected by the gain.
        let known = KNOWN_DEVIATION.to_num::<f64>();
        let measured = known * known * (1.0 / rig.control.adaptation_gain.max(1e-3) - 1.0);
        Ok(Self {
            model,
            guard: Guard::try_build(rig)?,
            timing: Timing::try_build(rig)?,
            dip: Dip::try_build(rig)?,
            strategy,
            tangents,
            coupling: checked("plant.arm_coupling", rig.plant.arm_coupling)?,
            load: checked("plant.top_load_n", load)?,
            gap_ref: [gap(references[0])?, gap(references[1])?],
            reserve: checked("control.gap_reserve", reserve)?,
            by_reserve: checked(
                "control.gap_reserve",
                if reserve > LEAST_RESERVE { 1.0 / reserve } else { 0.0 },
            )?,
            cruise_speed: checked("drive.cruise_speed_mm_s", rig.drive.cruise_speed_mm_s)?,
            least_speed: checked("drive.min_crossing_speed_mm_s", rig.least_planned_speed_mm_s())?,
            safe_speed: checked("control.safe_speed_mm_s", rig.control.safe_speed_mm_s)?,
            climb_speed: checked("preload.spring_n_per_mm", rig.climb_speed_mm_s().min(1000.0))?,
            prescribed_speed: None,
            uniform: false,
            radius: checked("rig.wheel_radius_mm", rig.rig.wheel_radius_mm)?,
            felt_at: felt_at(rig)?,
            tolerance: checked("rig.step_tolerance_mm", rig.rig.step_tolerance_mm)?,
            cruise_preload: checked("preload.cruise_n", rig.preload.cruise_n)?,
            rolling_preload: checked("control.slip_margin", rig.rolling_preload_n())?,
            most_preload: checked("preload.limit_n", rig.most_preload_n())?,
            friction: checked("plant.mu", rig.plant.mu)?,
            usable: checked("control.slip_margin", rig.plant.mu - rig.control.slip_margin)?,
            scale_range: (scale(1.0 - range)?, scale(1.0 + STIFFER_RANGE * range)?),
            measured_variance: checked("control.adaptation_gain", measured)?,
        })
    }

    /// Sets the crossing speed, mm/s, and whether it also applies between the steps: for tuning
    /// the strategies of a comparison.
    pub fn with_speed(mut self, crossing_mm_s: f64, uniform: bool) -> Result<Self, RigError> {
        self.prescribed_speed = Some(checked("drive.cruise_speed_mm_s", crossing_mm_s)?);
        self.uniform = uniform;
        Ok(self)
    }
}

/// Distances to the face at which the corner shows where it is, mm, as the crossing watch has
/// it: on deploy with the first touch, where the centre has risen by 0.16 mm beside the tread's
/// compression, `sqrt((y - rise)^2 - (y - h)^2)` at a height y; back once it has dipped by 1 mm.
fn felt_at(rig: &Rig) -> Result<[Millimetres; 2], RigError> {
    let (r, h) = (rig.rig.wheel_radius_mm, rig.rig.step_height_mm);
    let y = 0.98 * r;
    let touch = libm::sqrt((y - RISE_MM) * (y - RISE_MM) - (y - h) * (y - h));
    let dip = libm::sqrt(r * r - (r - DIP_MM) * (r - DIP_MM));
    let key = "rig.step_height_mm";
    Ok([checked(key, touch)?, checked(key, -dip)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::plan::{Learned, PlanRequest, Review, Strategy};
    use crate::units::Q16;
    use proptest::prelude::*;

    const ALL: [Strategy; 4] =
        [Strategy::Scheduled, Strategy::Constant, Strategy::Limit, Strategy::Reactive];

    fn request(back: bool, step: u8, scale: f64) -> PlanRequest {
        PlanRequest {
            sequence: 1,
            direction: if back { Direction::Retract } else { Direction::Deploy },
            step,
            learned: Learned { scale: Q16::from_num(scale), ..Learned::default() },
            preload: Q16::from_num(50),
            distance: Q16::ZERO,
            review: None,
            slipped: None,
        }
    }

    proptest! {
        #[test]
        fn no_plan_leaves_the_limits(
            strategy in 0..4usize,
            back in any::<bool>(),
            step in 0..4u8,
            scale in 0.75..1.25f64,
        ) {
            let rig = Rig::prototype();
            let planner = Planner::try_build_as(&rig, ALL[strategy]).unwrap();
            let plan = planner.plan(&request(back, step, scale));
            let (least, most) = (rig.drive.min_crossing_speed_mm_s, rig.drive.cruise_speed_mm_s);
            let speed = plan.cross_speed.to_num::<f64>();
            prop_assert!((least..=most).contains(&speed), "{speed}");
            for preload in [plan.cross_preload, plan.cruise_preload] {
                let preload = preload.to_num::<f64>();
                prop_assert!(preload >= rig.preload.cruise_n - 1e-3);
                prop_assert!(preload <= rig.most_preload_n() + 1e-3);
            }
            prop_assert!(plan.brake_distance >= Q16::ZERO && plan.brake_time >= Q16::ZERO);
        }

        #[test]
        fn a_scheduled_preload_holds_the_target_gap_by_the_formulas(
            back in any::<bool>(),
            step in 1..4u8,
            scale in 0.85..1.15f64,
        ) {
            let rig = Rig::prototype();
            let planner = Planner::try_build(&rig).unwrap();
            let request = request(back, step, scale);
            let plan = planner.plan(&request);
            let mut formula = Formula::new(&rig);
            formula.k_inf *= scale;
            let load = rig.plant.top_load_n * rig.plant.top_load_share;
            let sine = (rig.centre_radius_mm(usize::from(step) - 1)
                - rig.rig.arm_pivot_radius_mm)
                / rig.rig.arm_length_mm;
            let force = plan.cross_preload.to_num::<f64>()
                + load * rig.plant.arm_coupling * sine / (1.0 - sine * sine).sqrt();
            let speed = plan.cross_speed.to_num::<f64>();
            let gap = formula.gap_mm(request.direction, speed, force, Some(load));
            let target = planner.gap_ref(request.direction).to_num::<f64>()
                * (1.0 - rig.control.gap_reserve);
            // At the least speed the limit may not suffice; else the target is met, or
            // undercut where the cruise preload alone does.
            let floor = speed < rig.least_planned_speed_mm_s() + 0.01;
            prop_assert!(floor || gap < target * 1.002, "{gap} {target}");
        }

        #[test]
        fn adaptation_stays_in_its_range_whatever_is_measured(
            gap in -5.0..10.0f64,
            preload in 0.0..80.0f64,
            speed in 0.0..60.0f64,
            scale in 0.75..1.25f64,
        ) {
            let rig = Rig::prototype();
            let planner = Planner::try_build(&rig).unwrap();
            let q = Q16::from_num::<f64>;
            let review = Review {
                direction: Direction::Deploy,
                speed: q(speed),
                preload: q(preload),
                tan_arm: q(1.0),
                gap: q(gap),
                seen: q(gap),
                trusted: true,
                slipped: false,
            };
            let plan = planner.plan(&PlanRequest { review: Some(review), ..request(false, 1, scale) });
            let after = plan.outcome.unwrap().learned.scale.to_num::<f64>();
            let range = rig.control.adaptation_range;
            let (softest, stiffest) = (1.0 - range, 1.0 + STIFFER_RANGE * range);
            prop_assert!(after >= softest - 1e-3 && after <= stiffest + 1e-3, "{after}");
        }
    }

    #[test]
    fn between_the_steps_only_the_limit_strategy_keeps_the_limit() {
        let rig = Rig::prototype();
        for strategy in ALL {
            let planner = Planner::try_build_as(&rig, strategy).unwrap();
            for step in 0..4 {
                let preload = planner.plan(&request(false, step, 1.0)).cruise_preload;
                let expected = match strategy {
                    Strategy::Limit => rig.most_preload_n(),
                    _ => rig.preload.cruise_n,
                };
                assert!((preload.to_num::<f64>() - expected).abs() < 1e-3, "{strategy:?}");
            }
        }
    }
}
