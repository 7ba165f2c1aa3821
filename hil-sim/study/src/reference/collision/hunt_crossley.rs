//! The impact law of Hunt and Crossley, `F = D E delta^alpha (1 + chi V)`: what (14)
//! must read for its velocity factor to leave a force, with `[chi] = s/m`.

use crate::reference::case::{ReferenceError, positive, require};

/// A contact of this law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HuntCrossley {
    stiffness: f64,
    exponent: f64,
    chi: f64,
}

/// A mass that meets such a contact, at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// Time since the touch, s.
    pub t_s: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Its rate, m/s: positive inwards.
    pub speed_m_s: f64,
    /// Force, N.
    pub force_n: f64,
}

impl HuntCrossley {
    /// From `D E`, N/m^alpha, alpha, and chi, s/m.
    ///
    /// # Errors
    /// [`ReferenceError::OutOfRange`] if the stiffness is not above 0, alpha is outside
    /// 1 to 4, or chi is negative.
    pub fn new(stiffness: f64, exponent: f64, chi: f64) -> Result<Self, ReferenceError> {
        positive("stiffness", stiffness)?;
        require("exponent", exponent, (1.0..=4.0).contains(&exponent), "1 to 4")?;
        require("chi", chi, chi >= 0.0 && chi.is_finite(), "0 or more, finite")?;
        Ok(Self { stiffness, exponent, chi })
    }

    /// Force at this depth, m, and rate of depth, m/s.
    ///
    /// Equation: `F = D E delta^alpha (1 + chi V)`, never below 0, 0 out of contact.
    /// Units: N. Source: K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440.
    #[must_use]
    pub fn force_n(&self, depth_m: f64, speed_m_s: f64) -> f64 {
        if depth_m <= 0.0 {
            return 0.0;
        }
        self.stiffness * depth_m.powf(self.exponent) * (1.0 + self.chi * speed_m_s).max(0.0)
    }

    /// Largest depth, m, when `mass_kg` arrives at `speed_m_s`.
    ///
    /// Equation: from `m V dV = -F d(delta)`,
    /// `D E delta^(alpha+1)/(alpha+1) = m [chi V - ln(1 + chi V)]/chi^2`.
    #[must_use]
    pub fn peak_depth_m(&self, mass_kg: f64, speed_m_s: f64) -> f64 {
        let next = self.exponent + 1.0;
        (next * mass_kg * self.potential(speed_m_s) / self.stiffness).powf(1.0 / next)
    }

    /// Speed, m/s, at which what arrived at `speed_m_s` leaves; for any mass.
    ///
    /// Equation: the same potential at -V. For small `chi V`, `V (1 - 2 chi V/3)`.
    /// Always below 1/chi.
    #[must_use]
    pub fn rebound_m_s(&self, speed_m_s: f64) -> f64 {
        if self.chi == 0.0 {
            return speed_m_s;
        }
        let arrived = self.potential(speed_m_s);
        let (mut low, mut high) = (0.0, speed_m_s.min(1.0 / self.chi));
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return middle;
            }
            if self.potential(-middle) < arrived {
                low = middle;
            } else {
                high = middle;
            }
        }
    }

    /// The whole impact of `mass_kg` at `speed_m_s`, some `steps` instants long, the
    /// last of them out of contact again.
    ///
    /// Runge-Kutta of fourth order; its error falls with the fourth power of the step up to the
    /// kink at the end.
    ///
    /// # Errors
    /// [`ReferenceError::OutOfRange`] if mass or speed are not above 0 or `steps` is
    /// below 10.
    pub fn impact(
        &self,
        mass_kg: f64,
        speed_m_s: f64,
        steps: usize,
    ) -> Result<Vec<Instant>, ReferenceError> {
        positive("mass_kg", mass_kg)?;
        positive("speed_m_s", speed_m_s)?;
        require("steps", steps as f64, steps >= 10, "10 at least")?;
        // Way in and out at half the speed of arrival and of departure.
        let leaving = self.rebound_m_s(speed_m_s);
        let peak = self.peak_depth_m(mass_kg, speed_m_s);
        let dt = 2.0 * peak * (1.0 / speed_m_s + 1.0 / leaving) / steps as f64;
        let slope = |(x, v): (f64, f64)| (v, -self.force_n(x, v) / mass_kg);
        let moved = |(x, v): (f64, f64), (dx, dv): (f64, f64), h: f64| (x + h * dx, v + h * dv);
        let instant = |t_s: f64, (depth_m, speed_m_s): (f64, f64)| Instant {
            t_s,
            depth_m,
            speed_m_s,
            force_n: self.force_n(depth_m, speed_m_s),
        };
        let mut state = (0.0, speed_m_s);
        let mut course = vec![instant(0.0, state)];
        while state.0 >= 0.0 && course.len() < 20 * steps {
            let a = slope(state);
            let b = slope(moved(state, a, 0.5 * dt));
            let c = slope(moved(state, b, 0.5 * dt));
            let d = slope(moved(state, c, dt));
            let mean = |i: fn((f64, f64)) -> f64| (i(a) + 2.0 * (i(b) + i(c)) + i(d)) / 6.0;
            state = moved(state, (mean(|s| s.0), mean(|s| s.1)), dt);
            course.push(instant(dt * course.len() as f64, state));
        }
        Ok(course)
    }

    /// `[chi V - ln(1 + chi V)]/chi^2`, the integral of `V dV/(1 + chi V)`.
    fn potential(&self, speed: f64) -> f64 {
        let x = self.chi * speed;
        if x.abs() < 1e-3 {
            // The difference cancels.
            speed * speed * (0.5 - x * (1.0 / 3.0 - x * (0.25 - x * (0.2 - x / 6.0))))
        } else {
            (x - x.ln_1p()) / (self.chi * self.chi)
        }
    }
}
