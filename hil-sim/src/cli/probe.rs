//! The board at a real debug probe.

use std::time::Duration;

use super::failure::Failure;
use crate::probe::{PortError, RealPort, ReconnectingPort};

/// Time between two attempts to find a probe again.
const PAUSE: Duration = Duration::from_millis(500);
/// Longest time without it.
const PATIENCE: Duration = Duration::from_secs(120);

/// Attaches to the board, whose channels' control block lies at `block` if that is known.
pub(super) fn attach(block: Option<u32>) -> Result<RealPort, Failure> {
    RealPort::attach(block).map_err(missing)
}

/// The same, connected again whenever the probe was unplugged.
pub(super) fn reconnecting() -> Result<ReconnectingPort<'static>, Failure> {
    ReconnectingPort::open(|| Ok(Box::new(RealPort::attach(None)?)), PAUSE, PATIENCE)
        .map_err(missing)
}

/// A probe that is missing at the start is bad input.
fn missing(error: PortError) -> Failure {
    Failure::input(format!("--target probe: {error}"))
}
