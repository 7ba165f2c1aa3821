//! One tick as the log keeps it: all that the tick was given and all that it gave, so
//! that a host can run it again and compare bits.

use crate::sense::raw::{
    AdcCode, AngleFrame, BridgeCode, BridgeCodes, EncoderCount, Sample, SensorFrame,
};
use crate::supervise::Command;
use crate::supervise::codes;
use crate::tick::{Input, Output, Telemetry};
use crate::units::{MotorCommand, Tick};

/// Age of a code that was taken at its tick, and so the farthest ahead that one may be.
const NOW: u32 = 8;
/// Age of a code that is older than can be said; the time of the one before holds.
const OLD: u8 = 254;
/// Age of a code that never came.
const NEVER: u8 = 255;

/// A tick's input and output in 88 bytes. Plan, request and log entries, of which a run
/// has few, go beside it; flags tell that they were there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// State after the tick; its time is that of the input.
    pub telemetry: Telemetry,
    /// Codes of wheel, preload sensor, compression_sensor and arm; 0 for one that never came.
    pub codes: [u16; 4],
    /// Ages of the codes as they travel, see [`Record::sensors`].
    pub ages: [u8; 4],
    /// Codes of the bridges of drive and pre-tightener; 0 if there were none.
    pub bridges: [u16; 2],
    /// What else there was.
    pub flags: Flags,
}

/// What a tick was given and gave beside codes and state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(u16);

impl Flags {
    const COMMAND: u16 = 0b111;
    const PLAN: u16 = 1 << 3;
    const OVERRUN: u16 = 1 << 4;
    const EMERGENCY: u16 = 1 << 5;
    const REQUEST: u16 = 1 << 6;
    const REARM: u16 = 1 << 7;
    const DRIVE: u16 = 1 << 8;
    const PRELOAD: u16 = 1 << 9;
    const EVENTS: u32 = 10;
    const MOST_EVENTS: u16 = 0b1111;
    const READBACK: u16 = 1 << 14;

    fn of(input: &Input, output: &Output) -> Self {
        let bit = |set: bool, bit: u16| if set { bit } else { 0 };
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
                | (output.events.len() as u16) << Self::EVENTS,
        )
    }

    /// Flags from their bits.
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }

    /// Their bits.
    pub const fn to_bits(self) -> u16 {
        self.0
    }

    const fn has(self, bit: u16) -> bool {
        self.0 & bit != 0
    }

    /// The command that the tick was given.
    pub fn command(self) -> Option<Command> {
        codes::command((self.0 & Self::COMMAND) as u8)
    }

    /// The tick was given a plan.
    pub const fn plan(self) -> bool {
        self.has(Self::PLAN)
    }

    /// It began more than a period late.
    pub const fn overrun(self) -> bool {
        self.has(Self::OVERRUN)
    }

    /// The emergency stop had cut the bridges.
    pub const fn emergency_stop(self) -> bool {
        self.has(Self::EMERGENCY)
    }

    /// It asked for a plan.
    pub const fn request(self) -> bool {
        self.has(Self::REQUEST)
    }

    /// It gave the bridges their power back.
    pub const fn rearm(self) -> bool {
        self.has(Self::REARM)
    }

    /// The drive's bridge is on.
    pub const fn drive(self) -> bool {
        self.has(Self::DRIVE)
    }

    /// The pre-tightener's bridge is on.
    pub const fn preload(self) -> bool {
        self.has(Self::PRELOAD)
    }

    /// It was given what the bridges put out.
    pub const fn readback(self) -> bool {
        self.has(Self::READBACK)
    }

    /// Log entries that it gave.
    pub const fn events(self) -> u16 {
        self.0 >> Self::EVENTS & Self::MOST_EVENTS
    }
}

