//! What each fault and each limit stands for: cause, how it is found, what is done, what
//! ends it. For decoder, documentation and tests; the firmware carries only code and
//! sentence.

use super::{Fault, Limit};

/// A fault in full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultDescription {
    /// What may have brought it about.
    pub cause: &'static str,
    /// How it is found, and after how long.
    pub detection: &'static str,
    /// What the drive does.
    pub reaction: &'static str,
    /// What ends it.
    pub reset: &'static str,
}

/// What is done about every fault.
const HOLD: &str = "both bridges off in the same tick; the self-locking gears hold wheel and \
                    screw, the preload stays in its spring";
/// The same with nothing moving yet.
const STAY: &str = "does not start; both bridges stay off";
/// What ends what a look at the rig ends.
const LOOK: &str = "reset, once the cause is mended; the self-test must pass";
/// Reset where the position may be wrong.
const BACK: &str = "reset; then a retraction to the stow end, which sets the position anew";

const fn held(
    cause: &'static str,
    detection: &'static str,
    reset: &'static str,
) -> FaultDescription {
    FaultDescription { cause, detection, reaction: HOLD, reset }
}

impl Fault {
    /// Its account.
    pub const fn description(self) -> FaultDescription {
        match self {
            Self::SpeedStale => held(
                "encoder cable, counter, or its task; a count that jumps",
                "no plausible count for sense.stale_after_s",
                BACK,
            ),
            Self::PressureStale => held(
                "load cell cable, converter, or its task",
                "no good code for sense.stale_after_s",
                LOOK,
            ),
            Self::DisplacementStale => held(
                "displacement sensor cable, converter, or its task",
                "no good code for sense.stale_after_s",
                LOOK,
            ),
            Self::AngleStale => held(
                "angle sensor cable or bus; parity or error flag in every frame",
                "no good frame for sense.stale_after_s",
                LOOK,
            ),
            Self::ReadbackStale => held(
                "converter of the readback, or its clock",
                "no conversion of the bridges' outputs for 20 ticks",
                LOOK,
            ),
            Self::PressureRange => held(
                "broken bridge of the load cell, short, overload",
                "code outside 2 to 98 % for sense.stale_after_s",
                LOOK,
            ),
            Self::DisplacementRange => held(
                "broken bridge of the displacement sensor, short",
                "code outside 2 to 98 % for sense.stale_after_s",
                LOOK,
            ),
            Self::AngleRange => held(
                "angle sensor or magnet loose, zero wrong",
                "angle outside the arm's reach for sense.stale_after_s",
                LOOK,
            ),
            Self::PressureImplausible => held(
                "converter or reference stuck, connector loose, spring broken",
                "the same code 64 times in a row, or eight jumps of 4 N a tick, while the drive is on",
                LOOK,
            ),
            Self::DisplacementImplausible => held(
                "converter or reference stuck, connector loose, tread torn off",
                "the same code 64 times in a row, or eight jumps of 0.1 mm a tick, while the drive is on",
                LOOK,
            ),
            Self::Overpressure => held(
                "pre-tightener runs away, load cell reads too little, wheel forced up a step",
                "preload 10 % over its limit for 10 ticks, unless it is being relieved",
                LOOK,
            ),
            Self::PreloadNotReached => held(
                "pre-tightener stalled or weak, spring broken, load cell reads too little",
                "preload short by 10 % of cruise for 400 ticks of what the actuator's model has \
                 reached; or it does not stand in the time that any preload takes",
                LOOK,
            ),
            Self::DriveStalled => held(
                "motor, bridge or gearbox blocked; encoder line lost; end stop",
                "the reference goes 0.4 mm (2 mm from rest) while the encoder goes less than 0.05 mm",
                LOOK,
            ),
            Self::DriveRunaway => held(
                "bridge at full duty, reversed, or acting late; encoder slow",
                "the way by the encoder bends from the reference by 2.5 counts within 12 ticks, or \
                 leaves it by 0.15 mm; any turning of a wheel whose bridge is off",
                LOOK,
            ),
            Self::StepsDisagree => held(
                "encoder counts too few or too many; wheel slipped between steps; table wrong",
                "two steps in a row outside their tolerance, by ways that differ by more than it",
                BACK,
            ),
            Self::DutyMismatch => held(
                "motor weak, encoder counts too few or too many, wheel dragged or at a stop",
                "in steady motion the speed loop adds less than -0.05 or more than 0.13 of duty for \
                 120 ticks",
                BACK,
            ),
            Self::ArmMismatch => held(
                "wheel slides off a step, arm sensor jumps or has a wrong gain",
                "the arm moves 0.25 mm farther than the wheel turns, within 32 ticks",
                BACK,
            ),
            Self::PretightenerRunaway => held(
                "pre-tightener at full duty, reversed or weak; spring broken; load cell jumps",
                "preload off the actuator's model by a quarter of cruise for 10 ticks",
                LOOK,
            ),
            Self::DriveBridge => held(
                "drive's bridge stuck, at full duty, reversed or late; motor supply off; its \
                 divider or the readback's converter",
                "drive's output off the given duty, through the same lag, by 0.02 and a 32nd of \
                 it for 4 ticks",
                LOOK,
            ),
            Self::PretightenerBridge => held(
                "pre-tightener's bridge stuck, at full duty, reversed or late; motor supply off; \
                 its divider or the readback's converter",
                "pre-tightener's output off the given duty, through the same lag, by 0.02 and a \
                 32nd of it for 4 ticks",
                LOOK,
            ),
            Self::LevelMismatch => held(
                "steps of another height or number, arm sensor wrong, position lost",
                "at the end of travel arm and count of steps do not agree",
                BACK,
            ),
            Self::StepsLost => held(
                "wheel slips on the smooth wall, arm sensor stuck, table wrong",
                "two steps of the table in a row are not felt",
                BACK,
            ),
            Self::WheelSlips => held(
                "friction lost, step too high, preload lost",
                "on a corner the encoder goes farther than any crossing takes",
                "reset; then the other way",
            ),
            Self::PositionUnknown => FaultDescription {
                cause: "started between the last step and the end of travel after a reset",
                detection: "before the start",
                reaction: STAY,
                reset: "reset; then the other way",
            },
            Self::ModelSilent => {
                held("model task hung or starved", "no answer within 500 ticks of a request", LOOK)
            }
            Self::SelfTest => FaultDescription {
                cause: "wheel turns, or zero of load cell or displacement sensor is off",
                detection: "within 2 s of boot or reset",
                reaction: STAY,
                reset: LOOK,
            },
            Self::EmergencyStop => held(
                "somebody pressed it",
                "at once, by the line that cuts the bridges",
                "reset, once it is released",
            ),
            Self::TickOverrun => held(
                "another task or interrupt held the processor",
                "at the first tick after the one that was lost",
                LOOK,
            ),
        }
    }
}

