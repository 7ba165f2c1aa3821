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
    /// Carriage's travel per tread's travel of a wheel without creep.
    pub advance: f64,
    /// Normal force over cosine sum.
    pub normal: f64,
    /// Load on the tread beside traction, N, positive against its motion. It relieves the drive
    /// of no more than its load.
    pub offset_n: f64,
}

/// How a step ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ended {
    /// Tread's speed, mm/s.
    pub tread: f64,
    /// Carriage's speed, mm/s.
    pub speed: f64,
    /// Force of the contact that resisted the tread, N, signed as the tread's speed.
    pub tread_load_n: f64,
}

impl Grip {
    /// Friction utilisation, traction over normal force, in a contact with these cosine and
    /// sine sums, N, and its derivatives by both, 1/N.
    #[must_use]
    pub fn utilisation(&self, cosine: f64, sine: f64) -> (f64, (f64, f64)) {
        if cosine <= 0.0 {
            return (0.0, (0.0, 0.0));
        }
        let most = self.mu * cosine;
        let mut asked = self.asked(self.tread, sine);
        let lag = self.inertia * self.rolling * self.creep;
        let per_part = self.yields * self.normal * most;
        let sense = if asked * self.tread < 0.0 { -1.0 } else { 1.0 };
        let mut whole = most;
        let mut used = Used::of(asked.abs(), whole, lag);
        // Against its motion only does a load count for the worm.
        let resists = self.load(sense * used.part * most) > 0.0;
        if resists {
            let slows = self.inertia * self.advance;
            asked -= slows * self.yields * self.offset_n * sense_of(self.tread);
            whole += slows * per_part;
            used = Used::of(asked.abs(), whole, lag);
        }
        let sense = if asked * self.tread < 0.0 { -1.0 } else { 1.0 };
        if resists && self.yields * self.load(sense * used.part * most) > self.tread.abs() {
            // Brought to rest within the step.
            (asked, whole) = (self.asked(0.0, sine), most);
            used = Used::of(asked.abs(), whole, lag);
        }
        let utilisation = (self.mu * used.part).copysign(asked);
        let per = used.left / (whole * used.left + lag).max(f64::MIN_POSITIVE);
        (utilisation, (-utilisation * per * whole / cosine, self.mu * per))
    }

    /// Speeds at the end with this utilisation.
    #[must_use]
    pub fn ended(&self, utilisation: f64, cosine: f64, sine: f64) -> Ended {
        let traction = utilisation * cosine;
        let sense = sense_of(self.tread);
        let tread_load_n = sense * self.load(sense * traction);
        let tread = self.tread - self.yields * tread_load_n;
        let tread = if tread * self.tread > 0.0 { tread } else { 0.0 };
        let speed = self.speed + (traction - sine - self.load_n) / self.inertia;
        // What is held stands.
        let stands = tread == 0.0 && speed.abs() < STANDS_BELOW;
        Ended { tread, speed: if stands { 0.0 } else { speed }, tread_load_n }
    }

    /// Load on the tread, N, with this traction, positive along its motion: nothing drives the
    /// worm.
    fn load(&self, traction_n: f64) -> f64 {
        if self.tread == 0.0 { 0.0 } else { (traction_n * self.normal + self.offset_n).max(0.0) }
    }

    /// Traction that takes the carriage to where a tread of this speed would without
    /// creep, N.
    fn asked(&self, tread: f64, sine: f64) -> f64 {
        sine + self.load_n + self.inertia * (self.advance * tread - self.speed)
    }

    /// Speed of the tread over the wall beyond its creep, mm/s.
    #[must_use]
    pub fn slides(&self, ended: &Ended) -> f64 {
        let slip = (self.advance * ended.tread - ended.speed).abs();
        let beyond = slip - SLIDES_FROM * self.creep * self.rolling;
        if beyond > STANDS_BELOW { beyond } else { 0.0 }
    }
}

/// Sign of a speed, zero for none.
fn sense_of(speed: f64) -> f64 {
    if speed == 0.0 { 0.0 } else { speed.signum() }
}

/// Part of friction in use.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Used {
    part: f64,
    /// 1 - part, to full precision.
    left: f64,
}

impl Used {
    /// Solves `whole p - lag ln(1 - p) = asked`, none of them negative, to a part of 1e-10.
    fn of(asked: f64, whole: f64, lag: f64) -> Self {
        if lag <= 0.0 {
            let part = if asked < whole { asked / whole } else { 1.0 };
            return Self { part, left: 1.0 - part };
        }
        let enough = 1e-10 * asked;
        // By the first two terms of the logarithm, and once by Newton's method.
        let first = asked / (whole + lag);
        let mut part = first - 0.5 * lag * first * first / (whole + lag);
        if first < 0.9 {
            for _ in 0..3 {
                let left = 1.0 - part;
                let over = whole * part - lag * left.ln() - asked;
                let change = over * left / (whole * left + lag);
                part -= change;
                // What Newton's method leaves, by the second derivative.
                let rest = 0.5 * lag * (change / left).powi(2);
                if rest <= enough && (0.0..1.0).contains(&part) {
                    return Self { part, left: 1.0 - part };
                }
            }
        }
        Self::slowly(asked, whole, lag, enough)
    }

