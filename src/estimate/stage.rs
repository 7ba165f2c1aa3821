//! The six contact stages of the study.

/// Stage of the contact between wheel and sleeve, as the study numbers them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[repr(u8)]
pub enum ContactStage {
    /// 1: the wheel lies on the wall without preload.
    #[default]
    Initial = 1,
    /// 2: preload is being applied.
    Preloaded = 2,
    /// 3: the wheel holds by static friction; at a step, both walls carry.
    StaticFriction = 3,
    /// 4: the corner carries alone and the tread slides on it while it climbs.
    Sliding = 4,
    /// 5: the wheel rolls over the corner onto the next wall.
    Rolling = 5,
    /// 6: rolling on the continuous wall with viscoelastic friction.
    Continuous = 6,
}

impl ContactStage {
    /// Every stage, in the study's order.
    pub const ALL: [Self; 6] = [
        Self::Initial,
        Self::Preloaded,
        Self::StaticFriction,
        Self::Sliding,
        Self::Rolling,
        Self::Continuous,
    ];
}
