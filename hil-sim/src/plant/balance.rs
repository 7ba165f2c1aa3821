//! Radial balance of the wheel: the height at which contact carries the preload.

use super::ring::{Contact, Motion, Ring};

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
}

/// Radial load and how the wheel is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// Radial force that presses the wheel to the wall when its centre stands at
    /// its undeformed radius above the wall, N.
    pub preload_n: f64,
    /// How that force grows as the centre rises, N/mm: the pre-tightener's spring.
    pub spring_n_per_mm: f64,
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

impl Balance {
    /// Residual of the radial balance, N, its slope, N/mm, and the utilisation.
    fn residual(&self, contact: &Contact, lift_mm: f64) -> (f64, f64, f64) {
        let (c, s) = (contact.cosine_n, contact.sine_n);
        let (dc, ds) = contact.slope;
        let pressed = self.preload_n + self.spring_n_per_mm * lift_mm;
        let (force, slope, used) = match self.axial {
            Axial::Pushed => (c, dc, 0.0),
            Axial::Utilised(u) => (c + u * s, dc + u * ds, u),
            Axial::Driven(_) if c <= 0.0 => (0.0, 0.0, 0.0),
            Axial::Driven(load) => {
                let u = (load + s) / c;
                let du = (ds - u * dc) / c;
                (c + u * s, dc + u * ds + du * s, u)
            }
        };
        (force - pressed, slope - self.spring_n_per_mm, used)
    }

    /// Solves for the height, starting from the one in `motion`: Newton's method
    /// inside a bracket, which is halved when the step leaves it.
    ///
    /// # Errors
    /// [`BalanceError`] if the preload cannot be carried.
    pub fn solve(&self, ring: &Ring, motion: Motion) -> Result<Solved, BalanceError> {
        let radius = ring.parameters().radius_mm;
        let (mut low, mut high) = (0.2 * radius, 1.1 * radius + motion.wall.rise_mm);
        let tolerance = 1e-9 * self.preload_n.max(1.0);
        let mut height = motion.height_mm.clamp(low, high);
        let mut best = Solved { height_mm: height, contact: Contact::default(), utilisation: 0.0 };
        let mut best_residual = f64::INFINITY;
        for _ in 0..80 {
            let contact = ring.trial(&Motion { height_mm: height, ..motion });
            let (residual, slope, utilisation) = self.residual(&contact, height - radius);
            if residual.abs() < best_residual {
                best_residual = residual.abs();
                best = Solved { height_mm: height, contact, utilisation };
            }
            if residual.abs() <= tolerance || high - low < 1e-13 * radius {
                return Ok(best);
            }
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
        if best_residual <= 1e-3 * self.preload_n.max(1.0) {
            return Ok(best);
        }
        Err(BalanceError {
            preload_n: self.preload_n,
            residual_n: best_residual,
            height_mm: best.height_mm,
        })
    }
}
