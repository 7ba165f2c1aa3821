//! The controller's state as one row a tick.

use crate::estimate::ContactStage;
use crate::supervise::Mode;
use crate::units::{Duty, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Tick};

/// Declares the row. Each quantity has one line with its unit and column name; field, position
/// in the binary log and column come from it.
macro_rules! telemetry {
    ($($(#[$doc:meta])* $field:ident: $unit:ty = $column:literal,)*) => {
        /// All control-rate quantities of one tick.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct Telemetry {
            /// Tick of the row.
            pub at: Tick,
            /// Mode after the tick.
            pub mode: Mode,
            /// Contact stage.
            pub stage: ContactStage,
            /// Sleeve level: 0 at the outermost wall, one more per step.
            pub level: u8,
            /// Drive duty.
            pub drive: Duty,
            /// Pre-tightener duty.
            pub pretightener: Duty,
            $($(#[$doc])* pub $field: $unit,)*
        }

        impl Telemetry {
            /// Columns of the quantities, in the order of [`quantities`](Self::quantities).
            pub const COLUMNS: [&'static str; [$($column),*].len()] = [$($column),*];


            /// The quantities, in the order of their declaration.
            pub const fn quantities(&self) -> [Q16; Self::COLUMNS.len()] {
                [$(self.$field),*]
            }

            /// The row with these quantities.
            pub const fn with_quantities(mut self, all: [Q16; Self::COLUMNS.len()]) -> Self {
                [$(self.$field),*] = all;
                self
            }
        }
    };
}

telemetry! {
    /// Estimated axial position, mm.
    position: Millimetres = "position_mm",
    /// Estimated speed, mm/s.
    speed: MillimetresPerSecond = "speed_mm_s",
    /// Speed asked for by the profile, mm/s.
    speed_ref: MillimetresPerSecond = "speed_ref_mm_s",
    /// Measured preload, N.
    preload: Newtons = "preload_n",
    /// Preload asked for, N.
    preload_ref: Newtons = "preload_ref_n",
    /// Measured tread compression, mm.
    compression: Millimetres = "compression_mm",
    /// Wheel centre's distance from the pillar axis, from the arm angle, mm.
    radius: Millimetres = "radius_mm",
    /// Gap predicted for the step ahead, mm.
    gap_predicted: Millimetres = "gap_predicted_mm",
    /// Friction left unused, by the model for the present contact.
    slip_margin: Ratio = "slip_margin",
    /// Amplitude of the arm's mode: its largest since the approach to the latest step
    /// began, mm.
    vibration: Millimetres = "vibration_mm",
    /// Distance to the next corner touch, mm; 32767 when none is expected.
    distance: Millimetres = "distance_mm",
}
