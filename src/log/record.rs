//! One tick in the log: all inputs and outputs, so that a host can compare its bits.

use crate::sense::raw::{BridgeCode, BridgeCodes, Sample, SensorFrame, SensorId};
use crate::supervise::{Command, codes};
use crate::tick::{Input, Output, Telemetry};
use crate::units::{MotorCommand, Tick};

/// Code of age 0, and so the farthest that a code may be ahead of its tick.
const NOW: u32 = 8;
/// Code of an age that is too large to encode; the time of the tick before holds.
const OLD: u8 = 254;
/// Code of a sensor without a reading.
const NEVER: u8 = 255;

/// A tick's input and output in 92 bytes. Plan, request and log entries are rare and have frames
/// of their own; flags show that there were some.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// State after the tick; its time is that of the input.
    pub telemetry: Telemetry,
    /// Codes of the sensors, by [`SensorId`]; 0 without a reading.
    pub codes: [u16; SensorId::COUNT],
    /// Coded ages of the codes, see [`Record::sensors`].
    pub ages: [u8; SensorId::COUNT],
    /// Codes of the bridges of drive and pre-tightener; 0 if there were none.
    pub bridges: [u16; 2],
    /// Everything else.
    pub flags: Flags,
}

/// Inputs and outputs beside codes and state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(pub u16);

impl Flags {
    const COMMAND: u16 = 0b111;
    /// The tick was given a plan.
    pub const PLAN: Self = Self(1 << 3);
    /// It began more than a period late.
    pub const OVERRUN: Self = Self(1 << 4);
    /// The emergency stop had cut the bridges.
    pub const EMERGENCY: Self = Self(1 << 5);
    /// It asked for a plan.
    pub const REQUEST: Self = Self(1 << 6);
    /// It re-enabled the bridges.
    pub const REARM: Self = Self(1 << 7);
    /// The drive's bridge is on.
    pub const DRIVE: Self = Self(1 << 8);
    /// The pre-tightener's bridge is on.
    pub const PRELOAD: Self = Self(1 << 9);
    const EVENTS: u32 = 10;
    const MOST_EVENTS: u16 = 0b1111;
    /// It was given the readback of the bridges.
    pub const READBACK: Self = Self(1 << 14);
    /// It was given a request of the service mode: the latest of the events.
    pub const SERVICE: Self = Self(1 << 15);

    fn of(input: &Input, output: &Output) -> Self {
        let bit = |set: bool, flag: Self| if set { flag.0 } else { 0 };
        Self(
            u16::from(codes::of_command(input.command))
                | bit(input.plan.is_some(), Self::PLAN)
                | bit(input.overrun, Self::OVERRUN)
                | bit(input.emergency_stop, Self::EMERGENCY)
                | bit(output.request.is_some(), Self::REQUEST)
                | bit(output.rearm, Self::REARM)
                | bit(output.drive.enable, Self::DRIVE)
                | bit(output.preload.enable, Self::PRELOAD)
                | bit(input.sensors.bridges.is_some(), Self::READBACK)
                | bit(input.service.is_some(), Self::SERVICE)
                | (output.events.len() as u16) << Self::EVENTS,
        )
    }

    /// Whether this flag is set.
    pub const fn has(self, flag: Self) -> bool {
        self.0 & flag.0 != 0
    }

    /// The command that the tick was given.
    pub fn command(self) -> Option<Command> {
        codes::command((self.0 & Self::COMMAND) as u8)
    }

    /// Number of its log entries.
    pub const fn events(self) -> u16 {
        self.0 >> Self::EVENTS & Self::MOST_EVENTS
    }
}

impl Record {
    /// The record of a tick.
    pub fn of(input: &Input, output: &Output) -> Self {
        let Input { now, sensors: from, .. } = input;
        let sensors = from.samples.map(|sample| pack(*now, sample));
        let bridges = from.bridges.unwrap_or_default();
        Self {
            telemetry: output.telemetry,
            codes: sensors.map(|(code, _)| code),
            ages: sensors.map(|(_, age)| age),
            bridges: [bridges.drive.get(), bridges.pretightener.get()],
            flags: Flags::of(input, output),
        }
    }

    /// Time of the tick.
    pub const fn at(&self) -> Tick {
        self.telemetry.at
    }

    /// The codes with their times. For a code older than 245 ticks that is the time in the
    /// tick `before`.
    pub fn sensors(&self, before: &SensorFrame) -> SensorFrame {
        SensorFrame {
            samples: SensorId::ALL.map(|sensor| self.sample(sensor, before[sensor])),
            bridges: self.flags.has(Flags::READBACK).then(|| {
                let [drive, pretightener] = self.bridges.map(BridgeCode::new);
                BridgeCodes { drive, pretightener }
            }),
        }
    }

    fn sample(&self, sensor: SensorId, before: Option<Sample<u16>>) -> Option<Sample<u16>> {
        let taken = |age: u8| self.at().wrapping_add(NOW).wrapping_sub(age.into());
        let at = match self.ages[sensor as usize] {
            NEVER => return None,
            OLD => before.map_or(taken(OLD), |sample| sample.at),
            age => taken(age),
        };
        Some(Sample { code: self.codes[sensor as usize], at })
    }

