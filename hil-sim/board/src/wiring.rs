//! Mistakes in the wiring of a rig, between the chip's pins and the plant: what a first power-up
//! has to find.

use clap::ValueEnum;
use hil_sim::bringup::stowed;
use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::rig::Drives;
use hil_sim::plant::sensors::{Codes, encode, with_parity};
use hil_sim::scenario::injection::{Injection, Kind, Target};
use interstage::rig::Rig;
use interstage::sense::raw::SensorId::{ArmAngle, CompressionSensor, PreloadSensor};
use interstage::sense::raw::{BridgeCode, BridgeCodes, SensorId};

use super::chip::Chip;

/// Code of an open input whose pull-down is missing: it keeps some charge.
const FLOATING: u16 = 21_000;
/// Preload at which its sensor is at its stop, N.
const PRELOAD_STOP_N: f64 = 13.0;
/// By how much the angle's zero code is off, degrees.
const ANGLE_OFF: f64 = 20.0;
/// Friction of a wheel that cannot be turned, N.
const BLOCKED_N: f64 = 1e4;

/// A mistake in the wiring, by its name on the command line; [`Mistake::faults`] has those that
/// are faults of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mistake {
    OneBank,
    AngleOpen,
    MagnetMissing,
    /// The angle's chip is at the pivot's other end: from the stow end on its codes grow inwards.
    ArmInwards,
    AngleZero,
    PreloadOpen,
    PreloadReversed,
    /// Preload and compression sensor are exchanged.
    SensorsExchanged,
    CompressionOpen,
    CompressionReversed,
    EncoderA,
    EncoderB,
    EncoderOpen,
    /// Lines A and B are exchanged.
    EncoderSwapped,
    /// The drive motor's leads are exchanged.
    DriveLeads,
    /// Both of these are.
    BothSwapped,
    /// The pre-tightener's leads are exchanged.
    PretightenerLeads,
    MotorsExchanged,
    /// The inputs of the drive's readback are exchanged.
    ReadbackSwapped,
    /// The readbacks of the bridges are exchanged.
    ReadbacksExchanged,
    /// The reference of the drive's readback is missing.
    ReadbackReference,
    /// The motor supply is off.
    SupplyOff,
    StopOpen,
    StopShorted,
    /// The emergency stop's second contact does not cut the motors' supply.
    StopSupply,
    PreloadGain,
    PreloadScale,
    /// The carriage has no stop at the stow end.
    NoStop,
    /// The preload sensor is at its stop at 13 N.
    PreloadStop,
    CompressionScale,
    /// The preload sensor has ten times its noise.
    PreloadNoise,
    /// The compression sensor has ten times its noise.
    CompressionNoise,
    /// The wheel cannot be turned.
    WheelBlocked,
    /// The pull-down at the preload sensor's input is missing.
    PreloadPullDown,
    /// The pull-downs at the drive's bridge are missing.
    BridgePullDowns,
}

impl Mistake {
    /// The faults of the catalogue that it is, from the first instruction on.
    pub fn faults(self) -> Vec<Injection> {
        use Target::{AngleBus, EncoderLineA, EncoderLineB, Magnet, OptionBytes, Sensor, StopWire};
        let (preload, compression) = (Sensor(PreloadSensor), Sensor(CompressionSensor));
        let faults: &[(Target, Kind, f64)] = match self {
            Self::OneBank => &[(OptionBytes, Kind::Off, 0.0)],
            Self::AngleOpen => &[(AngleBus, Kind::Off, 0.0)],
            Self::MagnetMissing => &[(Magnet, Kind::Gone, 0.0)],
            Self::AngleZero => &[(Sensor(ArmAngle), Kind::Offset, ANGLE_OFF)],
            Self::PreloadOpen => &[(preload, Kind::Off, 0.0)],
            Self::PreloadReversed => &[(preload, Kind::Gain, -1.0)],
            Self::PreloadGain => &[(preload, Kind::Gain, 1.5)],
            Self::PreloadScale => &[(preload, Kind::Gain, 1.1)],
            Self::CompressionOpen => &[(compression, Kind::Off, 0.0)],
            Self::CompressionReversed => &[(compression, Kind::Gain, -1.0)],
            Self::CompressionScale => &[(compression, Kind::Gain, 0.9)],
            Self::EncoderA => &[(EncoderLineA, Kind::Off, 0.0)],
            Self::EncoderB => &[(EncoderLineB, Kind::Off, 0.0)],
            Self::EncoderOpen => &[(EncoderLineA, Kind::Off, 0.0), (EncoderLineB, Kind::Off, 0.0)],
            Self::StopOpen => &[(StopWire, Kind::Off, 0.0)],
            Self::StopShorted => &[(StopWire, Kind::Shorted, 0.0)],
            _ => &[],
        };
        faults.iter().map(|&(target, kind, by)| Injection::at(target, kind, 0.0, by)).collect()
    }
}

/// The wiring of a rig, and what a hand does with it.
#[derive(Clone, Debug, Default)]
pub struct Wiring {
    mistakes: Vec<Mistake>,
    /// The angle's code at the stow end, and that of a preload sensor at its stop.
    stowed: i32,
    preload_stop: u16,
    /// The emergency stop is pressed.
    pub stop_pressed: bool,
    /// The motor supply is switched off.
    pub switched_off: bool,
    /// Sensors that a hand has unplugged.
    pub unplugged: Vec<SensorId>,
}

impl Wiring {
    /// A rig with these mistakes.
    pub fn with(mistakes: &[Mistake]) -> Self {
        Self { mistakes: mistakes.to_vec(), ..Self::default() }
    }

