//! The roots of the frequency equation, none missed and none twice.
//!
//! Seen from its tip, the beam is a lossless one-port: the load z that puts a mode at
//! `beta_l` rises from minus to plus infinity between two frequencies of the beam
//! pinned at B, while the z of a mass and a spring falls throughout. So each interval
//! between two neighbouring pinned roots holds exactly one root, however close to its
//! edge (R. M. Foster, "A reactance theorem", 1924; Rayleigh's interlacing). A scan in
//! steps could miss a pair that straddles an edge; these brackets cannot.

use std::f64::consts::PI;

use super::waves::{End, Load, frequency_function};

/// Half-width of the bracket of a pinned root around its asymptote.
const PINNED_BRACKET: f64 = 0.1;

/// The first `count` non-zero roots `beta_l` with tip `mass` (beam masses) and `spring`
/// (EI / L^3).
pub(super) fn first(a: End, mass: f64, spring: f64, count: usize) -> Vec<f64> {
    // Below the first pinned root lies the first mode of an arm that is held, by its
    // clamp or by the spring; an arm that is not moves there as a rigid body at zero
    // frequency, and its first mode is in the second interval.
    let held = a == End::Clamped || spring > 0.0;
    let skipped = usize::from(!held);
    (skipped..skipped + count).map(|j| in_interval(a, mass, spring, j)).collect()
}

/// The root between pinned roots `j` and `j + 1`, the zeroth being the lower bound.
fn in_interval(a: End, mass: f64, spring: f64, j: usize) -> f64 {
    let low = if j == 0 { lower_bound(a, mass, spring) } else { pinned_root(a, j) };
    let high = pinned_root(a, j + 1);
    // At a pinned root the load does not matter, except for rounding: ask the bare end.
    let sign_high = frequency_function(a, Load::FREE, high).signum();
    bisect(low, high, sign_high, |beta_l| {
        frequency_function(a, Load::mass_and_spring(mass, spring, beta_l), beta_l)
    })
}

/// Root `j`, from 1, of the beam with its end B pinned, next to its asymptote: j pi
/// if A is pinned too, (j + 1/4) pi if not (Blevins, table 8-1).
fn pinned_root(a: End, j: usize) -> f64 {
    let shift = if a == End::Pinned { 0.0 } else { 0.25 };
    let asymptote = (j as f64 + shift) * PI;
    let (low, high) = (asymptote - PINNED_BRACKET, asymptote + PINNED_BRACKET);
    let pinned = |beta_l| frequency_function(a, Load::PINNED, beta_l);
    bisect(low, high, pinned(high).signum(), pinned)
}

/// A bound below the first root of a held arm.
///
/// Equation: `1 / beta_l^4` is at most the sum of its values with all flexibility but
/// one, or all mass but one, taken away (Dunkerley for masses, Papkovich for
/// flexibilities). Clamped: bare beam and
/// massless beam with the tip mass. Else: rigid beam on the spring, and flexible beam
/// on a pin. A tenth is taken off for rounding.
fn lower_bound(a: End, mass: f64, spring: f64) -> f64 {
    let inverse_fourth = match a {
        End::Clamped => 1.875_f64.powi(-4) + mass / 3.0,
        End::Pinned => (mass + 1.0 / 3.0) / spring + PI.powi(-4),
        End::Free => (mass + 1.0 / 4.0) / spring + 3.926_f64.powi(-4),
    };
    0.9 * inverse_fourth.powf(-0.25)
}

/// The sign change of `f` between `low` and `high`, to the last bit, where `f` has the
/// sign `sign_high` at `high` and the other at `low`. That is known beforehand and not
/// looked up, so a root on an edge of the interval is found as well.
pub(crate) fn bisect(mut low: f64, mut high: f64, sign_high: f64, f: impl Fn(f64) -> f64) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if f(middle) * sign_high > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
}
