//! The step table: where the wheel is relative to the steps and the end of travel.

use crate::model::corner_profile::CornerProfile;
use crate::numeric::checked;
use crate::rig::{MAX_STEPS, Rig, RigError};
use crate::units::{Direction, Millimetres, Q16, q16};

/// Distance to the end that counts as arrived, mm.
const ARRIVED_WITHIN: Millimetres = q16(50_000);
/// Distance behind a late step over which it is still searched, mm.
const SEARCH: Millimetres = q16(6_000_000);

/// Steps and corners of a rig. Steps are numbered from 1 at the outermost sleeve; 0 is none.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Steps {
    corner: CornerProfile,
    /// Positions of the faces from the stow end, mm.
    faces: heapless::Vec<Millimetres, MAX_STEPS>,
    travel: Millimetres,
    /// Height of a step by the table, mm.
    pub(crate) height: Millimetres,
    /// Half-width of the window in which a step is expected, mm.
    pub(crate) tolerance: Millimetres,
    /// Distance to the face by which a step must have been detected, deploy and retract, mm.
    detected_by: [Millimetres; 2],
    /// Travel of the wheel over a corner, mm.
    corner_reach: Millimetres,
}

/// State of the step that is expected next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expectation {
    /// Its window lies ahead.
    Ahead,
    /// Inside its window.
    Due,
    /// Past its window, still searched.
    Late,
    /// Given up.
    Missing,
}

