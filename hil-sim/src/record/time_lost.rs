//! Where the time of a run goes.

use serde::{Deserialize, Serialize};

use super::row::{CROSSES, MOVES, PRELOADS};
use crate::table::number;

/// What a run takes longer than its travel at cruise speed, s. With that travel the parts add up
/// to the duration, but for rests between motions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TimeLost {
    /// Nothing lost: the travel, at cruise speed.
    #[serde(default)]
    pub cruise_s: f64,
    /// At rest, until the preload carries the wheel.
    pub preload_s: f64,
    /// Before the steps: acceleration at the start, waiting for the preload, the window in which
    /// the step may come.
    pub approach_s: f64,
    /// From the touch until the wheel rolls on the next wall.
    pub crossing_s: f64,
    /// Behind the last step: braking for the end of travel.
    pub end_s: f64,
}

impl TimeLost {
    /// The parts beside the travel, with what each is.
    fn parts(&self) -> [(f64, &'static str); 4] {
        [
            (self.preload_s, "until the preload carries the wheel"),
            (self.approach_s, "before the steps"),
            (self.crossing_s, "on the steps, from the touch until the next wall carries"),
            (self.end_s, "behind the last step"),
        ]
    }

    /// The largest part beside the travel, in words.
    pub(crate) fn main(&self) -> String {
        let most = self.parts().into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        most.map_or_else(String::new, |(s, what)| format!("{s:.2} s {what}"))
    }

    /// Each part to a millisecond, and their sum. The travel takes the rounding, so that the printed
    /// parts add up.
    pub(crate) fn sentence(&self) -> String {
        let round = |s: f64| (s * 1e3).round() / 1e3;
        let parts = self.parts().map(|part| round(part.0));
        let sum_s = round(self.cruise_s + self.parts().iter().map(|part| part.0).sum::<f64>());
        let cruise = number(sum_s - parts.iter().sum::<f64>(), 3);
        let [preload, approach, crossing, end] = parts.map(|s| number(s, 3));
        let [first, before, corner, last] = self.parts().map(|part| part.1);
        format!(
            "{} s = {cruise} s for the travel at cruise speed + {preload} s {first} + lost by going \
             slower: {approach} s {before} + {crossing} s {corner} + {end} s {last}",
            number(sum_s, 3)
        )
    }
}

/// Time and travel of a part of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Part {
    time_s: f64,
    travel_mm: f64,
}

impl Part {
    fn add(&mut self, other: Self) {
        self.time_s += other.time_s;
        self.travel_mm += other.travel_mm;
    }

    fn lost_s(self, cruise_mm_s: f64) -> f64 {
        self.time_s - self.travel_mm / cruise_mm_s
    }
}

/// The parts of a run as it goes on.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TimeSplit {
    preload: Part,
    approach: Part,
    crossing: Part,
    /// Between the steps: before a step it becomes part of the approach.
    open: Part,
    last: Option<(f64, u8, f64)>,
    moved: bool,
}

impl TimeSplit {
    /// Takes the tick at `t_s`, in the mode of this number at that position.
    pub(super) fn add(&mut self, t_s: f64, mode: u8, position_mm: f64) {
        let (from_s, before, from_mm) =
            self.last.replace((t_s, mode, position_mm)).unwrap_or((t_s, mode, position_mm));
        let part = Part { time_s: t_s - from_s, travel_mm: (position_mm - from_mm).abs() };
        match before {
            PRELOADS if !self.moved => self.preload.add(part),
            _ if !self.moved => self.preload = Part::default(),
            // The motion ends with the last tick in which it moves.
            _ if !(MOVES.contains(&before) && MOVES.contains(&mode)) => {}
            _ if CROSSES.contains(&before) => {
                self.approach.add(std::mem::take(&mut self.open));
                self.crossing.add(part);
            }
            _ => self.open.add(part),
        }
        self.moved |= MOVES.contains(&mode);
    }

    /// What the parts take longer than their travel at this speed, mm/s.
    pub(super) fn lost(&self, cruise_mm_s: f64) -> TimeLost {
        let parts = [self.preload, self.approach, self.crossing, self.open];
        TimeLost {
            cruise_s: parts.iter().map(|part| part.travel_mm).sum::<f64>() / cruise_mm_s,
            preload_s: self.preload.lost_s(cruise_mm_s),
            approach_s: self.approach.lost_s(cruise_mm_s),
            crossing_s: self.crossing.lost_s(cruise_mm_s),
            end_s: self.open.lost_s(cruise_mm_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_part_loses_what_it_takes_longer_than_at_cruise_speed() {
        // Mode, ticks of 1 s, mm in each: two steps, and a build-up that was given up before.
        let run = [
            (PRELOADS, 9, 0.0),
            (3, 2, 0.0),
            (PRELOADS, 3, 0.0),
            (5, 2, 10.0),
            (6, 2, 5.0),
            (7, 4, 2.0),
            (8, 1, 10.0),
            (5, 1, 10.0),
            (6, 1, 5.0),
            (7, 1, 5.0),
            (5, 3, 2.5),
            (10, 7, 0.0),
        ];
        let (mut split, mut t_s, mut position_mm) = (TimeSplit::default(), 0.0, 80.0);
        for (mode, ticks, mm) in run {
            for _ in 0..ticks {
                split.add(t_s, mode, position_mm);
                (t_s, position_mm) = (t_s + 1.0, position_mm - mm);
            }
        }
        let lost = split.lost(10.0);
        assert!(lost.sentence().starts_with("17.000 s = 7.300 s for the travel"), "{lost:?}");
        assert!(lost.main().starts_with("3.70 s on the steps, from the touch"));
        let run = crate::report::example::deploy().summary;
        let (lost_by_run, duration_s) = (run.lost.unwrap(), run.duration_s.unwrap());
        assert!(lost_by_run.sentence().starts_with(&format!("{duration_s:.3} s = ")));
        let parts = lost.parts().map(|part| part.0);
        for (got, wanted) in parts.into_iter().chain([lost.cruise_s]).zip([3.0, 1.5, 3.7, 1.5, 7.3])
        {
            assert!((got - wanted).abs() < 1e-9, "{lost:?}");
        }
    }
}
