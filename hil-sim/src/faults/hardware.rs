//! What can break of the board itself, in registers and on lines: on the emulated board
//! alone.

use super::catalogue::{one, plain};
use super::{Entry, Kind, Target};

const GIVES: &str = "gives this code whatever the voltage";
const TURNED: &str = "a bit of its bytes in flash is turned over";
const CUT: &str = "power goes in the middle of an operation of the flash";
const PULLED: &str = "the reset pin is pulled in the middle of an operation of the flash";
const CAUGHT: &str = "is caught in a loop in one of its turns";

const fn stuck(target: Target) -> Entry {
    one(target, Kind::Stuck, 30_000.0, (0.0, 65_535.0), "of 65535", GIVES)
}

const fn hung(target: Target) -> Entry {
    plain(target, Kind::Hung, CAUGHT)
}

/// By its number from the beginning; of the image's, from behind its last bit on again.
const fn turned(target: Target) -> Entry {
    one(target, Kind::BitErrors, 1000.0, (0.0, 32_767.0), "from its first", TURNED)
}

const fn broken_off(kind: Kind, text: &'static str) -> Entry {
    one(Target::ParameterSave, kind, 100.0, (1.0, 10_000.0), "from its first", text)
}

/// All of them, in the order of the matrix.
pub const HARDWARE: &[Entry] = {
    use Kind::{BitErrors, Flooding, Gone, Hung, Off, Reset, Stalled, Stuck, Torn, Weak};
    use Target::{
        AngleBus, AngleTask, Debugger, DisplacementTask, Dma, EncoderLineA, EncoderLineB, HostLine,
        Image, ImageSet, Interrupt, JournalTask, LineTask, LoadCellConverter, ModelTask,
        PressureTask, Processor, ResetPin, SpareSet, SpeedTask, StoredSet, Supply, TickTask, Timer,
        TreadConverter,
    };
    &[
        stuck(LoadCellConverter),
        stuck(TreadConverter),
        one(AngleBus, BitErrors, 1.0, (1.0, 65_535.0), "mask", "these bits come turned over"),
        plain(AngleBus, Off, "the line is broken"),
        plain(EncoderLineA, Off, "the line is broken"),
        plain(EncoderLineB, Off, "the line is broken"),
        plain(Dma, Stalled, "moves nothing"),
        plain(Timer, Stuck, "its flags cannot be cleared"),
        plain(Interrupt, Flooding, "asks without end"),
        plain(Processor, Hung, "what it executes is caught in a loop"),
        hung(SpeedTask),
        hung(PressureTask),
        hung(DisplacementTask),
        hung(AngleTask),
        hung(TickTask),
        hung(ModelTask),
        hung(JournalTask),
        hung(LineTask),
        plain(Supply, Off, "falls too low for a moment: brown-out"),
        plain(Supply, Gone, "is gone for a moment, without a warning"),
        plain(Supply, Weak, "dips below its threshold for half a millisecond"),
        plain(ResetPin, Reset, "is pulled for a moment"),
        plain(Debugger, Reset, "asks for a reset"),
        plain(HostLine, Flooding, "random bytes in every millisecond"),
        turned(StoredSet),
        turned(SpareSet),
        turned(ImageSet),
        one(Image, BitErrors, 100_000.0, (0.0, 1_048_575.0), "from its first", TURNED),
        broken_off(Torn, CUT),
        broken_off(Reset, PULLED),
    ]
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::CATALOGUE;

    #[test]
    fn none_is_of_software_too() {
        for entry in HARDWARE {
            assert!(CATALOGUE.iter().all(|other| other.target != entry.target), "{entry:?}");
            assert!(entry.target.is_hardware());
            let (low, high) = entry.range;
            assert!(low <= entry.magnitude && entry.magnitude <= high, "{entry:?}");
            assert_eq!(low == high, entry.unit.is_empty(), "{entry:?}");
        }
        assert!(!Target::Encoder.is_hardware());
    }
}
