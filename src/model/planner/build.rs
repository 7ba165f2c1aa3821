//! From a rig to the planner's machine units, once at start.

use super::{DriveModel, Planner, PretightenerModel};
use crate::model::guard::Guard;
use crate::model::plan::Strategy;
use crate::model::profile::Profile;
use crate::model::rollout::{Run, roll};
use crate::model::timing::{SLEW_PART, Timing};
use crate::model::tread::{Axial, Tread, TreadState};
use crate::model::wind_up::Shear;
use crate::numeric::{checked, divide};
use crate::rig::{CROSSOVER_RAD_S, MAX_STEPS, PROPORTIONAL, Rig, RigError};
use crate::units::{Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, q16};

/// Rise and dip of the wheel at which a corner shows its place, mm.
const RISE_MM: f64 = 0.16;
const DIP_MM: f64 = 1.0;

/// One sigma of a step's height, mm: a sleeve is machined to 0.05 mm, evenly spread.
const HEIGHT_SIGMA: Millimetres = q16(28_900);

/// How much farther the stiffness estimate may rise than fall.
const STIFFER_RANGE: f64 = 10.0;

/// Where the rollout of a steady crossing begins and ends, over the wheel's radius: a patch before the
/// corner and behind it.
const STEADY_REACH: Millimetres = Millimetres::ONE;

impl Planner {
    /// The scheduler of a rig.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        Self::try_build_as(rig, Strategy::Scheduled)
    }

    /// The scheduler of a rig with one of the strategies it is compared with.
    pub fn try_build_as(rig: &Rig, strategy: Strategy) -> Result<Self, RigError> {
        let tread = Tread::try_build(rig)?;
        let load = rig.plant.top_load_n * rig.plant.top_load_share;
        let tangents = (0..rig.rig.step_positions_mm.len()).map(|level| {
            let lever = rig.centre_radius_mm(level) - rig.rig.arm_pivot_radius_mm;
            let sine = lever / rig.rig.arm_length_mm;
            checked("rig.arm_length_mm", sine / libm::sqrt(1.0 - sine * sine))
        });
        let tangents = tangents.collect::<Result<heapless::Vec<_, MAX_STEPS>, _>>()?;
        let first = tangents.first().map_or(0.0, |tangent: &Ratio| tangent.to_num::<f64>());
        let first = rig.plant.arm_coupling * load * first;
        let load_n = checked("plant.top_load_n", load)?;
        let shear = Shear::try_build(rig)?;
        let gap_ref = [Direction::Deploy, Direction::Retract].map(|direction| {
            if rig.control.gap_ref_mm > 0.0 {
                return checked("control.gap_ref_mm", rig.control.gap_ref_mm);
            }
            let speed = checked("control.safe_speed_mm_s", rig.control.safe_speed_mm_s)?;
            let force = checked("preload.cruise_n", rig.preload.cruise_n + first)?;
            Ok(steady_gap((&tread, shear), direction, load_n, speed, force))
        });
        let [deploy, retract] = gap_ref;
        let (deploy, retract) = (deploy?, retract?);
        let reserve = checked("control.gap_reserve", rig.control.gap_reserve)?;
        let aimed = |gap: Millimetres| gap - gap * reserve;
        let (radius, step) = (tread.radius(), tread.height());
        // Deploying the corner of a higher step shows itself earlier. Retracting the wheel falls over
        // a step of whose height nothing is known: `dgap/dh = (R - h) / (R + gap)`.
        let higher = HEIGHT_SIGMA * divide(radius - step, radius + retract);
        let range = rig.control.adaptation_range;
        let scale = |to| checked("control.adaptation_range", to);
        let answers = 1.0 + PROPORTIONAL;
        let lag_per_n = rig.drive.no_load_speed_mm_s / rig.drive.stall_force_n / answers;
        Ok(Self {
            tread,
            shear,
            profile: Profile::try_build(rig)?,
            timing: Timing::try_build(rig)?,
            drive: DriveModel {
                decay: checked("drive.no_load_speed_mm_s", 1e-3 * CROSSOVER_RAD_S / answers)?,
                lag_per_load: checked("drive.stall_force_n", lag_per_n)?,
            },
            pretightener: PretightenerModel {
                settles: checked("preload.delay_s", rig.preload.delay_s + rig.preload.lag_s)?,
                rate: checked("preload.slew_n_per_s", rig.preload.slew_n_per_s)? * SLEW_PART,
            },
            guard: Guard::try_build(rig)?,
            strategy,
            tangents,
            coupling: checked("plant.arm_coupling", rig.plant.arm_coupling)?,
            load: load_n,
            gap_ref: [deploy, retract],
            aimed: [aimed(deploy), aimed(retract) - higher],
            cruise_speed: checked("drive.cruise_speed_mm_s", rig.drive.cruise_speed_mm_s)?,
            least_speed: checked("drive.min_crossing_speed_mm_s", rig.least_planned_speed_mm_s())?,
            safe_speed: checked("control.safe_speed_mm_s", rig.control.safe_speed_mm_s)?,
            climb_speed: checked("preload.spring_n_per_mm", rig.climb_speed_mm_s().min(1000.0))?,
            prescribed_speed: None,
            uniform: false,
            radius: checked("rig.wheel_radius_mm", rig.rig.wheel_radius_mm)?,
            touch_at: checked("rig.step_height_mm", touch(rig.rig.wheel_radius_mm, rig))?,
            felt_at: felt_at(rig)?,
            tolerance: checked("rig.step_tolerance_mm", rig.rig.step_tolerance_mm)?,
            cruise_preload: checked("preload.cruise_n", rig.preload.cruise_n)?,
            rolling_preload: checked("control.slip_margin", rig.rolling_preload_n())?,
            most_preload: checked("preload.limit_n", rig.most_preload_n())?,
            friction: checked("plant.mu", rig.plant.mu)?,
            usable: checked("control.slip_margin", rig.plant.mu - rig.control.slip_margin)?,
            scale_range: (scale(1.0 - range)?, scale(1.0 + STIFFER_RANGE * range)?),
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

/// Gap of a crossing at a constant speed under a constant radial force, mm.
fn steady_gap(
    (tread, shear): (&Tread, Shear),
    direction: Direction,
    load: Newtons,
    speed: MillimetresPerSecond,
    force: Newtons,
) -> Millimetres {
    let reach = tread.radius() * STEADY_REACH;
    let deploys = direction == Direction::Deploy;
    let (from, until) = if deploys { (-reach, Q16::ZERO) } else { (reach.half(), -reach) };
    let (axial, scale, shear) = (Axial::Driven(load), Q16::ONE, Some(shear));
    let run = Run { direction, axial, scale, level: false, shear, from, until };
    roll(tread, &mut TreadState::default(), &run, |_| (speed, force)).lift.gap
}

/// Distance to the face at which a wheel of this height touches the corner, mm.
fn touch(height: f64, rig: &Rig) -> f64 {
    let above = height - rig.rig.step_height_mm;
    libm::sqrt(height * height - above * above)
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
