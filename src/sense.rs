//! From raw codes to checked quantities, each with its time and [`Validity`]. A sensor that
//! falls silent or answers with errors keeps its last good value, which ages; it never delays
//! the tick.

pub mod analog;
pub mod angle;
pub mod arm;
pub mod freshness;
pub mod raw;
mod senses;
pub mod speed;

pub use freshness::{Reading, Reason, Validity};
pub use senses::{FILTER_LAG, SensedState, Senses, SensesState, Tuning};
