//! What outlives a restart: why the program was stopped, and what the drive was doing.
//!
//! The board keeps it as words in memory that no start clears. After power was lost they
//! hold anything, so that each record carries a check of its own; a record that is not
//! whole is none. What the drive does is kept every tick, in two places by turns, so that
//! a reset in the middle of writing leaves the tick before.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::log::{Telemetry, number};
use crate::supervise::Mode;
use crate::units::{Millimetres, Q16, Tick};

/// Words of a [`Flight`].
pub const FLIGHT_WORDS: usize = 5;

/// Words of a [`Crash`].
pub const CRASH_WORDS: usize = 7;

/// Who had not come when the watchdog was no longer fed, one bit a task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Late(u16);

impl Late {
    /// Everyone is there.
    pub const NOBODY: Self = Self(0);
    /// The control tick began and did not end.
    pub const TICK: Self = Self(1 << 14);
    /// The control tick was not reached: something more urgent keeps the processor.
    pub const STARVED: Self = Self(1 << 15);

    /// Names by bit; those between are operators' tasks and the host's line, in the order
    /// in which they began.
    const NAMES: [&'static str; 6] =
        ["speed", "pressure", "displacement", "angle", "model", "journal"];

    /// The task of this station, by [`Station`](crate::tasks::Station).
    #[must_use]
    pub(crate) const fn station(index: usize) -> Self {
        Self(1 << (index & 0xF))
    }

    /// Both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether everyone is there.
    #[must_use]
    pub const fn is_nobody(self) -> bool {
        self.0 == 0
    }

    /// The last alone, if there is one.
    #[must_use]
    pub(crate) fn last(self) -> Option<Self> {
        Some(Self(1 << self.0.checked_ilog2()?))
    }

    /// The bits.
    #[must_use]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// From the bits.
    #[must_use]
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }

    /// Name of the first.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self.0.trailing_zeros() as usize {
            16 => "nobody",
            15 => "the control tick, kept from the processor",
            14 => "the control tick",
            bit => Self::NAMES.get(bit).copied().unwrap_or("an operator's task or the host's line"),
        }
    }
}

/// What the drive was doing in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Flight {
    /// The tick.
    pub tick: Tick,
    /// Estimated axial position, mm.
    pub position: Millimetres,
    /// Mode, by [`number::mode`].
    pub mode: u8,
    /// Sleeve level.
    pub level: u8,
    /// Code of the last fault since the start, 0 for none.
    pub fault: u16,
    /// Who had not come.
    pub late: Late,
}

impl Flight {
    /// What it is known by.
    const SEED: u32 = 0xF11E_0001;

    /// As words.
    #[must_use]
    pub fn seal(&self) -> [u32; FLIGHT_WORDS] {
        let state = u32::from(self.mode) | u32::from(self.level) << 8 | u32::from(self.fault) << 16;
        let late = u32::from(self.late.bits());
        let [a, b, c, d] = [self.tick, self.position.to_bits() as u32, state, late];
        [a, b, c, d, check(Self::SEED, &[a, b, c, d])]
    }

    /// From words, if they are whole.
    #[must_use]
    pub fn open(words: &[u32; FLIGHT_WORDS]) -> Option<Self> {
        let [tick, position, state, late, sum] = *words;
        (check(Self::SEED, &[tick, position, state, late]) == sum).then_some(Self {
            tick,
            position: Q16::from_bits(position as i32),
            mode: state as u8,
            level: (state >> 8) as u8,
            fault: (state >> 16) as u16,
            late: Late::from_bits(late as u16),
        })
    }

    /// The mode; none if the number has no meaning.
    #[must_use]
    pub fn mode(&self) -> Option<Mode> {
        number::mode(self.mode)
    }
}

/// The later of two.
#[must_use]
pub fn later(one: Option<Flight>, other: Option<Flight>) -> Option<Flight> {
    match (one, other) {
        (Some(a), Some(b)) if b.tick.wrapping_sub(a.tick) as i32 > 0 => Some(b),
        (Some(a), _) => Some(a),
        (None, b) => b,
    }
}

/// Gathers from tick to tick what a [`Flight`] says.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recorder {
    /// Mode of the latest row, and its number.
    mode: Mode,
    number: u8,
    fault: u16,
}

impl Recorder {
    /// What is to be kept of a tick.
    pub fn flight(&mut self, row: &Telemetry, late: Late) -> Flight {
        if row.mode != self.mode {
            self.mode = row.mode;
            self.number = number::of_mode(row.mode);
            if let Mode::FaultHold(fault) = row.mode {
                self.fault = fault.code();
            }
        }
        Flight {
            tick: row.at,
            position: row.position,
            mode: self.number,
            level: row.level,
            fault: self.fault,
            late,
        }
    }
}

