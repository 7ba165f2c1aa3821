//! Collision force and impact stress from the state of the virtual rig, and contact areas.
//!
//! The collision force is the axial force of the contact against the motion beyond rolling
//! resistance. The plant does not keep it, but it follows from what it keeps: a gripping
//! wheel carries `C + u S = N` radially and `u C - S = T` axially, with the friction
//! utilisation u, the pressing force N and the thrust T; from S goes what the continuous
//! wall resists.

use super::case::Case;
use hil_sim::plant::rig::VirtualRig;
use hil_sim::plant::rolling;
use hil_sim::plant::wall::LocalWall;

/// Distance behind an edge, mm, over which the patch leaves it: the next corner is farther.
pub(super) const LEAVES_MM: f64 = 8.0;

/// Rolling resistance over radial force of this plant on the continuous wall at this
/// speed, mm/s, and pressing force, N.
pub(super) fn resistance(plant: &VirtualRig, speed_mm_s: f64, pressing_n: f64) -> f64 {
    let ring = &plant.parameters().ring;
    let guess = ring.radius_mm - 0.3;
    let steady = rolling::solve(ring, speed_mm_s, guess, |c| c.cosine_n - pressing_n);
    steady.sine_n / steady.cosine_n.max(f64::MIN_POSITIVE)
}

/// Collision force, N, beyond this [`resistance`], within the inertia of the carriage,
/// 0.3 N, as long as the wheel grips; 0 where the wheel has not yet touched the step ahead.
pub(super) fn collision_n(plant: &VirtualRig, resistance: f64) -> f64 {
    let (truth, parameters) = (plant.truth(), plant.parameters());
    let used = truth.utilisation;
    let thrust = if used == 0.0 { 0.0 } else { parameters.load_n };
    let pressing = truth.preload_n + parameters.arm.thrust_ratio(truth.radius_mm) * thrust;
    let radial = (pressing + used * thrust) / (1.0 + used * used);
    let axial = used * radial - thrust;
    let beyond = (axial - resistance * truth.floor_n).max(0.0);
    let local = parameters.wall.local(truth.position_mm);
    let (radius, height) = (parameters.ring.radius_mm, truth.height_mm - local.base_mm);
    if local.behind_mm < LEAVES_MM {
        return beyond;
    }
    // No part of the corner's force is steeper than the end of its arc.
    let end = ((height - local.rise_mm) / radius).clamp(-1.0, 1.0).acos();
    beyond.min(truth.corner_n * end.sin())
}

/// Mean stress that this collision force puts on the wheel, kPa (1e-3 N/mm^2): the force
/// over the part of the wheel's undeformed surface that the step cuts off.
pub(super) fn impact_kpa(plant: &VirtualRig, collision_n: f64) -> f64 {
    let (truth, parameters) = (plant.truth(), plant.parameters());
    let local = parameters.wall.local(truth.position_mm);
    let ring = &parameters.ring;
    let height = truth.height_mm - local.base_mm;
    let size = (ring.radius_mm, ring.width_mm);
    let area = step_area_mm2(size, &local, height);
    // Elements of the plant's ring touch as a whole.
    stress_kpa(collision_n, area.max(ring.pitch_mm() * size.1))
}

/// Force over area, kPa; 0 where nothing touches.
pub(super) fn stress_kpa(force_n: f64, area_mm2: f64) -> f64 {
    if area_mm2 > 0.0 { 1e3 * force_n / area_mm2 } else { 0.0 }
}

/// [`corner_area_mm2`] of the step that the wheel is on, the one ahead if it is touched, with the
/// centre at this height above the wall under it, mm.
pub(super) fn step_area_mm2(size: (f64, f64), wall: &LocalWall, height_mm: f64) -> f64 {
    let ahead = corner_area_mm2(size, wall.ahead_mm, height_mm - wall.rise_mm);
    if ahead > 0.0 { ahead } else { corner_area_mm2(size, -wall.behind_mm, height_mm) }
}

/// Part of the undeformed surface of a wheel of this radius and width that face and top
/// of a step cut off, mm^2.
///
/// Equation: `A = R L (acos(u/R) - asin(d/R))`, d the distance to the face, negative once the
/// centre has passed it, and u the height of the centre above the top, both mm. Range: 0
/// where the corner is ahead of the wheel; the entire patch where it lies behind.
/// Memory lets the trailing part of the patch go earlier: the true area is smaller.
pub(super) fn corner_area_mm2((radius, width): (f64, f64), ahead_mm: f64, above_mm: f64) -> f64 {
    let half = (above_mm / radius).clamp(-1.0, 1.0).acos();
    let start = (ahead_mm / radius).clamp(-1.0, 1.0).asin().max(-half);
    if ahead_mm > 0.0 && ahead_mm.hypot(above_mm) >= radius {
        return 0.0;
    }
    radius * width * (half - start).max(0.0)
}

