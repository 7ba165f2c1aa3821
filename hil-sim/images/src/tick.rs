//! One control tick as words: its input, and the compared part of its output.

use interstage::model::Plan;
use interstage::sense::raw::{
    AdcCode, AngleFrame, BridgeCode, BridgeCodes, EncoderCount, Sample, SensorFrame,
};
use interstage::supervise::Command;
use interstage::tick::{Input, Output};

use crate::digest::Digest;

/// A sensor's code: 1 if the sensor has answered at all, the code, the tick at which it was taken.
pub type Code = [u32; 3];

/// Input of a tick without the plan, which the image computes itself.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Given {
    /// Time, ticks.
    pub now: u32,
    /// Wheel encoder, preload sensor, compression sensor, arm angle.
    pub codes: [Code; 4],
    /// Codes of the bridges of drive and pre-tightener in low and high half, or
    /// [`NO_BRIDGES`].
    pub bridges: u32,
    /// Index into [`Command::ALL`], from 1; 0 for none.
    pub command: u32,
    /// 1 if the tick is late.
    pub overrun: u32,
    /// 1 if the emergency stop has cut the bridges.
    pub emergency_stop: u32,
}

/// No conversion of the bridges' outputs.
pub const NO_BRIDGES: u32 = u32::MAX;

/// The compared part of a tick's output.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    /// Low and high half of the digest over the whole output.
    pub digest: [u32; 2],
    /// Q15 duty of the drive, 0x1_0000 if the bridge is off.
    pub drive: u32,
    /// Q15 duty of the pre-tightener, 0x1_0000 if the bridge is off.
    pub preload: u32,
}

/// The rig of the image's controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Preset {
    Prototype = 0,
    /// The study's own loads.
    Fe = 1,
}

impl Preset {
    /// Every preset.
    pub const ALL: [Self; 2] = [Self::Prototype, Self::Fe];

    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// Its name, as [`interstage::rig::Rig::named`] takes it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Prototype => "prototype",
            Self::Fe => "fe",
        }
    }
}

fn code<T>(sample: Option<Sample<T>>, get: impl Fn(T) -> u16) -> Code {
    sample.map_or([0; 3], |s| [1, get(s.code).into(), s.at])
}

fn sample<T>(code: &Code, new: impl Fn(u16) -> T) -> Option<Sample<T>> {
    let [valid, code, at] = *code;
    (valid != 0).then(|| Sample { code: new(code as u16), at })
}

impl Given {
    pub fn of(input: &Input) -> Self {
        let frame = input.sensors;
        let position =
            |command| Command::ALL.iter().position(|c| *c == command).map_or(0, |at| at as u32 + 1);
        Self {
            now: input.now,
            codes: [
                code(frame.wheel_encoder, EncoderCount::get),
                code(frame.preload_sensor, AdcCode::get),
                code(frame.compression_sensor, AdcCode::get),
                code(frame.arm_angle, AngleFrame::get),
            ],
            bridges: frame.bridges.map_or(NO_BRIDGES, |codes| {
                u32::from(codes.drive.get()) | u32::from(codes.pretightener.get()) << 16
            }),
            command: input.command.map_or(0, position),
            overrun: input.overrun.into(),
            emergency_stop: input.emergency_stop.into(),
        }
    }

    pub fn input(&self, plan: Option<Plan>) -> Input {
        let [wheel, preload, compression, arm] = &self.codes;
        Input {
            now: self.now,
            sensors: SensorFrame {
                wheel_encoder: sample(wheel, EncoderCount::new),
                preload_sensor: sample(preload, AdcCode::new),
                compression_sensor: sample(compression, AdcCode::new),
                arm_angle: sample(arm, AngleFrame::new),
                bridges: (self.bridges != NO_BRIDGES).then_some(BridgeCodes {
                    drive: BridgeCode::new(self.bridges as u16),
                    pretightener: BridgeCode::new((self.bridges >> 16) as u16),
                }),
            },
            command: Command::ALL.get((self.command as usize).wrapping_sub(1)).copied(),
            service: None,
            plan,
            overrun: self.overrun != 0,
            emergency_stop: self.emergency_stop != 0,
        }
    }

    /// The words in the image's memory.
    pub fn words(&self) -> [u32; 17] {
        let mut words = [0; 17];
        words[0] = self.now;
        words[1..13].copy_from_slice(self.codes.as_flattened());
        let rest = [self.bridges, self.command, self.overrun, self.emergency_stop];
        words[13..].copy_from_slice(&rest);
        words
    }
}

impl Taken {
    pub fn of(output: &Output) -> Self {
        let digest = Digest::of(output);
        let duty = |command: interstage::units::MotorCommand| {
            if command.enable { u32::from(command.duty.to_bits() as u16) } else { 0x1_0000 }
        };
        Self {
            digest: [digest as u32, (digest >> 32) as u32],
            drive: duty(output.drive),
            preload: duty(output.preload),
        }
    }

    /// From the words of the image's memory.
    pub const fn from_words(words: [u32; 4]) -> Self {
        let [low, high, drive, preload] = words;
        Self { digest: [low, high], drive, preload }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_survives_its_words() {
        let at = 7;
        let input = Input {
            now: 9,
            sensors: SensorFrame {
                wheel_encoder: Some(Sample { code: EncoderCount::new(65_535), at }),
                preload_sensor: None,
                compression_sensor: Some(Sample { code: AdcCode::new(1), at }),
                arm_angle: Some(Sample { code: AngleFrame::new(0x8001), at: 6 }),
                bridges: Some(BridgeCodes {
                    drive: BridgeCode::new(4095),
                    pretightener: BridgeCode::new(7),
                }),
            },
            command: Some(Command::Retract),
            service: None,
            plan: None,
            overrun: true,
            emergency_stop: false,
        };
        let back = Given::of(&input).input(None);
        assert_eq!(Digest::of(&back), Digest::of(&input));
        assert_eq!(back.sensors, input.sensors);
    }

    #[test]
    fn the_words_have_the_order_of_the_structure() {
        assert_eq!(size_of::<Given>(), size_of_val(&Given::default().words()));
        assert_eq!(core::mem::offset_of!(Given, command), 14 * 4);
    }
}
