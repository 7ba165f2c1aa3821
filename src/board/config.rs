//! From the rig's parameters to what the tasks run on.

use embassy_time::Timer;
use interstage::control::Controller;
use interstage::hal::{Indicator, Light, MotorCommand, Motors, Parts};
use interstage::log::{Identity, identity};
use interstage::model::Planner;
use interstage::rig::{Rig, RigError};
use static_cell::StaticCell;

use super::{Nucleo, journal};

static CONTROLLER: StaticCell<Controller> = StaticCell::new();
static PLANNER: StaticCell<Planner> = StaticCell::new();

/// Controller and planner for the prototype, in place for good. Call once.
pub(crate) fn build() -> Result<(&'static Controller, &'static Planner), RigError> {
    let rig = Rig::prototype();
    let controller = place(&CONTROLLER, Controller::try_build, &rig)?;
    let planner = place(&PLANNER, Planner::try_build, &rig)?;
    Ok((controller, planner))
}

/// What the binary log begins with.
pub(crate) fn identity(controller: &Controller, build: [u8; 8]) -> Identity {
    let rig = Rig::prototype();
    Identity {
        schema: identity::SCHEMA,
        version: identity::text(env!("CARGO_PKG_VERSION")),
        build,
        rig: identity::text("prototype"),
        parameters: identity::fingerprint(&rig),
        calibration: identity::fingerprint(&rig.sense),
        corner: controller.corner_reach(),
    }
}

/// Builds one of them in a frame of its own and moves it once: these frames are
/// the deepest the stack ever sees. Inlined into the caller they would add up, and
/// `init` with `?` keeps two more copies of the value.
#[inline(never)]
fn place<T>(
    cell: &'static StaticCell<T>,
    try_build: fn(&Rig) -> Result<T, RigError>,
    rig: &Rig,
) -> Result<&'static T, RigError> {
    let place = cell.uninit();
    match try_build(rig) {
        Ok(value) => Ok(place.write(value)),
        Err(error) => Err(error),
    }
}

/// No controller can be built from the parameters: stays off and says so.
#[embassy_executor::task]
pub(crate) async fn hold(mut parts: Parts<Nucleo>, error: RigError) -> ! {
    parts.motors.apply(MotorCommand::OFF, MotorCommand::OFF);
    parts.light.show(Light::Alarm);
    loop {
        journal::rig_error(&error);
        Timer::after_secs(1).await;
    }
}
