//! The tread displaced along the wall: it winds up under traction, and creeps as it rolls.
//!
//! Traction displaces the rim against the hub by w. It is `F = k (w + (s - 1) (w - q))`, the
//! three-parameter solid of the tread with the memory q. Rolling brings unstrained rubber into
//! the contact: the displacement is lost over the relaxation length, the memory over half the
//! length of the contact, the mean age of the rubber in it.

use interstage::rig::shear;

use super::ring::RingParameters;

/// Rubber between rim and hub, displaced along the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shear {
    /// Stiffness of the relaxed tread along the wall, N/mm.
    pub n_per_mm: f64,
    /// Relaxation length over the length of the contact.
    pub relaxation_lengths: f64,
    /// Instant over relaxed stiffness.
    pub stiffening: f64,
    /// Both relaxation times, of equal share, s.
    pub relaxations_s: [f64; 2],
}

/// Displacement of the rim against the hub along the wall, and its memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct WindUp {
    /// Displacement, mm, positive as the tread runs ahead of the wheel outwards.
    pub mm: f64,
    memory_mm: [f64; 2],
}

/// What a step of time makes of a [`WindUp`]: traction is `n_per_mm w + free_n`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Winding {
    pub(super) n_per_mm: f64,
    pub(super) free_n: f64,
    /// Displacement at its start, mm.
    pub(super) from_mm: f64,
    /// Of the memory: the part taken over from the displacement, and what is left of it, mm.
    follows: [(f64, f64); 2],
    pub(super) dt_s: f64,
    /// Speed of creep per traction at little of it, mm/s per N.
    pub(super) creeps: f64,
}

impl Shear {
    /// The layer of this wheel, `compliance` times as compliant.
    pub(crate) fn of(ring: &RingParameters, compliance: f64) -> Self {
        let thickness = ring.thickness_mm();
        let layer = shear::Shear::of_layer(ring.radius_mm, ring.width_mm, thickness, ring.k_inf);
        Self {
            n_per_mm: layer.n_per_mm / compliance,
            relaxation_lengths: layer.relaxation_lengths,
            stiffening: ring.k_0 / ring.k_inf,
            relaxations_s: ring.relaxations_s(),
        }
    }

    /// Stiffness in steady rolling that renews the tread in contact at this rate, 1/s, N/mm.
    fn rolling_n_per_mm(&self, renewed: f64) -> f64 {
        let unrelaxed = self.relaxations_s.map(|tau_s| renewed * tau_s / (1.0 + renewed * tau_s));
        let more = 0.5 * (self.stiffening - 1.0) * (unrelaxed[0] + unrelaxed[1]);
        self.n_per_mm * (1.0 + more)
    }
}

impl RingParameters {
    /// Thickness of the tread as a layer, mm.
    fn thickness_mm(&self) -> f64 {
        if self.is_coupled() { self.tread_thickness_mm } else { self.layer_mm }
    }
}

impl WindUp {
    /// The step of `dt_s`, rolling at this speed, mm/s, on a contact of this length, mm.
    pub(crate) fn over(&self, shear: &Shear, rolling: f64, contact_mm: f64, dt_s: f64) -> Winding {
        let renewed = 2.0 * rolling / contact_mm;
        let follows = [0, 1].map(|i| {
            let caught = dt_s / shear.relaxations_s[i];
            let all = 1.0 + caught + renewed * dt_s;
            (caught / all, self.memory_mm[i] / all)
        });
        let more = 0.5 * shear.n_per_mm * (shear.stiffening - 1.0);
        let left: f64 = follows.iter().map(|(part, _)| 1.0 - part).sum();
        let kept: f64 = follows.iter().map(|(_, kept)| kept).sum();
        let relaxation_mm = shear.relaxation_lengths * contact_mm;
        Winding {
            n_per_mm: shear.n_per_mm + more * left,
            free_n: -more * kept,
            from_mm: self.mm,
            follows,
            dt_s,
            creeps: rolling / (relaxation_mm * shear.rolling_n_per_mm(renewed)),
        }
    }

    /// Steady displacement under this traction, N, at this speed, mm/s.
    pub(crate) fn steady(shear: &Shear, traction_n: f64, rolling: f64, contact_mm: f64) -> Self {
        let renewed = 2.0 * rolling / contact_mm;
        let mm = traction_n / shear.rolling_n_per_mm(renewed);
        Self { mm, memory_mm: shear.relaxations_s.map(|tau_s| mm / (1.0 + renewed * tau_s)) }
    }

    /// Stored energy, mJ.
    pub(crate) fn stored_mj(&self, shear: &Shear) -> f64 {
        let more = 0.5 * (shear.stiffening - 1.0);
        let branches: f64 = self.memory_mm.iter().map(|q| more * (self.mm - q).powi(2)).sum();
        0.5 * shear.n_per_mm * (self.mm * self.mm + branches)
    }
}

