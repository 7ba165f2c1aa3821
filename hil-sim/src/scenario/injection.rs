//! One fault of a scenario: target, kind, onset, duration, magnitude.

mod catalogue;

use serde::{Deserialize, Serialize};

pub use catalogue::{CATALOGUE, Entry, HARDWARE, STEPS, entry, restarts};
use interstage::sense::raw::SensorId;

use crate::table::label;

/// When a fault begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Onset {
    /// Time since boot, s.
    Time(f64),
    /// True axial position that the wheel comes to, mm.
    Position(f64),
    /// The touch of this crossing's corner, counted from 1 over the run.
    Crossing(u8),
}

/// A fault of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Injection {
    pub target: Target,
    pub kind: Kind,
    /// Onset: time since boot, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_s: Option<f64>,
    /// Onset: true position, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_mm: Option<f64>,
    /// Onset: touch of this crossing, counted from 1 over the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_crossing: Option<u8>,
    /// Duration, s; permanent if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Magnitude in the unit of the catalogue, which has the default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnitude: Option<f64>,
}

impl Injection {
    /// A permanent fault from `at_s` on.
    pub const fn at(target: Target, kind: Kind, at_s: f64, magnitude: f64) -> Self {
        Self {
            target,
            kind,
            at_s: Some(at_s),
            at_mm: None,
            at_crossing: None,
            duration_s: None,
            magnitude: Some(magnitude),
        }
    }

    /// Whether it resets the board, at once or by the watchdog.
    pub const fn resets_board(&self) -> bool {
        self.target.resets_board(self.kind)
    }

    /// The onset; time 0 if there is none.
    pub fn from(&self) -> Onset {
        match (self.at_s, self.at_mm, self.at_crossing) {
            (_, Some(mm), _) => Onset::Position(mm),
            (_, _, Some(crossing)) => Onset::Crossing(crossing),
            (at_s, ..) => Onset::Time(at_s.unwrap_or(0.0)),
        }
    }

    /// Magnitude; by default that of the catalogue.
    pub fn magnitude(&self) -> f64 {
        let usual = entry(self.target, self.kind).map_or(0.0, |entry| entry.magnitude);
        self.magnitude.unwrap_or(usual)
    }

    /// In words; its time also from the command, as that of a report, if there was one.
    pub fn words(&self, commanded_s: Option<f64>) -> String {
        let unit = entry(self.target, self.kind).map_or("", |entry| entry.unit);
        let size = if unit.is_empty() { "" } else { &format!(" ({} {unit})", self.magnitude()) };
        let onset = match (self.from(), commanded_s) {
            (Onset::Time(s), Some(from)) => format!("{} s ({s} s from boot)", label(s - from, 3)),
            (Onset::Time(s), None) => format!("{s} s"),
            (Onset::Position(mm), _) => format!("{mm} mm"),
            (Onset::Crossing(n), _) => format!("crossing {n}"),
        };
        let end = self.duration_s.map_or(String::new(), |s| format!(" for {s} s"));
        format!("{} {}{size} from {onset}{end}", self.target.name(), self.kind.name())
    }
}

/// What breaks; the catalogue describes each fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Target {
    /// Converter that reads the outputs of both bridges.
    Readback,
    DriveReadback,
    PretightenerReadback,
    /// Drive motor or its bridge.
    Drive,
    /// Pre-tightener's motor or its bridge.
    Pretightener,
    /// Grip of the wheel.
    Wheel,
    /// Rubber of the wheel.
    Tread,
    Spring,
    Load,
    Tick,
    Model,
    /// Reader of the log.
    Log,
    Commands,
    /// The controller, which starts again.
    Reset,
    PreloadSensorConverter,
    /// Converter of the compression sensor.
    TreadConverter,
    AngleBus,
    EncoderLineA,
    EncoderLineB,
    Dma,
    /// Timer that wakes the tasks.
    Timer,
    /// The button's interrupt line.
    Interrupt,
    /// The code that the processor executes.
    Processor,
    WheelEncoderTask,
    PreloadSensorTask,
    CompressionSensorTask,
    ArmAngleTask,
    TickTask,
    ModelTask,
    JournalTask,
    LineTask,
    Supply,
    ResetPin,
    Debugger,
    HostLine,
    /// The set of parameters in force, in flash.
    StoredSet,
    /// The one before it, in the other place in flash.
    SpareSet,
    /// The set that the image carries, with nothing stored.
    ImageSet,
    /// A new set while it is written to flash.
    ParameterSave,
    /// The image in flash, after its first start.
    Image,
    Magnet,
    StopWire,
    OptionBytes,
    /// A step of the wall; a scenario has it among its anomalies.
    Step,
    #[serde(untagged)]
    Sensor(SensorId),
}

/// How it breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Gives nothing.
    Off,
    /// Keeps its last value.
    Stuck,
    Garbage,
    Gain,
    Offset,
    Slow,
    Delayed,
    /// Fails for a part of every 100 ms.
    Intermittent,
    Stalled,
    /// Keeps a part of its force.
    Weak,
    Reversed,
    /// Moves at full duty whenever its bridge is on.
    Runaway,
    Slip,
    /// A sector is soft; a save is cut by a loss of power.
    Torn,
    Broken,
    Doubled,
    /// Is late, so that ticks are lost.
    Overrun,
    Hung,
    Gone,
    Flooding,
    Random,
    BitErrors,
    Reset,
    /// Starts again with its record.
    Recorded,
    Regulating,
    Disturbed,
    OneWrongBit,
    TwoWrongBits,
    Halted,
    Shorted,
    Early,
    Late,
    Missing,
    Higher,
}

/// The name of a word of the scenario.
fn word(value: impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}

impl Target {
    pub(crate) fn name(self) -> String {
        word(self)
    }

    /// Whether it is a sensor, or the readback of a bridge or of both.
    pub(crate) const fn is_sensor(self) -> bool {
        use Target::{DriveReadback, PretightenerReadback, Readback, Sensor};
        matches!(self, Sensor(_) | Readback | DriveReadback | PretightenerReadback)
    }

    /// Whether such a fault of it resets the board, at once or by the watchdog.
    pub(crate) const fn resets_board(self, kind: Kind) -> bool {
        match self {
            Self::ResetPin | Self::Processor => true,
            Self::Debugger => matches!(kind, Kind::Reset),
            Self::Supply => !matches!(kind, Kind::Weak),
            _ => false,
        }
    }

    /// Whether it is a set of parameters that is read at a start.
    pub const fn is_of_sets(self) -> bool {
        matches!(self, Self::StoredSet | Self::SpareSet | Self::ImageSet | Self::ParameterSave)
    }

    /// Whether it is memory that is read at a start.
    pub const fn is_of_start(self) -> bool {
        self.is_of_sets() || matches!(self, Self::OptionBytes)
    }
}

impl Kind {
    /// Whether a fault of an actuator lies in its bridge or before it, so that the bridge
    /// puts out another duty than it was given. The others lie behind: in motor and gear.
    pub(crate) const fn is_in_bridge(self) -> bool {
        use Kind::{Delayed, Off, Regulating, Reversed, Runaway, Stuck};
        matches!(self, Off | Stuck | Reversed | Delayed | Runaway | Regulating)
    }

    pub(crate) fn name(self) -> String {
        word(self)
    }
}
