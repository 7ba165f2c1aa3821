//! The angle sensor on its bus: an AS5048A.
//!
//! Source: ams, AS5048A/AS5048B data sheet, SPI interface and registers. Each frame carries the
//! answer to the command of the frame before. An error in a command (parity, number of clocks,
//! unknown register) raises the error flag of all later answers, until the error register is
//! read: that read's own answer still has the flag, with the register's content.

use super::Frame;
use hil_sim::plant::sensors::with_parity;

/// Of a command: read, at this address.
const READ: u16 = 1 << 14;
const ADDRESS: u16 = 0x3FFF;
/// The error flag of an answer.
const ERROR: u16 = 1 << 14;
/// Bits of a frame without parity and flag.
const DATA: u16 = 0x3FFF;

/// Registers.
const NOP: u16 = 0;
const ERRORS: u16 = 0x0001;
const DIAGNOSTICS: u16 = 0x3FFD;
const MAGNITUDE: u16 = 0x3FFE;
const ANGLE: u16 = 0x3FFF;

/// Of the error register: number of clocks, unknown command, parity.
const FRAMING: u16 = 1;
const INVALID: u16 = 1 << 1;
const PARITY: u16 = 1 << 2;

/// Of the diagnostics: offset compensation finished, field too weak, and the gain, which is
/// greatest in the weakest field.
const COMPENSATED: u16 = 1 << 8;
const TOO_WEAK: u16 = 1 << 11;
const GAIN: u16 = 0xFF;

/// Fastest clock that it takes, core cycles in a bit: 10 MHz.
const FASTEST: u64 = 17;
/// Frame on an open line with its pull-up.
const PULLED_UP: u16 = 0xFFFF;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AngleSensor {
    /// The frame of the present angle, with parity and flag.
    pub angle: u16,
    /// Bits inverted on the line to the board.
    pub bit_errors: u16,
    /// The line to the board is broken.
    pub lost: bool,
    /// The sensor misses a clock edge of the next frame.
    pub disturbed: bool,
    /// Diagnostics and automatic gain.
    diagnostics: u16,
    errors: u16,
    answer: u16,
}

impl Default for AngleSensor {
    fn default() -> Self {
        Self {
            angle: 0,
            bit_errors: 0,
            lost: false,
            disturbed: false,
            diagnostics: COMPENSATED | 0x80,
            errors: 0,
            answer: 0,
        }
    }
}

impl AngleSensor {
    /// Takes the magnet away, or brings it back.
    pub(crate) fn set_magnet(&mut self, there: bool) {
        self.diagnostics = if there { COMPENSATED | 0x80 } else { COMPENSATED | TOO_WEAK | GAIN };
    }

    /// The board was reset in the middle of a frame: the select line rose too early.
    pub(crate) fn cut_off(&mut self) {
        self.errors |= FRAMING;
    }

    /// Power comes back: a sensor without errors, in the same place.
    pub fn power_up(&mut self) {
        (self.errors, self.answer) = (0, 0);
    }

    /// Exchanges a frame; `selected` says whether its select line was low throughout.
    pub fn exchange(&mut self, frame: Frame, selected: bool) -> u16 {
        if !selected || self.lost {
            return PULLED_UP;
        }
        let sent = self.answer;
        // A master that samples on the other edge sees every bit one place later; one with too
        // fast a clock reads zero.
        let sent = match (frame.mode, frame.bit_cycles >= FASTEST) {
            (1, true) => sent,
            (_, true) => sent >> 1,
            (_, false) => 0,
        };
        let misses = std::mem::take(&mut self.disturbed);
        self.answer = self.take(frame, misses);
        sent ^ self.bit_errors
    }

