//! Everything that can be broken, with its usual measure.

use super::{Kind, Target};

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

pub(super) const fn one(
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
pub(super) const fn plain(target: Target, kind: Kind, text: &'static str) -> Entry {
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

/// All of them, in the order of the matrix.
pub const CATALOGUE: &[Entry] = {
    use Kind::{
        Broken, Doubled, Flooding, Garbage, Gone, Hung, Off, Offset, Overrun, Random, Reversed,
        Slip, Stalled, Stuck, Torn,
    };
    use Target::{
        Angle, Commands, Drive, DriveReadback, Encoder, Load, LoadCell, Log, Model, Pretightener,
        PretightenerReadback, Readback, Spring, Tick, Tread, TreadSensor, Wheel,
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
        plain(LoadCell, Off, SILENT),
        plain(LoadCell, Stuck, FROZEN),
        plain(LoadCell, Garbage, RANDOM),
        gain(LoadCell, 1.2),
        one(LoadCell, Offset, 6.0, (-200.0, 200.0), "N", "reads so much more than is true"),
        slow(LoadCell, 0.1),
        delayed(LoadCell, 0.05, "follows this much later"),
        intermittent(LoadCell),
        plain(TreadSensor, Off, SILENT),
        plain(TreadSensor, Stuck, FROZEN),
        plain(TreadSensor, Garbage, RANDOM),
        gain(TreadSensor, 1.2),
        one(TreadSensor, Offset, 0.3, (-5.0, 5.0), "mm", "reads so much more than is true"),
        slow(TreadSensor, 0.1),
        delayed(TreadSensor, 0.05, "follows this much later"),
        intermittent(TreadSensor),
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
    ]
};

/// The fault of this kind at this target, if there is one.
#[must_use]
pub fn entry(target: Target, kind: Kind) -> Option<&'static Entry> {
    let mut all = CATALOGUE.iter().chain(super::HARDWARE);
    all.find(|entry| entry.target == target && entry.kind == kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_there_once_and_within_its_range() {
        for entry in CATALOGUE {
            let alike = |e: &&Entry| (e.target, e.kind) == (entry.target, entry.kind);
            assert_eq!(CATALOGUE.iter().filter(alike).count(), 1, "{entry:?}");
            let (low, high) = entry.range;
            assert!(low <= entry.magnitude && entry.magnitude <= high, "{entry:?}");
            assert_eq!(low == high, entry.unit.is_empty(), "{entry:?}");
        }
    }
}
