//! Traction over a step of time: motor, tread, friction and carriage at once.
//!
//! Whether a wheel grips depends on the force on it, and that force on how fast the carriage
//! is taken along. Taken one after the other, with the forces of the step before, a carriage
//! is caught at once that friction would have to accelerate, and energy comes from nowhere.
//! Here the friction cone is resolved within the step: its end velocities are those that its
//! forces give, and the tread between them winds up and creeps ([`WindUp`]).

/// Relaxation length of the traction over the length of the contact: pi G L / k_t, for the
/// creep stiffness of a half-space and k_t of a layer of 8 mm (1.6 at 5 mm, 2.8 at 12 mm).
const RELAXATION_LENGTHS: f64 = 2.1;

/// Slip that is rounding, mm/s.
const STANDS_BELOW: f64 = 1e-9;

/// Rubber between rim and hub, displaced along the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shear {
    /// Tangential stiffness of the relaxed tread, N/mm.
    pub n_per_mm: f64,
    /// Instant over relaxed stiffness.
    pub stiffening: f64,
    /// Both relaxation times, of equal share, s.
    pub relaxations_s: [f64; 2],
}

/// Displacement of the rim against the hub along the wall, and how traction follows from it.
///
/// The lumped form of the brush model: traction is `k_t (w + (s - 1) (w - q))` with the
/// displacement w and its memory q, the three-parameter solid of the tread. Strained rubber leaves
/// the contact and unstrained rubber comes in: w is lost over a relaxation length sigma, q over
/// the mean age of the rubber in contact, half its length. So a steadily rolling tread creeps by
/// `F / (k_t sigma S)`, S being the stiffening that is left at that speed: `k_t sigma` is the
/// creep stiffness. Near the limit of friction the contact
/// slides in part, by Carter (1926): creep is `2 (1 - sqrt(1 - p)) / p` times as much.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WindUp {
    /// Displacement, mm, positive as the tread runs ahead of the wheel outwards.
    pub mm: f64,
    memory_mm: [f64; 2],
}

/// What a step of time makes of a [`WindUp`]: traction is `n_per_mm w + free_n`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Winding {
    n_per_mm: f64,
    free_n: f64,
    from_mm: f64,
    /// Of the memory: the part taken over from the displacement, and what is left of it, mm.
    follows: [(f64, f64); 2],
    dt_s: f64,
    /// Speed of creep per traction, as long as nothing slides, mm/s per N.
    creeps: f64,
}

impl WindUp {
    /// The step of `dt_s`, rolling at this speed, mm/s, on a contact of this length, mm.
    #[must_use]
    pub fn over(&self, shear: &Shear, rolling: f64, contact_mm: f64, dt_s: f64) -> Winding {
        let renewed = 2.0 * rolling / contact_mm;
        let follows = [0, 1].map(|i| {
            let caught = dt_s / shear.relaxations_s[i];
            let all = 1.0 + caught + renewed * dt_s;
            (caught / all, self.memory_mm[i] / all)
        });
        let more = 0.5 * shear.n_per_mm * (shear.stiffening - 1.0);
        let left: f64 = follows.iter().map(|(part, _)| 1.0 - part).sum();
        let kept: f64 = follows.iter().map(|(_, kept)| kept).sum();
        Winding {
            n_per_mm: shear.n_per_mm + more * left,
            free_n: -more * kept,
            from_mm: self.mm,
            follows,
            dt_s,
            creeps: rolling / (RELAXATION_LENGTHS * contact_mm * shear.rolling_n_per_mm(renewed)),
        }
    }

    /// Steady displacement under this traction, N, at this speed, mm/s.
    #[must_use]
    pub fn steady(shear: &Shear, traction_n: f64, rolling: f64, contact_mm: f64) -> Self {
        let renewed = 2.0 * rolling / contact_mm;
        let mm = traction_n / shear.rolling_n_per_mm(renewed);
        Self { mm, memory_mm: shear.relaxations_s.map(|tau_s| mm / (1.0 + renewed * tau_s)) }
    }

    /// Stored energy, mJ.
    #[must_use]
    pub fn stored_mj(&self, shear: &Shear) -> f64 {
        let more = 0.5 * (shear.stiffening - 1.0);
        let branches: f64 = self.memory_mm.iter().map(|q| more * (self.mm - q).powi(2)).sum();
        0.5 * shear.n_per_mm * (self.mm * self.mm + branches)
    }
}

impl Shear {
    /// Stiffness in steady rolling that renews the tread in contact at this rate, 1/s, N/mm.
    fn rolling_n_per_mm(&self, renewed: f64) -> f64 {
        let unrelaxed = self.relaxations_s.map(|tau_s| renewed * tau_s / (1.0 + renewed * tau_s));
        let more = 0.5 * (self.stiffening - 1.0) * (unrelaxed[0] + unrelaxed[1]);
        self.n_per_mm * (1.0 + more)
    }
}

