//! One control tick as words: its input, and the compared part of its output.

use interstage::model::Plan;
use interstage::sense::raw::{BridgeCode, BridgeCodes, Sample, SensorFrame, SensorId};
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
    /// Codes of the sensors, by [`SensorId`].
    pub codes: [Code; SensorId::COUNT],
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

impl Given {
    /// Words in the image's memory.
    pub const WORDS: usize = 5 + 3 * SensorId::COUNT;

    pub fn of(input: &Input) -> Self {
        let frame = input.sensors;
        let position =
            |command| Command::ALL.iter().position(|c| *c == command).map_or(0, |at| at as u32 + 1);
        Self {
            now: input.now,
            codes: frame.samples.map(|s| s.map_or([0; 3], |s| [1, s.code.into(), s.at])),
            bridges: frame.bridges.map_or(NO_BRIDGES, |codes| {
                u32::from(codes.drive.get()) | u32::from(codes.pretightener.get()) << 16
            }),
            command: input.command.map_or(0, position),
            overrun: input.overrun.into(),
            emergency_stop: input.emergency_stop.into(),
        }
    }

    pub fn input(&self, plan: Option<Plan>) -> Input {
        Input {
            now: self.now,
            sensors: SensorFrame {
                samples: self.codes.map(|[valid, code, at]| {
                    (valid != 0).then_some(Sample { code: code as u16, at })
                }),
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
    pub fn words(&self) -> [u32; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let (first, rest) = words.split_at_mut(Self::WORDS - 4);
        first[0] = self.now;
        first[1..].copy_from_slice(self.codes.as_flattened());
        let last = [self.bridges, self.command, self.overrun, self.emergency_stop];
        rest.copy_from_slice(&last);
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
        let mut sensors = SensorFrame::taken(7, [65_535, 0, 1, 0x8001]);
        sensors[SensorId::PreloadSensor] = None;
        sensors[SensorId::ArmAngle].iter_mut().for_each(|sample| sample.at = 6);
        let (drive, pretightener) = (BridgeCode::new(4095), BridgeCode::new(7));
        sensors.bridges = Some(BridgeCodes { drive, pretightener });
        let input = Input {
            now: 9,
            sensors,
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
        assert_eq!(core::mem::offset_of!(Given, command), (2 + 3 * SensorId::COUNT) * 4);
    }
}
