//! Hardware in the loop: the protocol of a host with the plant and a board with the controller.
//!
//! The loop runs in lockstep. The host sends a tick with the sensors' codes; the board's clock
//! advances by that tick, every task that is due runs, and the bridge commands go back. Time on
//! the board is the count of ticks, however long one takes to arrive; so a run through a slow
//! probe gives the same bits as in software.
//!
//! Frames are those of the [binary line](crate::params::link), on RTT channels [`UP`] and
//! [`DOWN`].

use serde::{Deserialize, Serialize};

use crate::sense::raw::{BridgeCode, BridgeCodes, SensorId};
use crate::supervise::{Command, Mode, codes};
use crate::units::{Duty, MotorCommand, Tick};

/// RTT channel up.
pub const UP: u32 = 3;

/// RTT channel down.
pub const DOWN: u32 = 2;

/// Number of this protocol; messages of another one are not answered.
pub const PROTOCOL: u8 = 2;

/// The board's first tick; its clock begins one before. Even, so that the first tick reads the
/// angle sensor, as in software.
pub const FIRST: Tick = 2;

/// Messages of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToBoard {
    /// Begins a run, or asks for the state of the present one.
    Hello {
        /// [`PROTOCOL`].
        protocol: u8,
    },
    /// The tick of this number, and its inputs.
    Tick(Tick, Given),
}

/// Inputs of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Given {
    /// Wheel encoder's counter, which cannot fail.
    pub wheel_encoder: u16,
    /// The other sensors, by [`SensorId`]; none for one that does not answer.
    pub others: [Option<u16>; SensorId::COUNT - 1],
    /// Outputs of the bridges of drive and pre-tightener; none as above.
    pub bridges: Option<[u16; 2]>,
    /// The emergency stop's contact is open.
    pub stop: bool,
    /// Number of the operator's command, 0 for none ([`codes::of_command`]).
    pub command: u8,
}

impl Given {
    /// No sensor answers, and nothing happens.
    pub const NOTHING: Self = Self {
        wheel_encoder: 0,
        others: [None; SensorId::COUNT - 1],
        bridges: None,
        stop: false,
        command: 0,
    };

    /// Every sensor answers with these codes; nothing else happens.
    pub fn codes(
        [wheel_encoder, others @ ..]: [u16; SensorId::COUNT],
        bridges: BridgeCodes,
    ) -> Self {
        Self {
            wheel_encoder,
            others: others.map(Some),
            bridges: Some([bridges.drive.get(), bridges.pretightener.get()]),
            ..Self::NOTHING
        }
    }

    /// Code of a sensor; none for one that does not answer.
    pub fn code(&self, sensor: SensorId) -> Option<u16> {
        let wheel = [Some(self.wheel_encoder)];
        wheel.iter().chain(&self.others).nth(sensor as usize).copied().flatten()
    }

    /// The same with an operator's command, or none.
    pub const fn with(self, command: Option<Command>) -> Self {
        Self { command: codes::of_command(command), ..self }
    }

    /// The same with no sensor answering but the wheel's counter, which cannot fail.
    pub const fn silent(self) -> Self {
        Self { wheel_encoder: self.wheel_encoder, stop: self.stop, ..Self::NOTHING }
    }

    /// Output of the bridges, if it was converted.
    pub fn readback(&self) -> Option<BridgeCodes> {
        let [drive, pretightener] = self.bridges?.map(BridgeCode::new);
        Some(BridgeCodes { drive, pretightener })
    }
}

/// Messages of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToHost {
    /// Outputs of the tick of this number.
    Done(Tick, Taken),
    /// The next tick that the board takes: the answer to a hello, and to any other tick but the
    /// last.
    Next {
        /// Its number.
        tick: Tick,
        /// The host was silent for too long: the board continues alone, takes no more ticks,
        /// and has to be restarted.
        alone: bool,
    },
}