    /// The same wherever that fails, from the side from which Newton's method cannot overstep.
    fn slowly(asked: f64, whole: f64, lag: f64, enough: f64) -> Self {
        if asked < whole {
            let mut part = (asked / whole).min(-(-asked / lag).exp_m1());
            for _ in 0..60 {
                let left = 1.0 - part;
                let over = whole * part - lag * left.ln() - asked;
                if over <= enough {
                    break;
                }
                part -= over * left / (whole * left + lag);
            }
            return Self { part, left: 1.0 - part };
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

    /// Utilisation and end of a step.
    fn at(grip: &Grip, cosine: f64, sine: f64) -> (f64, Ended) {
        let (utilisation, _) = grip.utilisation(cosine, sine);
        (utilisation, grip.ended(utilisation, cosine, sine))
    }

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
            offset_n: 0.0,
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
            prop_assert!(error.abs() <= 1.1e-10 * asked + grain, "{used:?}: {error}");
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
            let (used, ended) = at(&grip, 30.0, 0.0);
            let kinetic = |v: f64, u: f64| 0.5e-3 * (mass * v * v + 2.0 * u * u);
            let before = kinetic(speed, tread);
            prop_assert!(kinetic(ended.speed, ended.tread) <= before * (1.0 + 1e-9) + 1e-9);
            prop_assert!(used.abs() <= mu);
            // Friction acts against the slip that is left.
            let slip = ended.tread - ended.speed;
            prop_assert!(slip * used >= -1e-9 * before);
        }
    }

    #[test]
    fn steady_traction_carries_the_load_at_its_creep() {
        let mut grip = grip();
        let mut tread = 8.0;
        for _ in 0..100 {
            grip.rolling = tread;
            grip.tread = tread + grip.yields * 6.7 * 1.0;
            let (_, ended) = at(&grip, 33.3, 0.0);
            (tread, grip.speed) = (ended.tread, ended.speed);
        }
        let (used, ended) = at(&grip, 33.3, 0.0);
        let part = 6.7 / 33.3 / 1.1;
        assert!((used - 1.1 * part).abs() < 1e-6, "{used}");
        let creep = -0.01 * (1.0f64 - part).ln();
        assert!((ended.speed / ended.tread - (1.0 - creep)).abs() < 1e-5, "{ended:?}");
        assert_eq!(grip.slides(&ended), 0.0);
    }

    #[test]
    fn beyond_friction_it_slides() {
        let grip = Grip { load_n: 60.0, ..grip() };
        let (used, ended) = at(&grip, 33.3, 0.0);
        assert!((used - 1.1).abs() < 1e-12);
        assert!((ended.speed - (7.9 + 1.1 * 33.3 - 60.0)).abs() < 1e-9);
        assert!(grip.slides(&ended) > 20.0);
    }

    #[test]
    fn slopes_are_those_of_the_utilisation() {
        for (load_n, tread, offset_n) in [
            (6.7, 8.0, 0.0),
            (20.0, 7.0, 3.0),
            (20.0, 7.0, -3.0),
            (-20.0, 8.0, 0.0),
            (36.0, 8.0, 0.0),
            (30.0, 0.5, 0.0),
        ] {
            let grip = Grip { load_n, tread, offset_n, ..grip() };
            let (c, s, h) = (33.3, 4.0, 1e-5);
            let used = |c, s| grip.utilisation(c, s).0;
            let by_cosine = (used(c + h, s) - used(c - h, s)) / (2.0 * h);
            let by_sine = (used(c, s + h) - used(c, s - h)) / (2.0 * h);
            let slope = grip.utilisation(c, s).1;
            assert!((slope.0 - by_cosine).abs() < 1e-6 && (slope.1 - by_sine).abs() < 1e-6);
        }
    }

    #[test]
    fn off_the_wall_the_load_alone_acts() {
        let (used, ended) = at(&grip(), 0.0, 0.0);
        assert_eq!((used, ended.tread), (0.0, 8.0));
        assert!((ended.speed - 1.2).abs() < 1e-12);
    }

    #[test]
    fn a_weak_motor_is_brought_to_rest_and_not_through_it() {
        let grip = Grip { load_n: 30.0, tread: 0.1, speed: 0.0, rolling: 0.1, ..grip() };
        let (_, ended) = at(&grip, 33.3, 0.0);
        assert_eq!(ended.tread, 0.0);
        assert!(ended.speed <= 0.0 && ended.speed > -1.0, "{ended:?}");
        assert!(ended.tread_load_n > 29.0);
    }
}