impl Record {
    /// The record of a tick.
    pub fn of(input: &Input, output: &Output) -> Self {
        let SensorFrame { wheel_encoder, preload_sensor, compression_sensor, arm_angle, bridges } =
            &input.sensors;
        let sensors = [
            pack(input.now, wheel_encoder.as_ref(), EncoderCount::get),
            pack(input.now, preload_sensor.as_ref(), AdcCode::get),
            pack(input.now, compression_sensor.as_ref(), AdcCode::get),
            pack(input.now, arm_angle.as_ref(), AngleFrame::get),
        ];
        let bridges = bridges.unwrap_or_default();
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

    /// The codes with their times. A code older than 245 ticks does not tell when it was
    /// taken: it is then the one of the tick `before`.
    pub fn sensors(&self, before: &SensorFrame) -> SensorFrame {
        let [wheel, preload_sensor, compression_sensor, arm] = [0, 1, 2, 3].map(|sensor| {
            let taken = match self.ages[sensor] {
                NEVER => return None,
                OLD => None,
                age => Some(self.at().wrapping_add(NOW).wrapping_sub(u32::from(age))),
            };
            Some((self.codes[sensor], taken))
        });
        let oldest = self.at().wrapping_add(NOW).wrapping_sub(u32::from(OLD));
        SensorFrame {
            wheel_encoder: unpack(wheel, before.wheel_encoder, EncoderCount::new, oldest),
            preload_sensor: unpack(preload_sensor, before.preload_sensor, AdcCode::new, oldest),
            compression_sensor: unpack(
                compression_sensor,
                before.compression_sensor,
                AdcCode::new,
                oldest,
            ),
            arm_angle: unpack(arm, before.arm_angle, AngleFrame::new, oldest),
            bridges: self.flags.readback().then(|| {
                let [drive, pretightener] = self.bridges.map(BridgeCode::new);
                BridgeCodes { drive, pretightener }
            }),
        }
    }

    /// What the tick was given, apart from the plan; `before` as for
    /// [`Record::sensors`].
    pub fn input(&self, before: &SensorFrame) -> Input {
        Input {
            now: self.at(),
            sensors: self.sensors(before),
            command: self.flags.command(),
            plan: None,
            overrun: self.flags.overrun(),
            emergency_stop: self.flags.emergency_stop(),
        }
    }

    /// What the drive's bridge was told.
    pub fn drive(&self) -> MotorCommand {
        MotorCommand { duty: self.telemetry.drive, enable: self.flags.drive() }
    }

    /// What the pre-tightener's bridge was told.
    pub fn preload(&self) -> MotorCommand {
        MotorCommand { duty: self.telemetry.pretightener, enable: self.flags.preload() }
    }

    /// A record of nothing.
    pub const EMPTY: Self = Self {
        telemetry: Telemetry::EMPTY,
        codes: [0; 4],
        ages: [0; 4],
        bridges: [0; 2],
        flags: Flags(0),
    };
}

/// Code and age of a sample as they travel.
fn pack<T: Copy>(now: Tick, sample: Option<&Sample<T>>, code: impl Fn(T) -> u16) -> (u16, u8) {
    let Some(sample) = sample else { return (0, NEVER) };
    let age = now.wrapping_sub(sample.at).wrapping_add(NOW);
    (code(sample.code), if age < u32::from(OLD) { age as u8 } else { OLD })
}

fn unpack<T>(
    packed: Option<(u16, Option<Tick>)>,
    before: Option<Sample<T>>,
    code: impl Fn(u16) -> T,
    oldest: Tick,
) -> Option<Sample<T>> {
    let (bits, taken) = packed?;
    let at = taken.or(before.map(|sample| sample.at)).unwrap_or(oldest);
    Some(Sample { code: code(bits), at })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::supervise::Mode;
    use crate::units::{Duty, Q16};
    use proptest::prelude::*;

    /// Any record that a tick can leave.
    pub(in crate::log) fn any_record() -> impl Strategy<Value = Record> {
        let quantities = any::<[i32; Telemetry::COLUMNS.len()]>();
        (
            (any::<u32>(), 0..18_usize, 1..=6_u8, any::<u8>(), quantities, any::<[i16; 2]>()),
            (any::<[u16; 4]>(), any::<[u8; 4]>(), any::<[u16; 2]>(), 0..1_u16 << 15),
        )
            .prop_map(
                |((at, mode, stage, level, q, duties), (codes, ages, bridges, flags))| {
                    let [drive, pretightener] = duties.map(Duty::from_bits);
                    let mode = Mode::WITHOUT_FAULT[mode];
                    let stage = codes::stage(stage).unwrap();
                    let state = Telemetry {
                        at,
                        mode,
                        stage,
                        level,
                        drive,
                        pretightener,
                        ..Telemetry::EMPTY
                    };
                    let telemetry = state.with_quantities(q.map(Q16::from_bits));
                    Record { telemetry, codes, ages, bridges, flags: Flags::from_bits(flags) }
                },
            )
    }

    fn sample<T>(code: T, at: Tick) -> Option<Sample<T>> {
        Some(Sample { code, at })
    }

    proptest! {
        #[test]
        fn what_a_tick_was_given_comes_back(
            now in any::<u32>(),
            codes in any::<[u16; 4]>(),
            ages in prop::array::uniform4(prop::option::of(-8..=245_i32)),
            command in prop::option::of(0..4_usize),
            bridges in prop::option::of(any::<[u16; 2]>()),
            overrun in any::<bool>(),
            emergency_stop in any::<bool>(),
        ) {
            let at = |sensor: usize| ages[sensor].map(|age| now.wrapping_sub(age as u32));
            let sensors = SensorFrame {
                wheel_encoder: at(0).and_then(|at| sample(EncoderCount::new(codes[0]), at)),
                preload_sensor: at(1).and_then(|at| sample(AdcCode::new(codes[1]), at)),
                compression_sensor: at(2).and_then(|at| sample(AdcCode::new(codes[2]), at)),
                arm_angle: at(3).and_then(|at| sample(AngleFrame::new(codes[3]), at)),
                bridges: bridges.map(|codes| BridgeCodes {
                    drive: BridgeCode::new(codes[0]),
                    pretightener: BridgeCode::new(codes[1]),
                }),
            };
            let command = command.map(|index| Command::ALL[index]);
            let input =
                Input { now, sensors, command, plan: None, overrun, emergency_stop };
            let output = Output {
                telemetry: Telemetry { at: now, ..Telemetry::default() },
                ..Output::default()
            };
            let back = Record::of(&input, &output).input(&SensorFrame::default());
            prop_assert_eq!(back.sensors, input.sensors);
            prop_assert_eq!((back.now, back.command), (now, command));
            prop_assert_eq!((back.overrun, back.emergency_stop), (overrun, emergency_stop));
        }

        #[test]
        fn a_code_too_old_to_tell_keeps_its_time(now in 1000..u32::MAX, age in 246..900_u32) {
            let old = sample(AdcCode::new(7), now - age);
            let frame = SensorFrame { compression_sensor: old, ..SensorFrame::default() };
            let input = Input { now, sensors: frame, ..Input::default() };
            let output = Output {
                telemetry: Telemetry { at: now, ..Telemetry::default() },
                ..Output::default()
            };
            let record = Record::of(&input, &output);
            prop_assert_eq!(record.sensors(&frame), frame);
            // Without a tick before, it is at least old.
            let alone = record.sensors(&SensorFrame::default()).compression_sensor.unwrap();
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
        assert!(record.flags.rearm() && !record.flags.request() && !record.flags.plan());
        assert_eq!(record.flags.events(), 0);
    }
}
