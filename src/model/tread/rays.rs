//! Directions from the wheel's centre along which the tread's elements lie.

/// Rays behind and ahead of the one straight down: to 0.5 and 1.0 rad.
pub(super) const BEHIND: i32 = 64;
pub(super) const AHEAD: i32 = 128;

/// Angle between two rays, rad: on the published wheel an element is 0.2 mm of tread.
pub(super) const PITCH: f64 = 0.008;

/// Sine and cosine, Q30, and secant and tangent, Q29, of a ray's angle from straight down, ahead
/// positive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) sin: i32,
    pub(super) cos: i32,
    pub(super) sec: i32,
    pub(super) tan: i32,
}

/// All rays, the hindmost first.
pub(super) static RAYS: [Ray; (BEHIND + AHEAD) as usize] = table();

/// The ray that many places ahead of straight down, none beyond the ends.
pub(super) fn ray(place: i32) -> Option<&'static Ray> {
    RAYS.get(usize::try_from(place + BEHIND).ok()?)
}

const fn table() -> [Ray; (BEHIND + AHEAD) as usize] {
    let mut rays = [Ray { sin: 0, cos: 0, sec: 0, tan: 0 }; (BEHIND + AHEAD) as usize];
    let mut index = 0;
    while index < rays.len() {
        rays[index] = at(index as i64 - BEHIND as i64);
        index += 1;
    }
    rays
}

/// By the series of sine and cosine in Q60, whose terms shrink by half and more.
const fn at(place: i64) -> Ray {
    const ONE: i128 = 1 << 60;
    // 0.008 in Q60.
    let angle = place as i128 * (ONE / 125);
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
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_ray_is_at_its_angle() {
        for place in -BEHIND..AHEAD {
            let (sin, cos) = (f64::from(place) * PITCH).sin_cos();
            let got = ray(place).expect("within");
            for (bits, exact, one) in [
                (got.sin, sin, 30),
                (got.cos, cos, 30),
                (got.sec, 1.0 / cos, 29),
                (got.tan, sin / cos, 29),
            ] {
                let error = f64::from(bits) - exact * f64::from(1 << one);
                assert!(error.abs() <= 1.0, "{place}: {error} LSB");
            }
        }
        assert!(ray(-BEHIND - 1).is_none() && ray(AHEAD).is_none());
    }
}
