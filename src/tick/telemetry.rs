//! The controller's state as one row a tick.

use crate::estimate::ContactStage;
use crate::supervise::Mode;
use crate::units::{Duty, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Tick};

/// Passes the quantities of a row to the macro `$then`, behind what else it is given: each with its
/// text, field and unit, its column in tables and the type there, the stage of the tick that gives
/// it, and, if a plot of the report shows it, that plot and the name of its curve.
///
/// Their order is that in frames.
#[macro_export]
macro_rules! quantities {
    ($then:ident $($given:tt)*) => {
        $then! { $($given)*
            /// Estimated axial position of the wheel centre, mm.
            position: Millimetres, position_mm: f64, "odometry";
            /// One sigma of it, mm; none, in the log 32767, while no landmark bears it out.
            position_sigma: Millimetres, position_sigma_mm: Option<f64>, "odometry";
            /// Estimated speed of the wheel, mm/s.
            speed: MillimetresPerSecond, wheel_speed_mm_s: f64, "sensing", "speed" "estimated";
            /// Speed reference, asked for by the profile, mm/s.
            speed_ref: MillimetresPerSecond, speed_ref_mm_s: f64, "schedule", "speed" "reference";
            /// Measured preload, N.
            preload: Newtons, preload_n: f64, "sensing", "preload" "measured";
            /// Preload reference, N.
            preload_ref: Newtons, preload_ref_n: f64, "schedule", "preload" "reference";
            /// Measured tread compression, mm.
            compression: Millimetres, compression_mm: f64, "sensing", "compression" "measured";
            /// Wheel centre's distance from the pillar axis by the arm angle, mm.
            radius: Millimetres, radius_mm: f64, "sensing", "radius" "from the arm angle";
            /// Gap predicted for the step ahead, mm.
            gap_predicted: Millimetres, gap_predicted_mm: f64, "plan";
            /// Friction left unused, by the model for the present contact.
            slip_margin: Ratio, slip_margin: f64, "schedule", "slip margin" "planned";
            /// Amplitude of the arm's mode, mm: its largest since the latest approach began.
            vibration: Millimetres, vibration_mm: f64, "vibration";
            /// Distance to the next face, mm; none, in the log 32767, when no face is left.
            distance: Millimetres, distance_mm: Option<f64>, "contact";
        }
    };
}

/// Declares the row.
macro_rules! telemetry {
    ($($(#[$doc:meta])* $field:ident: $unit:ty, $column:ident: $cell:ty, $stage:literal
        $(, $plot:literal $curve:literal)?;)*) => {
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
            /// Columns of the quantities, in the order of their declaration.
            pub const COLUMNS: &[&str] = &[$(stringify!($column)),*];
            /// Number of quantities.
            pub const QUANTITIES: usize = Self::COLUMNS.len();

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
crate::quantities!(telemetry);
