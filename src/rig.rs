//! The rig: geometry, material, actuators, sensors, limits. Every number is here once, in SI or
//! millimetres as its suffix says, with its source. The virtual rig's plant reads the same struct;
//! scenarios add deliberate mismatch.
//!
//! Sources: *published* is the study of the deployable mechanism; *derived* is computed from
//! published numbers; *chosen* is ours, with the reason beside it.

mod abilities;
mod presets;
pub mod shear;
mod validate;

pub use abilities::OVERPRESSURE_PART;
pub(crate) use abilities::{
    CLIMB_PART, CROSSOVER_RAD_S, MOST_ERROR_MM_S, PROPORTIONAL, SHORT_PART, START_LAG_MM,
};
pub use validate::{Bound, RigError};

/// Most steps a step table may hold.
pub const MAX_STEPS: usize = 8;

/// Most structural modes the resonance guard may watch.
pub const MAX_MODES: usize = 4;

/// A bounded list of numbers in a parameter set.
pub type List<const N: usize> = heapless::Vec<f64, N>;

/// All parameters of one rig.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    /// Sleeve, wheel and arm.
    pub rig: Geometry,
    /// Rubber of the wheel.
    pub tread: Tread,
    /// Loads and friction.
    pub plant: Loads,
    /// Pre-tightener.
    pub preload: Pretightener,
    /// Drive motor and speed limits.
    pub drive: Drive,
    /// Sensors.
    pub sense: Sensors,
    /// Settings of the controller.
    pub control: ControlSettings,
}

/// Sleeve, wheel and arm.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(not(target_os = "none"), derive(documented::DocumentedFields))]
#[serde(deny_unknown_fields)]
pub struct Geometry {
    /// Undeformed wheel radius R, mm. Published: 25.
    pub wheel_radius_mm: f64,
    /// Loss of wheel radius at which the wheel is changed, mm; the odometry reckons with half of
    /// it. Chosen.
    pub wheel_wear_mm: f64,
    /// Wheel width L, mm. Published: 28.
    pub wheel_width_mm: f64,
    /// Step height h between neighbouring sleeves, mm. Published: 4.
    pub step_height_mm: f64,
    /// Axial positions of the step faces, mm, ascending. Chosen:
    /// three steps evenly over the travel.
    pub step_positions_mm: List<MAX_STEPS>,
    /// Half-width of the window in which a step is expected, mm. Chosen: machining
    /// of the sleeves (0.3) plus odometry between two steps (2 % of 22 mm).
    pub step_tolerance_mm: f64,
    /// Complete travel, mm. Chosen: 10 s at 8 mm/s, inside the published 85 mm of the
    /// sliding connector.
    pub travel_mm: f64,
    /// Radius of the outermost sleeve wall from the pillar axis, mm. Published: 150.
    pub wall_radius_mm: f64,
    /// Drive arm length, mm. Published: 145.
    pub arm_length_mm: f64,
    /// Radius of the arm's pivot from the pillar axis, mm. Chosen: a pillar of
    /// 40 mm diameter.
    pub arm_pivot_radius_mm: f64,
}

/// Rubber of the wheel: three-parameter solid per area of ring.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(not(target_os = "none"), derive(documented::DocumentedFields))]
#[serde(deny_unknown_fields)]
pub struct Tread {
    /// Relaxed stiffness per area k_inf, Pa/m. Derived: fitted, with the next two,
    /// to the three published gaps.
    pub k_inf_pa_per_m: f64,
    /// Stiffening k_0/k_inf, dimensionless.
    pub stiffening: f64,
    /// Relaxation time tau, s.
    pub tau_s: f64,
    /// Thickness of the rubber, mm, by which it gives way along the wall. Chosen: 8, as it is not
    /// published; a layer so thick has the gaps nearest to those of independent elements.
    pub thickness_mm: f64,
}

/// Loads and friction.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(not(target_os = "none"), derive(documented::DocumentedFields))]
#[serde(deny_unknown_fields)]
pub struct Loads {
    /// Coulomb friction of tread on wall. Chosen: no published value for rubber on
    /// 2A12; dry rubber on metal lies in 0.5 to 1.2 and the paper's own cases need
    /// 0.94 at (5 mm/s, 33.3 N).
    pub mu: f64,
    /// Top load of the complete unit, N. Published: 20 on the rig, 60 in the study.
    pub top_load_n: f64,
    /// Share of the top load that this wheel lifts. Chosen: one third; the guide
    /// and the neighbouring units carry the rest.
    pub top_load_share: f64,
    /// Moved mass, kg. Chosen: arm, wheel, motor and carriage of one unit.
    pub moved_mass_kg: f64,
    /// How axial thrust turns into radial force through the inclined arm:
    /// N = P + coupling x F_axial x tan(arm angle). 1: trailing arm, thrust wedges
    /// the wheel into the wall; -1: leading arm, thrust lifts it; 0: parallel guide.
    /// Chosen: 1.
    pub arm_coupling: f64,
}

