//! Traction over a step of time: motor, tread, friction and carriage at once.
//!
//! Whether a wheel grips depends on the force on it, and that force on how fast the carriage
//! is taken along. Taken one after the other, with the forces of the step before, a carriage
//! is caught at once that friction would have to accelerate, and energy comes from nowhere.
//! Here the friction cone is resolved within the step: its end velocities are those that its
//! forces give, and so does the tread between them ([`wind_up`](super::wind_up)).

use super::wind_up::Winding;

/// Slip that is rounding, mm/s.
const STANDS_BELOW: f64 = 1e-9;

/// A driven wheel on a step of time from known speeds.
///
/// With p the part of friction used, c and s the cosine and sine sums of the contact and m/dt the
/// carriage's inertia, the carriage ends the step at `v1 = v0 + (mu p c - s - load) dt/m`.
/// Friction is that for which this is the speed of a gripping wheel, `advance u1` with the
/// tread's speed u1, less what the tread winds up and creeps by: at first in proportion to
/// traction, by Carter (1926) `2 (1 - sqrt(1 - p)) / p` times as much, twice at the limit of
/// friction, where it slides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Friction of tread on wall.
    pub mu: f64,
    /// How the tread winds up.
    pub winding: Winding,
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
pub(crate) struct Ended {
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
    pub(crate) fn utilisation(&self, cosine: f64, sine: f64) -> (f64, (f64, f64)) {
        if cosine <= 0.0 {
            return (0.0, (0.0, 0.0));
        }
        let most = self.mu * cosine;
        let slows = self.inertia * self.advance;
        // All of friction takes this off the carriage's momentum by winding up and by creep.
        let Winding { n_per_mm, free_n, from_mm, dt_s, creeps, .. } = self.winding;
        let per_mm_s = slows * most * self.normal;
        let wound = slows * (free_n / n_per_mm + from_mm) / dt_s;
        let (winds, lag) = (per_mm_s / (n_per_mm * dt_s), 2.0 * per_mm_s * creeps);
        let solve = |asked: f64, whole: f64| Used::by_carter(asked.abs(), whole, lag);
        let mut asked = self.asked(self.tread, sine) + wound;
        let per_part = self.yields * self.normal * most;
        let sense = if asked * self.tread < 0.0 { -1.0 } else { 1.0 };
        let mut whole = most + winds;
        let mut used = solve(asked, whole);
        // Against its motion only does a load count for the worm.
        let resists = self.load(sense * used.part * most) > 0.0;
        if resists {
            asked -= slows * self.yields * self.offset_n * sense_of(self.tread);
            whole += slows * per_part;
            used = solve(asked, whole);
        }
        let sense = if asked * self.tread < 0.0 { -1.0 } else { 1.0 };
        if resists && self.yields * self.load(sense * used.part * most) > self.tread.abs() {
            // Brought to rest within the step.
            (asked, whole) = (self.asked(0.0, sine) + wound, most + winds);
            used = solve(asked, whole);
        }
        let utilisation = (self.mu * used.part).copysign(asked);
        let per = used.left / (whole * used.left + lag).max(f64::MIN_POSITIVE);
        // What grows with the cosine sum at the same part of friction.
        let grows = asked * self.mu * per;
        (utilisation, (-grows / cosine, self.mu * per))
    }

