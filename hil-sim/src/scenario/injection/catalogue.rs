//! Everything that can be broken, with its usual measure: in software on every target, and
//! of the board itself, in registers and on lines, on the emulated board alone.

use super::kinds::{Kind, Target};

/// A fault that a scenario can name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// What breaks.
    pub target: Target,
    /// How.
    pub kind: Kind,
    /// How badly, unless a scenario says otherwise.
    pub magnitude: f64,
    /// Least and largest magnitude that a scenario may say; equal where it says none.
    pub range: (f64, f64),
    /// Unit of the magnitude.
    pub unit: &'static str,
    /// What happens.
    pub text: &'static str,
}

const fn one(
    target: Target,
    kind: Kind,
    magnitude: f64,
    range: (f64, f64),
    unit: &'static str,
    text: &'static str,
) -> Entry {
    Entry { target, kind, magnitude, range, unit, text }
}

/// One that has no measure.
const fn plain(target: Target, kind: Kind, text: &'static str) -> Entry {
    one(target, kind, 0.0, (0.0, 0.0), "", text)
}

const SILENT: &str = "no new reading comes";
const FROZEN: &str = "the code stands still, fresh in time";
const RANDOM: &str = "random codes";

const fn gain(target: Target, times: f64) -> Entry {
    let text = "reads so many times what is true, from its zero";
    one(target, Kind::Gain, times, (0.0, 10.0), "x", text)
}

const fn slow(target: Target, seconds: f64) -> Entry {
    one(target, Kind::Slow, seconds, (0.001, 10.0), "s", "follows with this time constant")
}

const fn delayed(target: Target, seconds: f64, text: &'static str) -> Entry {
    one(target, Kind::Delayed, seconds, (0.001, 2.0), "s", text)
}

const fn intermittent(target: Target) -> Entry {
    let text = "gives nothing for this part of every 100 ms";
    one(target, Kind::Intermittent, 0.5, (0.0, 1.0), "of 100 ms", text)
}

const fn weak(target: Target, part: f64) -> Entry {
    one(
        target,
        Kind::Weak,
        part,
        (0.0, 1.0),
        "x",
        "gives this part of its duty, its bridge being sound",
    )
}

const fn runaway(target: Target) -> Entry {
    let text = "takes this duty whatever is asked while its bridge is on, in the bridge";
    one(target, Kind::Runaway, 1.0, (-1.0, 1.0), "duty", text)
}

/// Those of software, in the order of the matrix.
pub const CATALOGUE: &[Entry] = {
    use Kind::{
        Broken, Doubled, Flooding, Garbage, Gone, Hung, Off, Offset, Overrun, Random, Recorded,
        Reversed, Slip, Stalled, Stuck, Torn,
    };
    use Target::{
        Angle, Commands, CompressionSensor, Drive, DriveReadback, Encoder, Load, Log, Model,
        PreloadSensor, Pretightener, PretightenerReadback, Readback, Reset, Spring, Tick, Tread,
        Wheel,
    };
    &[
        plain(Encoder, Off, SILENT),
        plain(Encoder, Stuck, FROZEN),
        plain(Encoder, Garbage, RANDOM),
        gain(Encoder, 1.5),
        one(Encoder, Offset, 2.0, (-100.0, 100.0), "mm", "jumps by so much once"),
        slow(Encoder, 0.1),
        delayed(Encoder, 0.05, "follows this much later"),
        intermittent(Encoder),
        plain(PreloadSensor, Off, SILENT),
        plain(PreloadSensor, Stuck, FROZEN),
        plain(PreloadSensor, Garbage, RANDOM),
        gain(PreloadSensor, 1.2),
        one(PreloadSensor, Offset, 6.0, (-200.0, 200.0), "N", "reads so much more than is true"),
        slow(PreloadSensor, 0.1),
        delayed(PreloadSensor, 0.05, "follows this much later"),
        intermittent(PreloadSensor),
        plain(CompressionSensor, Off, SILENT),
        plain(CompressionSensor, Stuck, FROZEN),
        plain(CompressionSensor, Garbage, RANDOM),
        gain(CompressionSensor, 1.2),
        one(CompressionSensor, Offset, 0.3, (-5.0, 5.0), "mm", "reads so much more than is true"),
        slow(CompressionSensor, 0.1),
        delayed(CompressionSensor, 0.05, "follows this much later"),
        intermittent(CompressionSensor),
        plain(Angle, Off, SILENT),
        plain(Angle, Stuck, FROZEN),
        plain(Angle, Garbage, RANDOM),
        gain(Angle, 1.2),
        one(Angle, Offset, 1.0, (-90.0, 90.0), "deg", "reads so much more than is true"),
        slow(Angle, 0.1),
        delayed(Angle, 0.05, "follows this much later"),
        intermittent(Angle),
        plain(Readback, Off, SILENT),
        intermittent(Readback),
        plain(DriveReadback, Stuck, FROZEN),
        plain(DriveReadback, Garbage, RANDOM),
        gain(DriveReadback, 1.2),
        one(DriveReadback, Offset, 0.1, (-2.5, 2.5), "duty", "reads so much more than is true"),
        slow(DriveReadback, 0.1),
        delayed(DriveReadback, 0.05, "follows this much later"),
        plain(PretightenerReadback, Stuck, FROZEN),
        plain(PretightenerReadback, Garbage, RANDOM),
        gain(PretightenerReadback, 1.2),
        one(
            PretightenerReadback,
            Offset,
            0.1,
            (-2.5, 2.5),
            "duty",
            "reads so much more than is true",
        ),
        slow(PretightenerReadback, 0.1),
        delayed(PretightenerReadback, 0.05, "follows this much later"),
        plain(Drive, Stalled, "gives no force, its bridge being sound"),
        plain(Drive, Stuck, "keeps its last duty, in the bridge"),
        weak(Drive, 0.4),
        plain(Drive, Reversed, "turns the other way, in the bridge"),
        delayed(Drive, 0.1, "acts this much later, in the bridge"),
        runaway(Drive),
        plain(Pretightener, Stalled, "gives no force, its bridge being sound"),
        plain(Pretightener, Stuck, "keeps its last duty, in the bridge"),
        weak(Pretightener, 0.4),
        plain(Pretightener, Reversed, "turns the other way, in the bridge"),
        delayed(Pretightener, 0.1, "acts this much later, in the bridge"),
        runaway(Pretightener),
        one(Wheel, Slip, 0.5, (0.01, 1.0), "x", "friction of tread on wall drops to this part"),
        one(
            Tread,
            Torn,
            0.3,
            (0.05, 1.0),
            "x",
            "a sector of 40 degrees keeps this part of its stiffness",
        ),
        one(
            Spring,
            Broken,
            0.5,
            (0.05, 1.0),
            "x",
            "the spring keeps this part of its rate and force",
        ),
        one(Load, Doubled, 2.0, (0.0, 5.0), "x", "the top load is so many times as large"),
        one(Tick, Overrun, 0.005, (0.001, 0.1), "s", "control ticks are lost for so long, once"),
        plain(Model, Hung, "the model task answers no request"),
        plain(Log, Gone, "nobody reads the log"),
        plain(Commands, Flooding, "a command in every tick that no moving mode takes"),
        one(Commands, Random, 50.0, (0.0, 1000.0), "1/s", "so many random commands a second"),
        plain(Reset, Recorded, "the controller starts again with its record"),
        one(Reset, Offset, 1.5, (-6.5, 6.5), "mm", "by the supply, its record off by so much"),
        plain(Reset, Gone, "the controller starts again without its record"),
    ]
};

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

