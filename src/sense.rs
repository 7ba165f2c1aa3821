//! From raw codes to checked quantities, each with its time and [`Validity`]. A sensor that
//! falls silent or answers with errors keeps its last good value, which ages; it never delays
//! the tick.
//!
//! # A new sensor
//! Log, columns, messages of the loop, faults of a scenario and images follow from its line in
//! `sensors` in `src/sense/raw.rs`. Beside it, for a converter's code that is logged:
//! 1. `src/board/pins.rs` (its driver) and `src/main.rs` (its task); with a converter of its own
//!    `src/board.rs` (its interrupt) and `src/board/registers.rs`;
//! 2. `hil-sim/src/plant/sensors.rs`: what it measures, its code, its noise;
//! 3. `hil-sim/board/src/chip/pins.rs`: its pin on the emulated board.
//!
//! One that the controller uses has its parameters in `src/rig.rs`, its quantity in
//! `src/sense/senses.rs`, and the faults of a silent one in `src/fault.rs`,
//! `src/supervise/monitor.rs` and `docs/MODES.md`.

pub mod analog;
pub mod angle;
pub mod arm;
pub mod freshness;
pub mod raw;
mod senses;
pub mod speed;

pub use freshness::{Reading, Reason, Validity};
pub use senses::{FILTER_LAG, SensedState, Senses, SensesState, Tuning, Zeros};
