//! All faults with their default magnitudes: those of software on every target, and those of
//! the board, in registers and on lines, on the emulated board alone.

use std::sync::LazyLock;

use interstage::sense::raw::SensorId;

use super::{Kind, Target};
use crate::plant::sensors::{MORE, SENSORS};

/// A fault that a scenario can name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    pub target: Target,
    pub kind: Kind,
    pub magnitude: f64,
    /// Least and largest magnitude of a scenario; equal where there is none.
    pub range: (f64, f64),
    pub unit: &'static str,
    /// What happens.
    pub text: &'static str,
    /// Codes that name it; none where only [`restarts`] do.
    pub codes: &'static [u16],
    /// The task that hangs, on the board.
    pub task: Option<&'static str>,
}

// Codes that name a sensor or what carries its readings. Two that are compared share a code.
const ENCODER: &[u16] = &[101, 122, 123, 124, 125, 126, 131];
const PRELOAD: &[u16] = &[102, 112, 116, 120, 121, 127, 212];
const COMPRESSION: &[u16] = &[103, 113, 117, 208, 211, 212];
const ARM: &[u16] = &[104, 106, 114, 126, 131];
/// The button's other contact takes the supply from the motors, not from their bridges.
const STOP: &[u16] = &[128, 129, 151];
const DEBUGGER: &[u16] = &[101, 123, 216];

/// Beginnings of the restarts or starts in the matrix that name such a fault; none if the
/// controller goes on.
pub const fn restarts(target: Target, kind: Kind) -> &'static [&'static str] {
    use Target::*;
    match (target, kind) {
        // By the program, once the supply is back.
        (Supply, Kind::Weak) | (Debugger, Kind::Reset) => &["reset by software"],
        (Reset, Kind::Recorded) | (ResetPin, _) | (ParameterSave, Kind::Reset) => &["reset by pin"],
        (Reset | Supply | ParameterSave, _) => &["reset by supply"],
        (Processor | Timer | Interrupt | TickTask | ModelTask | JournalTask | LineTask, _)
        | (WheelEncoderTask | PreloadSensorTask | CompressionSensorTask | ArmAngleTask, _) => {
            &["reset by watchdog"]
        }
        (Image, Kind::BitErrors | Kind::TwoWrongBits) => &["image damaged"],
        (ImageSet, _) => &["parameters damaged", "image damaged"],
        (StoredSet, _) => &["parameters damaged"],
        (OptionBytes, _) => &["flash: one bank"],
        _ => &[],
    }
}

const fn one(
    target: Target,
    kind: Kind,
    magnitude: f64,
    range: (f64, f64),
    unit: &'static str,
    text: &'static str,
) -> Entry {
    Entry { target, kind, magnitude, range, unit, text, codes: &[], task: None }
}

impl Entry {
    /// The same with the codes that name it.
    const fn by(self, codes: &'static [u16]) -> Self {
        Self { codes, ..self }
    }
}

/// A fault without magnitude.
const fn plain(target: Target, kind: Kind, text: &'static str) -> Entry {
    one(target, kind, 0.0, (0.0, 0.0), "", text)
}

const SILENT: &str = "no new reading comes";

fn delayed(target: Target, seconds: f64, text: &'static str) -> Entry {
    one(target, Kind::Delayed, seconds, (0.001, 2.0), "s", text)
}

fn intermittent(target: Target) -> Entry {
    let text = "gives nothing for this part of every 100 ms";
    one(target, Kind::Intermittent, 0.5, (0.0, 1.0), "of 100 ms", text)
}

/// Wrong codes of a sensor or readback: its gain, and its offset with range, unit and text.
fn distorted(
    target: Target,
    (times, (offset, most, unit, text)): (f64, (f64, f64, &'static str, &'static str)),
) -> [Entry; 6] {
    let gain = "reads so many times what is true, from its zero";
    [
        plain(target, Kind::Stuck, "the code stands still, fresh in time"),
        plain(target, Kind::Garbage, "random codes"),
        one(target, Kind::Gain, times, (0.0, 10.0), "x", gain),
        one(target, Kind::Offset, offset, (-most, most), unit, text),
        one(target, Kind::Slow, 0.1, (0.001, 10.0), "s", "follows with this time constant"),
        delayed(target, 0.05, "follows this much later"),
    ]
}