    /// Input of the tick except the plan and the service mode's duties; `before` as for
    /// [`Record::sensors`].
    pub fn input(&self, before: &SensorFrame) -> Input {
        Input {
            now: self.at(),
            sensors: self.sensors(before),
            command: self.flags.command(),
            service: None,
            plan: None,
            overrun: self.flags.has(Flags::OVERRUN),
            emergency_stop: self.flags.has(Flags::EMERGENCY),
        }
    }

    /// Command of the drive's bridge.
    pub fn drive(&self) -> MotorCommand {
        MotorCommand { duty: self.telemetry.drive, enable: self.flags.has(Flags::DRIVE) }
    }

    /// Command of the pre-tightener's bridge.
    pub fn preload(&self) -> MotorCommand {
        let enable = self.flags.has(Flags::PRELOAD);
        MotorCommand { duty: self.telemetry.pretightener, enable }
    }
}

/// Code and coded age of a sample.
fn pack(now: Tick, sample: Option<Sample<u16>>) -> (u16, u8) {
    let Some(sample) = sample else { return (0, NEVER) };
    let age = now.wrapping_sub(sample.at).wrapping_add(NOW);
    (sample.code, if age < u32::from(OLD) { age as u8 } else { OLD })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::supervise::Mode;
    use crate::units::{Duty, Q16};
    use proptest::prelude::*;

    /// Any record that a tick can leave.
    pub(in crate::log) fn any_record() -> impl Strategy<Value = Record> {
        let quantities = any::<[i32; Telemetry::QUANTITIES]>();
        (
            (any::<u32>(), 0..19_usize, 1..=6_u8, any::<u8>(), quantities, any::<[i16; 2]>()),
            (
                any::<[u16; SensorId::COUNT]>(),
                any::<[u8; SensorId::COUNT]>(),
                any::<[u16; 2]>(),
                any::<u16>(),
            ),
        )
            .prop_map(
                |((at, mode, stage, level, q, duties), (codes, ages, bridges, flags))| {
                    let [drive, pretightener] = duties.map(Duty::from_bits);
                    let mode = Mode::WITHOUT_FAULT[mode].0;
                    let stage = codes::stage(stage).unwrap();
                    let plain = Telemetry::default();
                    let state = Telemetry { at, mode, stage, level, drive, pretightener, ..plain };
                    let telemetry = state.with_quantities(q.map(Q16::from_bits));
                    Record { telemetry, codes, ages, bridges, flags: Flags(flags) }
                },
            )
    }

    fn output_at(at: Tick) -> Output {
        Output { telemetry: Telemetry { at, ..Telemetry::default() }, ..Output::default() }
    }

    proptest! {
        #[test]
        fn what_a_tick_was_given_comes_back(
            now in any::<u32>(),
            codes in any::<[u16; SensorId::COUNT]>(),
            ages in prop::collection::vec(prop::option::of(-8..=245_i32), SensorId::COUNT),
            command in prop::option::of(0..4_usize),
            bridges in prop::option::of(any::<[u16; 2]>()),
            overrun in any::<bool>(),
            emergency_stop in any::<bool>(),
        ) {
            let at = |age: i32| now.wrapping_sub(age as u32);
            let sensors = SensorFrame {
                samples: SensorId::ALL.map(|sensor| {
                    let code = codes[sensor as usize];
                    ages[sensor as usize].map(|age| Sample { code, at: at(age) })
                }),
                bridges: bridges.map(|codes| {
                    let [drive, pretightener] = codes.map(BridgeCode::new);
                    BridgeCodes { drive, pretightener }
                }),
            };
            let command = command.map(|index| Command::ALL[index]);
            let input =
                Input { now, sensors, command, service: None, plan: None, overrun, emergency_stop };
            let back = Record::of(&input, &output_at(now)).input(&SensorFrame::default());
            prop_assert_eq!(back.sensors, input.sensors);
            prop_assert_eq!((back.now, back.command), (now, command));
            prop_assert_eq!((back.overrun, back.emergency_stop), (overrun, emergency_stop));
        }

        #[test]
        fn a_code_too_old_to_tell_keeps_its_time(now in 1000..u32::MAX, age in 246..900_u32) {
            let mut frame = SensorFrame::default();
            frame[SensorId::CompressionSensor] = Some(Sample { code: 7, at: now - age });
            let input = Input { now, sensors: frame, ..Input::default() };
            let record = Record::of(&input, &output_at(now));
            prop_assert_eq!(record.sensors(&frame), frame);
            // Without a tick before, it is at least old.
            let alone = record.sensors(&SensorFrame::default())[SensorId::CompressionSensor].unwrap();
            prop_assert_eq!(now - alone.at, 246);
        }
    }

    #[test]
    fn bridges_and_flags_come_back() {
        let on = |bits| MotorCommand { duty: Duty::from_bits(bits), enable: true };
        let mut output = Output { drive: on(-5), rearm: true, ..Output::default() };
        output.telemetry.drive = output.drive.duty;
        let record = Record::of(&Input::default(), &output);
        assert_eq!((record.drive(), record.preload()), (on(-5), MotorCommand::OFF));
        assert!(record.flags.has(Flags::REARM));
        assert!(!record.flags.has(Flags::REQUEST) && !record.flags.has(Flags::PLAN));
        assert_eq!(record.flags.events(), 0);
    }
}
