//! Radial balance of the wheel: the height at which contact carries the preload.

use super::grip::Grip;
use super::ring::{Contact, Motion, Ring};
use super::wall::LocalWall;

/// How the wheel is moved along the sleeve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axial {
    /// Pushed at its axle, wall frictionless: no traction.
    Pushed,
    /// Turned by torque against this axial load, N, by Coulomb friction of equal
    /// utilisation over the whole contact.
    Driven(f64),
    /// Given friction utilisation, from a slip law or a sliding wheel.
    Utilised(f64),
    /// Turned by a motor, with the inertia of rotor and carriage, over a step of time.
    Carried(Grip),
}

/// Radial load and how the wheel is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// Radial force that presses the wheel to the wall when its centre stands at
    /// its undeformed radius above the wall, N.
    pub preload_n: f64,
    /// How that force grows as the centre rises, N/mm: the pre-tightener's spring. A slack
    /// spring does not pull.
    pub spring_n_per_mm: f64,
    /// What presses it beside the spring, N: load and vibration through the arm. It may lift
    /// the wheel, which then is pressed by nothing.
    pub arm_n: f64,
    /// How it is moved.
    pub axial: Axial,
}

/// A balanced contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solved {
    /// Height of the centre above the wall under it, mm.
    pub height_mm: f64,
    /// Contact there.
    pub contact: Contact,
    /// Friction utilisation, traction over normal force.
    pub utilisation: f64,
}

/// No height balances the preload.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "radial balance: no wheel height carries {preload_n} N (residual {residual_n} N at {height_mm} mm)"
)]
pub struct BalanceError {
    /// Preload asked for, N.
    pub preload_n: f64,
    /// Best residual, N.
    pub residual_n: f64,
    /// Height there, mm.
    pub height_mm: f64,
}

/// Part of the preload that is left unbalanced at most: a height of 1e-8 mm.
const TOLERANCE: f64 = 3e-8;

/// Part of the preload from which on a height is only on the way to the one that balances.
const FAR: f64 = 1e-4;

/// Part of the preload that one step of Newton's method makes good.
const NEAR: f64 = 1e-4;

/// A step so long that all memory has caught up, s.
const FOREVER_S: f64 = 1e9;

impl Balance {
    /// A constant radial force on the wheel, N.
    pub const fn under(preload_n: f64, axial: Axial) -> Self {
        Self { preload_n, spring_n_per_mm: 0.0, arm_n: 0.0, axial }
    }

    /// Residual of the radial balance, N, its slope, N/mm, and the utilisation, from
    /// the contact's cosine and sine sums, N, and their derivatives by height, N/mm.
    pub fn residual(
        &self,
        (c, s): (f64, f64),
        (dc, ds): (f64, f64),
        lift_mm: f64,
    ) -> (f64, f64, f64) {
        let (pressed, rate) = self.pressed(lift_mm);
        let (force, slope, used) = match self.axial {
            Axial::Pushed => (c, dc, 0.0),
            Axial::Utilised(u) => (c + u * s, dc + u * ds, u),
            Axial::Carried(grip) => {
                let (u, (by_c, by_s)) = grip.utilisation(c, s);
                let du = by_c * dc + by_s * ds;
                (c + u * s, dc + u * ds + du * s, u)
            }
            Axial::Driven(_) if c <= 0.0 => (0.0, 0.0, 0.0),
            Axial::Driven(load) => {
                let u = (load + s) / c;
                let du = (ds - u * dc) / c;
                (c + u * s, dc + u * ds + du * s, u)
            }
        };
        (force - pressed, slope - rate, used)
    }

    /// What presses the wheel at this lift, N, and how that grows, N/mm.
    pub(crate) fn pressed(&self, lift_mm: f64) -> (f64, f64) {
        let spring = (self.preload_n + self.spring_n_per_mm * lift_mm).max(0.0);
        let pressed = (spring + self.arm_n).max(0.0);
        let taut = spring > 0.0 && pressed > 0.0;
        (pressed, if taut { self.spring_n_per_mm } else { 0.0 })
    }

