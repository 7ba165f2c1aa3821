use interstage::rig::Rig;
use proptest::prelude::*;

use super::super::wall::tests::Facet;
use super::super::wall::{Step, Wall};
use super::*;

fn rubber(elements: usize) -> RingParameters {
    RingParameters::of(&Rig::fe(), elements)
}

/// Normal, cosine and sine sums of a fresh ring, and the floor's part, element by element
/// from the rays.
fn by_rays(parameters: &RingParameters, motion: &Motion) -> [f64; 4] {
    let pitch = TAU / parameters.elements as f64;
    let patch = pitch * parameters.radius_mm * parameters.width_mm;
    let law = Law::new(parameters, motion.dt_s);
    let edge = motion.wall.edge(motion.height_mm);
    let mut sums = [0.0; 4];
    for element in 0..parameters.elements {
        let angle = element as f64 * pitch - motion.turn_rad;
        let (sin, cos) = angle.sin_cos();
        if cos < 0.06 {
            continue;
        }
        let covered = edge.covered(sin, cos, pitch);
        let (distance, facet) = if covered > 0.0 && covered < 1.0 {
            (motion.height_mm / cos, Facet::Floor)
        } else {
            motion.wall.ray(motion.height_mm, sin, cos)
        };
        // The rest of an element that reaches past the edge meets the wall behind.
        let behind = (motion.height_mm + motion.wall.drop_mm) / cos;
        for (distance, part) in [(distance, covered), (behind, 1.0 - covered)] {
            let depth = (parameters.radius_mm - distance).max(0.0);
            let force = part * patch * law.tangent * depth;
            sums[0] += force;
            sums[1] += force * cos;
            sums[2] += force * sin;
            if facet == Facet::Floor {
                sums[3] += force * cos;
            }
        }
    }
    sums
}

proptest! {
    #[test]
    fn the_sums_are_those_of_the_rays(
        position in -30.0f64..30.0, rise in 0.0f64..20.0, sunk in -1.0f64..3.0,
        turn in -3.0f64..3.0, elements in 100usize..1500, level in 0usize..2,
    ) {
        let steps = [0.0, 40.0].map(|position_mm| Step { position_mm, height_mm: rise });
        let wall = Wall::new(steps.to_vec()).local(position + 40.0 * level as f64);
        let motion = Motion { wall, height_mm: 25.0 - sunk, turn_rad: turn, dt_s: 1e-3 };
        let mut ring = Ring::new(rubber(elements));
        let contact = ring.trial(&motion);
        let expected = by_rays(&rubber(elements), &motion);
        let got = [contact.normal_n, contact.cosine_n, contact.sine_n, contact.floor_n];
        for (got, expected) in got.iter().zip(expected) {
            prop_assert!((got - expected).abs() < 1e-7 * (1.0 + expected.abs()),
                "{got} {expected} {motion:?}");
        }
        // Whoever looks at all elements sees the same, to the last bit.
        prop_assert_eq!(Ring::new(rubber(elements)).visiting_all().trial(&motion), contact);
        // And what a balance needs is the same but for the order of the additions.
        let ((c, s), (dc, ds)) = ring.forces(&motion);
        prop_assert!((c - contact.cosine_n).abs() < 1e-9 * (1.0 + c.abs()));
        prop_assert!((s - contact.sine_n).abs() < 1e-9 * (1.0 + c.abs()));
        prop_assert_eq!((dc, ds), contact.slope);
    }

    /// Whatever is done to it, an element keeps its memory exactly.
    #[test]
    fn memory_decays_unseen(wait in 1usize..400, tau in 1e-3f64..10.0) {
        let wall = Wall::default().local(0.0);
        let at = |height_mm, turn_rad| Motion { wall, height_mm, turn_rad, dt_s: 1e-3 };
        let press = |wait: usize, steps: usize| {
            let mut ring = Ring::new(RingParameters { tau_s: tau, ..rubber(720) });
            for _ in 0..50 {
                ring.commit(&at(24.5, 0.0));
            }
            // Lifted off, and turned away and back.
            ring.commit(&at(26.0, 0.0));
            ring.commit(&at(26.0, 1.0));
            ring.commit(&at(26.0, -1.0));
            for _ in 0..steps {
                ring.commit(&Motion { dt_s: 1e-3 * (wait / steps) as f64, ..at(26.0, 0.0) });
            }
            ring.trial(&at(24.5, 0.0)).cosine_n
        };
        let (once, often) = (press(wait, 1), press(wait, wait));
        prop_assert!((once / often - 1.0).abs() < 1e-9, "{once} {often}");
    }
}

#[test]
fn a_step_of_no_height_is_no_step() {
    let level = Wall::default().local(0.0);
    let step = Wall::new(vec![Step { position_mm: 0.0, height_mm: 0.0 }]);
    for position in [-10.0, -1.0, 1e-6, 1.0, 3.0, 10.0] {
        let at = |wall| Motion { wall, height_mm: 24.6, turn_rad: 0.3, dt_s: 1e-3 };
        let flat = Ring::new(rubber(1440)).trial(&at(level));
        let crossed = Ring::new(rubber(1440)).trial(&at(step.local(position)));
        assert!((crossed.cosine_n / flat.cosine_n - 1.0).abs() < 1e-9, "at {position} mm");
    }
}