/// Those of the board itself, in the order of the matrix.
pub const HARDWARE: &[Entry] = {
    use Kind::{BitErrors, Flooding, Gone, Hung, Off, Reset, Stalled, Stuck, Torn, Weak};
    use Target::{
        AngleBus, ArmAngleTask, CompressionSensorTask, Debugger, Dma, EncoderLineA, EncoderLineB,
        HostLine, Image, ImageSet, Interrupt, JournalTask, LineTask, ModelTask,
        PreloadSensorConverter, PreloadSensorTask, Processor, ResetPin, SpareSet, StoredSet,
        Supply, TickTask, Timer, TreadConverter, WheelEncoderTask,
    };
    &[
        stuck(PreloadSensorConverter),
        stuck(TreadConverter),
        one(AngleBus, BitErrors, 1.0, (1.0, 65_535.0), "mask", "these bits come turned over"),
        plain(AngleBus, Off, "the line is broken"),
        plain(EncoderLineA, Off, "the line is broken"),
        plain(EncoderLineB, Off, "the line is broken"),
        plain(Dma, Stalled, "moves nothing"),
        plain(Timer, Stuck, "its flags cannot be cleared"),
        plain(Interrupt, Flooding, "asks without end"),
        plain(Processor, Hung, "what it executes is caught in a loop"),
        hung(WheelEncoderTask),
        hung(PreloadSensorTask),
        hung(CompressionSensorTask),
        hung(ArmAngleTask),
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

/// The fault of this kind at this target, if there is one.
#[must_use]
pub fn entry(target: Target, kind: Kind) -> Option<&'static Entry> {
    let mut all = CATALOGUE.iter().chain(HARDWARE);
    all.find(|entry| entry.target == target && entry.kind == kind)
}

impl Target {
    /// Whether it is of the board's hardware, which a run in software has not.
    #[must_use]
    pub fn is_hardware(self) -> bool {
        HARDWARE.iter().any(|entry| entry.target == self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_there_once_and_within_its_range() {
        let all: Vec<&Entry> = CATALOGUE.iter().chain(HARDWARE).collect();
        for entry in &all {
            let alike = |e: &&&Entry| (e.target, e.kind) == (entry.target, entry.kind);
            assert_eq!(all.iter().filter(alike).count(), 1, "{entry:?}");
            let (low, high) = entry.range;
            assert!(low <= entry.magnitude && entry.magnitude <= high, "{entry:?}");
            assert_eq!(low == high, entry.unit.is_empty(), "{entry:?}");
        }
        assert!(CATALOGUE.iter().all(|entry| !entry.target.is_hardware()));
    }
}