impl Winding {
    /// The displacement at the end of the step under this traction, N.
    #[must_use]
    pub fn end(&self, traction_n: f64) -> WindUp {
        let mm = (traction_n - self.free_n) / self.n_per_mm;
        WindUp { mm, memory_mm: self.follows.map(|(part, kept)| part * mm + kept) }
    }
}

/// A driven wheel on a step of time from known speeds.
///
/// With p the part of friction used, the tread runs over the wall by its [`WindUp`]'s rate and
/// by its creep, at first in proportion to p, twice as much at p = 1, and without bound there.
/// With c and s the cosine and sine sums of the contact and m/dt its inertia, the carriage ends
/// the step at `v1 = v0 + (mu p c - s - load) dt/m`, and friction is that for which this is
/// `advance (u1 - that)`, u1 being the tread's speed then.
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
        let winding = &self.winding;
        let slows = self.inertia * self.advance;
        // Of all friction: what winding up and creep take of the carriage's speed.
        let winds = slows * most * self.normal / (winding.n_per_mm * winding.dt_s);
        let lag = 2.0 * slows * most * self.normal * winding.creeps;
        let wound = slows * (winding.free_n / winding.n_per_mm + winding.from_mm) / winding.dt_s;
        let mut asked = self.asked(self.tread, sine) + wound;
        let per_part = self.yields * self.normal * most;
        let mut whole = most + winds;
        let mut used = Used::of(asked.abs(), whole, lag);
        let sense = if asked * self.tread < 0.0 { -1.0 } else { 1.0 };
        // Against its motion only does a load count for the worm.
        let resists = self.load(sense * used.part * most) > 0.0;
        if resists {
            asked -= slows * self.yields * self.offset_n * sense_of(self.tread);
            whole += slows * per_part;
            used = Used::of(asked.abs(), whole, lag);
        }
        let sense = if asked * self.tread < 0.0 { -1.0 } else { 1.0 };
        if resists && self.yields * self.load(sense * used.part * most) > self.tread.abs() {
            // Brought to rest within the step.
            (asked, whole) = (self.asked(0.0, sine) + wound, most + winds);
            used = Used::of(asked.abs(), whole, lag);
        }
        let utilisation = (self.mu * used.part).copysign(asked);
        let per = used.root / (whole * used.root + 0.5 * lag).max(f64::MIN_POSITIVE);
        (utilisation, (-asked * self.mu * per / cosine, self.mu * per))
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

    /// Speed of the tread over the wall without what winds it up, mm/s.
    #[must_use]
    pub fn creeps(&self, ended: &Ended, wound: &WindUp) -> f64 {
        let winds = (wound.mm - self.winding.from_mm) / self.winding.dt_s;
        ended.tread - ended.speed / self.advance - winds
    }

    /// The part of it that is beyond creep, mm/s: where all friction is used.
    #[must_use]
    pub fn slides(&self, creeps: f64, utilisation: f64, cosine: f64) -> f64 {
        let beyond = creeps.abs() - 2.0 * self.traction_n(self.mu, cosine) * self.winding.creeps;
        if utilisation.abs() >= self.mu && beyond > STANDS_BELOW { beyond } else { 0.0 }
    }

    /// Traction along the wall, N, at this utilisation.
    #[must_use]
    pub fn traction_n(&self, utilisation: f64, cosine: f64) -> f64 {
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
    /// Square root of what is left of it.
    root: f64,
}

impl Used {
    /// Solves `whole p + lag (1 - sqrt(1 - p)) = asked`, none of them negative; from p = 1 on the
    /// rest slides.
    fn of(asked: f64, whole: f64, lag: f64) -> Self {
        let left = whole + lag - asked;
        if left <= 0.0 {
            return Self { part: 1.0, root: 0.0 };
        }
        // whole r^2 + lag r = left.
        let root = 2.0 * left / (lag + (lag * lag + 4.0 * whole * left).sqrt());
        Self { part: 1.0 - root * root, root }
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

    /// The default tread.
    const SHEAR: Shear = Shear { n_per_mm: 21.0, stiffening: 4.2235, relaxations_s: [0.1059; 2] };

    fn grip() -> Grip {
        Grip {
            mu: 1.1,
            winding: WindUp::default().over(&SHEAR, 8.0, 6.0, 1e-3),
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
            prop_assert!((0.0..=1.0).contains(&used.part) && used.root >= 0.0);
            let reached = whole * used.part + lag * (1.0 - used.root);
            let error = if used.root > 0.0 { reached - asked } else { (reached - asked).max(0.0) };
            prop_assert!(error.abs() <= 1e-12 * (whole + lag), "{used:?}: {error}");
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
                winding: WindUp::default().over(&SHEAR, rolling, 6.0, dt),
                yields: 1000.0 * dt / 2.0, ..grip()
            };
            let (used, ended) = at(&grip, 30.0, 0.0);
            let kinetic = |v: f64, u: f64| 0.5e-3 * (mass * v * v + 2.0 * u * u);
            let before = kinetic(speed, tread);
            let wound = grip.winding.end(grip.traction_n(used, 30.0));
            let after = kinetic(ended.speed, ended.tread) + wound.stored_mj(&SHEAR);
            prop_assert!(after <= before * (1.0 + 1e-9) + 1e-9);
            prop_assert!(used.abs() <= mu);
            // Friction acts against what the tread creeps or slides.
            prop_assert!(grip.creeps(&ended, &wound) * used >= -1e-6 * before);
        }
    }

