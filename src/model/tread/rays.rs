//! Directions from the wheel's centre along which the tread's elements lie.

/// Sine and cosine, Q30, secant and tangent, Q29, and cosecant, Q24, of a ray's angle from straight
/// down, ahead positive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) sin: i32,
    pub(super) cos: i32,
    pub(super) sec: i32,
    pub(super) tan: i32,
    pub(super) csc: i32,
}

/// Rays this many microradians apart, one for each element of the state.
pub(super) struct Rays<const PITCH: u32, const ELEMENTS: usize>;

impl<const PITCH: u32, const ELEMENTS: usize> Rays<PITCH, ELEMENTS> {
    /// Rays behind the one straight down, and from it on ahead: to 0.77 and 1.27 rad as shipped.
    pub(super) const BEHIND: i32 = (ELEMENTS as i32) * 3 / 8;
    /// See [`Self::BEHIND`].
    pub(super) const AHEAD: i32 = ELEMENTS as i32 - Self::BEHIND;
    /// All rays, the hindmost first.
    const ALL: &[Ray; ELEMENTS] = &Self::table();

    /// The ray that many places ahead of straight down, none beyond the ends.
    #[inline(always)]
    pub(super) fn at(place: i32) -> Option<&'static Ray> {
        Self::ALL.get(place.wrapping_add(Self::BEHIND) as usize)
    }

    /// The rays from one place to before another, none if there is one beyond the ends.
    #[inline(always)]
    pub(super) fn between(low: i32, high: i32) -> &'static [Ray] {
        let at = |place: i32| place.wrapping_add(Self::BEHIND) as usize;
        Self::ALL.get(at(low)..at(high)).unwrap_or_default()
    }

    const fn table() -> [Ray; ELEMENTS] {
        let mut rays = [Ray { sin: 0, cos: 0, sec: 0, tan: 0, csc: 0 }; ELEMENTS];
        let mut index = 0;
        while index < ELEMENTS {
            rays[index] = ray((index as i64 - Self::BEHIND as i64) * PITCH as i64);
            index += 1;
        }
        rays
    }
}

/// The ray at this angle, microradians, by the series of sine and cosine in Q60.
const fn ray(microradians: i64) -> Ray {
    const ONE: i128 = 1 << 60;
    let angle = microradians as i128 * ONE / 1_000_000;
    let (mut term, mut sums, mut n) = (ONE, [0_i128; 2], 0);
    while n < 30 {
        sums[n % 2] += if n % 4 < 2 { term } else { -term };
        n += 1;
        term = ((term * angle) >> 60) / n as i128;
    }
    let [cos, sin] = sums;
    Ray {
        sin: (sin >> 30) as i32,
        cos: (cos >> 30) as i32,
        sec: ((ONE << 29) / cos) as i32,
        tan: ((sin << 29) / cos) as i32,
        // Saturated straight down, where no ray meets the face.
        csc: if sin > ONE >> 7 { ((ONE << 24) / sin) as i32 } else { i32::MAX },
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;

    type Shipped = Rays<8000, 256>;

    #[test]
    fn every_ray_is_at_its_angle() {
        for place in -Shipped::BEHIND..Shipped::AHEAD {
            let (sin, cos) = (f64::from(place) * 0.008).sin_cos();
            let got = Shipped::at(place).expect("within");
            for (bits, exact, one) in [
                (got.sin, sin, 30),
                (got.cos, cos, 30),
                (got.sec, 1.0 / cos, 29),
                (got.tan, sin / cos, 29),
                (got.csc, if place > 0 { 1.0 / sin } else { 128.0 }, 24),
            ] {
                let error = f64::from(bits) - exact * f64::from(1 << one);
                assert!(error.abs() <= 1.0, "{place}: {error} LSB");
            }
        }
        assert!(Shipped::at(-Shipped::BEHIND - 1).is_none());
        assert!(Shipped::at(Shipped::AHEAD).is_none());
        assert_eq!(Shipped::between(-Shipped::BEHIND, Shipped::AHEAD).len(), 256);
        assert_eq!(Shipped::between(-2, 3).len(), 5);
        assert!(Shipped::between(3, -2).is_empty());
    }
}
