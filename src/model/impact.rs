//! Dynamic effects of the corner: the stress of its first touch, and the vibration that it
//! leaves in the arm. Both are small at the rig's speeds and grow with them.

use crate::rig::Rig;

/// Density of styrene-butadiene rubber, kg/m^3. Source: material sheets, 1100 to 1180.
const RUBBER_DENSITY_KG_M3: f64 = 1140.0;

/// Relaxed Young's modulus of the same, Pa. Source: material sheets, about 60 Shore A.
const RUBBER_MODULUS_PA: f64 = 4.8e6;

/// Bending stiffness of the arm, N mm^2: 2A12 aluminium of 72.5 GPa, 12 mm wide and
/// 15 mm high in the plane of the arm. Published: material and section.
const ARM_BENDING_N_MM2: f64 = 72_500.0 * 12.0 * 15.0 * 15.0 * 15.0 / 12.0;

/// Impact and vibration of a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Impact stress per axial speed, Pa s/mm.
    pub stress_per_speed: f64,
    /// Circular frequency of the arm's first mode, rad/s.
    pub mode_rad_s: f64,
    /// Stiffness of the arm at the wheel, N/mm.
    pub arm_n_per_mm: f64,
}

impl Impact {
    /// Impact and vibration of a rig.
    ///
    /// The mode is the highest of `drive.modes_hz`: the first of the constrained rig.
    pub fn new(rig: &Rig) -> Self {
        let (r, h) = (rig.rig.wheel_radius_mm, rig.rig.step_height_mm);
        let above = (r - h) / r;
        let closing = libm::sqrt((1.0 - above * above).max(0.0));
        let impedance = libm::sqrt(RUBBER_DENSITY_KG_M3 * RUBBER_MODULUS_PA * rig.tread.stiffening);
        let mode_hz = rig.drive.modes_hz.iter().copied().fold(0.0, f64::max);
        let length = rig.rig.arm_length_mm;
        Self {
            stress_per_speed: impedance * closing * 1e-3,
            mode_rad_s: 2.0 * core::f64::consts::PI * mode_hz,
            arm_n_per_mm: 3.0 * ARM_BENDING_N_MM2 / (length * length * length),
        }
    }

    /// Stress increment of the first touch of the corner, Pa: `rho c_0 v sin(phi)`, with
    /// the instant wave speed `c_0 = sqrt(E_0 / rho)`, `E_0 = s E_inf`, and the closing
    /// speed normal to the tread, `cos(phi) = (R - h) / R`. Proportional to the speed,
    /// mm/s. Source: a plane wave in a half-space (Graff 1975, 1.1).
    pub fn stress_pa(&self, speed_mm_s: f64) -> f64 {
        self.stress_per_speed * speed_mm_s
    }

    /// Amplitude of the arm's first mode after the crossing, mm, at most: a radial force
    /// that rises evenly to `radial_n` while the wheel runs `run_mm` over the corner at
    /// `speed_mm_s` leaves `F/k 2 / (omega t)`, `t = run / v`; never more than a sudden
    /// force, `F/k`. Source: undamped oscillator under a ramp (Biggs 1964, 2.5).
    pub fn vibration_mm(&self, speed_mm_s: f64, radial_n: f64, run_mm: f64) -> f64 {
        let ramp = 2.0 * speed_mm_s / (self.mode_rad_s * run_mm);
        // A rig without modes has nothing that could swing.
        if self.mode_rad_s > 0.0 { radial_n / self.arm_n_per_mm * ramp.min(1.0) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stress_is_impedance_times_closing_speed() {
        let rig = Rig::prototype();
        // 0.5426 of 5 mm/s against 1140 kg/m^3 at 133.4 m/s.
        let stress = Impact::new(&rig).stress_pa(5.0);
        assert!((stress - 1140.0 * 133.35 * 5e-3 * 0.5426).abs() < 1.0, "{stress}");
    }

    #[test]
    fn a_ramp_leaves_what_an_integrated_oscillator_keeps() {
        let impact = Impact::new(&Rig::prototype());
        let (speed, force, run) = (60.0, 40.0, 3.0);
        let omega = impact.mode_rad_s;
        let rise = run / speed;
        // Semi-implicit steps far below the period, over the ramp and ten periods more.
        let (mut x, mut rate, mut most, dt) = (0.0, 0.0, 0.0f64, 1e-7);
        let still = force / impact.arm_n_per_mm;
        for step in 0..((rise + 0.04) / dt) as usize {
            let time = step as f64 * dt;
            rate += dt * omega * omega * (still * (time / rise).min(1.0) - x);
            x += dt * rate;
            if time > rise {
                most = most.max((x - still).abs());
            }
        }
        let bound = impact.vibration_mm(speed, force, run);
        // The sine of half the ramp's phase is what the bound leaves out.
        let exact = bound * (0.5 * omega * rise).sin().abs();
        assert!((most / exact - 1.0).abs() < 1e-2, "{most} {exact}");
        assert!(most <= 1.001 * bound);
    }

    #[test]
    fn a_rig_without_modes_does_not_swing() {
        let mut rig = Rig::prototype();
        rig.drive.modes_hz.clear();
        let swing = Impact::new(&rig).vibration_mm(60.0, 40.0, 3.0);
        assert!(swing.abs() < 1e-12, "{swing}");
    }
}
