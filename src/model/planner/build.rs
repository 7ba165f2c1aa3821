//! From a rig to the planner's machine units, once at start.

use super::Planner;
use crate::model::formula::Formula;
use crate::model::guard::Guard;
use crate::model::plan::Strategy;
use crate::model::reduced::ReducedModel;
use crate::model::timing::Timing;
use crate::numeric::checked;
use crate::rig::{REGULATION_PART, Rig, RigError};
use crate::supervise::Direction;

/// Part of the pre-tightener's slew that the spring may use up while the wheel climbs.
const CLIMB_PART: f64 = 0.9;
/// Steepest rise of the wheel over a corner, that behind lift-off.
const LIFT_SLOPE: f64 = 0.5;

/// What the least planned speed lies above the least useful one, relative: creep of
/// the tread and the dip under the load of the corner take up to a tenth.
const DIP_PART: f64 = 0.12;

impl Planner {
    /// The scheduler of a rig.
    ///
    /// # Errors
    /// [`RigError`] if a parameter is out of range.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        Self::try_build_as(rig, Strategy::Scheduled)
    }

    /// The scheduler of a rig with one of the strategies it is compared with.
    ///
    /// # Errors
    /// [`RigError`] if a parameter is out of range.
    pub fn try_build_as(rig: &Rig, strategy: Strategy) -> Result<Self, RigError> {
        let model = ReducedModel::try_build(rig)?;
        let load = rig.plant.top_load_n * rig.plant.top_load_share;
        let tangents = (0..rig.rig.step_positions_mm.len()).map(|level| {
            let sine =
                (rig.centre_radius_mm(level) - rig.rig.arm_pivot_radius_mm) / rig.rig.arm_length_mm;
            sine / libm::sqrt(1.0 - sine * sine)
        });
        let coupling = rig.plant.arm_coupling * load;
        let mut wedge = heapless::Vec::new();
        for tangent in tangents {
            // Never full: as many as steps.
            let _ = wedge.push(checked("plant.arm_coupling", coupling * tangent)?);
        }
        let first = wedge.first().map_or(0.0, |w| w.to_num::<f64>());
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
        let aim = 1.0 - rig.control.gap_reserve;
        let range = rig.control.adaptation_range;
        Ok(Self {
            model,
            guard: Guard::try_build(rig)?,
            timing: Timing::try_build(rig)?,
            strategy,
            load: checked("plant.top_load_n", load)?,
            wedge,
            coupling: checked("plant.arm_coupling", coupling)?,
            gap_ref: [gap(references[0])?, gap(references[1])?],
            target: [gap(references[0] * aim)?, gap(references[1] * aim)?],
            cruise_speed: checked("drive.cruise_speed_mm_s", rig.drive.cruise_speed_mm_s)?,
            least_speed: checked(
                "drive.min_crossing_speed_mm_s",
                rig.drive.min_crossing_speed_mm_s * (1.0 + DIP_PART),
            )?,
            safe_speed: checked("control.safe_speed_mm_s", rig.control.safe_speed_mm_s)?,
            climb_speed: checked(
                "preload.spring_n_per_mm",
                (CLIMB_PART * rig.preload.slew_n_per_s
                    / (rig.preload.spring_n_per_mm * LIFT_SLOPE))
                    .min(1000.0),
            )?,
            prescribed_speed: None,
            uniform: false,
            cruise_preload: checked("preload.cruise_n", rig.preload.cruise_n)?,
            most_preload: checked(
                "preload.limit_n",
                rig.preload.limit_n * (1.0 - REGULATION_PART),
            )?,
            friction: checked("plant.mu", rig.plant.mu)?,
            usable: checked("control.slip_margin", rig.plant.mu - rig.control.slip_margin)?,
            scale_range: (
                checked("control.adaptation_range", 1.0 - range)?,
                checked("control.adaptation_range", 1.0 + range)?,
            ),
            gain: checked("control.adaptation_gain", rig.control.adaptation_gain)?,
        })
    }

    /// Prescribes the crossing speed, mm/s, and whether it also holds between the
    /// steps: how the strategies of a comparison are tuned.
    ///
    /// # Errors
    /// [`RigError`] if the speed is out of range.
    pub fn with_speed(mut self, crossing_mm_s: f64, uniform: bool) -> Result<Self, RigError> {
        self.prescribed_speed = Some(checked("drive.cruise_speed_mm_s", crossing_mm_s)?);
        self.uniform = uniform;
        Ok(self)
    }
}
