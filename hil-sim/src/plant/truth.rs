//! What is true of the rig.

/// What is true after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    pub time_s: f64,
    /// Mean outputs of the bridges of drive and pre-tightener, parts of the supply. One that
    /// is off shows what its motor generates.
    pub bridges: [f64; 2],
    /// Axial position of the wheel centre, mm.
    pub position_mm: f64,
    pub speed_mm_s: f64,
    /// Tread speed by the wheel's spin, mm/s.
    pub tread_mm_s: f64,
    /// Axial speed without what the tread winds up by, mm/s: that of a rigid tread's contact. A
    /// wheel that stands sinks with its axle, until the rubber has relaxed, and not with this.
    pub rigid_mm_s: f64,
    /// Angle turned, rad.
    pub rotation_rad: f64,
    /// Radial preload of the pre-tightener, N.
    pub preload_n: f64,
    /// Wheel centre's distance from the pillar axis, mm.
    pub radius_mm: f64,
    /// Height of the centre above the outermost wall, mm.
    pub height_mm: f64,
    /// Arm angle from the pillar, rad.
    pub arm_rad: f64,
    /// Largest tread depth, mm.
    pub depth_mm: f64,
    /// What the compression sensor looks at, mm.
    pub compression_mm: f64,
    /// Force of corner and face, N.
    pub corner_n: f64,
    /// Force of the wall under the wheel, N.
    pub floor_n: f64,
    /// Friction of tread on wall.
    pub friction: f64,
    /// Friction utilisation.
    pub utilisation: f64,
    /// Clearance of the nearest step root from the undeformed wheel, mm, if near.
    pub root_clearance_mm: Option<f64>,
    /// Separation of wheel and wall away from steps, mm.
    pub separation_mm: f64,
    /// Axial force of the wall under the wheel against the motion of its tread, N.
    pub resistance_n: f64,
    /// Radial force of the contact beyond what presses the wheel, N: zero but for what the
    /// solution leaves.
    pub unbalanced_n: f64,
    /// Gross slip so far, mm.
    pub slip_mm: f64,
    /// Deflection of the arm by its modes, mm.
    pub vibration_mm: f64,
    /// Mechanical work of the drive so far, mJ.
    pub work_mj: f64,
    /// Friction work of creep and slip so far, mJ.
    pub friction_work_mj: f64,
    /// Whether the ring was resolved.
    pub ring_awake: bool,
}