/// What stopped the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stopped {
    /// A panic: where in flash the image says from where, and the line.
    Panic {
        /// Address of the place's description in the image.
        place: u32,
        /// Line in the source.
        line: u32,
    },
    /// A hard fault.
    Fault {
        /// Instruction that faulted, 0 if the stack does not tell.
        pc: u32,
        /// Where it would have returned to, 0 likewise.
        lr: u32,
        /// Configurable fault status.
        cfsr: u32,
        /// Hard fault status.
        hfsr: u32,
    },
    /// The watchdog was no longer fed.
    Hang {
        /// Where the processor was.
        pc: u32,
        /// Where that would have returned to.
        lr: u32,
        /// Who had not come.
        late: Late,
    },
}

/// The last words of a program that was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crash {
    /// First word of the image's hash, by which its addresses are known.
    pub build: u32,
    /// What stopped it.
    pub stopped: Stopped,
}

impl Crash {
    /// What it is known by.
    const SEED: u32 = 0xF11E_0002;

    /// As words.
    #[must_use]
    pub fn seal(&self) -> [u32; CRASH_WORDS] {
        let (kind, [a, b, c, d]) = match self.stopped {
            Stopped::Panic { place, line } => (1, [place, line, 0, 0]),
            Stopped::Fault { pc, lr, cfsr, hfsr } => (2, [pc, lr, cfsr, hfsr]),
            Stopped::Hang { pc, lr, late } => (3, [pc, lr, u32::from(late.bits()), 0]),
        };
        let build = self.build;
        [kind, build, a, b, c, d, check(Self::SEED, &[kind, build, a, b, c, d])]
    }

    /// From words, if they are whole.
    #[must_use]
    pub fn open(words: &[u32; CRASH_WORDS]) -> Option<Self> {
        let [kind, build, a, b, c, d, sum] = *words;
        let stopped = match kind {
            1 => Stopped::Panic { place: a, line: b },
            2 => Stopped::Fault { pc: a, lr: b, cfsr: c, hfsr: d },
            3 => Stopped::Hang { pc: a, lr: b, late: Late::from_bits(c as u16) },
            _ => return None,
        };
        let whole = check(Self::SEED, &[kind, build, a, b, c, d]) == sum;
        whole.then_some(Self { build, stopped })
    }
}

/// What the chip says about why it started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reset {
    /// Power came up, or fell too low and came back.
    Power,
    /// The reset pin.
    Pin,
    /// The program or a debugger asked for it.
    Software,
    /// The watchdog.
    Watchdog,
    /// Something else.
    Other,
}

impl Reset {
    /// In words.
    #[must_use]
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Power => "power came up",
            Self::Pin => "by the reset pin",
            Self::Software => "by software or debugger",
            Self::Watchdog => "by the watchdog",
            Self::Other => "for a reason that the chip does not tell",
        }
    }
}

/// What a start reports of the time before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restart {
    /// Why the chip started.
    pub reset: Reset,
    /// What the drive last did, if memory kept it.
    pub flight: Option<Flight>,
    /// What stopped the program, if something did.
    pub crash: Option<Crash>,
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Panic { place, line } => write!(f, "a panic in line {line}, place {place:#x}"),
            Self::Fault { pc, lr, cfsr, hfsr } => {
                write!(f, "a hard fault at {pc:#x} from {lr:#x}, CFSR {cfsr:#x}, HFSR {hfsr:#x}")
            }
            Self::Hang { pc, lr, late } => {
                write!(f, "{} did not come, at {pc:#x} from {lr:#x}", late.name())
            }
        }
    }
}

impl fmt::Display for Restart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "started: {}", self.reset.sentence())?;
        if let Some(crash) = &self.crash {
            write!(f, "; {}", crash.stopped)?;
        }
        if let Some(flight) = &self.flight {
            let Flight { tick, position, level, fault, late, .. } = *flight;
            match flight.mode() {
                Some(mode) => write!(f, "; before: {mode:?}")?,
                None => write!(f, "; before: mode {}", flight.mode)?,
            }
            write!(f, " at tick {tick}, {position:.2} mm, level {level}")?;
            if fault != 0 {
                write!(f, ", last fault {fault}")?;
            }
            if !late.is_nobody() {
                write!(f, ", {} was late", late.name())?;
            }
        }
        Ok(())
    }
}

