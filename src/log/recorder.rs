//! From a tick's telemetry to the snapshot that a restart finds.

use crate::estimate::PositionConfidence;
use crate::restart::{DriveSnapshot, MissedCheckIns, PackedSpeed, PackedZeros};
use crate::sense::Zeros;
use crate::supervise::{Mode, codes};
use crate::tick::Telemetry;

/// Makes a [`DriveSnapshot`] of each tick; keeps the last fault beyond its hold.
#[derive(Clone, Copy, Debug, Default)]
pub struct SnapshotRecorder {
    fault: u16,
}

impl SnapshotRecorder {
    /// The snapshot of a tick whose position had this confidence, and its sensors these zeros.
    pub fn snapshot(
        &mut self,
        row: &Telemetry,
        confidence: PositionConfidence,
        missed: MissedCheckIns,
        zeros: Zeros,
    ) -> DriveSnapshot {
        if let Mode::FaultHold(fault) = row.mode {
            self.fault = fault.code();
        }
        let unsure = confidence == PositionConfidence::Unsure;
        DriveSnapshot {
            tick: row.at,
            position: row.position,
            mode: codes::of_mode(row.mode),
            level: row.level | if unsure { DriveSnapshot::UNSURE } else { 0 },
            fault: self.fault,
            missed,
            packed_speed: PackedSpeed::of(row.speed_ref, confidence != PositionConfidence::Guess),
            packed_zeros: PackedZeros::of(zeros),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;
    use crate::supervise::Leg;
    use crate::units::Direction;
    use crate::units::Q16;

    #[test]
    fn the_last_fault_is_kept_beyond_its_hold() {
        let mut recorder = SnapshotRecorder::default();
        let zeros = Zeros { preload: Q16::from_num(3), compression: Q16::ZERO };
        let mut row =
            Telemetry { at: 5, level: 2, position: Q16::from_num(41), ..Telemetry::default() };
        assert_eq!(
            recorder.snapshot(&row, PositionConfidence::Sure, MissedCheckIns::NOBODY, zeros).mode(),
            Some(Mode::Boot)
        );
        row.mode = Mode::Run(Direction::Deploy, Leg::Crossing);
        let snapshot =
            recorder.snapshot(&row, PositionConfidence::Sure, MissedCheckIns::TICK, zeros);
        assert_eq!((snapshot.mode(), snapshot.fault), (Some(row.mode), 0));
        assert_eq!((snapshot.tick, snapshot.level, snapshot.position), (5, 2, row.position));
        assert_eq!(snapshot.missed, MissedCheckIns::TICK);
        assert!(snapshot.packed_speed.placed());
        assert_eq!(snapshot.packed_zeros.zeros(), zeros);
        let unsure =
            recorder.snapshot(&row, PositionConfidence::Unsure, MissedCheckIns::TICK, zeros);
        assert_eq!(unsure, DriveSnapshot { level: DriveSnapshot::UNSURE | 2, ..snapshot });
        row.mode = Mode::FaultHold(Fault::DriveStalled);
        assert_eq!(
            recorder
                .snapshot(&row, PositionConfidence::Guess, MissedCheckIns::NOBODY, zeros)
                .mode(),
            Some(row.mode)
        );
        row.mode = Mode::Idle;
        let snapshot =
            recorder.snapshot(&row, PositionConfidence::Guess, MissedCheckIns::NOBODY, zeros);
        assert!(!snapshot.packed_speed.placed());
        assert_eq!((snapshot.mode(), snapshot.fault), (Some(Mode::Idle), 122));
    }
}