impl Winding {
    /// The displacement at the end of the step under this traction, N.
    pub(crate) fn end(&self, traction_n: f64) -> WindUp {
        let mm = (traction_n - self.free_n) / self.n_per_mm;
        WindUp { mm, memory_mm: self.follows.map(|(part, kept)| part * mm + kept) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::ring::layer::{modulus_mm, shear_compliance};
    use interstage::rig::Rig;
    use interstage::rig::shear::{compliance_of, modulus};
    use std::f64::consts::{PI, TAU};

    const REFERENCE_MM: f64 = 2.5;

    fn ring(thickness_mm: f64) -> RingParameters {
        RingParameters {
            tread_thickness_mm: thickness_mm,
            ..RingParameters::of(&Rig::prototype(), 4)
        }
    }

    /// Displacement per traction on an elliptic contact, times `G L`, by the waves of the layer.
    fn by_waves(radius_mm: f64, thickness_mm: f64, contact_mm: f64) -> f64 {
        let deep = (40.0 * radius_mm / thickness_mm) as usize;
        // Fourier part of the ellipse, 2 J1(x)/x, by Simpson's rule over its own variable.
        let part = |x: f64| {
            let steps = 200;
            let sum: f64 = (0..=steps)
                .map(|i| {
                    let angle = PI * f64::from(i) / f64::from(steps);
                    let weight =
                        if i == 0 || i == steps { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
                    weight * angle.sin().powi(2) * (x * angle.cos()).cos()
                })
                .sum();
            sum * PI / (3.0 * f64::from(steps)) * 2.0 / PI
        };
        let waves: f64 = (1..=2000)
            .map(|n| {
                let compliance = if n <= deep {
                    shear_compliance(radius_mm, thickness_mm, n)
                } else {
                    0.5 * radius_mm / n as f64
                };
                2.0 * compliance * part(0.5 * n as f64 * contact_mm / radius_mm).powi(2)
            })
            .sum();
        (shear_compliance(radius_mm, thickness_mm, 0) + waves) / (TAU * radius_mm)
    }

    #[test]
    fn the_stiffness_is_that_of_the_layer() {
        for thickness in [3.0, 5.0, 8.0, 12.0, 16.0] {
            let exact = by_waves(25.0, thickness, REFERENCE_MM);
            let off = compliance_of(25.0, thickness, REFERENCE_MM) / exact - 1.0;
            assert!(off.abs() < 0.02, "{thickness}: {off}");
            let rubber = ring(thickness);
            let off = modulus(thickness, rubber.k_inf) / (rubber.k_inf * modulus_mm(&rubber)) - 1.0;
            assert!(off.abs() < 0.02, "{thickness}: {off}");
        }
    }

    /// The table of the page, and the nominal tread.
    #[test]
    fn the_stiffness_follows_the_thickness() {
        for (thickness, n_per_mm, creep_n) in
            [(5.0, 14.4, 64.5), (8.0, 19.5, 110.0), (12.0, 22.3, 165.0), (0.0, 19.5, 110.0)]
        {
            let shear = Shear::of(&ring(thickness), 1.0);
            let creep = shear.n_per_mm * shear.relaxation_lengths * 2.5;
            assert!((shear.n_per_mm / n_per_mm - 1.0).abs() < 0.01, "{thickness}: {shear:?}");
            assert!((creep / creep_n - 1.0).abs() < 0.01, "{thickness}: {creep}");
        }
        let wall = compliance_of(25.0, 8.0, 2.5) / compliance_of(25.0, 8.0, 6.0);
        assert!((1.2..1.25).contains(&wall), "{wall}");
    }

    /// Whatever the course of the traction, no more comes back than was put in.
    #[test]
    fn rubber_gives_back_no_more_than_it_took() {
        let shear = Shear::of(&ring(0.0), 1.0);
        let (mut wind_up, mut given, mut force) = (WindUp::default(), 0.0, 0.0);
        for step in 0..20_000 {
            let time = 1e-3 * f64::from(step);
            let winding = wind_up.over(&shear, 4.0 * (1.0 + (3.0 * time).sin()), 3.0, 1e-3);
            let next = 20.0 * (7.0 * time).sin() + 15.0 * (31.0 * time).sin();
            let end = winding.end(next);
            given += next * (end.mm - wind_up.mm);
            (wind_up, force) = (end, next);
            assert!(given >= wind_up.stored_mj(&shear) - 1e-9, "{step}: {given}");
        }
        assert!(given > 1.0 && force != 0.0);
    }

    /// Steady displacement is where any other settles.
    #[test]
    fn it_settles_where_steady_rolling_is() {
        let shear = Shear::of(&ring(0.0), 1.0);
        let mut wind_up = WindUp::default();
        for _ in 0..3000 {
            wind_up = wind_up.over(&shear, 8.0, 6.0, 1e-3).end(6.7);
        }
        let steady = WindUp::steady(&shear, 6.7, 8.0, 6.0);
        assert!((wind_up.mm - steady.mm).abs() < 1e-6, "{wind_up:?} {steady:?}");
    }
}
