//! What the drive was doing, kept every tick.

use serde::{Deserialize, Serialize};

use super::{FLIGHT_WORDS, Late, check};
use crate::estimate::PositionConfidence;
use crate::log::number;
use crate::supervise::Mode;
use crate::tick::Telemetry;
use crate::units::{Millimetres, MillimetresPerSecond, Q16, Tick};

/// Reference of the speed in a tick, signed outwards, in 1/32 mm/s, and in the last bit
/// whether the position was more than a guess.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pace(pub(super) i16);

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
    /// Sleeve level, and [`UNSURE`](Self::UNSURE).
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
    /// Added to the level if the position may be off, and no step has confirmed it; and by
    /// every start until its first tick, as nobody knows for how long the drive then stands
    /// unwatched.
    pub const UNSURE: u8 = 0x80;

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
    /// What is to be kept of a tick, in which the position was to be trusted so far.
    pub fn flight(&mut self, row: &Telemetry, trust: PositionConfidence, late: Late) -> Flight {
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
            level: row.level | if trust == PositionConfidence::Unsure { Flight::UNSURE } else { 0 },
            fault: self.fault,
            late,
            pace: Pace::of(row.speed_ref, trust != PositionConfidence::Guess),
        }
    }
}