    /// Takes a command; returns the answer of the next frame.
    fn take(&mut self, frame: Frame, misses: bool) -> u16 {
        let command = frame.sent;
        let data = if frame.bits != 16 || misses {
            self.errors |= FRAMING;
            0
        } else if command.count_ones() & 1 != 0 {
            self.errors |= PARITY;
            0
        } else {
            match (command & READ, command & ADDRESS) {
                (_, NOP) => 0,
                (READ, ERRORS) => {
                    let errors = std::mem::take(&mut self.errors);
                    return with_parity(errors | if errors == 0 { 0 } else { ERROR });
                }
                (READ, DIAGNOSTICS) => self.diagnostics,
                (READ, MAGNITUDE) => 0x1000,
                // With the frame's own parity, which a test may have spoilt.
                (READ, ANGLE) if self.errors == 0 => return self.angle,
                (READ, ANGLE) => self.angle & DATA,
                // Programming of the zero is not modelled.
                _ => {
                    self.errors |= INVALID;
                    0
                }
            }
        };
        with_parity(data | if self.errors == 0 { 0 } else { ERROR })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const READ_ANGLE: Frame = Frame { sent: 0xFFFF, bits: 16, mode: 1, bit_cycles: 32 };
    /// Reads the error register.
    const CLEAR: Frame = Frame { sent: 0x4001, ..READ_ANGLE };

    fn sensor() -> AngleSensor {
        AngleSensor { angle: with_parity(0x1234), ..AngleSensor::default() }
    }

    #[test]
    fn the_answer_comes_with_the_next_frame() {
        let mut sensor = sensor();
        assert_eq!(sensor.exchange(READ_ANGLE, true), 0);
        sensor.angle = with_parity(0x2345);
        assert_eq!(sensor.exchange(READ_ANGLE, true), with_parity(0x1234));
        assert_eq!(sensor.exchange(READ_ANGLE, true), with_parity(0x2345));
    }

    #[test]
    fn not_selected_it_leaves_the_line_to_the_pull_up() {
        let mut sensor = sensor();
        assert_eq!(sensor.exchange(READ_ANGLE, false), PULLED_UP);
        assert_eq!(sensor.exchange(READ_ANGLE, true), 0, "nor did it hear the command");
    }

    #[test]
    fn an_error_raises_the_flag_until_the_error_register_is_read() {
        let odd = |sensor: &mut AngleSensor| {
            sensor.exchange(Frame { sent: 0x7FFF, ..READ_ANGLE }, true);
        };
        let short = |sensor: &mut AngleSensor| {
            sensor.exchange(Frame { bits: 8, ..READ_ANGLE }, true);
        };
        let unknown = |sensor: &mut AngleSensor| {
            sensor.exchange(Frame { sent: 0x4002, ..READ_ANGLE }, true);
        };
        let cut = |sensor: &mut AngleSensor| sensor.cut_off();
        type Cause = fn(&mut AngleSensor);
        let causes: [(Cause, u16); 4] =
            [(odd, PARITY), (short, FRAMING), (unknown, INVALID), (cut, FRAMING)];
        for (cause, register) in causes {
            let mut sensor = sensor();
            cause(&mut sensor);
            sensor.exchange(READ_ANGLE, true);
            for _ in 0..5 {
                let answer = sensor.exchange(READ_ANGLE, true);
                assert_eq!(answer, with_parity(ERROR | 0x1234), "the flag stays");
            }
            sensor.exchange(CLEAR, true);
            assert_eq!(sensor.exchange(READ_ANGLE, true), with_parity(ERROR | register));
            assert_eq!(sensor.exchange(READ_ANGLE, true), with_parity(0x1234));
        }
    }

    #[test]
    fn its_diagnostics_tell_of_a_missing_magnet() {
        let read = Frame { sent: 0x7FFD, ..READ_ANGLE };
        let mut sensor = sensor();
        sensor.exchange(read, true);
        assert_eq!(sensor.exchange(read, true) & DATA, COMPENSATED | 0x80);
        sensor.set_magnet(false);
        sensor.exchange(read, true);
        assert_eq!(sensor.exchange(read, true) & DATA, COMPENSATED | TOO_WEAK | GAIN);
    }

    #[test]
    fn a_wrong_mode_or_clock_does_not_read_the_angle() {
        for frame in [Frame { mode: 0, ..READ_ANGLE }, Frame { bit_cycles: 16, ..READ_ANGLE }] {
            let mut sensor = sensor();
            sensor.exchange(READ_ANGLE, true);
            assert_ne!(sensor.exchange(frame, true) & DATA, 0x1234);
        }
    }
}
