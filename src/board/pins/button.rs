//! The blue button B1 as a source of commands.
//!
//! | gesture | command | given |
//! |---|---|---|
//! | short press | start | 0.4 s after release, when no second press came |
//! | two short presses | retract | at the second release |
//! | held for 1 s | stop | while still held |
//! | held on to 3 s | reset | while still held, after the stop |

use embassy_stm32::Peri;
use embassy_stm32::exti::ExtiInput;
use embassy_stm32::gpio::Level::{self, High as PRESSED, Low as RELEASED};
use embassy_stm32::gpio::Pull;
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{EXTI13, PC13};
use embassy_time::{Duration, Timer, with_timeout};
use interstage::hal::CommandSource;
use interstage::supervise::Command;

use crate::board::Irqs;

/// Time for which contacts bounce.
const BOUNCE: Duration = Duration::from_millis(20);

/// A second press within this after a release makes the two one gesture.
const DOUBLE: Duration = Duration::from_millis(400);

/// Holding for this long stops.
const STOP: Duration = Duration::from_secs(1);

/// Holding on for this much longer resets.
const RESET: Duration = Duration::from_secs(2);

/// Progress of a gesture.
#[derive(Clone, Copy)]
enum Gesture {
    /// None, or complete.
    None,
    /// Held until stop was given, not released.
    Stopped,
    /// Held until reset was given, not released.
    Reset,
}

/// B1.
pub(crate) struct Button {
    pin: ExtiInput<'static, Async>,
    gesture: Gesture,
}

impl Button {
    /// The button; on this board it connects the pin to the supply.
    pub(crate) fn new(pin: Peri<'static, PC13>, line: Peri<'static, EXTI13>) -> Self {
        Self { pin: ExtiInput::new(pin, line, Pull::Down, Irqs), gesture: Gesture::None }
    }

    /// Waits until the pin has this level and keeps it over the bounce.
    async fn settled(&mut self, level: Level) {
        loop {
            match level {
                PRESSED => self.pin.wait_for_high().await,
                RELEASED => self.pin.wait_for_low().await,
            }
            Timer::after(BOUNCE).await;
            if self.pin.get_level() == level {
                return;
            }
        }
    }
}

impl CommandSource for Button {
    async fn next(&mut self) -> Command {
        loop {
            match self.gesture {
                Gesture::None => {
                    self.settled(PRESSED).await;
                    let mut tapped = Command::Start;
                    loop {
                        if with_timeout(STOP, self.settled(RELEASED)).await.is_err() {
                            self.gesture = Gesture::Stopped;
                            return Command::Stop;
                        }
                        if tapped == Command::Retract
                            || with_timeout(DOUBLE, self.settled(PRESSED)).await.is_err()
                        {
                            return tapped;
                        }
                        tapped = Command::Retract;
                    }
                }
                Gesture::Stopped => {
                    if with_timeout(RESET, self.settled(RELEASED)).await.is_err() {
                        self.gesture = Gesture::Reset;
                        return Command::Reset;
                    }
                    self.gesture = Gesture::None;
                }
                Gesture::Reset => {
                    self.settled(RELEASED).await;
                    self.gesture = Gesture::None;
                }
            }
        }
    }
}
