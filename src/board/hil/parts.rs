//! The parts of the board that the host replaces.

use embassy_stm32::gpio::{AnyPin, Level, Output, Speed};
use embassy_stm32::{Peri, Peripherals};
use interstage::hal::{AnalogInput, AngleBus, CommandSource, Motors, WheelEncoder};
use interstage::sense::raw::{AdcCode, AngleFrame, BridgeCodes, BusFault, EncoderCount, SensorId};
use interstage::supervise::Command;
use interstage::units::MotorCommand;
use rtt_target::DownChannel;

use super::host_io::{self, PRESSED};
use crate::board::rtt::Frames;
use crate::board::{Console, Guard, Lamp, ParameterFlash, Parts, TextLog};

pub(crate) struct Wheel;

impl WheelEncoder for Wheel {
    fn count(&mut self) -> EncoderCount {
        EncoderCount::new(host_io::get().given.wheel_encoder)
    }
}

/// A sensor of [`SensorId::ANALOG`].
pub(crate) struct Analog(SensorId);

impl AnalogInput for Analog {
    async fn sample(&mut self) -> Result<AdcCode, BusFault> {
        host_io::get().given.code(self.0).map(AdcCode::new).ok_or(BusFault::Timeout)
    }
}

pub(crate) struct Angle;

impl AngleBus for Angle {
    async fn frame(&mut self) -> Result<AngleFrame, BusFault> {
        let frame = host_io::get().given.code(SensorId::ArmAngle);
        frame.map(AngleFrame::new).ok_or(BusFault::Timeout)
    }
}

pub(crate) struct Bridges;

impl Motors for Bridges {
    fn apply(&mut self, drive: MotorCommand, preload: MotorCommand) {
        host_io::change(|io| io.commands = (drive, preload));
    }

    fn readback(&mut self) -> Option<BridgeCodes> {
        host_io::get().given.readback()
    }

    fn stopped(&mut self) -> bool {
        host_io::get().cut
    }

    fn rearm(&mut self) {
        host_io::change(|io| io.cut &= io.given.stop);
    }
}

/// The host's operator.
pub(crate) struct Button;

impl CommandSource for Button {
    async fn next(&mut self) -> Command {
        PRESSED.wait().await
    }
}

/// Assigns the host's parts and the real ones that are left.
pub(crate) fn split(
    p: Peripherals,
    console: DownChannel,
    frames: Frames,
) -> (Parts, Peri<'static, AnyPin>, ParameterFlash) {
    // PWM, direction and enable of the drive, then of the pre-tightener.
    let pins: [Peri<'static, AnyPin>; 6] =
        [p.PA8.into(), p.PA9.into(), p.PA10.into(), p.PC6.into(), p.PC8.into(), p.PC9.into()];
    // Held low.
    core::mem::forget(pins.map(|pin| Output::new(pin, Level::Low, Speed::Low)));
    let parts = Parts {
        wheel_encoder: Wheel,
        analog: SensorId::ANALOG.map(Analog),
        arm_angle: Angle,
        motors: Bridges,
        watchdog: Guard::new(p.IWDG, p.TIM7),
        button: Button,
        console: Console(console),
        journal: TextLog::new(frames),
        light: Lamp,
    };
    (parts, p.PA5.into(), ParameterFlash::new(p.FLASH))
}