/// Outputs of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Taken {
    /// Duty of the drive, Q15; none with the bridge off.
    pub drive: Option<i16>,
    /// Duty of the pre-tightener, Q15; none with the bridge off.
    pub preload: Option<i16>,
    /// Number of the mode after the tick ([`codes::of_mode`]).
    pub mode: u8,
}

impl Taken {
    /// Outputs with these bridge commands and the number of this mode.
    pub fn new(drive: MotorCommand, preload: MotorCommand, mode: u8) -> Self {
        let duty = |command: MotorCommand| command.enable.then_some(command.duty.to_bits());
        Self { drive: duty(drive), preload: duty(preload), mode }
    }

    /// Commands of drive and pre-tightener.
    pub fn commands(&self) -> (MotorCommand, MotorCommand) {
        let command = |duty: Option<i16>| {
            duty.map_or(MotorCommand::OFF, |bits| MotorCommand::on(Duty::from_bits(bits)))
        };
        (command(self.drive), command(self.preload))
    }

    /// Mode after the tick; none if the number has no meaning.
    pub fn mode(&self) -> Option<Mode> {
        codes::mode(self.mode)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::link::{FrameReader, frame};
    use proptest::prelude::*;

    /// Room in the board's ring for a tick and a hello behind it.
    const RING: usize = 64;

    #[test]
    fn the_longest_messages_fit_the_rings() {
        let code = Some(u16::MAX);
        let given = Given {
            wheel_encoder: u16::MAX,
            others: [code; SensorId::COUNT - 1],
            bridges: Some([u16::MAX; 2]),
            stop: true,
            command: 4,
        };
        let down = [ToBoard::Tick(u32::MAX, given), ToBoard::Hello { protocol: PROTOCOL }];
        let bytes: usize = down.iter().map(|message| frame(message).unwrap().len()).sum();
        assert!(bytes < RING, "{bytes}");
        let taken = Taken { drive: Some(i16::MIN), preload: Some(i16::MIN), mode: 160 };
        let up = frame(&ToHost::Done(u32::MAX, taken)).unwrap();
        assert!(up.len() < RING, "{}", up.len());
    }

    /// What a reader makes of the message's frame.
    fn framed<T: Serialize + for<'de> Deserialize<'de>>(message: &T) -> Option<T> {
        let mut reader = FrameReader::new();
        frame(message)?.iter().find_map(|byte| reader.take(*byte))
    }

    proptest! {
        #[test]
        fn messages_come_back_from_their_frames(
            tick in any::<u32>(),
            wheel_encoder in any::<u16>(),
            others in any::<[Option<u16>; SensorId::COUNT - 1]>(),
            bridges in any::<Option<[u16; 2]>>(),
            stop in any::<bool>(),
            command in 0..5_u8,
            duties in any::<[Option<i16>; 2]>(),
        ) {
            let given = Given { wheel_encoder, others, bridges, stop, command };
            let silent = Given { wheel_encoder, stop, ..Given::default() };
            prop_assert_eq!(given.silent(), silent);
            let sent = ToBoard::Tick(tick, given);
            prop_assert_eq!(framed(&sent), Some(sent));
            let all = SensorId::ALL.map(|sensor| given.code(sensor));
            prop_assert_eq!((all[0], &all[1..]), (Some(wheel_encoder), &others[..]));
            let taken = Taken { drive: duties[0], preload: duties[1], mode: 3 };
            let sent = ToHost::Done(tick, taken);
            prop_assert_eq!(framed(&sent), Some(sent));
            let (drive, preload) = taken.commands();
            prop_assert_eq!(Taken::new(drive, preload, 3), taken);
        }
    }

    #[test]
    fn a_bridge_that_is_off_has_no_duty() {
        let off = MotorCommand { duty: Duty::from_bits(77), enable: false };
        let taken = Taken::new(off, MotorCommand::OFF, codes::of_mode(Mode::Idle));
        assert_eq!(taken.commands(), (MotorCommand::OFF, MotorCommand::OFF));
        assert_eq!(taken.mode(), Some(Mode::Idle));
    }
}
