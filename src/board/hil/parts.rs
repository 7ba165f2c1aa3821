//! The parts of the board that the host stands in for.

use embassy_stm32::gpio::{AnyPin, Level, Output, Speed};
use embassy_stm32::{Peri, Peripherals};
use interstage::hal::hil::Given;
use interstage::hal::{AnalogInput, AngleBus, CommandSource, Motors, Parts, WheelEncoder};
use interstage::sense::raw::{AdcCode, AngleFrame, BridgeCodes, BusFault, EncoderCount};
use interstage::supervise::Command;
use interstage::units::MotorCommand;
use rtt_target::DownChannel;

use super::desk::DESK;
use crate::board::rtt::Frames;
use crate::board::{Console, Guard, Lamp, Lines, Nucleo, Pages};

/// The wheel's counter.
pub(crate) struct Wheel;

impl WheelEncoder for Wheel {
    fn count(&mut self) -> EncoderCount {
        EncoderCount::new(DESK.given().wheel_encoder)
    }
}

/// The preload sensor.
pub(crate) type PreloadSensor = Analog;

/// The compression sensor.
pub(crate) type CompressionSensor = Analog;

/// One of the two analogue sensors.
pub(crate) struct Analog(fn(&Given) -> Option<u16>);

impl AnalogInput for Analog {
    async fn sample(&mut self) -> Result<AdcCode, BusFault> {
        (self.0)(&DESK.given()).map(AdcCode::new).ok_or(BusFault::Timeout)
    }
}

/// The arm's angle sensor.
pub(crate) struct Angle;

impl AngleBus for Angle {
    async fn frame(&mut self) -> Result<AngleFrame, BusFault> {
        DESK.given().arm_angle.map(AngleFrame::new).ok_or(BusFault::Timeout)
    }
}

/// The host's bridges, and the pins of the real ones, which are held low.
pub(crate) struct Bridges {
    _low: [Output<'static>; 6],
}

impl Motors for Bridges {
    fn apply(&mut self, drive: MotorCommand, preload: MotorCommand) {
        DESK.apply(drive, preload);
    }

    fn readback(&mut self) -> Option<BridgeCodes> {
        DESK.given().readback()
    }

    fn stopped(&mut self) -> bool {
        DESK.is_cut()
    }

    fn rearm(&mut self) {
        DESK.rearm();
    }
}

/// The host's operator.
pub(crate) struct Button;

impl CommandSource for Button {
    async fn next(&mut self) -> Command {
        DESK.pressed.wait().await
    }
}

/// Who gets what: the host's parts and the real ones that are left.
pub(crate) fn split(
    p: Peripherals,
    console: DownChannel,
    frames: Frames,
) -> (Parts<Nucleo>, Peri<'static, AnyPin>, Pages) {
    // PWM, direction and enable of the drive, then of the pre-tightener.
    let pins: [Peri<'static, AnyPin>; 6] =
        [p.PA8.into(), p.PA9.into(), p.PA10.into(), p.PC6.into(), p.PC8.into(), p.PC9.into()];
    let parts = Parts {
        wheel_encoder: Wheel,
        preload_sensor: Analog(|given| given.preload_sensor),
        compression_sensor: Analog(|given| given.compression_sensor),
        arm_angle: Angle,
        motors: Bridges { _low: pins.map(|pin| Output::new(pin, Level::Low, Speed::Low)) },
        watchdog: Guard::new(p.IWDG),
        button: Button,
        console: Console::new(console),
        journal: Lines::new(frames),
        light: Lamp,
    };
    (parts, p.PA5.into(), Pages::new(p.FLASH))
}