    /// Solves for the height, starting from the one in `motion`: Newton's method
    /// inside a bracket, which is halved when the step leaves it. A wheel that nothing
    /// presses stays there, or gives way to the wall as far as it has to.
    pub fn solve(&self, ring: &mut Ring, motion: Motion) -> Result<Solved, BalanceError> {
        self.search(ring, motion, None)
    }

    /// Brings a ring to rest on this wall under a radial load, N, from this height above it,
    /// mm, its rubber relaxed.
    pub(crate) fn rest(
        ring: &mut Ring,
        wall: LocalWall,
        height_mm: f64,
        preload_n: f64,
    ) -> Result<Solved, BalanceError> {
        let motion = Motion { wall, height_mm, turn_rad: 0.0, dt_s: FOREVER_S };
        let solved = Self::under(preload_n, Axial::Pushed).solve(ring, motion)?;
        ring.commit(&Motion { height_mm: solved.height_mm, ..motion });
        Ok(solved)
    }

    /// The same where the height in `motion` is predicted so well that one step of Newton's
    /// method does: if less than a small part of the preload is left there, the contact is moved
    /// by its derivatives and not computed again. Its force errs by a part of 1e-7.
    pub(crate) fn solve_near(
        &self,
        ring: &mut Ring,
        motion: Motion,
    ) -> Result<Solved, BalanceError> {
        let contact = ring.trial(&motion);
        let lift = motion.height_mm - ring.parameters().radius_mm;
        let forces = (contact.cosine_n, contact.sine_n);
        let (residual, slope, utilisation) = self.residual(forces, contact.slope, lift);
        let scale = (self.preload_n + self.arm_n).max(1.0);
        if contact.cosine_n == 0.0 && residual.abs() <= TOLERANCE * scale {
            // It hangs on its spring.
            return Ok(Solved { height_mm: motion.height_mm, contact, utilisation });
        }
        if residual.abs() <= NEAR * scale && slope < 0.0 && contact.cosine_n > 0.0 {
            let change = -residual / slope;
            let contact = contact.moved(change);
            let forces = (contact.cosine_n, contact.sine_n);
            let utilisation = self.residual(forces, contact.slope, lift + change).2;
            return Ok(Solved { height_mm: motion.height_mm + change, contact, utilisation });
        }
        self.search(ring, motion, Some((residual, slope)))
    }