/// Faults of a motor and its bridge.
fn actuator(target: Target) -> [Entry; 8] {
    let weak = "gives this part of its duty, its bridge being sound";
    let regulates = "regulates its current to that of this duty at standstill";
    let runaway = "takes this duty whatever is asked while its bridge is on, in the bridge";
    [
        plain(target, Kind::Stalled, "gives no force, its bridge being sound"),
        plain(target, Kind::Off, "puts out nothing, in the bridge"),
        plain(target, Kind::Stuck, "keeps its last duty, in the bridge"),
        one(target, Kind::Weak, 0.4, (0.0, 1.0), "x", weak),
        plain(target, Kind::Reversed, "turns the other way, in the bridge"),
        delayed(target, 0.1, "acts this much later, in the bridge"),
        one(target, Kind::Runaway, 1.0, (-1.0, 1.0), "duty", runaway),
        one(target, Kind::Regulating, 0.5, (0.0, 1.0), "duty", regulates),
    ]
}

/// Those of software, in the order of the matrix.
pub static CATALOGUE: LazyLock<Vec<Entry>> = LazyLock::new(|| {
    use Target::Reset;
    use {Kind::*, Target::*};
    let mut all = Vec::new();
    let codes = [ENCODER, PRELOAD, COMPRESSION, ARM];
    for ((sensor, model), codes) in SensorId::ALL.into_iter().zip(&SENSORS).zip(codes) {
        let sensor = Sensor(sensor);
        all.push(plain(sensor, Off, SILENT).by(codes));
        all.extend(distorted(sensor, model.faults).map(|row| row.by(codes)));
        all.push(intermittent(sensor).by(codes));
    }
    let both = [plain(Readback, Off, SILENT), intermittent(Readback)];
    all.extend(both.map(|row| row.by(&[105, 128, 129])));
    for (readback, codes) in [(DriveReadback, &[105, 128]), (PretightenerReadback, &[105, 129])] {
        all.extend(distorted(readback, (1.2, (0.1, 2.5, "duty", MORE))).map(|row| row.by(codes)));
    }
    all.extend(actuator(Drive).map(|row| row.by(&[122, 123, 125, 128])));
    all.extend(actuator(Pretightener).map(|row| row.by(&[120, 121, 127, 129])));
    let slip = "friction of tread on wall drops to this part";
    let torn = "a sector of 40 degrees keeps this part of its stiffness";
    let broken = "the spring keeps this part of its rate and force";
    let load = "the top load is so many times as large";
    let deaf = "the model task answers no request";
    let lost = "control ticks are lost for so long, once";
    all.extend([
        one(Wheel, Slip, 0.5, (0.01, 1.0), "x", slip).by(&[126, 133, 136, 218]),
        one(Tread, Torn, 0.3, (0.05, 1.0), "x", torn).by(&[208, 211, 212]),
        one(Spring, Broken, 0.5, (0.05, 1.0), "x", broken).by(&[121, 127]),
        one(Load, Doubled, 2.0, (0.0, 5.0), "x", load).by(&[125]),
        one(Tick, Overrun, 0.005, (0.001, 0.1), "s", lost).by(&[160]),
        Entry { text: deaf, ..hung(Model, "model") }.by(&[141]),
        plain(Log, Gone, "nobody reads the log"),
        plain(Commands, Flooding, "a command in every tick that no moving mode takes"),
        one(Commands, Random, 50.0, (0.0, 1000.0), "1/s", "so many random commands a second"),
        plain(Reset, Recorded, "the controller starts again with its record"),
        one(Reset, Offset, 1.5, (-6.5, 6.5), "mm", "by the supply, its record off by so much"),
        plain(Reset, Gone, "the controller starts again without its record"),
    ]);
    all
});

/// Codes of a converter.
const CODES: (f64, f64) = (0.0, 65_535.0);

const GIVES: &str = "gives this code whatever the voltage";
const FLIPPED: &str = "these bits come turned over";
const SHORTED: &str = "is shorted to ground, and the button cuts the motors' supply";
const HALTED: &str = "halts the core for so long";
const TURNED: &str = "a bit of its bytes in flash is turned over";
const CUT: &str = "power goes in the middle of an operation of the flash";
const PULLED: &str = "the reset pin is pulled in the middle of an operation of the flash";
const CORRECTED: &str = "the double word of a bit has one that is wrong, and corrected";
const REPORTED: &str = "the double word of a bit has two that are wrong";
/// Bits of a set, and more; of the set in the image, from behind its last bit on again.
const IN_SET: (f64, f64) = (0.0, 32_767.0);
/// Bits of the image, and more.
const IN_IMAGE: (f64, f64) = (0.0, 1_048_575.0);

/// A task by its name in the firmware.
const fn hung(target: Target, task: &'static str) -> Entry {
    Entry {
        task: Some(task),
        ..plain(target, Kind::Hung, "is caught in a loop in one of its turns")
    }
}

