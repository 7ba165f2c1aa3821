//! Ledger of the crossings: the controller's record of each, and what only the ticks around it
//! show. The journal keeps it from the records that it encodes, at no cost to the tick.

use serde::{Deserialize, Serialize};

use super::record::Record;
use crate::estimate::ContactStage;
use crate::supervise::Mode;
use crate::tick::CrossingRecord;
use crate::units::{Millimetres, MillimetresPerSecond, Q16, Ratio, Tick, q16};

/// Weight of the newest crossing in the trend.
const NEWEST: Ratio = q16(250_000);

/// A line of the ledger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// When the controller closed it.
    pub at: Tick,
    /// Crossings since boot, this one included.
    pub count: u16,
    /// The controller's record.
    pub crossing: CrossingRecord,
    /// Largest shortfall of the speed below its reference on the corner, mm/s.
    pub speed_dip: MillimetresPerSecond,
    /// Travel of the wheel beyond the distance from the last step found, mm: creep, slip, and
    /// the tolerances of both steps.
    pub slip: Millimetres,
    /// Measured minus predicted gap, mm.
    pub gap_residual: Millimetres,
    /// Change of the stiffness scale per crossing, the newest weighing a quarter: shows wear
    /// and ageing of the tread.
    pub trend: Ratio,
}

/// State of the ledger between its lines.
#[derive(Clone, Copy, Debug)]
pub struct Ledger {
    count: u16,
    /// Dip of the latest corner.
    dip: MillimetresPerSecond,
    on_corner: bool,
    scale: Option<Ratio>,
    trend: Ratio,
}

impl Ledger {
    /// A ledger without lines.
    pub const EMPTY: Self =
        Self { count: 0, dip: Q16::ZERO, on_corner: false, scale: None, trend: Q16::ZERO };

    /// Takes one tick into account.
    pub fn look(&mut self, record: &Record) {
        let seen = &record.telemetry;
        let touched = matches!(
            seen.stage,
            ContactStage::StaticFriction | ContactStage::Sliding | ContactStage::Rolling
        );
        let on_corner = touched && matches!(seen.mode, Mode::Run(..));
        if on_corner {
            if !self.on_corner {
                self.dip = Q16::ZERO;
            }
            self.dip = self.dip.max(seen.speed_ref.abs() - seen.speed.abs());
        }
        self.on_corner = on_corner;
    }

    /// Closes the line of a crossing.
    pub fn close(&mut self, at: Tick, crossing: &CrossingRecord) -> Line {
        self.count = self.count.saturating_add(1);
        let (scale, residual) = (crossing.stiffness_scale, crossing.residual);
        if let Some(before) = self.scale.replace(scale) {
            self.trend += NEWEST * (scale - before - self.trend);
        }
        Line {
            at,
            count: self.count,
            crossing: *crossing,
            speed_dip: self.dip,
            slip: if crossing.direction.sign() > 0 { residual } else { -residual },
            gap_residual: crossing.gap_measured - crossing.gap_predicted,
            trend: self.trend,
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::supervise::Leg;
    use crate::units::Direction;

    /// A crossing of ordinary values.
    pub(in crate::log) fn crossing(direction: Direction, scale: f64) -> CrossingRecord {
        let q = |value: f64| Q16::from_num(value);
        CrossingRecord {
            index: 2,
            direction,
            position: q(40.1),
            residual: q(0.1),
            speed: q(7.5),
            preload: q(48.0),
            peak_preload: q(49.5),
            compression: q(0.8),
            gap_predicted: q(2.57),
            gap_measured: q(2.59),
            height: q(4.0),
            lead_time: q(0.3),
            slip_margin: q(0.4),
            stiffness_scale: q(scale),
            ..CrossingRecord::default()
        }
    }

    fn row(stage: ContactStage, speed: f64, speed_ref: f64) -> Record {
        let mut record = Record::default();
        record.telemetry.mode = Mode::Run(Direction::Retract, Leg::Crossing);
        record.telemetry.stage = stage;
        record.telemetry.speed = Q16::from_num(speed);
        record.telemetry.speed_ref = Q16::from_num(speed_ref);
        record
    }

    #[test]
    fn the_dip_is_that_of_the_corner_alone() {
        let mut ledger = Ledger::EMPTY;
        for (stage, speed) in [
            (ContactStage::Continuous, -1.0),
            (ContactStage::StaticFriction, -7.5),
            (ContactStage::Sliding, -6.0),
            (ContactStage::Rolling, -8.5),
            (ContactStage::Continuous, -2.0),
        ] {
            ledger.look(&row(stage, speed, -8.0));
        }
        let line = ledger.close(9, &crossing(Direction::Retract, 1.0));
        assert_eq!(line.speed_dip.to_num::<f64>(), 2.0);
        // The next corner begins afresh.
        ledger.look(&row(ContactStage::Sliding, -7.0, -8.0));
        assert_eq!(ledger.close(10, &crossing(Direction::Retract, 1.0)).speed_dip, Q16::ONE);
    }

    #[test]
    fn slip_counts_the_way_the_wheel_goes() {
        let mut ledger = Ledger::EMPTY;
        let out = ledger.close(1, &crossing(Direction::Deploy, 1.0));
        let back = ledger.close(2, &crossing(Direction::Retract, 1.0));
        assert_eq!((out.slip, out.count), (Q16::from_num(0.1), 1));
        assert_eq!((back.slip, back.count), (-Q16::from_num(0.1), 2));
        assert!((out.gap_residual.to_num::<f64>() - 0.02).abs() < 5e-5);
    }

    #[test]
    fn a_tread_that_softens_evenly_shows_its_rate() {
        let mut ledger = Ledger::EMPTY;
        let mut trend = 0.0;
        for step in 0..40 {
            let scale = 1.1 - 0.004 * f64::from(step);
            trend = ledger.close(0, &crossing(Direction::Deploy, scale)).trend.to_num();
        }
        // A quarter of an LSB is lost in each of the roundings: some of them add up.
        assert!((trend + 0.004_f64).abs() < 1e-4, "{trend}");
    }
}
