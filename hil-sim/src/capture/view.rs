//! The state of a log under way, for whoever watches.

use std::time::Instant;

use crate::log::{Item, Mark, Row, Tally};
use crate::record::{MODE_NAMES, STAGE_NAMES, mode_number};
use crate::sil;

/// Keeps the latest of a log, and its rates.
pub struct View {
    row: Option<Row>,
    rig: String,
    event: String,
    mark: Option<Mark>,
    counted: (Instant, Tally),
    rates: (f64, f64),
}

impl Default for View {
    fn default() -> Self {
        Self {
            row: None,
            rig: "unknown".to_owned(),
            event: String::new(),
            mark: None,
            counted: (Instant::now(), Tally::default()),
            rates: (0.0, 0.0),
        }
    }
}

impl View {
    /// Takes an item in.
    pub fn see(&mut self, item: &Item) {
        match item {
            Item::Tick(record, sensors) => self.row = Some(Row::of(record, sensors)),
            Item::Identity(identity) => self.rig = identity.rig.as_str().to_owned(),
            Item::Event(entry) => self.event = sil::text(&entry.event),
            Item::Mark(mark) => self.mark = Some(*mark),
            Item::Plan(..) | Item::Request(..) | Item::CaptureChunk(_) | Item::Ledger(_) => {}
        }
    }

    /// Works the rates out, at most once in half a second; whether it was time.
    pub fn count(&mut self, tally: &Tally) -> bool {
        let (since, before) = &self.counted;
        let passed = since.elapsed().as_secs_f64();
        if passed < 0.5 {
            return false;
        }
        let rate = |now: u64, before: u64| (now - before) as f64 / passed;
        self.rates = (rate(tally.ticks, before.ticks), rate(tally.bytes, before.bytes));
        self.counted = (Instant::now(), *tally);
        true
    }

    /// The latest tick.
    #[must_use]
    pub const fn row(&self) -> Option<&Row> {
        self.row.as_ref()
    }

    /// Rig, rates and losses as one line.
    #[must_use]
    pub fn rates_text(&self, tally: &Tally) -> String {
        format!(
            "rig {}  {} ticks  {:.0} ticks/s  {:.1} kB/s  lost {} frames, {} ticks  starts anew {}",
            self.rig,
            tally.ticks,
            self.rates.0,
            self.rates.1 * 1e-3,
            tally.lost_frames,
            tally.lost_ticks,
            tally.restarts,
        )
    }

    /// The state as a few lines.
    #[must_use]
    pub fn text(&self, tally: &Tally) -> String {
        let mut text = self.rates_text(tally);
        if let Some(row) = &self.row {
            let mode = row.telemetry().map_or("?", |seen| mode_name(seen.mode));
            let stage = STAGE_NAMES.get(usize::from(row.stage).wrapping_sub(1)).unwrap_or(&"?");
            text += &format!(
                "\n  {:9.3} s  {mode:10}  {stage:16} level {}\n  position {:8.3} mm   speed {:7.3} of {:7.3} mm/s   preload {:6.2} of {:6.2} N\n  tread {:6.3} mm   radius {:8.3} mm   gap predicted {:6.3} mm   slip margin {:5.2}",
                row.t_s,
                row.level,
                row.position_mm,
                row.speed_mm_s,
                row.speed_ref_mm_s,
                row.preload_n,
                row.preload_ref_n,
                row.compression_mm,
                row.radius_mm,
                row.gap_predicted_mm,
                row.slip_margin,
            );
        }
        if !self.event.is_empty() {
            text += &format!("\n  {}", self.event);
        }
        if let Some(mark) = &self.mark {
            text += &format!("\n  {mark}");
        }
        text
    }
}

/// Name of a mode, short.
pub(crate) fn mode_name(mode: interstage::supervise::Mode) -> &'static str {
    MODE_NAMES.get(usize::from(mode_number(mode))).copied().unwrap_or("?")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Decoder;
    use crate::scenario::Scenario;

    #[test]
    fn the_state_shows_what_came_last() {
        let options = sil::Options { rows: true, ..sil::Options::default() };
        let stream = sil::run(&Scenario::default(), options).unwrap().stream;
        let (mut view, mut decoder) = (View::default(), Decoder::new());
        decoder.read(&stream, &mut |item| view.see(&item));
        let text = view.text(decoder.tally());
        for part in ["rig prototype", "complete", "level 3", "lost 0 frames", "position"] {
            assert!(text.contains(part), "{part} in {text}");
        }
        assert!(!view.count(decoder.tally()), "too early for a rate");
    }
}