    /// Newton's method inside a bracket, which is halved when the step leaves it; `known` are
    /// residual and slope at the height in `motion`.
    fn search(
        &self,
        ring: &mut Ring,
        motion: Motion,
        known: Option<(f64, f64)>,
    ) -> Result<Solved, BalanceError> {
        let radius = ring.parameters().radius_mm;
        // A wheel may hang higher.
        let highest = (1.1 * radius + motion.wall.rise_mm).max(motion.height_mm);
        let (mut low, mut high) = (0.2 * radius, highest);
        let scale = (self.preload_n + self.arm_n).max(1.0);
        let tolerance = TOLERANCE * scale;
        let start = motion.height_mm.clamp(low, high);
        let mut height = start;
        let (mut best, mut best_residual) = (None, f64::INFINITY);
        // So far off, the next height will not balance either: only what leads on from it
        // is computed.
        let mut far = true;
        if let Some((residual, slope)) = known.filter(|_| start == motion.height_mm) {
            (low, high) = if residual > 0.0 { (start, high) } else { (low, start) };
            let newton = start - residual / slope;
            if slope < 0.0 && newton > low && newton < high {
                height = newton;
                far = residual.abs() > FAR * scale;
            } else if residual != 0.0 {
                height = 0.5 * (low + high);
            } else {
                (low, high) = (0.2 * radius, highest);
            }
        }
        for _ in 0..80 {
            let at = Motion { height_mm: height, ..motion };
            let whole = if far { None } else { Some(ring.trial(&at)) };
            let (forces, slopes) = match &whole {
                Some(contact) => ((contact.cosine_n, contact.sine_n), contact.slope),
                None => ring.forces(&at),
            };
            let (residual, slope, utilisation) = self.residual(forces, slopes, height - radius);
            // Carried; or closed in on a kink, or on an end without a balance.
            let closed = high - low < 1e-13 * radius;
            if residual.abs() <= tolerance && forces.0 == 0.0 && height != start && !closed {
                // Nothing presses, and nothing is touched: back to where it stood at most.
                if height > start {
                    high = height;
                    height = (0.5 * (low + high)).max(start);
                } else {
                    low = height;
                    height = (0.5 * (low + high)).min(start);
                }
                continue;
            }
            if let Some(contact) = whole
                && residual.abs() < best_residual
            {
                best_residual = residual.abs();
                best = Some(Solved { height_mm: height, contact, utilisation });
            }
            if !far && (residual.abs() <= tolerance || closed) {
                break;
            }
            if far && (residual.abs() <= tolerance || closed) {
                far = false;
                continue;
            }
            far = residual.abs() > FAR * scale;
            // Too much force: the centre must stand higher.
            if residual > 0.0 {
                low = height;
            } else {
                high = height;
            }
            let newton = height - residual / slope;
            height = if slope < 0.0 && newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
        }
        best.filter(|_| best_residual <= 1e-3 * scale).ok_or(BalanceError {
            preload_n: self.preload_n,
            residual_n: best_residual,
            height_mm: best.map_or(height, |solved| solved.height_mm),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::ring::RingParameters;
    use crate::plant::wall::{Step, Wall};
    use crate::plant::wind_up::{Shear, WindUp};
    use interstage::rig::Rig;

    /// A ring on both floor and corner, and a motion that leaves it there.
    fn climbing() -> (Ring, Motion) {
        let ring = Ring::new(RingParameters::of(&Rig::fe(), 1440));
        let wall = Wall::new(vec![Step { position_mm: 13.0, height_mm: 4.0 }]).local(0.0);
        (ring, Motion { wall, height_mm: 24.8, turn_rad: 0.0, dt_s: 0.2 })
    }

    fn solve(preload_n: f64, spring_n_per_mm: f64, axial: Axial) -> Solved {
        let (mut ring, motion) = climbing();
        Balance { preload_n, spring_n_per_mm, arm_n: 0.0, axial }.solve(&mut ring, motion).unwrap()
    }

    /// A wheel that has just met a corner and loses speed against it.
    fn carried(load_n: f64) -> Grip {
        let shear = Shear::of(&RingParameters::of(&Rig::fe(), 1440), 1.0);
        Grip {
            mu: 0.9,
            winding: WindUp::default().over(&shear, 8.0, 6.0, 1e-3),
            load_n,
            inertia: 1.0,
            speed: 8.0,
            tread: 8.0,
            yields: 0.025,
            advance: 1.0,
            normal: 1.02,
            offset_n: 0.0,
        }
    }

    /// One that was pressed by a rounding more than its weight lifts fell onto the wall.
    #[test]
    fn a_wheel_that_hangs_on_its_spring_stays_there() {
        let (mut ring, motion) = climbing();
        let (preload_n, spring_n_per_mm, radius_mm) = (-1.7, 1.2, ring.parameters().radius_mm);
        let height_mm = radius_mm + 14.2;
        let spring_n: f64 = preload_n + spring_n_per_mm * (height_mm - radius_mm);
        let (arm_n, axial) = (-spring_n.next_down(), Axial::Utilised(0.0));
        let balance = Balance { preload_n, spring_n_per_mm, arm_n, axial };
        let solved = balance.solve_near(&mut ring, Motion { height_mm, ..motion }).unwrap();
        assert_eq!(solved.height_mm, height_mm);
    }

    #[test]
    fn the_forces_balance() {
        let [rate, load, used] = [1.2, 6.7, 0.8];
        for preload in [60.0, 150.0] {
            for axial in [
                Axial::Pushed,
                Axial::Driven(load),
                Axial::Utilised(used),
                Axial::Carried(carried(load)),
            ] {
                let solved = solve(preload, rate, axial);
                let (c, s) = (solved.contact.cosine_n, solved.contact.sine_n);
                assert!(solved.contact.floor_n > 0.0 && solved.contact.step_sine_n > 0.0);
                let thrust = solved.utilisation * c - s;
                let pressed = preload + rate * (solved.height_mm - 25.0);
                match axial {
                    Axial::Driven(_) => assert!((thrust - load).abs() < 1e-6),
                    Axial::Carried(grip) => {
                        let speed = grip.speed + (thrust - load) / grip.inertia;
                        assert!((grip.ended(solved.utilisation, c, s).speed - speed).abs() < 1e-6);
                    }
                    _ => {}
                }
                let carried = c + solved.utilisation * s;
                assert!((carried - pressed).abs() < 1e-5, "{axial:?}: {carried} {pressed}");
            }
        }
    }

    #[test]
    fn a_height_foreseen_is_the_one_searched_for() {
        let (mut ring, motion) = climbing();
        let balance = Balance {
            preload_n: 60.0,
            spring_n_per_mm: 1.2,
            arm_n: 0.0,
            axial: Axial::Carried(carried(6.7)),
        };
        let found = balance.solve(&mut ring, motion).unwrap();
        // One and three hundredths of a micrometre off, and far off.
        for off in [1e-5, -3e-5, 0.3, -0.2] {
            let motion = Motion { height_mm: found.height_mm + off, ..motion };
            let near = balance.solve_near(&mut ring, motion).unwrap();
            assert!((near.height_mm - found.height_mm).abs() < 2e-8, "{off}: {near:?}");
            let carried = near.contact.cosine_n + near.utilisation * near.contact.sine_n;
            let pressed = balance.pressed(near.height_mm - 25.0).0;
            assert!((carried - pressed).abs() < 1e-6 * pressed, "{off}: {carried} {pressed}");
        }
    }

    #[test]
    fn what_nothing_presses_stays_or_gives_way() {
        let (mut ring, motion) = climbing();
        let balance =
            Balance { preload_n: -3.6, spring_n_per_mm: 1.2, arm_n: 0.0, axial: Axial::Pushed };
        // Clear of the wall it stays; where the spring presses it, it comes back to that.
        for (start, end) in [(27.0, 27.0), (28.0, 28.0), (28.0 + 1e-15, 28.0), (30.0, 28.0)] {
            let motion = Motion { height_mm: start, ..motion };
            for solved in [balance.solve(&mut ring, motion), balance.solve_near(&mut ring, motion)]
            {
                let solved = solved.unwrap();
                assert!((solved.height_mm - end).abs() < 1e-6, "{start}: {solved:?}");
                assert_eq!(solved.contact.normal_n, 0.0);
            }
        }
        // In the wall's way it is lifted out, to where it just touches.
        let solved = balance.solve(&mut ring, Motion { height_mm: 24.0, ..motion }).unwrap();
        assert!(solved.contact.normal_n < 1e-6, "{solved:?}");
        // The corner may lie between two elements.
        assert!((0.0..0.055).contains(&solved.contact.depth_mm), "{solved:?}");
    }

    #[test]
    fn a_wheel_that_nothing_presses_stays_with_the_wall() {
        let (mut ring, motion) = climbing();
        let wall = Wall::new(vec![Step { position_mm: 23.6, height_mm: 17.3 }]).local(0.0);
        // Lifted by the arm from a high corner, it is not carried on to where the spring takes
        // hold, 4 to 9 mm above.
        for tenths in 50..110 {
            let arm_n = -20.0 - 0.1 * f64::from(tenths);
            let axial = Axial::Carried(carried(5.2));
            let balance = Balance { preload_n: 20.0, spring_n_per_mm: 1.2, arm_n, axial };
            for height_mm in [24.0, 24.5, 25.0] {
                let motion = Motion { wall, height_mm, ..motion };
                let solved = balance.solve_near(&mut ring, motion).unwrap();
                assert!(solved.height_mm < 25.7, "{arm_n} N: {solved:?}");
            }
        }
    }

    #[test]
    fn a_preload_that_nothing_carries_is_told() {
        let (mut ring, motion) = climbing();
        let balance = Balance::under(1e9, Axial::Pushed);
        let error = balance.solve(&mut ring, motion).unwrap_err();
        assert_eq!(error.preload_n, 1e9);
        assert!(error.to_string().starts_with("radial balance: no wheel height carries"));
    }
}
