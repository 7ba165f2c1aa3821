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
    use crate::estimate::PositionConfidence::{Guess, Sure, Unsure};
    use crate::fault::Fault;
    use crate::supervise::Leg;
    use crate::units::{Direction, Q16};

    #[test]
    fn the_last_fault_is_kept_beyond_its_hold() {
        let mut recorder = SnapshotRecorder::default();
        let zeros = Zeros { preload: Q16::from_num(3), compression: Q16::ZERO };
        let mut row =
            Telemetry { at: 5, level: 2, position: Q16::from_num(41), ..Telemetry::default() };
        let mut snapshot =
            |row: &_, confidence| recorder.snapshot(row, confidence, MissedCheckIns::TICK, zeros);
        assert_eq!(snapshot(&row, Sure).mode(), Some(Mode::Boot));
        row.mode = Mode::Run(Direction::Deploy, Leg::Crossing);
        let crossing = snapshot(&row, Sure);
        assert_eq!((crossing.mode(), crossing.fault), (Some(row.mode), 0));
        assert_eq!((crossing.tick, crossing.level, crossing.position), (5, 2, row.position));
        assert_eq!(crossing.missed, MissedCheckIns::TICK);
        assert!(crossing.packed_speed.placed());
        assert_eq!(crossing.packed_zeros.zeros(), zeros);
        let unsure = DriveSnapshot { level: DriveSnapshot::UNSURE | 2, ..crossing };
        assert_eq!(snapshot(&row, Unsure), unsure);
        row.mode = Mode::FaultHold(Fault::DriveStalled);
        assert_eq!(snapshot(&row, Guess).mode(), Some(row.mode));
        row.mode = Mode::Idle;
        let idle = snapshot(&row, Guess);
        assert!(!idle.packed_speed.placed());
        assert_eq!((idle.mode(), idle.fault), (Some(Mode::Idle), 122));
    }
}
