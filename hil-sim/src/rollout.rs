//! Isolated crossings by the model that the controller plans with: the tread, rolled out in fixed
//! point.

use interstage::model::rollout::{Run, roll};
use interstage::model::tread::{Axial, Tread, TreadState};
use interstage::rig::{Rig, RigError};
use interstage::units::{Direction, Q16};
use serde::Serialize;

/// Halvings of the force that gives a gap: to a millinewton.
const HALVINGS: usize = 18;

/// A crossing at constant speed and radial force.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CrossingSetup {
    pub speed_mm_s: f64,
    /// Radial force on the wheel, N.
    pub preload_n: f64,
    #[serde(skip)]
    pub direction: Direction,
    /// Axial load lifted by friction, N; none pushes a frictionless wheel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_n: Option<f64>,
}

/// What the model gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossed {
    /// Clearance between step root and undeformed wheel at lift-off (retract: touch-down), mm.
    pub gap_mm: f64,
    /// Wheel centre at that instant: axially before the face, and above the upper wall, mm.
    pub ahead_mm: f64,
    /// See `ahead_mm`.
    pub above_mm: f64,
    /// Tread depth at the corner at that instant, mm.
    pub depth_mm: f64,
    /// Largest axial force of the contact against the motion outwards, N.
    pub corner_force_n: f64,
    /// Largest friction needed; 0 if pushed.
    pub utilisation: f64,
}

/// A rig's wheel before a step.
#[derive(Clone, Copy, Debug)]
pub struct Wheel {
    /// The tread in machine units.
    pub tread: Tread,
    radius_mm: f64,
    step_mm: f64,
    reach_mm: f64,
}

impl Wheel {
    /// The wheel of a rig; fails where a figure is out of the model's range.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        Ok(Self {
            tread: Tread::try_build(rig)?,
            radius_mm: rig.rig.wheel_radius_mm,
            step_mm: rig.rig.step_height_mm,
            reach_mm: rig.corner_reach_mm(),
        })
    }

    /// How it is rolled: from one radius before the corner to where the wall has taken over.
    pub fn run(&self, setup: &CrossingSetup) -> Run {
        let (from, until) = match setup.direction {
            Direction::Deploy => (-self.reach_mm - self.radius_mm, 0.0),
            Direction::Retract => (self.radius_mm, -self.reach_mm - 0.5),
        };
        Run {
            direction: setup.direction,
            axial: setup.load_n.map_or(Axial::Pushed, |load| Axial::Driven(Q16::from_num(load))),
            scale: Q16::ONE,
            level: true,
            shear: None,
            from: Q16::from_num(from),
            until: Q16::from_num(until),
        }
    }

    /// A crossing; none where the lower wall carries until the step is under the centre.
    pub fn cross(&self, setup: &CrossingSetup) -> Option<Crossed> {
        self.cross_along(setup, &|_| (setup.speed_mm_s, setup.preload_n))
    }

    /// The same with the speed, mm/s, and the radial force, N, of each place of the axle, mm from
    /// the face outwards.
    pub(crate) fn cross_along(
        &self,
        setup: &CrossingSetup,
        course: &dyn Fn(f64) -> (f64, f64),
    ) -> Option<Crossed> {
        let course = |position: Q16| {
            let (speed, force) = course(position.to_num());
            (Q16::from_num(speed), Q16::from_num(force))
        };
        let mut state = TreadState::default();
        let rolled = roll(&self.tread, &mut state, &self.run(setup), course);
        let lift = rolled.lift;
        let (ahead_mm, above_mm) =
            (-lift.position.to_num::<f64>(), lift.centre.to_num::<f64>() - self.step_mm);
        lift.is_found().then(|| Crossed {
            gap_mm: lift.gap.to_num(),
            ahead_mm,
            above_mm,
            depth_mm: self.radius_mm - ahead_mm.hypot(above_mm),
            corner_force_n: rolled.corner_force.to_num(),
            utilisation: lift.utilisation.to_num(),
        })
    }

    /// Radial force from 1 to 250 N with which the crossing leaves this gap, N; `preload_n` of the
    /// setup does not count.
    pub fn force_n(&self, gap_mm: f64, setup: &CrossingSetup) -> f64 {
        let wider = |preload_n: f64| {
            let crossed = self.cross(&CrossingSetup { preload_n, ..*setup });
            crossed.is_some_and(|crossed| crossed.gap_mm > gap_mm)
        };
        halved((1.0, 250.0), wider)
    }
}

/// Halves an interval towards where `below` ceases to hold.
pub fn halved((mut low, mut high): (f64, f64), below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gap_and_force_are_inverse() {
        let wheel = Wheel::try_build(&Rig::prototype()).unwrap();
        for direction in Direction::ALL {
            for (speed_mm_s, preload_n) in [(5.0, 33.3), (25.0, 120.0)] {
                for load_n in [None, Some(6.7)] {
                    let setup = CrossingSetup { speed_mm_s, preload_n, direction, load_n };
                    let crossed = wheel.cross(&setup).unwrap();
                    let again = wheel.force_n(crossed.gap_mm, &setup);
                    assert!((again / preload_n - 1.0).abs() < 1e-3, "{setup:?} {again}");
                    let above = crossed.above_mm + wheel.step_mm;
                    let gap = crossed.ahead_mm.hypot(above) - wheel.radius_mm;
                    assert!((gap - crossed.gap_mm).abs() < 1e-3, "{crossed:?}");
                }
            }
        }
    }

    #[test]
    fn a_wheel_that_sinks_in_has_no_gap() {
        let wheel = Wheel::try_build(&Rig::prototype()).unwrap();
        let direction = Direction::Deploy;
        let setup = CrossingSetup { speed_mm_s: 5.0, preload_n: 1000.0, direction, load_n: None };
        assert_eq!(wheel.cross(&setup), None);
    }
}
