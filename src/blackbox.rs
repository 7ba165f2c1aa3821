//! What outlives a restart: why the program was stopped, and what the drive was doing.
//!
//! The board keeps it as words in memory that no start clears. After power was lost they
//! hold anything, so that each record carries a check of its own; a record that is not
//! whole is none. What the drive does is kept every tick, in two places by turns, so that
//! a reset in the middle of writing leaves the tick before.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::log::{Telemetry, number};
use crate::supervise::{Fault, Mode};
use crate::units::{Millimetres, MillimetresPerSecond, Q16, Tick, ticks_to_seconds};

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

/// Reference of the speed in a tick, signed outwards, in 1/32 mm/s, and in the last bit
/// whether the position was more than a guess.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pace(i16);

impl Pace {
    /// Bits of a speed that it leaves out.
    const COARSER: u32 = 11;

    /// Of this speed, mm/s; half a metre a second counts for more.
    #[must_use]
    pub fn of(speed: MillimetresPerSecond, placed: bool) -> Self {
        let most = i32::from(i16::MAX >> 1);
        let speed = (speed.to_bits() >> Self::COARSER).clamp(-most, most);
        Self((speed << 1) as i16 | i16::from(placed))
    }

    /// The speed, mm/s.
    #[must_use]
    pub fn speed(self) -> MillimetresPerSecond {
        Q16::from_bits((i32::from(self.0) >> 1) << Self::COARSER)
    }

    /// Whether the position was more than a guess.
    #[must_use]
    pub const fn placed(self) -> bool {
        self.0 & 1 != 0
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
    /// How fast it was going, and whether the position was more than a guess.
    pub pace: Pace,
}

impl Flight {
    /// What it is known by.
    const SEED: u32 = 0xF11E_0001;

