//! What the drive was doing in a tick.

use serde::{Deserialize, Serialize};

use super::{SNAPSHOT_WORDS, check};
use crate::sense::Zeros;
use crate::sense::raw::SensorId;
use crate::supervise::{Mode, codes};
use crate::units::{Millimetres, MillimetresPerSecond, Q16, Tick};

/// Speed reference of a tick, signed outwards, in 1/32 mm/s; the last bit is whether the
/// position was better than a guess.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackedSpeed(pub(super) i16);

impl PackedSpeed {
    /// Bits of a speed that are cut.
    const COARSER: u32 = 11;

    /// From a speed, mm/s, saturating at half a metre a second.
    pub fn of(speed: MillimetresPerSecond, placed: bool) -> Self {
        let most = i32::from(i16::MAX >> 1);
        let speed = (speed.to_bits() >> Self::COARSER).clamp(-most, most);
        Self((speed << 1) as i16 | i16::from(placed))
    }

    /// The speed, mm/s.
    pub fn speed(self) -> MillimetresPerSecond {
        Q16::from_bits((i32::from(self.0) >> 1) << Self::COARSER)
    }

    /// Whether the position was better than a guess.
    pub const fn placed(self) -> bool {
        self.0 & 1 != 0
    }
}

/// Zeros of preload and compression sensor, in 1/256 N and 1/16384 mm, saturating: 128 N and 2 mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackedZeros(pub(super) i16, pub(super) i16);

impl PackedZeros {
    /// Bits that are cut.
    const COARSER: (u32, u32) = (8, 2);

    /// From the zeros.
    pub fn of(zeros: Zeros) -> Self {
        let pack = |value: Q16, cut: u32| {
            (value.to_bits() >> cut).clamp(i16::MIN.into(), i16::MAX.into()) as i16
        };
        Self(pack(zeros.preload, Self::COARSER.0), pack(zeros.compression, Self::COARSER.1))
    }

    /// The zeros.
    pub fn zeros(self) -> Zeros {
        let unpack = |bits: i16, cut: u32| Q16::from_bits(i32::from(bits) << cut);
        let (force, depth) = Self::COARSER;
        Zeros { preload: unpack(self.0, force), compression: unpack(self.1, depth) }
    }
}

/// Tasks that had not checked in when the watchdog was no longer fed, one bit a task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissedCheckIns(pub u16);

impl MissedCheckIns {
    /// All tasks have checked in.
    pub const NOBODY: Self = Self(0);
    /// The control tick began and did not end.
    pub const TICK: Self = Self(1 << 14);
    /// The control tick did not start: something of higher priority keeps the processor.
    pub const STARVED: Self = Self(1 << 15);

    /// The task of this number, by [`TaskId`](crate::tasks::TaskId).
    pub const fn task(index: usize) -> Self {
        Self(1 << (index & 0xF))
    }

    /// The tasks of both.
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all tasks have checked in.
    pub const fn is_nobody(self) -> bool {
        self.0 == 0
    }

    /// Name of the first task.
    pub fn name(self) -> &'static str {
        match self.0.trailing_zeros() as usize {
            16 => "nobody",
            15 => "the control tick, kept from the processor",
            14 => "the control tick",
            // After these the operators' tasks and the host's line, in the order of their start.
            bit => {
                let mut names = SensorId::NAMES.iter().chain(&["model", "journal"]);
                names.nth(bit).copied().unwrap_or("an operator's task or the host's line")
            }
        }
    }
}

/// What the drive was doing in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DriveSnapshot {
    /// The tick.
    pub tick: Tick,
    /// Estimated axial position, mm.
    pub position: Millimetres,
    /// Mode, by [`codes::mode`].
    pub mode: u8,
    /// Sleeve level, and [`UNSURE`](Self::UNSURE).
    pub level: u8,
    /// Code of the last fault since the start, 0 for none.
    pub fault: u16,
    /// Tasks that had not checked in.
    pub missed: MissedCheckIns,
    /// Speed reference, and whether the position was better than a guess.
    pub packed_speed: PackedSpeed,
    /// Zeros of the analogue sensors.
    pub packed_zeros: PackedZeros,
}

impl DriveSnapshot {
    /// Seed of its check.
    const SEED: u32 = 0xF11E_0001;
    /// Added to the level if the position may be off and no step has confirmed it; and by every
    /// start until its first tick, as the wheel may be moved unobserved before that.
    pub const UNSURE: u8 = 0x80;

    /// As words.
    pub fn seal(&self) -> [u32; SNAPSHOT_WORDS] {
        let state = u32::from(self.mode) | u32::from(self.level) << 8 | u32::from(self.fault) << 16;
        let missed = u32::from(self.missed.0) | u32::from(self.packed_speed.0 as u16) << 16;
        let [a, b, c, d] = [self.tick, self.position.to_bits() as u32, state, missed];
        let PackedZeros(preload, compression) = self.packed_zeros;
        let e = u32::from(preload as u16) | u32::from(compression as u16) << 16;
        [a, b, c, d, e, check(Self::SEED, &[a, b, c, d, e])]
    }

    /// From words, if they are intact.
    pub fn open(words: &[u32; SNAPSHOT_WORDS]) -> Option<Self> {
        let [tick, position, state, missed, zeros, sum] = *words;
        (check(Self::SEED, &[tick, position, state, missed, zeros]) == sum).then_some(Self {
            tick,
            position: Q16::from_bits(position as i32),
            mode: state as u8,
            level: (state >> 8) as u8,
            fault: (state >> 16) as u16,
            missed: MissedCheckIns(missed as u16),
            packed_speed: PackedSpeed((missed >> 16) as i16),
            packed_zeros: PackedZeros(zeros as i16, (zeros >> 16) as i16),
        })
    }

    /// The mode; none if the number has no meaning.
    pub fn mode(&self) -> Option<Mode> {
        codes::mode(self.mode)
    }
}

/// The later of two.
pub fn later(one: Option<DriveSnapshot>, other: Option<DriveSnapshot>) -> Option<DriveSnapshot> {
    let later = |a: &DriveSnapshot, b: &DriveSnapshot| b.tick.wrapping_sub(a.tick) as i32 > 0;
    one.into_iter().chain(other).reduce(|a, b| if later(&a, &b) { b } else { a })
}
