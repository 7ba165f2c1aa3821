//! The controller's state as one row a tick.

use crate::estimate::ContactStage;
use crate::supervise::Mode;
use crate::units::{Duty, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Tick};

/// Declares the row: each quantity has one line, and its position in the binary log is that of
/// the line.
macro_rules! telemetry {
    ($($(#[$doc:meta])* $field:ident: $unit:ty,)*) => {
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
            /// Number of quantities.
            pub const QUANTITIES: usize = [$(stringify!($field)),*].len();

            /// The quantities, in the order of their declaration.
            pub const fn quantities(&self) -> [Q16; Self::QUANTITIES] {
                [$(self.$field),*]
            }

            /// The row with these quantities.
            pub const fn with_quantities(mut self, all: [Q16; Self::QUANTITIES]) -> Self {
                [$(self.$field),*] = all;
                self
            }
        }
    };
}

telemetry! {
    /// Estimated axial position, mm.
    position: Millimetres,
    /// Estimated speed, mm/s.
    speed: MillimetresPerSecond,
    /// Speed asked for by the profile, mm/s.
    speed_ref: MillimetresPerSecond,
    /// Measured preload, N.
    preload: Newtons,
    /// Preload asked for, N.
    preload_ref: Newtons,
    /// Measured tread compression, mm.
    compression: Millimetres,
    /// Wheel centre's distance from the pillar axis, from the arm angle, mm.
    radius: Millimetres,
    /// Gap predicted for the step ahead, mm.
    gap_predicted: Millimetres,
    /// Friction left unused, by the model for the present contact.
    slip_margin: Ratio,
    /// Amplitude of the arm's mode: its largest since the approach to the latest step
    /// began, mm.
    vibration: Millimetres,
    /// Distance to the next corner touch, mm; 32767 when none is expected.
    distance: Millimetres,
}