    fn has(&self, mistake: Mistake) -> bool {
        self.mistakes.contains(&mistake)
    }

    /// The plant of this rig as built.
    pub fn build(&mut self, rig: &Rig, plant: &mut PlantParameters) {
        self.stowed = stowed(rig).round() as i32;
        self.preload_stop = encode(PreloadSensor, rig, PRELOAD_STOP_N).round() as u16;
        if self.has(Mistake::PreloadNoise) {
            plant.sensors.noise.preload_sensor_n *= 10.0;
        }
        if self.has(Mistake::CompressionNoise) {
            plant.sensors.noise.compression_sensor_mm *= 10.0;
        }
        if self.has(Mistake::NoStop) {
            plant.stops_mm.0 = -1e3;
        }
        if self.has(Mistake::WheelBlocked) {
            plant.drive.friction_n = BLOCKED_N;
        }
    }

    /// The motors' supply is there.
    pub(crate) fn is_supplied(&self) -> bool {
        let cut = self.stop_pressed && !self.has(Mistake::StopSupply);
        !cut && !self.switched_off && !self.has(Mistake::SupplyOff)
    }

    /// Applies what is constant, and the hand, to the chip's pins.
    pub(crate) fn connect(&self, chip: &mut Chip, now: u64) {
        chip.defects.encoder_swapped =
            self.has(Mistake::EncoderSwapped) || self.has(Mistake::BothSwapped);
        chip.defects.drive_bridge_floats = self.has(Mistake::BridgePullDowns);
        chip.press_stop(self.stop_pressed, now);
    }

    /// What the motors get of what the bridges put out.
    pub fn drives(&self, mut drives: Drives) -> Drives {
        if !self.is_supplied() {
            (drives.drive_on, drives.preload_on) = (false, false);
        }
        if self.has(Mistake::MotorsExchanged) {
            std::mem::swap(&mut drives.drive, &mut drives.preload);
            std::mem::swap(&mut drives.drive_on, &mut drives.preload_on);
        }
        if self.has(Mistake::DriveLeads) || self.has(Mistake::BothSwapped) {
            drives.drive = -drives.drive;
        }
        if self.has(Mistake::PretightenerLeads) {
            drives.preload = -drives.preload;
        }
        drives
    }

    /// What the board gets of what the sensors and bridges give.
    pub fn codes(&self, mut codes: Codes) -> Codes {
        codes.bridges = self.readback(codes.bridges);
        let [.., preload, compression, arm] = &mut codes.sensors;
        if self.has(Mistake::ArmInwards) {
            // The chip is at the pivot's other end.
            *arm = with_parity((2 * self.stowed - i32::from(*arm & 0x3FFF)) as u16 & 0x3FFF);
        }
        if self.has(Mistake::PreloadStop) {
            *preload = self.preload_stop.min(*preload);
        }
        let is_out = |sensor| self.unplugged.contains(&sensor);
        if is_out(PreloadSensor) {
            *preload = if self.has(Mistake::PreloadPullDown) { FLOATING } else { 0 };
        }
        if is_out(CompressionSensor) {
            *compression = 0;
        }
        if self.has(Mistake::SensorsExchanged) {
            std::mem::swap(preload, compression);
        }
        codes
    }

    /// The readback of bridges whose motors, by [`Wiring::drives`], have got something else.
    fn readback(&self, codes: BridgeCodes) -> BridgeCodes {
        let mirrored = |code: BridgeCode| {
            BridgeCode::new((2 * BridgeCode::CENTRE).saturating_sub(code.get()).min(4095))
        };
        let BridgeCodes { mut drive, mut pretightener } = codes;
        if self.has(Mistake::MotorsExchanged) {
            std::mem::swap(&mut drive, &mut pretightener);
        }
        if self.has(Mistake::DriveLeads) || self.has(Mistake::BothSwapped) {
            drive = mirrored(drive);
        }
        if self.has(Mistake::PretightenerLeads) {
            pretightener = mirrored(pretightener);
        }
        if self.has(Mistake::ReadbackSwapped) {
            drive = mirrored(drive);
        }
        if self.has(Mistake::ReadbackReference) {
            drive = BridgeCode::new(drive.get().saturating_sub(BridgeCode::CENTRE));
        }
        if self.has(Mistake::ReadbacksExchanged) {
            std::mem::swap(&mut drive, &mut pretightener);
        }
        BridgeCodes { drive, pretightener }
    }
}

#[cfg(test)]
mod tests {
    use hil_sim::scenario::Scenario;

    use super::*;

    #[test]
    fn a_mistake_is_as_large_on_another_rig() {
        for full_scale_n in [200.0, 80.0] {
            let sets = [
                format!("sense.preload_full_scale_n={full_scale_n}"),
                "rig.arm_length_mm=160".into(),
            ];
            let scenario = Scenario::default().with(&sets).expect("in range");
            let mut wiring = Wiring::with(&[Mistake::PreloadStop, Mistake::ArmInwards]);
            wiring.build(&scenario.rig, &mut scenario.plant());
            let codes = |preload_n: f64, arm: f64| {
                let preload = encode(PreloadSensor, &scenario.rig, preload_n).round();
                [0, preload as u16, 0, with_parity(arm as u16)]
            };
            let passed = |sensors| wiring.codes(Codes { sensors, bridges: BridgeCodes::default() });
            let stow = stowed(&scenario.rig).round();
            // Below 13 N, and at the stow end, nothing shows.
            assert_eq!(passed(codes(12.9, stow)).sensors, codes(12.9, stow));
            assert_eq!(passed(codes(30.0, stow + 100.0)).sensors, codes(13.0, stow - 100.0));
        }
    }
}
