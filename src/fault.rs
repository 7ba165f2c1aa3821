//! Latched faults (codes 100 to 199) and active limits (200 to 299). Codes are stable: no number
//! gets a second meaning. Cause, detection, reaction and reset of each: `docs/MODES.md`.

/// A latched fault: the drive holds until it is reset.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[repr(u16)]
pub enum Fault {
    /// The wheel encoder stopped answering.
    WheelEncoderStale = 101,
    /// The preload sensor stopped answering.
    PreloadSensorStale = 102,
    /// The compression sensor stopped answering.
    CompressionSensorStale = 103,
    /// The arm angle sensor stopped answering or answers with errors.
    ArmAngleStale = 104,
    /// The readback of the bridges stopped answering.
    ReadbackStale = 105,
    /// The preload sensor reads outside its range.
    PreloadSensorRange = 112,
    /// The compression sensor reads outside its range.
    CompressionSensorRange = 113,
    /// The arm angle lies outside the arm's reach.
    ArmAngleRange = 114,
    /// The preload sensor's code does not change, or jumps as no force does.
    PreloadSensorImplausible = 116,
    /// The compression sensor's code does not change, or jumps as no tread does.
    CompressionSensorImplausible = 117,
    /// The preload exceeded its limit by more than the regulation band.
    Overpressure = 120,
    /// The preload did not reach its reference in time.
    PreloadNotReached = 121,
    /// The wheel does not turn although driven.
    DriveStalled = 122,
    /// The wheel turns against the command or far faster than asked.
    DriveRunaway = 123,
    /// Two steps in a row are off the table by different distances.
    StepsDisagree = 124,
    /// The drive takes another duty than its speed needs.
    DutyMismatch = 125,
    /// The arm moves farther than the wheel turns.
    ArmMismatch = 126,
    /// The preload strays from what the pre-tightener is asked for.
    PretightenerRunaway = 127,
    /// The drive's bridge puts out another duty than it was given.
    DriveBridge = 128,
    /// The pre-tightener's bridge puts out another duty than it was given.
    PretightenerBridge = 129,
    /// Odometry and arm disagree on the sleeve level at the end of travel.
    LevelMismatch = 131,
    /// Two steps of the table in a row were not found.
    StepsLost = 132,
    /// The wheel turns at a corner without getting over it.
    WheelSlips = 133,
    /// The position is not known and no step lies ahead that could set it.
    PositionUnknown = 134,
    /// The model task does not answer.
    ModelSilent = 141,
    /// A sensor was not at rest or not at zero in the self-test.
    SelfTest = 150,
    /// The emergency stop cut the bridges.
    EmergencyStop = 151,
    /// The control tick was late by more than a period.
    TickOverrun = 160,
    // Behind all others, whatever its code: logs have the place in this list.
    /// The arm angle sensor has no magnet in range.
    ArmAngleMagnet = 106,
    /// At the end of travel the position is less certain than the end has to be.
    PlaceUnconfirmed = 135,
    /// The friction is below what the load needs at the step ahead.
    FrictionShort = 136,
}

impl Fault {
    /// Every fault, in the order of codes.
    pub const ALL: [Self; 31] = [
        Self::WheelEncoderStale,
        Self::PreloadSensorStale,
        Self::CompressionSensorStale,
        Self::ArmAngleStale,
        Self::ReadbackStale,
        Self::ArmAngleMagnet,
        Self::PreloadSensorRange,
        Self::CompressionSensorRange,
        Self::ArmAngleRange,
        Self::PreloadSensorImplausible,
        Self::CompressionSensorImplausible,
        Self::Overpressure,
        Self::PreloadNotReached,
        Self::DriveStalled,
        Self::DriveRunaway,
        Self::StepsDisagree,
        Self::DutyMismatch,
        Self::ArmMismatch,
        Self::PretightenerRunaway,
        Self::DriveBridge,
        Self::PretightenerBridge,
        Self::LevelMismatch,
        Self::StepsLost,
        Self::WheelSlips,
        Self::PositionUnknown,
        Self::PlaceUnconfirmed,
        Self::FrictionShort,
        Self::ModelSilent,
        Self::SelfTest,
        Self::EmergencyStop,
        Self::TickOverrun,
    ];

    /// The stable code.
    pub const fn code(self) -> u16 {
        self as u16
    }

    /// One sentence for the operator.
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::WheelEncoderStale => "the wheel encoder stopped answering",
            Self::PreloadSensorStale => "the preload sensor stopped answering",
            Self::CompressionSensorStale => "the compression sensor stopped answering",
            Self::ArmAngleStale => "the arm angle sensor stopped answering or answers with errors",
            Self::ReadbackStale => "the readback of the bridges stopped answering",
            Self::ArmAngleMagnet => {
                "the magnet of the arm angle sensor is missing, too weak or too strong"
            }
            Self::PreloadSensorRange => "the preload sensor reads outside its range",
            Self::CompressionSensorRange => "the compression sensor reads outside its range",
            Self::ArmAngleRange => "the arm angle lies outside the arm's reach",
            Self::PreloadSensorImplausible => "the preload sensor reads what no force explains",
            Self::CompressionSensorImplausible => {
                "the compression sensor reads what no tread explains"
            }
            Self::Overpressure => "the preload exceeded its limit",
            Self::PreloadNotReached => "the preload did not reach its reference in time",
            Self::DriveStalled => "the wheel stands still although driven",
            Self::DriveRunaway => "the wheel does not turn as commanded",
            Self::StepsDisagree => "two steps in a row are off the table by different distances",
            Self::DutyMismatch => "duty and speed of the drive do not match",
            Self::ArmMismatch => "the arm moves farther than the wheel turns",
            Self::PretightenerRunaway => "the preload strays from its reference",
            Self::DriveBridge => "the drive's bridge puts out another duty than it was given",
            Self::PretightenerBridge => {
                "the pre-tightener's bridge puts out another duty than it was given"
            }
            Self::LevelMismatch => "the arm does not confirm the sleeve level at the end of travel",
            Self::StepsLost => "two steps of the table in a row were not found",
            Self::WheelSlips => "the wheel turns at a corner without getting over it",
            Self::PositionUnknown => {
                "the position is not known and no step lies ahead that could give it: go the other way"
            }
            Self::PlaceUnconfirmed => {
                "place unconfirmed: the end of travel is reached by a position that no step bears out"
            }
            Self::FrictionShort => {
                "friction below what this load needs: even the crossing that asks least of it slips"
            }
            Self::ModelSilent => "the model task does not answer",
            Self::EmergencyStop => "the emergency stop cut the bridges",
            Self::SelfTest => "a sensor was not at rest or not at zero in the self-test",
            Self::TickOverrun => "the control tick came more than a period late",
        }
    }
}