    /// As words.
    #[must_use]
    pub fn seal(&self) -> [u32; FLIGHT_WORDS] {
        let state = u32::from(self.mode) | u32::from(self.level) << 8 | u32::from(self.fault) << 16;
        let late = u32::from(self.late.bits()) | u32::from(self.pace.0 as u16) << 16;
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
            pace: Pace((late >> 16) as i16),
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
    /// What is to be kept of a tick; `placed` says that the position is more than a guess.
    pub fn flight(&mut self, row: &Telemetry, placed: bool, late: Late) -> Flight {
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
            pace: Pace::of(row.speed_ref, placed),
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
        /// When the bridges were cut.
        at: Tick,
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
            Stopped::Hang { pc, lr, late, at } => (3, [pc, lr, u32::from(late.bits()), at]),
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
            3 => Stopped::Hang { pc: a, lr: b, late: Late::from_bits(c as u16), at: d },
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

/// Where a wheel stands by the record of the run before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Axial position, mm.
    pub position: Millimetres,
    /// The bridges were off as soon as the record ends: what is added is the coasting. If
    /// not, a drive went on that nobody watched.
    pub sure: bool,
}

/// Ticks for which the wheel goes on at its speed after the record: what is left of the
/// tick, and the coasting, in which the gears take half of the speed each ms.
const COASTS: Tick = 2;

/// Ticks from the watchdog's last feeding to its reset.
const UNFED: Tick = 100;

/// Longest time without a record within which it still tells all, ticks.
const FRESH: Tick = 5;

impl Restart {
    /// Where the wheel stands, if the record tells.
    ///
    /// A reset takes the power from the bridges at once, a panic or a hard fault before it
    /// is recorded; then the wheel coasts by a tenth of a millimetre. If the tick hung, the
    /// drive went on at its last duty until the bridges were cut, or until the watchdog
    /// bit: at about the reference of the last tick, for a time that is known. After a fault
    /// that may have been one of the position it tells nothing.
    #[must_use]
    pub fn place(&self) -> Option<Place> {
        let flight = self.flight.filter(|flight| flight.pace.placed() && spared(flight.fault))?;
        let unwatched = match (self.reset, self.crash.map(|crash| crash.stopped)) {
            (_, Some(Stopped::Hang { at, .. })) => at.wrapping_sub(flight.tick).min(UNFED),
            (Reset::Watchdog, None) => UNFED,
            _ => 0,
        };
        let way = flight.pace.speed() * ticks_to_seconds(unwatched + COASTS);
        Some(Place { position: flight.position + way, sure: unwatched <= FRESH })
    }
}

/// Whether the position was to be believed although this fault was reported: none, or one
/// that has nothing to do with how the wheel's way is found.
fn spared(code: u16) -> bool {
    const OTHERS: [Fault; 11] = [
        Fault::PressureStale,
        Fault::DisplacementStale,
        Fault::PressureRange,
        Fault::DisplacementRange,
        Fault::PressureImplausible,
        Fault::DisplacementImplausible,
        Fault::Overpressure,
        Fault::PreloadNotReached,
        Fault::PretightenerRunaway,
        Fault::EmergencyStop,
        Fault::TickOverrun,
    ];
    code == 0 || OTHERS.iter().any(|fault| fault.code() == code)
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Panic { place, line } => write!(f, "a panic in line {line}, place {place:#x}"),
            Self::Fault { pc, lr, cfsr, hfsr } => {
                write!(f, "a hard fault at {pc:#x} from {lr:#x}, CFSR {cfsr:#x}, HFSR {hfsr:#x}")
            }
            Self::Hang { pc, lr, late, .. } => {
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
    use crate::supervise::{Direction, Leg};
    use proptest::prelude::*;

    fn flight() -> impl Strategy<Value = Flight> {
        let bits = (any::<u8>(), any::<u8>(), any::<u16>(), any::<u16>(), any::<i16>());
        (any::<u32>(), any::<i32>(), bits).prop_map(
            |(tick, position, (mode, level, fault, late, pace))| Flight {
                tick,
                position: Q16::from_bits(position),
                mode,
                level,
                fault,
                late: Late::from_bits(late),
                pace: Pace(pace),
            },
        )
    }

    fn crash() -> impl Strategy<Value = Crash> {
        (any::<u32>(), 0..3, any::<[u32; 4]>()).prop_map(|(build, kind, [a, b, c, d])| Crash {
            build,
            stopped: match kind {
                0 => Stopped::Panic { place: a, line: b },
                1 => Stopped::Fault { pc: a, lr: b, cfsr: c, hfsr: d },
                _ => Stopped::Hang { pc: a, lr: b, late: Late::from_bits(c as u16), at: d },
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

    const EMPTY: Flight = Flight {
        tick: 0,
        position: Q16::ZERO,
        mode: 0,
        level: 0,
        fault: 0,
        late: Late::NOBODY,
        pace: Pace(0),
    };

    #[test]
    fn a_pace_is_the_speed_to_a_32nd() {
        for (speed, placed) in [(0.0, true), (47.3, false), (-47.3, true), (-511.9, false)] {
            let pace = Pace::of(Q16::from_num(speed), placed);
            let read = pace.speed().to_num::<f64>();
            assert!((read - speed).abs() <= 1.0 / 32.0, "{read} for {speed}");
            assert_eq!(pace.placed(), placed);
        }
        assert!(Pace::of(Q16::MIN, true).speed() < Q16::from_num(-511));
    }

    #[test]
    fn the_place_is_the_record_s_and_the_way_gone_after_it() {
        let pace = Pace::of(Q16::from_num(-40), true);
        let flight = Flight { tick: 900, position: Q16::from_num(30), pace, ..EMPTY };
        let restart = |reset, crash| Restart { reset, flight: Some(flight), crash };
        let at = |restart: Restart| {
            restart.place().map(|place| (place.position.to_num::<f64>(), place.sure))
        };
        let near = |restart, mm: f64, sure| {
            let (position, told) = at(restart).expect("a place");
            assert!((position - mm).abs() < 1e-3 && told == sure, "{restart}: {position}");
        };
        near(restart(Reset::Pin, None), 29.92, true);
        near(restart(Reset::Watchdog, None), 30.0 - 40.0 * 0.102, false);
        let crash = |stopped| Some(Crash { build: 1, stopped });
        let hang = |at| crash(Stopped::Hang { pc: 0, lr: 0, late: Late::TICK, at });
        near(restart(Reset::Watchdog, hang(900)), 29.92, true);
        near(restart(Reset::Watchdog, hang(975)), 30.0 - 40.0 * 0.077, false);
        near(restart(Reset::Software, crash(Stopped::Panic { place: 1, line: 2 })), 29.92, true);
        let lost = Flight { pace: Pace::of(Q16::from_num(-40), false), ..flight };
        assert_eq!(Restart { flight: Some(lost), ..restart(Reset::Pin, None) }.place(), None);
        let held = Flight { fault: 123, ..flight };
        assert_eq!(Restart { flight: Some(held), ..restart(Reset::Pin, None) }.place(), None);
        let stopped = Flight { fault: Fault::EmergencyStop.code(), ..flight };
        near(Restart { flight: Some(stopped), ..restart(Reset::Pin, None) }, 29.92, true);
        assert_eq!(Restart { flight: None, ..restart(Reset::Power, None) }.place(), None);
    }

    #[test]
    fn the_last_fault_is_kept_beyond_its_hold() {
        let mut recorder = Recorder::default();
        let mut row =
            Telemetry { at: 5, level: 2, position: Q16::from_num(41), ..Telemetry::EMPTY };
        assert_eq!(recorder.flight(&row, true, Late::NOBODY).mode(), Some(Mode::Boot));
        row.mode = Mode::Run(Direction::Deploy, Leg::Crossing);
        let flight = recorder.flight(&row, true, Late::TICK);
        assert_eq!((flight.mode(), flight.fault), (Some(row.mode), 0));
        assert_eq!((flight.tick, flight.level, flight.position), (5, 2, row.position));
        assert_eq!(flight.late, Late::TICK);
        row.mode = Mode::FaultHold(Fault::DriveStalled);
        assert_eq!(recorder.flight(&row, false, Late::NOBODY).mode(), Some(row.mode));
        row.mode = Mode::Idle;
        let flight = recorder.flight(&row, false, Late::NOBODY);
        assert!(!flight.pace.placed());
        assert_eq!((flight.mode(), flight.fault), (Some(Mode::Idle), 122));
    }

    #[test]
    fn a_report_names_what_is_known() {
        let restart = Restart { reset: Reset::Power, flight: None, crash: None };
        assert_eq!(restart.to_string(), "started: power came up");
        let flight = Flight { tick: 9, mode: 6, level: 1, fault: 122, late: Late::TICK, ..EMPTY };
        let stopped = Stopped::Hang { pc: 16, lr: 32, late: Late::STARVED, at: 80 };
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