    #[test]
    fn steady_traction_carries_the_load_at_the_creep_of_the_brush_model() {
        let (mut grip, mut wind_up) = (grip(), WindUp::default());
        let (mut tread, mut used, mut ended) = (8.0, 0.0, Ended::default());
        for _ in 0..5000 {
            grip.winding = wind_up.over(&SHEAR, tread, 6.0, 1e-3);
            grip.tread = tread + grip.yields * 6.7 * 1.0;
            (used, ended) = at(&grip, 33.3, 0.0);
            wind_up = grip.winding.end(grip.traction_n(used, 33.3));
            (tread, grip.speed) = (ended.tread, ended.speed);
        }
        assert!((used - 6.7 / 33.3).abs() < 1e-6, "{used}");
        // Rubber that is 3 mm of travel old on average has relaxed but for this part.
        let unrelaxed = 0.1059 / (0.1059 + 3.0 / tread);
        let n_per_mm = 21.0 * (1.0 + 3.2235 * unrelaxed);
        let part = used / 1.1;
        let slides = 2.0 * (1.0 - (1.0 - part).sqrt()) / part;
        let creep = 6.7 / (n_per_mm * 2.1 * 6.0) * slides;
        assert!((ended.speed / ended.tread - (1.0 - creep)).abs() < 1e-5, "{ended:?} {creep}");
        assert!((wind_up.mm - 6.7 / n_per_mm).abs() < 1e-5, "{wind_up:?}");
        assert!((WindUp::steady(&SHEAR, 6.7, tread, 6.0).mm - wind_up.mm).abs() < 1e-5);
        assert_eq!(grip.slides(grip.creeps(&ended, &wind_up), used, 33.3), 0.0);
    }

    #[test]
    fn a_load_on_a_wheel_at_rest_displaces_it_by_its_stiffness_and_stops_ringing() {
        let (mut wind_up, mut speed, mut position) = (WindUp::default(), 0.0, 0.0f64);
        let mut deepest = 0.0f64;
        for tick in 0..12_000 {
            let winding = wind_up.over(&SHEAR, 0.0, 6.0, 1e-3);
            let grip = Grip { winding, tread: 0.0, speed, load_n: 6.7, ..grip() };
            let (used, ended) = at(&grip, 33.3, 0.0);
            wind_up = winding.end(grip.traction_n(used, 33.3));
            (speed, position) = (ended.speed, position + 1e-3 * ended.speed);
            deepest = deepest.min(position);
            assert_eq!(grip.slides(grip.creeps(&ended, &wind_up), used, 33.3), 0.0, "{tick}");
        }
        assert!((position + 6.7 / 21.0).abs() < 1e-3, "{position}");
        assert!((wind_up.mm - 6.7 / 21.0).abs() < 1e-6, "{wind_up:?}");
        assert!(speed.abs() < 1e-6 && deepest > -0.4, "{speed} {deepest}");
    }

    #[test]
    fn beyond_friction_it_slides() {
        let before = WindUp::steady(&SHEAR, 36.0, 8.0, 6.0);
        let winding = before.over(&SHEAR, 8.0, 6.0, 1e-3);
        let grip = Grip { load_n: 60.0, winding, ..grip() };
        let (used, ended) = at(&grip, 33.3, 0.0);
        assert!((used - 1.1).abs() < 1e-12);
        assert!((ended.speed - (7.9 + 1.1 * 33.3 - 60.0)).abs() < 1e-9);
        // What winds the tread up to the limit of friction is no slip.
        let wound = grip.winding.end(grip.traction_n(used, 33.3));
        let slip = grip.slides(grip.creeps(&ended, &wound), used, 33.3);
        let most = ended.tread - ended.speed;
        assert!(
            slip > 0.0 && slip < most - (wound.mm - before.mm) / 1e-3,
            "{slip} {most} {wound:?}"
        );
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
        let winding = WindUp::steady(&SHEAR, 30.0, 0.0, 6.0).over(&SHEAR, 0.0, 6.0, 1e-3);
        let grip = Grip { load_n: 30.0, tread: 0.1, speed: 0.0, winding, ..grip() };
        let (_, ended) = at(&grip, 33.3, 0.0);
        assert_eq!(ended.tread, 0.0);
        assert!(ended.speed <= 0.0 && ended.speed > -1.0, "{ended:?}");
        assert!(ended.tread_load_n > 29.0);
    }
}
