//! Shows the state of a growing log as a few lines of text.

use std::time::Instant;

use interstage::log::Record;
use interstage::sense::raw::SensorFrame;

use super::{Columns, Counts, Item, Mark, mode_words, stage_name, text};
use crate::table::{counted, number};

/// Ticks without an answer after which nothing is shown of a sensor.
const SILENT: u32 = 50;

/// The columns of a tick as a view shows them: unknown is what a silent sensor gave last, and a
/// gap that no plan predicts.
pub(crate) fn shown(record: &Record, sensors: &SensorFrame) -> Columns {
    let mut row = Columns::of(record, sensors);
    let now = row.tick;
    for (at, value) in [
        (row.wheel_encoder_at, &mut row.position_mm),
        (row.wheel_encoder_at, &mut row.wheel_speed_mm_s),
        (row.wheel_encoder_at.min(row.preload_at), &mut row.slip_margin),
        (row.preload_at, &mut row.preload_n),
        (row.compression_at, &mut row.compression_mm),
        (row.arm_angle_at, &mut row.radius_mm),
    ] {
        if at.is_none_or(|at| now.saturating_sub(at) > SILENT) {
            *value = f64::NAN;
        }
    }
    if row.gap_predicted_mm == 0.0 {
        row.gap_predicted_mm = f64::NAN;
    }
    row
}

/// The latest items of a log, and its rates.
#[derive(Default)]
pub(crate) struct View {
    row: Option<Columns>,
    rig: Option<String>,
    event: String,
    mark: Option<Mark>,
    counted: Option<(Instant, Counts)>,
    /// Ticks and bytes a second.
    rates: (f64, f64),
}

impl View {
    pub(crate) fn see(&mut self, item: &Item) {
        match item {
            Item::Tick(record, sensors) => self.row = Some(shown(record, sensors)),
            Item::Identity(identity) => self.rig = Some(identity.rig.as_str().to_owned()),
            Item::Event(entry) => self.event = text(&entry.event),
            Item::Mark(mark) => self.mark = Some(*mark),
            Item::Plan(..) | Item::Request(..) | Item::Ledger(_) | Item::Frame(_) => {}
        }
    }

    /// Computes the rates at most once in half a second; returns whether it did.
    pub(crate) fn count(&mut self, counts: &Counts) -> bool {
        let (since, before) =
            self.counted.get_or_insert_with(|| (Instant::now(), Counts::default()));
        let passed = since.elapsed().as_secs_f64();
        if passed < 0.5 {
            return false;
        }
        let rate = |now: u64, before: u64| (now - before) as f64 / passed;
        self.rates = (rate(counts.ticks, before.ticks), rate(counts.bytes, before.bytes));
        self.counted = Some((Instant::now(), *counts));
        true
    }

    pub(crate) const fn row(&self) -> Option<&Columns> {
        self.row.as_ref()
    }

    /// Rig, rates and losses as one line.
    pub(crate) fn rates_text(&self, counts: &Counts) -> String {
        let (ticks, bytes) = self.rates;
        format!(
            "rig {}  {}, {ticks:.0}/s, {:.0} kB/s  lost {}, {}  restarts {}",
            self.rig.as_deref().unwrap_or("unknown"),
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
            format!(
                " {:9.2} s  {mode:25}  contact: {stage:15}  level {}\n \
                 position {:>6} mm   speed {:>5} of {:>5} mm/s   preload {:>5} of {:>5} N\n \
                 compression {:>4} mm  radius {:>5} mm  gap predicted {:>4} mm  slip margin {:>5}",
                row.t_s,
                row.level,
                number(row.position_mm, 2),
                number(row.wheel_speed_mm_s, 2),
                number(row.speed_ref_mm_s, 2),
                number(row.preload_n, 1),
                number(row.preload_ref_n, 1),
                number(row.compression_mm, 2),
                number(row.radius_mm, 1),
                number(row.gap_predicted_mm, 2),
                number(row.slip_margin, 2)
            )
        })
    }

    /// The state as a few lines.
    pub(crate) fn text(&self, counts: &Counts) -> String {
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
    use crate::record::decoder::tests::deployment;

    #[test]
    fn the_state_shows_what_came_last() {
        let stream = deployment().stream;
        let (mut view, mut decoder) = (View::default(), Decoder::new());
        let mut first = None;
        decoder.read(&stream, &mut |item| {
            view.see(&item);
            first = first.take().or_else(|| view.row().map(|_| view.state_text()));
        });
        assert!(first.is_some_and(|text| text.contains("gap predicted    - mm")));
        let text = view.text(decoder.counts());
        for part in ["rig prototype", "deployed", "level 3", "lost 0 frames", "position"] {
            assert!(text.contains(part), "{part} in {text}");
        }
        assert!(!view.count(decoder.counts()), "too early for a rate");
        let mut now = *view.row().unwrap();
        now.wheel_encoder_at = Some(now.tick - SILENT - 1);
        let record = Record { telemetry: now.telemetry().unwrap(), ..Record::default() };
        let row = shown(&record, &now.sensors());
        assert!(row.wheel_speed_mm_s.is_nan() && row.position_mm.is_nan() && row.preload_n > 0.0);
    }
}
