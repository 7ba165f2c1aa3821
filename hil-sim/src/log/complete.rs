//! What the controller believes, put beside what the plant knows.

use super::row::Row;
use super::run::Run;
use crate::record::{self, Recording};

/// Completes the rows of a recording, a millisecond each from boot, by those of the
/// controller's log. A row whose tick is not in the log keeps what it has.
pub fn complete(recording: &mut Recording, run: &Run) {
    for row in &run.rows {
        if let Some(place) = recording.rows.get_mut(row.tick as usize) {
            believe(place, row);
        }
    }
}

pub(super) fn believe(place: &mut record::Row, row: &Row) {
    place.mode = row.telemetry().map_or(place.mode, |seen| record::mode_number(seen.mode));
    place.stage = row.stage;
    place.level = row.level;
    place.position_est_mm = row.position_mm;
    place.speed_est_mm_s = row.speed_mm_s;
    place.speed_ref_mm_s = row.speed_ref_mm_s;
    place.preload_meas_n = row.preload_n;
    place.preload_ref_n = row.preload_ref_n;
    place.radius_est_mm = row.radius_mm;
    place.compression_meas_mm = row.compression_mm;
    place.gap_predicted_mm = row.gap_predicted_mm;
    place.slip_margin_est = row.slip_margin;
    place.drive_duty = row.drive_duty;
    place.preload_duty = row.preload_duty;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;
    use crate::sil;

    #[test]
    fn a_run_in_software_is_completed_by_its_own_log() {
        let options = sil::Options { rows: true, ..sil::Options::default() };
        let whole = sil::run(&Scenario::default(), options).unwrap();
        let run = Run::of_stream(&whole.stream);
        assert!(run.is_whole(), "{:?}", run.marks);
        assert_eq!(run.rows.len(), whole.rows.len());
        let mut bare = whole.clone();
        for row in &mut bare.rows {
            row.position_est_mm = f64::NAN;
            row.preload_meas_n = f64::NAN;
            row.mode = 12;
        }
        complete(&mut bare, &run);
        let text = |recording: &Recording| format!("{:?}", recording.rows);
        assert_eq!(text(&bare), text(&whole));
        // Every quantity of every tick in less than this.
        let mean = whole.stream.len() as f64 / run.rows.len() as f64;
        assert!(mean < 50.0, "{mean} bytes a tick");
    }
}
