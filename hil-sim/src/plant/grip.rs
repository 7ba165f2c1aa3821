//! Traction over a step of time: motor, tread, friction and carriage at once.
//!
//! Whether a wheel grips depends on the force on it, and that force on how fast the carriage
//! is taken along. Taken one after the other, with the forces of the step before, a carriage
//! is caught at once that friction would have to accelerate, and energy comes from nowhere.
//! Here the friction cone is resolved within the step: its end velocities are those that its
//! forces give.

/// Logarithm of the part of friction left over, from which on a wheel counts as sliding:
/// 99.9 % of it used.
pub(super) const SLIDES_FROM: f64 = 6.907_755_278_982_137;

/// Slip that is rounding, mm/s.
const STANDS_BELOW: f64 = 1e-9;

/// A driven wheel on a step of time from known speeds.
///
/// With p the part of friction used, q = -ln(1 - p) and sigma the speed of the tread, the
/// tread creeps by `sigma creep q`: at first in proportion to p, without bound as p comes
/// to 1. With c and s the cosine and sine sums of the contact and m/dt its inertia, the
/// carriage ends the step at `v1 = v0 + (mu p c - s - load) dt/m`, and friction is that for
/// which this is `advance u1 - sigma creep q`, u1 being the tread's speed then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Friction of tread on wall.
    pub mu: f64,
    /// Creepage at 63 % of friction.
    pub creep: f64,
    /// Speed of the tread that it creeps in proportion to, mm/s, not negative.
    pub rolling: f64,
    /// Axial load on the carriage, N.
    pub load_n: f64,
    /// Carriage's inertia over the step, N per mm/s.
    pub inertia: f64,
    /// Carriage's speed at the step's start, mm/s.
    pub speed: f64,
    /// Tread's speed at the step's end if nothing resists, mm/s.
    pub tread: f64,
    /// What a resisting newton takes off it, mm/s. Nothing drives the worm.
    pub yields: f64,
    /// Carriage's way per tread's way of a wheel without creep.
    pub advance: f64,
    /// Normal force over cosine sum.
    pub normal: f64,
}

/// What a [`Grip`] comes to in a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traction {
    /// Friction utilisation, traction over normal force.
    pub utilisation: f64,
    /// Its derivatives by cosine and sine sum, 1/N.
    pub slope: (f64, f64),
    /// Tread's speed at the step's end, mm/s.
    pub tread: f64,
    /// Carriage's speed at the step's end, mm/s.
    pub speed: f64,
    /// Force of the contact that resists the tread, N, signed as the tread's speed.
    pub resists_n: f64,
}

impl Grip {
    /// Traction in a contact with these cosine and sine sums, N.
    #[must_use]
    pub fn at(&self, cosine: f64, sine: f64) -> Traction {
        if cosine <= 0.0 {
            let speed = self.speed - (sine + self.load_n) / self.inertia;
            return Traction { tread: self.tread, speed, ..Traction::default() };
        }
        let most = self.mu * cosine;
        let asked = self.asked(self.tread, sine);
        // Against its motion only does a load count for the worm.
        let per_part =
            if asked * self.tread > 0.0 { self.yields * self.normal * most } else { 0.0 };
        let lag = self.inertia * self.rolling * self.creep;
        let whole = most + self.inertia * self.advance * per_part;
        let used = Used::of(asked.abs(), whole, lag);
        let sense = asked.signum();
        let tread = self.tread - sense * per_part * used.part;
        if tread * self.tread < 0.0 {
            // Brought to rest within the step.
            let asked = self.asked(0.0, sine);
            let used = Used::of(asked.abs(), most, lag);
            return self.with(used, asked.signum(), most, lag, (cosine, sine), 0.0, true);
        }
        self.with(used, sense, whole, lag, (cosine, sine), tread, per_part > 0.0)
    }

