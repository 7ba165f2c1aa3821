//! One rig as built: the nominal parameters with the mismatch of a seed.

use interstage::rig::Rig;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::actuators::{DriveMotor, Pretightener};
use super::arm::{Arm, ModeParameters};
use super::ring::RingParameters;
use super::sensors::{Noise, SensorParameters};
use super::spread::Spread;
use super::wall::{Step, Wall};
use super::wind_up::Shear;

/// Elements of the ring in a deployment. With the usual stride the gap is within 0.25 %,
/// the largest force within 0.3 % of a ring twenty times as fine. Two thirds of them keep
/// the gap as well, but not the friction at which a sliding wheel still climbs.
pub(crate) const ELEMENTS: usize = 1440;

/// Room between each end of the travel and its stop, mm: the 85 mm of the sliding
/// connector around 80 mm of travel.
pub(crate) const STOP_ROOM_MM: f64 = 2.5;

#[derive(Clone, Debug, PartialEq)]
pub struct PlantParameters {
    /// Wheel and rubber.
    pub ring: RingParameters,
    /// The steps as machined.
    pub wall: Wall,
    pub arm: Arm,
    pub wall_radius_mm: f64,
    /// Travel between the end stops, mm.
    pub stops_mm: (f64, f64),
    /// Friction of tread on wall, its mean.
    pub mu: f64,
    /// Amplitude of its waves along the wall over its mean, and their length, mm.
    pub friction_waves: (f64, f64),
    /// Factor of the tread's compliance along the wall.
    pub wind_up: f64,
    /// Part of the compression by which the rolling radius is less than the undeformed one.
    pub rolling_compression: f64,
    /// Axial load on this wheel, N.
    pub load_n: f64,
    pub mass_kg: f64,
    pub drive: DriveMotor,
    /// Rate of the preload spring, N/mm.
    pub spring_n_per_mm: f64,
    /// Largest rate of preload, N/s.
    pub slew_n_per_s: f64,
    /// Lag of the screw, s.
    pub lag_s: f64,
    /// Dead time of the screw, s.
    pub delay_s: f64,
    /// Part of the screw's speed that raising the preload limit takes.
    pub screw_droop: f64,
    /// Part of full duty that the screw's friction takes.
    pub screw_friction: f64,
    pub preload_limit_n: f64,
    /// Largest force of the screw's position, N.
    pub seat_max_n: f64,
    pub modes: Vec<ModeParameters>,
    /// Torque ripple: amplitude, N, and its pitch at the tread, mm.
    pub ripple: (f64, f64),
    /// Distance of the axis of rotation from the axis of the rim, mm.
    pub run_out_mm: f64,
    /// Play of the drive, mm at the tread.
    pub backlash_mm: f64,
    /// Coulomb friction in the arm's pivot, N at the wheel.
    pub pivot_friction_n: f64,
    /// What the compression sensor measures: from 0, the deepest point, to 1, the mean depth
    /// of the patch that carries.
    pub compression_patch: f64,
    /// Compliance of its mounting, mm/N.
    pub compression_compliance_mm_per_n: f64,
    /// Sensors as calibrated and as they are.
    pub sensors: SensorParameters,
}

/// Draws from the spread. The order of the draws is part of what a seed means: a new
/// parameter is drawn after the others.
struct Draw(ChaCha8Rng);

impl Draw {
    /// A factor around 1 with this relative standard deviation, cut at three of them.
    fn factor(&mut self, deviation: f64) -> f64 {
        let normal: f64 = StandardNormal.sample(&mut self.0);
        1.0 + deviation * normal.clamp(-3.0, 3.0)
    }

    /// An offset within this half-width.
    fn offset(&mut self, half_width: f64) -> f64 {
        half_width * (2.0 * self.0.random::<f64>() - 1.0)
    }
}

impl PlantParameters {
    /// Friction of tread on wall at a position, mm.
    pub fn friction_at(&self, position_mm: f64) -> f64 {
        let (amplitude, length_mm) = self.friction_waves;
        self.mu * (1.0 + amplitude * (std::f64::consts::TAU * position_mm / length_mm).sin())
    }

    /// The tread displaced along the wall.
    pub fn shear(&self) -> Shear {
        Shear::of(&self.ring, self.wind_up)
    }

    /// The pre-tightener with this dead time, s.
    pub(crate) fn pretightener(
        &self,
        delay_s: f64,
        dt_s: f64,
        seat_n: f64,
        range: (f64, f64),
    ) -> Pretightener {
        Pretightener::new(self.slew_n_per_s, self.lag_s, delay_s, dt_s, seat_n, range).with_losses(
            self.screw_droop,
            self.screw_friction,
            self.preload_limit_n,
        )
    }