/// An active limit: reported, acted on, gone when its cause is gone.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[repr(u16)]
pub enum Limit {
    /// A corner was met before its window.
    StepEarly = 201,
    /// A window passed without a corner; the search goes on at crossing speed.
    StepLate = 202,
    /// A step of the table was not found.
    StepMissing = 203,
    /// A corner was met where the table has none.
    StepExtra = 204,
    /// The preload that the gap asks for exceeds the limit: the crossing is slowed.
    PreloadLimited = 205,
    /// Even the least crossing speed does not hold the gap within the preload limit.
    SpeedFloor = 206,
    /// A speed was moved out of a mode's band.
    ResonanceAvoided = 207,
    /// The stiffness estimate reached the end of its range.
    AdaptationBounded = 208,
    /// The drive waits before a corner for the preload to be reached.
    PreloadWait = 209,
    /// The friction utilisation leaves less than the wanted margin.
    SlipMarginLow = 210,
    /// The measured gap of a crossing is not the predicted one.
    GapStrange = 211,
    /// Compression and preload of a wheel at rest contradict each other.
    CompressionStrange = 212,
    /// The position is that of a record which no step ahead can confirm.
    PositionUnconfirmed = 213,
    /// A motion of the service mode has reached a bound.
    ServiceBounded = 214,
    /// The host has not repeated its request in the service mode.
    ServiceSilent = 215,
    /// A debugger has halted the core; meanwhile the motors were off and time stood still.
    CoreHalted = 216,
    /// The measured gap of a crossing is wider than the reference by more than 3 %.
    GapWide = 217,
    /// The wheel slipped on a corner.
    WheelSlipped = 218,
    /// A step is not as high as the table has it.
    StepHeight = 219,
    /// The wheel is beyond the end of travel: a step corrected the position late.
    EndOverrun = 220,
}

impl Limit {
    /// Every limit, in the order of codes.
    pub const ALL: [Self; 20] = [
        Self::StepEarly,
        Self::StepLate,
        Self::StepMissing,
        Self::StepExtra,
        Self::PreloadLimited,
        Self::SpeedFloor,
        Self::ResonanceAvoided,
        Self::AdaptationBounded,
        Self::PreloadWait,
        Self::SlipMarginLow,
        Self::GapStrange,
        Self::CompressionStrange,
        Self::PositionUnconfirmed,
        Self::ServiceBounded,
        Self::ServiceSilent,
        Self::CoreHalted,
        Self::GapWide,
        Self::WheelSlipped,
        Self::StepHeight,
        Self::EndOverrun,
    ];

    /// The stable code.
    pub const fn code(self) -> u16 {
        self as u16
    }

    /// One sentence for the operator.
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::StepEarly => "a corner was met before its window",
            Self::StepLate => {
                "a step's window passed without a corner; searching on at crossing speed"
            }
            Self::StepMissing => "a step of the table was not found",
            Self::StepExtra => "a corner was met where the step table has none",
            Self::PreloadLimited => "the preload limit was reached: the crossing is slowed",
            Self::SpeedFloor => {
                "the least crossing speed does not hold the gap within the preload limit"
            }
            Self::ResonanceAvoided => "a speed was moved out of a structural mode's band",
            Self::AdaptationBounded => "the stiffness estimate reached the end of its range",
            Self::PreloadWait => "waiting before a corner until the preload is reached",
            Self::SlipMarginLow => "the friction utilisation leaves less than the wanted margin",
            Self::GapStrange => "the measured gap is not the predicted one",
            Self::CompressionStrange => "compression of the tread and preload do not match",
            Self::PositionUnconfirmed => {
                "the position comes from a record, and no step ahead can confirm it"
            }
            Self::ServiceBounded => "a motion in the service mode has reached a bound",
            Self::ServiceSilent => "the host fell silent in the service mode",
            Self::GapWide => "the measured gap is more than 3 % over the reference",
            Self::WheelSlipped => "the wheel slipped on a corner",
            Self::StepHeight => "a step is not as high as the table has it",
            Self::EndOverrun => "the wheel is beyond the end: a step showed the place late",
            Self::CoreHalted => "a debugger halted the core, and the motors were off meanwhile",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_ascend_in_their_own_ranges() {
        let faults = Fault::ALL.map(Fault::code);
        let limits = Limit::ALL.map(Limit::code);
        assert!(faults.is_sorted_by(|a, b| a < b) && faults.iter().all(|c| (100..200).contains(c)));
        assert!(limits.is_sorted_by(|a, b| a < b) && limits.iter().all(|c| (200..300).contains(c)));
    }
}
