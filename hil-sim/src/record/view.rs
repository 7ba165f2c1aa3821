//! Shows the state of a growing log as a few lines of text.

use std::time::Instant;

use super::{Controller, Counts, Item, Mark, mode_words, stage_name, text};
use crate::table::{counted, number};

/// The latest items of a log, and its rates.
pub struct View {
    row: Option<Controller>,
    rig: String,
    event: String,
    mark: Option<Mark>,
    counted: (Instant, Counts),
    /// Ticks and bytes a second.
    rates: (f64, f64),
}

impl Default for View {
    fn default() -> Self {
        Self {
            row: None,
            rig: "unknown".to_owned(),
            event: String::new(),
            mark: None,
            counted: (Instant::now(), Counts::default()),
            rates: (0.0, 0.0),
        }
    }
}

impl View {
    pub fn see(&mut self, item: &Item) {
        match item {
            Item::Tick(record, sensors) => self.row = Some(Controller::of(record, sensors)),
            Item::Identity(identity) => self.rig = identity.rig.as_str().to_owned(),
            Item::Event(entry) => self.event = text(&entry.event),
            Item::Mark(mark) => self.mark = Some(*mark),
            Item::Plan(..) | Item::Request(..) | Item::CaptureChunk(_) | Item::Ledger(_) => {}
        }
    }

    /// Computes the rates at most once in half a second; returns whether it did.
    pub fn count(&mut self, counts: &Counts) -> bool {
        let (since, before) = &self.counted;
        let passed = since.elapsed().as_secs_f64();
        if passed < 0.5 {
            return false;
        }
        let rate = |now: u64, before: u64| (now - before) as f64 / passed;
        self.rates = (rate(counts.ticks, before.ticks), rate(counts.bytes, before.bytes));
        self.counted = (Instant::now(), *counts);
        true
    }

    /// The latest tick.
    pub const fn row(&self) -> Option<&Controller> {
        self.row.as_ref()
    }

    /// Rig, rates and losses as one line.
    pub(crate) fn rates_text(&self, counts: &Counts) -> String {
        let (ticks, bytes) = self.rates;
        format!(
            "rig {}  {}, {ticks:.0}/s, {:.0} kB/s  lost {}, {}  restarts {}",
            self.rig,
            counted(counts.ticks, "tick"),
            bytes * 1e-3,
            counted(counts.lost_frames, "frame"),
            counted(counts.lost_ticks, "tick"),
            counts.restarts,
        )
    }

    /// Time, mode, contact and the quantities of the latest tick, in lines of at most 80 letters;
    /// empty before the first.
    pub(crate) fn state_text(&self) -> String {
        self.row.map_or_else(String::new, |row| {
            let mode = row.mode().map_or_else(|| "unknown mode".to_owned(), mode_words);
            let stage = stage_name(row.stage);
            let state = format!(
                " {:9.2} s  {mode:25}  contact: {stage:15}  level {}\n",
                row.t_s, row.level
            );
            let motion = format!(
                " position {:>6} mm   speed {:>5} of {:>5} mm/s   preload {:>5} of {:>5} N\n",
                number(row.position_mm, 2),
                number(row.wheel_speed_mm_s, 2),
                number(row.speed_ref_mm_s, 2),
                number(row.preload_n, 1),
                number(row.preload_ref_n, 1)
            );
            let contact = format!(
                " compression {:>4} mm  radius {:>5} mm  gap predicted {:>4} mm  slip margin {:>5}",
                number(row.compression_mm, 2),
                number(row.radius_mm, 1),
                number(row.gap_predicted_mm, 2),
                number(row.slip_margin, 2)
            );
            state + &motion + &contact
        })
    }

    /// The state as a few lines.
    pub fn text(&self, counts: &Counts) -> String {
        let mut lines = vec![self.rates_text(counts)];
        lines.extend(self.row.map(|_| self.state_text()));
        lines.extend((!self.event.is_empty()).then(|| format!("  {}", self.event)));
        lines.extend(self.mark.map(|mark| format!("  {mark}")));
        lines.join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Decoder;
    use crate::scenario::Scenario;
    use crate::session;

    #[test]
    fn the_state_shows_what_came_last() {
        let stream = session::run(&Scenario::default(), session::Options::ROWS).unwrap().stream;
        let (mut view, mut decoder) = (View::default(), Decoder::new());
        decoder.read(&stream, &mut |item| view.see(&item));
        let text = view.text(decoder.counts());
        for part in ["rig prototype", "deployed", "level 3", "lost 0 frames", "position"] {
            assert!(text.contains(part), "{part} in {text}");
        }
        assert!(!view.count(decoder.counts()), "too early for a rate");
    }
}