/// Pre-tightener: motor, screw and spring.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(not(target_os = "none"), derive(documented::DocumentedFields))]
#[serde(deny_unknown_fields)]
pub struct Pretightener {
    /// Radial preload on the smooth wall, N. Published: 33 on the rig, 100 in the study.
    pub cruise_n: f64,
    /// Largest radial preload, N. Published: 50 on the rig; a third more than that
    /// of the study's scale (150) there.
    pub limit_n: f64,
    /// Spring rate seen at the wheel, N/mm. Derived: the pre-tightener acts half-way
    /// along the arm, and the limit must lie within the published 23 mm of extension:
    /// 2 x 50 N / 23 mm x 1/4 = 1.1, taken as 1.2.
    pub spring_n_per_mm: f64,
    /// Largest rate of preload, N/s. Chosen: 10 mm/s of screw at that stiffness.
    pub slew_n_per_s: f64,
    /// Dead time between command and screw, s. Chosen.
    pub delay_s: f64,
    /// Lag of the screw's speed behind its command, s. Chosen.
    pub lag_s: f64,
}

/// Drive motor, gearbox and speed limits.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(not(target_os = "none"), derive(documented::DocumentedFields))]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// Speed of the tread at full duty without load, mm/s.
    pub no_load_speed_mm_s: f64,
    /// Force at the tread at full duty and standstill, N, were the current unlimited.
    pub stall_force_n: f64,
    /// Force at the tread at the current limit, N.
    pub force_limit_n: f64,
    /// Inertia of rotor and gears seen as mass at the tread, kg.
    pub reflected_mass_kg: f64,
    /// Speed on the smooth wall, mm/s.
    pub cruise_speed_mm_s: f64,
    /// Least speed while crossing, mm/s. Chosen: 1.5, because a tread stiffer or slower than known
    /// needs less than the lowest published, 2.9741.
    pub min_crossing_speed_mm_s: f64,
    /// Largest acceleration of the profile, mm/s^2.
    pub acceleration_mm_s2: f64,
    /// Largest jerk of the profile, mm/s^3.
    pub jerk_mm_s3: f64,
    /// Travel between two torque ripples of motor and gearbox, mm at the tread: the
    /// excitation frequency is speed over this.
    pub ripple_pitch_mm: f64,
    /// Structural modes to keep away from, Hz. Published: 163 and 276.
    pub modes_hz: List<MAX_MODES>,
    /// Half-width of the band kept out around each mode, relative.
    pub guard_band: f64,
}

/// Sensors.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(not(target_os = "none"), derive(documented::DocumentedFields))]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Encoder counts per wheel turn, all edges.
    pub encoder_counts: f64,
    /// Preload sensor full scale, N, at 90 % of the converter; zero is at 5 %.
    pub preload_full_scale_n: f64,
    /// Largest gain error of the preload sensor, relative: the preload limit is kept with it.
    /// Derived: three deviations of a calibration within 0.5 %.
    pub preload_error: f64,
    /// Tread compression full scale, mm, at 90 % of the converter; zero at 5 %.
    pub tread_full_scale_mm: f64,
    /// Code of the angle sensor at which the arm lies along the pillar, 0 to 16383.
    pub angle_zero_code: f64,
    /// Age beyond which a reading is stale, s.
    pub stale_after_s: f64,
}

/// Settings of the controller.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(not(target_os = "none"), derive(documented::DocumentedFields))]
#[serde(deny_unknown_fields)]
pub struct ControlSettings {
    /// Gap to hold at a step, mm; 0 takes that at `safe_speed_mm_s` and cruise preload.
    pub gap_ref_mm: f64,
    /// Speed of the paper's safe point, mm/s. Published: 5.
    pub safe_speed_mm_s: f64,
    /// Part of the reference gap that the schedule aims below it, relative, to leave
    /// room for model error and tolerance.
    pub gap_reserve: f64,
    /// Friction utilisation that the schedule leaves unused, absolute. Chosen.
    pub slip_margin: f64,
    /// Largest deviation of the stiffness estimate below nominal, relative; above it four times
    /// as much, which only makes the crossings slower.
    pub adaptation_range: f64,
    /// Part of an observed stiffness error taken over per crossing.
    pub adaptation_gain: f64,
}
