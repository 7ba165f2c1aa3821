//! A tick with names and units.

use interstage::log::{Flags, Record, codes};
use interstage::sense::raw::{
    AdcCode, AngleFrame, BridgeCode, BridgeCodes, EncoderCount, Sample, SensorFrame,
};
use interstage::tick::Telemetry;
use interstage::units::{Duty, Q16};
use serde::{Deserialize, Serialize};

/// A tick of the controller: what its sensors said, what it made of it, what it did.
///
/// Every quantity is exactly what the controller has: its fixed-point numbers are whole
/// multiples of 2^-16 and have a place in an `f64`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Ticks since boot, 1 ms each.
    pub tick: u32,
    /// The same, s.
    pub t_s: f64,
    /// Number of the mode, see [`codes::mode`].
    pub mode: u8,
    /// Contact stage, 1 to 6.
    pub stage: u8,
    /// Sleeve level.
    pub level: u8,
    /// Code of the wheel encoder, 16 bits, wraps; none before the first.
    pub wheel_code: Option<u16>,
    /// When it was taken, ticks.
    pub wheel_at: Option<u32>,
    /// Code of the load cell.
    pub load_cell_code: Option<u16>,
    /// When it was taken, ticks.
    pub load_cell_at: Option<u32>,
    /// Code of the tread displacement sensor.
    pub tread_code: Option<u16>,
    /// When it was taken, ticks.
    pub tread_at: Option<u32>,
    /// Frame of the arm angle sensor, undecoded.
    pub arm_code: Option<u16>,
    /// When it was taken, ticks.
    pub arm_at: Option<u32>,
    /// Code of the drive's bridge, 12 bits, 2048 without voltage; none if none was taken.
    pub drive_code: Option<u16>,
    /// Code of the pre-tightener's bridge.
    pub pretightener_code: Option<u16>,
    /// Number of the command that was given, from 1; 0 for none.
    pub command: u8,
    /// Everything else that the tick was given and gave, as bits, see [`Flags`].
    pub flags: u16,
    /// Estimated axial position, mm.
    pub position_mm: f64,
    /// Estimated speed, mm/s.
    pub speed_mm_s: f64,
    /// Speed asked for, mm/s.
    pub speed_ref_mm_s: f64,
    /// Measured preload, N.
    pub preload_n: f64,
    /// Preload asked for, N.
    pub preload_ref_n: f64,
    /// Measured tread compression, mm.
    pub compression_mm: f64,
    /// Wheel centre's distance from the pillar axis, mm.
    pub radius_mm: f64,
    /// Gap predicted for the step ahead, mm.
    pub gap_predicted_mm: f64,
    /// Friction left unused, by the model.
    pub slip_margin: f64,
    /// Amplitude of the arm's mode, mm.
    pub vibration_mm: f64,
    /// Distance to the next face, mm; 32768 when none is left.
    pub distance_mm: f64,
    /// Duty of the drive, -1 to 1.
    pub drive_duty: f64,
    /// Duty of the pre-tightener, -1 to 1.
    pub preload_duty: f64,
    /// The drive's bridge is on.
    pub drive_on: bool,
    /// The pre-tightener's bridge is on.
    pub preload_on: bool,
}

/// One in the format of a duty.
const DUTY: f64 = 32_768.0;

