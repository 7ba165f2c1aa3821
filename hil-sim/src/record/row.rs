//! One row a tick: the controller's inputs and outputs, and the plant's truth beside them.
//!
//! The fields of [`Columns`] and [`TrueState`] are the columns of CSV, MCAP and JSON; serde
//! derives their names, order and schema.
//!
//! A new column of the plant is a field of [`TrueState`]. One of the controller is a line of
//! `quantities` in `src/tick/telemetry.rs` and its value in `src/tick/report.rs`. It changes the
//! layout of the log: record the runs in `hil-sim/tests/data` again.

use documented::DocumentedFields;
use interstage::log::{Flags, Record, codes};
use interstage::sense::raw::{AngleFrame, BridgeCode, BridgeCodes, Sample, SensorFrame, SensorId};
use interstage::supervise::Mode;
use interstage::tick::Telemetry;
use interstage::units::{Duty, Q16};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use super::columns::{
    ANGLE, Cell, Column, angle_error, angle_frame, bit, mode_column, stage_column,
};
use super::summary::nan;
use crate::plant::rig::Truth;

/// Names of the numbers in `Columns::mode`.
pub const MODE_NAMES: [&str; 14] = [
    "boot",
    "self-test",
    "zero",
    "idle",
    "preload",
    "cruise",
    "approach",
    "crossing",
    "settle",
    "stopping",
    "complete",
    "fault hold",
    "off",
    "service",
];
/// The number of the mode in which the preload builds before the motion.
pub(crate) const PRELOADS: u8 = 4;
/// Those in which the drive moves, and of these those at a step.
pub(crate) const MOVES: std::ops::Range<u8> = 5..10;
pub(crate) const CROSSES: std::ops::Range<u8> = 7..9;
const FAULT_HOLD: u8 = 11;
/// The number of a tick in which the controller did not run.
pub(crate) const OFF: u8 = 12;
const SERVICE: u8 = 13;

/// Names of the contact stages, from number 1.
pub(crate) const STAGE_NAMES: [&str; 6] =
    ["initial", "preloaded", "static friction", "sliding", "rolling", "continuous"];

/// Index of a mode into [`MODE_NAMES`].
pub(crate) fn mode_number(mode: Mode) -> u8 {
    split(mode).0
}

/// A mode in words, with its direction and the code of a fault that is held.
pub(crate) fn mode_words(mode: Mode) -> String {
    match mode {
        Mode::FaultHold(fault) => format!("{}, {}", mode.words(), fault.code()),
        _ => mode.words().to_owned(),
    }
}

/// Name of a contact stage's number.
pub(crate) fn stage_name(stage: u8) -> &'static str {
    STAGE_NAMES.get(usize::from(stage).wrapping_sub(1)).copied().unwrap_or("unknown stage")
}

/// First of the retracting modes in the firmware's numbers, and their offset from those that
/// deploy.
const RETRACTING: (u8, u8) = (11, 7);
/// The service mode in the firmware's numbers, behind the modes with a direction.
const SERVING: u8 = 18;
/// First code of a fault.
const FAULT: u8 = 101;

/// Number, whether it retracts, code of the fault that is held.
fn split(mode: Mode) -> (u8, bool, u8) {
    match codes::of_mode(mode) {
        fault @ FAULT.. => (FAULT_HOLD, false, fault),
        SERVING => (SERVICE, false, 0),
        code if code >= RETRACTING.0 => (code - RETRACTING.1, true, 0),
        code => (code, false, 0),
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// The controller's inputs and outputs.
    #[serde(flatten)]
    pub controller: Columns,
    /// The plant's truth, if there is a plant.
    #[serde(flatten)]
    pub truth: Option<TrueState>,
}

impl<'de> Deserialize<'de> for Row {
    /// Reads both halves from one object: `flatten` would lose every number if another crate
    /// of the build enables `arbitrary_precision` of `serde_json`.
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let row = serde_json::Value::deserialize(from)?;
        let controller = Columns::deserialize(&row).map_err(D::Error::custom)?;
        let truth = row.get("position_true_mm").map(|_| TrueState::deserialize(&row));
        Ok(Self { controller, truth: truth.transpose().map_err(D::Error::custom)? })
    }
}

/// One in the format of a duty.
const DUTY: f64 = 32_768.0;

macro_rules! with_quantities {
    ($($sensors:tt)*) => { interstage::quantities!(controller { $($sensors)* }); };
}

