//! What the drive is doing when a reset comes.

use serde::Serialize;

/// What the drive is doing when an aimed reset comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aim {
    /// In the self-test after a start.
    SelfTest,
    /// Taking its zeros.
    Zeroing,
    /// Waiting for a command.
    Idle,
    /// Raising the preload before a run.
    Preloading,
    /// Between the steps.
    Cruise,
    /// Before a step.
    Approach,
    /// On a corner.
    Crossing,
    /// Behind a step.
    Settle,
    /// Coming to rest on command.
    Stopping,
    /// Arrived.
    Complete,
    /// Held by a fault.
    FaultHold,
}

impl Aim {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::SelfTest,
        Self::Zeroing,
        Self::Idle,
        Self::Preloading,
        Self::Cruise,
        Self::Approach,
        Self::Crossing,
        Self::Settle,
        Self::Stopping,
        Self::Complete,
        Self::FaultHold,
    ];

    /// Part of what the log says of it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::SelfTest => "self-test",
            Self::Zeroing => "zeroing",
            Self::Idle => "idle",
            Self::Preloading => "preloading",
            Self::Cruise => "cruise",
            Self::Approach => "approach",
            Self::Crossing => "crossing",
            Self::Settle => "settle",
            Self::Stopping => "stopping",
            Self::Complete => "ed",
            Self::FaultHold => "fault hold",
        }
    }

    /// Whether it is over once the drive has got its command.
    pub(super) const fn comes_before_the_command(self) -> bool {
        matches!(self, Self::SelfTest | Self::Zeroing | Self::Idle)
    }
}

/// Which of the modes a mode of the log is, in the words of the log; the ways out and back
/// alike.
#[must_use]
pub(super) fn aim_of(mode: &str) -> &'static str {
    if mode.is_empty() {
        return "boot";
    }
    if matches!(mode, "deployed" | "retracted") {
        return "complete";
    }
    Aim::ALL.into_iter().map(Aim::name).find(|name| mode.contains(name)).unwrap_or("other")
}
