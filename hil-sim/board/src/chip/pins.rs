//! The chip's pins as they are wired on the board (docs/HARDWARE.md), and the bridges at them.

use interstage::sense::raw::SensorId;

/// A pin: port (0 is A) and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pin(pub(super) usize, pub(super) u32);

impl Pin {
    /// Emergency stop of the drive's timer: high is open.
    pub const STOP_DRIVE: Self = Self(1, 12);
    /// Emergency stop of the pre-tightener's timer: high is open.
    pub const STOP_PRELOAD: Self = Self(1, 7);
    /// Button: high is pressed.
    pub const BUTTON: Self = Self(2, 13);
    pub const LIGHT: Self = Self(0, 5);
    /// Select line of the angle sensor: low selects.
    pub(super) const SELECT: Self = Self(1, 10);
}

/// Pins with an external level at power-up, by port, and the levels: emergency stop closed,
/// button released.
pub(super) const OUTSIDE: [(u32, u32); 7] =
    [(0, 0), (1 << 12 | 1 << 7, 0), (1 << 13, 0), (0, 0), (0, 0), (0, 0), (0, 0)];

/// A pin with the number of its alternate function.
pub(super) type Carried = (Pin, u32);

/// Lines of the wheel encoder at TIM5.
pub(super) const WHEEL: [Carried; 2] = [(Pin(0, 0), 2), (Pin(0, 1), 2)];
/// Lines of the angle sensor at SPI1: clock, to the board, from the board.
pub(super) const ANGLE: [Carried; 3] = [(Pin(1, 3), 5), (Pin(0, 6), 5), (Pin(0, 7), 5)];
/// Sensors at analogue inputs.
pub(super) const SENSORS: usize = SensorId::ANALOG.len();
/// Analogue inputs of the sensors, then of the bridges: pin, converter (0 is ADC1) and its channel.
pub(super) const ANALOG: [(Pin, usize, usize); SENSORS + 2] =
    [(Pin(2, 2), 0, 8), (Pin(2, 3), 1, 9), (Pin(1, 0), 2, 12), (Pin(1, 1), 2, 1)];

/// Wiring of a motor's bridge.
pub(super) struct Wired {
    pub(super) pwm: Carried,
    pub(super) forward: Pin,
    pub(super) enable: Pin,
    pub(super) stop: Carried,
}

/// Drive and pre-tightener.
pub(super) const BRIDGES: [Wired; 2] = [
    Wired {
        pwm: (Pin(0, 8), 6),
        forward: Pin(0, 9),
        enable: Pin(0, 10),
        stop: (Pin::STOP_DRIVE, 6),
    },
    Wired {
        pwm: (Pin(2, 6), 4),
        forward: Pin(2, 8),
        enable: Pin(2, 9),
        stop: (Pin::STOP_PRELOAD, 5),
    },
];

/// Mean command of a bridge over some time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motor {
    /// Mean signed duty, -1 to 1, over the time in which the bridge was enabled.
    pub duty: f64,
    /// Part of the time in which the bridge was enabled.
    pub enabled: f64,
}

/// A bridge's lines, integrated over time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bridge {
    /// Its lines at present.
    lines: Lines,
    since: u64,
    /// Cycles for which its timer was high up to then.
    high: u64,
    /// Integrals since `from`: signed cycles of a PWM that is high, and cycles enabled.
    driven: i64,
    enabled: u64,
    from: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lines {
    /// The PWM line is the timer's; else it is high or low.
    pub(super) timed: bool,
    pub(super) high: bool,
    pub(super) forward: bool,
    pub(super) on: bool,
}

impl Bridge {
    /// Books up to `now`, when the timer was high for so many cycles since its start; the lines
    /// are others from then on.
    pub(super) fn set(&mut self, lines: Lines, high: u64, now: u64) {
        let cycles = now.saturating_sub(self.since);
        if self.lines.on {
            let constant = if self.lines.high { cycles } else { 0 };
            let driven = if self.lines.timed { high.wrapping_sub(self.high) } else { constant };
            self.driven += if self.lines.forward { driven as i64 } else { -(driven as i64) };
            self.enabled += cycles;
        }
        (self.lines, self.high, self.since) = (lines, high, now);
    }

    /// Books up to a reset, which starts its timer over.
    pub(super) fn reset(&mut self, high: u64, now: u64) {
        self.set(self.lines, high, now);
        self.high = 0;
    }

    pub(super) fn take(&mut self, high: u64, now: u64) -> Motor {
        self.set(self.lines, high, now);
        let cycles = now.saturating_sub(self.from).max(1);
        let motor = Motor {
            duty: if self.enabled == 0 { 0.0 } else { self.driven as f64 / self.enabled as f64 },
            enabled: self.enabled as f64 / cycles as f64,
        };
        (self.driven, self.enabled, self.from) = (0, 0, now);
        motor
    }
}