    /// Traction that takes the carriage to where a tread of this speed would without
    /// creep, N.
    fn asked(&self, tread: f64, sine: f64) -> f64 {
        sine + self.load_n + self.inertia * (self.advance * tread - self.speed)
    }

    #[allow(clippy::too_many_arguments)]
    fn with(
        &self,
        used: Used,
        sense: f64,
        whole: f64,
        lag: f64,
        (cosine, sine): (f64, f64),
        tread: f64,
        resists: bool,
    ) -> Traction {
        let per = used.left / (whole * used.left + lag).max(f64::MIN_POSITIVE);
        let utilisation = sense * self.mu * used.part;
        let traction = utilisation * cosine;
        Traction {
            utilisation,
            slope: (-utilisation * per * whole / cosine, self.mu * per),
            tread,
            speed: self.speed + (traction - sine - self.load_n) / self.inertia,
            resists_n: if resists { traction * self.normal } else { 0.0 },
        }
    }

    /// Way of the tread over the wall beyond its creep, mm/s.
    #[must_use]
    pub fn slides(&self, traction: &Traction) -> f64 {
        let slip = (self.advance * traction.tread - traction.speed).abs();
        let beyond = slip - SLIDES_FROM * self.creep * self.rolling;
        if beyond > STANDS_BELOW { beyond } else { 0.0 }
    }
}

/// Part of friction in use.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Used {
    part: f64,
    /// 1 - part, to full precision.
    left: f64,
}

