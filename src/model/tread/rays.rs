//! Directions from the wheel's centre along which the tread's elements lie.

/// Rays behind and ahead of the one straight down: to 0.5 and 1.0 rad.
pub(super) const BEHIND: i32 = 64;
pub(super) const AHEAD: i32 = 128;

/// Angle between two rays, rad: on the published wheel an element is 0.2 mm of tread.
pub(super) const PITCH: f64 = 0.008;

/// Magnitudes of sine and cosine, Q30, and of secant and tangent, Q29, of a ray's angle from straight
/// down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) sin: u32,
    pub(super) cos: u32,
    pub(super) sec: i32,
    pub(super) tan: u32,
}

/// All rays, the hindmost first.
pub(super) static RAYS: [Ray; (BEHIND + AHEAD) as usize] = table();

/// Tangent of the ray that many places ahead of straight down, Q29, none beyond the ends.
pub(super) fn tangent(place: i32) -> Option<i32> {
    let ray = RAYS.get(usize::try_from(place + BEHIND).ok()?)?;
    Some(ray.tan as i32 * place.signum())
}

/// Visits places from `from` to before `until` as long as the depth along their rays is positive.
/// Gives their number.
#[inline(always)]
pub(super) fn ahead(
    from: i32,
    until: i32,
    depth: impl Fn(&Ray) -> i32,
    mut visit: impl FnMut(i32, &Ray, i32),
) -> i32 {
    walk(between(from, until).iter(), depth, |n, ray, depth| visit(from + n, ray, depth))
}

/// The same backwards, from before `from` down to `until`.
#[inline(always)]
pub(super) fn behind(
    from: i32,
    until: i32,
    depth: impl Fn(&Ray) -> i32,
    mut visit: impl FnMut(i32, &Ray, i32),
) -> i32 {
    let rays = between(until, from).iter().rev();
    walk(rays, depth, |n, ray, depth| visit(from - 1 - n, ray, depth))
}

/// Visits rays, with their number so far, as long as the depth along them is positive.
#[inline(always)]
fn walk<'a>(
    rays: impl Iterator<Item = &'a Ray>,
    depth: impl Fn(&Ray) -> i32,
    mut visit: impl FnMut(i32, &Ray, i32),
) -> i32 {
    let mut number = 0;
    for ray in rays {
        let depth = depth(ray);
        if depth <= 0 {
            break;
        }
        visit(number, ray, depth);
        number += 1;
    }
    number
}

/// Rays of the places from `low` to before `high`, none if a place has none.
fn between(low: i32, high: i32) -> &'static [Ray] {
    let index = |place: i32| usize::try_from(place + BEHIND).unwrap_or(usize::MAX);
    RAYS.get(index(low)..index(high)).unwrap_or_default()
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
        sin: (sin >> 30).unsigned_abs() as u32,
        cos: (cos >> 30) as u32,
        sec: ((ONE << 29) / cos) as i32,
        tan: ((sin << 29) / cos).unsigned_abs() as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_ray_is_at_its_angle() {
        for place in -BEHIND..AHEAD {
            let (sin, cos) = (f64::from(place) * PITCH).sin_cos();
            let [got] = between(place, place + 1) else { panic!("within") };
            for (bits, exact, one) in [
                (f64::from(got.sin), sin.abs(), 30),
                (f64::from(got.cos), cos, 30),
                (f64::from(got.sec), 1.0 / cos, 29),
                (f64::from(tangent(place).expect("within")), sin / cos, 29),
            ] {
                let error = bits - exact * f64::from(1 << one);
                assert!(error.abs() <= 1.0, "{place}: {error} LSB");
            }
        }
        assert!(tangent(-BEHIND - 1).is_none() && tangent(AHEAD).is_none());
    }
}