impl Row {
    /// The row of a record.
    #[must_use]
    pub fn of(record: &Record, sensors: &SensorFrame) -> Self {
        let Record { telemetry: seen, flags, .. } = record;
        let SensorFrame { wheel, load_cell, tread, arm, bridges } = sensors;
        Self {
            tick: seen.at,
            t_s: f64::from(seen.at) * 1e-3,
            mode: codes::of_mode(seen.mode),
            stage: seen.stage as u8,
            level: seen.level,
            wheel_code: wheel.map(|sample| sample.code.get()),
            wheel_at: wheel.map(|sample| sample.at),
            load_cell_code: load_cell.map(|sample| sample.code.get()),
            load_cell_at: load_cell.map(|sample| sample.at),
            tread_code: tread.map(|sample| sample.code.get()),
            tread_at: tread.map(|sample| sample.at),
            arm_code: arm.map(|sample| sample.code.get()),
            arm_at: arm.map(|sample| sample.at),
            drive_code: bridges.map(|codes| codes.drive.get()),
            pretightener_code: bridges.map(|codes| codes.pretightener.get()),
            command: codes::of_command(flags.command()),
            flags: flags.to_bits(),
            position_mm: seen.position.to_num(),
            speed_mm_s: seen.speed.to_num(),
            speed_ref_mm_s: seen.speed_ref.to_num(),
            preload_n: seen.preload.to_num(),
            preload_ref_n: seen.preload_ref.to_num(),
            compression_mm: seen.compression.to_num(),
            radius_mm: seen.radius.to_num(),
            gap_predicted_mm: seen.gap_predicted.to_num(),
            slip_margin: seen.slip_margin.to_num(),
            vibration_mm: seen.vibration.to_num(),
            distance_mm: seen.distance.to_num(),
            drive_duty: f64::from(seen.drive.to_bits()) / DUTY,
            preload_duty: f64::from(seen.pretightener.to_bits()) / DUTY,
            drive_on: flags.drive(),
            preload_on: flags.preload(),
        }
    }

    /// What the controller's sensors said.
    #[must_use]
    pub fn sensors(&self) -> SensorFrame {
        fn sample<T>(
            code: Option<u16>,
            at: Option<u32>,
            make: impl Fn(u16) -> T,
        ) -> Option<Sample<T>> {
            Some(Sample { code: make(code?), at: at? })
        }
        let bridges = self.drive_code.zip(self.pretightener_code);
        SensorFrame {
            wheel: sample(self.wheel_code, self.wheel_at, EncoderCount::new),
            load_cell: sample(self.load_cell_code, self.load_cell_at, AdcCode::new),
            tread: sample(self.tread_code, self.tread_at, AdcCode::new),
            arm: sample(self.arm_code, self.arm_at, AngleFrame::new),
            bridges: bridges.map(|(drive, pretightener)| BridgeCodes {
                drive: BridgeCode::new(drive),
                pretightener: BridgeCode::new(pretightener),
            }),
        }
    }

    /// Everything else that the tick was given and gave.
    #[must_use]
    pub const fn flags(&self) -> Flags {
        Flags::from_bits(self.flags)
    }

    /// The controller's state in its own numbers; none if mode or stage have no meaning.
    #[must_use]
    pub fn telemetry(&self) -> Option<Telemetry> {
        let q = |value: f64| Q16::from_num(value);
        let duty = |value: f64| Duty::from_bits((value * DUTY).round() as i16);
        Some(Telemetry {
            at: self.tick,
            mode: codes::mode(self.mode)?,
            stage: codes::stage(self.stage)?,
            position: q(self.position_mm),
            speed: q(self.speed_mm_s),
            speed_ref: q(self.speed_ref_mm_s),
            preload: q(self.preload_n),
            preload_ref: q(self.preload_ref_n),
            compression: q(self.compression_mm),
            radius: q(self.radius_mm),
            level: self.level,
            gap_predicted: q(self.gap_predicted_mm),
            slip_margin: q(self.slip_margin),
            vibration: q(self.vibration_mm),
            distance: q(self.distance_mm),
            drive: duty(self.drive_duty),
            pretightener: duty(self.preload_duty),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_row_keeps_every_bit(q in prop::array::uniform11(any::<i32>()), duties in any::<[i16; 2]>()) {
            let q = q.map(Q16::from_bits);
            let telemetry = Telemetry {
                at: 77,
                position: q[0],
                speed: q[1],
                speed_ref: q[2],
                preload: q[3],
                preload_ref: q[4],
                compression: q[5],
                radius: q[6],
                gap_predicted: q[7],
                slip_margin: q[8],
                vibration: q[9],
                distance: q[10],
                drive: Duty::from_bits(duties[0]),
                pretightener: Duty::from_bits(duties[1]),
                ..Telemetry::default()
            };
            let record = Record { telemetry, ..Record::EMPTY };
            let row = Row::of(&record, &SensorFrame::default());
            prop_assert_eq!(row.telemetry(), Some(telemetry));
            // JSON keeps it too.
            let text = serde_json::to_string(&row).unwrap();
            prop_assert_eq!(serde_json::from_str::<Row>(&text).unwrap(), row);
        }
    }
}
