//! From raw codes to checked quantities, each with its time and [`Validity`]. A sensor that
//! falls silent or answers with errors keeps its last good value, which ages; it never delays
//! the tick.
//!
//! # A new sensor
//! Follow `compression_sensor` from the pin to the log. In this order the compiler names the next
//! place:
//! 1. `src/sense/raw.rs` (code), `src/rig.rs` with presets and ranges, `src/sense/senses.rs`
//!    (quantity, validity, age).
//! 2. `src/tasks/{sensors,exchange,liveness}.rs`: the task, its slot, its place in `PERIODS` and in
//!    the names of `src/restart/snapshot.rs`. Sensor tasks come first in `TaskId`, in the order of
//!    `PERIODS`.
//! 3. `src/board/pins.rs` and `src/board.rs` (driver and part), the same for the host's loop in
//!    `src/hal/hil.rs` and `src/board/hil/`, `src/main.rs` (task).
//! 4. `src/fault.rs`, `src/supervise/{monitor,startup}.rs`, `docs/MODES.md`: the fault of a stale
//!    reading.
//! 5. `src/log/{record,delta,identity}.rs` and the columns (`hil-sim/src/record/tick.rs`); `SCHEMA`
//!    of the parameters where a set changes.
//! 6. `hil-sim/src/plant/{rig,sensors,spread,draw}.rs` (truth, code, noise),
//!    `session/closed_loop.rs`, `hil/run.rs`, `injector/sensor.rs`, `scenario/injection`.
//! 7. The emulated board's input in `hil-sim/board/src/{chip,bench,fault_injector}.rs` and
//!    `hil-sim/images/src/tick.rs`; the recorded runs.

pub mod analog;
pub mod angle;
pub mod arm;
pub mod freshness;
pub mod raw;
mod senses;
pub mod speed;

pub use freshness::{Reading, Reason, Validity};
pub use senses::{FILTER_LAG, SensedState, Senses, SensesState, Tuning, Zeros};