impl Used {
    /// Solves `whole p - lag ln(1 - p) = asked`, none of them negative, to a part of 1e-12:
    /// Newton's method, from the side from which it cannot overstep.
    fn of(asked: f64, whole: f64, lag: f64) -> Self {
        let enough = 1e-12 * asked;
        if asked < whole {
            let mut part = asked / whole;
            if lag > 0.0 {
                part = part.min(-(-asked / lag).exp_m1());
                for _ in 0..60 {
                    let left = 1.0 - part;
                    let over = whole * part - lag * left.ln() - asked;
                    if over <= enough {
                        break;
                    }
                    part -= over * left / (whole * left + lag);
                }
            }
            return Self { part, left: 1.0 - part };
        }
        if lag <= 0.0 {
            return Self { part: 1.0, left: 0.0 };
        }
        // In q, which goes on where p has come to 1.
        let mut q = ((asked - whole) / lag).max(asked / (whole + lag));
        for _ in 0..60 {
            let left = (-q).exp();
            let short = asked - whole * (1.0 - left) - lag * q;
            if short <= enough {
                break;
            }
            q += short / (whole * left + lag);
        }
        Self { part: -(-q).exp_m1(), left: (-q).exp() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grip() -> Grip {
        Grip {
            mu: 1.1,
            creep: 0.01,
            rolling: 8.0,
            load_n: 6.7,
            inertia: 1.0,
            speed: 7.9,
            tread: 8.0,
            yields: 0.025,
            advance: 1.0,
            normal: 1.0,
        }
    }

    proptest! {
        #[test]
        fn friction_solves_its_equation(
            asked in -9.0f64..6.0, whole in -6.0f64..6.0, lag in -12.0f64..6.0,
        ) {
            let [asked, whole, lag] = [asked, whole, lag].map(|exponent| 10f64.powf(exponent));
            let used = Used::of(asked, whole, lag);
            prop_assert!((0.0..=1.0).contains(&used.part) && used.left >= 0.0);
            // Where p is known no better than to its last bit, so is its logarithm.
            let error = whole * used.part - lag * used.left.ln() - asked;
            let grain = lag * 2e-16 / used.left + 2e-16 * whole;
            prop_assert!(error.abs() <= 2e-12 * asked + grain, "{used:?}: {error}");
        }

        /// What the traction does to tread and carriage takes energy from them, or moves it
        /// between them: none appears.
        #[test]
        fn nothing_is_gained_by_friction(
            speed in -500.0f64..500.0, tread in -500.0f64..500.0, mass in -3.0f64..3.0,
            mu in 0.0f64..3.0, rolling in 0.0f64..500.0, dt in -6.0f64..-2.0,
        ) {
            let (mass, dt) = (10f64.powf(mass), 10f64.powf(dt));
            let grip = Grip {
                mu, speed, tread, rolling, load_n: 0.0, inertia: 1e-3 * mass / dt,
                yields: 1000.0 * dt / 2.0, ..grip()
            };
            let ended = grip.at(30.0, 0.0);
            let kinetic = |v: f64, u: f64| 0.5e-3 * (mass * v * v + 2.0 * u * u);
            let before = kinetic(speed, tread);
            prop_assert!(kinetic(ended.speed, ended.tread) <= before * (1.0 + 1e-9) + 1e-9);
            prop_assert!(ended.utilisation.abs() <= mu);
            // Friction acts against the slip that is left.
            let slip = ended.tread - ended.speed;
            prop_assert!(slip * ended.utilisation >= -1e-9 * before);
        }
    }

    #[test]
    fn steady_traction_carries_the_load_at_its_creep() {
        let mut grip = grip();
        let mut tread = 8.0;
        for _ in 0..100 {
            grip.rolling = tread;
            grip.tread = tread + grip.yields * 6.7 * 1.0;
            let ended = grip.at(33.3, 0.0);
            (tread, grip.speed) = (ended.tread, ended.speed);
        }
        let ended = grip.at(33.3, 0.0);
        let part = 6.7 / 33.3 / 1.1;
        assert!((ended.utilisation - 1.1 * part).abs() < 1e-6, "{ended:?}");
        let creep = -0.01 * (1.0f64 - part).ln();
        assert!((ended.speed / ended.tread - (1.0 - creep)).abs() < 1e-5, "{ended:?}");
        assert_eq!(grip.slides(&ended), 0.0);
    }

    #[test]
    fn beyond_friction_it_slides() {
        let grip = Grip { load_n: 60.0, ..grip() };
        let ended = grip.at(33.3, 0.0);
        assert!((ended.utilisation - 1.1).abs() < 1e-12);
        assert!((ended.speed - (7.9 + 1.1 * 33.3 - 60.0)).abs() < 1e-9);
        assert!(grip.slides(&ended) > 20.0);
    }

    #[test]
    fn slopes_are_those_of_the_utilisation() {
        for (load_n, tread) in [(6.7, 8.0), (20.0, 7.0), (-20.0, 8.0), (36.0, 8.0), (30.0, 0.5)] {
            let grip = Grip { load_n, tread, ..grip() };
            let (c, s, h) = (33.3, 4.0, 1e-5);
            let apart = |a: Traction, b: Traction| (a.utilisation - b.utilisation) / (2.0 * h);
            let by_cosine = apart(grip.at(c + h, s), grip.at(c - h, s));
            let by_sine = apart(grip.at(c, s + h), grip.at(c, s - h));
            let slope = grip.at(c, s).slope;
            assert!((slope.0 - by_cosine).abs() < 1e-6 && (slope.1 - by_sine).abs() < 1e-6);
        }
    }

    #[test]
    fn off_the_wall_the_load_alone_acts() {
        let ended = grip().at(0.0, 0.0);
        assert_eq!((ended.utilisation, ended.tread), (0.0, 8.0));
        assert!((ended.speed - 1.2).abs() < 1e-12);
    }

    #[test]
    fn a_weak_motor_is_brought_to_rest_and_not_through_it() {
        let grip = Grip { load_n: 30.0, tread: 0.1, speed: 0.0, rolling: 0.1, ..grip() };
        let ended = grip.at(33.3, 0.0);
        assert_eq!(ended.tread, 0.0);
        assert!(ended.speed <= 0.0 && ended.speed > -1.0, "{ended:?}");
        assert!(ended.resists_n > 29.0);
    }
}
