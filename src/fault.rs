//! Latched faults (codes 100 to 199) and active limits (200 to 299). Codes are stable: no number
//! gets a second meaning. Cause, detection, reaction and reset of each: `docs/MODES.md`.

/// Declares an enum: each variant has its words, which the method of this name gives.
macro_rules! worded {
    ($(#[$meta:meta])* $name:ident, $words:ident:
        $($(#[$of:meta])* $variant:ident $text:literal;)*) => {
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        $(#[$meta])*
        pub enum $name {
            $($(#[$of])* #[doc = concat!("In words: ", $text, ".")] $variant,)*
        }

        impl $name {
            /// Every one.
            pub const ALL: [Self; [$($text),*].len()] = [$(Self::$variant),*];

            /// In words.
            pub const fn $words(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                }
            }
        }
    };
}
pub(crate) use worded;

/// Declares codes: each has one line with its name, its number and its sentence for the operator.
macro_rules! codes {
    ($(#[$doc:meta])* $name:ident: $($variant:ident = $code:literal, $sentence:literal;)*) => {
        $(#[$doc])*
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize,
            serde::Deserialize,
        )]
        #[repr(u16)]
        pub enum $name {
            $(#[doc = $sentence] $variant = $code,)*
        }

        impl $name {
            /// Every one, in the order of codes.
            pub const ALL: [Self; [$($code),*].len()] = {
                let mut all = [$(Self::$variant),*];
                let mut end = 1;
                while end < all.len() {
                    let mut at = end;
                    while at > 0 && all[at].code() < all[at - 1].code() {
                        (all[at], all[at - 1]) = (all[at - 1], all[at]);
                        at -= 1;
                    }
                    end += 1;
                }
                all
            };

            /// The stable code.
            pub const fn code(self) -> u16 {
                self as u16
            }

            /// One sentence for the operator.
            pub const fn sentence(self) -> &'static str {
                match self {
                    $(Self::$variant => $sentence,)*
                }
            }
        }
    };
}

codes! {
    /// A latched fault: the drive holds until it is reset.
    Fault:
    WheelEncoderStale = 101, "the wheel encoder stopped answering";
    PreloadSensorStale = 102, "the preload sensor stopped answering";
    CompressionSensorStale = 103, "the compression sensor stopped answering";
    ArmAngleStale = 104, "the arm angle sensor stopped answering or answers with errors";
    ReadbackStale = 105, "the readback of the bridges stopped answering";
    PreloadSensorRange = 112, "the preload sensor reads outside its range";
    CompressionSensorRange = 113, "the compression sensor reads outside its range";
    ArmAngleRange = 114, "the arm angle lies outside the arm's reach";
    PreloadSensorImplausible = 116, "the preload sensor reads what no force explains";
    CompressionSensorImplausible = 117, "the compression sensor reads what no tread explains";
    Overpressure = 120, "the preload exceeded its limit";
    PreloadNotReached = 121, "the preload did not reach its reference in time";
    DriveStalled = 122, "the wheel stands still although driven";
    DriveRunaway = 123, "the wheel does not turn as commanded";
    StepsDisagree = 124, "two steps in a row are off the table by different distances";
    DutyMismatch = 125, "duty and speed of the drive do not match";
    ArmMismatch = 126, "the arm moves farther than the wheel turns";
    PretightenerRunaway = 127, "the preload strays from its reference";
    DriveBridge = 128, "the drive's bridge puts out another duty than it was given";
    PretightenerBridge = 129, "the pre-tightener's bridge puts out another duty than it was given";
    LevelMismatch = 131, "the arm does not confirm the sleeve level at the end of travel";
    StepsLost = 132, "two steps of the table in a row were not found";
    WheelSlips = 133, "the wheel turns at a corner without getting over it";
    PositionUnknown = 134,
        "the position is not known and no step lies ahead that could give it: go the other way";
    ModelSilent = 141, "the model task does not answer";
    SelfTest = 150, "a sensor was not at rest or not at zero in the self-test";
    EmergencyStop = 151, "the emergency stop cut the bridges";
    TickOverrun = 160, "the control tick came more than a period late";
    // Behind all others, whatever its code: logs have the place in this list.
    ArmAngleMagnet = 106, "the magnet of the arm angle sensor is missing, too weak or too strong";
    PlaceUnconfirmed = 135,
        "place unconfirmed: the end of travel is reached by a position that no step bears out";
    FrictionShort = 136,
        "friction below what this load needs: even the crossing that asks least of it slips";
}

codes! {
    /// An active limit: reported, acted on, gone when its cause is gone.
    Limit:
    StepEarly = 201, "a corner was met before its window";
    StepLate = 202, "a step's window passed without a corner; searching on at crossing speed";
    StepMissing = 203, "a step of the table was not found";
    StepExtra = 204, "a corner was met where the step table has none";
    PreloadLimited = 205, "the preload limit slows the crossing below control.safe_speed_mm_s";
    SpeedFloor = 206, "the least crossing speed does not hold the gap within the preload limit";
    ResonanceAvoided = 207, "a speed was moved out of a structural mode's band";
    AdaptationBounded = 208, "the stiffness estimate reached the end of its range";
    PreloadWait = 209, "waiting before a corner until the preload is reached";
    SlipMarginLow = 210, "the friction utilisation leaves less than the wanted margin";
    GapStrange = 211, "the measured gap is not the predicted one";
    CompressionStrange = 212, "compression of the tread and preload do not match";
    PositionUnconfirmed = 213,
        "the position comes from a record, and no step ahead can confirm it";
    ServiceBounded = 214, "a motion in the service mode has reached a bound";
    ServiceSilent = 215, "the host fell silent in the service mode";
    CoreHalted = 216, "a debugger halted the core, and the motors were off meanwhile";
    GapWide = 217, "the measured gap is more than 3 % over the reference";
    WheelSlipped = 218, "the wheel slipped on a corner";
    StepHeight = 219, "a step is not as high as the table has it";
    EndOverrun = 220, "the wheel is beyond the end: a step showed the place late";
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