/// Contact area that belongs to a tread depth at lift-off, mm^2, by the nominal
/// geometry: how a compression sensor's reading becomes an area.
pub(super) fn area_of_depth_mm2(case: &Case, depth_mm: f64) -> f64 {
    let wheel = case.loads.rig().rig;
    let above = wheel.wheel_radius_mm - wheel.step_height_mm;
    let reach = wheel.wheel_radius_mm - depth_mm;
    let ahead = (reach * reach - above * above).max(0.0).sqrt();
    corner_area_mm2((wheel.wheel_radius_mm, wheel.wheel_width_mm), ahead, above)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Source;
    use crate::paper::case::Loads;
    use crate::paper::experiment;
    use crate::paper::histories::Histories;
    use crate::paper::history::Quantity;

    #[test]
    fn the_area_is_that_of_a_fine_sum() {
        let (radius, width, above) = (25.0, 28.0, 21.0);
        for ahead in [10.0_f64, 2.0, -2.0, -9.0] {
            let n = 200_000;
            let pitch = 2.4 / f64::from(n);
            let inside = (0..n)
                .map(|i| (f64::from(i) + 0.5) * pitch - 1.2)
                .filter(|psi: &f64| {
                    // Beyond the face, and below the top.
                    radius * psi.sin() > ahead && radius * psi.cos() > above
                })
                .count();
            let sum = inside as f64 * pitch * radius * width;
            let area = corner_area_mm2((radius, width), ahead, above);
            assert!((area / sum - 1.0).abs() < 1e-3, "{area} {sum}");
        }
        assert_eq!(corner_area_mm2((radius, width), 14.0, above), 0.0);
        assert_eq!(stress_kpa(5.0, 0.0), 0.0);
    }

    #[test]
    fn a_depth_gives_the_area_that_the_corner_cuts_off() {
        let case = Case::new(Loads::Prototype, 5.0, 33.3);
        for ahead_mm in [0.5, 8.0, 12.5] {
            let depth_mm = 25.0 - 21.0_f64.hypot(ahead_mm);
            let exact = corner_area_mm2((25.0, 28.0), ahead_mm, 21.0);
            let area = area_of_depth_mm2(&case, depth_mm);
            assert!((area / exact - 1.0).abs() < 1e-9, "{area} {exact}");
        }
    }

    #[test]
    fn a_slow_case_is_run_to_its_end() {
        let case = Case::new(Loads::Prototype, 3.0, 40.0);
        let mut scenario = case.scenario(0);
        (scenario.rig.rig.travel_mm, scenario.rig.rig.step_positions_mm[2]) = (240.0, 220.0);
        assert_eq!(experiment::run_as(&case, &scenario).unwrap().crossings.len(), 3);
    }

    #[test]
    fn the_measured_force_is_the_one_that_the_reference_gives() {
        let case = Case::new(Loads::Prototype, 8.0, 40.0);
        // The tread of the reference does not give way along the wall; this one by 0.4 of what 3 mm do.
        let mut scenario = case.scenario(0);
        (scenario.rig.tread.thickness_mm, scenario.mismatch.wind_up_compliance) = (3.0, 0.4);
        let run = experiment::run_as(&case, &scenario).unwrap();
        let nominal = experiment::Experiment { case, runs: vec![run; 40] };
        let histories = Histories::new(&nominal).unwrap();
        for quantity in [Quantity::Collision, Quantity::Impact] {
            let read = histories.peaks(quantity, Source::Experiment);
            let wanted = histories.peaks(quantity, Source::Simulation);
            for (read, wanted) in read.iter().zip(&wanted) {
                // Where, not when: the preload rises while the wheel approaches the first step,
                // and a corner slows the wheel. The log has a line every 0.8 mm.
                let off_mm = read.position_mm - wanted.position_mm;
                assert!(off_mm.abs() < 0.8, "{quantity:?} {read:?} {wanted:?}");
                let ratio = read.value / wanted.value;
                assert!((ratio - 1.0).abs() < 0.06, "{quantity:?} {read:?} {wanted:?}");
            }
        }
    }
}
