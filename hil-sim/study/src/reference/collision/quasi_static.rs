//! The crossing without inertia: at every place the contact carries the preload.

use super::crossing::{Crossing, Recorder, Way, ring};
use crate::reference::case::Case;
use crate::reference::error::ReferenceError;
use hil_sim::plant::balance::Balance;
use hil_sim::plant::ring::{Contact, Motion, Ring};

/// Where a crossing stands.
pub(super) struct Rolling {
    pub(super) ring: Ring,
    pub(super) t_s: f64,
    pub(super) x_mm: f64,
    pub(super) y_mm: f64,
    /// Contact there.
    pub(super) contact: Contact,
    pub(super) utilisation: f64,
}

impl Rolling {
    /// The wheel put down at the start of its way.
    pub(super) fn start(case: &Case, way: &Way) -> Self {
        Self {
            ring: ring(case),
            t_s: 0.0,
            x_mm: way.start_mm,
            y_mm: way.radius_mm - 0.01,
            contact: Contact::default(),
            utilisation: 0.0,
        }
    }

    /// On by one stride at most, to `to_mm` at most.
    pub(super) fn advance(
        &mut self,
        case: &Case,
        way: &Way,
        to_mm: f64,
    ) -> Result<(), ReferenceError> {
        let stride = case.resolution.stride_mm.min(to_mm - self.x_mm);
        let dt = stride / case.speed_mm_s;
        let x = self.x_mm + stride;
        let motion = way.motion(x, self.y_mm, stride / way.radius_mm, dt);
        let balance = Balance {
            preload_n: case.preload_n,
            spring_n_per_mm: 0.0,
            arm_n: 0.0,
            axial: case.axial,
        };
        let solved = balance.solve(&mut self.ring, motion)?;
        self.ring.commit(&Motion { height_mm: solved.height_mm, ..motion });
        self.t_s += dt;
        self.x_mm = x;
        self.y_mm = solved.height_mm + motion.wall.base_mm;
        self.contact = solved.contact;
        self.utilisation = solved.utilisation;
        Ok(())
    }

    /// On until `to_mm`, calling `seen` after every stride.
    pub(super) fn run(
        &mut self,
        case: &Case,
        way: &Way,
        to_mm: f64,
        mut seen: impl FnMut(&Self),
    ) -> Result<(), ReferenceError> {
        // A rest below this is rounding of the sum of strides.
        while to_mm - self.x_mm > 1e-9 {
            self.advance(case, way, to_mm)?;
            seen(self);
        }
        Ok(())
    }
}

/// The crossing without inertia.
///
/// Equation: `sum of p cos(psi) R dpsi L = P` over ring elements with the memory of the
/// three-parameter solid, p >= 0; the collision force is the same sum with sin(psi).
/// Sign: force against the motion positive. Units: as the fields say.
/// Range: that of [`Case::check`]; inertia must not matter, see [`super::dynamic()`].
/// Error: gap and force within 0.1 % of the converged ring at [`Resolution::HISTORY`],
/// 0.02 % at [`Resolution::FIGURE`]. Cost: some 10^4 strides of a few hundred elements.
/// Source: derived; without memory it is [`super::elastic`].
///
/// [`Resolution::HISTORY`]: crate::reference::Resolution::HISTORY
/// [`Resolution::FIGURE`]: crate::reference::Resolution::FIGURE
///
/// # Errors
/// [`ReferenceError`] if an argument is out of range or the preload cannot be carried.
pub fn quasi_static(case: &Case) -> Result<Crossing, ReferenceError> {
    case.check()?;
    let way = Way::of(case);
    let mut rolling = Rolling::start(case, &way);
    rolling.run(case, &way, way.shown_mm, |_| {})?;
    let mut recorder = Recorder::default();
    rolling.run(case, &way, way.end_mm, |now| {
        recorder.take(&way, case, (now.t_s, now.x_mm, now.y_mm), &now.contact, now.utilisation);
    })?;
    Ok(recorder.finish(case))
}
