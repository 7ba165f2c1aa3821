//! What a start knows of the run before.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::{Crash, DriveSnapshot, PackedSpeed, Stopped};
use crate::estimate::Place;
use crate::fault::{Fault, worded};
use crate::units::{Millimetres, Tick, ticks_to_seconds};

worded! {
    /// Reason of a start, by the chip.
    Reset, sentence:
    /// Power came up, or fell too low and came back.
    Power "power came up";
    Pin "by the reset pin";
    Software "by software or debugger";
    Watchdog "by the watchdog";
    Other "for a reason that the chip does not tell";
}

/// What a start reports of the run before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restart {
    /// Why the chip started.
    pub reset: Reset,
    /// The last snapshot, if memory kept it.
    pub snapshot: Option<DriveSnapshot>,
    /// What stopped the program, if something did.
    pub crash: Option<Crash>,
}

/// Ticks for which the wheel keeps its speed after the record: the rest of the tick, and the
/// coasting, in which the gears halve the speed each ms.
const COASTS: Tick = 2;

/// Ticks from the watchdog's last feeding to its reset.
const UNFED: Tick = 100;

/// Longest time without a record after which the position is still sure, ticks.
const FRESH: Tick = 5;

impl Restart {
    /// Whether the program hung with interrupts masked: nothing could record the task.
    pub const fn interrupts_masked(&self) -> bool {
        matches!(self.reset, Reset::Watchdog) && self.crash.is_none()
    }

    /// Position of the wheel, if the record gives it.
    ///
    /// A reset switches the bridges off at once, a panic or a hard fault before it is recorded;
    /// then the wheel coasts by a tenth of a millimetre. If the tick hung, the drive went on at
    /// its last duty until the bridges were cut or the watchdog bit: at about the last
    /// reference, for a known time. Without a supply the gears hold the wheel, but not against
    /// a hand. After a fault that may concern the position, the record gives none.
    #[inline(never)]
    pub fn place(&self) -> Option<Place> {
        let snapshot = self
            .snapshot
            .filter(|snapshot| snapshot.packed_speed.placed() && spared(snapshot.fault))?;
        let stopped = self.crash.map(|crash| crash.stopped);
        // For an unknown time since the record.
        let without_supply = self.reset == Reset::Power || stopped == Some(Stopped::Supply);
        let unwatched = match (self.reset, stopped) {
            (_, Some(Stopped::Hang { at, .. })) => at.wrapping_sub(snapshot.tick).min(UNFED),
            (Reset::Watchdog, None) => UNFED,
            _ => 0,
        };
        let travel = snapshot.packed_speed.speed() * ticks_to_seconds(unwatched + COASTS);
        Some(Place {
            position: snapshot.position + travel,
            sure: unwatched <= FRESH && !without_supply && snapshot.level < DriveSnapshot::UNSURE,
            zeros: snapshot.packed_zeros.zeros(),
        })
    }

    /// What a start keeps of it until the first tick, for a reset that comes before: the wheel
    /// at rest, unless it is moved.
    pub fn at_start(&self) -> Option<DriveSnapshot> {
        let mut snapshot = self.snapshot?;
        if let Some(place) = self.place() {
            snapshot.position = place.position;
            snapshot.packed_speed = PackedSpeed::of(Millimetres::ZERO, true);
        }
        snapshot.level |= DriveSnapshot::UNSURE;
        Some(snapshot)
    }
}

/// Whether the position is valid despite this fault: none, or one that does not concern the
/// wheel's travel.
fn spared(code: u16) -> bool {
    const OTHERS: [Fault; 11] = [
        Fault::PreloadSensorStale,
        Fault::CompressionSensorStale,
        Fault::PreloadSensorRange,
        Fault::CompressionSensorRange,
        Fault::PreloadSensorImplausible,
        Fault::CompressionSensorImplausible,
        Fault::Overpressure,
        Fault::PreloadNotReached,
        Fault::PretightenerRunaway,
        Fault::EmergencyStop,
        Fault::TickOverrun,
    ];
    code == 0 || OTHERS.iter().any(|fault| fault.code() == code)
}

impl fmt::Display for Restart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "started: {}", self.reset.sentence())?;
        if let Some(crash) = &self.crash {
            write!(f, "; {}", crash.stopped)?;
        }
        if self.interrupts_masked() {
            f.write_str("; a hang with interrupts shut out")?;
        }
        if let Some(snapshot) = &self.snapshot {
            let DriveSnapshot { tick, position, level, fault, missed, .. } = *snapshot;
            match snapshot.mode() {
                Some(mode) => write!(f, "; before: {}", mode.words())?,
                None => write!(f, "; before: mode {}", snapshot.mode)?,
            }
            let level = level & !DriveSnapshot::UNSURE;
            let (s, ms) = (tick / 1000, tick % 1000);
            write!(f, " at {s}.{ms:03} s, {position:.2} mm, level {level}")?;
            if fault != 0 {
                write!(f, ", last fault {fault}")?;
            }
            if !missed.is_nobody() {
                write!(f, ", {} was late", missed.name())?;
            }
            if snapshot.level >= DriveSnapshot::UNSURE {
                f.write_str(", its place unsure")?;
            }
        }
        Ok(())
    }
}