/// Those of the board itself, in the order of the matrix.
pub const HARDWARE: &[Entry] = {
    use Kind::Reset;
    use {Kind::*, Target::*};
    &[
        one(PreloadSensorConverter, Stuck, 30_000.0, CODES, "of 65535", GIVES).by(PRELOAD),
        one(TreadConverter, Stuck, 30_000.0, CODES, "of 65535", GIVES).by(COMPRESSION),
        one(AngleBus, BitErrors, 1.0, (1.0, 65_535.0), "mask", FLIPPED).by(ARM),
        plain(AngleBus, Off, "the line is broken").by(ARM),
        plain(EncoderLineA, Off, "the line is broken").by(ENCODER),
        plain(EncoderLineB, Off, "the line is broken").by(ENCODER),
        plain(Dma, Stalled, "moves nothing").by(&[102, 103, 105]),
        plain(Timer, Stuck, "its flags cannot be cleared"),
        plain(Interrupt, Flooding, "asks without end"),
        plain(Processor, Hung, "what it executes is caught in a loop"),
        hung(WheelEncoderTask, "wheel_encoder"),
        hung(PreloadSensorTask, "preload_sensor"),
        hung(CompressionSensorTask, "compression_sensor"),
        hung(ArmAngleTask, "arm_angle"),
        hung(TickTask, "motors"),
        hung(ModelTask, "model"),
        hung(JournalTask, "journal"),
        hung(LineTask, "link"),
        plain(Supply, Off, "falls too low for a moment: brown-out"),
        plain(Supply, Gone, "is gone for a moment, without a warning"),
        plain(Supply, Weak, "dips below its threshold for half a millisecond"),
        plain(ResetPin, Reset, "is pulled for a moment"),
        plain(Debugger, Reset, "asks for a reset").by(DEBUGGER),
        plain(HostLine, Flooding, "random bytes in every millisecond"),
        one(StoredSet, BitErrors, 1000.0, IN_SET, "from its first", TURNED),
        one(SpareSet, BitErrors, 1000.0, IN_SET, "from its first", TURNED),
        one(ImageSet, BitErrors, 1000.0, IN_SET, "from its first", TURNED),
        one(Image, BitErrors, 100_000.0, IN_IMAGE, "from its first", TURNED),
        one(ParameterSave, Torn, 100.0, (1.0, 10_000.0), "from its first", CUT),
        one(ParameterSave, Reset, 100.0, (1.0, 10_000.0), "from its first", PULLED),
        plain(AngleBus, Disturbed, "one frame misses a clock edge").by(ARM),
        plain(Magnet, Gone, "has come off").by(ARM),
        plain(StopWire, Off, "is torn").by(STOP),
        plain(StopWire, Shorted, SHORTED).by(STOP),
        one(Debugger, Halted, 50.0, (1.0, 1000.0), "ms", HALTED).by(DEBUGGER),
        one(Image, OneWrongBit, 100_000.0, IN_IMAGE, "from its first", CORRECTED),
        one(Image, TwoWrongBits, 100_000.0, IN_IMAGE, "from its first", REPORTED),
        one(StoredSet, TwoWrongBits, 1000.0, IN_SET, "from its first", REPORTED),
        one(SpareSet, TwoWrongBits, 1000.0, IN_SET, "from its first", REPORTED),
        plain(OptionBytes, Off, "make one bank of the flash"),
    ]
};

/// Steps that differ from the table, in the order of the matrix.
pub const STEPS: &[Entry] = {
    use Kind::{Doubled, Early, Higher, Late, Missing};
    const NEARER: &str = "nearer to the stow end than the table says";
    const FARTHER: &str = "farther out than the table says";
    let (tolerances, heights, runs) = ("times its tolerance", "of its height", "of its run");
    &[
        one(Target::Step, Early, 2.5, (0.0, 25.0), tolerances, NEARER).by(&[201, 124]),
        one(Target::Step, Late, 2.5, (0.0, 25.0), tolerances, FARTHER).by(&[202, 203, 124]),
        plain(Target::Step, Missing, "not there").by(&[202, 203, 132]),
        one(Target::Step, Doubled, 1.1, (1.0, 10.0), runs, "another one behind it").by(&[204]),
        one(Target::Step, Higher, 0.25, (0.0, 1.0), heights, "higher than the table says")
            .by(&[219]),
    ]
};

/// The fault of this kind at this target, if there is one.
pub fn entry(target: Target, kind: Kind) -> Option<&'static Entry> {
    let mut all = CATALOGUE.iter().chain(HARDWARE).chain(STEPS);
    all.find(|entry| entry.target == target && entry.kind == kind)
}

impl Target {
    /// Whether it is hardware of the board, which a run in software lacks.
    pub(crate) fn is_hardware(self) -> bool {
        HARDWARE.iter().any(|entry| entry.target == self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_there_once_and_within_its_range() {
        let all: Vec<&Entry> = CATALOGUE.iter().chain(HARDWARE).chain(STEPS).collect();
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
