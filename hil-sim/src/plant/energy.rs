//! Where the drive's work goes: the sums of a run.

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
