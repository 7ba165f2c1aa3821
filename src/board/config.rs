//! From the set of parameters to what the tasks run on.

use embassy_executor::Spawner;
use embassy_time::Timer;
use interstage::hal::{Indicator, Light, Motors, Parts};
use interstage::log::{Identity, identity};
use interstage::model::Planner;
use interstage::params::service::{Service, in_force};
use interstage::params::{Header, ParameterSet, SetError};
use interstage::tick::Controller;
use interstage::units::MotorCommand;
use static_cell::StaticCell;

use super::{Bridges, Lamp, Nucleo, Pages, image};

/// The set that the image carries: the prototype, written by `rig-study constants`.
static PROTOTYPE: &[u8] = include_bytes!("../params/prototype.set");

static CONTROLLER: StaticCell<Controller> = StaticCell::new();
static PLANNER: StaticCell<Planner> = StaticCell::new();

/// What the tasks run on, and what the binary log begins with.
pub(crate) type Constants = (&'static Controller, &'static Planner, Identity);

/// Controller and planner of the set in force, in place for good, and the service that
/// can replace it. Call once.
///
/// A stored set that the firmware cannot run, or that is damaged, is not passed over for
/// another one: the drive would move by parameters that nobody chose.
pub(crate) fn build(pages: Pages) -> (Result<Constants, SetError>, Service<Pages>) {
    let Ok((_, set)) = in_force(&pages, PROTOTYPE) else {
        return (Err(SetError::Damaged), Service::new(pages, PROTOTYPE, 0));
    };
    let running = ParameterSet::open_any(set).map_or(0, |set| set.header().parameters);
    (constants(set), Service::new(pages, PROTOTYPE, running))
}

#[inline(never)]
fn constants(set: &[u8]) -> Result<Constants, SetError> {
    let set = ParameterSet::open(set)?;
    let controller = CONTROLLER.init_with(Controller::default);
    let rest = set.controller_into(controller)?;
    let planner = PLANNER.init_with(Planner::default);
    rest.planner_into(planner)?;
    announce(set.header());
    Ok((controller, planner, identity(set.header(), controller)))
}

fn identity(header: &Header, controller: &Controller) -> Identity {
    Identity {
        schema: identity::SCHEMA,
        version: identity::text(env!("CARGO_PKG_VERSION")),
        build: image::id(),
        rig: header.name.clone(),
        parameters: header.parameters,
        calibration: header.calibration,
        corner: controller.corner_reach(),
    }
}

/// Which parameters these are, for whoever reads the log.
fn announce(header: &Header) {
    defmt::info!(
        "rig {=str}, schema {=u16}, parameters {=u32:08x}, calibration {=u32:08x}",
        header.name.as_str(),
        header.schema,
        header.parameters,
        header.calibration
    );
}

/// Why the drive stays off.
#[derive(Clone, Copy)]
pub(crate) enum Held {
    /// A bit of the image has turned over: what would run is not what was tested.
    Image,
    /// No controller can be read from the parameters.
    Parameters(SetError),
}

/// Has the drive stay off, and says why.
pub(crate) fn hold(threads: Spawner, parts: Parts<Nucleo>, why: Held) {
    let Parts {
        motors,
        light,
        wheel_encoder,
        preload_sensor,
        compression_sensor,
        arm_angle,
        watchdog,
        button,
        console,
        journal,
    } = parts;
    // As they are until the next start: to switch them off would be code for nothing.
    core::mem::forget((
        wheel_encoder,
        preload_sensor,
        compression_sensor,
        arm_angle,
        watchdog,
        button,
        console,
        journal,
    ));
    threads.spawn(stay_off(motors, light, why).unwrap());
}

#[embassy_executor::task]
async fn stay_off(mut motors: Bridges, mut light: Lamp, why: Held) -> ! {
    motors.apply(MotorCommand::OFF, MotorCommand::OFF);
    light.show(Light::Alarm);
    loop {
        match why {
            Held::Image => image::say_damaged(),
            Held::Parameters(error @ SetError::Schema { found }) => {
                defmt::error!("parameters: {=str}, {=u16}", error.sentence(), found);
            }
            Held::Parameters(error) => defmt::error!("parameters: {=str}", error.sentence()),
        }
        Timer::after_secs(1).await;
    }
}
