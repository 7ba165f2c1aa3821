//! The shipping model on the arguments of its counterparts in other arithmetics.

use interstage::model::reduced::{Point, ReducedModel, Scale};
use interstage::rig::Rig;
use interstage::units::{Direction, Q16};
use interstage_arith::{Answer, Given};

/// What can be called: name of the arithmetic, functions forwards and back.
pub const FUNCTIONS: [(&str, &str, &str); 5] = [
    ("shipping fixed point", "arith_shipping_forward", "arith_shipping_inverse"),
    ("fixed crate, I4F28", "arith_fixed_forward", "arith_fixed_inverse"),
    ("f32, micromath", "arith_micromath_forward", "arith_micromath_inverse"),
    ("f32, libm", "arith_libm_forward", "arith_libm_inverse"),
    ("f64, libm", "arith_f64_forward", "arith_f64_inverse"),
];

/// A rig with another height of its steps, bits of Q15.16, mm.
#[must_use]
pub fn with_step(mut rig: Rig, step_height: i32) -> Rig {
    rig.rig.step_height_mm = f64::from(step_height) / 65_536.0;
    rig
}

#[inline(always)]
fn point(given: &Given, scale: Scale) -> Point {
    Point {
        direction: if given.direction == 0 { Direction::Deploy } else { Direction::Retract },
        speed: Q16::from_bits(given.speed),
        scale,
    }
}

/// Everything about the crossing at a force.
#[inline(always)]
#[must_use]
pub fn crossing(model: &ReducedModel, scale: Scale, given: &Given) -> Answer {
    let found = model.crossing(&point(given, scale), Q16::from_bits(given.wanted));
    Answer {
        gap: found.gap.to_bits(),
        corner_force: found.corner_force.to_bits(),
        impact_stress_kpa: found.impact_stress_kpa.to_bits(),
        vibration_um: found.vibration_um.to_bits(),
        utilisation: found.utilisation.to_bits(),
        slip_margin: found.slip_margin.to_bits(),
    }
}

/// Radial force that gives a gap.
#[inline(always)]
#[must_use]
pub fn force(model: &ReducedModel, scale: Scale, given: &Given) -> i32 {
    model.force(&point(given, scale), Q16::from_bits(given.wanted)).to_bits()
}