impl Steps {
    /// The steps of a rig; fails where a length is out of range.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let (r, h) = (rig.rig.wheel_radius_mm, rig.rig.step_height_mm);
        let mut faces = heapless::Vec::new();
        for &position in &rig.rig.step_positions_mm {
            // Never full: both lists hold as many.
            let _ = faces.push(checked("rig.step_positions_mm", position)?);
        }
        // Deploy: at lift-off with the tread compressed by half a step. Retract: where the
        // edge has let the wheel down by a tenth of the step.
        let compressed = r - 0.5 * h;
        let deploy = libm::sqrt((compressed * compressed - (r - h) * (r - h)).max(0.0));
        let retract = libm::sqrt(r * r - (r - 0.1 * h) * (r - 0.1 * h));
        Ok(Self {
            corner: CornerProfile::try_build(rig)?,
            faces,
            travel: checked("rig.travel_mm", rig.rig.travel_mm)?,
            height: checked("rig.step_height_mm", h)?,
            tolerance: checked("rig.step_tolerance_mm", rig.rig.step_tolerance_mm)?,
            detected_by: [
                checked("rig.step_height_mm", deploy)?,
                -checked("rig.step_height_mm", retract)?,
            ],
            corner_reach: checked("rig.step_height_mm", rig.corner_reach_mm())?,
        })
    }

    /// Geometry of a corner.
    pub const fn corner(&self) -> &CornerProfile {
        &self.corner
    }

    /// Number of steps.
    pub fn count(&self) -> u8 {
        self.faces.len() as u8
    }

    /// Travel of the wheel over a corner, mm.
    pub const fn corner_reach(&self) -> Millimetres {
        self.corner_reach
    }

    /// Position of the face of a step, mm.
    pub fn face(&self, step: u8) -> Option<Millimetres> {
        self.faces.get(usize::from(step).checked_sub(1)?).copied()
    }

    /// Middle of the wall of a level; the ends of travel on the first and the last one, mm.
    pub fn middle_of(&self, level: u8) -> Millimetres {
        match (self.face(level), self.face(level.saturating_add(1))) {
            _ if level == 0 => Millimetres::ZERO,
            (Some(low), Some(high)) => (low + high) * q16(500_000),
            _ => self.travel,
        }
    }

    /// Axial distance along `direction` to the face of a step, mm; none if there is no step.
    pub fn distance(
        &self,
        step: u8,
        direction: Direction,
        position: Millimetres,
    ) -> Option<Millimetres> {
        self.face(step).map(|face| match direction {
            Direction::Deploy => face - position,
            Direction::Retract => position - face,
        })
    }

    /// Distance along `direction` to the end of travel, mm.
    pub fn remaining(&self, direction: Direction, position: Millimetres) -> Millimetres {
        match direction {
            Direction::Deploy => self.travel - position,
            Direction::Retract => position,
        }
    }

    /// Whether the end of travel is reached.
    pub fn arrived(&self, remaining: Millimetres) -> bool {
        remaining <= ARRIVED_WITHIN
    }

    /// The step after `step` in this direction, 0 behind the last.
    pub fn after(&self, step: u8, direction: Direction) -> u8 {
        match direction {
            Direction::Deploy if step < self.count() => step + 1,
            Direction::Deploy => 0,
            Direction::Retract => step.saturating_sub(1),
        }
    }

    /// The step ahead of a wheel on the wall of `level`, 0 if there is none.
    pub fn ahead_of_level(&self, level: u8, direction: Direction) -> u8 {
        match direction {
            Direction::Deploy => self.after(level, direction),
            Direction::Retract => level,
        }
    }

    /// Number of faces at or below `position`.
    pub fn behind(&self, position: Millimetres) -> u8 {
        self.faces.iter().take_while(|face| **face <= position).count() as u8
    }

    /// Distance outwards from `position` to the face that the wheel is on or that is next, mm.
    pub fn next_face(&self, position: Millimetres) -> Option<Millimetres> {
        let near = |face: &&Millimetres| **face + self.corner.patch() > position;
        self.faces.iter().find(near).map(|face| *face - position)
    }

    /// Distance to where the corner may first touch, tolerance included, from the distance to
    /// the face, mm.
    pub fn to_window(
        &self,
        direction: Direction,
        distance: Option<Millimetres>,
    ) -> Option<Millimetres> {
        let first = self.corner.first_contact(direction) + self.tolerance;
        distance.map(|distance| distance - first)
    }

    /// Whether the step at this distance to its face is still to come.
    pub fn expectation(&self, direction: Direction, distance: Option<Millimetres>) -> Expectation {
        let Some(face) = distance else { return Expectation::Ahead };
        let by = match direction {
            Direction::Deploy => self.detected_by[0],
            Direction::Retract => self.detected_by[1],
        } - self.tolerance;
        if self.to_window(direction, distance).is_some_and(|ahead| ahead > Q16::ZERO) {
            Expectation::Ahead
        } else if face > by {
            Expectation::Due
        } else if face > by - SEARCH {
            Expectation::Late
        } else {
            Expectation::Missing
        }
    }

    /// Whether a corner detected at this distance is the step of the table, rather than one
    /// that the table lacks.
    pub fn belongs(&self, direction: Direction, distance: Option<Millimetres>) -> bool {
        self.to_window(direction, distance).is_some_and(|ahead| ahead <= SEARCH)
    }

    /// Nearer to a face than this, a wheel before it may touch its corner, mm.
    pub fn touches_within(&self) -> Millimetres {
        self.corner.first_contact(Direction::Deploy) + self.tolerance
    }

    /// Whether a wheel at this position may touch a corner, ahead or behind.
    pub fn may_touch(&self, position: Millimetres) -> bool {
        let behind = self.corner.first_contact(Direction::Retract) + self.tolerance;
        let ahead = self.touches_within();
        self.faces.iter().any(|face| {
            let distance = *face - position;
            distance < ahead && distance > -behind
        })
    }

    /// The first step whose face lies between `nearest` and `farthest` ahead of `position`.
    pub fn between(
        &self,
        position: Millimetres,
        nearest: Millimetres,
        farthest: Millimetres,
    ) -> Option<u8> {
        let on = |face: &Millimetres| *face - position > nearest && *face - position < farthest;
        Some(self.faces.iter().position(on)? as u8 + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps() -> Steps {
        Steps::try_build(&Rig::prototype()).expect("a sound rig")
    }

    #[test]
    fn a_step_is_due_from_its_window_on_and_its_corner_belongs_from_six_millimetres_before() {
        let steps = steps();
        for direction in Direction::ALL {
            let window = steps.corner.first_contact(direction) + steps.tolerance;
            let at = |ahead: Q16| Some(window + ahead);
            assert_eq!(steps.expectation(direction, at(Q16::DELTA)), Expectation::Ahead);
            assert_eq!(steps.expectation(direction, at(Q16::ZERO)), Expectation::Due);
            assert!(steps.belongs(direction, at(Q16::ZERO)));
            assert!(steps.belongs(direction, at(SEARCH)));
            assert!(!steps.belongs(direction, at(SEARCH + Q16::DELTA)));
            assert!(!steps.belongs(direction, None));
        }
    }

    #[test]
    fn a_crossing_runs_over_a_quarter_of_a_turn_s_chord() {
        // Of a rigid wheel of 25 mm that touches the edge of a step of 4 mm.
        let reach = steps().corner_reach().to_num::<f64>();
        assert!((reach - (25.0f64 * 25.0 - 21.0 * 21.0).sqrt()).abs() < 1e-3, "{reach}");
    }

    #[test]
    fn a_face_is_ahead_until_the_patch_is_clear_of_it() {
        let steps = steps();
        let (patch, face, next) = (steps.corner.patch(), q16(18_000_000), q16(40_000_000));
        let at = face + patch;
        assert_eq!(steps.next_face(at - Q16::DELTA), Some(Q16::DELTA - patch));
        assert_eq!(steps.next_face(at), Some(next - at));
        assert_eq!(steps.next_face(q16(75_000_000)), None);
    }

    #[test]
    fn a_corner_may_touch_from_its_first_contact_until_the_patch_is_clear_of_it() {
        // The first step of the prototype is at 18 mm, the second at 40 mm.
        let steps = steps();
        for (position, expected) in [
            (0.0, false),
            (3.0, false),
            (3.3, true),
            (12.0, true),
            (18.0, true),
            (24.2, true),
            (24.6, false),
            (25.0, false),
            (25.3, true),
            (70.0, false),
        ] {
            assert_eq!(steps.may_touch(Q16::from_num(position)), expected, "{position}");
        }
        let face = q16(18_000_000);
        let ahead = face - steps.touches_within();
        let behind = face + steps.corner.first_contact(Direction::Retract) + steps.tolerance;
        assert!(!steps.may_touch(ahead) && steps.may_touch(ahead + Q16::DELTA));
        assert!(steps.may_touch(behind - Q16::DELTA) && !steps.may_touch(behind));
    }
}
