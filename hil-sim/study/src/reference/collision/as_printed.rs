//! Equations 17 and 28 as printed. Not to be used: kept to show what they do.
//!
//! Both are meant as the same factor D of the collision force. At the corner of 90
//! degrees that the study takes them at, `tan theta` has no bound: (17) divides by it
//! and (28), which should follow from (17), multiplies by it. One gives no force
//! whatever the preload, the other an unbounded one. [`super::hereditary`] has the cone
//! with the angle counted from the surface, [`super::quasi_static()`] the straight edge.

use std::f64::consts::PI;

/// What the two equations are made of, in the study's letters, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Printed {
    /// Angle theta as the study counts it, degrees.
    pub theta_deg: f64,
    /// Contact area A, m^2.
    pub area_m2: f64,
    /// Wheel radius R, m.
    pub radius_m: f64,
    /// l: in (17) the tread's thickness, in (25) the wheel's width; (28) has both as one.
    pub l_m: f64,
    /// Tangential friction F_q, N.
    pub friction_n: f64,
    /// Modulus E* and loss modulus E'', Pa.
    pub modulus_pa: (f64, f64),
    /// Shear modulus G_inf, Pa.
    pub shear_pa: f64,
    /// Normal force p of (21).
    pub normal_n: f64,
    /// Speed v, m/s, and relaxation time tau, s.
    pub speed_m_s: f64,
    /// Relaxation time tau, s.
    pub tau_s: f64,
    /// K_h of (21).
    pub hysteresis: f64,
}

impl Printed {
    /// (17): `D = 2 A R/(pi tan theta l)`. 0 at 90 degrees.
    #[must_use]
    pub fn d_17(&self) -> f64 {
        2.0 * self.area_m2 * self.radius_m / (PI * tan_deg(self.theta_deg) * self.l_m)
    }

    /// (28): `D = 48 l R^1/2 F_q E*^2 p R^2 pi tan theta l
    /// / (16 (3 v tau E*^2 p + 4 R K_h E'') G_inf R^1/2)`. Infinite at 90 degrees.
    #[must_use]
    pub fn d_28(&self) -> f64 {
        let (modulus, loss) = self.modulus_pa;
        let root = self.radius_m.sqrt();
        let pressed = modulus * modulus * self.normal_n;
        let over = 48.0
            * self.l_m
            * root
            * self.friction_n
            * pressed
            * self.radius_m.powi(2)
            * PI
            * tan_deg(self.theta_deg)
            * self.l_m;
        let rolling = 3.0 * self.speed_m_s * self.tau_s * pressed;
        let hysteresis = 4.0 * self.radius_m * self.hysteresis * loss;
        over / (16.0 * (rolling + hysteresis) * self.shear_pa * root)
    }
}

/// The tangent of an angle in degrees, infinite at 90: in radians, 90 degrees is no
/// number of this format and its tangent merely large.
fn tan_deg(degrees: f64) -> f64 {
    if degrees == 90.0 { f64::INFINITY } else { degrees.to_radians().tan() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(theta_deg: f64) -> Printed {
        Printed {
            theta_deg,
            area_m2: 1e-4,
            radius_m: 0.025,
            l_m: 0.028,
            friction_n: 20.0,
            modulus_pa: (5e6, 1e6),
            shear_pa: 1.6e6,
            normal_n: 100.0,
            speed_m_s: 5e-3,
            tau_s: 0.1,
            hysteresis: 1.0,
        }
    }

    #[test]
    fn at_ninety_degrees_one_vanishes_and_the_other_is_unbounded() {
        assert_eq!(corner(90.0).d_17(), 0.0);
        assert_eq!(corner(90.0).d_28(), f64::INFINITY);
    }

    #[test]
    fn towards_ninety_degrees_they_go_opposite_ways() {
        let mut last = corner(10.0);
        for theta in [30.0, 45.0, 60.0, 80.0, 89.0, 89.9] {
            let next = corner(theta);
            assert!(next.d_17() < last.d_17() && next.d_28() > last.d_28(), "{theta}");
            // tan inverted: their product does not depend on the angle.
            let product = |p: Printed| p.d_17() * p.d_28();
            assert!((product(next) / product(last) - 1.0).abs() < 1e-12);
            last = next;
        }
    }

    #[test]
    fn their_units_differ() {
        // Lengths doubled, all else held: (17) scales as A R / l, (28) as l^2 R^2 over
        // a sum, so they cannot be one factor.
        let small = corner(45.0);
        let large = Printed { area_m2: 4e-4, radius_m: 0.05, l_m: 0.056, ..small };
        assert!((large.d_17() / small.d_17() - 4.0).abs() < 1e-12);
        let ratio = large.d_28() / small.d_28();
        assert!(ratio > 8.0 && ratio <= 16.0, "{ratio}");
    }
}
