//! From raw codes to checked quantities, each with its time and [`Validity`]. A sensor that falls
//! silent or answers with errors keeps its last good value, which ages; it never delays the tick.
//!
//! # A new sensor
//! Task, log, columns, messages of the loop, faults of a scenario and images follow from its entry
//! in `sensors` in `src/sense/raw.rs`. One at a converter of its own, whose code is logged, is in
//! four files, in six if it measures what the plant does not have yet:
//! 1. `src/sense/raw.rs`: its entry, the last, and its place in
//!    [`SensorId::ANALOG`](raw::SensorId::ANALOG);
//! 2. `src/board/pins.rs`: converter, pin, DMA channel and interrupt;
//! 3. `hil-sim/src/plant/sensors.rs`: what it measures, its code, its noise;
//! 4. `hil-sim/board/src/chip/pins.rs`: its pin on the emulated board, which has ADC1 to ADC4;
//! 5. `hil-sim/src/plant/truth.rs` and `hil-sim/src/plant/rig/truth.rs`: the quantity.
//!
//! Tests ask for its columns in `docs/LOGGING.md`, for the runs in `hil-sim/tests/data` again, and for
//! their own numbers of sensors. All sensors share one stream of noise: the runs of a seed change.
//! A bus or counter of another kind has a driver in `src/board/pins/`, a part in `src/board.rs`, a
//! task in `src/tasks/sensors.rs` and `src/main.rs`, and a model on the emulated board.
//!
//! One that the controller uses is read in less than 20 ms (`rig.sense.stale_after_s`). It has its
//! parameters in `src/rig.rs` and `src/rig/`, which a new `SCHEMA` in `src/params/set.rs` names, its
//! quantity in `src/sense/senses.rs`, and the faults of a silent one in `src/fault.rs`,
//! `src/supervise/monitor.rs`, `docs/MODES.md` and the catalogue of `hil-sim/src/scenario/injection/`.

pub mod analog;
pub mod angle;
pub mod arm;
pub mod freshness;
pub mod raw;
mod senses;
pub mod speed;

pub use freshness::{Reading, Reason, Validity};
pub use senses::{FILTER_LAG, FILTER_S, SensedState, Senses, SensesState, Zeros};
