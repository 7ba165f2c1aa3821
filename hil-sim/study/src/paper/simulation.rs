//! What the reference models say: gap, depth and area of the converged ring with memory,
//! and a deployment as ring with inertia, waves in the tread and bending of the arm.

use anyhow::Result;

use super::case::{Arms, Case};
use super::history::{History, INTERVAL_S, Instant};
use super::measure::{corner_area_mm2, stress_kpa};
use super::theory::{Drive, Lift, setup};
use crate::reference::collision::dynamic;
use crate::reference::impact::Rod;
use crate::reference::{ReferenceCase, Rubber};
use hil_sim::plant::balance::{Axial, BalanceError};
use hil_sim::rollout::CrossingSetup;

/// Distance before a step at which its crossing begins, mm: touch, and a tenth of a radius.
const BEGINS_MM: f64 = 16.1;

/// Longest time that waves and arm are followed over where nothing happens, s.
const QUIET_S: f64 = 1e-3;

/// The ring's crossing from sleeve `level`, at the instant at which the lower wall stops
/// carrying; the collision is the largest of the crossing.
///
/// The area is the part of the wheel that the step cuts off, as a compression sensor
/// would have it: elements of the ring enter and leave as a whole.
pub(super) fn lift(case: &Case, drive: Drive, level: usize) -> Result<Lift, BalanceError> {
    let CrossingSetup { preload_n, load_n, .. } = setup(case, drive, level);
    let reference = ReferenceCase {
        axial: load_n.map_or(Axial::Pushed, Axial::Driven),
        ..ReferenceCase::new(case.loads.rig(), case.speed_mm_s, preload_n)
    };
    let result = reference.still()?;
    let (x, y) = result.lift;
    let rig = &reference.rig.rig;
    let size = (rig.wheel_radius_mm, rig.wheel_width_mm);
    let area = corner_area_mm2(size, -x, y - rig.step_height_mm);
    Ok(Lift::new((result.gap_mm, result.lift_depth_mm), area, result.corner_force_n))
}

/// Cells of the tread in which waves run to the hub.
const CELLS: usize = 4;

/// A deployment of the driven wheel by the reference models, a crossing a step: the
/// ring with memory and inertia, the waves that its stress sends through the tread, and the
/// arm that it bends.
pub(super) fn deployment(case: &Case, arms: &Arms) -> Result<History> {
    let rig = case.loads.rig();
    let size = (rig.rig.wheel_radius_mm, rig.rig.wheel_width_mm);
    let steps = rig.rig.step_positions_mm.clone();
    let mut history = History::default();
    let mut modal = arms.modal()?;
    let mut last_s = 0.0;
    for (level, &step) in steps.iter().enumerate() {
        let reference =
            ReferenceCase::new(rig.clone(), case.speed_mm_s, case.pressing_n(level)).driven();
        let crossing = dynamic(&reference)?;
        let mut rod = Rod::tread(Rubber::of(&reference), CELLS);
        let before = crossing.iter().filter(|sample| sample.t_s < 0.0);
        let (axial, floor) =
            before.fold((0.0, 0.0), |(a, b), sample| (a + sample.axial_n, b + sample.floor_n));
        let resistance = if floor > 0.0 { axial / floor } else { 0.0 };
        // Until the next crossing begins.
        let next = steps.get(level + 1).map_or(rig.rig.travel_mm, |next| next - BEGINS_MM);
        for sample in crossing.iter().filter(|sample| step + sample.x_mm < next) {
            let time_s = (step + sample.x_mm) / case.speed_mm_s;
            let dt_s = time_s - last_s;
            if dt_s <= 0.0 {
                continue;
            }
            last_s = time_s;
            let collision_n = (sample.axial_n - resistance * sample.floor_n).max(0.0);
            let top = sample.y_mm - rig.rig.step_height_mm;
            let stress = stress_kpa(collision_n, corner_area_mm2(size, -sample.x_mm, top));
            let waves = (dt_s.min(QUIET_S) / rod.step_s()).ceil();
            for _ in 0..waves as usize {
                rod.step(1e3 * stress);
            }
            modal.step(arms.across_n(level, collision_n), dt_s);
            let now = Instant {
                time_s,
                position_mm: step + sample.x_mm,
                collision_n,
                impact_kpa: 1e-3 * rod.hub_pa(),
                arm_um: 1e6 * modal.deflection_m(),
                clearance_mm: (level == 0 && sample.x_mm < 0.0).then_some(sample.clearance_mm),
            };
            history.push(&now, INTERVAL_S);
        }
    }
    // The rest of the travel, on the last sleeve.
    let end_s = rig.rig.travel_mm / case.speed_mm_s;
    while last_s < end_s {
        last_s += QUIET_S;
        modal.step(0.0, QUIET_S);
        let arm_um = 1e6 * modal.deflection_m();
        let position_mm = last_s * case.speed_mm_s;
        let now = Instant { time_s: last_s, position_mm, arm_um, ..Instant::default() };
        history.push(&now, INTERVAL_S);
    }
    Ok(history)
}