impl Limit {
    /// What is done while it lasts, and what ends it.
    pub const fn description(self) -> (&'static str, &'static str) {
        match self {
            Self::StepEarly => {
                ("crosses at crossing speed; the odometry is not moved", "the step is behind")
            }
            Self::StepLate => (
                "searches on at crossing speed and crossing preload",
                "a corner is met, or the step given up",
            ),
            Self::StepMissing => ("goes on to the next step of the table", "the next step"),
            Self::StepExtra => ("crosses at crossing speed", "the step is behind"),
            Self::PreloadLimited => {
                ("crosses as slowly as the preload limit asks for", "the step is behind")
            }
            Self::SpeedFloor => {
                ("crosses at the least speed with the limit's preload", "the step is behind")
            }
            Self::ResonanceAvoided => ("takes the nearest speed outside the band", "the next plan"),
            Self::AdaptationBounded => {
                ("keeps the end of the range", "a crossing within the range")
            }
            Self::PreloadWait => {
                ("slows down and, if need be, stands before the window", "the preload stands")
            }
            Self::GapStrange => (
                "goes on; the estimate follows by its step at most, or not at all",
                "a crossing whose gap is as predicted",
            ),
            Self::TreadStrange => (
                "goes on; load cell or displacement sensor is wrong, or the tread another one",
                "the next preload phase",
            ),
            Self::PositionUnconfirmed => (
                "goes on from the record of a run that hung or lost its supply",
                "the next step that is found",
            ),
            Self::SlipMarginLow => ("goes on", "the next plan"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_account_says_something_of_its_own() {
        for fault in Fault::ALL {
            let FaultDescription { cause, detection, reaction, reset } = fault.description();
            for text in [cause, detection, reaction, reset] {
                assert!(text.len() > 10 && !text.contains('|'), "{fault:?}");
            }
            let alike = |other: &&Fault| other.description().cause == cause;
            assert_eq!(Fault::ALL.iter().filter(alike).count(), 1, "{fault:?}");
        }
    }

    #[test]
    fn codes_ascend_in_their_own_ranges() {
        let faults = Fault::ALL.map(Fault::code);
        let limits = Limit::ALL.map(Limit::code);
        assert!(faults.is_sorted_by(|a, b| a < b) && faults.iter().all(|c| (100..200).contains(c)));
        assert!(limits.is_sorted_by(|a, b| a < b) && limits.iter().all(|c| (200..300).contains(c)));
    }

    /// The page that an operator reads.
    const PAGE: &str = include_str!("../../docs/MODES.md");

    #[test]
    fn the_page_says_of_each_fault_what_its_account_says() {
        for fault in Fault::ALL {
            let (code, sentence) = (fault.code(), fault.sentence());
            let FaultDescription { cause, detection, reaction, reset } = fault.description();
            let row = format!("| {code} | {sentence} | {cause} | {detection} | {reset} |");
            assert_eq!(PAGE.matches(&row).count(), 1, "{row}");
            let code = code.to_string();
            let reactions = |line: &&str| line.starts_with("- ") && line.contains(&code);
            let line = PAGE.lines().find(reactions).expect("a reaction");
            assert!(line.ends_with(&format!(": {reaction}.")), "{line}");
            let alike = |other: &&Fault| other.sentence() == sentence;
            assert_eq!(Fault::ALL.iter().filter(alike).count(), 1, "{sentence}");
        }
    }

    #[test]
    fn the_page_says_of_each_limit_what_its_account_says() {
        for limit in Limit::ALL {
            let (code, sentence) = (limit.code(), limit.sentence());
            let (reaction, until) = limit.description();
            let row = format!("| {code} | {sentence} | {reaction} | {until} |");
            assert_eq!(PAGE.matches(&row).count(), 1, "{row}");
            let alike = |other: &&Limit| other.sentence() == sentence;
            assert_eq!(Limit::ALL.iter().filter(alike).count(), 1, "{sentence}");
        }
    }
}