    /// The plant of a seed: `rig` with this spread, and with these steps, each its position
    /// and how much higher than the table says it is, mm. Seed 0 is the nominal rig without
    /// mismatch; its sensors still quantise and have their noise.
    pub(crate) fn draw(
        rig: &Rig,
        steps: &[(f64, f64)],
        spread: &Spread,
        noise: &Noise,
        seed: u64,
    ) -> Self {
        let nominal = Spread::default();
        let spread = if seed == 0 { &nominal } else { spread };
        let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
        let k_inf = rig.tread.k_inf_pa_per_m * 1e-9 * draw.factor(spread.k_inf_rel);
        // Rubber that softens at once does not exist.
        let stiffening = (rig.tread.stiffening * draw.factor(spread.stiffening_rel)).max(1.0);
        let tau_s = rig.tread.tau_s * draw.factor(spread.tau_rel);
        let mu = rig.plant.mu * draw.factor(spread.mu_rel);
        let load =
            rig.plant.top_load_n * rig.plant.top_load_share * draw.factor(spread.top_load_rel);
        let spring_n_per_mm = rig.preload.spring_n_per_mm * draw.factor(spread.spring_rel);
        let delay_s = (rig.preload.delay_s * draw.factor(spread.delay_rel)).max(0.0);
        let lag_s = rig.preload.lag_s * draw.factor(spread.lag_rel);
        let slew_n_per_s = rig.preload.slew_n_per_s * draw.factor(spread.slew_rel);
        let radius_mm = rig.rig.wheel_radius_mm + draw.offset(spread.wheel_radius_mm)
            - spread.wear_mm * draw.0.random::<f64>();
        let preload_sensor_gain = draw.factor(spread.preload_sensor_gain_rel);
        let compression_gain = draw.factor(spread.compression_sensor_gain_rel);
        let angle_zero_rad = draw.offset(spread.arm_angle_zero_deg).to_radians();
        let steps = steps
            .iter()
            .map(|(position, higher)| Step {
                position_mm: position + draw.offset(spread.step_position_mm),
                height_mm: rig.rig.step_height_mm + higher + draw.offset(spread.step_height_mm),
            })
            .collect();
        // The supply is one for both bridges, the dividers are not.
        let supply = draw.factor(spread.supply_rel);
        let mut divided = || supply * draw.factor(spread.readback_gain_rel);
        let readback_gain = [divided(), divided()];
        let mut zero = || draw.factor(spread.readback_zero_duty) - 1.0;
        let readback_zero = [zero(), zero()];
        let readback_lag = draw.factor(spread.readback_lag_rel);
        Self {
            ring: RingParameters {
                radius_mm,
                k_inf,
                k_0: k_inf * stiffening,
                tau_s,
                ..RingParameters::of(rig, ELEMENTS)
            },
            wall: Wall::new(steps),
            arm: Arm::of(rig),
            wall_radius_mm: rig.rig.wall_radius_mm,
            stops_mm: (-STOP_ROOM_MM, rig.rig.travel_mm + STOP_ROOM_MM),
            mu,
            friction_waves: (0.0, 22.0),
            wind_up: 1.0,
            rolling_compression: 1.0 / 3.0,
            load_n: load,
            mass_kg: rig.plant.moved_mass_kg,
            drive: DriveMotor {
                no_load_mm_s: rig.drive.no_load_speed_mm_s,
                stall_n: rig.drive.stall_force_n,
                limit_n: rig.drive.force_limit_n,
                mass_kg: rig.drive.reflected_mass_kg,
                friction_n: 0.02 * rig.drive.stall_force_n,
            },
            spring_n_per_mm,
            slew_n_per_s,
            lag_s,
            delay_s,
            screw_droop: 0.0,
            screw_friction: 0.0,
            preload_limit_n: rig.preload.limit_n,
            seat_max_n: 1.25 * rig.preload.limit_n,
            modes: rig.drive.modes_hz.iter().map(|&hz| ModeParameters::at(hz)).collect(),
            ripple: (0.006 * rig.drive.force_limit_n, rig.drive.ripple_pitch_mm),
            run_out_mm: 0.0,
            backlash_mm: 0.0,
            pivot_friction_n: 0.0,
            compression_patch: 0.0,
            compression_compliance_mm_per_n: 0.0,
            sensors: SensorParameters {
                counts_per_turn: rig.sense.encoder_counts,
                preload_full_scale_n: rig.sense.preload_full_scale_n,
                preload_sensor_gain,
                tread_full_scale_mm: rig.sense.tread_full_scale_mm,
                compression_gain,
                angle_zero_code: rig.sense.angle_zero_code,
                angle_zero_rad,
                readback_gain,
                readback_zero,
                readback_lag,
                noise: noise.clone(),
            },
        }
    }
}
