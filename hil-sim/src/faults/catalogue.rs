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

/// All of them, in the order of the matrix.
pub const CATALOGUE: &[Entry] = {
    use Kind::{
        Broken, Delayed, Doubled, Flooding, Gain, Garbage, Gone, Hung, Intermittent, Off, Offset,
        Overrun, Random, Reversed, Runaway, Slip, Slow, Stalled, Stuck, Torn, Weak,
    };
    use Target::{
        Angle, Commands, Drive, Encoder, Load, LoadCell, Log, Model, Pretightener, Spring, Tick,
        Tread, TreadSensor, Wheel,
    };
    &[
        one(Encoder, Off, 0.0, (0.0, 0.0), "", "no new reading comes"),
        one(Encoder, Stuck, 0.0, (0.0, 0.0), "", "the code stands still, fresh in time"),
        one(Encoder, Garbage, 0.0, (0.0, 0.0), "", "random codes"),
        one(
            Encoder,
            Gain,
            1.5,
            (0.0, 10.0),
            "x",
            "reads so many times what is true, from its zero",
        ),
        one(Encoder, Offset, 2.0, (-100.0, 100.0), "mm", "jumps by so much once"),
        one(Encoder, Slow, 0.1, (0.001, 10.0), "s", "follows with this time constant"),
        one(Encoder, Delayed, 0.05, (0.001, 2.0), "s", "follows this much later"),
        one(
            Encoder,
            Intermittent,
            0.5,
            (0.0, 1.0),
            "of 100 ms",
            "gives nothing for this part of every 100 ms",
        ),
        one(LoadCell, Off, 0.0, (0.0, 0.0), "", "no new reading comes"),
        one(LoadCell, Stuck, 0.0, (0.0, 0.0), "", "the code stands still, fresh in time"),
        one(LoadCell, Garbage, 0.0, (0.0, 0.0), "", "random codes"),
        one(
            LoadCell,
            Gain,
            1.2,
            (0.0, 10.0),
            "x",
            "reads so many times what is true, from its zero",
        ),
        one(LoadCell, Offset, 6.0, (-200.0, 200.0), "N", "reads so much more than is true"),
        one(LoadCell, Slow, 0.1, (0.001, 10.0), "s", "follows with this time constant"),
        one(LoadCell, Delayed, 0.05, (0.001, 2.0), "s", "follows this much later"),
        one(
            LoadCell,
            Intermittent,
            0.5,
            (0.0, 1.0),
            "of 100 ms",
            "gives nothing for this part of every 100 ms",
        ),
        one(TreadSensor, Off, 0.0, (0.0, 0.0), "", "no new reading comes"),
        one(TreadSensor, Stuck, 0.0, (0.0, 0.0), "", "the code stands still, fresh in time"),
        one(TreadSensor, Garbage, 0.0, (0.0, 0.0), "", "random codes"),
        one(
            TreadSensor,
            Gain,
            1.2,
            (0.0, 10.0),
            "x",
            "reads so many times what is true, from its zero",
        ),
        one(TreadSensor, Offset, 0.3, (-5.0, 5.0), "mm", "reads so much more than is true"),
        one(TreadSensor, Slow, 0.1, (0.001, 10.0), "s", "follows with this time constant"),
        one(TreadSensor, Delayed, 0.05, (0.001, 2.0), "s", "follows this much later"),
        one(
            TreadSensor,
            Intermittent,
            0.5,
            (0.0, 1.0),
            "of 100 ms",
            "gives nothing for this part of every 100 ms",
        ),
        one(Angle, Off, 0.0, (0.0, 0.0), "", "no new reading comes"),
        one(Angle, Stuck, 0.0, (0.0, 0.0), "", "the code stands still, fresh in time"),
        one(Angle, Garbage, 0.0, (0.0, 0.0), "", "random codes"),
        one(Angle, Gain, 1.2, (0.0, 10.0), "x", "reads so many times what is true, from its zero"),
        one(Angle, Offset, 1.0, (-90.0, 90.0), "deg", "reads so much more than is true"),
        one(Angle, Slow, 0.1, (0.001, 10.0), "s", "follows with this time constant"),
        one(Angle, Delayed, 0.05, (0.001, 2.0), "s", "follows this much later"),
        one(
            Angle,
            Intermittent,
            0.5,
            (0.0, 1.0),
            "of 100 ms",
            "gives nothing for this part of every 100 ms",
        ),
        one(Drive, Stalled, 0.0, (0.0, 0.0), "", "gives no force"),
        one(Drive, Stuck, 0.0, (0.0, 0.0), "", "keeps its last duty"),
        one(Drive, Weak, 0.4, (0.0, 1.0), "x", "gives this part of its duty"),
        one(Drive, Reversed, 0.0, (0.0, 0.0), "", "turns the other way"),
        one(Drive, Delayed, 0.1, (0.001, 2.0), "s", "acts this much later"),
        one(
            Drive,
            Runaway,
            1.0,
            (-1.0, 1.0),
            "duty",
            "takes this duty whatever is asked while its bridge is on",
        ),
        one(Pretightener, Stalled, 0.0, (0.0, 0.0), "", "gives no force"),
        one(Pretightener, Stuck, 0.0, (0.0, 0.0), "", "keeps its last duty"),
        one(Pretightener, Weak, 0.4, (0.0, 1.0), "x", "gives this part of its duty"),
        one(Pretightener, Reversed, 0.0, (0.0, 0.0), "", "turns the other way"),
        one(Pretightener, Delayed, 0.1, (0.001, 2.0), "s", "acts this much later"),
        one(
            Pretightener,
            Runaway,
            1.0,
            (-1.0, 1.0),
            "duty",
            "takes this duty whatever is asked while its bridge is on",
        ),
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
        one(Model, Hung, 0.0, (0.0, 0.0), "", "the model task answers no request"),
        one(Log, Gone, 0.0, (0.0, 0.0), "", "nobody reads the log"),
        one(
            Commands,
            Flooding,
            0.0,
            (0.0, 0.0),
            "",
            "a command in every tick that no moving mode takes",
        ),
        one(Commands, Random, 50.0, (0.0, 1000.0), "1/s", "so many random commands a second"),
    ]
};

/// The fault of this kind at this target, if there is one.
#[must_use]
pub fn entry(target: Target, kind: Kind) -> Option<&'static Entry> {
    CATALOGUE.iter().find(|entry| entry.target == target && entry.kind == kind)
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
