//! From the set of parameters to what the tasks run on.

use embassy_executor::Spawner;
use embassy_futures::block_on;
use embassy_time::Timer;
use interstage::hal::{Indicator, Light, Motors};
use interstage::log::{Identity, identity};
use interstage::model::Planner;
use interstage::params::service::{Service, in_force};
use interstage::params::slots::mend;
use interstage::params::{ParameterSet, SetError};
use interstage::tick::Controller;
use interstage::units::MotorCommand;
use static_cell::StaticCell;

use super::{ParameterFlash, Parts, image};

/// Parameter set in the image: the prototype, written by `rig-study constants`.
static PROTOTYPE: &[u8] = include_bytes!("../params/prototype.set");

static CONTROLLER: StaticCell<Controller> = StaticCell::new();
static PLANNER: StaticCell<Planner> = StaticCell::new();

/// What the tasks run on, and the head of the binary log.
pub(crate) type Constants = (&'static Controller, &'static Planner, Identity);

/// Controller and planner of the set in force, at their final place, and the service that can
/// replace the set. Call once.
///
/// A stored set that is damaged or that the firmware cannot run is not replaced by another one:
/// the drive would move by parameters that nobody chose.
pub(crate) fn build(
    mut flash: ParameterFlash,
) -> (Result<Constants, SetError>, Service<ParameterFlash>) {
    if block_on(mend(&mut flash)).is_err() {
        defmt::error!("parameters: what a lost supply left could not be erased");
    }
    let Ok((_, set)) = in_force(&flash, PROTOTYPE) else {
        return (Err(SetError::Damaged), Service::new(flash, PROTOTYPE, 0));
    };
    let running = ParameterSet::open_any(set).map_or(0, |set| set.header().parameters);
    (constants(set), Service::new(flash, PROTOTYPE, running))
}

#[inline(never)]
fn constants(set: &[u8]) -> Result<Constants, SetError> {
    let set = ParameterSet::open(set)?;
    let controller = CONTROLLER.init_with(Controller::default);
    let rest = set.read_controller(controller)?;
    let planner = PLANNER.init_with(Planner::default);
    rest.read_planner(planner)?;
    let header = set.header();
    defmt::info!(
        "rig {=str}, schema {=u16}, parameters {=u32:08x}, calibration {=u32:08x}",
        header.name.as_str(),
        header.schema,
        header.parameters,
        header.calibration
    );
    let identity = Identity {
        schema: identity::SCHEMA,
        version: identity::text(env!("CARGO_PKG_VERSION")),
        build: image::id(),
        rig: header.name.clone(),
        parameters: header.parameters,
        calibration: header.calibration,
        corner: controller.corner_reach(),
    };
    Ok((controller, planner, identity))
}

/// Why the drive stays off.
#[derive(Clone, Copy)]
pub(crate) enum HoldReason {
    /// A bit of the image has flipped: the code is no longer the tested one.
    Image,
    /// The chip's option bytes make one bank of its flash.
    OneBank,
    /// No controller can be read from the parameters.
    Parameters(SetError),
}

pub(crate) fn hold(threads: Spawner, parts: Parts, why: HoldReason) {
    threads.spawn(stay_off(parts, why).unwrap());
}

/// The other parts are left as they are until the next start.
#[embassy_executor::task]
async fn stay_off(mut parts: Parts, why: HoldReason) -> ! {
    parts.motors.apply(MotorCommand::OFF, MotorCommand::OFF);
    parts.light.show(Light::Alarm);
    loop {
        match why {
            HoldReason::Image => image::log_damaged(),
            HoldReason::OneBank => defmt::error!(
                "flash: one bank (option byte DBANK = 0); set it by `STM32_Programmer_CLI -c \
                 port=SWD -ob DBANK=1`, then flash the image again"
            ),
            HoldReason::Parameters(error @ SetError::Schema { found }) => {
                defmt::error!("parameters: {=str}, {=u16}", error.sentence(), found);
            }
            HoldReason::Parameters(error) => {
                defmt::error!("parameters: {=str}", error.sentence());
            }
        }
        Timer::after_secs(1).await;
    }
}
