//! Where the drive's work goes: the sums of a run, and their booking stride by stride.

use super::traction::{Moves, Stride};
use super::{Drives, Truth, VirtualRig};

/// Work and losses since the start, mJ. The first law over any part of a run reads
/// `motor = gear + worm + creep + contact + load + preload + arm + change of wound and kinetic`,
/// and over one that begins and ends in the same state of the tread `contact = tread`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Work of the motor, what it is braked with negative.
    pub motor_mj: f64,
    /// Loss by Coulomb friction of the gearbox.
    pub gear_mj: f64,
    /// Loss in the self-locking worm: what a load along the motion brings.
    pub worm_mj: f64,
    /// Loss by creep and slip of the tread on the wall, and in its rubber displaced along it.
    pub creep_mj: f64,
    /// What the normal pressure of the contact takes from axle and tread.
    pub contact_mj: f64,
    /// What the tread's elements take up: stored in those in contact, the rest lost in them.
    pub tread_mj: f64,
    /// Work on the load.
    pub load_mj: f64,
    /// Work on spring and screw of the pre-tightener.
    pub preload_mj: f64,
    /// Work on the modes of the arm and on the friction of its pivot.
    pub arm_mj: f64,
    /// Elastic energy of the tread displaced along the wall, now.
    pub wound_mj: f64,
    /// Kinetic energy of rotor and carriage, now.
    pub kinetic_mj: f64,
}

impl VirtualRig {
    /// Books a stride that began with this truth, these cosine and sine sums, N, and this energy
    /// of the wound-up tread, mJ. The axial forces of its end act over the travel by its mean speeds, as the step of time has it.
    pub(super) fn book(
        &mut self,
        before: &Truth,
        from_n: (f64, f64),
        wound_mj: f64,
        drives: &Drives,
        stride: &Stride,
    ) {
        let (_, cosine, sine) = self.forces;
        let (p, truth) = (&self.parameters, &self.truth);
        let travel = self.mean(before.speed_mm_s, truth.speed_mm_s) * stride.dt_s;
        let rolled = self.mean(before.tread_mm_s, truth.tread_mm_s) * stride.dt_s;
        let ((sin, cos), (sin_before, cos_before)) =
            (truth.rotation_rad.sin_cos(), before.rotation_rad.sin_cos());
        // Of the rim's axis, and of the axle.
        let carried = travel + p.run_out_mm * (sin - sin_before);
        let lifted = truth.height_mm - before.height_mm;
        let rise = lifted - p.run_out_mm * (cos - cos_before);
        let part = self.rolling_part();
        let advance = match stride.moves {
            Moves::Driven(grip) | Moves::Free(grip) => grip.advance,
            Moves::Latched | Moves::Spins(_) => part,
        };
        let slip = self.mean(
            advance * before.tread_mm_s - before.speed_mm_s,
            advance * truth.tread_mm_s - truth.speed_mm_s,
        ) * stride.dt_s;
        let traction_n = truth.utilisation * self.lever_n();
        let kinetic =
            p.mass_kg * truth.speed_mm_s.powi(2) + p.drive.mass_kg * truth.tread_mm_s.powi(2);
        let spring = 0.5 * (before.preload_n + self.preload_now());
        let pressed = cosine + truth.utilisation * sine;
        let taken = self.ring.taken_mj();
        let given_mj = sine * carried - cosine * lifted;
        // As the elements take it up: by the mean forces of the stride.
        let between_mj = 0.5 * ((from_n.1 + sine) * carried - (from_n.0 + cosine) * lifted);
        let inner_mj = self.inner_load_n * rolled.abs();
        // While the ring sleeps, its elements take up what the resultants do: steady rolling.
        let taken_mj = if truth.ring_awake { taken - self.taken_mj } else { between_mj };
        let offset_n = self.eccentric_load_n();
        let energy = &mut self.energy;
        energy.motor_mj += stride.motor_force_n(self.tread_load_n) * rolled;
        if drives.drive_on {
            energy.gear_mj += p.drive.friction_n * rolled.abs();
        }
        energy.worm_mj += (-(traction_n + offset_n) * rolled - inner_mj).max(0.0);
        energy.wound_mj = self.wind_up.stored_mj(&p.shear());
        energy.creep_mj += traction_n / advance * slip - (energy.wound_mj - wound_mj);
        energy.contact_mj += given_mj;
        energy.tread_mj += taken_mj;
        energy.load_mj += p.load_n * travel;
        energy.preload_mj += spring * rise;
        energy.arm_mj += (pressed - spring) * rise;
        energy.kinetic_mj = 0.5e-3 * kinetic;
        self.taken_mj = taken;
        // To a multiple of 2^-20 mJ: elements visited without need do not show in any bit.
        let grid = 1.5 * 4_294_967_296.0;
        self.learn_inner_load((taken_mj - between_mj + grid) - grid, rolled);
    }
}