/// Declares the columns of sensors and quantities, and what is made of them.
macro_rules! controller {
    ({ $($(#[$about:meta])* $id:ident $called:literal $fault:literal, $period:literal:
        $code:ident $(($error:ident))?, $at:ident;)* }
    $($(#[$doc:meta])* $field:ident: $unit:ty, $column:ident: $cell:ty, $stage:literal
        $(, $plot:literal $curve:literal)?;)*) => {
        /// The controller's sensor codes, estimates and outputs.
        ///
        /// Every quantity is exact: the controller's fixed-point numbers are multiples of 2^-16,
        /// which an `f64` represents. What is unknown, or absent in a log, is `NaN`.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, DocumentedFields)]
        #[serde(default)]
        pub struct Columns {
            /// Ticks since boot, 1 ms each.
            pub tick: u32,
            /// Time since boot, s.
            pub t_s: f64,
            /// Mode, by its number and in tables by name.
            #[serde(with = "mode_column")]
            pub mode: u8,
            /// The mode is one of retraction.
            #[serde(with = "bit")]
            pub retracts: bool,
            /// Code of the fault that is held; 0 for none.
            pub fault: u8,
            /// Contact stage, by its number from 1 to 6 and in tables by name.
            #[serde(with = "stage_column")]
            pub stage: u8,
            /// Sleeve level: 0 at the outermost wall.
            pub level: u8,
            $(
                $(#[$about])* pub $code: Option<u16>,
                $(
                    /// What is wrong with its frame: 0 nothing, 1 the sensor's error flag is set,
                    /// 2 the parity is odd, 3 both.
                    pub $error: u8,
                )?
                /// When it was taken, ticks; none before the first.
                pub $at: Option<u32>,
            )*
            /// Code of the drive's bridge, 12 bits, 2048 without voltage; none if none was taken.
            pub drive_code: Option<u16>,
            /// Code of the pre-tightener's bridge.
            pub pretightener_code: Option<u16>,
            /// Number of the command that was given, from 1; 0 for none.
            pub command: u8,
            /// All other inputs and outputs of the tick as bits of `Flags`.
            pub flags: u16,
            $($(#[$doc])* pub $column: $cell,)*
            /// Duty of the drive, -1 to 1.
            pub drive_duty: f64,
            /// Duty of the pre-tightener, -1 to 1.
            pub pretightener_duty: f64,
            /// The drive's bridge is on.
            #[serde(with = "bit")]
            pub drive_on: bool,
            /// The pre-tightener's bridge is on.
            #[serde(with = "bit")]
            pub pretightener_on: bool,
        }

        impl Columns {
            /// The quantities, in the order of their columns.
            pub(crate) const QUANTITIES: &[Column] = &[$(Column {
                name: stringify!($column),
                stage: $stage,
                curve: [$(Some(($plot, $curve)),)? None][0],
                of: |row| row.$column.quantity().map_or(f64::NAN, Q16::to_num),
            }),*];

            /// A tick that did not run, or is not in the log.
            pub(crate) fn unknown(tick: u32) -> Self {
                Self {
                    tick,
                    t_s: f64::from(tick) * 1e-3,
                    mode: OFF,
                    $($column: Cell::UNKNOWN,)*
                    drive_duty: f64::NAN,
                    pretightener_duty: f64::NAN,
                    ..Self::of(&Record::default(), &SensorFrame::default())
                }
            }

            /// The columns of a record and of the codes that the tick used.
            pub(crate) fn of(record: &Record, sensors: &SensorFrame) -> Self {
                let Record { telemetry: seen, flags, .. } = record;
                let (mode, retracts, fault) = split(seen.mode);
                let arm = sensors.get(SensorId::ArmAngle, AngleFrame::new);
                let code = |sensor| {
                    let mask = if sensor == SensorId::ArmAngle { ANGLE } else { u16::MAX };
                    sensors[sensor].map(|sample| sample.code & mask)
                };
                Self {
                    tick: seen.at,
                    t_s: f64::from(seen.at) * 1e-3,
                    mode,
                    retracts,
                    fault,
                    stage: seen.stage as u8,
                    level: seen.level,
                    $(
                        $code: code(SensorId::$id),
                        $($error: arm.map_or(0, |sample| angle_error(sample.code)),)?
                        $at: sensors[SensorId::$id].map(|sample| sample.at),
                    )*
                    drive_code: sensors.bridges.map(|codes| codes.drive.get()),
                    pretightener_code: sensors.bridges.map(|codes| codes.pretightener.get()),
                    command: codes::of_command(flags.command()),
                    flags: flags.0,
                    $($column: Cell::of(seen.$field),)*
                    drive_duty: f64::from(seen.drive.to_bits()) / DUTY,
                    pretightener_duty: f64::from(seen.pretightener.to_bits()) / DUTY,
                    drive_on: flags.has(Flags::DRIVE),
                    pretightener_on: flags.has(Flags::PRELOAD),
                }
            }

            /// The controller's sensor codes.
            pub(crate) fn sensors(&self) -> SensorFrame {
                let bridges = self.drive_code.zip(self.pretightener_code);
                let mut frame = SensorFrame::default();
                $(
                    let taken = self.$code.zip(self.$at);
                    frame[SensorId::$id] = taken.map(|(code, at)| Sample {
                        code: [$(angle_frame(code, self.$error).get(),)? code][0],
                        at,
                    });
                )*
                frame.bridges = bridges.map(|(drive, pretightener)| BridgeCodes {
                    drive: BridgeCode::new(drive),
                    pretightener: BridgeCode::new(pretightener),
                });
                frame
            }

            /// The controller's state in its own numbers, where the log lacks a quantity that of
            /// `absent`; none if mode or contact stage is invalid.
            pub(crate) fn telemetry_over(&self, absent: &Telemetry) -> Option<Telemetry> {
                let duty = |value: f64| Duty::from_bits((value * DUTY).round() as i16);
                Some(Telemetry {
                    at: self.tick,
                    mode: self.mode()?,
                    stage: codes::stage(self.stage)?,
                    level: self.level,
                    $($field: self.$column.quantity().unwrap_or(absent.$field),)*
                    drive: duty(self.drive_duty),
                    pretightener: duty(self.pretightener_duty),
                })
            }
        }
    };
}
interstage::sensors!(with_quantities);

impl Default for Columns {
    fn default() -> Self {
        Self::unknown(0)
    }
}

impl Columns {
    /// All other inputs and outputs of the tick.
    pub(crate) const fn flags(&self) -> Flags {
        Flags(self.flags)
    }

    /// The mode; none if the numbers are invalid.
    pub(crate) fn mode(&self) -> Option<Mode> {
        let code = match (self.mode, self.retracts) {
            (FAULT_HOLD, _) => self.fault,
            (SERVICE, false) => SERVING,
            (number, _) if number > FAULT_HOLD => return None,
            (number, true) => number + RETRACTING.1,
            (number, false) => number,
        };
        codes::mode(code).filter(|mode| split(*mode).0 == self.mode)
    }

    /// The controller's state in its own numbers.
    pub fn telemetry(&self) -> Option<Telemetry> {
        self.telemetry_over(&Telemetry::default())
    }
}

/// The plant's truth at a tick, before it moves. A column that another version's log lacks is
/// `NaN`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, DocumentedFields)]
pub struct TrueState {
    /// Axial position of the wheel centre, mm.
    pub position_true_mm: f64,
    /// Axial speed, mm/s.
    #[serde(default = "nan")]
    pub speed_true_mm_s: f64,
    /// Radial preload, N.
    #[serde(default = "nan")]
    pub preload_true_n: f64,
    /// Distance of the wheel centre from the pillar axis, mm.
    #[serde(default = "nan")]
    pub radius_true_mm: f64,
    /// Compression of the tread where its sensor looks, mm.
    #[serde(default = "nan")]
    pub compression_true_mm: f64,
    /// Clearance of the nearest step's root from the undeformed wheel, mm; NaN away from a step.
    #[serde(default = "nan")]
    pub root_clearance_mm: f64,
    /// Force of the step's corner and face on the wheel, N.
    #[serde(default = "nan")]
    pub corner_force_n: f64,
    /// Force of the lower wall on the wheel, N.
    #[serde(default = "nan")]
    pub floor_force_n: f64,
    /// Friction utilisation, traction over normal force.
    #[serde(default = "nan")]
    pub utilisation: f64,
    /// Friction left unused: mu minus utilisation.
    #[serde(default = "nan")]
    pub slip_margin_true: f64,
    /// Gross slip so far, mm.
    #[serde(default = "nan")]
    pub slip_mm: f64,
    /// Deflection of the arm by its modes, um.
    #[serde(default = "nan")]
    pub vibration_true_um: f64,
}

impl From<&Truth> for TrueState {
    fn from(truth: &Truth) -> Self {
        Self {
            position_true_mm: truth.position_mm,
            speed_true_mm_s: truth.speed_mm_s,
            preload_true_n: truth.preload_n,
            radius_true_mm: truth.radius_mm,
            compression_true_mm: truth.compression_mm,
            root_clearance_mm: truth.root_clearance_mm.unwrap_or(f64::NAN),
            corner_force_n: truth.corner_n,
            floor_force_n: truth.floor_n,
            utilisation: truth.utilisation,
            slip_margin_true: truth.friction - truth.utilisation.abs(),
            slip_mm: truth.slip_mm,
            vibration_true_um: truth.vibration_mm * 1e3,
        }
    }
}

impl Row {
    /// A tick of zeros, which shows the form of each column.
    pub(super) fn example(with_truth: bool) -> Self {
        let controller = Columns::of(&Record::default(), &SensorFrame::default());
        Self { controller, truth: with_truth.then(TrueState::default) }
    }

    /// A true quantity; `NaN` without truth.
    pub fn of_truth(&self, of: impl Fn(&TrueState) -> f64) -> f64 {
        self.truth.as_ref().map_or(f64::NAN, of)
    }

    /// A true quantity, or where there is no truth the controller's.
    pub(crate) fn known(
        &self,
        truth: impl Fn(&TrueState) -> f64,
        controller: impl Fn(&Columns) -> f64,
    ) -> f64 {
        self.truth.as_ref().map_or_else(|| controller(&self.controller), truth)
    }

    /// Axial position, mm: the true one, or by odometry where there is none.
    pub fn position_mm(&self) -> f64 {
        self.known(|truth| truth.position_true_mm, |seen| seen.position_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interstage::fault::Fault;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_tick_keeps_every_bit(
            quantities in any::<[i32; Telemetry::QUANTITIES]>(),
            [drive, pretightener] in any::<[i16; 2]>(),
        ) {
            let telemetry = Telemetry {
                at: 77,
                drive: Duty::from_bits(drive),
                pretightener: Duty::from_bits(pretightener),
                ..Telemetry::default()
            }
            .with_quantities(quantities.map(Q16::from_bits));
            let record = Record { telemetry, ..Record::default() };
            let controller = Columns::of(&record, &SensorFrame::default());
            prop_assert_eq!(controller.telemetry(), Some(telemetry));
            // JSON keeps it too.
            let tick = Row { controller, truth: None };
            let text = serde_json::to_string(&tick).unwrap();
            prop_assert_eq!(serde_json::from_str::<Row>(&text).unwrap(), tick);
        }
    }

    #[test]
    fn no_face_ahead_is_no_number() {
        let telemetry = Telemetry { distance: Q16::MAX, ..Telemetry::default() };
        let record = Record { telemetry, ..Record::default() };
        let tick = Columns::of(&record, &SensorFrame::default());
        assert_eq!(tick.distance_mm, None);
        assert_eq!(tick.telemetry(), Some(telemetry));
    }

    #[test]
    fn of_an_unknown_tick_only_the_time_is_a_number() {
        let columns = |tick: Columns| serde_json::to_value(tick).unwrap();
        let known = columns(Row::example(false).controller);
        let unknown = columns(Columns::unknown(5));
        let numbers = known.as_object().unwrap().iter().filter(|(_, value)| value.is_f64());
        assert!(numbers.clone().count() > Telemetry::QUANTITIES, "{known}");
        for (name, _) in numbers {
            assert_eq!(unknown[name].is_null(), name != "t_s", "{name}");
        }
    }

    #[test]
    fn every_mode_has_a_name_and_comes_back() {
        let held = Fault::ALL.into_iter().map(Mode::FaultHold);
        for mode in Mode::WITHOUT_FAULT.map(|(mode, _)| mode).into_iter().chain(held) {
            let (number, retracts, fault) = split(mode);
            let tick = Columns { mode: number, retracts, fault, ..Columns::default() };
            assert_eq!(tick.mode(), Some(mode));
            let name = MODE_NAMES[usize::from(number)][..4].replace('-', "");
            assert!(format!("{mode:?}").to_lowercase().contains(&name));
        }
        for (mode, retracts) in [(OFF, false), (3, true), (FAULT_HOLD, false), (200, true)] {
            let tick = Columns { mode, retracts, ..Columns::default() };
            assert_eq!(tick.mode(), None, "{mode}");
        }
        assert_eq!((stage_name(0), stage_name(6)), ("unknown stage", "continuous"));
    }
}