/// Check of a record's words.
///
/// Each word is mixed in by steps of which every one can be undone: a change within one
/// word always shows, any other with all but one in 2^32.
fn check(seed: u32, words: &[u32]) -> u32 {
    words.iter().fold(seed, |sum, word| (sum.rotate_left(7) ^ word).wrapping_mul(0x9E37_79B1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::supervise::{Direction, Fault, Leg};
    use proptest::prelude::*;

    fn flight() -> impl Strategy<Value = Flight> {
        (any::<u32>(), any::<i32>(), any::<u8>(), any::<u8>(), any::<u16>(), any::<u16>()).prop_map(
            |(tick, position, mode, level, fault, late)| Flight {
                tick,
                position: Q16::from_bits(position),
                mode,
                level,
                fault,
                late: Late::from_bits(late),
            },
        )
    }

    fn crash() -> impl Strategy<Value = Crash> {
        (any::<u32>(), 0..3, any::<[u32; 4]>()).prop_map(|(build, kind, [a, b, c, d])| Crash {
            build,
            stopped: match kind {
                0 => Stopped::Panic { place: a, line: b },
                1 => Stopped::Fault { pc: a, lr: b, cfsr: c, hfsr: d },
                _ => Stopped::Hang { pc: a, lr: b, late: Late::from_bits(c as u16) },
            },
        })
    }

    proptest! {
        #[test]
        fn a_record_is_read_as_it_was_kept(flight in flight(), crash in crash()) {
            prop_assert_eq!(Flight::open(&flight.seal()), Some(flight));
            prop_assert_eq!(Crash::open(&crash.seal()), Some(crash));
        }

        #[test]
        fn a_word_that_changed_makes_it_none(
            flight in flight(),
            crash in crash(),
            at in any::<prop::sample::Index>(),
            change in 1_u32..,
        ) {
            let mut words = flight.seal();
            words[at.index(FLIGHT_WORDS)] ^= change;
            prop_assert_eq!(Flight::open(&words), None);
            let mut words = crash.seal();
            words[at.index(CRASH_WORDS)] ^= change;
            prop_assert_eq!(Crash::open(&words), None);
        }

        #[test]
        fn memory_that_was_never_written_is_none(
            flight in any::<[u32; FLIGHT_WORDS]>(),
            crash in any::<[u32; CRASH_WORDS]>(),
            same in any::<u8>(),
        ) {
            prop_assert_eq!(Flight::open(&flight), None);
            prop_assert_eq!(Crash::open(&crash), None);
            let same = u32::from_le_bytes([same; 4]);
            prop_assert_eq!(Flight::open(&[same; FLIGHT_WORDS]), None);
            prop_assert_eq!(Crash::open(&[same; CRASH_WORDS]), None);
        }
    }

    #[test]
    fn the_later_place_counts_also_when_the_clock_wraps() {
        let at = |tick| Some(Flight::open(&[0; 5]).unwrap_or(Flight { tick, ..EMPTY }));
        assert_eq!(later(at(7), at(8)), at(8));
        assert_eq!(later(at(8), at(7)), at(8));
        assert_eq!(later(at(u32::MAX), at(0)), at(0));
        assert_eq!(later(at(0), at(u32::MAX)), at(0));
        assert_eq!((later(None, at(3)), later(at(3), None)), (at(3), at(3)));
        assert_eq!(later(None, None), None);
    }

    const EMPTY: Flight =
        Flight { tick: 0, position: Q16::ZERO, mode: 0, level: 0, fault: 0, late: Late::NOBODY };

    #[test]
    fn the_last_fault_is_kept_beyond_its_hold() {
        let mut recorder = Recorder::default();
        let mut row =
            Telemetry { at: 5, level: 2, position: Q16::from_num(41), ..Telemetry::EMPTY };
        assert_eq!(recorder.flight(&row, Late::NOBODY).mode(), Some(Mode::Boot));
        row.mode = Mode::Run(Direction::Deploy, Leg::Crossing);
        let flight = recorder.flight(&row, Late::TICK);
        assert_eq!((flight.mode(), flight.fault), (Some(row.mode), 0));
        assert_eq!((flight.tick, flight.level, flight.position), (5, 2, row.position));
        assert_eq!(flight.late, Late::TICK);
        row.mode = Mode::FaultHold(Fault::DriveStalled);
        assert_eq!(recorder.flight(&row, Late::NOBODY).mode(), Some(row.mode));
        row.mode = Mode::Idle;
        let flight = recorder.flight(&row, Late::NOBODY);
        assert_eq!((flight.mode(), flight.fault), (Some(Mode::Idle), 122));
    }

    #[test]
    fn a_report_names_what_is_known() {
        let restart = Restart { reset: Reset::Power, flight: None, crash: None };
        assert_eq!(restart.to_string(), "started: power came up");
        let flight = Flight { tick: 9, mode: 6, level: 1, fault: 122, late: Late::TICK, ..EMPTY };
        let stopped = Stopped::Hang { pc: 16, lr: 32, late: Late::STARVED };
        let crash = Some(Crash { build: 1, stopped });
        let text = Restart { reset: Reset::Watchdog, flight: Some(flight), crash }.to_string();
        assert_eq!(
            text,
            "started: by the watchdog; the control tick, kept from the processor did not come, \
             at 0x10 from 0x20; before: Run(Deploy, Approach) at tick 9, 0.00 mm, level 1, \
             last fault 122, the control tick was late"
        );
    }

    #[test]
    fn everyone_has_a_name() {
        assert_eq!(Late::NOBODY.name(), "nobody");
        assert!(Late::NOBODY.is_nobody() && !Late::TICK.is_nobody());
        let names: std::collections::BTreeSet<_> =
            (0..16).map(|bit| Late::from_bits(1 << bit).name()).collect();
        assert_eq!(names.len(), 9, "{names:?}");
        let both = Late::TICK.and(Late::station(1));
        assert_eq!((both.name(), both.last()), ("pressure", Some(Late::TICK)));
        assert_eq!(Late::NOBODY.last(), None);
        assert_eq!(Late::STARVED.name(), "the control tick, kept from the processor");
    }
}