    /// Speeds at the end with this utilisation.
    pub(crate) fn ended(&self, utilisation: f64, cosine: f64, sine: f64) -> Ended {
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

    /// Speed of the tread over the wall without what winds it up, mm/s, at this tread's and
    /// carriage's speed and this traction.
    pub(crate) fn creeps(&self, tread: f64, speed: f64, traction_n: f64) -> f64 {
        let winding = &self.winding;
        let winds = (winding.end(traction_n).mm - winding.from_mm) / winding.dt_s;
        tread - speed / self.advance - winds
    }

    /// The part of it that is beyond elastic creep, mm/s.
    pub(crate) fn slides(&self, ended: &Ended, utilisation: f64, cosine: f64) -> f64 {
        let slip =
            self.creeps(ended.tread, ended.speed, self.traction_n(utilisation, cosine)).abs();
        // Where all friction is used.
        let elastic = 2.0 * self.traction_n(self.mu, cosine) * self.winding.creeps;
        let slides = utilisation.abs() >= self.mu;
        let beyond = slip - elastic;
        if slides && beyond > STANDS_BELOW { beyond } else { 0.0 }
    }

    /// Traction at the tread, N, at this utilisation.
    pub(crate) fn traction_n(&self, utilisation: f64, cosine: f64) -> f64 {
        utilisation * self.normal * cosine
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
    /// Derivative of the part by that of the creep's law: of the logarithm 1 - part, to full
    /// precision.
    left: f64,
}

impl Used {
    /// Solves `whole p + lag (1 - sqrt(1 - p)) = asked`, none of them negative; from p = 1 on
    /// the rest slides.
    fn by_carter(asked: f64, whole: f64, lag: f64) -> Self {
        let rest = whole + lag - asked;
        if rest <= 0.0 {
            return Self { part: 1.0, left: 0.0 };
        }
        // whole r^2 + lag r = rest, r the root of 1 - p.
        let root = 2.0 * rest / (lag + (lag * lag + 4.0 * whole * rest).sqrt());
        let root = root.min(1.0);
        Self { part: 1.0 - root * root, left: 2.0 * root }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::wind_up::{Shear, WindUp};
    use proptest::prelude::*;

    /// The nominal tread.
    fn shear() -> Shear {
        Shear {
            n_per_mm: 19.6,
            relaxation_lengths: 2.255,
            stiffening: 4.2235,
            relaxations_s: [0.1059; 2],
        }
    }

    /// Utilisation and end of a step.
    fn at(grip: &Grip, cosine: f64, sine: f64) -> (f64, Ended) {
        let (utilisation, _) = grip.utilisation(cosine, sine);
        (utilisation, grip.ended(utilisation, cosine, sine))
    }

    fn grip() -> Grip {
        Grip {
            mu: 1.1,
            winding: WindUp::default().over(&shear(), 8.0, 6.0, 1e-3),
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
        fn carter_solves_its_equation(
            asked in -9.0f64..6.0, whole in -6.0f64..6.0, lag in -12.0f64..6.0,
        ) {
            let [asked, whole, lag] = [asked, whole, lag].map(|exponent| 10f64.powf(exponent));
            let used = Used::by_carter(asked, whole, lag);
            prop_assert!((0.0..=1.0).contains(&used.part) && used.left >= 0.0);
            let over = whole * used.part + lag * (1.0 - 0.5 * used.left) - asked;
            let error = if used.left > 0.0 { over.abs() } else { over.max(0.0) };
            prop_assert!(error <= 1e-12 * (whole + lag), "{used:?}: {error}");
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
                mu, speed, tread, load_n: 0.0, inertia: 1e-3 * mass / dt,
                yields: 1000.0 * dt / 2.0, ..grip()
            };
            let kinetic = |v: f64, u: f64| 0.5e-3 * (mass * v * v + 2.0 * u * u);
            let before = kinetic(speed, tread);
            let winding = WindUp::default().over(&shear(), rolling, 6.0, dt);
            let grip = Grip { winding, ..grip };
            let (used, ended) = at(&grip, 30.0, 0.0);
            let traction = grip.traction_n(used, 30.0);
            let stored = winding.end(traction).stored_mj(&shear());
            let after = kinetic(ended.speed, ended.tread) + stored;
            prop_assert!(after <= before * (1.0 + 1e-9) + 1e-9);
            prop_assert!(used.abs() <= mu);
            // Friction acts against the slip that is left.
            let slip = grip.creeps(ended.tread, ended.speed, traction);
            prop_assert!(slip * used >= -1e-6 * before);
        }
    }

    #[test]
    fn a_tread_that_winds_up_carries_the_load_at_its_steady_creep() {
        let (shear, mut grip, mut wind_up) = (shear(), grip(), WindUp::default());
        let (mut tread, mut used, mut ended) = (8.0, 0.0, Ended::default());
        for _ in 0..5000 {
            let winding = wind_up.over(&shear, tread, 6.0, 1e-3);
            grip.winding = winding;
            grip.tread = tread + grip.yields * 6.7;
            (used, ended) = at(&grip, 33.3, 0.0);
            wind_up = winding.end(grip.traction_n(used, 33.3));
            (tread, grip.speed) = (ended.tread, ended.speed);
        }
        assert!((used - 6.7 / 33.3).abs() < 1e-6, "{used}");
        // Rubber that is 3 mm of travel old on average has relaxed but for this part.
        let unrelaxed = 0.1059 / (0.1059 + 3.0 / tread);
        let n_per_mm = shear.n_per_mm * (1.0 + 3.2235 * unrelaxed);
        let part = used / 1.1;
        let slides = 2.0 * (1.0 - (1.0 - part).sqrt()) / part;
        let creep = 6.7 / (n_per_mm * shear.relaxation_lengths * 6.0) * slides;
        assert!((ended.speed / ended.tread - (1.0 - creep)).abs() < 1e-5, "{ended:?} {creep}");
        assert!((wind_up.mm - 6.7 / n_per_mm).abs() < 1e-5, "{wind_up:?}");
        assert_eq!(grip.slides(&ended, used, 33.3), 0.0);
    }

    #[test]
    fn a_load_winds_a_wheel_at_rest_up_by_load_over_stiffness() {
        for load_n in [6.7, -6.7] {
            let (mut wind_up, mut speed, mut position) = (WindUp::default(), 0.0, 0.0f64);
            let mut farthest = 0.0f64;
            for tick in 0..12_000 {
                let winding = wind_up.over(&shear(), 0.0, 6.0, 1e-3);
                let grip = Grip { winding, tread: 0.0, speed, load_n, ..grip() };
                let (used, ended) = at(&grip, 33.3, 0.0);
                wind_up = winding.end(grip.traction_n(used, 33.3));
                (speed, position) = (ended.speed, position + 1e-3 * ended.speed);
                farthest = farthest.max(position.abs());
                assert_eq!(grip.slides(&ended, used, 33.3), 0.0, "{tick}");
            }
            let wound = load_n / shear().n_per_mm;
            assert!((position + wound).abs() < 1e-3, "{position}");
            assert!((wind_up.mm - wound).abs() < 1e-6, "{wind_up:?}");
            // It stops ringing, and does not overshoot.
            assert!(speed.abs() < 1e-6 && farthest < 1.2 * wound.abs(), "{speed} {farthest}");
        }
    }

    #[test]
    fn beyond_friction_it_slides() {
        // Wound up as far as friction goes: it winds no further, and all is creep and slip.
        let winding = WindUp::steady(&shear(), 1.1 * 33.3, 8.0, 6.0).over(&shear(), 8.0, 6.0, 1e-3);
        let grip = Grip { load_n: 60.0, winding, ..grip() };
        let (used, ended) = at(&grip, 33.3, 0.0);
        assert!((used - 1.1).abs() < 1e-12);
        assert!((ended.speed - (7.9 + 1.1 * 33.3 - 60.0)).abs() < 1e-9);
        let slides = ended.tread - ended.speed - 2.0 * 1.1 * 33.3 * winding.creeps;
        assert!((grip.slides(&ended, used, 33.3) - slides).abs() < 1e-6);
    }

    #[test]
    fn what_winds_the_tread_up_to_the_limit_of_friction_is_no_slip() {
        let before = WindUp::steady(&shear(), 36.0, 8.0, 6.0);
        let winding = before.over(&shear(), 8.0, 6.0, 1e-3);
        let grip = Grip { load_n: 60.0, winding, ..grip() };
        let (used, ended) = at(&grip, 33.3, 0.0);
        assert!((used - 1.1).abs() < 1e-12);
        let wound = winding.end(grip.traction_n(used, 33.3));
        let (slip, most) = (grip.slides(&ended, used, 33.3), ended.tread - ended.speed);
        assert!(slip > 0.0 && slip < most - (wound.mm - before.mm) / 1e-3, "{slip} {most}");
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
            let rigid = Grip { load_n, tread, offset_n, ..grip() };
            let winding = WindUp::steady(&shear(), 5.0, 8.0, 6.0).over(&shear(), 8.0, 6.0, 1e-3);
            let grip = Grip { winding, ..rigid };
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
        let winding = WindUp::steady(&shear(), 30.0, 0.0, 6.0).over(&shear(), 0.0, 6.0, 1e-3);
        let grip = Grip { load_n: 30.0, tread: 0.1, speed: 0.0, winding, ..grip() };
        let (_, ended) = at(&grip, 33.3, 0.0);
        assert_eq!(ended.tread, 0.0);
        assert!(ended.speed <= 0.0 && ended.speed > -1.0, "{ended:?}");
        assert!(ended.tread_load_n > 29.0);
    }
}
