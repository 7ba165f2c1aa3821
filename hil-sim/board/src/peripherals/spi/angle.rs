//! The angle sensor on its bus: an AS5048A.
//!
//! Source: ams, AS5048A/AS5048B data sheet, SPI interface. Each frame carries the
//! answer to the command of the frame before; a command with odd parity raises the
//! error flag of the next answer.

use super::Frame;

/// Reads the angle.
const READ_ANGLE: u16 = 0xFFFF;
/// The error flag of an answer.
const ERROR: u16 = 1 << 14;
/// Fastest clock that it takes, core cycles in a bit: 10 MHz.
const FASTEST: u64 = 17;
/// Frame on an open line with its pull-up.
const PULLED_UP: u16 = 0xFFFF;

/// The sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AngleSensor {
    /// The frame of the present angle, with parity and flag.
    pub angle: u16,
    /// Bits inverted on the line to the board.
    pub bit_errors: u16,
    /// The line to the board is broken.
    pub lost: bool,
    answer: u16,
}

impl AngleSensor {
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
        let odd = frame.bits != 16 || frame.sent.count_ones() & 1 != 0;
        self.answer = match frame.sent {
            _ if odd => with_parity(ERROR),
            READ_ANGLE => self.angle,
            // Other registers are not modelled: zero.
            _ => 0,
        };
        sent ^ self.bit_errors
    }
}

/// A frame of 15 bits with even parity on top.
fn with_parity(frame: u16) -> u16 {
    frame | ((frame.count_ones() & 1) as u16) << 15
}

#[cfg(test)]
mod tests {
    use super::*;

    const READ: Frame = Frame { sent: READ_ANGLE, bits: 16, mode: 1, bit_cycles: 32 };

    fn sensor() -> AngleSensor {
        AngleSensor { angle: 0x1234, ..AngleSensor::default() }
    }

    #[test]
    fn the_answer_comes_with_the_next_frame() {
        let mut sensor = sensor();
        assert_eq!(sensor.exchange(READ, true), 0);
        sensor.angle = 0x2345;
        assert_eq!(sensor.exchange(READ, true), 0x1234);
        assert_eq!(sensor.exchange(READ, true), 0x2345);
    }

    #[test]
    fn not_selected_it_leaves_the_line_to_the_pull_up() {
        let mut sensor = sensor();
        assert_eq!(sensor.exchange(READ, false), PULLED_UP);
        assert_eq!(sensor.exchange(READ, true), 0, "nor did it hear the command");
    }

    #[test]
    fn odd_parity_raises_the_error_flag() {
        let mut sensor = sensor();
        sensor.exchange(Frame { sent: 0x7FFF, ..READ }, true);
        let sent = sensor.exchange(READ, true);
        assert_eq!((sent & ERROR, sent.count_ones() & 1), (ERROR, 0));
    }

    #[test]
    fn a_wrong_mode_or_clock_does_not_read_the_angle() {
        for frame in [Frame { mode: 0, ..READ }, Frame { bit_cycles: 16, ..READ }] {
            let mut sensor = sensor();
            sensor.exchange(READ, true);
            assert_ne!(sensor.exchange(frame, true), 0x1234);
        }
    }
}
