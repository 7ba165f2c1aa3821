//! Mistakes in the wiring of a rig, between the chip's pins and the plant: what a first power-up
//! has to find.

use clap::ValueEnum;
use hil_sim::bringup::{Sensor, stowed};
use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::rig::Drives;
use hil_sim::plant::sensors::Codes;
use interstage::rig::Rig;
use interstage::sense::raw::{BridgeCode, BridgeCodes, SensorId};

use super::chip::{Chip, Pin};

/// Code of a sensor without load: 5 % of the converter.
const ZERO: i32 = 3277;
/// Codes from there to full scale: 85 %.
const FULL: f64 = 55_704.75;
/// Code of an open input whose pull-down is missing: it keeps some charge.
const FLOATING: u16 = 21_000;
/// What a sensor shows of its quantity, in percent.
const GAINS: [(Mistake, i32); 5] = [
    (Mistake::PreloadReversed, -100),
    (Mistake::CompressionReversed, -100),
    (Mistake::PreloadGain, 150),
    (Mistake::PreloadScale, 110),
    (Mistake::CompressionScale, 90),
];
/// Preload at which its sensor is at its stop, N.
const PRELOAD_STOP_N: f64 = 13.0;
/// By how much the angle's zero code is off, codes.
const ANGLE_OFF: i32 = 900;
/// Friction of a wheel that cannot be turned, N.
const BLOCKED_N: f64 = 1e4;

/// A mistake in the wiring, by its name on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mistake {
    /// The option byte DBANK is 0.
    OneBank,
    /// The angle encoder is not connected.
    AngleOpen,
    MagnetMissing,
    /// Its chip is at the pivot's other end: the codes grow inwards from the right one at the stow end.
    ArmInwards,
    /// The angle's zero code is far off.
    AngleZero,
    /// The preload sensor is not connected.
    PreloadOpen,
    /// Its bridge is reversed.
    PreloadReversed,
    /// Preload and compression sensor are exchanged.
    SensorsExchanged,
    /// The compression sensor is not connected.
    CompressionOpen,
    CompressionReversed,
    /// Line A of the wheel encoder is not connected.
    EncoderA,
    /// Line B of the wheel encoder is not connected.
    EncoderB,
    /// Neither is connected.
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
    /// The emergency stop's contact is open.
    StopOpen,
    /// Its line is shorted to ground.
    StopShorted,
    /// Its second contact does not cut the motors' supply.
    StopSupply,
    /// The preload sensor shows 1.5 times the preload.
    PreloadGain,
    /// It shows a tenth too much.
    PreloadScale,
    /// The carriage has no stop at the stow end.
    NoStop,
    /// It is at its stop at 13 N.
    PreloadStop,
    /// The compression sensor shows a tenth too little.
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

/// The wiring of a rig, and what a hand does with it.
#[derive(Clone, Debug, Default)]
pub struct Wiring {
    mistakes: Vec<Mistake>,
    /// The angle's code at the stow end, and that of a preload sensor at its stop.
    stowed: i32,
    preload_stop: i32,
    /// The emergency stop is pressed.
    pub stop_pressed: bool,
    /// The motor supply is switched off.
    pub switched_off: bool,
    /// Sensors that a hand has unplugged.
    pub unplugged: Vec<Sensor>,
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
        let stop = FULL * PRELOAD_STOP_N / rig.sense.preload_full_scale_n;
        self.preload_stop = ZERO + stop.round() as i32;
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
    pub fn is_supplied(&self) -> bool {
        let cut = self.stop_pressed && !self.has(Mistake::StopSupply);
        !cut && !self.switched_off && !self.has(Mistake::SupplyOff)
    }

    /// Applies what is constant, and the hand, to the chip's pins.
    pub fn connect(&self, chip: &mut Chip, now: u64) {
        chip.flash.set_single_bank(self.has(Mistake::OneBank));
        chip.angle.lost = self.has(Mistake::AngleOpen);
        chip.angle.set_magnet(!self.has(Mistake::MagnetMissing));
        let open = self.has(Mistake::EncoderOpen);
        chip.defects.encoder_lines =
            [open || self.has(Mistake::EncoderA), open || self.has(Mistake::EncoderB)];
        chip.defects.encoder_swapped =
            self.has(Mistake::EncoderSwapped) || self.has(Mistake::BothSwapped);
        chip.defects.drive_bridge_floats = self.has(Mistake::BridgePullDowns);
        let pressed = self.stop_pressed && !self.has(Mistake::StopShorted);
        let open = pressed || self.has(Mistake::StopOpen);
        chip.drive(Pin::STOP_DRIVE, open, now);
        chip.drive(Pin::STOP_PRELOAD, open, now);
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
        let arm = &mut codes.sensors[SensorId::ArmAngle as usize];
        *arm = self.arm(*arm);
        let places = [SensorId::PreloadSensor, SensorId::CompressionSensor].map(|s| s as usize);
        let [mut preload, mut compression] = places.map(|at| i32::from(codes.sensors[at]));
        for (mistake, percent) in GAINS.into_iter().filter(|(mistake, _)| self.has(*mistake)) {
            let is_compression =
                matches!(mistake, Mistake::CompressionReversed | Mistake::CompressionScale);
            let code = if is_compression { &mut compression } else { &mut preload };
            *code = ZERO + (*code - ZERO) * percent / 100;
        }
        if self.has(Mistake::PreloadStop) {
            preload = preload.min(self.preload_stop);
        }
        if self.has(Mistake::PreloadOpen) || self.unplugged.contains(&Sensor::Preload) {
            let floats = self.has(Mistake::PreloadPullDown);
            preload = if floats { FLOATING.into() } else { 0 };
        }
        if self.has(Mistake::CompressionOpen) || self.unplugged.contains(&Sensor::Compression) {
            compression = 0;
        }
        if self.has(Mistake::SensorsExchanged) {
            std::mem::swap(&mut preload, &mut compression);
        }
        let code = |code: i32| code.clamp(0, 65_535) as u16;
        (codes.sensors[places[0]], codes.sensors[places[1]]) = (code(preload), code(compression));
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

    /// The angle's frame, of a chip at the pivot's other end or with its zero elsewhere.
    fn arm(&self, frame: u16) -> u16 {
        let mut code = i32::from(frame & 0x3FFF);
        if self.has(Mistake::ArmInwards) {
            code = 2 * self.stowed - code;
        }
        if self.has(Mistake::AngleZero) {
            code += ANGLE_OFF;
        }
        let bits = (code & 0x3FFF) as u16;
        bits | ((bits.count_ones() & 1) as u16) << 15
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
                let arm = arm as u16;
                let preload = 65_535.0 * (0.05 + 0.85 * preload_n / full_scale_n);
                [0, preload.round() as u16, 0, arm | ((arm.count_ones() & 1) as u16) << 15]
            };
            let passed = |sensors| wiring.codes(Codes { sensors, bridges: BridgeCodes::default() });
            let stow = stowed(&scenario.rig).round();
            // Below 13 N, and at the stow end, nothing shows.
            assert_eq!(passed(codes(12.9, stow)).sensors, codes(12.9, stow));
            assert_eq!(passed(codes(30.0, stow + 100.0)).sensors, codes(13.0, stow - 100.0));
        }
    }
}
